//! What a whole frame of the atrium costs after different changes: medians over frames and the number of passes that ran.
//!
//!     cargo run --release -p halflight-evaluator --example reuse -- 320x180
#![allow(clippy::disallowed_macros, reason = "an example prints")]

use std::error::Error;

use halflight_evaluator::{
    experiment::{
        COMMIT,
        session::{Frames, Request, Session},
    },
    measurement::Timing,
};
use halflight_native::{AdapterChoice, NativeGpu};
use halflight_scenes::{CameraKeyframe, Keyframe, Motion, Scene, bundled};
use halflight_techniques::{invocation::parse_size, technique};

/// Frames that are timed, after one for warm-up.
const FRAMES: u32 = 7;

/// A scene that is animated in one way.
fn changing(change: &str) -> Result<Scene, Box<dyn Error>> {
    let mut scene = bundled::scene("atrium")?;
    match change {
        "sun" => {
            let end = Keyframe { frame: 100, rotate_degrees: [0.0, 20.0, 0.0], ..Keyframe::default() };
            let motion = Motion { pivot: [0.0; 3], keyframes: vec![Keyframe::default(), end] };
            scene.moves.lights.push((0, motion));
        }
        "camera" => {
            let (eye, target) = (scene.camera.eye, scene.camera.target);
            let key = |frame, x: f32| CameraKeyframe { frame, eye: [eye[0] + x, eye[1], eye[2]], target, cut: false };
            scene.moves.camera = vec![key(0, 0.0), key(100, 1.0)];
        }
        _ => {}
    }
    Ok(scene)
}

fn main() -> Result<(), Box<dyn Error>> {
    let size = parse_size(&std::env::args().nth(1).unwrap_or_else(|| "320x180".into()))?;
    let native = NativeGpu::open(&AdapterChoice::from("any"))?;
    println!("{}, commit {COMMIT}, {}x{}, ms (passes that ran)", native.info.name, size[0], size[1]);
    println!("| technique | anything | the sun turns | the camera moves | the next frame | the same frame |");
    println!("|---|---:|---:|---:|---:|---:|");
    for name in ["none", "rsm", "hybrid", "hierarchical", "bitmask"] {
        let technique = technique(name)?;
        let settings = (technique.complete)(&Default::default())?;
        let request = Request { technique, settings, size, seed: 0, direct: None };
        let mut cells = Vec::new();
        for (change, due, advances) in
            [("none", false, 1), ("sun", true, 1), ("camera", true, 1), ("none", true, 1), ("none", true, 0)]
        {
            let scene = changing(change)?;
            let session = Session::new(&native, &scene);
            let mut frames = session.frames(&request)?;
            cells.push(cost(&mut frames, due, advances)?);
        }
        println!("| `{name}` | {} |", cells.join(" | "));
    }
    Ok(())
}

/// Median time of a frame, and how many of its passes ran.
fn cost(frames: &mut Frames, due: bool, advances: u32) -> Result<String, Box<dyn Error>> {
    let mut sums = Vec::new();
    for frame in 0..=FRAMES {
        let time = if due { frames.run_due(frame * advances)? } else { frames.run(frame * advances)? };
        if frame > 0 {
            sums.push(time.passes.iter().map(|pass| pass.milliseconds).sum());
        }
    }
    let median = Timing::of(&sums).map_or(f64::NAN, |timing| timing.median);
    let ran = frames.causes().iter().filter(|cause| cause.is_some()).count();
    Ok(format!("{median:.1} ({ran})"))
}
