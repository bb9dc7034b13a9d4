//! The command line.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

use clap::{Args, Parser, Subcommand};
use halflight_output::{PrintError, terminal};
use halflight_renderer::{
    gi::Technique,
    parameters::{Settings, Value, check_settings},
};
use halflight_techniques::{self, preset::Preset};

use crate::{Error, experiment::shard::Shard};

mod explain;
mod export;
mod list;
mod merge;
mod plan;
mod recommend;
mod render;
mod run;
mod truth;

/// Measures screen-space indirect illumination: what each millisecond buys.
#[derive(Parser)]
#[command(name = "evaluator", version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run a grid of configurations: time each one, measure it against the path-traced reference, write a report folder.
    Run(run::RunArgs),
    /// Merge report folders of one grid, measured in parts, to one.
    Merge(merge::MergeArgs),
    /// Render one frame of a scene to an EXR (all channels) or a PNG (tone-mapped).
    Render(render::RenderArgs),
    /// Print the plan of a frame: passes, textures with their bytes, and the reason for each.
    Plan(plan::PlanArgs),
    /// Path-trace the reference of a scene. Traced samples are cached, and a later call continues from them.
    Truth(truth::TruthArgs),
    /// Split the error of a technique into its sources: noise, estimator, missing visibility, light off the screen.
    Explain(explain::ExplainArgs),
    /// Recommend the settings with the lowest error within a time, or the fastest within an error.
    Recommend(recommend::RecommendArgs),
    /// Write a plan and its shaders as files for other engines.
    Export(export::ExportArgs),
    /// Compare two EXR or PNG images by every metric.
    Compare {
        /// The image.
        image: PathBuf,
        /// What it should look like.
        reference: PathBuf,
        /// Print JSON.
        #[arg(long)]
        json: bool,
    },
    /// List techniques, parameters, adapters or scenes.
    List(list::ListArgs),
}

/// A technique and its settings.
#[derive(Args)]
struct TechniqueArgs {
    /// Technique; `evaluator list techniques` names them. [default: that of --preset, otherwise hierarchical]
    #[arg(long)]
    technique: Option<String>,
    /// A file with a technique and its settings, as the viewer saves it; --set replaces single settings.
    #[arg(long, value_name = "FILE.toml")]
    preset: Option<PathBuf>,
    /// A setting, as technique.parameter=value or parameter=value; may be given many times.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<String>,
}

impl TechniqueArgs {
    fn resolve(&self) -> Result<(&'static Technique, Settings), Error> {
        let bad = |e: halflight_renderer::parameters::SettingsError| Error::BadInput(e.to_string());
        let preset = self.preset.as_deref().map(read_preset).transpose()?;
        let technique = match (&self.technique, &preset) {
            (Some(name), _) => halflight_techniques::technique(name).map_err(bad)?,
            (None, Some(preset)) => preset.technique,
            (None, None) => halflight_techniques::technique("hierarchical").map_err(bad)?,
        };
        if let Some(preset) = preset.as_ref().filter(|preset| preset.technique.name != technique.name) {
            return Err(Error::BadInput(format!(
                "--technique {} does not go with --preset, which is for {}: leave one of them out",
                technique.name, preset.technique.name
            )));
        }
        let mut settings = preset.map(|preset| preset.settings).unwrap_or_default();
        for text in &self.settings {
            let (name, value) = text
                .split_once('=')
                .ok_or_else(|| Error::BadInput(format!("--set {text} has no value: write --set {text}=VALUE")))?;
            let key = if name.contains('.') { name.to_owned() } else { format!("{}.{name}", technique.name) };
            settings.insert(key, Value::parse(value));
        }
        check_settings(&settings, &halflight_techniques::parameters_of(technique)).map_err(bad)?;
        Ok((technique, settings))
    }
}

fn read_preset(path: &Path) -> Result<Preset, Error> {
    let text = std::fs::read_to_string(path)
        .map_err(|e| Error::BadInput(format!("cannot read {}: {e}; check --preset", path.display())))?;
    Preset::read(path, &text).map_err(|e| Error::BadInput(e.to_string()))
}

/// Runs the command line; returns the process's exit code: 0 done, 1 failed, 2 bad input.
pub fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(answer) => return explain_usage(&answer),
    };
    let result = match cli.command {
        Command::Render(args) => render::render(&args),
        Command::Plan(args) => plan::plan(&args),
        Command::Run(args) => run::main(&args),
        Command::Merge(args) => merge::main(&args),
        Command::Truth(args) => truth::main(&args),
        Command::Compare { image, reference, json } => compare(&image, &reference, json),
        Command::Explain(args) => explain::main(&args),
        Command::Export(args) => export::main(&args),
        Command::Recommend(args) => recommend::main(&args),
        Command::List(args) => list::main(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => end(&error),
    }
}

/// Ends with an error: its sentence on standard error, unless all that happened is that the reader went away.
fn end(error: &Error) -> ExitCode {
    if !matches!(error, Error::Print(PrintError::Closed)) {
        terminal::note(format_args!("error: {error}"));
    }
    ExitCode::from(error.exit_code())
}

/// Prints the help that was asked for, or what is wrong with the command line.
fn explain_usage(answer: &clap::Error) -> ExitCode {
    let printed = answer.print().map_err(PrintError::from).and_then(|()| terminal::flush());
    match printed {
        Err(error) if !answer.use_stderr() => end(&error.into()),
        _ => ExitCode::from(answer.exit_code() as u8),
    }
}

/// Prints a value as JSON.
fn print_json(value: &impl serde::Serialize) -> Result<(), Error> {
    let text = serde_json::to_string_pretty(value).map_err(|e| Error::Failed(e.to_string()))?;
    Ok(terminal::print_line(text)?)
}

/// Says on standard error what the loader of a scene replaced.
fn print_warnings(warnings: &[String]) {
    warnings.iter().for_each(|warning| terminal::note(format_args!("warning: {warning}")));
}

/// The scene, by file or by the name of a bundled one.
#[derive(Args)]
struct SceneArgs {
    /// Scene file (.toml), model (.obj, .gltf, .glb), or name of a bundled scene: `evaluator list scenes` names them.
    #[arg(long, value_name = "FILE")]
    scene: PathBuf,
}

fn compare(image: &Path, reference: &Path, json: bool) -> Result<(), Error> {
    let comparison = crate::compare::compare(image, reference)?;
    if json { print_json(&comparison) } else { Ok(terminal::print_line(comparison)?) }
}

/// The part of the work that `--shard` and `--shards` name.
fn parse_shard(text: &str, parts: Option<u32>) -> Result<Shard, Error> {
    Shard::parse(text, parts, &|name| std::env::var(name).ok()).map_err(Error::BadInput)
}

/// Whether an output file holds all channels (EXR) or one picture (PNG).
fn is_exr(path: &Path) -> Result<bool, Error> {
    match path.extension().map(|e| e.to_string_lossy().to_lowercase()).as_deref() {
        Some("exr") => Ok(true),
        Some("png") => Ok(false),
        _ => Err(Error::BadInput(format!(
            "--out {} is neither .exr nor .png: give it one of these endings",
            path.display()
        ))),
    }
}
