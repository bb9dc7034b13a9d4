//! glTF models: geometry, nodes, cameras and lights.

mod animation;
mod damage;
mod maker;
mod materials;

use std::path::Path;

use glam::Vec3;
use halflight_scenes::{Light, MemoryFiles, Mesh, Scene, generators, load_scene, write_obj, write_scene};
use image::{ImageFormat, Rgb, RgbImage};

use crate::{assert_warns, load};
use maker::{Maker, ONE_NODE, bare, data_encoding, encoded, triangle};

/// Meshes with materials of colour and emission as a binary file.
fn written(scene: &Scene) -> Vec<u8> {
    let mut maker = Maker::default();
    let (mut meshes, mut nodes) = (Vec::new(), Vec::new());
    for (i, mesh) in scene.meshes.iter().enumerate() {
        let (positions, normals) = (maker.floats(&mesh.positions), maker.floats(&mesh.normals));
        let (uvs, indices) = (maker.floats(&mesh.uvs), maker.indices(&mesh.indices));
        meshes.push(format!(
            r#"{{"primitives":[{{"attributes":{{"POSITION":{positions},"NORMAL":{normals},"TEXCOORD_0":{uvs}}},"indices":{indices},"material":{}}}]}}"#,
            mesh.material
        ));
        nodes.push(format!(r#"{{"mesh":{i},"name":"{}"}}"#, mesh.name));
    }
    let materials: Vec<_> = scene
        .materials
        .iter()
        .map(|m| {
            let [r, g, b] = m.albedo;
            let strength = m.emission.iter().copied().fold(1.0, f32::max);
            let glow = m.emission.map(|x| x / strength);
            format!(
                r#"{{"name":"{}","pbrMetallicRoughness":{{"baseColorFactor":[{r},{g},{b},1],"metallicFactor":0}},
                "emissiveFactor":{glow:?},"extensions":{{"KHR_materials_emissive_strength":{{"emissiveStrength":{strength}}}}}}}"#,
                m.name
            )
        })
        .collect();
    let all: Vec<_> = (0..nodes.len()).map(|i| i.to_string()).collect();
    maker.glb(&format!(
        r#""extensionsUsed":["KHR_materials_emissive_strength"],"meshes":[{}],"nodes":[{}],"materials":[{}],"scenes":[{{"nodes":[{}]}}]"#,
        meshes.join(","),
        nodes.join(","),
        materials.join(","),
        all.join(",")
    ))
}

#[test]
fn the_same_geometry_as_obj_and_glb_is_equal() {
    let generators::Geometry { meshes, mut materials, textures } = generators::geometry("cornell").expect("it builds");
    // One that glows, with powers of two that no scale rounds.
    materials[0].emission = [4.0, 2.0, 1.0];
    let files: MemoryFiles = write_obj(&meshes, &materials, &textures, "m").expect("valid").into_iter().collect();
    let obj = load_scene(&files, Path::new("m.obj")).expect("it was written");
    let glb = bare(&written(&obj));
    assert_eq!(glb.meshes, obj.meshes);
    assert_eq!(glb.materials, obj.materials);
    assert_eq!((glb.camera, glb.lights, glb.warnings), (obj.camera, obj.lights, obj.warnings));
}

fn positions(mesh: &Mesh) -> Vec<[f32; 3]> {
    mesh.indices.iter().map(|&i| mesh.positions[i as usize]).collect()
}

#[test]
fn nodes_place_instances_and_mirrors_turn_faces() {
    let mut maker = Maker::default();
    let meshes = triangle(&mut maker, "", "");
    let nodes = r#""scenes":[{"nodes":[0,3]}],"nodes":[{"translation":[10,0,0],"children":[1,2]},
        {"mesh":0,"name":"turned","rotation":[0,0,0.70710678,0.70710678],"scale":[2,2,2]},
        {"mesh":0,"name":"mirrored","scale":[-1,1,1]},
        {"mesh":0,"matrix":[0,0,-1,0, 0,1,0,0, 1,0,0,0, 0,5,0,1]}]"#;
    let scene = bare(&maker.glb(&format!("{meshes},{nodes}")));
    let names: Vec<_> = scene.meshes.iter().map(|mesh| mesh.name.as_str()).collect();
    assert_eq!(names, ["turned", "mirrored", "t"]);
    let close = |mesh: &Mesh, wanted: [[f32; 3]; 3], normal: [f32; 3]| {
        for (found, wanted) in positions(mesh).into_iter().zip(wanted) {
            // The quaternion of the file has 8 digits.
            assert!(Vec3::from(found).distance(wanted.into()) < 1e-6, "{found:?} {wanted:?}");
        }
        let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(positions(mesh)[i]));
        let geometric = (b - a).cross(c - a).normalize();
        for found in [geometric, Vec3::from(mesh.normals[0])] {
            assert!(found.distance(normal.into()) < 1e-6, "{found:?} {normal:?}");
        }
    };
    close(&scene.meshes[0], [[10.0, 0.0, 0.0], [10.0, 2.0, 0.0], [8.0, 0.0, 0.0]], [0.0, 0.0, 1.0]);
    // The winding is turned, so that the front stays in front.
    close(&scene.meshes[1], [[10.0, 0.0, 0.0], [10.0, 1.0, 0.0], [9.0, 0.0, 0.0]], [0.0, 0.0, 1.0]);
    close(&scene.meshes[2], [[0.0, 5.0, 0.0], [0.0, 5.0, -1.0], [0.0, 6.0, 0.0]], [1.0, 0.0, 0.0]);
}

#[test]
fn strips_fans_and_every_kind_of_number_are_read() {
    let mut maker = Maker::default();
    let positions = maker.floats(&[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0]]);
    let small = maker.accessor(&[0, 1, 3, 2], 4, "SCALAR", 5121, "");
    let list = maker.accessor(&[0, 0, 1, 0, 2, 0], 3, "SCALAR", 5123, "");
    // Positions as normalized bytes, 4 bytes apart; the last replaced by a sparse part.
    let bytes = [0, 0, 0, 0, 127, 0, 0, 0, 0, 127, 0, 0];
    let view = maker.view(&bytes);
    maker.views[view] = maker.views[view].replace('}', r#","byteStride":4}"#);
    let (at, with) = (maker.view(&[1]), maker.view(&[0, 0, 127, 0]));
    maker.accessors.push(format!(
        r#"{{"bufferView":{view},"count":3,"type":"VEC3","componentType":5120,"normalized":true,"min":[0,0,0],"max":[1,1,1],
        "sparse":{{"count":1,"indices":{{"bufferView":{at},"componentType":5121}},"values":{{"bufferView":{with}}}}}}}"#
    ));
    let quantized = maker.accessors.len() - 1;
    let meshes = format!(
        r#""meshes":[{{"primitives":[
        {{"attributes":{{"POSITION":{positions}}},"mode":5}},
        {{"attributes":{{"POSITION":{positions}}},"mode":6,"indices":{small}}},
        {{"attributes":{{"POSITION":{positions}}},"indices":{list}}},
        {{"attributes":{{"POSITION":{quantized}}}}},
        {{"attributes":{{"POSITION":{positions}}},"mode":1}}]}}]"#
    );
    let scene = bare(&maker.glb(&format!("{meshes},{ONE_NODE}")));
    let triangles: Vec<_> = scene.meshes.iter().map(|mesh| mesh.indices.len() / 3).collect();
    assert_eq!(triangles, [2, 2, 1, 1]);
    // All but the last face +z.
    for mesh in &scene.meshes[..3] {
        assert!(mesh.normals.iter().all(|&normal| normal == [0.0, 0.0, 1.0]));
    }
    let last = self::positions(&scene.meshes[3]);
    assert_eq!(last, [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]);
    assert_warns(&scene, &["m.glb:", "lines and points are not drawn"]);
}

#[test]
fn buffers_and_images_may_be_data_or_files() {
    let mut maker = Maker::default();
    let meshes = triangle(&mut maker, "", r#","material":0"#);
    let png = encoded(RgbImage::from_pixel(2, 1, Rgb([10, 20, 30])), ImageFormat::Png);
    let base64 = data_encoding(&png);
    for (image, buffer) in [
        ("my%20image.png".to_owned(), r#","uri":"my%20data.bin""#.to_owned()),
        (
            format!("data:image/png;base64,{base64}"),
            format!(r#","uri":"data:application/octet-stream;base64,{}""#, data_encoding(&maker.bytes)),
        ),
    ] {
        let json = maker.json(
            &format!(
                r#"{meshes},{ONE_NODE},"materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
                "textures":[{{"source":0}}],"images":[{{"uri":"{image}"}}]"#
            ),
            &buffer,
        );
        let files: [(&str, &[u8]); 3] =
            [("dir/m.gltf", json.as_bytes()), ("dir/my data.bin", &maker.bytes), ("dir/my image.png", &png)];
        let scene = load(&files, "dir/m.gltf");
        assert_eq!(scene.warnings, [""; 0]);
        assert_eq!((scene.textures.len(), &scene.textures[0].rgba[..3]), (1, &[10, 20, 30][..]));
        assert_eq!(scene.meshes[0].uvs, [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    }
}

#[test]
fn cameras_and_lights_are_those_of_the_file() {
    let mut maker = Maker::default();
    let meshes = triangle(&mut maker, "", "");
    let parts = format!(
        r#"{meshes},"extensionsUsed":["KHR_lights_punctual"],"scenes":[{{"nodes":[0,1,2,3,4,5]}}],
        "cameras":[{{"type":"perspective","perspective":{{"yfov":0.5,"znear":0.1}}}}],
        "extensions":{{"KHR_lights_punctual":{{"lights":[
            {{"type":"directional","color":[1,0.5,0],"intensity":4}},{{"type":"point","intensity":8}},
            {{"type":"spot","intensity":2,"spot":{{"innerConeAngle":0.25,"outerConeAngle":0.5}}}}]}}}},
        "nodes":[{{"mesh":0}},{{"camera":0,"translation":[1,2,3]}},{{"camera":0}},
            {{"rotation":[-0.70710678,0,0,0.70710678],"extensions":{{"KHR_lights_punctual":{{"light":0}}}}}},
            {{"translation":[0,3,0],"extensions":{{"KHR_lights_punctual":{{"light":1}}}}}},
            {{"translation":[0,0,4],"extensions":{{"KHR_lights_punctual":{{"light":2}}}}}}]"#
    );
    let glb = maker.glb(&parts);
    let scene = bare(&glb);
    assert_warns(&scene, &["m.glb:", "only the first camera"]);
    let camera = scene.camera;
    assert_eq!((camera.eye, camera.target, camera.up), ([1.0, 2.0, 3.0], [1.0, 2.0, 2.0], [0.0, 1.0, 0.0]));
    assert_eq!(camera.vertical_fov_degrees, 0.5_f32.to_degrees());
    let [Light::Directional { direction, irradiance }, point, spot] = scene.lights[..] else {
        panic!("{:?}", scene.lights)
    };
    // Looking along -z, turned down.
    assert!(Vec3::from(direction).distance(Vec3::NEG_Y) < 1e-6 && irradiance == [4.0, 2.0, 0.0], "{direction:?}");
    assert_eq!(point, Light::Point { position: [0.0, 3.0, 0.0], intensity: [8.0; 3] });
    let wanted = Light::Spot {
        position: [0.0, 0.0, 4.0],
        direction: [0.0, 0.0, -1.0],
        intensity: [2.0; 3],
        half_angle_degrees: 0.5_f32.to_degrees(),
        full_intensity_half_angle_degrees: 0.25_f32.to_degrees(),
    };
    assert_eq!(spot, wanted);
    assert_eq!(scene.environment, None);

    // In a scene file they count unless it has its own; the transform of the model applies to them.
    let toml = "[[model]]\npath = \"m.glb\"\ntransform = { translate = [10, 0, 0], scale = 2 }\n";
    let moved = load(&[("s.toml", toml.as_bytes()), ("m.glb", &glb)], "s.toml");
    assert_eq!((moved.camera.eye, moved.lights.len()), ([12.0, 4.0, 6.0], 3));
    assert_eq!(moved.lights[1], Light::Point { position: [10.0, 6.0, 0.0], intensity: [8.0; 3] });
    assert_eq!(positions(&moved.meshes[0])[1], [12.0, 0.0, 0.0]);
    let own = format!(
        "{toml}[camera]\neye = [0, 0, 9]\ntarget = [0, 0, 0]\n[[light]]\nkind = \"point\"\nposition = [0, 1, 0]\nintensity = [1, 1, 1]\n"
    );
    let own = load(&[("s.toml", own.as_bytes()), ("m.glb", &glb)], "s.toml");
    assert_eq!((own.camera.eye, own.lights.len()), ([0.0, 0.0, 9.0], 1));
    // Saved and read again, nothing is doubled.
    let files: MemoryFiles =
        write_scene(&moved, "again").expect("valid").into_iter().chain([("m.glb".into(), glb)]).collect();
    let again = load_scene(&files, Path::new("again.toml")).expect("it was written");
    assert_eq!((again.lights, again.camera, again.meshes), (moved.lights, moved.camera, moved.meshes));
}

#[test]
fn a_far_model_keeps_its_shape() {
    let mut maker = Maker::default();
    let meshes = triangle(&mut maker, "", "");
    let nodes = r#""scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"translation":[8388608,0,0.5]}]"#;
    let scene = bare(&maker.glb(&format!("{meshes},{nodes}")));
    assert_eq!(scene.origin, [8_388_609.0, 0.0, 0.0]);
    assert_eq!(positions(&scene.meshes[0]), [[-1.0, 0.0, 0.5], [0.0, 0.0, 0.5], [-1.0, 1.0, 0.5]]);
}
