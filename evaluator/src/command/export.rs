//! `evaluator export`.

use std::path::PathBuf;

use clap::Args;
use halflight_output::{OutputFolder, terminal};
use halflight_techniques::invocation::parse_size;

use super::{TechniqueArgs, print_warnings};
use crate::{
    Error,
    experiment::session::{open_adapter, open_scene},
    export::{export, sample::write_sample},
};

#[derive(Args)]
pub(super) struct ExportArgs {
    #[command(flatten)]
    technique: TechniqueArgs,
    /// Size of the display, pixels. Most plans are valid for other sizes, too: plan.json says so.
    #[arg(long, default_value = "1280x720", value_parser = parse_size, value_name = "WxH")]
    size: [u32; 2],
    /// Folder for plan.json and the shaders.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Also write inputs and results of this scene, to check a player of the plan: sample.json and raw texels.
    #[arg(long, value_name = "SCENE")]
    sample: Option<PathBuf>,
    /// Frames of the sample.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000), requires = "sample")]
    frames: u32,
    /// Adapter that computes the sample: any, gpu, software, part of a name, or its number in `evaluator list adapters`.
    #[arg(long, default_value = "any", requires = "sample")]
    adapter: String,
}

pub(super) fn main(args: &ExportArgs) -> Result<(), Error> {
    let (technique, settings) = args.technique.resolve()?;
    let exported = export(technique, &settings, args.size)?;
    let folder = OutputFolder::open(&args.out);
    let write = |name: &str, text: &str| {
        let path = folder.claim(name)?;
        std::fs::write(&path, text).map_err(|error| Error::unwritable(&path, error))
    };
    // Shaders of an earlier export may belong to passes that are gone.
    folder.remove(|name| name.ends_with(".wgsl") || name.starts_with("sample"))?;
    let plan = serde_json::to_string_pretty(&exported.document).map_err(|e| Error::Failed(e.to_string()))?;
    write("plan.json", &(plan + "\n"))?;
    for (name, text) in &exported.shaders {
        write(name, text)?;
    }
    if let Some(path) = &args.sample {
        let scene = open_scene(path)?;
        print_warnings(&scene.warnings);
        write_sample(&open_adapter(&args.adapter)?, &scene, &exported.plan, args.frames, &folder)?;
    }
    let document = &exported.document;
    let valid = match &document.display.reason {
        None => "valid for any size".to_owned(),
        Some(reason) => format!("valid for this size alone: {reason}"),
    };
    Ok(terminal::print_line(format_args!(
        "{}: {} passes, {} textures, {valid}",
        args.out.join("plan.json").display(),
        document.passes.len(),
        document.textures.len()
    ))?)
}
