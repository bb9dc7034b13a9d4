//! What a search found.

use halflight_metrics::Metric;
use halflight_renderer::{gi::Technique, parameters::Settings};
use serde::Serialize;

use super::{Estimate, Goal, Measured, Search, mean, median};

/// Why there is no answer: one sentence that says what would help.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct NoAnswer(pub String);

/// A number and where it lies, with a confidence of about 95 %.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Interval {
    /// The number.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Half the width of an interval of a prediction, relative to it: what the models were off by in docs/recommend.md.
const PREDICTED: f64 = 0.25;

impl Interval {
    /// The median of samples with its notch, 1.57 interquartile ranges over the root of their number (McGill et al. 1978).
    pub fn of_median(samples: &[f64]) -> Self {
        let value = median(samples);
        let quartile = |share| halflight_metrics::percentile(&mut samples.to_vec(), share);
        let notch = match samples.len() {
            0 | 1 => 0.0,
            count => 1.57 * (quartile(0.75) - quartile(0.25)) / (count as f64).sqrt(),
        };
        Self { value, low: value - notch, high: value + notch }
    }

    /// The mean of samples with two standard errors, plus what else it may be off by.
    pub fn of_mean(samples: &[f64], other: f64) -> Self {
        let value = mean(samples);
        let count = samples.len() as f64;
        let square: f64 = samples.iter().map(|sample| (sample - value).powi(2)).sum();
        let own = if count > 1.0 { 2.0 * (square / (count - 1.0) / count).sqrt() } else { 0.0 };
        Self { value, low: (value - own - other).max(0.0), high: value + own + other }
    }

    fn predicted(value: f64) -> Self {
        Self { value, low: value * (1.0 - PREDICTED), high: value * (1.0 + PREDICTED) }
    }
}

/// A configuration with its time and error at full size.
#[derive(Clone, Debug, Serialize)]
pub struct Point {
    /// Name of the technique.
    #[serde(serialize_with = "name_of")]
    pub technique: &'static Technique,
    /// Settings that differ from the defaults.
    pub settings: Settings,
    /// Time of the technique's passes, ms.
    pub time_ms: Interval,
    /// Error by the deciding metric; lower is better.
    pub error: Interval,
    /// Whether both were measured at full size, not predicted.
    pub verified: bool,
}

fn name_of<S: serde::Serializer>(technique: &&'static Technique, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(technique.name)
}

impl Point {
    /// The technique with the settings that differ from its defaults, in one line.
    pub fn label(&self) -> String {
        let own = format!("{}.", self.technique.name);
        let settings =
            self.settings.iter().map(|(key, value)| format!(" {}={value}", key.strip_prefix(&own).unwrap_or(key)));
        std::iter::once(self.technique.name.to_owned()).chain(settings).collect()
    }
}

/// What another time would give.
#[derive(Clone, Debug, Serialize)]
pub struct Step {
    /// The configuration.
    pub point: Point,
    /// Its time less that of the answer, ms.
    pub more_ms: f64,
    /// Its error over that of the answer, less 1.
    pub error_change: f64,
}

/// The recommended configuration.
#[derive(Clone, Debug, Serialize)]
pub struct Answer {
    /// The configuration.
    #[serde(flatten)]
    pub point: Point,
    /// Key of the metric that decided.
    #[serde(serialize_with = "key_of")]
    pub metric: &'static Metric,
    /// Error of the image without indirect light.
    pub baseline_error: f64,
    /// Time and error that the models predicted before it was measured at full size.
    pub predicted: Option<[f64; 2]>,
    /// The nearest faster configuration that no other beats.
    pub faster: Option<Step>,
    /// The nearest one of lower error that no other beats.
    pub better: Option<Step>,
    /// All configurations that no other beats, fastest first.
    pub frontier: Vec<Point>,
    /// Everything that was measured.
    pub measured: Vec<Point>,
    /// Number of cells that were measured.
    pub cells: usize,
    /// Number of candidates.
    pub candidates: f64,
    /// The largest part of the error that remains, and what would help; from the caller.
    pub remains: Option<String>,
}

fn key_of<S: serde::Serializer>(metric: &&'static Metric, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(metric.key)
}

/// Steps smaller than this are noise, relative to the answer.
const SMALLEST_STEP: f64 = 0.03;

impl Search {
    /// The best configuration so far.
    ///
    /// # Errors
    /// One sentence where there is none: the view is unlit, the limit cannot be kept, or no indirect light is better.
    pub fn answer(&mut self) -> Result<Answer, NoAnswer> {
        let metric = self.request.metric;
        let name = metric.title;
        let baseline = self.baseline.iter().rev().flatten().next().map(|measured| mean(&measured.errors));
        let Some(baseline) = baseline else {
            return Err(NoAnswer("nothing was measured yet: give the search more time".into()));
        };
        if baseline.is_nan() {
            return Err(NoAnswer(format!(
                "{name} is not defined for this view: point the camera at a surface of the scene"
            )));
        }
        if baseline <= 0.0 {
            return Err(NoAnswer(
                "no indirect light reaches what the camera sees, so `none` is exact and costs nothing: check the lights of \
                 the scene, or point the camera at lit surfaces"
                    .into(),
            ));
        }
        let mut known = self.measured();
        known.sort_by(|a, b| a.time.total_cmp(&b.time));
        let Some(fastest) = known.first().cloned() else {
            let [w, h] = self.request.reduced;
            return Err(NoAnswer(match (&self.too_slow, self.refused().first()) {
                (Some((ms, technique)), _) => format!(
                    "nothing comes near the budget: even at {w}x{h}, a first frame of the fastest technique, {technique}, takes \
                     {} ms; {}",
                    short(*ms),
                    self.request.advice.more_time
                ),
                (None, Some(reason)) => format!("no configuration could be measured: {reason}"),
                (None, None) => "nothing was measured yet: give the search more time".to_owned(),
            }));
        };
        let keeps = |estimate: &&Estimate| match self.request.goal {
            Goal::Budget(budget) => estimate.time_high <= budget,
            Goal::ErrorBound(bound) => estimate.error <= bound,
        };
        let best = |estimates: &mut dyn Iterator<Item = &Estimate>| {
            let wanted = |estimate: &Estimate| match self.request.goal {
                Goal::Budget(_) => estimate.error,
                Goal::ErrorBound(_) => estimate.time,
            };
            estimates.min_by(|a, b| wanted(a).total_cmp(&wanted(b))).cloned()
        };
        let feasible = best(&mut known.iter().filter(|estimate| estimate.verified).filter(keeps))
            .or_else(|| best(&mut known.iter().filter(keeps)));
        let Some(answer) = feasible else {
            let [w, h] = self.request.size;
            let lowest = known.iter().min_by(|a, b| a.error.total_cmp(&b.error)).unwrap_or(&fastest);
            return Err(NoAnswer(match self.request.goal {
                Goal::Budget(budget) => format!(
                    "nothing runs in {} ms at {w}x{h}: the fastest found, {}, takes up to {} ms; {}",
                    short(budget),
                    self.point(&fastest).label(),
                    short(fastest.time_high),
                    self.request.advice.more_time
                ),
                Goal::ErrorBound(bound) => format!(
                    "no configuration reaches a {name} of {}: the best found, {}, has {} in {} ms; {}",
                    short(bound),
                    self.point(lowest).label(),
                    short(lowest.error),
                    short(lowest.time),
                    self.request.advice.larger_error
                ),
            }));
        };
        let frontier = frontier(&known);
        if answer.error >= baseline {
            let better = frontier.iter().find(|estimate| estimate.error < baseline);
            let help = match better {
                Some(better) => format!(
                    "{} ms would help: {} has {}",
                    short(better.time),
                    self.point(better).label(),
                    short(better.error)
                ),
                None => format!(
                    "no measured configuration is better at any time; by {} some may be",
                    self.request.advice.other_metric
                ),
            };
            return Err(NoAnswer(format!(
                "by {name}, showing no indirect light ({}) beats everything within the limit: the best, {}, has {}; {help}",
                short(baseline),
                self.point(&answer).label(),
                short(answer.error)
            )));
        }
        let step = |other: &Estimate| Step {
            point: self.point(other),
            more_ms: other.time - answer.time,
            error_change: other.error / answer.error - 1.0,
        };
        let faster =
            frontier.iter().rfind(|other| other.time < answer.time * (1.0 - SMALLEST_STEP) && other.error < baseline);
        let better = frontier
            .iter()
            .find(|other| other.error < answer.error * (1.0 - SMALLEST_STEP) && other.time > answer.time);
        let record = self.record(answer.family, answer.fingerprint, true);
        Ok(Answer {
            metric,
            baseline_error: baseline,
            predicted: record.and_then(|record| record.predicted),
            faster: faster.map(&step),
            better: better.map(&step),
            frontier: frontier.iter().map(|estimate| self.point(estimate)).collect(),
            measured: known.iter().map(|estimate| self.point(estimate)).collect(),
            cells: self.cells(),
            candidates: self.candidates(),
            remains: None,
            point: self.point(&answer),
        })
    }

    fn point(&self, estimate: &Estimate) -> Point {
        let family = &self.families[estimate.family];
        let record = self.record(estimate.family, estimate.fingerprint, true);
        let measured = record.and_then(|record| record.measured.as_ref());
        let [time_ms, error] = match measured {
            Some(Measured { times, errors, reference_noise, .. }) => {
                [Interval::of_median(times), Interval::of_mean(errors, *reference_noise)]
            }
            None => [estimate.time, estimate.error].map(Interval::predicted),
        };
        Point {
            technique: family.technique,
            settings: family.settings(&estimate.candidate),
            time_ms,
            error,
            verified: measured.is_some(),
        }
    }
}

/// Estimates that no other beats, fastest first; `known` is sorted by time.
fn frontier(known: &[Estimate]) -> Vec<Estimate> {
    let mut lowest = f64::INFINITY;
    let beats = |estimate: &&Estimate| {
        let better = estimate.error < lowest;
        lowest = lowest.min(estimate.error);
        better
    };
    known.iter().filter(beats).cloned().collect()
}

/// Three significant digits.
fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let decimals = (2 - value.abs().log10().floor() as i32).clamp(0, 12) as usize;
    format!("{value:.decimals$}")
}
