//! Error and time of a technique over frames: relMSE of `albedo * indirect` over blocks of 4 x 4 pixels, against a
//! path-traced reference. The view is static, or `--moving` says what moves before.
//!
//!     cargo run --release -p halflight-evaluator --example error_over_frames -- scenes/atrium.toml --size 320x180
#![allow(clippy::disallowed_macros, reason = "an example prints")]

use std::{error::Error, path::PathBuf};

use clap::Parser;
use halflight_evaluator::experiment::{
    COMMIT,
    moving::Moving,
    reference,
    session::{Request, Session, open_adapter, open_scene},
};
use halflight_frame_graph::Part;
use halflight_metrics::{LinearPair, block_rel_mse, mean};
use halflight_native::images::{Image, Precision, Rgb};
use halflight_renderer::{
    parameters::{Settings, Value, check_settings},
    truth::{Request as TruthRequest, Stop},
};
use halflight_techniques::{invocation::parse_size, parameters_of, technique};

#[derive(Parser)]
struct Args {
    /// A scene file.
    scene: PathBuf,
    /// The technique.
    #[arg(long, default_value = "radiance-cache")]
    technique: String,
    /// A setting, NAME=VALUE.
    #[arg(long = "set")]
    set: Vec<String>,
    /// Width and height, pixels.
    #[arg(long, default_value = "320x180", value_parser = parse_size)]
    size: [u32; 2],
    /// Frames that are measured, counted from 1.
    #[arg(long, value_delimiter = ',', default_value = "1,8,32,128")]
    frames: Vec<u32>,
    /// What moves.
    #[arg(long, value_enum, default_value_t)]
    moving: Moving,
    /// Bounces of the reference.
    #[arg(long, default_value_t = reference::ALL_BOUNCES)]
    bounces: u32,
    /// Relative error of the reference over blocks of 8 x 8 pixels.
    #[arg(long, default_value_t = 0.02)]
    rel_error: f32,
    /// Folder for the frames as EXR files.
    #[arg(long)]
    out: Option<PathBuf>,
    /// Whether to skip the reference, and with it the errors.
    #[arg(long)]
    no_reference: bool,
}

fn main() -> Result<(), Box<dyn Error>> {
    let args = Args::parse();
    let native = open_adapter("any")?;
    let scene = open_scene(&args.scene)?;
    let technique = technique(&args.technique)?;
    let mut settings = Settings::new();
    for text in &args.set {
        let (key, value) = text.split_once('=').ok_or_else(|| format!("--set {text} has no value"))?;
        let key = if key.contains('.') { key.to_owned() } else { format!("{}.{key}", technique.name) };
        settings.insert(key, Value::parse(value));
    }
    check_settings(&settings, &parameters_of(technique))?;
    let settings = (technique.complete)(&settings)?;
    let truth = if args.no_reference {
        None
    } else {
        let request = TruthRequest {
            bounce1: args.bounces == 1,
            bounces: args.bounces,
            ..TruthRequest::new(scene.camera, args.size)
        };
        let stop = Stop { samples_per_pixel: 1 << 16, rel_error: Some(args.rel_error), error_block: 8 };
        Some(reference::image(&reference::trace(&native, &scene, &request, stop)?.truth))
    };
    println!(
        "{}, commit {COMMIT}, {}, {}, {}x{}",
        native.info.name, scene.name, technique.name, args.size[0], args.size[1]
    );
    println!("| frame | block relMSE | mean | technique, ms | trace, ms | slots taken |");
    println!("|---:|---:|---:|---:|---:|---:|");
    // A camera that moves is at the right place in one frame alone.
    let sequences: Vec<Vec<u32>> = match args.moving {
        Moving::Camera => args.frames.iter().map(|&frame| vec![frame]).collect(),
        _ => vec![args.frames.clone()],
    };
    for wanted in sequences {
        let last = wanted.iter().copied().max().unwrap_or(1);
        let (scene, before) = args.moving.apply(scene.clone(), last);
        let session = Session::new(&native, &scene);
        let request = Request { technique, settings: settings.clone(), size: args.size, seed: 0, direct: None };
        let mut frames = session.frames(&request)?;
        let mut times = Vec::new();
        for number in 1..=before + last {
            let time = frames.run(number - 1)?;
            let of = |wanted: &dyn Fn(&str) -> bool| {
                let passes = time.passes.iter().filter(|pass| pass.part == Part::Technique && wanted(&pass.name));
                passes.map(|pass| pass.milliseconds).sum::<f64>()
            };
            times.push([of(&|_| true), of(&|name| name == "trace")]);
            let Some(number) = number.checked_sub(before).filter(|number| wanted.contains(number)) else {
                continue;
            };
            let image = frames.image()?;
            if let Some(folder) = &args.out {
                image.write_exr(&folder.join(format!("{}_{number}.exr", technique.name)), Precision::Half)?;
            }
            let errors = truth.as_ref().map_or(Ok([f64::NAN; 2]), |truth| errors(&image, truth))?;
            let errors: Vec<String> = errors.iter().map(|error| format!("{error:.4}")).collect();
            let [all, trace] = [0, 1].map(|part| {
                let mut sorted: Vec<f64> = times.iter().map(|time| time[part]).collect();
                sorted.sort_by(f64::total_cmp);
                sorted[sorted.len() / 2]
            });
            let taken = frames.read_buffer("buckets")?.map_or(String::new(), |bytes| slots_taken(&bytes));
            println!("| {number} | {} | {all:.1} | {trace:.1} | {taken} |", errors.join(" | "));
            times.clear();
        }
    }
    Ok(())
}

/// Slots of the cache's table that have a record. Twin of `Bucket` in radiance_cache/cells.wgsl: eight fingerprints, 0 in
/// empty slots, before eight cells.
fn slots_taken(buckets: &[u8]) -> String {
    let slots = buckets.chunks_exact(224).flat_map(|bucket| bucket[..32].chunks_exact(4));
    let count = slots.clone().count();
    let taken = slots.filter(|&fingerprint| fingerprint != [0; 4]).count();
    format!("{taken} of {count}")
}

/// relMSE over blocks of 4 x 4 pixels, and the mean relative to that of the reference.
fn errors(image: &Image, truth: &Image) -> Result<[f64; 2], Box<dyn Error>> {
    let mask = truth.surface_mask().ok_or("the reference has no depth")?;
    let albedo = truth.rgb("albedo").ok_or("the reference has no albedo")?;
    let light = |image: &Image| -> Vec<Rgb> {
        let light = image.rgb("indirect").unwrap_or_else(|| vec![[0.0; 3]; albedo.len()]);
        albedo.iter().zip(&light).map(|(a, i)| std::array::from_fn(|c| a[c] * i[c])).collect()
    };
    let (own, wanted) = (light(image), light(truth));
    let pair = LinearPair::new(&own, &wanted, Some(&mask));
    Ok([block_rel_mse(&pair, truth.width), mean(&own, Some(&mask)) / mean(&wanted, Some(&mask))])
}
