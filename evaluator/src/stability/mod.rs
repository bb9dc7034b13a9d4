//! `evaluator stability`: whether techniques stay numerically sound at the extremes.
//!
//! Rows are extremes of geometry, image, light, material and parameters, invariances, precision, bad input and faults.
//! Every row is run with every technique that is listed and with settings that follow from the declarations of its
//! parameters ([`switches`]), so that a new technique or switch is covered without a line of new code here.

use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind},
};

use halflight_native::NativeGpu;
use halflight_renderer::{
    gi::Technique,
    parameters::{Kind, Parameter, Settings, Value},
    scene::SceneFacts,
};
use halflight_techniques::TECHNIQUES;
use serde::Serialize;

use crate::{Error, progress::Progress};

mod bad_input;
mod closed_forms;
pub mod corner;
mod extremes;
pub mod faults;
pub mod fuzz;
mod invariances;
pub mod mutations;
pub mod oracle;
mod output;
mod precision;
pub mod random;
pub mod scenes;
pub mod sectors;
pub mod switches;
pub mod voxels;

use switches::Switches;

/// What one row measured of one technique with some settings.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// Group of rows: geometry, image, invariance...
    pub group: &'static str,
    /// The row.
    pub row: String,
    /// Technique, or what else was looked at.
    pub technique: String,
    /// Settings that differ from the defaults.
    pub settings: String,
    /// What the worst value is.
    pub measure: &'static str,
    /// The worst value.
    pub worst: f64,
    /// What it may be at most; `None` where nothing is promised and the value is told as it is.
    pub bound: Option<f64>,
    /// Why the bound is what it is.
    pub reason: String,
    /// Where the worst value stood.
    pub detail: String,
    /// Values at the largest number that their format is given.
    pub clamped: u64,
    /// Largest value of all light, radiance.
    pub largest: f64,
}

impl Check {
    /// A check of this row; the worst value and its bound come next.
    pub(crate) fn new(group: &'static str, row: impl Into<String>, technique: &str, settings: &Settings) -> Self {
        Self {
            group,
            row: row.into(),
            technique: technique.into(),
            settings: words(settings),
            measure: "",
            worst: 0.0,
            bound: None,
            reason: String::new(),
            detail: String::new(),
            clamped: 0,
            largest: 0.0,
        }
    }

    /// A value that may be at most `bound`.
    pub(crate) fn bounded(self, measure: &'static str, worst: f64, bound: f64, reason: &str) -> Self {
        Self { measure, worst, bound: Some(bound), reason: reason.into(), ..self }
    }

    /// A value of which nothing is promised.
    pub(crate) fn told(self, measure: &'static str, worst: f64, reason: &str) -> Self {
        Self { measure, worst, bound: None, reason: reason.into(), ..self }
    }

    pub(crate) fn detail(self, detail: impl Into<String>) -> Self {
        Self { detail: detail.into(), ..self }
    }

    /// Whether the worst value is over its bound; a value that is not a number always is.
    pub fn is_red(&self) -> bool {
        self.bound.is_some_and(|bound| self.worst.is_nan() || self.worst > bound)
    }

    /// Why a red check is red, where that is known.
    pub fn explanation(&self) -> Option<&'static str> {
        let known = |e: &&Explained| {
            self.row.contains(e.row)
                && self.technique == e.technique
                && self.measure == e.measure
                && e.settings.iter().all(|wanted| self.settings.split(' ').any(|set| set.starts_with(wanted)))
        };
        EXPLAINED.iter().find(known).map(|e| e.cause)
    }
}

/// Checks that are known to be red, and why. A check that is red and not here fails the run.
struct Explained {
    /// Part of the row's name.
    row: &'static str,
    technique: &'static str,
    measure: &'static str,
    /// How settings that the check has begin.
    settings: &'static [&'static str],
    /// Cause and mend.
    cause: &'static str,
}

const EXPLAINED: &[Explained] = &[
    Explained {
        row: "a plane does not light itself",
        technique: "bitmask",
        measure: "indirect light over the plane's radiance",
        settings: &["steps=1"],
        cause: "one step on each side follows the plane of its sample to the receiver's own pixel and to the edge of the screen, \
                and the farther it goes the more a normal of 11 bits lifts it: 0.002; with two steps the row holds",
    },
    Explained {
        row: "64 lights",
        technique: "hybrid",
        measure: "errors",
        settings: &["light_view_size=512"],
        cause: "104 views of 512 texels a side do not fit a buffer that every device binds: refused by a sentence with the \
                size that fits",
    },
    Explained {
        row: "64 lights",
        technique: "hierarchical",
        measure: "errors",
        settings: &["light_view_size=512"],
        cause: "104 views of 512 texels a side and their pyramid do not fit a buffer that every device binds: refused by a \
                sentence with the size that fits",
    },
    Explained {
        row: "",
        technique: "hybrid",
        measure: "mean of indirect light over the most that sources can send",
        settings: &["weighting=published"],
        cause: "Equation 3 as printed has the unit of one over an area: its mean may be any times what sources send, and \
                the intensity is the user's",
    },
    Explained {
        row: "what was hidden in the frame before",
        technique: "bitmask",
        measure: "uncovered pixels with light of the frame before",
        settings: &["feedback="],
        cause: "feedback reflects the light of the frame before once more: that is how it makes further bounces",
    },
];

/// How much to run.
#[derive(Clone, Debug)]
pub struct Options {
    /// Techniques, by name; all of them where empty.
    pub techniques: Vec<String>,
    /// The default and a few settings a row instead of all pairs of values.
    pub quick: bool,
    /// Only rows whose group or name holds one of these texts; all where empty.
    pub rows: Vec<String>,
}

impl Table {
    /// Adds the rows of random configurations and damaged files.
    pub fn add_chance(&mut self, random: Option<&random::Outcome>, fuzz: Option<&fuzz::Outcome>) {
        let group = "chance";
        if let Some(outcome) = random {
            let row = "random scenes, cameras, sizes and settings";
            let reason = "none panics, hangs or writes a value that is not finite or light below zero";
            let check = Check::new(group, row, "all", &Settings::new());
            let faults = outcome.faults.join("; ");
            let detail = format!("{} configurations, {} with indirect light; {faults}", outcome.run, outcome.lit);
            self.checks.push(check.bounded("faults", outcome.faults.len() as f64, 0.0, reason).detail(detail));
        }
        if let Some(outcome) = fuzz {
            let row = "damaged models, materials, scenes, grids and presets";
            let reason = "each is read as a sound scene or refused by one sentence that names the file";
            let check = Check::new(group, row, "readers", &Settings::new());
            let faults: Vec<&str> = outcome.faults.iter().map(|(_, fault, _)| fault.as_str()).collect();
            let share = outcome.accepted as f64 / outcome.run.max(1) as f64;
            let detail = format!("{} files, {:.0} % of them taken; {}", outcome.run, 100.0 * share, faults.join("; "));
            self.checks.push(check.bounded("faults", faults.len() as f64, 0.0, reason).detail(detail));
        }
    }
}

impl Default for Options {
    fn default() -> Self {
        Self { techniques: Vec::new(), quick: true, rows: Vec::new() }
    }
}

/// What a run found.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// All checks, in the order of their rows.
    pub checks: Vec<Check>,
    /// Combinations of values that techniques refuse, one sentence each: they are part of the behaviour.
    pub refused: Vec<String>,
    /// Settings that every technique was run with in this table: technique, how many, of how many parameters.
    pub covered: Vec<(String, usize, usize)>,
}

impl Table {
    /// Checks that are red and not explained.
    pub fn unexplained(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|check| check.is_red() && check.explanation().is_none())
    }
}

/// One run of the suite.
pub struct Suite<'a> {
    native: &'a NativeGpu,
    options: Options,
    /// Settings of every technique that is asked for.
    switches: Vec<Switches>,
    table: Table,
    progress: Progress,
    /// Rows so far: quick runs turn to other settings with every row.
    turn: usize,
}

impl<'a> Suite<'a> {
    /// Runs every row.
    ///
    /// # Errors
    /// A technique that there is none of, or a device that was lost.
    pub fn run(native: &'a NativeGpu, options: &Options) -> Result<Table, Error> {
        let mut suite = Self::prepare(native, options)?;
        extremes::run(&mut suite);
        closed_forms::run(&mut suite);
        corner::run(&mut suite);
        invariances::run(&mut suite);
        precision::run(&mut suite);
        bad_input::run(&mut suite);
        suite.progress.finish(&format!("stability: {} checks", suite.table.checks.len()));
        Ok(suite.table)
    }

    fn prepare(native: &'a NativeGpu, options: &Options) -> Result<Self, Error> {
        for name in &options.techniques {
            halflight_techniques::technique(name).map_err(|e| Error::BadInput(e.to_string()))?;
        }
        // Everything that a setting may ask of a scene: gloss, solid and open meshes, motion.
        let facts = SceneFacts::of(&extremes::everything());
        let wanted = |technique: &&Technique| {
            options.techniques.is_empty() || options.techniques.iter().any(|name| name == technique.name)
        };
        let switches: Vec<Switches> =
            TECHNIQUES.iter().filter(wanted).map(|technique| Switches::of(technique, &facts)).collect();
        let covered = |s: &Switches| {
            let count = if options.quick { s.each.len() } else { s.pairs.len() };
            (s.technique.name.to_owned(), count, (s.technique.parameters)().len())
        };
        let table = Table {
            checks: Vec::new(),
            refused: switches.iter().flat_map(|s| s.refused.iter().cloned()).collect(),
            covered: switches.iter().map(covered).collect(),
        };
        let progress = Progress::new("stability", 100);
        Ok(Self { native, options: options.clone(), switches, table, progress, turn: 0 })
    }

    /// Whether a row is asked for.
    fn wants(&self, group: &str, row: &str) -> bool {
        let rows = &self.options.rows;
        rows.is_empty() || rows.iter().any(|text| group.contains(text.as_str()) || row.contains(text.as_str()))
    }

    /// Techniques with the settings that a row of extremes is run with: all pairs of values, or in a quick run the
    /// default and one or two of the settings that hold each value once, other ones with every row.
    fn pairs(&mut self) -> Vec<(&'static Technique, Vec<Settings>)> {
        self.turn += 1;
        let (quick, turn) = (self.options.quick, self.turn);
        // With many techniques one other setting a row is enough: rows are many.
        let others = if self.switches.len() > 3 { 1 } else { 2 };
        let of = |s: &Switches| match quick {
            false => [&s.single[..1], &s.pairs].concat(),
            true => {
                let mut all = vec![s.single[0].clone()];
                all.extend((0..others).filter_map(|i| s.each.get((others * turn + i) % s.each.len()).cloned()));
                all.dedup();
                all
            }
        };
        self.switches.iter().map(|s| (s.technique, of(s))).collect()
    }

    /// Techniques with the settings that an invariance is run with: one value at a time, or in a quick run the default
    /// and one other.
    fn singles(&mut self) -> Vec<(&'static Technique, Vec<Settings>)> {
        self.turn += 1;
        let (quick, turn) = (self.options.quick, self.turn);
        let of = |s: &Switches| match quick {
            false => s.single.clone(),
            true => {
                let mut all = vec![s.single[0].clone()];
                if s.single.len() > 1 {
                    all.push(s.single[1 + turn % (s.single.len() - 1)].clone());
                }
                all
            }
        };
        self.switches.iter().map(|s| (s.technique, of(s))).collect()
    }

    fn push(&mut self, check: Check) {
        self.progress.set(0, &format!("{} checks, {}: {}", self.table.checks.len(), check.group, check.row));
        self.table.checks.push(check);
    }

    /// Runs something whose panic is a red check and not the end of the run. `check` names the row.
    fn guarded(&mut self, check: Check, run: impl FnOnce(&Check) -> Result<Vec<Check>, Error>) {
        match catch_unwind(AssertUnwindSafe(|| run(&check))) {
            Ok(Ok(checks)) => checks.into_iter().for_each(|check| self.push(check)),
            Ok(Err(error)) => {
                self.push(check.bounded("errors", 1.0, 0.0, "accepted settings run").detail(error.to_string()));
            }
            Err(panic) => {
                self.push(check.bounded("panics", 1.0, 0.0, "nothing panics").detail(panic_words(&*panic)));
            }
        }
    }
}

/// What a panic said.
pub(crate) fn panic_words(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str).or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("a panic without words").replace('\n', " ")
}

/// Settings in words, without the technique's name.
pub(crate) fn words(settings: &Settings) -> String {
    let word = |(key, value): (&String, &Value)| format!("{}={value}", key.rsplit('.').next().unwrap_or(key));
    settings.iter().map(word).collect::<Vec<_>>().join(" ")
}

/// What the suite sets beside a technique's own settings: shadow maps small enough for 64 lights.
pub(crate) fn with_small_shadows(settings: &Settings) -> Settings {
    let mut settings = settings.clone();
    settings.insert("direct.shadow_map_size".into(), Value::Int(64));
    settings
}

/// A technique's parameter of this name.
pub(crate) fn parameter(technique: &Technique, name: &str) -> Option<Parameter> {
    (technique.parameters)().into_iter().find(|parameter| parameter.name == name)
}

/// How often light bounces with these settings.
pub(crate) fn bounces(technique: &Technique, settings: &Settings) -> u32 {
    let key = format!("{}.bounces", technique.name);
    match (settings.get(&key), parameter(technique, "bounces").map(|p| (p.kind, p.default))) {
        (Some(Value::Int(bounces)), Some((Kind::Int(..), _))) => u32::try_from(*bounces).unwrap_or(1),
        (None, Some((Kind::Int(..), Value::Int(bounces)))) => u32::try_from(bounces).unwrap_or(1),
        _ => 1,
    }
}
