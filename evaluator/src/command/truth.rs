//! `evaluator truth`.

use std::path::PathBuf;

use clap::Args;
use halflight_native::images::{Precision, auto_exposure, write_png};
use halflight_renderer::invocation::parse_size;
use halflight_renderer::truth::{Request, Stop};

use super::{SceneArgs, is_exr, print_warnings};
use crate::{
    Error,
    session::{open_adapter, open_scene_keeping},
    truth,
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
    #[arg(long, conflicts_with = "samples_per_pixel")]
    rel_error: Option<f32>,
    /// Samples a pixel [default: 64].
    #[arg(long)]
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
    /// Adapter: any, gpu, software, or part of a name.
    #[arg(long, default_value = "any")]
    adapter: String,
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
    let stop = match (args.rel_error, args.samples_per_pixel) {
        (Some(error), _) => Stop { error_block: 8, ..Stop::at_rel_error(error) },
        (None, samples) => Stop { error_block: 8, ..Stop::at_samples(samples.unwrap_or(64).max(1)) },
    };
    let traced = truth::trace(&native, &scene, &request, stop)?;
    print_warnings(&traced.warnings);
    let mut image = truth::image(&traced.truth);
    let facts = [
        ("scene", scene.name.clone()),
        ("samples_per_pixel", traced.truth.samples.to_string()),
        ("rel_error_8x8", traced.rel_error.to_string()),
        ("bounces", args.bounces.to_string()),
        ("seed", args.seed.to_string()),
        ("inputs", traced.inputs.to_string()),
        ("commit", crate::run::COMMIT.to_owned()),
    ];
    image.metadata.extend(facts.map(|(key, value)| (key.to_owned(), value)));
    if exr {
        image.write_exr(&args.out, Precision::Full)?;
    } else {
        let pixels = truth::final_radiance(&traced.truth);
        write_png(&args.out, args.size[0], &pixels, auto_exposure(&pixels, image.surface_mask().as_deref()))?;
    }
    Ok(())
}
