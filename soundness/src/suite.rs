//! The rows, run one after another.

use halflight_evaluator::{Error, progress::Progress};
use halflight_frame_graph::FramePlan;
use halflight_native::NativeGpu;
use halflight_renderer::{gi::Technique, parameters::Settings, scene::SceneFacts};
use halflight_techniques::{TECHNIQUES, technique};

use crate::{check::Check, panics::caught, scenes::everything, switches::Switches, table::Table};

mod bad_input;
mod closed_forms;
pub mod corner;
mod extremes;
mod invariances;
mod precision;

/// Number of float16 textures that the light shown by a plan passes through at most: each may truncate it once.
fn float16_textures(plan: &FramePlan) -> usize {
    let shown = ["indirect", "final"].iter().find_map(|name| plan.outputs.get(name));
    let halves = plan.resources.iter().enumerate().filter(|(index, resource)| {
        let is_half = resource.format() == Some(wgpu::TextureFormat::Rgba16Float);
        is_half && resource.name != "normal" && (resource.name != "final" || shown.is_some_and(|id| id.0 == *index))
    });
    halves.count()
}

/// Number of textures in which a plan packs light into surfels after it was gathered: mantissas of 12 bits.
fn packed_textures(plan: &FramePlan) -> usize {
    let is_light = |name: &str| name == "gathered" || name.starts_with("denoised");
    let packed = |format| format == Some(wgpu::TextureFormat::Rgba32Uint);
    plan.resources.iter().filter(|resource| is_light(&resource.name) && packed(resource.format())).count()
}

/// What to run.
#[derive(Clone, Debug)]
pub struct Options {
    /// Techniques, by name; all of them where empty.
    pub techniques: Vec<String>,
    /// The default and a few settings per row instead of all pairs of values.
    pub quick: bool,
    /// Only rows whose group or name contains one of these texts; all rows where empty.
    pub rows: Vec<String>,
}

impl Default for Options {
    fn default() -> Self {
        Self { techniques: Vec::new(), quick: true, rows: Vec::new() }
    }
}

/// One run of the suite.
pub struct Suite<'a> {
    native: &'a NativeGpu,
    options: Options,
    /// Settings of every technique that runs.
    switches: Vec<Switches>,
    table: Table,
    progress: Progress,
    /// Number of rows so far: each row of a quick run takes other settings.
    rows_done: usize,
}

impl<'a> Suite<'a> {
    /// Runs every row.
    ///
    /// # Errors
    /// Where a technique is unknown, or the device is lost.
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
            technique(name).map_err(|e| Error::BadInput(e.to_string()))?;
        }
        let facts = SceneFacts::of(&everything());
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
        Ok(Self { native, options: options.clone(), switches, table, progress, rows_done: 0 })
    }

    /// Whether a row is to run.
    fn wants(&self, group: &str, row: &str) -> bool {
        let rows = &self.options.rows;
        rows.is_empty() || rows.iter().any(|text| group.contains(text.as_str()) || row.contains(text.as_str()))
    }

    /// Techniques with the settings for a row of extremes: all pairs of values, or in a quick run the default and one or
    /// two of the settings that cover each value once, different ones for each row.
    fn pairs(&mut self) -> Vec<(&'static Technique, Vec<Settings>)> {
        self.rows_done += 1;
        let (quick, row) = (self.options.quick, self.rows_done);
        // With many techniques one other setting per row is enough, because there are many rows.
        let others = if self.switches.len() > 3 { 1 } else { 2 };
        let of = |s: &Switches| match quick {
            false => [&s.single[..1], &s.pairs].concat(),
            true => {
                let mut all = vec![s.single[0].clone()];
                all.extend((0..others).filter_map(|i| s.each.get((others * row + i) % s.each.len()).cloned()));
                all.dedup();
                all
            }
        };
        self.switches.iter().map(|s| (s.technique, of(s))).collect()
    }

    /// Techniques with the settings for an invariance: one value at a time, or in a quick run the default and one other.
    fn singles(&mut self) -> Vec<(&'static Technique, Vec<Settings>)> {
        self.rows_done += 1;
        let (quick, row) = (self.options.quick, self.rows_done);
        let of = |s: &Switches| match quick {
            false => s.single.clone(),
            true => {
                let mut all = vec![s.single[0].clone()];
                if s.single.len() > 1 {
                    all.push(s.single[1 + row % (s.single.len() - 1)].clone());
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

    /// Runs the row that `check` names. An error or a panic is a red check and does not end the run.
    fn guarded(&mut self, check: Check, run: impl FnOnce(&Check) -> Result<Vec<Check>, Error>) {
        match caught(|| run(&check)) {
            Ok(Ok(checks)) => checks.into_iter().for_each(|check| self.push(check)),
            Ok(Err(error)) => {
                self.push(check.bounded("errors", 1.0, 0.0, "accepted settings run").detail(error.to_string()));
            }
            Err(message) => self.push(check.bounded("panics", 1.0, 0.0, "nothing panics").detail(message)),
        }
    }
}
