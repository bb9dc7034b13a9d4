//! Techniques under a sky: what they claim, and what closes it.
#![allow(clippy::unwrap_used)]

use glam::{Quat, Vec3};
use halflight_evaluator::experiment::session::Session;
use halflight_renderer::{
    gi::{Reach, Technique},
    plan_frame,
    scene::SceneFacts,
};
use halflight_scenes::{Camera, Environment, Material, Scene};
use halflight_soundness::scenes;
use halflight_techniques::TECHNIQUES;
use halflight_tests::{device, render, request};

/// Techniques that claim the sky with their default settings.
fn claiming() -> impl Iterator<Item = &'static Technique> {
    TECHNIQUES.iter().filter(|technique| {
        let settings = (technique.complete)(&Default::default()).unwrap();
        (technique.sources)(&settings).unwrap().sky == Reach::Scene
    })
}

fn white(radiance: f32) -> Scene {
    Scene {
        materials: vec![Material { albedo: [1.0; 3], ..Material::default() }],
        environment: Some(Environment::constant([radiance; 3])),
        ..Scene::default()
    }
}

/// A white floor under an even sky of radiance 1 reflects 1.
#[test]
fn a_floor_under_a_white_sky_is_white() {
    let mut scene = white(1.0);
    scene.meshes = vec![scenes::quad(Vec3::new(-1.0, 0.0, 1.0), 2.0 * Vec3::X, -2.0 * Vec3::Z, 0)];
    scene.camera = Camera { eye: [0.0, 1.0, 2.0], target: [0.0; 3], ..Camera::default() };
    let session = Session::new(device(), &scene);
    let mut names = Vec::new();
    for technique in claiming() {
        let request = request(technique.name, &[], [64, 36]);
        let depth = render(&session, &request, "depth");
        let light = render(&session, &request, "indirect");
        let lit: Vec<f64> =
            light.iter().zip(&depth).filter(|(_, depth)| depth[0] > 0.0).map(|(l, _)| f64::from(l[0])).collect();
        assert!(lit.len() > 200, "the floor is in the picture");
        let mean = lit.iter().sum::<f64>() / lit.len() as f64;
        // A bitmask rounds to a 32nd by chance: over 200 pixels the mean is closer than a hundredth.
        assert!((mean - 1.0).abs() < 0.01, "{}: {mean}", technique.name);
        names.push(technique.name);
    }
    assert!(names.len() >= 6, "{names:?}");
}

/// In a closed box no light of the sky arrives, however the box is turned relative to the voxels.
#[test]
fn a_closed_box_under_a_sky_is_dark() {
    for turn in [Quat::IDENTITY, Quat::from_rotation_y(0.6) * Quat::from_rotation_x(0.4)] {
        let mut scene = white(1.0);
        let at = |x: f32, y: f32, z: f32| turn * Vec3::new(x, y, z);
        let side = |axis: Vec3| turn * (4.0 * axis);
        scene.meshes = vec![
            scenes::quad(at(-2.0, -2.0, -2.0), side(Vec3::X), side(Vec3::Y), 0),
            scenes::quad(at(-2.0, -2.0, 2.0), side(Vec3::X), side(Vec3::Y), 0),
            scenes::quad(at(-2.0, -2.0, -2.0), side(Vec3::X), side(Vec3::Z), 0),
            scenes::quad(at(-2.0, 2.0, -2.0), side(Vec3::X), side(Vec3::Z), 0),
            scenes::quad(at(-2.0, -2.0, -2.0), side(Vec3::Y), side(Vec3::Z), 0),
            scenes::quad(at(2.0, -2.0, -2.0), side(Vec3::Y), side(Vec3::Z), 0),
        ];
        scene.camera = Camera {
            eye: at(1.5, 1.0, 1.5).to_array(),
            target: at(-1.0, -0.5, -1.0).to_array(),
            up: (turn * Vec3::Y).to_array(),
            vertical_fov_degrees: 70.0,
        };
        let session = Session::new(device(), &scene);
        for technique in claiming() {
            let light = render(&session, &request(technique.name, &[], [64, 36]), "indirect");
            let brightest = light.iter().flatten().fold(0.0f32, |a, &b| a.max(b));
            assert_eq!(brightest, 0.0, "{} lets light in", technique.name);
        }
    }
}

#[test]
fn plans_tell_what_a_technique_leaves_out() {
    let scene = white(1.0);
    let note = |technique: &Technique| {
        let settings = (technique.complete)(&Default::default()).unwrap();
        plan_frame(&SceneFacts::of(&scene), technique, &settings, [16, 9], Default::default()).unwrap().notes
    };
    for technique in TECHNIQUES {
        let claims = claiming().any(|claiming| claiming.name == technique.name);
        let expected =
            if claims { vec![] } else { vec![format!("{} leaves out indirect light of the sky", technique.name)] };
        let about_no_pass = |note: &String| note.ends_with("because the scene has no light that it takes");
        let notes: Vec<_> = note(technique).into_iter().filter(|note| !about_no_pass(note)).collect();
        assert_eq!(notes, expected);
    }
}
