//! Predicts time and error of candidates of one technique from measured ones.
//!
//! The time of a pass is an overhead that all passes have, and its number of invocations, which the plan knows, times a cost
//! for each invocation:
//!
//! ```text
//! ln((time - overhead) / invocations) = base + q log2(pixels / reduced pixels) + sum over axes (slope log2(value / default) + own)
//! ```
//!
//! `q` is 0 for a pass whose time is proportional to its invocations. `slope` is 0.69 (ln 2) where it is proportional to
//! a number such as samples, so one measured value of samples predicts the others. `own` is what a value does beyond its
//! slope, and all that a word such as `visibility=auto` does. All are found by least squares with small penalties on
//! effects, so that what was not measured has no effect. The error has the same form, without invocations.

use std::collections::BTreeMap;

use crate::{
    family::{Family, Planned, PlannedPass},
    least_squares::ridge,
};

/// A measured candidate.
#[derive(Clone, Debug)]
pub struct Observation {
    /// Index of the value on each axis.
    pub candidate: Vec<usize>,
    /// `log2(pixels / reduced pixels)`.
    pub scale: f64,
    /// Its passes with their invocations.
    pub planned: Vec<PlannedPass>,
    /// Median time of each pass by name, ms.
    pub passes: Vec<(String, f64)>,
    /// Error, lower is better.
    pub error: f64,
}

/// Penalties: of the base, of q, of a slope, of a value's own effect beyond a slope, and of a word's effect. A change of
/// 1 in the logarithm weighs as much as the same residual, so 0.01 shrinks a single measured effect by 1 %.
const PENALTIES: [f64; 5] = [1e-6, 0.05, 0.001, 0.05, 0.01];

/// The fitted model of one technique.
#[derive(Clone, Debug)]
pub struct Model {
    overhead: f64,
    passes: BTreeMap<String, Vec<f64>>,
    error: Vec<f64>,
}

/// A time that a clock cannot tell from none, ms.
const SHORTEST: f64 = 1e-5;
/// An error that is as good as none. It keeps logarithms finite.
const LOWEST: f64 = 1e-12;

impl Model {
    /// Fits the model of a family to what was measured of it. `overhead` is the time of a pass that does almost nothing, ms.
    pub fn fit(family: &Family, observed: &[Observation], overhead: f64) -> Self {
        let penalties = penalties(family);
        let mut rows: BTreeMap<&str, Vec<(Vec<f64>, f64)>> = BTreeMap::new();
        let mut errors = Vec::new();
        for observation in observed {
            let x = features(family, &observation.candidate, observation.scale);
            errors.push((x.clone(), observation.error.max(LOWEST).ln()));
            for (name, time) in &observation.passes {
                let Some(planned) = observation.planned.iter().find(|planned| planned.name == *name) else { continue };
                let cost = ((time - overhead).max(SHORTEST) / planned.invocations).ln();
                rows.entry(name).or_default().push((x.clone(), cost));
            }
        }
        let passes = rows.into_iter().map(|(name, rows)| (name.to_owned(), fit(&rows, &penalties))).collect();
        Self { overhead, passes, error: fit(&errors, &penalties) }
    }

    /// Predicted time of a candidate, ms.
    pub fn time(&self, family: &Family, candidate: &[usize], scale: f64, planned: &Planned) -> f64 {
        let x = features(family, candidate, scale);
        let time = |pass: &PlannedPass| {
            let cost = self.coefficients(&pass.name).map_or(SHORTEST.ln(), |b| dot(b, &x));
            self.overhead + pass.invocations * cost.exp()
        };
        planned.passes.iter().map(time).sum()
    }

    /// Predicted error of a candidate.
    pub fn error(&self, family: &Family, candidate: &[usize], scale: f64) -> f64 {
        dot(&self.error, &features(family, candidate, scale)).exp()
    }

    /// Of a pass that was never measured, the coefficients of the nearest one of its kind: `gather_4` is like `gather_3`.
    fn coefficients(&self, name: &str) -> Option<&Vec<f64>> {
        self.passes.get(name).or_else(|| {
            let kind = kind(name);
            // The last in order of their names has the highest number.
            let mut alike = self.passes.iter().filter(|(other, _)| self::kind(other) == kind);
            alike.next_back().map(|(_, b)| b)
        })
    }
}

/// A name without the number at its end.
fn kind(name: &str) -> &str {
    name.trim_end_matches(|end: char| end.is_ascii_digit() || end == '_')
}

/// Fits around the mean, so that no penalty pulls the base.
fn fit(rows: &[(Vec<f64>, f64)], penalties: &[f64]) -> Vec<f64> {
    let mean = rows.iter().map(|(_, y)| y).sum::<f64>() / rows.len().max(1) as f64;
    let centred: Vec<_> = rows.iter().map(|(x, y)| (x.clone(), y - mean)).collect();
    let mut coefficients = ridge(&centred, penalties);
    coefficients[0] += mean;
    coefficients
}

/// The x of a candidate: 1, the scale, and for each axis a slope (if its values are numbers) and one entry for each value
/// but the default.
fn features(family: &Family, candidate: &[usize], scale: f64) -> Vec<f64> {
    let mut x = vec![1.0, scale];
    for (axis, &chosen) in family.axes.iter().zip(candidate) {
        if let Some(default) = slope_from(axis) {
            x.push(axis.number(chosen).map_or(0.0, |number| (number / default).log2()));
        }
        x.extend((1..axis.values.len()).map(|index| f64::from(u8::from(index == chosen))));
    }
    x
}

fn penalties(family: &Family) -> Vec<f64> {
    let [base, q, slope, own, word] = PENALTIES;
    let mut penalties = vec![base, q];
    for axis in &family.axes {
        let numeric = slope_from(axis).is_some();
        penalties.extend(numeric.then_some(slope));
        penalties.extend((1..axis.values.len()).map(|_| if numeric { own } else { word }));
    }
    penalties
}

/// The default of an axis whose values are all positive numbers.
fn slope_from(axis: &crate::family::Axis) -> Option<f64> {
    (0..axis.values.len()).all(|index| axis.number(index).is_some()).then(|| axis.number(0))?
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
