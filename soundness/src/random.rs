//! Random scenes, cameras, sizes and settings. None may panic, write a value that is not finite, or take too long. One that
//! does is shrunk to the smallest that still fails, and written as a scene and a preset.

use std::{
    path::Path,
    time::{Duration, Instant},
};

use halflight_evaluator::{
    Error,
    experiment::session::{Request, Session},
    progress::Progress,
};
use halflight_native::{AdapterChoice, NativeGpu, files::write_whole};
use halflight_output::OutputFolder;
use halflight_renderer::parameters::Settings;
use halflight_scenes::write_scene;
use halflight_techniques::{invocation::Invocation, preset::Preset};
use proptest::{
    strategy::{Strategy, ValueTree},
    test_runner::{Config, RngAlgorithm, TestRng, TestRunner},
};

use crate::{
    check::Check,
    panics::caught,
    settings::{with_small_shadows, words},
};

mod configuration;

use configuration::{Configuration, configuration};

impl Configuration {
    /// The fault, `None` where there is none, and whether the image shows indirect light.
    fn judge(&self, native: &NativeGpu) -> (Option<String>, bool) {
        let start = Instant::now();
        let result = caught(|| self.run(native));
        let (fault, lit) = match result {
            Err(message) => (Some(format!("panics: {message}")), false),
            Ok(Err(error)) => (Some(format!("fails: {error}")), false),
            Ok(Ok(found)) => found,
        };
        let mut took = start.elapsed();
        if took > TOO_LONG {
            // On a busy computer other programs may have taken the time: a second run decides.
            let start = Instant::now();
            drop(caught(|| self.run(native)));
            took = took.min(start.elapsed());
        }
        (fault.or_else(|| (took > TOO_LONG).then(|| format!("takes {:.0} s", took.as_secs_f64()))), lit)
    }

    fn run(&self, native: &NativeGpu) -> Result<(Option<String>, bool), Error> {
        let scene = self.scene();
        let session = Session::new(native, &scene).keep_all();
        let settings = with_small_shadows(&self.settings());
        let request = Request { technique: self.technique(), settings, size: self.size, seed: self.seed, direct: None };
        let mut frames = match session.frames(&request) {
            Ok(frames) => frames,
            // The technique refuses this combination with a message.
            Err(Error::BadInput(sentence)) if sentence.contains(self.technique().name) => return Ok((None, false)),
            Err(error) => return Err(error),
        };
        for frame in 0..self.frames {
            frames.run(frame)?;
            let plan = frames.plan();
            let light = |name: &str| {
                let outputs = ["direct", "indirect", "glossy", "final"];
                outputs.iter().any(|o| plan.outputs.get(o).is_some_and(|id| plan.resources[id.0].name == name))
            };
            for found in frames.scan()? {
                if found.not_finite() > 0 {
                    let text =
                        format!("frame {frame}: {} has {} NaN, {} infinities", found.name, found.nan, found.infinite);
                    return Ok((Some(text), false));
                }
                if found.negative > 0 && light(&found.name) {
                    let text = format!("frame {frame}: {} has {} values below zero", found.name, found.negative);
                    return Ok((Some(text), false));
                }
            }
        }
        let light = frames.read_rgb("indirect")?.unwrap_or_default();
        Ok((None, light.iter().flatten().any(|&v| v > 0.0)))
    }

    /// Writes a scene, a preset and the command that repeats the fault.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &Path, number: usize, fault: &str) -> Result<(), Error> {
        let name = format!("random_{number}");
        let files = write_scene(&self.scene(), &name).map_err(|e| Error::Failed(e.to_string()))?;
        let settings = with_small_shadows(&self.settings());
        let preset = Preset { technique: self.technique(), settings }.to_toml();
        let command = Invocation::evaluator("render")
            .option("scene", format_args!("{name}.toml"))
            .option("preset", format_args!("{name}.preset.toml"))
            .size(self.size)
            .option("seed", self.seed)
            .option("frame", self.frames - 1)
            .flag("check", true)
            .option("out", format_args!("{name}.exr"));
        let command = format!("# {fault}\n# {command}\n");
        let preset = (format!("{name}.preset.toml"), (command + &preset).into_bytes());
        let folder = OutputFolder::open(folder);
        for (file, bytes) in files.into_iter().chain([preset]) {
            let path = folder.claim(&file)?;
            write_whole(&path, |file| std::io::Write::write_all(file, &bytes))
                .map_err(|e: std::io::Error| Error::unwritable(&path, e))?;
        }
        Ok(())
    }
}

/// A frame of at most 64x48 pixels that takes longer counts as hanging.
const TOO_LONG: Duration = Duration::from_secs(60);
/// Largest number of shrinking steps.
const SHRINKS: usize = 400;
/// Configurations per device, because a device keeps its pipelines as long as it exists.
const A_DEVICE: usize = 250;

/// What a run of random configurations found.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Number of configurations.
    pub run: usize,
    /// Number of those that showed indirect light.
    pub lit: usize,
    /// Faults as text, each of the smallest configuration found.
    pub faults: Vec<String>,
}

impl Outcome {
    /// The outcome as a check of a table.
    pub fn check(&self) -> Check {
        let reason = "none panics, hangs or writes a value that is not finite or negative light";
        let faults = self.faults.join("; ");
        Check::new("random", "random scenes, cameras, sizes and settings", "all", &Settings::new())
            .bounded("faults", self.faults.len() as f64, 0.0, reason)
            .detail(format!("{} configurations, {} with indirect light; {faults}", self.run, self.lit))
    }
}

/// Runs `count` configurations, the same ones for the same seed; faults are written to `folder` where one is given.
///
/// # Errors
/// Where there is no adapter, or a folder cannot be written.
pub fn run(adapter: &AdapterChoice, count: usize, seed: u64, folder: Option<&Path>) -> Result<Outcome, Error> {
    let open = || NativeGpu::open(adapter).map_err(|e| Error::BadInput(e.to_string()));
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
    let mut runner = TestRunner::new_with_rng(Config { max_shrink_iters: 0, ..Config::default() }, rng);
    let strategy = configuration();
    let mut outcome = Outcome::default();
    let progress = Progress::new("random configurations", count as u64);
    let mut native = open()?;
    for number in 0..count {
        if number % A_DEVICE == A_DEVICE - 1 {
            native = open()?;
        }
        let mut tree = strategy.new_tree(&mut runner).map_err(|e| Error::Failed(e.to_string()))?;
        outcome.run += 1;
        progress.set(number as u64, &format!("{} faults", outcome.faults.len()));
        let mut smallest = tree.current();
        let (fault, lit) = smallest.judge(&native);
        outcome.lit += usize::from(lit);
        let Some(mut fault) = fault else { continue };
        let mut failed = true;
        for _ in 0..SHRINKS {
            if !(if failed { tree.simplify() } else { tree.complicate() }) {
                break;
            }
            // A lost device would make everything fail.
            if fault.contains("lost") {
                native = open()?;
            }
            let (found, _) = tree.current().judge(&native);
            failed = found.is_some();
            if let Some(found) = found {
                (smallest, fault) = (tree.current(), found);
            }
        }
        let description =
            format!("{fault}: {} {} {smallest:?}", smallest.technique().name, words(&smallest.settings()));
        if let Some(folder) = folder {
            smallest.write(folder, outcome.faults.len(), &fault)?;
        }
        outcome.faults.push(description);
        native = open()?;
    }
    progress.finish(&format!("{count} random configurations, {} faults", outcome.faults.len()));
    Ok(outcome)
}
