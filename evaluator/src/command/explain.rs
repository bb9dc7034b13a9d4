//! `evaluator explain`.

use std::path::PathBuf;

use clap::Args;
use halflight_native::cache::Cache;
use halflight_output::terminal;

use super::{SceneArgs, TechniqueArgs, print_json, print_warnings};
use halflight_renderer::parameters::Settings;
use halflight_techniques::invocation::{Invocation, parse_size};

use crate::{
    Error,
    experiment::{
        COMMIT,
        session::{open_adapter, open_scene},
    },
    explain::{Explanation, Options},
    format,
};

/// The frame that is explained: surfaces that appeared are blurred for about as many.
const FRAME: u32 = 8;

#[derive(Args)]
pub(super) struct ExplainArgs {
    #[command(flatten)]
    scene: SceneArgs,
    #[command(flatten)]
    technique: TechniqueArgs,
    /// Image size, pixels; the exhaustive sum takes time with the square of their number.
    #[arg(long, default_value = "320x180", value_parser = parse_size, value_name = "WxH")]
    size: [u32; 2],
    /// The frame that is explained, counted from 1, of a technique that keeps light in the world.
    #[arg(long, default_value_t = FRAME, value_parser = clap::value_parser!(u32).range(1..))]
    frame: u32,
    /// Frames that stand for the converged image. Of a technique that keeps light in the world, the number of frames after
    /// which it counts as converged.
    #[arg(long, default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..))]
    frames: u32,
    /// Samples a pixel of the reference.
    #[arg(long, default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..))]
    samples_per_pixel: u32,
    /// Direct light that the technique reads: rendered (shadow maps) or truth (path-traced).
    #[arg(long, value_name = "SOURCE", default_value = "rendered", value_parser = ["rendered", "truth"])]
    direct: String,
    /// Adapter: any, gpu, software, part of a name, or its number in `evaluator list adapters`.
    #[arg(long, default_value = "any")]
    adapter: String,
    /// Seed of the image that is explained.
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Folder for the page, the table, the chart and one picture a link.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

impl ExplainArgs {
    /// The command that finds the same figures, with the settings of a preset written out.
    fn invocation(&self, technique: &str, settings: &Settings) -> Invocation {
        Invocation::evaluator("explain")
            .option("scene", self.scene.scene.display())
            .technique(technique, settings)
            .size(self.size)
            .option_unless("frame", self.frame, FRAME)
            .option("frames", self.frames)
            .option("samples-per-pixel", self.samples_per_pixel)
            .option("direct", &self.direct)
            .option_unless("seed", self.seed, 0)
            .option_unless("adapter", self.adapter.as_str(), "any")
            .option_if("out", self.out.as_ref().map(|out| out.display()))
    }
}

pub(super) fn main(args: &ExplainArgs) -> Result<(), Error> {
    let (technique, settings) = args.technique.resolve()?;
    let scene = open_scene(&args.scene.scene)?;
    print_warnings(&scene.warnings);
    if let Some(folder) = &args.out {
        // A folder that holds files of the user is refused before anything is measured.
        Explanation::claim(folder)?;
    }
    let native = open_adapter(&args.adapter)?;
    let options = Options {
        technique,
        settings,
        size: args.size,
        seed: args.seed,
        frame: args.frame,
        frames: args.frames,
        samples_per_pixel: args.samples_per_pixel,
        cache: Some(Cache::standard()),
        direct_from_truth: args.direct == "truth",
    };
    let explanation = Explanation::measure(&native, &scene, &options)?;
    let [width, height] = args.size;
    let settings = format::settings(&options.settings);
    let facts = [
        ("Command", args.invocation(technique.name, &options.settings).to_string()),
        ("Scene", scene.name.clone()),
        ("Size", format!("{width}x{height}")),
        ("Technique", technique.name.to_owned()),
        ("Settings", if settings.is_empty() { "defaults".into() } else { settings }),
        ("Direct light", args.direct.clone()),
        ("Frames", args.frames.to_string()),
        ("Samples a pixel of the reference", args.samples_per_pixel.to_string()),
        ("Seed", args.seed.to_string()),
        ("Adapter", native.info.name.clone()),
        ("Commit", COMMIT.to_owned()),
        ("Warnings", if scene.warnings.is_empty() { "none".into() } else { scene.warnings.join("; ") }),
    ];
    let written = args.out.as_ref().map_or(Ok(()), |folder| {
        explanation.write(folder, &facts)?;
        terminal::note(format_args!("report: {}", folder.join("index.html").display()));
        Ok(())
    });
    // What was measured is printed even where the folder cannot be written.
    let printed = if args.json { print_json(&explanation.rows()) } else { Ok(terminal::print(explanation)?) };
    written.and(printed)
}
