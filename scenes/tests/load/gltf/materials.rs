//! Materials and textures of glTF models.

use halflight_scenes::{Scene, SceneNeeds};
use image::{ImageFormat, Rgb, RgbImage, Rgba, RgbaImage};

use super::maker::{Maker, ONE_NODE, bare, encoded, triangle, with_images, with_material};
use crate::assert_warns;

#[test]
fn materials_become_albedo_and_gloss() {
    let pbr = |pbr: &str| with_material(&format!(r#""pbrMetallicRoughness":{{{pbr}}}"#), "").materials[0].clone();
    // A rough metal, which is the default, is diffuse.
    let rough = pbr(r#""baseColorFactor":[0.5,0.25,0,1]"#);
    assert_eq!((rough.albedo, rough.specular, rough.phong_exponent), ([0.5, 0.25, 0.0], [0.0; 3], 0.0));
    let plastic = pbr(r#""baseColorFactor":[0.5,0.25,0,1],"metallicFactor":0,"roughnessFactor":0.5"#);
    assert_eq!((plastic.albedo, plastic.specular, plastic.phong_exponent), ([0.5, 0.25, 0.0], [0.02; 3], 30.0));
    let mirror = pbr(r#""baseColorFactor":[0.5,0.25,0,1],"metallicFactor":1,"roughnessFactor":0"#);
    assert_eq!((mirror.albedo, mirror.specular, mirror.phong_exponent), ([0.0; 3], [0.5, 0.25, 0.0], 1e6));
    let strong = with_material(
        r#""emissiveFactor":[1,0.5,0],"extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":20}}"#,
        r#","extensionsUsed":["KHR_materials_emissive_strength"]"#,
    );
    assert_eq!((strong.materials[0].emission, strong.lights.len()), ([20.0, 10.0, 0.0], 0));
    let other = with_material(
        r#""extensions":{"KHR_materials_pbrSpecularGlossiness":{"diffuseFactor":[0.5,0.5,0,1],"specularFactor":[0.5,0.25,0],"glossinessFactor":0.5}}"#,
        r#","extensionsUsed":["KHR_materials_pbrSpecularGlossiness"]"#,
    );
    let other = &other.materials[0];
    assert_eq!((other.albedo, other.specular, other.phong_exponent), ([0.5, 0.5, 0.0], [0.25, 0.125, 0.0], 30.0));
}

#[test]
fn what_materials_lose_is_told() {
    for (material, used, parts) in [
        (
            r#""extensions":{"KHR_materials_unlit":{}}"#,
            "KHR_materials_unlit",
            ["without lighting", "KHR_materials_unlit"],
        ),
        (
            r#""extensions":{"KHR_materials_clearcoat":{}}"#,
            "KHR_materials_clearcoat",
            ["not drawn", "KHR_materials_clearcoat"],
        ),
        (
            r#""alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.5]}"#,
            "",
            ["constant transparency", "opaque"],
        ),
    ] {
        let used = if used.is_empty() { String::new() } else { format!(r#","extensionsUsed":["{used}"]"#) };
        assert_warns(&with_material(material, &used), &["m.glb:", parts[0], parts[1]]);
    }
    let normal = encoded(RgbImage::from_pixel(1, 1, Rgb([128, 128, 255])), ImageFormat::Png);
    let scene = with_images(r#""normalTexture":{"index":0}"#, &[(&normal, "png")], r#"{"source":0}"#);
    assert_warns(&scene, &["m.glb:", "normal maps"]);
}

#[test]
fn masks_are_cut_at_their_cutoff() {
    let image = RgbaImage::from_fn(3, 1, |x, _| Rgba([200, 100, 50, [50, 100, 200][x as usize]]));
    let png = encoded(image, ImageFormat::Png);
    let scene = |material: &str| {
        let pbr = r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0}}"#;
        with_images(&format!("{pbr},{material}"), &[(&png, "png")], r#"{"source":0}"#)
    };
    // Texels are absent where the alpha is under 128.
    let absent = |scene: &Scene| {
        let texture = &scene.textures[scene.materials[0].alpha_texture.expect("a mask")];
        texture.rgba.chunks(4).map(|texel| texel[3] < 128).collect::<Vec<_>>()
    };
    for (material, wanted) in [
        (r#""alphaMode":"MASK""#, [true, true, false]),
        (r#""alphaMode":"MASK","alphaCutoff":0.25"#, [true, false, false]),
        (r#""alphaMode":"MASK","alphaCutoff":0.9"#, [true, true, true]),
        (r#""alphaMode":"BLEND""#, [true, true, false]),
    ] {
        let scene = scene(material);
        assert_eq!(absent(&scene), wanted, "{material}");
        assert!(SceneNeeds::of(&scene).alpha_tested);
        assert_eq!(scene.warnings.len(), usize::from(material.contains("BLEND")));
    }
    assert_eq!(scene(r#""alphaMode":"OPAQUE""#).materials[0].alpha_texture, None);
}

#[test]
fn textures_are_transformed_and_webp_is_read() {
    let webp = encoded(RgbaImage::from_pixel(1, 1, Rgba([10, 20, 30, 255])), ImageFormat::WebP);
    let material = r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0,
        "extensions":{"KHR_texture_transform":{"offset":[0.5,0.25],"scale":[2,4]}}}}"#;
    let texture = r#"{"extensions":{"EXT_texture_webp":{"source":0}}}"#;
    let scene = with_images(material, &[(&webp, "webp")], texture);
    assert_eq!(scene.warnings, [""; 0]);
    assert_eq!(scene.textures[0].rgba, [10, 20, 30, 255]);
    assert_eq!(scene.meshes[0].uvs, [[0.5, 0.25], [2.5, 0.25], [0.5, 4.25]]);
    // A texture in a format that is not read.
    let scene = with_images(
        r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0}}"#,
        &[(b"basis", "ktx2")],
        r#"{"extensions":{"KHR_texture_basisu":{"source":0}}}"#,
    );
    assert_eq!(scene.materials[0].albedo_texture, None);
    assert_warns(&scene, &["m.glb:", "KHR_texture_basisu", "left out"]);
    // A broken image is a checker, as in an OBJ file.
    let scene =
        with_images(r#""pbrMetallicRoughness":{"baseColorTexture":{"index":0}}"#, &[(b"x", "png")], r#"{"source":0}"#);
    assert_warns(&scene, &["m.glb", "`m`", "cannot be decoded", "checker"]);
}

#[test]
fn borders_that_do_not_repeat_are_told_where_they_show() {
    let png = encoded(RgbImage::from_pixel(1, 1, Rgb([1, 2, 3])), ImageFormat::Png);
    let material = |scale: &str| {
        format!(
            r#""pbrMetallicRoughness":{{"baseColorTexture":{{"index":0,"extensions":{{"KHR_texture_transform":{{"scale":{scale}}}}}}}}}"#
        )
    };
    let texture = r#"{"source":0,"sampler":0}],"samplers":[{"wrapS":33071}"#;
    let inside = with_images(&material("[1,1]"), &[(&png, "png")], texture);
    assert_eq!(inside.warnings, [""; 0]);
    let outside = with_images(&material("[3,1]"), &[(&png, "png")], texture);
    assert_warns(&outside, &["m.glb:", "clamped or mirrored", "repeated"]);
}

#[test]
fn colours_of_vertices_and_images_of_emission_are_drawn() {
    let mut maker = Maker::default();
    let colours =
        maker.accessor(&[255, 0, 51, 255, 255, 0, 51, 255, 255, 0, 51, 255], 3, "VEC4", 5121, r#","normalized":true"#);
    let meshes = triangle(&mut maker, &format!(r#","COLOR_0":{colours}"#), r#","material":0"#);
    let material = r#""materials":[{"pbrMetallicRoughness":{"baseColorFactor":[0.5,1,1,1],"metallicFactor":0}}]"#;
    let scene = bare(&maker.glb(&format!("{meshes},{ONE_NODE},{material}")));
    assert_eq!((scene.materials[0].albedo, scene.warnings.len()), ([0.5, 0.0, 0.2], 0));

    let black = encoded(RgbImage::from_pixel(1, 1, Rgb([0; 3])), ImageFormat::Png);
    let white = encoded(RgbImage::from_pixel(1, 1, Rgb([255; 3])), ImageFormat::Png);
    let glow = r#""emissiveFactor":[1,0.5,0],"emissiveTexture":{"index":0}"#;
    let scene = with_images(glow, &[(&white, "png")], r#"{"source":0}"#);
    assert_eq!((scene.materials[0].emission, scene.warnings.len()), ([1.0, 0.5, 0.0], 0));
    assert_eq!(with_images(glow, &[(&black, "png")], r#"{"source":0}"#).materials[0].emission, [0.0; 3]);
    // The triangle covers the half u + v < 1 of the image: the upper left half of these four texels.
    let corner = RgbImage::from_fn(2, 2, |x, y| Rgb([if x + y == 0 { 255 } else { 0 }; 3]));
    let scene = with_images(glow, &[(&encoded(corner, ImageFormat::Png), "png")], r#"{"source":0}"#);
    // The white texel is half of the triangle, but for the samples at its border.
    assert!((scene.materials[0].emission[0] - 0.5).abs() < 0.1, "{:?}", scene.materials[0].emission);
    assert_warns(&scene, &["m.glb:", "averaged over each face"]);
}
