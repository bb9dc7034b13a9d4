//! Light from what the lights see: absolute units, units of the scene, light from off the screen, plans.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use halflight_evaluator::session::Session;
use halflight_evaluator::truth::trace;
use halflight_renderer::{
    SceneFacts, plan_frame,
    truth::{Request, Stop},
};
use halflight_scenes::{Light, Material, Scene};
use halflight_tests::{device, frames, known, mean_luminance, render, request, scenes, settings};

const SIZE: [u32; 2] = [96, 54];

/// Floor and wall that meet, both lit and both in view: nothing hides anything.
fn corner(light: Light) -> Scene {
    let mut scene = scenes::court();
    scene.meshes.truncate(2);
    scene.lights = vec![light];
    scene
}

fn lights() -> [(&'static str, Light); 3] {
    let position = [0.3, 2.0, 0.6];
    let intensity = [9.0, 8.0, 7.0];
    [
        ("directional", scenes::sun()),
        ("point", Light::Point { position, intensity }),
        (
            "spot",
            Light::Spot {
                position,
                direction: [-0.1, -1.0, -0.8],
                intensity,
                half_angle_degrees: 55.0,
                full_intensity_half_angle_degrees: 40.0,
            },
        ),
    ]
}

/// Mean of the first bounce, path-traced.
fn truth(scene: &Scene) -> f64 {
    let request = Request { bounces: 1, ..Request::new(scene.camera, SIZE) };
    let traced = trace(device(), scene, &request, Stop::at_samples(384)).unwrap();
    mean_luminance(&traced.truth.indirect.unwrap().mean)
}

/// Mean over these frames.
fn hybrid(scene: &Scene, more: &[(&str, &str)], count: u32) -> f64 {
    let session = Session::new(device(), scene);
    let base =
        [("start_resolution", "full"), ("storage", "float32"), ("sources", "lights"), ("voxel_resolution", "128")];
    let request = request("hybrid", &[&base[..], more].concat(), SIZE);
    mean_luminance(&frames(&session, &request).mean_over_frames("indirect", count).unwrap().0)
}

#[test]
fn what_the_lights_see_agrees_with_truth_in_absolute_units() {
    for (name, light) in lights() {
        let scene = corner(light);
        let wanted = truth(&scene);
        for (how, settings) in [
            ("lights", &[("visibility", "off")][..]),
            ("lights, visibility", &[]),
            ("both", &[("sources", "both"), ("visibility", "off"), ("radius", "0.4")]),
        ] {
            let ratio = hybrid(&scene, settings, 4) / wanted;
            println!("{name}, {how}: {ratio:.4} of the path-traced mean");
            // The promise for a single light and nothing hidden. Grid cells clear of the ends of a ray cost what comes
            // from nearer than them, on both sides of the corner; a disc stands for a texel of the light's view.
            assert!((ratio - 1.0).abs() < 0.05, "{name}, {how}: {ratio}");
        }
        // The original pattern, wide enough for all of the map. Of a map with a perspective it reaches only what lies
        // before the light on the receiver's side.
        if name != "directional" {
            continue;
        }
        let session = Session::new(device(), &scene);
        let settings =
            [("start_resolution", "full"), ("storage", "float32"), ("map_radius", "1.5"), ("samples", "256")];
        let rsm = frames(&session, &request("rsm", &settings, SIZE)).mean_over_frames("indirect", 4).unwrap().0;
        let ratio = mean_luminance(&rsm) / wanted;
        println!("{name}, rsm: {ratio:.4} of the path-traced mean");
        assert!((ratio - 1.0).abs() < 0.05, "{name}, rsm: {ratio}");
    }
}

#[test]
fn a_choice_of_lights_brings_what_all_of_them_bring() {
    let scene = corner(scenes::sun());
    let all = hybrid(&scene, &[("visibility", "off"), ("light_samples", "1024"), ("light_view_size", "32")], 4);
    for (virtual_lights, light_samples) in [("1024", "64"), ("128", "128"), ("512", "32")] {
        let settings = [
            ("visibility", "off"),
            ("light_view_size", "32"),
            ("virtual_lights", virtual_lights),
            ("light_samples", light_samples),
        ];
        let ratio = hybrid(&scene, &settings, 32) / all;
        println!("{virtual_lights} lights, {light_samples} samples: {ratio:.4}");
        // 32 frames choose anew 32 times; measured up to 1 %, which is their noise.
        assert!((ratio - 1.0).abs() < 0.03, "{virtual_lights}, {light_samples}: {ratio}");
    }
}

#[test]
fn units_of_the_scene_do_not_matter() {
    let image = |scale: f32| {
        let mut scene = scenes::court();
        for position in scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions) {
            *position = (Vec3::from(*position) * scale).to_array();
        }
        scene.camera.eye = scene.camera.eye.map(|v| v * scale);
        scene.camera.target = scene.camera.target.map(|v| v * scale);
        let session = Session::new(device(), &scene);
        let request = request("hybrid", &[("storage", "float32"), ("voxel_resolution", "128")], SIZE);
        frames(&session, &request).mean_over_frames("indirect", 24).unwrap().0
    };
    let (one, hundred) = (image(1.0), image(100.0));
    let worst = one.iter().zip(&hundred).flat_map(|(a, b)| (0..3).map(|c| (a[c] - b[c]).abs())).fold(0.0, f32::max);
    let largest = one.iter().flatten().copied().fold(0.0, f32::max);
    let ratio = mean_luminance(&hundred) / mean_luminance(&one);
    println!("largest difference {worst:e} of {largest}, means {ratio:.5}");
    // A sum of 16,384 importances rounds at 1e-4 of it, a tenth of the way between two chosen lights: others are chosen,
    // and what 24 frames leave of that noise is 0.4 % of the mean.
    assert!((ratio - 1.0).abs() < 0.01);
    let differ = one.iter().zip(&hundred).filter(|(a, b)| (a[1] - b[1]).abs() > 0.02 * largest).count();
    assert!(differ < one.len() / 20, "{differ} of {} pixels differ", one.len());
}

#[test]
fn light_from_a_wall_off_the_screen_arrives() {
    // A red wall behind the camera, lit by a lamp between them, faces a white one: the screen shows the white one alone.
    let red = Material { albedo: [0.9, 0.05, 0.05], ..Material::default() };
    let scene = Scene {
        name: "behind".into(),
        meshes: vec![
            scenes::quad(Vec3::new(-2.0, 0.0, -2.0), 4.0 * Vec3::X, 3.0 * Vec3::Y, 0),
            scenes::quad(Vec3::new(2.0, 0.0, 2.0), -4.0 * Vec3::X, 3.0 * Vec3::Y, 1),
        ],
        materials: vec![scenes::grey(0.8), red],
        lights: vec![Light::Spot {
            position: [0.0, 1.5, 0.0],
            direction: [0.0, 0.0, 1.0],
            intensity: [10.0; 3],
            half_angle_degrees: 50.0,
            full_intensity_half_angle_degrees: 40.0,
        }],
        camera: scenes::camera([0.0, 1.5, 1.5], [0.0, 1.5, -2.0], 40.0),
        ..Scene::default()
    };
    let wanted = truth(&scene);
    let screen = hybrid(&scene, &[("sources", "screen"), ("radius", "30")], 2);
    let hierarchical = {
        let session = Session::new(device(), &scene);
        mean_luminance(&render(&session, &request("hierarchical", &[], SIZE), "indirect"))
    };
    let both = hybrid(&scene, &[("sources", "both")], 4);
    println!("truth {wanted:.4}, screen {screen:.4}, hierarchical {hierarchical:.4}, both {both:.4}");
    assert!(wanted > 0.01);
    // The wall on the screen is unlit: exactly nothing comes from there.
    assert_eq!((screen, hierarchical), (0.0, 0.0));
    let session = Session::new(device(), &scene);
    assert_eq!(mean_luminance(&render(&session, &request("ssdo", &[("radius", "30")], SIZE), "indirect")), 0.0);
    assert!((both / wanted - 1.0).abs() < 0.05, "{both} of {wanted}");
}

#[test]
fn the_plan_has_what_scene_and_settings_need() {
    let names = |scene: &Scene, more: &[(&str, &str)]| -> Vec<String> {
        let plan =
            plan_frame(&SceneFacts::of(scene), known("hybrid"), &settings("hybrid", more), SIZE, Default::default());
        let technique = |pass: &&halflight_renderer::plan::Pass| pass.part == halflight_renderer::plan::Part::Technique;
        plan.unwrap().passes.iter().filter(technique).map(|pass| pass.name.clone()).collect()
    };
    let scene = scenes::court();
    let screen = names(&scene, &[("sources", "screen")]);
    assert!(!screen.iter().any(|name| name.contains("light") || name.contains("voxels")), "{screen:?}");
    let both = names(&scene, &[]);
    for name in ["light_view_0", "collect_0", "choose", "scene_voxels", "gather"] {
        assert!(both.iter().any(|pass| pass == name), "{name}: {both:?}");
    }
    assert_eq!(names(&scene, &[("visibility", "off")]).len(), both.len() - 1);
    // A second sun brings a view and its collection; what is done for the screen is done once.
    let mut two = scene.clone();
    two.lights.push(scenes::sun());
    assert_eq!(names(&two, &[]).len(), both.len() + 2);
    // Six faces look around a point light.
    two.lights = vec![Light::Point { position: [0.0, 2.0, 0.0], intensity: [1.0; 3] }];
    assert_eq!(names(&two, &[]).len(), both.len() + 10);
    // Without lights only the screen is left.
    two.lights.clear();
    assert_eq!(names(&two, &[]), screen);
}
