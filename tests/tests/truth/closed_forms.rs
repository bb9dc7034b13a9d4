//! Scenes whose light is known on paper.

use std::{f64::consts::PI, path::Path};

use halflight_renderer::truth::Request;
use halflight_scenes::{DiskFiles, Light, Mesh, Scene, load_scene};

use crate::{add_quad, assert_near, down_at_origin, grey, mean, mean_grey, trace};

/// In a closed room of albedo 1/2 that emits 1/2 everywhere, n bounces bring 1/2 + 1/4 + ... = 1 - 2^-n.
#[test]
fn furnace() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/furnace.toml");
    let scene = load_scene(&DiskFiles, &path).unwrap();
    for bounces in [1, 2, 4, 14] {
        let request = Request { bounce1: true, bounces, ..Request::new(scene.camera, [64, 48]) };
        let truth = trace(&scene, &request, 16);
        assert!(truth.depth.iter().all(|&d| d > 0.0), "the room is closed");
        assert!(truth.direct.iter().flatten().all(|&v| (v - 0.5).abs() < 1e-6), "everything emits 1/2");
        let expected = 1.0 - 0.5f64.powi(bounces as i32);
        // A ray in 10,000 may slip through a crack between two faces or start on the wrong side of one.
        assert_near(mean(truth.indirect.as_ref().unwrap()), expected, 1e-4, &format!("{bounces} bounces"));
        assert_near(mean(truth.bounce1.as_ref().unwrap()), 0.5, 1e-4, "first bounce");
        if bounces <= 4 {
            // Weights stay above the threshold of the roulette: every path returns the same value.
            let worst = truth.indirect.unwrap().standard_error.iter().flatten().fold(0.0f32, |a, &b| a.max(b));
            assert!(worst < 0.05, "a standard error of {worst} where nothing is random");
        }
    }
}

/// A square plate over the origin: openness is 1 minus the form factor of four rectangles that meet above the point.
#[test]
fn occlusion_by_a_parallel_plate() {
    let (half, height) = (1.5, 1.0);
    let mut scene = floor();
    plate(&mut scene, half as f32, height as f32, grey(0.5, 0.0));
    let a = half / height;
    let quarter = 2.0 * a / f64::sqrt(1.0 + a * a) * (a / f64::sqrt(1.0 + a * a)).atan() / (2.0 * PI);
    for (radius, expected) in [(0.0, 1.0 - 4.0 * quarter), (0.9, 1.0)] {
        let request = Request { ambient_occlusion: Some(radius), ..Request::new(down_at_origin(), [16, 16]) };
        let truth = trace(&scene, &request, 400);
        // The image is 9 mm wide: the form factor changes by less than 1e-4 over it.
        assert_near(mean_grey(truth.ambient_occlusion.as_ref().unwrap()), expected, 1e-4, "plate");
        // The same through whole paths, which have to find the nearest hit.
        let truth = trace(&scene, &Request { bounces: 1, ..request }, 100);
        assert_near(mean_grey(truth.ambient_occlusion.as_ref().unwrap()), expected, 1e-4, "plate, with bounces");
    }
}

/// A ball straight above the origin hides the part (R / d)^2 of the cosine-weighted hemisphere.
#[test]
fn occlusion_by_a_ball() {
    let (radius, distance) = (0.7f32, 1.6f32);
    let mut scene = floor();
    scene.meshes.push(ball([0.0, distance, 0.0], radius));
    let request = Request { ambient_occlusion: Some(0.0), ..Request::new(down_at_origin(), [16, 16]) };
    let truth = trace(&scene, &request, 400);
    let expected = 1.0 - f64::from(radius / distance).powi(2);
    // 128 facets around: the inscribed polyhedron is thinner by less than 1 - cos(pi / 64)^2 = 0.24 % in area.
    assert_near(mean_grey(truth.ambient_occlusion.as_ref().unwrap()), expected, 0.0024 * (1.0 - expected), "ball");
}

/// A glowing plate lights the origin by its radiance times its form factor, and all of that is the first bounce.
#[test]
fn light_of_a_glowing_plate() {
    let mut scene = floor();
    plate(&mut scene, 1.0, 1.0, grey(0.0, 3.0));
    let quarter = 2.0 / f64::sqrt(2.0) * f64::sqrt(0.5).atan() / (2.0 * PI);
    let request = Request { bounce1: true, bounces: 3, ..Request::new(down_at_origin(), [16, 16]) };
    let truth = trace(&scene, &request, 400);
    assert_near(mean(truth.bounce1.as_ref().unwrap()), 3.0 * 4.0 * quarter, 1e-3, "first bounce");
    assert_near(mean(truth.indirect.as_ref().unwrap()), 3.0 * 4.0 * quarter, 1e-3, "a black plate sends nothing back");
}

/// Point, spot and directional light on a floor of albedo 0.5: albedo / pi * irradiance * cosine.
#[test]
fn direct_light() {
    let (height, intensity) = (2.0, 5.0);
    let position = [1.0, height, 0.0];
    let square = 1.0 + f64::from(height).powi(2);
    let irradiance = f64::from(intensity) / square * f64::from(height) / square.sqrt();
    // The axis is 20 degrees away from the origin; intensity falls from 10 to 30 degrees, so half of it is left.
    let to_origin = f64::atan2(-1.0, f64::from(-height));
    let axis = to_origin + 20f64.to_radians();
    let spot = |half_angle_degrees, full_intensity_half_angle_degrees| Light::Spot {
        position,
        direction: [axis.sin() as f32, axis.cos() as f32, 0.0],
        intensity: [intensity; 3],
        half_angle_degrees,
        full_intensity_half_angle_degrees,
    };
    let sun = Light::Directional { direction: [3.0, -4.0, 0.0], irradiance: [intensity; 3] };
    let cases = [
        (Light::Point { position, intensity: [intensity; 3] }, irradiance),
        (spot(30.0, 10.0), irradiance / 2.0),
        (spot(19.9, 19.9), 0.0),
        (spot(20.1, 20.1), irradiance),
        (sun, f64::from(intensity) * 0.8),
    ];
    for (light, expected) in cases {
        let scene = Scene { lights: vec![light], ..floor() };
        let camera = halflight_scenes::Camera { vertical_fov_degrees: 1e-3, ..down_at_origin() };
        let truth = trace(&scene, &Request::new(camera, [4, 4]), 1);
        for value in truth.direct.iter().flatten() {
            let expected = 0.5 / PI * expected;
            // The inverse cosine of a GPU is good to about 1e-4; only the soft edge of a cone depends on it.
            assert!(
                (f64::from(*value) - expected).abs() <= 2e-4 * expected,
                "{light:?}: {value} instead of {expected}"
            );
        }
        // A plate between light and floor.
        let mut scene = scene;
        plate(&mut scene, 0.2, 0.25, grey(0.5, 0.0));
        scene.meshes.last_mut().unwrap().positions.iter_mut().for_each(|p| p[0] += 0.25);
        let truth = trace(&scene, &Request::new(down_at_origin(), [4, 4]), 1);
        let shadowed = !matches!(light, Light::Directional { .. });
        assert_eq!(truth.direct.iter().flatten().all(|&v| v == 0.0), shadowed || expected == 0.0, "{light:?}");
    }
}

/// Only what the eye sees, on the side that it sees, counts as on screen.
#[test]
fn on_screen_split() {
    let camera = halflight_scenes::Camera {
        eye: [0.0, 1.0, 4.0],
        target: [0.0, 1.0, 0.0],
        vertical_fov_degrees: 40.0,
        ..Default::default()
    };
    // The wall at z = 0 faces the eye. A glowing plate lies behind the eye (off screen), stands beside the wall within
    // the image with its glow towards both, or hangs before the wall with its back to the eye.
    let plates = [
        ("behind the eye", [-1.0, 0.0, 6.0], [0.0, 2.0, 0.0], 0.0),
        ("lying in the image", [-0.5, 0.0, 0.5], [0.0, 0.0, 0.5], 1.0),
        ("back to the eye", [-0.3, 0.7, 0.8], [0.0, 0.6, 0.0], 0.0),
    ];
    for (what, corner, v, part) in plates {
        let mut scene = Scene::default();
        add_quad(&mut scene, [-1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], grey(0.5, 0.0));
        add_quad(&mut scene, corner, [-2.0 * corner[0], 0.0, 0.0], v, grey(0.0, 1.0));
        let request = Request { bounce1: true, on_screen: true, ..Request::new(camera, [24, 24]) };
        let truth = trace(&scene, &request, 200);
        let (all, error) = mean(truth.bounce1.as_ref().unwrap());
        let (seen, _) = mean(truth.on_screen.as_ref().unwrap());
        assert!(all > 20.0 * error, "{what}: the plate lights the wall");
        // The same samples feed both sums.
        assert!((seen - part * all).abs() < 1e-3 * all, "{what}: {seen} of {all} is on screen");
    }
}

fn floor() -> Scene {
    let mut scene = Scene::default();
    add_quad(&mut scene, [-50.0, 0.0, 50.0], [100.0, 0.0, 0.0], [0.0, 0.0, -100.0], grey(0.5, 0.0));
    scene
}

/// A square around the y axis, `half` wide to each side. The eye of `down_at_origin` is under it.
fn plate(scene: &mut Scene, half: f32, height: f32, material: halflight_scenes::Material) {
    add_quad(scene, [-half, height, -half], [2.0 * half, 0.0, 0.0], [0.0, 0.0, 2.0 * half], material);
}

/// A ball of 128 x 64 facets, smooth normals.
fn ball(centre: [f32; 3], radius: f32) -> Mesh {
    let (around, down) = (128u32, 64u32);
    let mut mesh = Mesh::default();
    for j in 0..=down {
        for i in 0..=around {
            let (theta, phi) = (PI * f64::from(j) / f64::from(down), 2.0 * PI * f64::from(i) / f64::from(around));
            let n = [theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()].map(|v| v as f32);
            mesh.positions.push(std::array::from_fn(|k| centre[k] + radius * n[k]));
            mesh.normals.push(n);
            mesh.uvs.push([0.0; 2]);
            if i < around && j < down {
                let [a, b] = [j * (around + 1) + i, (j + 1) * (around + 1) + i];
                mesh.indices.extend([a, b, a + 1, a + 1, b, b + 1]);
            }
        }
    }
    mesh
}
