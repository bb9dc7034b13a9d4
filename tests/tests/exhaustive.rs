//! The exhaustive sum against a double-precision sum over the same G-buffer, and against closed forms.
#![allow(clippy::unwrap_used)]

use glam::{DVec3, Vec3};
use halflight_evaluator::experiment::session::Session;
use halflight_scenes::{Camera, Scene};
use halflight_soundness::{
    oracle::{GBuffer, Pixel},
    scenes,
};
use halflight_tests::{bundled, device, frames, request};

/// Largest error of the shader's sum relative to the pixel's value, or to a hundredth of the mean
/// where the pixel is darker than that: float32 cannot promise more where light of the whole screen
/// all but cancels behind a horizon.
fn largest_error(scene: &Scene, form_factor: &str, size: [u32; 2]) -> f64 {
    let session = Session::new(device(), scene);
    let mut frames = frames(&session, &request("exhaustive", &[("form_factor", form_factor)], size));
    frames.run(0).unwrap();
    let gbuffer = GBuffer::read(&frames);
    let exact = gbuffer.exhaustive(form_factor == "eq4");
    let shader = frames.read_rgb("indirect").unwrap().unwrap();
    let mean = exact.iter().map(|v| v.element_sum() / 3.0).sum::<f64>() / exact.len() as f64;
    assert!(mean > 0.0, "a dark image proves nothing");
    let error = |(exact, got): (&DVec3, &[f32; 3])| {
        let channel = |i: usize| (f64::from(got[i]) - exact[i]).abs() / exact[i].max(0.01 * mean);
        channel(0).max(channel(1)).max(channel(2))
    };
    exact.iter().zip(&shader).map(error).fold(0.0, f64::max)
}

#[test]
fn the_sum_is_the_double_precision_sum() {
    for (name, size) in [("cornell", [64, 36]), ("atrium", [96, 54]), ("bars", [33, 61])] {
        let scene = bundled(name);
        for form_factor in ["eq4", "eq3"] {
            let error = largest_error(&scene, form_factor, size);
            println!("{name} {form_factor}: largest relative error {error:.2e}");
            assert!(error < 1e-4, "{name} {form_factor}: {error:.2e}");
        }
    }
}

/// Form factor from a point with a unit normal to a polygon that lies wholly in front of it
/// (Lambert 1760): corners counter-clockwise as the point sees them.
fn polygon_form_factor(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let ray = |corner: DVec3| (corner - point).normalize();
    let edge = |i: usize| {
        let (a, b) = (ray(corners[i]), ray(corners[(i + 1) % corners.len()]));
        a.cross(b).normalize() * a.angle_between(b)
    };
    (0..corners.len()).map(edge).sum::<DVec3>().dot(normal) / std::f64::consts::TAU
}

/// A black floor, 4 x 4, around the origin and an emitting quad of radiance 2.
fn plate(corner: Vec3, u: Vec3, v: Vec3, camera: Camera) -> Scene {
    Scene {
        meshes: vec![
            scenes::quad(Vec3::new(-2.0, 0.0, 2.0), 4.0 * Vec3::X, -4.0 * Vec3::Z, 0),
            scenes::quad(corner, u, v, 1),
        ],
        materials: vec![scenes::grey(0.0), scenes::emitter(2.0)],
        camera,
        ..Scene::default()
    }
}

/// Mean and root mean square, over that part of the floor that counts, of the relative error of the whole pipeline against the
/// analytic light of the quad.
fn plate_error(scene: &Scene, size: [u32; 2], counts: fn(DVec3) -> bool) -> (f64, f64) {
    let corners: Vec<DVec3> = scene.meshes[1].positions.iter().map(|&p| Vec3::from(p).as_dvec3()).collect();
    let session = Session::new(device(), scene);
    let mut frames = frames(&session, &request("exhaustive", &[], size));
    frames.run(0).unwrap();
    let gbuffer = GBuffer::read(&frames);
    let to_world = frames.view().world_to_view.as_dmat4().inverse();
    let got = frames.read_rgb("indirect").unwrap().unwrap();
    let (mut sum, mut square, mut count) = (0.0, 0.0, 0.0);
    for (pixel, got) in gbuffer.pixels.iter().zip(&got) {
        let position = to_world.transform_point3(pixel.position);
        if pixel.depth > 0.0 && position.y.abs() < 1e-3 && counts(position) {
            let expected = 2.0 * polygon_form_factor(position, DVec3::Y, &corners).abs();
            let error = f64::from(got[0]) / expected - 1.0;
            sum += error;
            square += error * error;
            count += 1.0;
        }
    }
    assert!(count > 300.0, "the floor is hardly seen: {count} pixels");
    (sum / count, (square / count).sqrt())
}

#[test]
fn an_upright_plate_lights_the_floor_as_the_closed_form_says() {
    // All of the plate, 2 x 1.2 at height 0.3, is on the screen, about 40 x 24 pixels of 96 x 72.
    let camera = scenes::camera([0.0, 1.6, 3.5], [0.0, 0.4, 0.0], 50.0);
    let scene = plate(Vec3::new(-1.0, 0.3, -1.5), 2.0 * Vec3::X, 1.2 * Vec3::Y, camera);
    // Behind it the floor is dark in screen space, as the camera sees the front; close by, single
    // pixels of the plate's edge decide.
    let in_front = |floor: DVec3| floor.z > -1.2;
    let (mean, rms) = plate_error(&scene, [96, 72], in_front);
    println!("upright plate: mean error {mean:.4}, rms {rms:.4}");
    // Whole pixels stand for the plate's edges: up to half a pixel of 40 and of 24 on each side, so
    // its seen area is right to (1/40 + 1/24) / 2 = 3.3 % at worst, and that is common to all the floor.
    assert!(mean.abs() < 0.033, "{mean}");
    assert!(rms < 0.04, "{rms}");
    // Twice the pixels along each axis: half the error at the edge.
    let (mean, rms) = plate_error(&scene, [192, 144], in_front);
    println!("upright plate, twice as fine: mean error {mean:.4}, rms {rms:.4}");
    assert!(mean.abs() < 0.017 && rms < 0.02, "{mean} {rms}");
}

#[test]
fn a_plate_overhead_lights_the_floor_as_the_closed_form_says() {
    // The plate faces down, 1.6 x 1.6 at height 2; the camera looks between it and the floor.
    let camera = scenes::camera([0.0, 1.0, 3.0], [0.0, 1.0, 0.0], 85.0);
    let scene = plate(Vec3::new(-0.8, 2.0, -0.8), 1.6 * Vec3::X, 1.6 * Vec3::Z, camera);
    let (mean, rms) = plate_error(&scene, [160, 120], |_| true);
    println!("overhead plate: mean error {mean:.4}, rms {rms:.4}");
    // The plate is 30 to 50 pixels wide and 14 high at a grazing angle: half a pixel of 14 is 3.6 %, of 40 1.3 %.
    assert!(mean.abs() < 0.05, "{mean}");
    assert!(rms < 0.06, "{rms}");
}

#[test]
fn equation_2_is_the_area_that_a_pixel_sees() {
    // A camera of 60 degrees and 1280 x 720 pixels; planes through a point on the ray of a pixel, tilted
    // by up to 80 degrees against the eye, in several directions.
    let tan_half_fov = [16.0 / 9.0 * 30f64.to_radians().tan(), 30f64.to_radians().tan()];
    let size = [1280, 720];
    let gbuffer = GBuffer { size, display_size: size, tan_half_fov, pixels: Vec::new() };
    let ray = |x: f64, y: f64| {
        DVec3::new((2.0 * x / 1280.0 - 1.0) * tan_half_fov[0], (1.0 - 2.0 * y / 720.0) * tan_half_fov[1], -1.0)
    };
    for (x, y) in [(640.5, 360.5), (0.5, 0.5), (1279.5, 300.5), (200.5, 719.5)] {
        for tilt in [0.0, 30.0, 60.0, 80.0f64] {
            for turn in [0.0, 100.0, 220.0f64] {
                let depth = 7.0;
                let position = ray(x, y) * depth;
                let to_eye = -position.normalize();
                let across = to_eye.any_orthonormal_vector();
                let across = across * turn.to_radians().cos() + to_eye.cross(across) * turn.to_radians().sin();
                let normal = to_eye * tilt.to_radians().cos() + across * tilt.to_radians().sin();
                // Where the rays through the pixel's corners meet the plane.
                let corner = |dx: f64, dy: f64| {
                    let ray = ray(x + dx, y + dy);
                    ray * (normal.dot(position) / normal.dot(ray))
                };
                let diagonals = [corner(0.5, 0.5) - corner(-0.5, -0.5), corner(-0.5, 0.5) - corner(0.5, -0.5)];
                let exact = 0.5 * diagonals[0].cross(diagonals[1]).length();
                let pixel = Pixel { depth, position, normal, radiance: DVec3::ZERO };
                let error = gbuffer.surface_area(&pixel, 1.0) / exact - 1.0;
                // Equation 2 takes the slope at the centre for the whole pixel; what it leaves out is the
                // square of (pixel's angle, 1e-3) times (tangent of the tilt, at most 5.7).
                assert!(error.abs() < 1e-4, "pixel {x} {y}, tilt {tilt}, turn {turn}: {error:.2e}");
            }
        }
    }
}

#[test]
fn equation_4_is_bounded_and_meets_equation_3_far_away() {
    let gbuffer = GBuffer { size: [64, 64], display_size: [64, 64], tan_half_fov: [1.0, 1.0], pixels: Vec::new() };
    let at = |position: DVec3, normal: DVec3| Pixel { depth: -position.z, position, normal, radiance: DVec3::ONE };
    // A source that faces the eye and a receiver between the two that faces it at 60 degrees.
    let source = at(DVec3::new(0.0, 0.0, -10.0), DVec3::Z);
    let tilted = DVec3::new(0.75f64.sqrt(), 0.0, -0.5);
    let factor = |distance: f64, disc| {
        gbuffer.form_factor(&at(source.position + DVec3::Z * distance, tilted), &source, 1.0, disc)
    };
    // r -> 0: what remains is the cosine at the receiver.
    assert!((factor(1e-9, true) - 0.5).abs() < 1e-9);
    assert!(factor(1e-9, false) > 1e12);
    let area = gbuffer.surface_area(&source, 1.0);
    for distance in [1e-3, 0.1, 1.0, 5.0] {
        let disc = factor(distance, true);
        assert!(disc <= 0.5, "{disc}");
        // Their ratio is 1 + R^2 / r^2 exactly.
        let expected = 1.0 + area / std::f64::consts::PI / (distance * distance);
        // 10 - 0.001 is rounded at 1e-15, a relative 1e-12 of the distance, twice that of its square.
        assert!((factor(distance, false) / disc / expected - 1.0).abs() < 1e-11);
    }
    // Neither sends light backwards.
    let behind = at(DVec3::new(0.0, 0.0, -11.0), DVec3::Z);
    assert_eq!(gbuffer.form_factor(&behind, &source, 1.0, true), 0.0);
    assert_eq!(gbuffer.form_factor(&at(source.position + DVec3::Z, DVec3::Z), &source, 1.0, true), 0.0);
}

#[test]
fn light_in_a_furnace_stays_under_what_the_walls_send() {
    // Everything emits 0.5, so no point can receive more than 0.5, wherever it looks; with half of the
    // room off the screen it receives less. Pixels sum discs, and in a corner they overlap a little:
    // 2 % above the bound.
    let scene = bundled("furnace");
    let session = Session::new(device(), &scene);
    let mut frames = frames(&session, &request("exhaustive", &[], [96, 72]));
    frames.run(0).unwrap();
    let light = frames.read_rgb("indirect").unwrap().unwrap();
    let largest = light.iter().flatten().fold(0.0f32, |a, &b| a.max(b));
    let mean = light.iter().map(|p| p[0]).sum::<f32>() / light.len() as f32;
    println!("furnace: largest {largest}, mean {mean}");
    assert!(largest < 0.51, "{largest}");
    assert!(mean > 0.15, "{mean}");
}
