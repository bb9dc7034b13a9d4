//! The links of an error, each found alone on a scene that has it alone.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use halflight_evaluator::explain::{Explanation, Options};
use halflight_scenes::{Light, Material, Scene};
use halflight_soundness::scenes;
use halflight_tests::{device, known, settings};

/// A white floor and an emitting plate above its left edge, seen from the front: all on the screen, nothing hidden. The
/// plate's back shines too, but on nothing.
fn lit_floor() -> Scene {
    Scene {
        name: "lit floor".into(),
        meshes: vec![
            scenes::quad(Vec3::new(-1.4, 0.0, 2.0), 4.0 * Vec3::X, -4.0 * Vec3::Z, 0),
            // Faces +x.
            scenes::quad(Vec3::new(-1.5, 0.3, 1.0), -2.0 * Vec3::Z, 1.2 * Vec3::Y, 1),
        ],
        materials: vec![scenes::grey(0.8), scenes::emitter(2.0), Material { albedo: [0.0; 3], ..Material::default() }],
        camera: scenes::camera([0.3, 2.2, 6.0], [0.3, 0.3, 0.0], 45.0),
        ..Scene::default()
    }
}

fn explain(scene: &Scene, technique: &str, values: &[(&str, &str)]) -> Explanation {
    explain_frame(scene, technique, values, 8)
}

fn explain_frame(scene: &Scene, technique: &str, values: &[(&str, &str)], frame: u32) -> Explanation {
    let options = Options {
        technique: known(technique),
        settings: settings(technique, values),
        size: [96, 64],
        seed: 0,
        frame,
        frames: 32,
        samples_per_pixel: 256,
        cache: None,
        direct_from_truth: false,
    };
    let explanation = Explanation::measure(device(), scene, &options).unwrap();
    println!("{}\n{explanation}", scene.name);
    let rows = explanation.rows();
    // The links add up to what the whole is: rounding alone is left.
    let sum = |of: &dyn Fn(&halflight_evaluator::explain::LinkRow) -> f64| rows.iter().map(of).sum::<f64>();
    let (bias, square) = (explanation.moments.mean.value, explanation.moments.square.value);
    assert!((sum(&|row| row.bias.value) - bias).abs() < 1e-9 * bias.abs().max(1e-3));
    assert!((sum(&|row| row.square.value + row.cross.value / 2.0) - square).abs() < 1e-9 * square.abs().max(1e-3));
    explanation
}

/// Fails unless this link has nearly all of the squared error.
fn stands_alone(explanation: &Explanation, link: &str, advice: &str) {
    let rows = explanation.rows();
    let square = explanation.moments.square.value;
    let part = |row: &halflight_evaluator::explain::LinkRow| row.square.value / square;
    let own = rows.iter().find(|row| row.link == link).unwrap();
    // What is left over is that of single pixels at the plate's edge, a few per cent of the light at most: its square
    // is far less than a tenth of an error that is as large as the light itself.
    assert!((part(own) - 1.0).abs() < 0.1, "{link}: {}", part(own));
    for row in rows.iter().filter(|row| row.link != link) {
        assert!(part(row) < 0.1, "{link}: {} has {}", row.link, part(row));
    }
    assert!(explanation.advice.contains(advice), "{}", explanation.advice);
}

#[test]
fn light_from_off_the_screen() {
    let mut scene = lit_floor();
    // Behind and above the camera, facing the floor.
    scene.meshes[1] = scenes::quad(Vec3::new(-1.0, 3.0, 6.0), 2.0 * Vec3::X, 2.0 * Vec3::Y, 1);
    scene.meshes[1].indices.reverse();
    scene.meshes[1].normals.iter_mut().for_each(|n| *n = [0.0, 0.0, -1.0]);
    scene.name = "light off the screen".into();
    stands_alone(&explain(&scene, "hierarchical", &[]), "off-screen and hidden light", "the screen does not show");
}

#[test]
fn a_hidden_occluder() {
    let mut scene = lit_floor();
    // A black wall in the camera's own plane: the eye sees its edge alone, which has no width.
    scene.meshes.push(scenes::quad(Vec3::new(0.3, 0.0, 2.0), -4.0 * Vec3::Z, 2.0 * Vec3::Y, 2));
    scene.name = "hidden occluder".into();
    // The exhaustive sum has neither noise nor hierarchy.
    let explanation = explain(&scene, "exhaustive", &[]);
    stands_alone(&explanation, "missing visibility", "passes through occluders");
}

#[test]
fn one_sample() {
    let mut scene = lit_floor();
    scene.name = "one sample".into();
    let explanation = explain(
        &scene,
        "hierarchical",
        &[("start_resolution", "full"), ("disc_area", "texel"), ("samples", "1"), ("levels", "1")],
    );
    stands_alone(&explanation, "noise", "try more samples");
}

/// The first frame is far from the converged one. The 32nd is that one but for its random numbers.
#[test]
fn rays_not_yet_traced() {
    let mut scene = lit_floor();
    scene.name = "few rays".into();
    let settings = [("bounces", "1"), ("rays", "64")];
    let error = |frame: u32| {
        let explanation = explain_frame(&scene, "radiance-cache", &settings, frame);
        let rows = explanation.rows();
        let names: Vec<_> = rows.iter().map(|row| row.link).collect();
        assert_eq!(names, ["direct light", "rays not yet traced", "interpolation", "what is left"]);
        [1, 2, 3].map(|row| rows[row].square.value)
    };
    let [first, interpolation, rest] = error(1);
    let [last, interpolation_again, rest_again] = error(32);
    // With 32 times the rays the variance should be a thirtieth. What is left is the difference of two seeds, and filters
    // correlate neighbours: a fourth tells both from a frame that is not counted.
    assert!(last < 0.25 * first, "{last} after 32 frames, {first} after one");
    // The other links do not know which frame is explained.
    assert_eq!([interpolation, rest], [interpolation_again, rest_again]);
}

/// A second bounce has a link of its own, and the other links are those of one bounce.
#[test]
fn further_bounces() {
    let scene = two_walls(-Vec3::Z);
    let link = |explanation: &Explanation, name: &str| {
        explanation.rows().iter().find(|row| row.link == name).map(|row| (row.bias.value, row.square.value))
    };
    let one = explain(&scene, "hierarchical", &[("bounces", "1")]);
    let two = explain(&scene, "hierarchical", &[("bounces", "2")]);
    assert_eq!(link(&one, "further bounces"), None);
    assert!(link(&two, "further bounces").is_some_and(|(_, square)| square > 0.0));
    for name in ["missing visibility", "off-screen and hidden light"] {
        assert_eq!(link(&one, name), link(&two, name), "{name}");
    }
    assert!(two.truth_mean > one.truth_mean, "the reference has both bounces");
}

#[test]
fn one_level_that_does_not_reach() {
    let mut scene = lit_floor();
    scene.name = "one level".into();
    let explanation = explain(
        &scene,
        "hierarchical",
        &[("start_resolution", "full"), ("levels", "1"), ("radius", "3"), ("samples", "256"), ("disc_area", "texel")],
    );
    stands_alone(&explanation, "estimator and hierarchy", "another number of levels");
}

/// Two white walls that face each other, one before the camera and one behind it, of which a lamp lights one.
fn two_walls(lit: Vec3) -> Scene {
    Scene {
        name: "two walls".into(),
        meshes: vec![
            scenes::quad(Vec3::new(-2.0, 0.0, -2.0), 4.0 * Vec3::X, 3.0 * Vec3::Y, 0),
            scenes::quad(Vec3::new(2.0, 0.0, 2.0), -4.0 * Vec3::X, 3.0 * Vec3::Y, 0),
            // A floor between them, which both light and the camera sees.
            scenes::quad(Vec3::new(-2.0, 0.0, 2.0), 4.0 * Vec3::X, -4.0 * Vec3::Z, 0),
        ],
        materials: vec![scenes::grey(0.8)],
        lights: vec![Light::Spot {
            position: [0.0, 1.7, 0.0],
            direction: lit.to_array(),
            intensity: [10.0; 3],
            half_angle_degrees: 30.0,
            full_intensity_half_angle_degrees: 25.0,
        }],
        camera: scenes::camera([0.0, 1.8, 1.9], [0.0, 0.9, -2.0], 75.0),
        ..Scene::default()
    }
}

/// Settings of `hybrid` that leave no other error than `more` brings.
fn hybrid(more: &[(&'static str, &'static str)]) -> Vec<(&'static str, &'static str)> {
    let fine =
        [("start_resolution", "full"), ("light_samples", "512"), ("samples_per_ray", "1"), ("screen_samples", "256")];
    [&fine[..], more].concat()
}

#[test]
fn light_from_off_the_screen_that_only_the_screen_is_asked_for() {
    // All that is nearer than the radius comes from the screen, and the lit wall is behind the camera.
    let explanation = explain(&two_walls(Vec3::Z), "hybrid", &hybrid(&[("radius", "100")]));
    stands_alone(&explanation, "light from off the screen", "light_view_size");
}

#[test]
fn light_from_the_screen_that_passes_through_an_occluder() {
    let mut scene = two_walls(Vec3::NEG_Z);
    // A black wall in the camera's own plane, over half of the floor, between the lit wall's right part and the left.
    scene.materials.push(Material { albedo: [0.0; 3], ..Material::default() });
    scene.meshes.push(scenes::quad(Vec3::new(0.0, 0.0, 1.0), -2.9 * Vec3::Z, 1.5 * Vec3::Y, 1));
    scene.lights[0] = Light::Spot {
        position: [0.8, 1.2, 0.0],
        direction: [0.3, 0.0, -1.0],
        intensity: [10.0; 3],
        half_angle_degrees: 25.0,
        full_intensity_half_angle_degrees: 20.0,
    };
    let explanation = explain(&scene, "hybrid", &hybrid(&[("sources", "lights"), ("visibility", "off")]));
    stands_alone(&explanation, "light from the screen", "light_view_size");
}
