//! How close the gather comes to a bare fetch loop, what each part of the chain costs, and whether the
//! number of triangles matters.
//!
//!     cargo run --release -p halflight-evaluator --example roofline -- --scene scenes/atrium.toml
//!
//! The fetch loop reads the same texels as the gather, in the same order, and adds them up
//! (`hierarchical/fetch.wgsl`). Every figure is a median over frames with its 5 % and 95 % quantiles.
//! What is compared alternates within one run, pass by pass or frame by frame, and ratios are taken
//! between neighbours in time: other work on the machine slows both alike.
#![allow(clippy::disallowed_macros, reason = "an example for developers")]

mod operations;

use std::{path::PathBuf, process::ExitCode};

use clap::Parser;
use halflight_evaluator::{
    Error,
    experiment::session::{Frames, Request, Session, open_adapter, open_scene},
};
use halflight_frame_graph::{FramePlan, Part, Pass, PassTime, ResourceId, ResourceKind};
use halflight_metrics::percentile;
use halflight_native::{NativeGpu, images::Rgb};
use halflight_renderer::{
    gi::Technique,
    parameters::{Settings, Value, check_settings},
};
use halflight_scenes::{Camera, Scene};
use halflight_shared_shaders::{
    Call,
    hierarchical::{fetch, gather},
};
use halflight_techniques::{hierarchical, invocation::parse_size};
use wgpu::TextureFormat;

#[derive(Parser)]
struct Args {
    /// Scene file (.toml) or model (.obj).
    #[arg(long, default_value = "scenes/atrium.toml")]
    scene: PathBuf,
    /// Image size, pixels.
    #[arg(long, default_value = "1280x720", value_parser = parse_size, value_name = "WxH")]
    size: [u32; 2],
    /// A setting of the hierarchical technique; may be given many times.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<String>,
    /// Frames to time.
    #[arg(long, default_value_t = 30, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// Adapter: any, gpu, software, or part of a name.
    #[arg(long, default_value = "any")]
    adapter: String,
}

/// The hierarchical technique with a fetch pass after each gather.
static WITH_FETCHES: Technique = Technique {
    plan: |plan, inputs, settings| {
        let indirect = (hierarchical::TECHNIQUE.plan)(plan, inputs, settings)?;
        add_fetches(plan);
        Ok(indirect)
    },
    ..hierarchical::TECHNIQUE
};

/// The scene with few triangles that the second table holds against a big one.
const SMALL_SCENE: &str = "scenes/cornell.toml";
/// In the middle of its open side and wide enough to show nothing but surfaces.
const SMALL_CAMERA: Camera =
    Camera { eye: [0.0, 1.0, 0.9], target: [0.0, 1.0, 0.0], up: [0.0, 1.0, 0.0], vertical_fov_degrees: 60.0 };
/// Width of the lit and unlit squares of the light that both scenes are given, pixels: about that of
/// patches of sun.
const PATCH: u32 = 64;

fn main() -> ExitCode {
    match run(&Args::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn run(args: &Args) -> Result<(), Error> {
    let native = open_adapter(&args.adapter)?;
    let scene = open_scene(&args.scene)?;
    let small = Scene { camera: SMALL_CAMERA, ..open_scene(SMALL_SCENE.as_ref())? };
    let [width, height] = args.size;
    let settings = settings(&args.settings)?;
    println!("{}, {width}x{height}, {} frames\n", native.info.name, args.frames);
    chain(&native, &scene, &settings, args.size, args.frames)?;
    triangles(&native, [&small, &scene], &settings, args.size, args.frames)
}

fn settings(texts: &[String]) -> Result<Settings, Error> {
    let given = texts.iter().map(|text| {
        let (name, value) = text
            .split_once('=')
            .ok_or_else(|| Error::BadInput(format!("--set {text} has no value: write --set {text}=VALUE")))?;
        Ok((format!("hierarchical.{name}"), Value::parse(value)))
    });
    let settings = given.collect::<Result<Settings, Error>>()?;
    check_settings(&settings, &(WITH_FETCHES.parameters)()).map_err(|e| Error::BadInput(e.to_string()))?;
    Ok(settings)
}

fn add_fetches(plan: &mut FramePlan) {
    let gathers: Vec<_> = plan.passes.iter().filter(|pass| gathers_level(pass)).cloned().collect();
    for gather in gathers {
        let Some((surfels, size)) = surfels(plan, &gather) else { continue };
        let name = gather.name.replace("gather", "fetch");
        let sums = plan.texture(format!("{name}_sums"), size, TextureFormat::Rgba32Float, "sums of fetched texels");
        // The fetches take their numbers from the gather, which has more of them.
        let shader = fetch::Features::default().shader();
        let constants = gather.constants.into_iter().filter(|(name, _)| shader.overrides.contains(name)).collect();
        let bindings = vec![("surfels", surfels), ("sums", sums)];
        let call = Call { shader, bindings, params: gather.params, constants };
        plan.pass(Part::Technique, name, call).because("roofline").over(size);
        // Next to its gather, so that both meet the same caches and the same load of the machine.
        let place = plan.passes.iter().position(|pass| pass.name == gather.name).map_or(0, |index| index + 1);
        plan.passes[place..].rotate_right(1);
    }
}

/// The passes that gather in one level. `gather_sky` is none of them.
const GATHERS: [&str; 8] =
    ["gather_0", "gather_1", "gather_2", "gather_3", "gather_4", "gather_5", "gather_6", "gather_7"];

/// Whether a pass gathers in one level.
fn gathers_level(pass: &Pass) -> bool {
    GATHERS.contains(&pass.name.as_str())
}

/// What a gather reads, and its size.
fn surfels(plan: &FramePlan, gather: &Pass) -> Option<(ResourceId, [u32; 2])> {
    let &(_, id) = gather.bindings.iter().find(|(variable, _)| *variable == "surfels")?;
    match plan.resources[id.0].kind {
        ResourceKind::Texture { size, .. } => Some((id, size)),
        _ => None,
    }
}

/// Times of every pass over some frames.
#[derive(Default)]
struct Times(Vec<Vec<PassTime>>);

impl Times {
    fn add(&mut self, frames: &mut Frames, frame: u32) -> Result<(), Error> {
        self.0.push(frames.run(frame)?.passes);
        Ok(())
    }

    /// Milliseconds of the passes whose names start with one of these, a sum for each frame.
    fn of(&self, prefixes: &[&str]) -> Vec<f64> {
        let wanted = |pass: &&PassTime| prefixes.iter().any(|prefix| pass.name.starts_with(prefix));
        self.0.iter().map(|frame| frame.iter().filter(wanted).map(|pass| pass.milliseconds).sum()).collect()
    }
}

/// `median [5 % .. 95 %]`.
fn spread(values: &[f64], digits: usize) -> String {
    let mut values = values.to_vec();
    let [low, middle, high] = [0.05, 0.5, 0.95].map(|fraction| percentile(&mut values, fraction));
    format!("{middle:>9.digits$} [{low:>8.digits$} .. {high:>8.digits$}]")
}

fn ratios(above: &[f64], below: &[f64]) -> Vec<f64> {
    above.iter().zip(below).map(|(a, b)| a / b).collect()
}

/// First table: gathers against fetches, then the parts of the chain.
fn chain(native: &NativeGpu, scene: &Scene, settings: &Settings, size: [u32; 2], count: u32) -> Result<(), Error> {
    let session = Session::new(native, scene);
    let mut light = session.scene_frames(settings, size)?;
    light.run(0)?;
    let request = Request { technique: &WITH_FETCHES, settings: settings.clone(), size, seed: 0, direct: None };
    let mut frames = session.technique_frames(&request, &light)?;
    frames.run(0)?;
    let mut times = Times::default();
    for frame in 0..count {
        times.add(&mut frames, frame)?;
    }
    println!("Gather against a bare fetch loop, {} ({} triangles)\n", scene.name, scene.triangle_count());
    println!(
        "{:<9}{:>32}{:>32}{:>32}",
        "level", "gather, million samples/s", "fetch, million samples/s", "fetch / gather time"
    );
    for pass in frames.plan().passes.iter().filter(|pass| gathers_level(pass)) {
        let Some((_, [width, height])) = surfels(frames.plan(), pass) else { continue };
        let samples = pass.constants.iter().find(|(name, _)| *name == "SAMPLES").map_or(0.0, |(_, value)| *value);
        // Samples off the screen are counted too: both loops take them, and neither fetches there.
        let million = f64::from(width) * f64::from(height) * samples * 1e-6;
        let level = &pass.name["gather_".len()..];
        let [gather, fetch] = ["gather_", "fetch_"].map(|prefix| times.of(&[&format!("{prefix}{level}")]));
        let rate = |times: &[f64]| spread(&times.iter().map(|time| million / time * 1e3).collect::<Vec<_>>(), 1);
        println!("{level:<9}{:>32}{:>32}{:>32}", rate(&gather), rate(&fetch), spread(&ratios(&fetch, &gather), 3));
    }
    for (name, shader) in
        [("gather", gather::Features::default().shader()), ("fetch", fetch::Features::default().shader())]
    {
        if let Some(of) = operations::of_loop(shader) {
            println!("{name}: {} operations on numbers and {} fetch a sample", of.scalar, of.fetches);
        }
    }
    println!("\n{:<32}{:>32}", "part", "milliseconds");
    let gather = times.of(&GATHERS);
    let parts: [(&str, &[&str]); 7] = [
        ("pyramid", &["pyramid_"]),
        ("gather", &GATHERS),
        ("combine", &["combine_"]),
        ("upsample", &["upsample"]),
        ("composite", &["composite"]),
        ("sky", &["gather_sky"]),
        ("whole chain", &["pyramid_", "gather_", "combine_", "upsample", "composite"]),
    ];
    for (part, prefixes) in parts {
        println!("{part:<32}{:>32}", spread(&times.of(prefixes), 2));
    }
    println!("{:<32}{:>32}\n", "level 0 / all of the gather", spread(&ratios(&times.of(&["gather_0"]), &gather), 3));
    Ok(())
}

/// Second table: the gather over few and over many triangles, under the same light.
fn triangles(
    native: &NativeGpu,
    scenes: [&Scene; 2],
    settings: &Settings,
    size: [u32; 2],
    count: u32,
) -> Result<(), Error> {
    let sessions = scenes.map(|scene| Session::new(native, scene));
    let mut surfaces = Vec::new();
    let mut lights = Vec::new();
    for session in &sessions {
        let mut light = session.scene_frames(settings, size)?;
        light.run(0)?;
        let depth = light.read("depth")?.ok_or_else(|| Error::Failed("the plan has no depth".into()))?;
        surfaces.push(depth.iter().map(|texel| texel[0] > 0.0).collect::<Vec<_>>());
        lights.push(light);
    }
    // Lit only where both scenes show a surface: the lit pixels are the same ones.
    let lit = |index: usize| {
        let patch = [index as u32 % size[0] / PATCH, index as u32 / size[0] / PATCH];
        (patch[0] + patch[1]).is_multiple_of(2) && surfaces.iter().all(|surface| surface[index])
    };
    let direct: Vec<Rgb> = (0..surfaces[0].len()).map(|index| [f32::from(u8::from(lit(index))); 3]).collect();
    let share = |count: usize| 100.0 * count as f64 / direct.len() as f64;
    println!(
        "Gather over few and many triangles, {:.1} % of the pixels lit\n",
        share((0..direct.len()).filter(|&i| lit(i)).count())
    );
    let request = Request {
        technique: &hierarchical::TECHNIQUE,
        settings: settings.clone(),
        size,
        seed: 0,
        direct: Some(&direct),
    };
    let mut both = Vec::new();
    for (session, light) in sessions.iter().zip(&lights) {
        let mut frames = session.technique_frames(&request, light)?;
        frames.run(0)?;
        both.push((frames, Times::default()));
    }
    for frame in 0..count {
        for (frames, times) in &mut both {
            times.add(frames, frame)?;
        }
    }
    println!("{:<16}{:>12}{:>16}{:>36}", "scene", "triangles", "surface, %", "gather, ms");
    let gathers: Vec<_> = both.iter().map(|(_, times)| times.of(&GATHERS)).collect();
    for ((scene, surface), gather) in scenes.iter().zip(&surfaces).zip(&gathers) {
        let shown = share(surface.iter().filter(|shown| **shown).count());
        println!("{:<16}{:>12}{shown:>16.1}{:>36}", scene.name, scene.triangle_count(), spread(gather, 2));
    }
    println!(
        "{:<44}{:>36}",
        format!("{} / {}", scenes[1].name, scenes[0].name),
        spread(&ratios(&gathers[1], &gathers[0]), 3)
    );
    Ok(())
}
