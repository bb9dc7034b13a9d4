//! What a technique costs in a scene with ten times the triangles and ten times the lights. The camera looks at the same
//! surfaces: the other nine copies of the scene lie behind its walls.
//!
//!     cargo run --release -p halflight-evaluator --example larger_scene -- radiance-cache 1280x720
#![allow(clippy::disallowed_macros, reason = "an example prints")]

use std::{error::Error, time::Instant};

use halflight_evaluator::{
    experiment::{
        COMMIT,
        session::{Request, Session},
    },
    measurement::Timing,
};
use halflight_frame_graph::Part;
use halflight_native::{AdapterChoice, NativeGpu};
use halflight_scenes::{Light, Mesh, Scene, bundled};
use halflight_techniques::{invocation::parse_size, technique};

/// How much larger the other scene is.
const TIMES: usize = 10;
/// Frames until records are settled, and frames that are timed.
const SETTLED: u32 = 40;
const TIMED: u32 = 16;

/// The scene with copies of its meshes side by side along x, a tenth of its width apart.
fn copied(scene: &Scene) -> Scene {
    let xs = || scene.meshes.iter().flat_map(|mesh| mesh.positions.iter().map(|position| position[0]));
    let (low, high) = (xs().fold(f32::INFINITY, f32::min), xs().fold(f32::NEG_INFINITY, f32::max));
    let copy = |mesh: &Mesh, number: usize| {
        let mut mesh = Mesh { model: None, ..mesh.clone() };
        mesh.positions.iter_mut().for_each(|position| position[0] += 1.1 * (high - low) * number as f32);
        mesh
    };
    let meshes = (0..TIMES).flat_map(|number| scene.meshes.iter().map(move |mesh| copy(mesh, number))).collect();
    Scene { meshes, ..scene.clone() }
}

/// The scene with weak lamps between the eye and its target, until it has ten times as many lights.
fn lit(scene: &Scene) -> Scene {
    let (eye, target) = (scene.camera.eye, scene.camera.target);
    let wanted = TIMES * scene.lights.len();
    let mut scene = scene.clone();
    let lamps = (scene.lights.len()..wanted).map(|number| {
        let share = number as f32 / wanted as f32;
        Light::Point { position: [0, 1, 2].map(|i| eye[i] + (target[i] - eye[i]) * share), intensity: [0.5; 3] }
    });
    let lamps: Vec<_> = lamps.collect();
    scene.lights.extend(lamps);
    scene
}

fn main() -> Result<(), Box<dyn Error>> {
    let name = std::env::args().nth(1).unwrap_or_else(|| "radiance-cache".into());
    let size = parse_size(&std::env::args().nth(2).unwrap_or_else(|| "1280x720".into()))?;
    let native = NativeGpu::open(&AdapterChoice::from("any"))?;
    let technique = technique(&name)?;
    let settings = (technique.complete)(&Default::default())?;
    println!(
        "{name}, {}, commit {COMMIT}, {}x{}, medians of {TIMED} frames after {SETTLED}",
        native.info.name, size[0], size[1]
    );
    println!(
        "| scene | triangles | lights | technique, ms | least to 95 % | scene, ms | first frame, s | scene, MB | plan, MB |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|---:|---:|");
    let one = bundled::scene("atrium")?;
    let scenes = [
        ("atrium", one.clone()),
        ("ten times the triangles", copied(&one)),
        ("ten times the lights", lit(&one)),
        ("both", lit(&copied(&one))),
    ];
    for (title, scene) in &scenes {
        let session = Session::new(&native, scene);
        let request = Request { technique, settings: settings.clone(), size, seed: 0, direct: None };
        let start = Instant::now();
        let mut frames = session.frames(&request)?;
        frames.run(0)?;
        let first = start.elapsed().as_secs_f64();
        let (mut own, mut others) = (Vec::new(), Vec::new());
        for frame in 1..SETTLED + TIMED {
            // What nothing has changed is not drawn again.
            let time = frames.run_due(frame)?;
            if frame >= SETTLED {
                let sum = |of_technique: bool| {
                    let passes = time.passes.iter().filter(|pass| (pass.part == Part::Technique) == of_technique);
                    passes.map(|pass| pass.milliseconds).sum::<f64>()
                };
                own.push(sum(true));
                others.push(sum(false));
            }
        }
        let timing = Timing::of(&own).ok_or("no frame was timed")?;
        let scene_ms = Timing::of(&others).map_or(0.0, |timing| timing.median);
        let megabytes = |bytes: u64| bytes as f64 * 1e-6;
        println!(
            "| {title} | {} | {} | {:.1} | {:.1} to {:.1} | {scene_ms:.1} | {first:.1} | {:.1} | {:.1} |",
            scene.triangle_count(),
            scene.lights.len(),
            timing.median,
            timing.min,
            timing.p95,
            megabytes(session.scene_bytes()),
            megabytes(frames.plan().bytes()),
        );
    }
    Ok(())
}
