//! Scenes whose light is known on paper.

use std::{f64::consts::PI, path::Path};

use halflight_renderer::truth::Request;
use halflight_scenes::{DiskFiles, Light, Material, Mesh, Scene, load_scene};

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

/// A glossy floor under a white surround sends Ks times its lobe's albedo: 1 for an eye straight above, whatever the
/// exponent, and less where the horizon cuts the lobe.
#[test]
fn a_lobe_in_a_white_surround_sends_its_albedo() {
    let specular = [0.5, 0.25, 0.0];
    for exponent in [0.0, 4.0, 32.0, 128.0, 1e6] {
        let mut scene = Scene::default();
        let material = Material { specular, phong_exponent: exponent, ..grey(0.0, 0.0) };
        add_quad(&mut scene, [-1.0, 0.0, 1.0], [2.0, 0.0, 0.0], [0.0, 0.0, -2.0], material);
        let (x, y, z) = ([20.0, 0.0, 0.0], [0.0, 20.0, 0.0], [0.0, 0.0, 20.0]);
        for (corner, u, v) in [
            ([-10.0, 10.0, -10.0], x, z),
            ([-10.0; 3], x, y),
            ([-10.0, -10.0, 10.0], x, y),
            ([-10.0; 3], y, z),
            ([10.0, -10.0, -10.0], y, z),
        ] {
            add_quad(&mut scene, corner, u, v, grey(0.0, 1.0));
        }
        for degrees in [0.0f32, 60.0, 85.0] {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            let camera = halflight_scenes::Camera { eye: [0.0, 0.5 * cosine, 0.5 * sine], ..down_at_origin() };
            let camera = halflight_scenes::Camera { vertical_fov_degrees: 0.1, ..camera };
            let truth = trace(&scene, &Request { glossy: true, ..Request::new(camera, [16, 16]) }, 200);
            let expected = specular.iter().map(|&ks| f64::from(ks)).sum::<f64>() / 3.0
                * lobe_albedo(f64::from(exponent), f64::from(degrees).to_radians());
            // 0.1 degrees of view change the albedo by less than 1e-3; float32's powers of cosines lose 1e-4 at 1e6.
            let glossy = mean(truth.glossy.as_ref().unwrap());
            assert_near(glossy, expected, 2e-3 * expected, &format!("exponent {exponent} at {degrees} degrees"));
            assert!(truth.glossy.unwrap().mean.iter().all(|pixel| pixel[2] == 0.0), "Ks of blue is 0");
        }
    }
}

/// Integral of (s + 2) / (2 pi) cos^s(angle to the mirror direction) cos(angle to the normal), over the hemisphere.
fn lobe_albedo(exponent: f64, mirror_angle: f64) -> f64 {
    // In coordinates of the lobe: equal steps of u = cos^(s + 1) carry equal shares of its density.
    let (along, around) = (2000, 720);
    let mut sum = 0.0;
    for i in 0..along {
        let cosine = ((f64::from(i) + 0.5) / f64::from(along)).powf(1.0 / (exponent + 1.0));
        let sine = (1.0 - cosine * cosine).sqrt();
        for j in 0..around {
            let turn = 2.0 * PI * (f64::from(j) + 0.5) / f64::from(around);
            sum += (cosine * mirror_angle.cos() + sine * turn.cos() * mirror_angle.sin()).max(0.0);
        }
    }
    (exponent + 2.0) / (exponent + 1.0) * sum / f64::from(along * around)
}

/// What only receives light sends as much as black matter does.
#[test]
fn what_only_receives_is_a_black_source() {
    let camera = halflight_scenes::Camera { eye: [0.0, 0.9, 3.0], target: [0.0, 0.5, 0.0], ..Default::default() };
    let light = |receive_only: bool, albedo: f32| {
        let polished = Material { specular: [0.5; 3], phong_exponent: 16.0, ..grey(0.5, 0.0) };
        let mut scene = Scene {
            lights: vec![Light::Directional { direction: [0.1, -1.0, -0.8], irradiance: [3.0; 3] }],
            ..Scene::default()
        };
        add_quad(&mut scene, [-2.0, 0.0, 2.0], [4.0, 0.0, 0.0], [0.0, 0.0, -4.0], polished);
        add_quad(
            &mut scene,
            [-1.0, 0.0, -0.5],
            [2.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            Material { receive_only, ..grey(albedo, 0.0) },
        );
        let request = Request { bounce1: true, bounces: 3, glossy: true, ..Request::new(camera, [24, 16]) };
        trace(&scene, &request, 16)
    };
    let (silent, black, grey) = (light(true, 0.5), light(false, 0.0), light(false, 0.5));
    assert_eq!(silent.indirect, black.indirect);
    assert_eq!(silent.bounce1, black.bounce1);
    assert_eq!(silent.glossy, black.glossy);
    assert_eq!(silent.direct, grey.direct, "its direct light shows");
    assert_ne!(silent.indirect, grey.indirect);
    assert_ne!(silent.glossy, grey.glossy);
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
