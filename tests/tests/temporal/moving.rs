//! How light, shadows and the filter follow what moves, and what only receives.

use glam::{Mat4, Vec3};
use halflight_evaluator::experiment::session::Session;
use halflight_native::images::Rgb;
use halflight_scenes::{CameraKeyframe, Keyframe, Light, Motion, Moves, Scene};
use halflight_soundness::scenes;
use halflight_tests::{bundled, device, frames, request};

use super::*;

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
    let session = Session::new(device(), &scene).keep_all();
    let size = [64, 48];
    let mut run = frames(&session, &request("hierarchical", &filtered("0.9"), size));
    run.run(5).unwrap();
    run.run(6).unwrap();
    let depth = run.read("depth").unwrap().unwrap();
    let bytes = run.read_bytes("object").unwrap().expect("something moves, and the filter follows it");
    // One byte, because there are less than 256 objects.
    let object: Vec<u32> = bytes.iter().map(|&object| object.into()).collect();
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
    let session = Session::new(device(), &scene).keep_all();
    let follow = |a| {
        let mut run = frames(&session, &request("hierarchical", &filtered(a), size));
        let last = lights(&mut run, 40, 40).remove(0);
        (last, run.read("depth").unwrap().unwrap())
    };
    let posed = scene.posed(40);
    let still = Session::new(device(), &posed).keep_all();
    let reference = frames(&still, &request("hierarchical", &NOISY, size)).mean_over_frames("indirect", 64).unwrap().0;
    let ((noisy, _), (smooth, _)) = (follow("0"), follow("0.9"));
    let (before, after) = (rms(&noisy, &reference), rms(&smooth, &reference));
    println!("unfiltered {before:.2e}, filtered {after:.2e} off the average");
    // Half a pixel a frame: bilinear taps also blur noise away, and what is on the screen changes a little.
    assert!(after < 0.5 * before, "{after} against {before}");
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
    let mut empty = Scene { name: "empty".into(), ..Scene::default() };
    let mut bright = lamp(3);
    bright.lights.push(Light::Point { position: [0.0, 1.5, 0.0], intensity: [1e30; 3] });
    // An empty scene with light, because nothing is planned without.
    empty.lights.push(scenes::sun());
    for scene in [moving, empty, bright, scenes::court()] {
        let session = Session::new(device(), &scene).keep_all();
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
            let session = Session::new(device(), scene).keep_all();
            halflight_tests::render(&session, &request(technique, settings, [32, 18]), output)
        };
        assert!(image(&silent, "indirect") == image(&black, "indirect"), "{technique}");
        // As a grid measures it, the scene's own passes apart.
        let session = Session::new(device(), &silent).keep_all();
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
        let session = Session::new(device(), scene).keep_all();
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
