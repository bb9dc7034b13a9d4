//! What a whole frame of the atrium costs after different changes: medians over frames and the number of passes that ran.
//! A second table has two lights more, a spot and a point light.
//!
//!     cargo run --release -p halflight-evaluator --example reuse -- 320x180
//!     cargo run --release -p halflight-evaluator --example reuse -- 320x180 three-lights   # the second table alone
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
use halflight_renderer::parameters::Value;
use halflight_scenes::{CameraKeyframe, Keyframe, Light, Motion, Scene, bundled};
use halflight_techniques::{invocation::parse_size, technique};

/// Frames that are timed, after one for warm-up.
const FRAMES: u32 = 7;

/// A scene that is animated in one way.
fn changing(change: &str) -> Result<Scene, Box<dyn Error>> {
    let mut scene = bundled::scene("atrium")?;
    match change {
        "sun" => turn(&mut scene, 0),
        "camera" => {
            let (eye, target) = (scene.camera.eye, scene.camera.target);
            let key = |frame, x: f32| CameraKeyframe { frame, eye: [eye[0] + x, eye[1], eye[2]], target, cut: false };
            scene.moves.camera = vec![key(0, 0.0), key(100, 1.0)];
        }
        _ => {}
    }
    Ok(scene)
}

/// Turns a light about the vertical axis through its own position, or moves it.
fn turn(scene: &mut Scene, light: usize) {
    let (pivot, translate) = match scene.lights[light] {
        Light::Directional { .. } => ([0.0; 3], [0.0; 3]),
        Light::Spot { position, .. } => (position, [0.0; 3]),
        Light::Point { position, .. } => (position, [1.0, 0.0, 0.0]),
    };
    let end = Keyframe { frame: 100, rotate_degrees: [0.0, 20.0, 0.0], translate, ..Keyframe::default() };
    scene.moves.lights.push((light, Motion { pivot, keyframes: vec![Keyframe::default(), end] }));
}

/// The atrium with a spot light at the camera and a point light before it, of which one may turn.
fn three_lights(turns: Option<usize>) -> Result<Scene, Box<dyn Error>> {
    let mut scene = bundled::scene("atrium")?;
    let (eye, target) = (scene.camera.eye, scene.camera.target);
    let along = |share: f32| [0, 1, 2].map(|axis| eye[axis] + (target[axis] - eye[axis]) * share);
    scene.lights.push(Light::Spot {
        position: eye,
        direction: [0, 1, 2].map(|axis| target[axis] - eye[axis]),
        intensity: [30.0; 3],
        half_angle_degrees: 35.0,
        full_intensity_half_angle_degrees: 30.0,
    });
    scene.lights.push(Light::Point { position: along(0.5), intensity: [5.0; 3] });
    if let Some(light) = turns {
        turn(&mut scene, light);
    }
    Ok(scene)
}

/// Frames of a scene with three lights, of which one turns.
fn lights_alone(native: &NativeGpu, size: [u32; 2]) -> Result<(), Box<dyn Error>> {
    println!("| technique | anything | the sun turns | the spot turns | the point moves | the next frame |");
    println!("|---|---:|---:|---:|---:|---:|");
    for (name, setting) in [("rsm", None), ("hybrid", None), ("hierarchical", Some(("hierarchical.sources", "lights")))]
    {
        let technique = technique(name)?;
        let given = setting.into_iter().map(|(key, value)| (key.to_owned(), Value::parse(value))).collect();
        let settings = (technique.complete)(&given)?;
        let request = Request { technique, settings, size, seed: 0, direct: None };
        let mut cells = Vec::new();
        for (turns, due) in [(None, false), (Some(0), true), (Some(1), true), (Some(2), true), (None, true)] {
            let scene = three_lights(turns)?;
            let session = Session::new(native, &scene);
            cells.push(cost(&mut session.frames(&request)?, due, 1)?);
        }
        println!("| `{name}` | {} |", cells.join(" | "));
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let size = parse_size(&std::env::args().nth(1).unwrap_or_else(|| "320x180".into()))?;
    let native = NativeGpu::open(&AdapterChoice::from("any"))?;
    println!("{}, commit {COMMIT}, {}x{}, ms (passes that ran)", native.info.name, size[0], size[1]);
    if std::env::args().nth(2).as_deref() == Some("three-lights") {
        return lights_alone(&native, size);
    }
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
    println!();
    lights_alone(&native, size)
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
