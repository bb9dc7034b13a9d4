//! The temporal filter: what it averages, what it forgets, and how it follows what moves.
#![allow(clippy::unwrap_used)]

use glam::{Mat4, Vec3};
use halflight_evaluator::session::{Frames, Request, Session};
use halflight_native::images::{Rgb, luminance};
use halflight_renderer::{
    Externals, Recording, SceneBuffers, SceneFacts, View, parameters::Value, plan::ResourceKind, plan_frame,
    temporal::frames_until,
};
use halflight_scenes::{CameraKeyframe, Keyframe, Light, Motion, Moves, Scene};
use halflight_tests::{bundled, device, frames, known, request, scenes, settings};

/// A small, noisy gather whose light is stored without loss.
const NOISY: [(&str, &str); 5] =
    [("start_resolution", "half"), ("levels", "3"), ("samples", "4"), ("disc_area", "texel"), ("storage", "float32")];

fn filtered(a: &'static str) -> Vec<(&'static str, &'static str)> {
    NOISY.into_iter().chain([("temporal_a", a)]).collect()
}

fn light(frames: &Frames) -> Vec<Rgb> {
    frames.read_rgb("indirect").unwrap().unwrap()
}

/// Runs frames from `0` to `last`; the light of each from `from` on.
fn lights(frames: &mut Frames, from: u32, last: u32) -> Vec<Vec<Rgb>> {
    let mut all = Vec::new();
    for frame in 0..=last {
        frames.run(frame).unwrap();
        if frame >= from {
            all.push(light(frames));
        }
    }
    all
}

fn mean(images: &[Vec<Rgb>]) -> Vec<Rgb> {
    (0..images[0].len())
        .map(|i| {
            std::array::from_fn(|c| {
                images.iter().map(|image| f64::from(image[i][c])).sum::<f64>() as f32 / images.len() as f32
            })
        })
        .collect()
}

/// Root mean square over pixels and channels.
fn rms(a: &[Rgb], b: &[Rgb]) -> f64 {
    let square = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
    (square / (3 * a.len()) as f64).sqrt()
}

/// Standard deviation over images at each pixel and channel, root mean square.
fn deviation(images: &[Vec<Rgb>]) -> f64 {
    let middle = mean(images);
    let variance: f64 = images.iter().map(|image| rms(image, &middle).powi(2)).sum();
    (variance / (images.len() - 1) as f64).sqrt()
}

#[test]
fn a_still_camera_converges_to_the_average_of_independent_frames() {
    let scene = scenes::court();
    let session = Session::new(device(), &scene);
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
    let (still, restless) = (Session::new(device(), &still), Session::new(device(), &restless));
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
        let session = Session::new(device(), &scene);
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
    let session = Session::new(device(), &scene);
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

/// The court with a lamp beside the wall that moves away at once, at a frame.
fn lamp(leaves: u32) -> Scene {
    let mut scene = scenes::court();
    let mut mesh = scenes::quad(Vec3::new(0.4, 0.8, -1.6), 0.6 * Vec3::X, 0.6 * Vec3::Y, 2);
    mesh.object = Some(0);
    scene.meshes.push(mesh);
    scene.materials.push(scenes::emitter(20.0));
    let key = |frame, x| Keyframe { frame, translate: [x, 0.0, 0.0], ..Keyframe::default() };
    let keyframes = vec![key(0, 0.0), key(leaves - 1, 0.0), key(leaves, -1.8)];
    scene.moves.objects.push(Motion { pivot: [0.0; 3], keyframes });
    scene
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
        let session = Session::new(device(), &posed);
        let mut run = frames(&session, &request("hierarchical", &smooth("256"), size));
        let image = run.mean_over_frames("indirect", 32).unwrap().0;
        (image, run.read("depth").unwrap().unwrap())
    };
    let ((old, depth_before), (new, depth_after)) = (reference(0), reference(leaves));
    // Surfaces that stood still and in view all the time; the others start anew.
    let stayed: Vec<bool> = depth_before.iter().zip(&depth_after).map(|(a, b)| a[0] == b[0] && a[0] > 0.0).collect();
    let uncovered: Vec<bool> = depth_before.iter().zip(&depth_after).map(|(a, b)| a[0] != b[0] && b[0] > 0.0).collect();
    assert!(uncovered.iter().filter(|&&v| v).count() > 20);
    let session = Session::new(device(), &scene);
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
            let session = Session::new(device(), &posed);
            let mut run = frames(&session, &request("hierarchical", &settings("256", "0"), size));
            run.mean_over_frames("glossy", 12).unwrap().0
        };
        let (old, new) = (reference(0), reference(leaves));
        let all = vec![true; old.len()];
        let session = Session::new(device(), &scene);
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
fn reprojection_of_a_moving_object_lands_on_the_same_surface_point() {
    // A tilted plate turns, grows and flies; the camera moves too. Where a pixel shows the plate, the matrix that
    // its frame was given must lead to where that very point was.
    let key = |frame, translate, degrees, scale| Keyframe { frame, translate, rotate_degrees: degrees, scale };
    let motion = Motion {
        pivot: [0.1, 0.2, -1.0],
        keyframes: vec![
            key(0, [0.0; 3], [0.0; 3], [1.0; 3]),
            key(10, [0.4, 0.3, -0.2], [20.0, 70.0, -40.0], [1.5, 0.8, 1.2]),
        ],
    };
    let camera = |frame, eye| CameraKeyframe { frame, eye, target: [0.0, 0.0, -1.0], cut: false };
    let mut plate = scenes::quad(Vec3::new(-0.5, -0.4, -1.2), Vec3::new(1.0, 0.0, 0.3), Vec3::new(0.0, 0.9, 0.2), 0);
    plate.object = Some(0);
    let scene = Scene {
        meshes: vec![plate],
        materials: vec![scenes::grey(0.5)],
        lights: vec![scenes::sun()],
        camera: scenes::camera([0.0, 0.0, 2.0], [0.0, 0.0, -1.0], 50.0),
        moves: Moves {
            objects: vec![motion],
            camera: vec![camera(0, [0.0, 0.0, 2.0]), camera(10, [0.1, 0.05, 2.0])],
            ..Moves::default()
        },
        ..Scene::default()
    };
    let (now, then) = (scene.pose(6), scene.pose(5));
    // Closed form, in double precision: the point at rest is found through this frame's pose and placed by the one before.
    let double = |m: Mat4| m.as_dmat4();
    let to_rest = (double(now.camera.view_matrix()) * double(now.objects[0])).inverse();
    let to_before = double(then.camera.view_matrix()) * double(then.objects[0]);
    let session = Session::new(device(), &scene);
    let size = [64, 48];
    let mut run = frames(&session, &request("hierarchical", &filtered("0.9"), size));
    run.run(5).unwrap();
    run.run(6).unwrap();
    let depth = run.read("depth").unwrap().unwrap();
    let bytes = run.read_bytes("object").unwrap().expect("something moves, and the filter follows it");
    let object: &[u32] = bytemuck::cast_slice(&bytes);
    let history = run.read_bytes("history").unwrap().unwrap();
    let history: &[[u32; 4]] = bytemuck::cast_slice(&history);
    let [tx, ty] = run.view().tan_half_fov.map(f64::from);
    let place = |i: usize, d: f64| {
        let (x, y) = ((i % 64) as f64 + 0.5, (i / 64) as f64 + 0.5);
        glam::DVec3::new((2.0 * x / 64.0 - 1.0) * tx, (1.0 - 2.0 * y / 48.0) * ty, -1.0) * d
    };
    let (mut plate_pixels, mut remembered, mut inside) = (0, 0, 0);
    for i in 0..depth.len() {
        let d = f64::from(depth[i][0]);
        assert_eq!(object[i], u32::from(d > 0.0), "only the plate is there");
        if d <= 0.0 {
            continue;
        }
        plate_pixels += 1;
        let rest = to_rest.transform_point3(place(i, d));
        // The plate at rest is corner + s u + t v with s and t in 0..1.
        let offset = rest - glam::DVec3::new(-0.5, -0.4, -1.2);
        let (u, v) = (glam::DVec3::new(1.0, 0.0, 0.3), glam::DVec3::new(0.0, 0.9, 0.2));
        let normal = u.cross(v).normalize();
        // Depth and interpolated positions are float32 numbers near 3.
        assert!(offset.dot(normal).abs() < 1e-5, "pixel {i} is off the plate by {}", offset.dot(normal));
        let before = to_before.transform_point3(rest);
        let ndc = [before.x / (-before.z * tx), before.y / (-before.z * ty)];
        let at = [(ndc[0] * 0.5 + 0.5) * 64.0, (0.5 - ndc[1] * 0.5) * 48.0];
        // Well inside the plate of the frame before all four taps are on it, and the pixel must remember one frame.
        let (s, t) = (offset.dot(u) / u.length_squared(), offset.dot(v) / v.length_squared());
        let deep = |x: f64| (0.1..0.9).contains(&x);
        if deep(s) && deep(t) && (2.0..62.0).contains(&at[0]) && (2.0..46.0).contains(&at[1]) {
            inside += 1;
            remembered += usize::from(history[i][3] >> 22 == 2);
        }
    }
    println!(
        "{plate_pixels} pixels of the plate, {inside} well inside, {remembered} of them remember the frame before"
    );
    assert!(inside > 100 && remembered == inside);
}

#[test]
fn a_moving_object_keeps_the_pattern_of_its_light() {
    // Two lamps make a pattern on a plate that flies with them past the camera: light on it stands still in the
    // plate's own frame, so a filter that follows it must agree with the average of unfiltered frames.
    let mut scene = scenes::court();
    for mesh in &mut scene.meshes {
        mesh.object = Some(0);
    }
    let key = |frame, x| Keyframe { frame, translate: [x, 0.0, 0.0], ..Keyframe::default() };
    scene.moves.objects.push(Motion { pivot: [0.0; 3], keyframes: vec![key(0, 0.0), key(40, 1.0)] });
    let size = [64, 36];
    let session = Session::new(device(), &scene);
    let follow = |a| {
        let mut run = frames(&session, &request("hierarchical", &filtered(a), size));
        let last = lights(&mut run, 40, 40).remove(0);
        (last, run.read("depth").unwrap().unwrap())
    };
    let posed = scene.posed(40);
    let still = Session::new(device(), &posed);
    let reference = frames(&still, &request("hierarchical", &NOISY, size)).mean_over_frames("indirect", 64).unwrap().0;
    let ((noisy, _), (smooth, _)) = (follow("0"), follow("0.9"));
    let (before, after) = (rms(&noisy, &reference), rms(&smooth, &reference));
    println!("unfiltered {before:.2e}, filtered {after:.2e} off the average");
    // Half a pixel a frame: bilinear taps also blur noise away, and what is on the screen changes a little.
    assert!(after < 0.5 * before, "{after} against {before}");
}

#[test]
fn the_same_seed_gives_the_same_frames() {
    let scene = bundled("motion");
    let session = Session::new(device(), &scene);
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
fn no_texture_holds_nan_whatever_moves() {
    let mut moving = bundled("motion");
    // The block passes through the eye, shrinks to nothing much, and comes back.
    moving.moves.objects[0].keyframes = vec![
        Keyframe::default(),
        Keyframe { frame: 3, translate: [0.6, 0.2, 3.4], scale: [1e-6; 3], ..Keyframe::default() },
        Keyframe { frame: 5, translate: [0.0; 3], rotate_degrees: [1e4, -1e4, 3.0], scale: [50.0; 3] },
    ];
    moving.moves.lights.push((
        0,
        Motion {
            pivot: [0.0; 3],
            keyframes: vec![
                Keyframe::default(),
                Keyframe {
                    frame: 4,
                    translate: [0.3, -1.0, 0.2],
                    rotate_degrees: [0.0, 0.0, 200.0],
                    ..Keyframe::default()
                },
            ],
        },
    ));
    let empty = Scene { name: "empty".into(), ..Scene::default() };
    let mut bright = lamp(3);
    bright.lights.push(Light::Point { position: [0.0, 1.5, 0.0], intensity: [1e30; 3] });
    for scene in [moving, empty, bright, scenes::court()] {
        let session = Session::new(device(), &scene);
        for (size, start) in
            [([1, 1], "full"), ([3, 1], "half"), ([1, 5], "quarter"), ([33, 17], "half"), ([31, 37], "full")]
        {
            for (a, storage) in [("0.9", "float16"), ("0.999", "float32"), ("0.001", "float16")] {
                // Small shadow maps: they are not what is looked at.
                let small = ("direct.shadow_map_size", "64");
                let values = [("start_resolution", start), ("storage", storage), ("temporal_a", a), small];
                let mut run = frames(&session, &request("hierarchical", &values, size));
                for frame in 0..7 {
                    run.run(frame).unwrap();
                    for found in run.scan().unwrap() {
                        let place = format!("{} {size:?} {values:?} frame {frame}", scene.name);
                        assert_eq!(found.not_finite(), 0, "{place}: {}", found.name);
                    }
                    let history = run.read_bytes("history").unwrap().unwrap();
                    let words: &[[u32; 4]] = bytemuck::cast_slice(&history);
                    assert!(words.iter().all(|w| f32::from_bits(w[0]).is_finite() && w[1] >> 24 <= 232));
                }
            }
        }
    }
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
        let session = Session::new(device(), scene);
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
    let run = |recording: &Recording, frames: std::ops::Range<u32>, size| {
        for frame in frames {
            let mut view = View::new(&scene.camera, size, facts.near);
            view.frame = frame;
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            recording.record(gpu, &mut encoder, &view);
            gpu.queue.submit([encoder.finish()]);
        }
        let plan = recording.plan();
        let index = plan.resources.iter().position(|resource| resource.name == "history").unwrap();
        assert!(matches!(plan.resources[index].kind, ResourceKind::Texture { .. }));
        let texture = recording.texture(halflight_renderer::plan::ResourceId(index)).unwrap();
        let bytes = halflight_native::frames::read_texture(gpu, texture).unwrap();
        let words: &[[u32; 4]] = bytemuck::cast_slice(&bytes);
        words.iter().map(|w| w[3] >> 22).max().unwrap()
    };
    let size = [32, 18];
    let mut recording = Recording::new(gpu, plan("4", size), &externals());
    assert_eq!(run(&recording, 0..5, size), 5);
    recording.replan(gpu, plan("8", size), &externals());
    assert_eq!(run(&recording, 5..6, size), 6, "the history goes on");
    recording.forget();
    assert_eq!(run(&recording, 6..7, size), 1, "a cut that the program knows of");
    assert_eq!(run(&recording, 9..10, size), 1, "frames are missing in between");
    recording.replan(gpu, plan("8", [40, 18]), &externals());
    assert_eq!(run(&recording, 10..11, [40, 18]), 1, "another size");
}

#[test]
fn what_only_receives_sends_nothing() {
    let mut scene = scenes::court();
    // The block on the floor, with materials of its own.
    scene.materials.extend([scenes::grey(0.7), scenes::grey(0.4)]);
    (scene.meshes[2].material, scene.meshes[3].material) = (2, 3);
    let mut silent = scene.clone();
    silent.materials[2..].iter_mut().for_each(|material| material.receive_only = true);
    // What a black block sends; what it receives does not depend on its colour.
    let mut black = scene.clone();
    black.materials[2..].iter_mut().for_each(|material| material.albedo = [0.0; 3]);
    for (technique, settings) in [("hierarchical", &[][..]), ("hierarchical", &[("bounces", "3")]), ("exhaustive", &[])]
    {
        let image = |scene: &Scene, output: &str| {
            let session = Session::new(device(), scene);
            halflight_tests::render(&session, &request(technique, settings, [32, 18]), output)
        };
        assert!(image(&silent, "indirect") == image(&black, "indirect"), "{technique}");
        // As a grid measures it, the scene's own passes apart.
        let session = Session::new(device(), &silent);
        let request = request(technique, settings, [32, 18]);
        let mut own = session.scene_frames(&request.settings, request.size).unwrap();
        own.run(0).unwrap();
        let mut apart = session.technique_frames(&request, &own).unwrap();
        apart.run(0).unwrap();
        assert!(light(&apart) == image(&black, "indirect"), "{technique} apart");
        assert!(image(&silent, "indirect") != image(&scene, "indirect"), "{technique}");
        assert!(image(&silent, "direct") == image(&scene, "direct"), "{technique}: its direct light still shows");
    }
}

#[test]
fn shadows_and_light_follow_what_moves() {
    // A moving scene at a frame is the still scene posed at it: same G-buffer, same direct light.
    let mut scene = bundled("motion");
    scene.moves.lights.push((
        0,
        Motion {
            pivot: [0.0; 3],
            keyframes: vec![
                Keyframe::default(),
                Keyframe {
                    frame: 20,
                    translate: [0.2, -0.1, 0.3],
                    rotate_degrees: [0.0, 10.0, 8.0],
                    ..Keyframe::default()
                },
            ],
        },
    ));
    let posed = scene.posed(13);
    let image = |scene: &Scene, frame, output: &str| {
        let session = Session::new(device(), scene);
        let mut run = frames(&session, &request("none", &[], [96, 54]));
        run.run(frame).unwrap();
        run.read_rgb(output).unwrap().unwrap()
    };
    for output in ["depth", "normal", "albedo", "direct"] {
        let (moving, still) = (image(&scene, 13, output), image(&posed, 0, output));
        let far = |(a, b): &(&Rgb, &Rgb)| a.iter().zip(*b).any(|(a, b)| (a - b).abs() > 2e-3 * (1.0 + b.abs()));
        let differ = moving.iter().zip(&still).filter(far).count();
        // Rounding moves edges of silhouettes and of shadows by less than a pixel; a shadow map that
        // stayed behind would change hundreds of pixels.
        assert!(differ * 200 <= moving.len(), "{output}: {differ} of {} pixels differ", moving.len());
    }
    let before = image(&scene, 0, "direct");
    assert!(rms(&before, &image(&scene, 13, "direct")) > 0.01, "nothing moved");
}
