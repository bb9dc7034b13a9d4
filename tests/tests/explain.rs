//! The links of an error, each found alone on a scene that has it alone.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use halflight_evaluator::explain::{Explanation, Options};
use halflight_scenes::{Material, Scene};
use halflight_tests::{device, known, scenes, settings};

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
    let options = Options {
        technique: known(technique),
        settings: settings(technique, values),
        size: [96, 64],
        seed: 0,
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
    stands_alone(&explanation, "missing visibility", "stands in its way");
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
