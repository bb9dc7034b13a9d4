//! `evaluator recommend`.

use std::path::PathBuf;

use clap::Args;
use halflight_output::terminal;
use halflight_recommend::{Cell, Goal, metric};
use halflight_techniques::{
    invocation::{Invocation, parse_size},
    technique,
};

use super::{SceneArgs, print_json, print_warnings};
use crate::{
    Error,
    experiment::{
        reference::ALL_BOUNCES,
        session::{open_adapter, open_scene},
    },
    recommend::{self, Measurer, Measuring, Options, Report},
};

/// Searches all techniques and their declared grid values for the best within a limit. The time that counts is the median
/// of all passes of the technique, beyond G-buffer and direct light, with everything changed: as `time_ms_median` of
/// reports, and with --moving as without it.
#[derive(Args)]
#[group(id = "limit", required = true, multiple = false, args = ["budget_ms", "error_bound"])]
pub(super) struct RecommendArgs {
    #[command(flatten)]
    scene: SceneArgs,
    /// Most time of the technique, milliseconds: the lowest error within it is searched.
    #[arg(long, value_name = "MS", value_parser = positive)]
    budget_ms: Option<f64>,
    /// Largest error by --metric: the shortest time within it is searched.
    #[arg(long, value_name = "ERROR", value_parser = positive)]
    error_bound: Option<f64>,
    /// Metric that decides: flip, rel_mse, block_rel_mse, rmse, ssim, hdr_flip or bias; of ssim, 1 less it, and of bias its
    /// magnitude.
    #[arg(long, default_value = "block_rel_mse")]
    metric: String,
    /// Image size, pixels.
    #[arg(long, default_value = "1280x720", value_parser = parse_size, value_name = "WxH")]
    size: [u32; 2],
    /// Technique to choose from; may be given many times [default: all]
    #[arg(long = "technique", value_name = "NAME")]
    techniques: Vec<String>,
    /// The camera moves sideways in each frame. Without it, the camera is static. What builds on frames before counts with
    /// frame 60: what is seen after a second at 60 frames a second.
    #[arg(long)]
    moving: bool,
    /// Time for the search, minutes. It ends with the best so far.
    #[arg(long, default_value_t = 5.0, value_parser = positive)]
    minutes: f64,
    /// Bounces of the reference. Light of bounces that a configuration leaves out counts as error.
    #[arg(long, default_value_t = ALL_BOUNCES, value_parser = clap::value_parser!(u32).range(1..=64))]
    bounces: u32,
    /// Folder for the page, the preset, recommend.json and the measured cells.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON.
    #[arg(long)]
    json: bool,
    /// Keep the cells that an earlier search left in --out.
    #[arg(long, requires = "out")]
    resume: bool,
    /// Adapter: any, gpu, software, part of a name, or its number in `evaluator list adapters`.
    #[arg(long, default_value = "any")]
    adapter: String,
    /// Seed of every random number.
    #[arg(long, default_value_t = 0)]
    seed: u32,
}

fn positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|v: &f64| *v > 0.0 && v.is_finite());
    number.ok_or_else(|| "give a number above 0".into())
}

impl RecommendArgs {
    /// The command that repeats the search.
    fn invocation(&self) -> Invocation {
        let named = self.techniques.iter().fold(
            Invocation::evaluator("recommend")
                .option("scene", self.scene.scene.display())
                .option_if("budget-ms", self.budget_ms)
                .option_if("error-bound", self.error_bound)
                .option("metric", &self.metric)
                .size(self.size),
            |all, name| all.option("technique", name),
        );
        named
            .option_unless("minutes", self.minutes, 5.0)
            .option_unless("bounces", self.bounces, ALL_BOUNCES)
            .option_if("out", self.out.as_ref().map(|out| out.display()))
            .option_unless("adapter", self.adapter.as_str(), "any")
            .option_unless("seed", self.seed, 0)
            .flag("moving", self.moving)
    }
}

pub(super) fn main(args: &RecommendArgs) -> Result<(), Error> {
    let goal = match (args.budget_ms, args.error_bound) {
        (Some(budget), _) => Goal::Budget(budget),
        (None, Some(bound)) => Goal::ErrorBound(bound),
        (None, None) => return Err(Error::BadInput("give --budget-ms MS or --error-bound ERROR".into())),
    };
    let named = args.techniques.iter().map(|name| technique(name).map_err(|e| Error::BadInput(e.to_string())));
    let options = Options {
        goal,
        metric: metric(&args.metric).map_err(Error::BadInput)?,
        size: args.size,
        techniques: named.collect::<Result<_, _>>()?,
        measuring: Measuring { moving: args.moving, bounces: args.bounces, seed: args.seed },
        minutes: args.minutes,
    };
    let scene = open_scene(&args.scene.scene)?;
    print_warnings(&scene.warnings);
    // Images are measured in the first pose, as those of reports.
    let still = scene.posed(0);
    let folder = args.out.as_deref().map(recommend::claim).transpose()?;
    let native = open_adapter(&args.adapter)?;
    let found = recommend::recommend(&native, &still, &options, folder.as_ref(), args.resume)?;
    let report = Report {
        options: &options,
        scene: &still,
        path: args.scene.scene.display().to_string(),
        found: &found,
        command: args.invocation(),
        adapter: native.info.name.clone(),
        software: native.is_software(),
    };
    let pictures = match (&found.answer, &folder) {
        (Ok(answer), Some(_)) => {
            let point = &answer.point;
            let cell = Cell::full_size(point.technique, point.settings.clone(), args.size);
            Some(Measurer::new(&native, &still, options.metric, options.measuring.clone()).pictures(&cell)?)
        }
        _ => None,
    };
    let written = folder.as_ref().map_or(Ok(()), |folder| {
        report.write(folder, pictures.as_ref())?;
        if found.answer.is_ok() {
            terminal::note(format_args!("report: {}", folder.path().join("index.html").display()));
        }
        Ok(())
    });
    // What was found is printed even where the folder cannot be written.
    let printed = match (&found.answer, args.json) {
        (_, true) => print_json(&report.json()),
        (Ok(_), false) => Ok(terminal::print(&report)?),
        (Err(_), false) => Ok(()),
    };
    written.and(printed)?;
    found.answer.map(drop).map_err(|sentence| Error::BadInput(sentence.to_string()))
}
