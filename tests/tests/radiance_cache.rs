//! The radiance cache against closed forms and the path tracer.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use halflight_evaluator::experiment::session::{Frames, Session};
use halflight_native::{images::Rgb, truth::TruthSource};
use halflight_renderer::truth::{Request as TruthRequest, Stop, Truth};
use halflight_scenes::{Camera, CameraKeyframe, Environment, Keyframe, Light, Material, Motion, Scene};
use halflight_soundness::scenes;
use halflight_tests::{bundled, device, frames, mean_luminance, request};

const SIZE: [u32; 2] = [256, 176];

/// Incident light after frames `0..count`.
fn light_after(frames: &mut Frames, count: u32) -> Vec<Rgb> {
    (0..count).for_each(|frame| drop(frames.run(frame).unwrap()));
    frames.read_rgb("indirect").unwrap().unwrap()
}

fn reference(scene: &Scene, bounces: u32) -> Truth {
    let request = TruthRequest { bounces, ..TruthRequest::new(scene.camera, SIZE) };
    let stop = Stop { samples_per_pixel: 256, rel_error: None, error_block: 8 };
    TruthSource::new(&device().gpu, scene, None).trace(&request, stop, &mut |_| {}).unwrap().truth
}

/// Mean of `albedo * light` over the picture.
fn mean_of(albedo: &[Rgb], light: &[Rgb]) -> f64 {
    let product: Vec<Rgb> = albedo.iter().zip(light).map(|(a, l)| std::array::from_fn(|c| a[c] * l[c])).collect();
    mean_luminance(&product)
}

#[test]
fn the_mean_is_that_of_the_path_tracer() {
    // Records of hits are up to a fifth of the picture wide at this size, and the mean over them loses up to 4 %.
    for (name, bounces, setting) in [("cornell", 1, "1"), ("cornell", 2, "2"), ("cornell", 12, "0"), ("bars", 12, "0")]
    {
        let scene = bundled(name);
        let truth = reference(&scene, bounces);
        let session = Session::new(device(), &scene);
        let mut frames = frames(&session, &request("radiance-cache", &[("bounces", setting)], SIZE));
        let light = light_after(&mut frames, 48);
        let ratio = mean_of(&truth.albedo, &light) / mean_of(&truth.albedo, &truth.indirect.unwrap().mean);
        println!("{name}, {bounces} bounces: {ratio:.4}");
        assert!((ratio - 1.0).abs() < 0.05, "{name}, {bounces} bounces: {ratio:.4}");
    }
}

/// In a closed room with walls of albedo a that emit 1, incident light is 1 / (1 - a) everywhere.
#[test]
fn a_furnace_sums_the_series() {
    let corner = Vec3::splat(-1.0);
    let mut meshes = Vec::new();
    for axis in 0..3 {
        let [u, v] = [1, 2].map(|step| 2.0 * Vec3::AXES[(axis + step) % 3]);
        meshes.push(scenes::quad(corner, u, v, 0));
        meshes.push(scenes::quad(corner + 2.0 * Vec3::AXES[axis], u, v, 0));
    }
    let material = Material { albedo: [0.5; 3], emission: [1.0; 3], ..Material::default() };
    let camera = Camera { eye: [0.1, 0.0, 0.8], target: [0.0, 0.0, -1.0], ..Camera::default() };
    let scene = Scene { meshes, materials: vec![material], camera, ..Scene::default() };
    let session = Session::new(device(), &scene);
    let mut frames = frames(&session, &request("radiance-cache", &[("storage", "float32")], SIZE));
    let light = light_after(&mut frames, 64);
    for [value, ..] in light {
        // Every ray finds the same light. What is left are the albedos of 8 links, which are rounded to 5 bits of their
        // square root at random: 0.459 or 0.504 instead of 0.5, with a mean within 0.005. This counts twice in the sum.
        assert!((1.9..2.04).contains(&value), "{value}");
    }
}

#[test]
fn two_runs_agree_bit_for_bit() {
    let scene = bundled("cornell");
    let session = Session::new(device(), &scene);
    let request = request("radiance-cache", &[], SIZE);
    let [first, second] = [(); 2].map(|()| light_after(&mut frames(&session, &request), 6));
    assert_eq!(first, second);
}

/// The camera is in a dark room beside a lit one. The wall between them is thinner than a record.
#[test]
fn no_light_comes_through_a_thin_wall() {
    // Surfaces overlap at the edges, because rays may pass between two that only touch.
    let wall = |x: f32| scenes::quad(Vec3::new(x, -0.1, -2.1), 4.2 * Vec3::Z, 3.2 * Vec3::Y, 0);
    let mut meshes = vec![wall(-3.0), wall(0.0), wall(0.002), wall(3.0)];
    for y in [0.0, 3.0] {
        meshes.push(scenes::quad(Vec3::new(-3.1, y, -2.1), 6.2 * Vec3::X, 4.2 * Vec3::Z, 0));
    }
    for z in [-2.0, 2.0] {
        meshes.push(scenes::quad(Vec3::new(-3.1, -0.1, z), 6.2 * Vec3::X, 3.2 * Vec3::Y, 0));
    }
    let camera = Camera { eye: [-2.5, 1.5, 1.0], target: [0.0, 0.5, -1.0], ..Camera::default() };
    let lights = vec![Light::Point { position: [1.5, 2.0, 0.0], intensity: [10.0; 3] }];
    let scene = Scene { meshes, materials: vec![scenes::grey(0.8)], camera, lights, ..Scene::default() };
    let session = Session::new(device(), &scene);
    let light = light_after(&mut frames(&session, &request("radiance-cache", &[], SIZE)), 24);
    let brightest = light.iter().flatten().fold(0.0f32, |most, &v| most.max(v));
    // No ray passes. But the filter of the shadow map reaches 1.5 texels of 1 mm beyond the wall, and lights that strip of
    // floor with a radiance of at most 0.6. From the middle of the room it covers 5e-4 of the hemisphere.
    assert!(brightest < 3e-4, "{brightest:e}");
}

/// A lamp turns by 30 degrees in one frame. The links that records keep are lit again, without new rays for them.
#[test]
fn light_follows_a_lamp() {
    let mut scene = bundled("cornell");
    let angles = [(0, 0.0), (23, 0.0), (24, 30.0)];
    let key = |(frame, angle): (u32, f32)| Keyframe { frame, rotate_degrees: [0.0, 0.0, angle], ..Keyframe::default() };
    scene.moves.lights.push((0, Motion { pivot: [0.0, 1.95, 0.0], keyframes: angles.map(key).to_vec() }));
    let truth = reference(&scene.posed(24), 12);
    let session = Session::new(device(), &scene);
    let mut frames = frames(&session, &request("radiance-cache", &[], SIZE));
    let before = light_after(&mut frames, 24);
    let after = light_after_from(&mut frames, 24, 32);
    let converged = light_after_from(&mut frames, 32, 72);
    let wanted = mean_of(&truth.albedo, &truth.indirect.as_ref().unwrap().mean);
    let [before, after, converged] = [&before, &after, &converged].map(|light| mean_of(&truth.albedo, light) / wanted);
    println!("before {before:.3}, after 8 frames {after:.3}, converged {converged:.3}");
    assert!((before - 1.0).abs() > 0.1, "the light hardly changes: {before}");
    // 8 links a record leave noise, which the mean over the picture does not have.
    assert!((after / converged - 1.0).abs() < 0.1, "after 8 frames {after}, converged {converged}");
}

/// An emissive block moves through a room and stops. Rays find it where it is, and points are drawn on it there.
#[test]
fn light_follows_an_object() {
    let mut scene = bundled("motion");
    scene.moves.camera.clear();
    // The block stops in frame 40.
    let truth = reference(&scene.posed(40), 12);
    let session = Session::new(device(), &scene);
    let mut frames = frames(&session, &request("radiance-cache", &[], SIZE));
    let moving = light_after(&mut frames, 41);
    let stopped = light_after_from(&mut frames, 41, 80);
    let wanted = truth.indirect.unwrap().mean;
    let width = SIZE[0] as usize;
    let half = |image: &[Rgb], right: bool| -> Vec<Rgb> {
        let inside = |(index, _): &(usize, &Rgb)| (index % width >= width / 2) == right;
        image.iter().enumerate().filter(inside).map(|(_, &value)| value).collect()
    };
    for right in [false, true] {
        let albedo = half(&truth.albedo, right);
        let mean = |light: &[Rgb]| mean_of(&albedo, &half(light, right)) / mean_of(&albedo, &half(&wanted, right));
        let (moving, stopped) = (mean(&moving), mean(&stopped));
        println!("right half: {right}, moving {moving:.3}, stopped {stopped:.3}");
        // The records of hits are wide at this size and lose up to 5 %.
        assert!((stopped - 1.0).abs() < 0.06, "right half: {right}, {stopped}");
        // While emitters move, records keep at most 8 rays: noise, which the mean has less of.
        assert!((moving - 1.0).abs() < 0.1, "right half: {right}, {moving}");
    }
}

fn light_after_from(frames: &mut Frames, first: u32, end: u32) -> Vec<Rgb> {
    (first..end).for_each(|frame| drop(frames.run(frame).unwrap()));
    frames.read_rgb("indirect").unwrap().unwrap()
}

/// Every ray of a convex surface sees the sky.
#[test]
fn an_even_sky_is_exact_from_the_first_frame() {
    let scene = Scene {
        meshes: vec![scenes::quad(Vec3::new(-50.0, 0.0, 50.0), 100.0 * Vec3::X, -100.0 * Vec3::Z, 0)],
        materials: vec![scenes::grey(0.5)],
        environment: Some(Environment::constant([0.25, 0.5, 1.0])),
        camera: Camera { eye: [0.0, 2.0, 0.0], target: [0.0, 0.0, -2.0], ..Camera::default() },
        ..Scene::default()
    };
    let session = Session::new(device(), &scene);
    let light = light_after(&mut frames(&session, &request("radiance-cache", &[("storage", "float32")], SIZE)), 1);
    for value in light {
        for (own, sky) in value.into_iter().zip([0.25, 0.5, 1.0]) {
            // Rounding of means.
            assert!((own - sky).abs() < 1e-4, "{value:?}");
        }
    }
}

/// The camera looks away from a corner, to a floor from which no ray hits anything, until the records of the corner are
/// removed.
#[test]
fn links_refer_to_the_records_of_what_they_hit() {
    let floor = |x: f32| scenes::quad(Vec3::new(x - 4.0, 0.0, 4.0), 8.0 * Vec3::X, -8.0 * Vec3::Z, 0);
    let wall = scenes::quad(Vec3::new(-14.0, 0.0, -4.0), 8.0 * Vec3::X, 6.0 * Vec3::Y, 0);
    let camera = Camera { eye: [0.0, 4.0, 14.0], target: [-10.0, 1.0, -2.0], ..Camera::default() };
    let mut scene = Scene {
        meshes: vec![floor(-10.0), wall, floor(10.0)],
        materials: vec![scenes::grey(0.5)],
        lights: vec![scenes::sun()],
        camera,
        ..Scene::default()
    };
    let key = |frame, x| CameraKeyframe { frame, eye: camera.eye, target: [x, 1.0, -2.0], cut: false };
    scene.moves.camera = vec![key(0, -10.0), key(8, -10.0), key(16, 10.0), key(90, 10.0)];
    let session = Session::new(device(), &scene);
    // So few rays that most records of hits are not hit in every frame.
    let mut frames = frames(&session, &request("radiance-cache", &[("rays", "128"), ("spacing", "2")], [64, 48]));
    for frame in 0..=90 {
        frames.run(frame).unwrap();
        let words = |name: &str| -> Vec<u32> {
            let bytes = frames.read_buffer(name).unwrap().unwrap();
            bytes.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect()
        };
        let (buckets, records, links) = (words("buckets"), words("records"), words("links"));
        // Twin of `Bucket` in radiance_cache/cells.wgsl: eight fingerprints before eight cells of six words.
        let is_taken = |slot: usize| buckets[slot / 8 * 56 + slot % 8] != 0;
        let mut checked = 0;
        for slot in (0..buckets.len() / 7).filter(|&slot| is_taken(slot)) {
            // Twin of `Record`: the number of links is word 15, level and bin are word 3.
            let count = records[16 * slot + 15].min(8) as usize;
            for link in links[32 * slot..][..4 * count].chunks_exact(4).filter(|link| link[3] & 0xfffff != 0xfffff) {
                let source = (link[3] & 0xfffff) as usize;
                assert!(is_taken(source), "frame {frame}: a link refers to an empty slot");
                assert!(records[16 * source + 3] & 128 != 0, "frame {frame}: a link refers to a record of pixels");
                checked += 1;
            }
        }
        assert!(checked > 20 || !(2..60).contains(&frame), "frame {frame}: only {checked} links");
    }
}

#[test]
fn memory_is_bounded() {
    let scene = bundled("atrium");
    let session = Session::new(device(), &scene);
    let frames = frames(&session, &request("radiance-cache", &[], [1280, 720]));
    let plan = frames.plan();
    let shown = plan.resources.iter().find(|resource| resource.name == "final").unwrap();
    // Beyond the image to show: 92,160 slots of 276 bytes, 2.7 MB of rays, 1.8 MB of lists of pixels, and 18.4 MB of images.
    let own = plan.technique_bytes() - shown.bytes();
    assert!(own <= 48_000_000, "{own} bytes");
}
