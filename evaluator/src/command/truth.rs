//! `evaluator truth`.

use std::path::PathBuf;

use clap::Args;
use halflight_native::{
    images::{Precision, auto_exposure, write_png},
    scene_hash::scene_hash,
};
use halflight_renderer::truth::{Request, Stop};
use halflight_techniques::invocation::{Invocation, parse_size};

use super::{SceneArgs, is_exr, print_warnings};
use crate::{
    Error,
    experiment::{
        COMMIT, reference,
        session::{open_adapter, open_scene_keeping},
    },
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
    /// Where to write: .exr holds every channel, .png the tone-mapped image.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Adapter: any, gpu, software, part of a name, or its number in `evaluator list adapters`.
    #[arg(long, default_value = "any")]
    adapter: String,
}

impl TruthArgs {
    /// The command that traces the same image.
    fn invocation(&self) -> Invocation {
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
            .option("out", self.out.display())
    }
}

pub(super) fn main(args: &TruthArgs) -> Result<(), Error> {
    let exr = is_exr(&args.out)?;
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
    let most = if args.rel_error.is_some() { 1 << 16 } else { 64 };
    let stop =
        Stop { samples_per_pixel: args.samples_per_pixel.unwrap_or(most), rel_error: args.rel_error, error_block: 8 };
    let traced = reference::trace(&native, &scene, &request, stop)?;
    print_warnings(&traced.warnings);
    if traced.rel_error.is_none() {
        print_warnings(&[reference::unknown_error(&scene.name, traced.truth.samples)]);
    }
    let mut image = reference::image(&traced.truth);
    let facts = [
        ("command", args.invocation().to_string()),
        ("scene", scene.name.clone()),
        ("scene_hash", scene_hash(&scene).to_string()),
        ("samples_per_pixel", traced.truth.samples.to_string()),
        ("rel_error_8x8", traced.rel_error.map_or("unknown".into(), |error| error.to_string())),
        ("bounces", args.bounces.to_string()),
        ("seed", args.seed.to_string()),
        ("inputs", traced.inputs.to_string()),
        ("commit", COMMIT.to_owned()),
        ("warnings", scene.warnings.join("; ")),
    ];
    image.metadata.extend(facts.map(|(key, value)| (key.to_owned(), value)));
    if exr {
        image.write_exr(&args.out, Precision::Full)?;
    } else {
        let pixels = reference::final_radiance(&traced.truth);
        write_png(&args.out, args.size[0], &pixels, auto_exposure(&pixels, image.surface_mask().as_deref()))?;
    }
    Ok(())
}
