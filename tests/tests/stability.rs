//! No NaN and no infinity in any texture, whatever the scene, the size and the settings.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use halflight_evaluator::session::Session;
use halflight_scenes::{Light, Scene};
use halflight_tests::{bundled, device, frames, request, scenes};

/// Runs a frame and looks through every texture; returns the largest value of the final image.
fn scan(session: &Session, technique: &str, settings: &[(&str, &str)], size: [u32; 2]) -> f32 {
    let request = request(technique, settings, size);
    let mut frames = frames(session, &request);
    frames.run(0).unwrap();
    if frames.plan().has_history() {
        // A second frame reads what the first one left.
        frames.run(1).unwrap();
    }
    let mut largest = 0.0f32;
    for (name, texels) in frames.read_all().unwrap() {
        let bad = texels.iter().flatten().filter(|v| !v.is_finite()).count();
        let what = format!("{} {technique} {settings:?} {size:?}: {name}", session.scene.name);
        assert_eq!(bad, 0, "{what} has {bad} values that are not finite");
        // Light is never negative.
        if ["direct", "indirect", "glossy", "fed", "final"].contains(&name.as_str()) {
            assert!(texels.iter().flatten().all(|&v| v >= 0.0), "{what} has negative values");
            largest = texels.iter().flatten().fold(largest, |a, &b| a.max(b));
        }
    }
    let bytes: Vec<String> =
        frames.plan().resources.iter().map(|r| r.name.clone()).filter(|n| n.starts_with("surfels")).collect();
    for name in bytes {
        let bytes = frames.read_bytes(&name).unwrap().unwrap();
        let words: &[[u32; 4]] = bytemuck::cast_slice(&bytes);
        assert!(words.iter().all(|w| f32::from_bits(w[0]).is_finite()), "{name} has a depth that is not finite");
    }
    largest
}

/// Settings that reach every shader variant and both ends of every range.
const SETTINGS: &[&[(&str, &str)]] = &[
    &[],
    &[("start_resolution", "full"), ("levels", "1"), ("samples", "1")],
    &[("start_resolution", "full"), ("levels", "8"), ("form_factor", "eq3"), ("disc_area", "texel")],
    &[("start_resolution", "half"), ("pyramid_filter", "vote"), ("upsampling_kernel", "nearest")],
    &[("start_resolution", "half"), ("upsampling_kernel", "linear"), ("storage", "float32")],
    &[("levels", "8"), ("pyramid_filter", "vote"), ("ring", "2009"), ("radius", "20")],
    &[("radius", "0.01")],
    &[("radius", "16384"), ("samples", "1024"), ("disc_area", "texel")],
    &[("only_level", "3"), ("form_factor", "eq3")],
    &[
        ("temporal_a", "0.999"),
        ("start_resolution", "half"),
        ("storage", "float32"),
        ("bounces", "2"),
        ("bounce_interleaving", "on"),
    ],
    &[("visibility", "surface"), ("samples_per_ray", "1"), ("visibility_downsampling", "and"), ("bounces", "2")],
    &[("visibility", "solid"), ("samples_per_ray", "64"), ("start_resolution", "full"), ("levels", "8")],
    &[("visibility", "auto"), ("radius", "16384"), ("bounces", "3"), ("visibility_bounces", "first")],
    &[("bounces", "8"), ("start_resolution", "full"), ("levels", "1"), ("pyramid_filter", "vote")],
];

/// The same for the techniques that walk along slices.
const SLICE_SETTINGS: &[(&str, &[(&str, &str)])] = &[
    ("bitmask", &[]),
    ("bitmask", &[("estimator", "published"), ("thickness", "1e9"), ("sectors", "128"), ("spacing", "constant")]),
    ("bitmask", &[("finds", "occlusion"), ("resolution", "half"), ("radius", "1e-6"), ("thickness_slope", "0")]),
    (
        "bitmask",
        &[("feedback", "0.95"), ("temporal_a", "0.9"), ("resolution", "half"), ("slices", "2"), ("steps", "1")],
    ),
    ("gtao", &[("falloff", "1"), ("radius", "1e9"), ("resolution", "half")]),
    ("horizon", &[("radius", "1"), ("storage", "float32"), ("jitter", "off")]),
    ("ray-march", &[("rays", "3"), ("thickness", "1e9"), ("resolution", "half")]),
];

fn scan_all(scene: &Scene, size: [u32; 2]) {
    let session = Session::new(device(), scene);
    scan(&session, "none", &[], size);
    for form_factor in ["eq3", "eq4"] {
        scan(&session, "exhaustive", &[("form_factor", form_factor)], size);
    }
    for settings in SETTINGS {
        scan(&session, "hierarchical", settings, size);
    }
    for (technique, settings) in SLICE_SETTINGS {
        scan(&session, technique, settings, size);
    }
}

fn triangle(material: halflight_scenes::Material) -> Scene {
    let mut mesh = scenes::quad(Vec3::new(-0.5, -0.5, -1.0), Vec3::X, Vec3::Y, 0);
    mesh.indices.truncate(3);
    Scene {
        name: "triangle".into(),
        meshes: vec![mesh],
        materials: vec![material],
        lights: vec![scenes::sun()],
        ..Scene::default()
    }
}

#[test]
fn bundled_scenes_are_finite() {
    for name in ["cornell", "bars", "furnace", "atrium", "motion"] {
        scan_all(&bundled(name), [33, 17]);
    }
}

#[test]
fn an_empty_scene_is_black() {
    let scene = Scene { name: "empty".into(), ..Scene::default() };
    scan_all(&scene, [17, 9]);
    assert_eq!(scan(&Session::new(device(), &scene), "hierarchical", &[], [17, 9]), 1.0, "only alpha is not black");
    // With lights and materials, yet nothing to see.
    let lit = Scene { lights: vec![scenes::sun()], materials: vec![scenes::grey(0.5)], ..scene };
    scan_all(&lit, [17, 9]);
}

#[test]
fn a_camera_that_sees_only_sky_sees_black() {
    let mut scene = scenes::court();
    scene.camera.target = [0.0, 10.0, 20.0];
    scan_all(&scene, [17, 9]);
    assert_eq!(scan(&Session::new(device(), &scene), "hierarchical", &[], [17, 9]), 1.0, "only alpha is not black");
}

#[test]
fn one_triangle_is_finite() {
    scan_all(&triangle(scenes::grey(1.0)), [31, 29]);
    scan_all(&triangle(scenes::emitter(1.0)), [31, 29]);
    let mut flat = triangle(scenes::grey(1.0));
    // No area, then one point: nothing is drawn, or at most a line.
    flat.meshes[0].positions[2] = flat.meshes[0].positions[1];
    scan_all(&flat, [31, 29]);
    flat.meshes[0].positions[1] = flat.meshes[0].positions[0];
    scan_all(&flat, [31, 29]);
}

#[test]
fn scenes_without_light_are_finite() {
    let mut scene = scenes::court();
    scene.lights.clear();
    scan_all(&scene, [33, 17]);
}

#[test]
fn extremes_of_gloss_are_finite() {
    for exponent in [0.0, 1.0, 32.0, 1e6] {
        let mut scene = scenes::court();
        scene.name = format!("court with exponent {exponent:e}");
        scene.materials.iter_mut().for_each(|material| {
            material.specular = [1.0, 0.5, 0.0];
            material.phong_exponent = exponent;
        });
        let session = Session::new(device(), &scene);
        for importance in ["lobe", "2010", "off"] {
            for more in
                [[("visibility", "surface"), ("bounces", "2")], [("start_resolution", "full"), ("temporal_a", "0.9")]]
            {
                let settings = [&[("glossy", "on"), ("glossy_importance", importance)][..], &more].concat();
                for size in [[33, 17], [1, 1], [97, 1]] {
                    scan(&session, "hierarchical", &settings, size);
                }
            }
        }
    }
}

#[test]
fn extremes_of_extra_cameras_are_finite() {
    let mut scene = scenes::court();
    let here = scene.camera;
    // In the same place, beside, on a surface, looking away, and nowhere in particular.
    scene.extra_cameras = vec![
        here,
        scenes::camera([-1.9, 1.2, -1.0], [1.0, 0.2, -1.2], 170.0),
        scenes::camera([0.0; 3], [0.0, 1.0, 0.0], 60.0),
        scenes::camera([0.0, 1.4, 4.0], [0.0, 10.0, 20.0], 1.0),
        scenes::camera([0.0; 3], [0.0; 3], 60.0),
    ];
    let session = Session::new(device(), &scene);
    for settings in [
        &[("visibility", "surface"), ("bounces", "2"), ("bounce_interleaving", "on")][..],
        &[("temporal_a", "0.9"), ("storage", "float32")],
    ] {
        for size in [[33, 17], [1, 1], [31, 2]] {
            scan(&session, "hierarchical", settings, size);
        }
    }
}

#[test]
fn extremes_of_light_are_clamped() {
    for radiance in [0.0, 1e-30, 1e6, 1e30, f32::MAX] {
        let mut scene = scenes::court();
        scene.name = format!("court lit by {radiance:e}");
        scene.lights = vec![Light::Directional { direction: [0.2, -1.0, -0.3], irradiance: [radiance; 3] }];
        scene.materials[1].emission = [radiance; 3];
        scan_all(&scene, [33, 17]);
    }
}

#[test]
fn extremes_of_geometry_are_finite() {
    let mut scene = scenes::court();
    // Coincident surfaces, opposite vertex normals, a zero normal.
    scene.name = "coincident".into();
    let copies = scene.meshes.clone();
    scene.meshes.extend(copies);
    for (mesh, normals) in scene.meshes.iter_mut().zip([[0.0; 3], [0.0, 0.0, -1.0], [0.0, -1.0, 0.0]]) {
        mesh.normals[1] = normals;
    }
    scan_all(&scene, [33, 17]);
    // A camera on a surface, and one inside a block.
    for eye in [[0.0, 0.0, 0.0], [0.0, 0.3, -1.2], [0.0, 1.4, 4e6]] {
        let mut scene = scenes::court();
        scene.name = format!("eye at {eye:?}");
        scene.camera.eye = eye;
        scan_all(&scene, [33, 17]);
    }
    for degrees in [1.0, 170.0] {
        let mut scene = scenes::court();
        scene.name = format!("{degrees} degrees");
        scene.camera.vertical_fov_degrees = degrees;
        scan_all(&scene, [33, 17]);
    }
}

#[test]
fn extremes_of_size_are_finite() {
    let scene = scenes::court();
    for size in [[1, 1], [3, 1], [1, 3], [2, 2], [97, 1], [1, 97], [160, 16], [31, 37]] {
        scan_all(&scene, size);
    }
    // Odd and prime, larger than the pyramid.
    let session = Session::new(device(), &scene);
    scan(&session, "hierarchical", &[], [1279, 717]);
}

#[test]
fn a_pixel_alone_receives_nothing() {
    let scene = scenes::court();
    let session = Session::new(device(), &scene);
    for technique in ["hierarchical", "exhaustive"] {
        let light = halflight_tests::render(&session, &request(technique, &[], [1, 1]), "indirect");
        // A surface does not light itself.
        assert_eq!(light, [[0.0; 3]], "{technique}");
    }
}

#[test]
fn a_plane_does_not_light_itself() {
    // One tilted, lit plane over the whole screen. All of it lies in one plane, so no part sees another.
    let mut mesh = scenes::quad(Vec3::new(-50.0, -1.0, 50.0), 100.0 * Vec3::X, -100.0 * Vec3::Z, 0);
    mesh.name = "plane".into();
    let mut scene = Scene {
        meshes: vec![mesh],
        materials: vec![scenes::grey(0.8)],
        lights: vec![scenes::sun()],
        ..Scene::default()
    };
    scene.camera = scenes::camera([0.0, 1.0, 3.0], [0.3, -1.0, -0.5], 40.0);
    let session = Session::new(device(), &scene);
    for (technique, settings) in [
        ("exhaustive", &[][..]),
        ("hierarchical", &[("start_resolution", "full"), ("disc_area", "texel")]),
        ("hierarchical", &[("start_resolution", "quarter"), ("disc_area", "texel"), ("pyramid_filter", "vote")]),
        ("hierarchical", &[("start_resolution", "quarter"), ("disc_area", "sample"), ("samples", "16")]),
    ] {
        let request = request(technique, settings, [128, 96]);
        let lit = halflight_tests::mean_luminance(&halflight_tests::render(&session, &request, "direct"));
        let light = halflight_tests::mean_luminance(&halflight_tests::render(&session, &request, "indirect"));
        println!("{technique} {settings:?}: {:.1e} of the plane's radiance", light / lit);
        // Normals are stored with 11 bits, positions with 24: a cosine of 5e-4 on both sides, in one of
        // two directions, over a plane that fills the view would give 1e-3 at most.
        assert!(light < 1e-3 * lit, "{technique} {settings:?}: {light} of {lit}");
    }
}
