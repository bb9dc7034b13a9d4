//! One check: a row, a technique with some settings, a metric, its worst value and its bound.

use halflight_renderer::parameters::Settings;
use serde::Serialize;

use crate::settings::words;

/// The result of one row for one technique with some settings.
#[derive(Clone, Debug, Serialize)]
pub struct Check {
    /// Group of rows: geometry, image, invariances...
    pub group: &'static str,
    /// The row.
    pub row: String,
    /// Technique, or what else was tested.
    pub technique: String,
    /// Settings that differ from the defaults.
    pub settings: String,
    /// What `worst` is. The key in files is `measure`, as in older tables.
    #[serde(rename = "measure")]
    pub metric: &'static str,
    /// The worst value.
    pub worst: f64,
    /// Largest value that passes; `None` where the value is reported, not bounded.
    pub bound: Option<f64>,
    /// Why the bound is what it is.
    pub reason: String,
    /// Where the worst value was found.
    pub detail: String,
    /// Number of values clamped to the largest number that their format may hold.
    pub clamped: u64,
    /// Largest value of all light, radiance.
    pub largest: f64,
    /// 99.9th percentile of indirect light over pixels and channels, radiance.
    pub percentile: f64,
}

/// The 99.9th percentile of the finite channels of all pixels; 0 for an empty image.
pub(crate) fn percentile_999(pixels: &[[f32; 3]]) -> f64 {
    let mut values: Vec<f32> = pixels.iter().flatten().copied().filter(|v| v.is_finite()).collect();
    values.sort_by(f32::total_cmp);
    let index = (0.999 * values.len() as f64).ceil() as usize;
    values.get(index.saturating_sub(1)).map_or(0.0, |&v| v.into())
}

impl Check {
    /// A check of this row; [`Check::bounded`] or [`Check::reported`] adds its value.
    pub(crate) fn new(group: &'static str, row: impl Into<String>, technique: &str, settings: &Settings) -> Self {
        Self {
            group,
            row: row.into(),
            technique: technique.into(),
            settings: words(settings),
            metric: "",
            worst: 0.0,
            bound: None,
            reason: String::new(),
            detail: String::new(),
            clamped: 0,
            largest: 0.0,
            percentile: 0.0,
        }
    }

    /// With a value that may be at most `bound`.
    pub(crate) fn bounded(self, metric: &'static str, worst: f64, bound: f64, reason: &str) -> Self {
        Self { metric, worst, bound: Some(bound), reason: reason.into(), ..self }
    }

    /// With a value that has no bound.
    pub(crate) fn reported(self, metric: &'static str, worst: f64, reason: &str) -> Self {
        Self { metric, worst, bound: None, reason: reason.into(), ..self }
    }

    pub(crate) fn detail(self, detail: impl Into<String>) -> Self {
        Self { detail: detail.into(), ..self }
    }

    /// Whether the worst value exceeds its bound. NaN always does.
    pub fn is_red(&self) -> bool {
        self.bound.is_some_and(|bound| self.worst.is_nan() || self.worst > bound)
    }

    /// Cause of a red check, where it is known.
    pub fn explanation(&self) -> Option<&'static str> {
        let known = |e: &&Explained| {
            self.row.contains(e.row)
                && self.technique == e.technique
                && self.metric == e.metric
                && e.settings.iter().all(|wanted| self.settings.split(' ').any(|set| set.starts_with(wanted)))
        };
        EXPLAINED.iter().find(known).map(|e| e.cause)
    }
}

/// A check that is known to be red. Any other red check fails the run.
struct Explained {
    /// Part of the row's name.
    row: &'static str,
    technique: &'static str,
    metric: &'static str,
    /// Settings that the check must have, each by its beginning.
    settings: &'static [&'static str],
    /// Cause and fix.
    cause: &'static str,
}

const EXPLAINED: &[Explained] = &[
    Explained {
        row: "a plane does not light itself",
        technique: "bitmask",
        metric: "indirect light over the plane's radiance",
        settings: &["steps=1"],
        cause: "with one step per side, the sample's plane is extended to the receiver's own pixel and to the edge of the \
                screen; the farther it is extended, the more an 11-bit normal tilts it: 0.002. With two steps the row holds",
    },
    Explained {
        row: "64 lights",
        technique: "hybrid",
        metric: "errors",
        settings: &["light_view_size=512"],
        cause: "104 reflective shadow maps of 512x512 texels do not fit a buffer that every device can bind; the message \
                names the size that fits",
    },
    Explained {
        row: "64 lights",
        technique: "hierarchical",
        metric: "errors",
        settings: &["light_view_size=512"],
        cause: "104 reflective shadow maps of 512x512 texels and their pyramid do not fit a buffer that every device can \
                bind; the message names the size that fits",
    },
    Explained {
        row: "",
        technique: "hybrid",
        metric: "mean of indirect light over the most that sources can send",
        settings: &["weighting=published"],
        cause: "Equation 3 as printed has the unit 1/area: its mean may be any multiple of what sources send, and the user \
                sets the intensity",
    },
    Explained {
        row: "what was hidden in the frame before",
        technique: "bitmask",
        metric: "uncovered pixels with light of the frame before",
        settings: &["feedback="],
        cause: "the previous-frame bounce reflects the light of the frame before: this is how it adds bounces",
    },
];
