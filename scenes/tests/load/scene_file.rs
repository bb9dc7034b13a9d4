//! TOML scene files, valid and invalid.

use glam::Vec3;
use halflight_scenes::{Camera, Light, Scene, generators};

use crate::{TRIANGLE, assert_says, corners, load, refusal};

const CAMERA: &str = "[camera]\neye = [0, 0, 5]\ntarget = [0, 0, 0]\n";
const MODEL: &str = "[[model]]\npath = \"m.obj\"\n";
const SUN: &str = "[[light]]\nkind = \"directional\"\ndirection = [0, -1, 0]\nirradiance = [1, 1, 1]\n";

fn scene(toml: &str) -> Scene {
    load(&[("dir/s.toml", toml.as_bytes()), ("dir/m.obj", TRIANGLE.as_bytes())], "dir/s.toml")
}

fn refused(toml: &str) -> String {
    refusal(&[("dir/s.toml", toml.as_bytes()), ("dir/m.obj", TRIANGLE.as_bytes())], "dir/s.toml")
}

#[test]
fn every_key_is_read() {
    let read = scene(
        r#"
        name = "nave"
        [[model]]
        path = "m.obj"
        [camera]
        eye = [-620.0, 150.0, -30.0]
        target = [500.0, 280.0, -30.0]
        up = [0.0, 0.0, 1.0]
        vertical_fov_degrees = 45
        [[light]]
        kind = "directional"
        direction = [0.3, -1.0, 0.08]
        irradiance = [10.0, 9.5, 8.5]
        [[light]]
        kind = "spot"
        position = [0.0, 1.95, 0.0]
        direction = [0.15, -1.0, 0.1]
        intensity = [4.0, 3.7, 3.2]
        half_angle_degrees = 40.0
        full_intensity_half_angle_degrees = 35.0
        [[light]]
        kind = "point"
        position = [1, 2, 3]
        intensity = [0, 1, 0]
        "#,
    );
    assert_eq!(read.name, "nave");
    let camera = Camera {
        eye: [-620.0, 150.0, -30.0],
        target: [500.0, 280.0, -30.0],
        up: [0.0, 0.0, 1.0],
        vertical_fov_degrees: 45.0,
    };
    assert_eq!(read.camera, camera);
    let lights = [
        Light::Directional { direction: [0.3, -1.0, 0.08], irradiance: [10.0, 9.5, 8.5] },
        Light::Spot {
            position: [0.0, 1.95, 0.0],
            direction: [0.15, -1.0, 0.1],
            intensity: [4.0, 3.7, 3.2],
            half_angle_degrees: 40.0,
            full_intensity_half_angle_degrees: 35.0,
        },
        Light::Point { position: [1.0, 2.0, 3.0], intensity: [0.0, 1.0, 0.0] },
    ];
    assert_eq!(read.lights, lights);
    assert_eq!(read.triangle_count(), 1);
    assert_eq!(read.environment, None);
}

#[test]
fn numbers_may_have_every_toml_form() {
    let read = scene(&format!("{MODEL}[camera]\neye = [1_000, 0x10, +1_0.5e1]\ntarget = [-0.0, -3, 5e-1]\n{SUN}"));
    assert_eq!((read.camera.eye, read.camera.target), ([1000.0, 16.0, 105.0], [0.0, -3.0, 0.5]));
}

#[test]
fn missing_keys_have_defaults() {
    let read = scene(&format!("{MODEL}{CAMERA}{SUN}"));
    assert_eq!((read.name.as_str(), read.camera.up, read.camera.vertical_fov_degrees), ("s", [0.0, 1.0, 0.0], 60.0));
    let hard = "[[light]]\nkind = \"spot\"\nposition = [0, 1, 0]\ndirection = [0, -1, 0]\nintensity = [1, 1, 1]\nhalf_angle_degrees = 30\n";
    let Light::Spot { full_intensity_half_angle_degrees, .. } = scene(&format!("{MODEL}{CAMERA}{hard}")).lights[0]
    else {
        panic!("not a spot light")
    };
    assert_eq!(full_intensity_half_angle_degrees, 30.0);
    // Without camera and light: as for a bare OBJ file.
    let bare = load(&[("m.obj", TRIANGLE.as_bytes())], "m.obj");
    let automatic = scene(MODEL);
    assert_eq!((automatic.camera, automatic.lights), (bare.camera, bare.lights));
}

#[test]
fn generators_can_be_named() {
    let obj = format!("mtllib m.mtl\nusemtl m\n{TRIANGLE}");
    for &name in generators::NAMES {
        let geometry = generators::geometry(name).expect("every name builds");
        // After a model with its own material and texture.
        let toml = format!("{MODEL}[[model]]\ngenerator = \"{name}\"\n{CAMERA}{SUN}");
        let files: [(&str, &[u8]); 3] =
            [("s.toml", toml.as_bytes()), ("m.obj", obj.as_bytes()), ("m.mtl", b"newmtl m\nmap_Kd gone.png\n")];
        let read = load(&files, "s.toml");
        assert_eq!(read.meshes.len(), 1 + geometry.meshes.len(), "{name}");
        for (mesh, made) in read.meshes[1..].iter().zip(&geometry.meshes) {
            assert_eq!((&mesh.positions, &mesh.indices), (&made.positions, &made.indices));
            let (material, made) = (&read.materials[mesh.material], &geometry.materials[made.material]);
            assert_eq!((&material.name, material.albedo), (&made.name, made.albedo));
            for (index, made) in
                [(material.albedo_texture, made.albedo_texture), (material.alpha_texture, made.alpha_texture)]
            {
                assert_eq!(index.map(|i| &read.textures[i].name), made.map(|i| &geometry.textures[i].name));
            }
        }
    }
    let sentence = refused(&format!("{CAMERA}[[model]]\ngenerator = \"cornel\"\n"));
    assert_says(&sentence, &["dir/s.toml:5:", "`model.generator`", "`cornel`", "`cornell`"]);
    let sentence = refused("[[model]]\ngenerator = \"zzzzzzzzzzzz\"\n");
    assert_says(&sentence, &["dir/s.toml:2:", "`model.generator`", "use ", "`cornell`"]);
}

#[test]
fn the_same_texture_of_two_models_is_loaded_once() {
    let obj = format!("mtllib m.mtl\nusemtl m\n{TRIANGLE}");
    let toml = format!("{MODEL}{MODEL}{CAMERA}{SUN}");
    let files: [(&str, &[u8]); 3] =
        [("s.toml", toml.as_bytes()), ("m.obj", obj.as_bytes()), ("m.mtl", b"newmtl m\nmap_Kd gone.png\n")];
    let read = load(&files, "s.toml");
    assert_eq!((read.materials.len(), read.textures.len(), read.warnings.len()), (2, 1, 1));
    assert_eq!(read.meshes.iter().map(|mesh| mesh.material).collect::<Vec<_>>(), [0, 1]);
}

#[test]
fn transforms_are_baked_in_the_stated_order() {
    // A triangle tilted by 45 degrees about x, so that scaling changes its normal.
    let tilted = "v 0 0 0\nv 1 0 0\nv 0 1 -1\nvn 0 1 1\nf 1//1 2//1 3//1\n";
    let [h, n] = [0.5_f32.sqrt(), 0.2_f32.sqrt()];
    for (transform, positions, normal) in [
        ("translate = [1, 2, 3]", [[1.0, 2.0, 3.0], [2.0, 2.0, 3.0], [1.0, 3.0, 2.0]], [0.0, h, h]),
        // Scaled by 2 in y: the inverse transpose tilts the normal towards z.
        ("scale = [1, 2, 1]", [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2.0, -1.0]], [0.0, n, 2.0 * n]),
        ("scale = 3", [[0.0; 3], [3.0, 0.0, 0.0], [0.0, 3.0, -3.0]], [0.0, h, h]),
        // Mirrored in x: corners 2 and 3 are swapped, so that the winding agrees with the normal.
        ("scale = [-1, 1, 1]", [[0.0; 3], [0.0, 1.0, -1.0], [-1.0, 0.0, 0.0]], [0.0, h, h]),
        ("scale = -1", [[0.0; 3], [0.0, -1.0, 1.0], [-1.0, 0.0, 0.0]], [0.0, -h, -h]),
        ("rotate_degrees = [0, 90, 0]", [[0.0; 3], [0.0, 0.0, -1.0], [-1.0, 1.0, 0.0]], [h, h, 0.0]),
        // x before y: (0, 1, -1) goes to (0, 1, 1), then to (1, 1, 0).
        ("rotate_degrees = [90, 90, 0]", [[0.0; 3], [0.0, 0.0, -1.0], [1.0, 1.0, 0.0]], [h, -h, 0.0]),
        // Scale before rotation before translation.
        (
            "scale = [2, 1, 1]\nrotate_degrees = [0, 0, 90]\ntranslate = [10, 0, 0]",
            [[10.0, 0.0, 0.0], [10.0, 2.0, 0.0], [9.0, 0.0, -1.0]],
            [-h, 0.0, h],
        ),
    ] {
        let toml = format!("{MODEL}[model.transform]\n{transform}\n{CAMERA}{SUN}");
        let read = load(&[("s.toml", toml.as_bytes()), ("m.obj", tilted.as_bytes())], "s.toml");
        let corners: Vec<_> = corners(&read).into_iter().map(|(_, (position, normal, _))| [position, normal]).collect();
        for (corner, wanted) in corners.iter().zip(positions) {
            for (value, wanted) in corner.concat().iter().zip([wanted, normal].concat()) {
                // A few float32 roundings of numbers near 10.
                assert!((value - wanted).abs() < 1e-5, "{transform}: {corners:?}");
            }
        }
        let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(corners[i][0]));
        assert!((b - a).cross(c - a).dot(normal.into()) > 0.0, "{transform}: the winding disagrees with the normal");
    }
}

#[test]
fn unknown_keys_get_the_nearest_name() {
    for (toml, line, parts) in [
        ("nam = \"x\"\n", 1, ["`nam`", "did you mean `name`?"]),
        ("[[modle]]\n", 1, ["`modle`", "did you mean `model`?"]),
        ("[camera]\neye = [0, 0, 1]\nfov_degrees = 50\n", 3, ["`camera.fov_degrees`", "`vertical_fov_degrees`"]),
        (
            "[camera]\nvertical_fov_degree = 50\n",
            2,
            ["`camera.vertical_fov_degree`", "did you mean `vertical_fov_degrees`?"],
        ),
        ("[[model]]\nfile = \"m.obj\"\n", 2, ["`model.file`", "use `path`, `generator`"]),
        ("\n[[light]]\nkind = \"spot\"\nintesity = [1, 1, 1]\n", 4, ["`light.intesity`", "did you mean `intensity`?"]),
        ("[[light]]\nkind = \"point\"\ndirection = [1, 1, 1]\n", 3, ["`light.direction`", "`position`"]),
        ("[[light]]\nkind = \"spot\"\nirradiance = [1, 1, 1]\n", 3, ["`light.irradiance`", "`light.intensity`"]),
        (
            "[[model]]\npath = \"m.obj\"\ntransform = { scale = 1, rotate = [0, 0, 0] }\n",
            3,
            ["`transform.rotate`", "`rotate_degrees`"],
        ),
    ] {
        assert_says(&refused(toml), &[&format!("dir/s.toml:{line}:"), parts[0], parts[1]]);
    }
}

#[test]
fn invalid_values_are_refused_with_line_key_value_and_range() {
    let spot = "[[light]]\nkind = \"spot\"\nposition = [0, 1, 0]\ndirection = [0, -1, 0]\nintensity = [1, 1, 1]\n";
    for (toml, line, parts) in [
        (format!("{CAMERA}vertical_fov_degrees = 0.5\n"), 4, ["`camera.vertical_fov_degrees` is 0.5", "from 1 to 170"]),
        (format!("{CAMERA}vertical_fov_degrees = 171\n"), 4, ["`camera.vertical_fov_degrees` is 171", "from 1 to 170"]),
        (format!("{CAMERA}vertical_fov_degrees = nan\n"), 4, ["`camera.vertical_fov_degrees` is nan", "from 1 to 170"]),
        (format!("{CAMERA}vertical_fov_degrees = \"60\"\n"), 4, ["is \"60\"", "a number"]),
        (format!("{CAMERA}up = [0, 0, 0]\n"), 4, ["`camera.up` is [0, 0, 0]", "not all 0"]),
        ("[camera]\neye = [0, inf, 0]\n".into(), 2, ["`camera.eye` is [0, inf, 0]", "finite"]),
        ("[camera]\neye = [0, 1]\n".into(), 2, ["`camera.eye` is [0, 1]", "[x, y, z]"]),
        ("[camera]\neye = [0, 1e39, 0]\n".into(), 2, ["`camera.eye` is [0, 1e39, 0]", "finite"]),
        (
            "[camera]\neye = [0, 1, 2]\ntarget = [0.0, 1.0, 2.0]\n".into(),
            3,
            ["`camera.target` is", "different from `camera.eye`"],
        ),
        ("[camera]\ntarget = [0, 1, 2]\n".into(), 1, ["`camera.eye` is missing", "eye = ["]),
        ("[camera]\neye = [0, 1, 2]\n".into(), 1, ["`camera.target` is missing", "target = ["]),
        ("camera = 1\n".into(), 1, ["`camera` is 1", "[camera]"]),
        ("[light]\nkind = \"point\"\n".into(), 1, ["`light` is", "[[light]]"]),
        ("[[light]]\nposition = [0, 0, 0]\n".into(), 1, ["`light.kind` is missing", "directional"]),
        ("[[light]]\nkind = \"spto\"\n".into(), 2, ["`light.kind` is \"spto\"", "did you mean `spot`?"]),
        ("[[light]]\nkind = \"area\"\n".into(), 2, ["`light.kind` is \"area\"", "`directional`, `spot` or `point`"]),
        (SUN.replace("[0, -1, 0]", "[0, 0, 0]"), 3, ["`light.direction` is [0, 0, 0]", "not all 0"]),
        (SUN.replace("[1, 1, 1]", "[1, -1, 1]"), 4, ["`light.irradiance` is [1, -1, 1]", "none of them negative"]),
        (SUN.replace("irradiance = [1, 1, 1]", ""), 1, ["`light.irradiance` is missing", "irradiance = ["]),
        (format!("{spot}half_angle_degrees = 90\n"), 6, ["`light.half_angle_degrees` is 90", "from 0.1 to 89"]),
        (format!("{spot}half_angle_degrees = 0\n"), 6, ["`light.half_angle_degrees` is 0", "from 0.1 to 89"]),
        (
            format!("{spot}half_angle_degrees = 30\nfull_intensity_half_angle_degrees = 31\n"),
            7,
            ["`light.full_intensity_half_angle_degrees` is 31", "from 0 to 30"],
        ),
        (spot.into(), 1, ["`light.half_angle_degrees` is missing", "half_angle_degrees = "]),
        (format!("{MODEL}transform = {{ scale = 0 }}\n"), 3, ["`transform.scale` is 0", "none of them 0"]),
        (
            format!("{MODEL}transform = {{ scale = [1, 0, 1] }}\n"),
            3,
            ["`transform.scale` is [1, 0, 1]", "none of them 0"],
        ),
        (
            format!("{MODEL}transform = {{ scale = 1e38, translate = [3e38, 0, 0] }}\n"),
            3,
            ["`transform.scale`", "float32"],
        ),
        (format!("{MODEL}generator = \"cornell\"\n"), 3, ["`model.generator`", "remove one"]),
        ("[[model]]\n".into(), 1, ["`model.path` is missing", "generator"]),
        ("name = 3\n[[model]]\n".into(), 1, ["`name` is 3", "text in quotes"]),
        ("name = \"x\"\n".into(), 1, ["`model` is missing", "[[model]]"]),
        ("[[model]]\npath = \"gone.obj\"\n".into(), 2, ["`model.path` names dir/gone.obj", "relative to this file"]),
        ("[[model]]\npath = \"m.fbx\"\n".into(), 2, ["`model.path` names m.fbx", "only .obj, .gltf and .glb models"]),
        ("name = \"x\nname = 2\n".into(), 1, ["not valid TOML", "dir/s.toml"]),
        ("[camera]\n\n[camera]\n".into(), 3, ["not valid TOML", "dir/s.toml"]),
    ] {
        assert_says(&refused(&toml), &[&format!("dir/s.toml:{line}:"), parts[0], parts[1]]);
    }
}

#[test]
fn an_invalid_model_is_refused_with_its_file_and_line() {
    let toml = "[[model]]\npath = \"sub/bad.obj\"\n";
    let files: [(&str, &[u8]); 2] = [("dir/s.toml", toml.as_bytes()), ("dir/sub/bad.obj", b"v 0 0 nan\n")];
    assert_says(&refusal(&files, "dir/s.toml"), &["dir/sub/bad.obj:1:", "`v 0 0 nan`"]);
}

#[test]
fn an_environment_is_a_radiance_or_a_map() {
    for (text, wanted) in [
        ("radiance = [1, -1, 1]", &["dir/s.toml:4:", "radiance", "none of them negative"][..]),
        ("map = 'no.exr'", &["dir/s.toml:4:", "no.exr", "no such file"]),
        ("map = 'no.exr'\nradiance = [1, 1, 1]", &["together with `radiance`", "remove one"]),
        ("", &["radiance", "is missing", "map ="]),
        ("mpa = 'no.exr'", &["mpa", "did you mean `map`"]),
    ] {
        assert_says(&refused(&format!("{MODEL}[environment]\n{text}\n")), wanted);
    }
    let broken: [(&str, &[u8]); 3] = [
        ("dir/s.toml", b"[[model]]\npath = 'm.obj'\n[environment]\nmap = 'sky.exr'\n"),
        ("dir/m.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        ("dir/sky.exr", b"not an image"),
    ];
    assert_says(&refusal(&broken, "dir/s.toml"), &["sky.exr", "not a readable EXR image", "store it"]);
}

#[test]
fn text_that_is_not_utf8_is_refused() {
    assert_says(&refusal(&[("s.toml", b"name = \"\xff\"\n")], "s.toml"), &["s.toml:", "UTF-8"]);
}

#[test]
fn radiance_maps_are_read_and_odd_shapes_are_told() {
    let toml = format!("{MODEL}{CAMERA}[environment]\nmap = 'sky.hdr'\n");
    let read = |resolution: &str, pixels: usize| {
        let sky = [format!("#?RADIANCE\n\n{resolution}\n").as_bytes(), &[128, 64, 0, 129].repeat(pixels)].concat();
        let files: [(&str, &[u8]); 3] =
            [("s.toml", toml.as_bytes()), ("m.obj", TRIANGLE.as_bytes()), ("sky.hdr", &sky)];
        load(&files, "s.toml")
    };
    let scene = read("-Y 4 +X 8", 32);
    let sky = scene.environment.as_ref().expect("a sky");
    assert_eq!((sky.width, sky.height, sky.texels[31], sky.map.as_deref()), (8, 4, [1.0, 0.5, 0.0], Some("sky.hdr")));
    assert_eq!((scene.lights.len(), scene.warnings.len()), (0, 0));
    for (resolution, pixels, size) in
        [("-Y 8 +X 8", 64, "8 x 8"), ("-Y 1 +X 8", 8, "8 x 1"), ("-Y 8 +X 4", 32, "4 x 8")]
    {
        let scene = read(resolution, pixels);
        crate::assert_warns(&scene, &["sky.hdr:", size, "twice as wide", "stretched"]);
    }
}
