//! The search: which cell to measure next.

use std::{collections::HashMap, rc::Rc};

use halflight_metrics::{Function, METRICS, Metric};
use halflight_renderer::{gi::Technique, parameters::Settings, scene::SceneFacts};
use halflight_scenes::nearest_name;
use serde::{Deserialize, Serialize};

use crate::{
    family::{Family, Planned},
    model::{Model, Observation},
};

mod answer;
mod stages;

pub use answer::{Answer, Interval, NoAnswer, Point, Step};

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Goal {
    /// The lowest error within this time of the technique's passes, ms.
    Budget(f64),
    /// The shortest time with at most this error.
    ErrorBound(f64),
}

/// A question.
#[derive(Clone, Debug)]
pub struct Request {
    /// What is asked for.
    pub goal: Goal,
    /// The metric that decides; it has a plotted value, of which lower is better.
    pub metric: &'static Metric,
    /// Width and height of the frame, pixels.
    pub size: [u32; 2],
    /// Width and height of the cells that are measured first, pixels. Equal to `size` to measure all at full size.
    pub reduced: [u32; 2],
    /// Most cells to measure; `None` for a fifth of the candidates, at least 24.
    pub most_cells: Option<usize>,
    /// How the caller names what would help, in the sentences of [`NoAnswer`].
    pub advice: &'static Advice,
}

/// What would help where there is no answer, as the end of a sentence: by options of a command, or in the words of an
/// interface.
#[derive(Clone, Copy, Debug)]
pub struct Advice {
    /// Search other techniques.
    pub other_techniques: &'static str,
    /// Allow more time, or choose a smaller image.
    pub more_time: &'static str,
    /// Allow a larger error.
    pub larger_error: &'static str,
    /// Another metric, after "by".
    pub other_metric: &'static str,
}

/// Cells that every search may measure.
pub const FEWEST_CELLS: usize = 24;
/// The share of candidates that a search may measure, if nothing else is asked.
const SHARE_OF_CANDIDATES: f64 = 0.2;

/// Part of the search that a cell belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Each technique once.
    Defaults,
    /// Single changed settings.
    Effects,
    /// What the models predict to be the best, at reduced size.
    Combinations,
    /// The same at full size.
    Verification,
    /// Nothing is left to measure.
    Done,
}

/// A configuration to measure.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The technique.
    pub technique: &'static Technique,
    /// Its settings that differ from the defaults.
    pub settings: Settings,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Why it is measured.
    pub stage: Stage,
    /// A technique whose first frame takes longer cannot be the answer: [`Outcome::TooSlow`] saves the others. ms.
    pub slowest_ms: f64,
    id: Id,
}

impl Cell {
    /// A configuration at full size that no search has asked for, for sweeps.
    pub fn full_size(technique: &'static Technique, settings: Settings, size: [u32; 2]) -> Self {
        let id = Id { candidate: None, full: true };
        Self { technique, settings, size, stage: Stage::Verification, slowest_ms: f64::INFINITY, id }
    }
}

/// A frame this many times the budget is too slow to go on with.
const TOO_SLOW: f64 = 30.0;

/// A cell in the search's own terms; `None` is the baseline without indirect light.
#[derive(Clone, Debug, PartialEq)]
struct Id {
    candidate: Option<(usize, Vec<usize>)>,
    full: bool,
}

/// What a cell gave.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// Time of the technique in each timed frame, ms; empty for the baseline.
    pub times: Vec<f64>,
    /// Median time of each of its passes by name, ms.
    pub passes: Vec<(String, f64)>,
    /// The plotted value of the metric in one or more frames: lower is better.
    pub errors: Vec<f64>,
    /// Largest change of the error that the noise of the reference may cause.
    pub reference_noise: f64,
}

/// The result of a cell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Outcome {
    /// It was measured.
    Measured(Measured),
    /// Its first frame took this long, ms: longer than [`Cell::slowest_ms`].
    TooSlow(f64),
    /// The device refused it, for this reason.
    Refused(String),
}

/// The metric of this name: a column of results.csv, or its part after the first `_`.
///
/// # Errors
/// One sentence with the nearest name, or what is wrong with the metric.
pub fn metric(name: &str) -> Result<&'static Metric, String> {
    let short = |metric: &Metric| metric.key.split_once('_').map_or(metric.key, |(_, short)| short);
    METRICS
        .iter()
        .filter(|metric| decides(metric))
        .find(|metric| metric.key == name || short(metric) == name)
        .ok_or_else(|| {
            let names = metric_names();
            let near = nearest_name(name, names.iter().copied());
            let hint = near.map_or(String::new(), |near| format!("did you mean {near}? "));
            format!("no metric that can decide is called {name}: {hint}choose one of {}", names.join(", "))
        })
}

/// Names of the metrics that can decide, in reading order.
pub fn metric_names() -> Vec<&'static str> {
    let deciding = Metric::ranked().into_iter().filter(|metric| decides(metric));
    deciding.map(|metric| metric.key.split_once('_').map_or(metric.key, |(_, short)| short)).collect()
}

fn decides(metric: &Metric) -> bool {
    let of_light = matches!(metric.function, Function::Indirect(_) | Function::IndirectBlocks(_) | Function::Final(_));
    of_light && metric.plot.is_some()
}

/// A measured candidate.
#[derive(Clone, Debug)]
pub(crate) struct Record {
    pub(crate) family: usize,
    pub(crate) candidate: Vec<usize>,
    pub(crate) fingerprint: u64,
    pub(crate) full: bool,
    pub(crate) measured: Option<Measured>,
    /// Time and error that the models predicted before it was measured at full size.
    pub(crate) predicted: Option<[f64; 2]>,
}

/// What is known of a candidate at full size.
#[derive(Clone, Debug)]
pub(crate) struct Estimate {
    pub(crate) family: usize,
    pub(crate) candidate: Vec<usize>,
    pub(crate) fingerprint: u64,
    pub(crate) time: f64,
    /// Upper end of the interval of a measured time; a predicted one as it is.
    pub(crate) time_high: f64,
    pub(crate) error: f64,
    /// Whether it was measured at full size.
    pub(crate) verified: bool,
    /// Whether it was measured at reduced size.
    pub(crate) reduced: bool,
}

/// The search of one question on one scene.
pub struct Search {
    pub(crate) request: Request,
    pub(crate) facts: SceneFacts,
    pub(crate) families: Vec<Family>,
    /// Families that are still searched.
    alive: Vec<usize>,
    stage: Stage,
    /// Rounds of effects that are complete.
    round: usize,
    /// Values that were tried, by family: axis and index.
    tried: Vec<Vec<(usize, usize)>>,
    /// Cells left of this round, by family.
    quota: Vec<usize>,
    /// Cells of the last two stages so far.
    combinations: usize,
    verifications: usize,
    steps: usize,
    pub(crate) records: Vec<Record>,
    /// Error of the image without indirect light, at reduced and at full size.
    pub(crate) baseline: [Option<Measured>; 2],
    models: Vec<Option<Rc<Model>>>,
    plans: HashMap<(usize, bool, Vec<usize>), Option<Rc<Planned>>>,
    pending: Option<(Cell, Option<[f64; 2]>)>,
    cells: usize,
    refused: Vec<String>,
    /// The fastest of the cells that were too slow: time of its first frame in ms, and technique.
    pub(crate) too_slow: Option<(f64, &'static str)>,
}

impl Search {
    /// A search over all candidates of these families.
    ///
    /// # Errors
    /// One sentence where there is nothing to choose from.
    pub fn new(request: Request, facts: SceneFacts, families: Vec<Family>) -> Result<Self, NoAnswer> {
        let names = families.iter().map(|family| family.technique.name).collect::<Vec<_>>().join(", ");
        let mut plans = HashMap::new();
        let mut lit = Vec::new();
        let mut refused = Vec::new();
        for family in families {
            let defaults = vec![0; family.axes.len()];
            match family.plan(&facts, &defaults, request.size) {
                Some(planned) if planned.has_light => {
                    plans.insert((lit.len(), true, defaults), Some(Rc::new(planned)));
                    lit.push(family);
                }
                Some(_) => {}
                None => refused.push(family.technique.name.to_owned()),
            }
        }
        if lit.is_empty() {
            return Err(NoAnswer(format!(
                "there is nothing to choose: {} no indirect light in this scene; {}",
                if names.contains(", ") { format!("none of {names} finds") } else { format!("{names} finds") },
                request.advice.other_techniques
            )));
        }
        let count = lit.len();
        Ok(Self {
            request,
            facts,
            alive: (0..count).collect(),
            stage: Stage::Defaults,
            round: 0,
            tried: vec![Vec::new(); count],
            quota: vec![0; count],
            combinations: 0,
            verifications: 0,
            steps: 0,
            records: Vec::new(),
            baseline: [None, None],
            models: vec![None; count],
            plans,
            pending: None,
            cells: 0,
            refused,
            too_slow: None,
            families: lit,
        })
    }

    /// The question.
    pub fn request(&self) -> &Request {
        &self.request
    }

    /// Where the search stands.
    pub fn stage(&self) -> Stage {
        self.stage
    }

    /// Cells that were measured, without those of the baseline.
    pub fn cells(&self) -> usize {
        self.cells
    }

    /// Number of candidates. Some may do the same, because a setting has no effect.
    pub fn candidates(&self) -> f64 {
        self.families.iter().map(Family::size).sum()
    }

    /// What devices refused, one sentence each.
    pub fn refused(&self) -> &[String] {
        &self.refused
    }

    fn most_cells(&self) -> usize {
        let share = (self.candidates() * SHARE_OF_CANDIDATES).min(1e6) as usize;
        self.request.most_cells.unwrap_or_else(|| share.max(FEWEST_CELLS))
    }

    /// Whether reduced and full size are one.
    fn one_size(&self) -> bool {
        self.request.size == self.request.reduced
    }

    /// Hands back the result of the last cell.
    pub fn report(&mut self, outcome: Outcome) {
        let Some((cell, predicted)) = self.pending.take() else { return };
        let measured = match outcome {
            Outcome::Measured(measured) => Some(measured),
            Outcome::TooSlow(ms) => {
                let faster = self.too_slow.as_ref().is_none_or(|(known, _)| ms < *known);
                if faster {
                    self.too_slow = Some((ms, cell.technique.name));
                }
                None
            }
            Outcome::Refused(reason) => {
                if !self.refused.contains(&reason) {
                    self.refused.push(reason);
                }
                None
            }
        };
        let full = cell.id.full || self.one_size();
        let Some((family, candidate)) = cell.id.candidate else {
            // A baseline that cannot be measured counts as an error that nothing can compare with.
            let measured = measured.unwrap_or(Measured {
                times: Vec::new(),
                passes: Vec::new(),
                errors: vec![f64::NAN],
                reference_noise: 0.0,
            });
            self.baseline[0].get_or_insert_with(|| measured.clone());
            if full {
                self.baseline[1] = Some(measured);
            }
            return;
        };
        self.cells += 1;
        let fingerprint = self.planned(family, &candidate, true).map_or(0, |planned| planned.fingerprint);
        self.records.push(Record { family, candidate, fingerprint, full, measured, predicted });
        self.models[family] = None;
    }

    /// The plan of a candidate.
    fn planned(&mut self, family: usize, candidate: &[usize], full: bool) -> Option<Rc<Planned>> {
        let size = if full { self.request.size } else { self.request.reduced };
        let (families, facts) = (&self.families, &self.facts);
        let planned = || families[family].plan(facts, candidate, size).filter(|planned| planned.has_light).map(Rc::new);
        self.plans.entry((family, full, candidate.to_vec())).or_insert_with(planned).clone()
    }

    /// The record of what a candidate does, at a size.
    pub(crate) fn record(&self, family: usize, fingerprint: u64, full: bool) -> Option<&Record> {
        self.records
            .iter()
            .rfind(|record| record.family == family && record.fingerprint == fingerprint && record.full == full)
    }

    /// `log2(pixels / reduced pixels)` of a size.
    fn scale(&self, full: bool) -> f64 {
        let pixels = |[w, h]: [u32; 2]| f64::from(w) * f64::from(h);
        if full { (pixels(self.request.size) / pixels(self.request.reduced)).log2() } else { 0.0 }
    }

    /// Most time of a pass that does almost nothing: a share of the shortest that was measured, ms.
    fn overhead(&self) -> f64 {
        let measured = self.records.iter().filter_map(|record| record.measured.as_ref());
        let shortest =
            measured.flat_map(|measured| &measured.passes).map(|(_, time)| *time).fold(f64::INFINITY, f64::min);
        // Not all of it, so that the shortest pass keeps a cost of its own.
        if shortest.is_finite() { 0.9 * shortest.max(0.0) } else { 0.0 }
    }

    /// The fitted model of a family.
    fn model(&mut self, family: usize) -> Rc<Model> {
        if let Some(model) = &self.models[family] {
            return Rc::clone(model);
        }
        let records: Vec<Record> = self.records.iter().filter(|record| record.family == family).cloned().collect();
        let mut observed = Vec::new();
        for record in records {
            let Some(measured) = record.measured else { continue };
            let Some(planned) = self.planned(family, &record.candidate, record.full) else { continue };
            observed.push(Observation {
                scale: self.scale(record.full),
                candidate: record.candidate,
                planned: planned.passes.clone(),
                passes: measured.passes,
                error: mean(&measured.errors),
            });
        }
        let model = Rc::new(Model::fit(&self.families[family], &observed, self.overhead()));
        self.models[family] = Some(Rc::clone(&model));
        model
    }

    /// Time and error of a candidate at full size: measured there, or predicted, or predicted and corrected by what was
    /// measured at reduced size. `None` where it cannot run.
    pub(crate) fn estimate(&mut self, family: usize, candidate: &[usize]) -> Option<Estimate> {
        let planned = self.planned(family, candidate, true)?;
        let fingerprint = planned.fingerprint;
        let full = self.record(family, fingerprint, true).cloned();
        let reduced = self.record(family, fingerprint, false).cloned();
        let known = Estimate {
            family,
            candidate: candidate.to_vec(),
            fingerprint,
            time: f64::NAN,
            time_high: f64::NAN,
            error: f64::NAN,
            verified: full.is_some(),
            reduced: reduced.is_some() || full.is_some(),
        };
        if let Some(record) = full {
            let measured = record.measured?;
            let time = Interval::of_median(&measured.times);
            return Some(Estimate { time: time.value, time_high: time.high, error: mean(&measured.errors), ..known });
        }
        let model = self.model(family);
        let scale = self.scale(true);
        let mut time = model.time(&self.families[family], candidate, scale, &planned);
        let mut error = model.error(&self.families[family], candidate, scale);
        if let Some(record) = reduced {
            let measured = record.measured?;
            let small = self.planned(family, candidate, false)?;
            time *= median(&measured.times) / model.time(&self.families[family], candidate, 0.0, &small);
            error *= mean(&measured.errors) / model.error(&self.families[family], candidate, 0.0);
        }
        Some(Estimate { time, time_high: time, error, ..known })
    }
}

/// The middle value; 0 without values.
pub(crate) fn median(values: &[f64]) -> f64 {
    if values.is_empty() { 0.0 } else { halflight_metrics::percentile(&mut values.to_vec(), 0.5) }
}

/// The mean; NaN without values.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
