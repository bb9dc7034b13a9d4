//! Light that rays find by chance only seldom: small lamps, and suns in a sky. It is drawn instead.

use std::f64::consts::PI;

use glam::DVec3;
use halflight_native::{AdapterChoice, NativeGpu, truth::TruthSource};
use halflight_renderer::truth::{Request, Stop};
use halflight_scenes::{Environment, Light, Material, Mesh, Scene, Texture};

use crate::{add_quad, assert_near, down_at_origin, grey, mean, trace};

fn floor(albedo: f32) -> Scene {
    let mut scene = Scene::default();
    add_quad(&mut scene, [-50.0, 0.0, 50.0], [100.0, 0.0, 0.0], [0.0, 0.0, -100.0], grey(albedo, 0.0));
    scene
}

fn add_triangle(scene: &mut Scene, corners: [[f32; 3]; 3], material: Material) {
    let [a, b, c] = corners.map(glam::Vec3::from);
    scene.meshes.push(Mesh {
        positions: corners.to_vec(),
        normals: vec![(b - a).cross(c - a).normalize().to_array(); 3],
        uvs: vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
        indices: vec![0, 1, 2],
        material: scene.materials.len(),
        ..Mesh::default()
    });
    scene.materials.push(material);
}

/// Form factor from the origin, facing +y, to a polygon above it (Lambert 1760).
fn form_factor(corners: &[[f32; 3]]) -> f64 {
    let unit = |i: usize| DVec3::from(corners[i % corners.len()].map(f64::from)).normalize();
    let sum: f64 =
        (0..corners.len()).map(|i| unit(i).angle_between(unit(i + 1)) * unit(i).cross(unit(i + 1)).normalize().y).sum();
    sum.abs() / (2.0 * PI)
}

/// A lamp of 2 cm at a distance of 2 m: one ray in 70,000 finds it.
const LAMP: [[f32; 3]; 3] = [[0.5, 2.0, 0.1], [0.52, 2.0, 0.1], [0.5, 2.003, 0.12]];

#[test]
fn a_small_lamp_is_found_from_both_sides() {
    let expected = 300.0 * form_factor(&LAMP);
    let [a, b, c] = LAMP;
    for corners in [[a, b, c], [a, c, b]] {
        let mut scene = floor(0.5);
        add_triangle(&mut scene, corners, grey(0.0, 300.0));
        let request = Request { bounce1: true, bounces: 2, ..Request::new(down_at_origin(), [16, 16]) };
        let truth = trace(&scene, &request, 16);
        for estimate in [&truth.bounce1, &truth.indirect] {
            let (value, error) = mean(estimate.as_ref().unwrap());
            // The lamp is so small that every point on it sends nearly the same.
            assert!(error < 2e-4 * expected, "standard error {error} of {expected}");
            // The image is 9 mm wide: the form factor changes by less than 1e-3 over it.
            assert_near((value, error), expected, 1e-3 * expected, "a small lamp");
        }
    }
}

/// A lamp near a floor, where neither kind of sample alone has little noise: the two must not count light twice.
#[test]
fn a_large_lamp_close_by_counts_once() {
    for height in [0.02, 0.3, 2.0] {
        let corners = [[-1.0, height, -1.0], [1.0, height, -1.0], [1.0, height, 1.0], [-1.0, height, 1.0]];
        let mut scene = floor(0.5);
        add_quad(&mut scene, corners[0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0], grey(0.0, 3.0));
        let camera = halflight_scenes::Camera { eye: [0.0, height / 2.0, 0.0], ..down_at_origin() };
        let request = Request { bounces: 1, ..Request::new(camera, [16, 16]) };
        let expected = 3.0 * form_factor(&corners);
        let light = mean(trace(&scene, &request, 100).indirect.as_ref().unwrap());
        assert_near(light, expected, 1e-4 * expected, &format!("a lamp at {height}"));
    }
}

/// Half of the lamp is cut out by an alpha mask.
#[test]
fn cut_out_parts_of_a_lamp_send_nothing() {
    let mut scene = floor(0.5);
    let pixel = |alpha: u8| [255, 255, 255, alpha];
    scene.textures.push(Texture { name: "mask".into(), width: 2, height: 1, rgba: [pixel(0), pixel(255)].concat() });
    add_quad(&mut scene, [-1.0, 1.0, -1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0], grey(0.0, 3.0));
    scene.meshes[1].uvs = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    scene.materials[1].alpha_texture = Some(0);
    let present = [[0.0, 1.0, -1.0], [1.0, 1.0, -1.0], [1.0, 1.0, 1.0], [0.0, 1.0, 1.0]];
    let request = Request { bounces: 1, ..Request::new(down_at_origin(), [16, 16]) };
    let light = mean(trace(&scene, &request, 200).indirect.as_ref().unwrap());
    let expected = 3.0 * form_factor(&present);
    // The image is 9 mm wide, and the cut is above it.
    assert_near(light, expected, 1e-2 * expected, "half a lamp");
}

/// A dim sky with a sun of one texel, which covers a 26,000th of the sphere.
fn sunny() -> Environment {
    let (width, height) = (256, 128);
    let mut texels = vec![[0.1; 3]; (width * height) as usize];
    texels[(40 * width + 77) as usize] = [2000.0; 3];
    Environment { map: None, width, height, texels }
}

/// Irradiance over pi of a floor under this sky: every texel in closed form.
fn irradiance(sky: &Environment) -> f64 {
    let (width, height) = (f64::from(sky.width), f64::from(sky.height));
    let texel = |(index, texel): (usize, &[f32; 3])| {
        let row = (index / sky.width as usize) as f64;
        let [top, bottom] = [row, row + 1.0].map(|row| (row / height).min(0.5) * PI);
        f64::from(texel[0]) * 2.0 * PI / width * (bottom.sin().powi(2) - top.sin().powi(2)) / 2.0
    };
    sky.texels.iter().enumerate().map(texel).sum::<f64>() / PI
}

#[test]
fn a_sun_in_the_sky_is_found() {
    let scene = Scene { environment: Some(sunny()), ..floor(0.5) };
    let expected = irradiance(scene.environment.as_ref().unwrap());
    let request = Request { bounce1: true, on_screen: true, bounces: 3, ..Request::new(down_at_origin(), [16, 16]) };
    let truth = trace(&scene, &request, 100);
    for estimate in [&truth.bounce1, &truth.indirect, &truth.on_screen] {
        let (value, error) = mean(estimate.as_ref().unwrap());
        assert!(error < 0.01 * expected, "standard error {error} of {expected}");
        assert_near((value, error), expected, 0.0, "a sun in the sky");
    }
}

#[test]
fn lamp_and_sun_share_the_samples() {
    let mut scene = Scene { environment: Some(sunny()), ..floor(0.5) };
    add_triangle(&mut scene, LAMP, grey(0.0, 3e4));
    let expected = irradiance(scene.environment.as_ref().unwrap()) + 3e4 * form_factor(&LAMP);
    let request = Request { bounces: 1, ..Request::new(down_at_origin(), [16, 16]) };
    let light = mean(trace(&scene, &request, 200).indirect.as_ref().unwrap());
    // The lamp hides less than 1e-4 of the sky, and not the sun.
    assert_near(light, expected, 2e-3 * expected, "a lamp and a sun");
}

/// Units of length change the densities by their squares.
#[test]
fn the_unit_of_length_does_not_matter() {
    let light = |unit: f32| {
        let mut scene = floor(0.5);
        add_triangle(&mut scene, LAMP, grey(0.0, 300.0));
        let positions = scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions).flatten();
        positions.for_each(|v| *v *= unit);
        let mut camera = down_at_origin();
        camera.eye = camera.eye.map(|v| v * unit);
        let request = Request { bounces: 1, ..Request::new(camera, [16, 16]) };
        mean(trace(&scene, &request, 16).indirect.as_ref().unwrap()).0
    };
    let metres = light(1.0);
    // Powers of two: rounding is the same in every unit, except at the constants that guard against 0.
    for unit in [2f32.powi(-20), 2f32.powi(-10), 2f32.powi(20)] {
        let other = light(unit);
        assert!((other - metres).abs() < 1e-3 * metres, "{other} instead of {metres} in units of {unit}");
    }
}

/// The true value lies within two stated standard errors about as often as it should.
#[test]
fn stated_errors_hold_for_rare_light() {
    let mut scene = Scene { environment: Some(sunny()), ..floor(0.5) };
    add_triangle(&mut scene, LAMP, grey(0.0, 3e4));
    let expected = irradiance(scene.environment.as_ref().unwrap()) + 3e4 * form_factor(&LAMP);
    let within = (0..32)
        .filter(|&seed| {
            let request = Request { bounces: 1, seed, ..Request::new(down_at_origin(), [16, 16]) };
            let (value, error) = mean(trace(&scene, &request, 8).indirect.as_ref().unwrap());
            (value - expected).abs() <= 2.0 * error
        })
        .count();
    // 95 % are expected. Fewer than 29 of 32, that is 90 %, would occur by chance in one of 14 choices of seeds.
    assert!(within >= 29, "{within} of 32 seeds within two standard errors");
}

#[test]
fn an_image_without_light_has_no_known_error() {
    let gpu = NativeGpu::open(&AdapterChoice::Any).unwrap();
    let request = Request { bounces: 1, ..Request::new(down_at_origin(), [16, 16]) };
    let traced = |scene: &Scene| {
        let stop = Stop { samples_per_pixel: 64, ..Stop::at_rel_error(0.02) };
        let traced = TruthSource::new(&gpu.gpu, scene, None).trace(&request, stop, &mut |_| ()).unwrap();
        (traced.rel_error, traced.truth.samples)
    };
    // A lamp above a ceiling that hides it.
    let mut hidden = floor(0.5);
    add_quad(&mut hidden, [-50.0, 1.0, -50.0], [100.0, 0.0, 0.0], [0.0, 0.0, 100.0], grey(0.5, 0.0));
    hidden.lights.push(Light::Point { position: [0.0, 5.0, 0.0], intensity: [100.0; 3] });
    assert_eq!(traced(&hidden), (None, 64), "all samples are spent");
    // Without any light, black is exact.
    assert_eq!(traced(&floor(0.5)), (Some(0.0), 16));
}
