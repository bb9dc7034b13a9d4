//! `evaluator truth`.

use std::path::PathBuf;

use clap::Args;
use halflight_native::NativeGpu;
use halflight_renderer::truth::{PART, Request, Stop};
use halflight_scenes::Scene;
use halflight_techniques::invocation::{Invocation, parse_size};

use super::{SceneArgs, is_exr, parse_shard, print_warnings};
use crate::{
    Error,
    experiment::{
        reference,
        session::{open_adapter, open_scene_keeping},
        shard::Shard,
    },
    merge::reference::{About, ENDING, ReferencePart, write},
};

#[derive(Args)]
pub(super) struct TruthArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Image size, pixels.
    #[arg(long, default_value = "1280x720", value_parser = parse_size, value_name = "WxH")]
    size: [u32; 2],
    /// Bounces of indirect light, 0 to 64.
    #[arg(long, default_value_t = 1)]
    bounces: u32,
    /// Stop at this relative error over blocks of 8x8 pixels.
    #[arg(long)]
    rel_error: Option<f32>,
    /// Most samples a pixel [default: 64; with --rel-error 65536].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    samples_per_pixel: Option<u32>,
    /// Also trace the part of the first bounce that comes from surfaces on the screen.
    #[arg(long)]
    on_screen: bool,
    /// Also trace what glossy materials (Ks, Ns) send on to the eye.
    #[arg(long)]
    glossy: bool,
    /// Also trace ambient occlusion of this radius, scene units; 0 for unlimited.
    #[arg(long, value_name = "RADIUS")]
    ambient_occlusion: Option<f32>,
    /// Number of the frame at which a moving scene is traced.
    #[arg(long, default_value_t = 0)]
    frame: u32,
    /// Seed of every random number.
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Trace part I of N of the samples only (I from 0), 64 or a multiple of them, to share a reference among machines.
    /// `evaluator merge` adds the files exactly. `auto` is as for `evaluator run`.
    #[arg(long, value_name = "I/N|auto", conflicts_with = "rel_error", requires = "samples_per_pixel")]
    shard: Option<String>,
    /// Number of parts for --shard auto, where the scheduler does not say it.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    shards: Option<u32>,
    /// Where to write: .exr holds every channel, .png the tone-mapped image, .truth the sums of a part.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Adapter: any, gpu, software, part of a name, or its number in `evaluator list adapters`.
    #[arg(long, default_value = "any")]
    adapter: String,
}

impl TruthArgs {
    /// The command that traces the same image.
    fn invocation(&self, shard: Option<Shard>) -> Invocation {
        Invocation::evaluator("truth")
            .option("scene", self.scene.scene.display())
            .size(self.size)
            .option("bounces", self.bounces)
            .option_if("samples-per-pixel", self.samples_per_pixel)
            .option_if("rel-error", self.rel_error)
            .option_unless("seed", self.seed, 0)
            .option_unless("frame", self.frame, 0)
            .flag("on-screen", self.on_screen)
            .flag("glossy", self.glossy)
            .option_if("ambient-occlusion", self.ambient_occlusion)
            .option_unless("adapter", self.adapter.as_str(), "any")
            .option_if("shard", shard)
            .option("out", self.out.display())
    }
}

pub(super) fn main(args: &TruthArgs) -> Result<(), Error> {
    let shard = args.shard.as_deref().map(|text| parse_shard(text, args.shards)).transpose()?;
    if args.shard.is_none() && args.shards.is_some() {
        return Err(Error::BadInput("--shards goes with --shard auto only: add it, or leave --shards out".into()));
    }
    let is_part = args.out.extension().is_some_and(|ending| ending == ENDING);
    match shard {
        Some(_) if !is_part => {
            let out = args.out.display();
            return Err(Error::BadInput(format!("--out {out} is no .truth file, which holds a part: name it so")));
        }
        Some(_) => {}
        None => drop(is_exr(&args.out)?),
    }
    let scene = open_scene_keeping(&args.scene.scene, &args.out)?;
    print_warnings(&scene.warnings);
    let scene = scene.posed(args.frame);
    let native = open_adapter(&args.adapter)?;
    let request = Request {
        bounce1: args.bounces > 0,
        bounces: args.bounces,
        on_screen: args.on_screen,
        glossy: args.glossy,
        ambient_occlusion: args.ambient_occlusion,
        seed: args.seed,
        ..Request::new(scene.camera, args.size)
    };
    let most = args.samples_per_pixel.unwrap_or(if args.rel_error.is_some() { 1 << 16 } else { 64 });
    if let Some(shard) = shard {
        return trace_part(args, &native, &scene, &request, most, shard);
    }
    let stop = Stop { samples_per_pixel: most, rel_error: args.rel_error, error_block: 8 };
    let traced = reference::trace(&native, &scene, &request, stop)?;
    print_warnings(&traced.warnings);
    if traced.rel_error.is_none() {
        print_warnings(&[reference::unknown_error(&scene.name, traced.truth.samples)]);
    }
    let command = args.invocation(None).to_string();
    let about = About::new(command, &native, &scene, &request, &traced.inputs, traced.truth.samples);
    write(&traced.truth, traced.rel_error, &about, &args.out)
}

/// Traces the samples of a part and writes their sums.
fn trace_part(
    args: &TruthArgs,
    native: &NativeGpu,
    scene: &Scene,
    request: &Request,
    samples: u32,
    shard: Shard,
) -> Result<(), Error> {
    let parts = shard.range(samples.div_ceil(PART));
    let range = parts.start * PART..(parts.end * PART).min(samples);
    if range.is_empty() {
        return Err(Error::BadInput(format!(
            "--shard {shard} of {samples} samples a pixel has none: parts are of {PART} samples, so use at most {} shards",
            samples.div_ceil(PART)
        )));
    }
    let sampled = reference::trace_range(native, scene, request, range)?;
    print_warnings(&sampled.warnings);
    let command = args.invocation(Some(shard)).to_string();
    let about = About::new(command, native, scene, request, &sampled.inputs, samples);
    ReferencePart { about, sums: sampled.sums }.write(&args.out)
}
