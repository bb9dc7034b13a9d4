//! What the filter averages, what it forgets, and when.

use glam::Vec3;
use halflight_evaluator::experiment::session::{Frames, Request, Session};
use halflight_frame_graph::{Changed, CompiledGraph, Externals, ResourceKind};
use halflight_native::images::{Rgb, luminance};
use halflight_renderer::{
    gi::temporal::frames_until,
    parameters::Value,
    plan_frame,
    scene::{SceneBuffers, SceneFacts, camera_view},
};
use halflight_scenes::{CameraKeyframe, Keyframe, Light, Motion, Moves, Scene};
use halflight_soundness::scenes;
use halflight_tests::{bundled, device, frames, known, request, settings};

use super::*;

#[test]
fn a_still_camera_converges_to_the_average_of_independent_frames() {
    let scene = scenes::court();
    let session = Session::new(device(), &scene).keep_all();
    let size = [64, 36];
    // Frames of another seed share no random number with those that the filter sees.
    let other = Request { seed: 7, ..request("hierarchical", &NOISY, size) };
    let independent = lights(&mut frames(&session, &other), 0, 199);
    let (truth, sigma) = (mean(&independent), deviation(&independent));
    for storage in ["float32", "float16"] {
        let mut settings = filtered("0.9");
        settings.push(("storage", storage));
        let mut run = frames(&session, &request("hierarchical", &settings, size));
        let mut at = Vec::new();
        for frame in 0..=255 {
            run.run(frame).unwrap();
            if [0, 255].contains(&frame) {
                at.push(rms(&light(&run), &truth));
            }
        }
        // The first 53 frames, until what came before is under 1/256, count as 19; then every frame counts.
        let n = 255.0 - 53.0 + 19.0;
        let expected = sigma * (1.0 / n + 1.0 / independent.len() as f64).sqrt();
        println!(
            "{storage}: {:.2e} after one frame, {:.2e} after 256; noise gives {sigma:.2e}, {expected:.2e}",
            at[0], at[1]
        );
        assert!(at[0] > 0.7 * sigma, "the first frame is not filtered");
        // Both averages are of thousands of numbers each, so their spread is a few percent; float16 adds
        // half a step of 2^-11 of the light, far below.
        assert!(at[1] < 1.2 * expected, "{} against {expected}", at[1]);
    }
}

/// The court, and far behind the camera a speck that moves in every frame: nothing shows, but no frame is still.
fn restless() -> Scene {
    let mut scene = scenes::court();
    let mut speck = scenes::quad(Vec3::new(0.0, 1.0, 4.5), 0.01 * Vec3::X, 0.01 * Vec3::Y, 0);
    speck.object = Some(0);
    scene.meshes.push(speck);
    let key = |frame, x| Keyframe { frame, translate: [x, 0.0, 0.0], ..Keyframe::default() };
    scene.moves.objects.push(Motion { pivot: [0.0; 3], keyframes: vec![key(0, 0.0), key(1000, 1.0)] });
    scene
}

#[test]
fn flicker_falls_at_least_five_times_at_a_of_nine_tenths() {
    let size = [64, 36];
    let noisy = request("hierarchical", &NOISY, size);
    let (still, restless) = (scenes::court(), restless());
    let (still, restless) = (Session::new(device(), &still).keep_all(), Session::new(device(), &restless).keep_all());
    let unfiltered = deviation(&lights(&mut frames(&still, &noisy), 0, 63));
    // Filtered frames hang together, so their deviation is taken about the average of many others.
    let truth = mean(&lights(&mut frames(&still, &Request { seed: 7, ..noisy.clone() }), 0, 255));
    let own = unfiltered / 256.0_f64.sqrt();
    let of = |images: &[Vec<Rgb>]| {
        let square: f64 = images.iter().map(|image| rms(image, &truth).powi(2)).sum::<f64>() / images.len() as f64;
        unfiltered / (square - own * own).max(0.0).sqrt()
    };
    let filtered = request("hierarchical", &filtered("0.9"), size);
    // A scene in which something moves has an exponential average for good.
    let exponential = of(&lights(&mut frames(&restless, &filtered), 30, 129));
    // A still one averages on after frame 53.
    let images = lights(&mut frames(&still, &filtered), 100, 129);
    let (averaged, flicker) = (of(&images), unfiltered / deviation(&images));
    let independent = (1.9_f64 / 0.1).sqrt();
    println!(
        "deviation {unfiltered:.2e}; exponential {exponential:.2} times lower (independent frames: {independent:.2}); \
         still {averaged:.2}, its flicker {flicker:.1}"
    );
    // Independent frames could not: frames that share out their directions do better. All pixels share one random start,
    // so a hundred frames are only some dozen averages, good for a tenth.
    assert!(averaged >= 5.0 && flicker >= 5.0 && exponential >= 5.0);
}

/// Every texture and every word of history, to compare bit for bit.
fn state(frames: &Frames) -> Vec<(String, Vec<u8>)> {
    let written = ["indirect", "filtered", "final", "history"];
    written.into_iter().filter_map(|name| Some((name.to_owned(), frames.read_bytes(name).unwrap()?))).collect()
}

#[test]
fn after_a_teleport_nothing_of_the_old_image_remains() {
    let mut scene = scenes::court();
    let here = scene.camera;
    let key = |frame, eye: [f32; 3], cut| CameraKeyframe { frame, eye, target: here.target, cut };
    // By a cut in the scene file, by a jump of the eye, and by a turn on the spot.
    let jumped = [1.2, 1.4, 4.0];
    for camera in [
        vec![key(0, here.eye, false), key(10, [0.1, 1.4, 4.0], true)],
        vec![key(0, here.eye, false), key(9, here.eye, false), key(10, jumped, false)],
        vec![
            key(0, here.eye, false),
            key(9, here.eye, false),
            CameraKeyframe { frame: 10, eye: here.eye, target: [3.0, 0.8, 2.0], cut: false },
        ],
    ] {
        scene.moves = Moves { camera, ..Moves::default() };
        let session = Session::new(device(), &scene).keep_all();
        let request = request("hierarchical", &filtered("0.9"), [48, 27]);
        let mut long = frames(&session, &request);
        lights(&mut long, 10, 10);
        // The same frame as the first of a new recording.
        let mut fresh = frames(&session, &request);
        fresh.run(10).unwrap();
        let (long, fresh) = (state(&long), state(&fresh));
        assert_eq!(long.len(), 4);
        for ((name, long), (_, fresh)) in long.iter().zip(&fresh) {
            assert!(long == fresh, "{name} remembers the old camera");
        }
    }
    // A small step is none of these.
    scene.moves = Moves { camera: vec![key(0, here.eye, false), key(10, [0.1, 1.4, 4.0], false)], ..Moves::default() };
    let session = Session::new(device(), &scene).keep_all();
    let request = request("hierarchical", &filtered("0.9"), [48, 27]);
    let (mut long, mut fresh) = (frames(&session, &request), frames(&session, &request));
    lights(&mut long, 10, 10);
    fresh.run(10).unwrap();
    assert!(state(&long) != state(&fresh), "nothing is remembered");
}

/// As [`NOISY`] with many samples: the same mean, without most of the noise.
fn smooth(samples: &'static str) -> Vec<(&'static str, &'static str)> {
    NOISY.into_iter().chain([("samples", samples)]).collect()
}

/// Share of the old image in the new one: the projection of what is left onto what changed.
fn residue(image: &[Rgb], old: &[Rgb], new: &[Rgb], wanted: &[bool]) -> f64 {
    let (mut product, mut square) = (0.0, 0.0);
    for ((image, (old, new)), _) in image.iter().zip(old.iter().zip(new)).zip(wanted).filter(|(_, wanted)| **wanted) {
        let change = f64::from(luminance(*old) - luminance(*new));
        product += f64::from(luminance(*image) - luminance(*new)) * change;
        square += change * change;
    }
    product / square
}

#[test]
fn a_moving_bright_object_leaves_no_ghost_older_than_the_half_life() {
    let leaves = 80;
    let scene = lamp(leaves);
    let size = [64, 36];
    let reference = |frame| {
        let posed = scene.posed(frame);
        let session = Session::new(device(), &posed).keep_all();
        let mut run = frames(&session, &request("hierarchical", &smooth("256"), size));
        let image = run.mean_over_frames("indirect", 32).unwrap().0;
        (image, run.read("depth").unwrap().unwrap())
    };
    let ((old, depth_before), (new, depth_after)) = (reference(0), reference(leaves));
    // Surfaces that stood still and in view all the time; the others start anew.
    let stayed: Vec<bool> = depth_before.iter().zip(&depth_after).map(|(a, b)| a[0] == b[0] && a[0] > 0.0).collect();
    let uncovered: Vec<bool> = depth_before.iter().zip(&depth_after).map(|(a, b)| a[0] != b[0] && b[0] > 0.0).collect();
    assert!(uncovered.iter().filter(|&&v| v).count() > 20);
    let session = Session::new(device(), &scene).keep_all();
    // Noise of the residue of one frame.
    let mut unfiltered = frames(&session, &request("hierarchical", &smooth("64"), size));
    let residues: Vec<f64> = (leaves..leaves + 24)
        .map(|frame| {
            unfiltered.run(frame).unwrap();
            residue(&light(&unfiltered), &old, &new, &stayed)
        })
        .collect();
    let middle = residues.iter().sum::<f64>() / residues.len() as f64;
    let noise = (residues.iter().map(|r| (r - middle).powi(2)).sum::<f64>() / (residues.len() - 1) as f64).sqrt();
    for (a, text) in [(0.9_f32, "0.9"), (0.8, "0.8")] {
        // An average of frames has this much less of it; four deviations, and half a percent for the references.
        let tolerance = 4.0 * noise * f64::from((1.0 - a) / (1.0 + a)).sqrt() + 0.005;
        let half_life = frames_until(a, 0.5);
        let settings = [smooth("64"), vec![("temporal_a", text)]].concat();
        let mut run = frames(&session, &request("hierarchical", &settings, size));
        let images = lights(&mut run, leaves, leaves + 20);
        for (k, image) in images.iter().enumerate() {
            let (left, expected) = (residue(image, &old, &new, &stayed), f64::from(a.powi(k as i32 + 1)));
            // The lamp is gone in frame `leaves`, which already mixes in 1 - a of the new light.
            assert!(
                (left - expected).abs() < tolerance,
                "frame {k} at a = {a}: {left} of the old light, not {expected}"
            );
            let own = residue(image, &old, &new, &uncovered);
            assert!(own < 0.25, "frame {k} at a = {a}: {own} of the lamp is still where it was");
        }
        let at = |frames: f32| residue(&images[frames.ceil() as usize - 1], &old, &new, &stayed);
        println!(
            "a = {a}: half-life {half_life:.2} frames; {:.3} left then, {:.3} after two; tolerance {tolerance:.3}",
            at(half_life),
            at(2.0 * half_life)
        );
        assert!(at(half_life) <= 0.5 + tolerance && at(2.0 * half_life) <= 0.25 + tolerance);
    }
}

#[test]
fn glossy_light_is_forgotten_the_faster_the_narrower_its_lobe() {
    let (leaves, size) = (14, [64, 36]);
    let glossy = |frames: &Frames| frames.read_rgb("glossy").unwrap().unwrap();
    // Lobes a half and a sixth as wide as the widest: 9.5 and 3.2 frames instead of the 19 of a = 0.9.
    for (exponent, a) in [(3.0, 8.5 / 10.5), (35.0, 2.1667 / 4.1667f32)] {
        let mut scene = lamp(leaves);
        (scene.materials[0].specular, scene.materials[0].phong_exponent) = ([0.5; 3], exponent);
        let settings = |samples: &'static str, a| {
            let more = [("glossy", "on"), ("levels", "1"), ("temporal_a", a), ("samples", samples)];
            [&NOISY[..], &more].concat()
        };
        let reference = |frame| {
            let posed = scene.posed(frame);
            let session = Session::new(device(), &posed).keep_all();
            let mut run = frames(&session, &request("hierarchical", &settings("256", "0"), size));
            run.mean_over_frames("glossy", 12).unwrap().0
        };
        let (old, new) = (reference(0), reference(leaves));
        let all = vec![true; old.len()];
        let session = Session::new(device(), &scene).keep_all();
        let mut run = frames(&session, &request("hierarchical", &settings("256", "0.9"), size));
        for frame in 0..leaves + 8 {
            run.run(frame).unwrap();
            if frame < leaves {
                continue;
            }
            let left = residue(&glossy(&run), &old, &new, &all);
            let expected = f64::from(a).powi((frame - leaves) as i32 + 1);
            println!(
                "exponent {exponent}, frame {}: {left:.3} of the old light, {expected:.3} expected",
                frame - leaves
            );
            // Noise of single frames with 256 samples, as the last frames show where next to nothing is left.
            assert!((left - expected).abs() < 0.03, "exponent {exponent}, frame {frame}: {left}, not {expected}");
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_frames() {
    let scene = bundled("motion");
    let session = Session::new(device(), &scene).keep_all();
    let run = |seed| {
        let request = Request { seed, ..request("hierarchical", &filtered("0.9"), [33, 19]) };
        let mut run = frames(&session, &request);
        lights(&mut run, 12, 12);
        state(&run)
    };
    assert!(run(3) == run(3), "two runs with one seed differ");
    assert!(run(3) != run(4), "the seed does nothing");
}

#[test]
fn brightness_and_units_scale_exactly_over_frames() {
    // A camera that steps aside, and the court as one moving object.
    let plain = {
        let mut scene = restless();
        let key = |frame, x| CameraKeyframe { frame, eye: [x, 1.4, 4.0], target: [0.0, 0.8, 0.0], cut: false };
        scene.moves.camera = vec![key(0, 0.0), key(20, 0.5)];
        scene.meshes[2].object = Some(0);
        scene
    };
    let run = |scene: &Scene| {
        let session = Session::new(device(), scene).keep_all();
        let mut run = frames(&session, &request("hierarchical", &filtered("0.9"), [48, 27]));
        lights(&mut run, 6, 6).remove(0)
    };
    let bits =
        |image: &[Rgb], factor: f32| -> Vec<u32> { image.iter().flatten().map(|v| (v * factor).to_bits()).collect() };
    let image = run(&plain);
    // Powers of two move exponents and no mantissa.
    let mut bright = plain.clone();
    for light in &mut bright.lights {
        if let Light::Directional { irradiance, .. } = light {
            *irradiance = irradiance.map(|v| v * 16.0);
        }
    }
    assert!(bits(&run(&bright), 1.0) == bits(&image, 16.0), "brightness");
    let mut large = plain;
    let scale = |v: &mut [f32; 3]| *v = v.map(|v| v * 64.0);
    large.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions).for_each(scale);
    large.moves.objects.iter_mut().flat_map(|motion| &mut motion.keyframes).for_each(|key| scale(&mut key.translate));
    scale(&mut large.camera.eye);
    scale(&mut large.camera.target);
    for key in &mut large.moves.camera {
        scale(&mut key.eye);
        scale(&mut key.target);
    }
    assert!(bits(&run(&large), 1.0) == bits(&image, 1.0), "units");
}

#[test]
fn history_outlives_a_change_of_settings_but_not_of_size() {
    let scene = scenes::court();
    let gpu = &device().gpu;
    let (facts, buffers) = (SceneFacts::of(&scene), SceneBuffers::new(gpu, &scene));
    let plan = |samples: &str, size| {
        let mut settings = settings("hierarchical", &filtered("0.9"));
        settings.insert("hierarchical.samples".into(), Value::parse(samples));
        plan_frame(&facts, known("hierarchical"), &settings, size, Default::default()).unwrap()
    };
    let externals = || Externals { scene: Some(&buffers), ..Default::default() };
    let run = |recording: &CompiledGraph, frames: std::ops::Range<u32>, size| {
        for frame in frames {
            let mut view = camera_view(&scene.camera, size, facts.near);
            view.frame = frame;
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            recording.record(gpu, &mut encoder, &view, Changed::Anything);
            gpu.queue.submit([encoder.finish()]);
        }
        let plan = recording.plan();
        let index = plan.resources.iter().position(|resource| resource.name == "history").unwrap();
        assert!(matches!(plan.resources[index].kind, ResourceKind::Texture { .. }));
        let texture = recording.texture(halflight_frame_graph::ResourceId(index)).unwrap();
        let bytes = halflight_native::frames::read_texture(gpu, texture).unwrap();
        let words: &[[u32; 4]] = bytemuck::cast_slice(&bytes);
        words.iter().map(|w| w[3] >> 22).max().unwrap()
    };
    let size = [32, 18];
    let mut recording = CompiledGraph::new(gpu, plan("4", size), &externals());
    assert_eq!(run(&recording, 0..5, size), 5);
    recording.replan(gpu, plan("8", size), &externals());
    assert_eq!(run(&recording, 5..6, size), 6, "the history goes on");
    recording.reset_history();
    assert_eq!(run(&recording, 6..7, size), 1, "a cut that the program knows of");
    assert_eq!(run(&recording, 9..10, size), 1, "frames are missing in between");
    recording.replan(gpu, plan("8", [40, 18]), &externals());
    assert_eq!(run(&recording, 10..11, [40, 18]), 1, "another size");
}
