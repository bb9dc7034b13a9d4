//! Errors of linear radiance.

use serde::{Deserialize, Serialize};

use halflight_renderer::error::{relative_floor, relative_square};

use super::{Rgb, counted, counted_pairs};
use crate::serial;
use crate::statistics::percentile;

/// Error of linear radiance against the truth, over pixels and channels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinearErrors {
    /// Mean of `(x - t)^2 / (t^2 + 0.01 m^2)`, m the mean of the truth; no unit. The second term keeps black truth from
    /// dividing by zero: below a tenth of the mean an error counts against that tenth.
    #[serde(with = "serial::float")]
    pub rel_mse: f64,
    /// Root mean square of `x - t`, radiance.
    #[serde(with = "serial::float")]
    pub rmse: f64,
    /// Mean of `x - t`, radiance: positive = too bright.
    #[serde(with = "serial::float")]
    pub bias: f64,
    /// 95th percentile of `|x - t|`, radiance.
    #[serde(with = "serial::float")]
    pub p95_abs: f64,
    /// 99.9th percentile of `|x - t|`, radiance: fireflies and leaks live here.
    #[serde(with = "serial::float")]
    pub p999_abs: f64,
    /// The one factor on `x` that makes `rel_mse` smallest: what an artist would set the exposure of a method without
    /// units to. 1 for black.
    #[serde(with = "serial::float")]
    pub best_factor: f64,
    /// `rel_mse` of the image times that factor.
    #[serde(with = "serial::float")]
    pub scaled_rel_mse: f64,
}

/// Mean over the pixels that count and their channels; NaN when none does.
pub fn mean(image: &[Rgb], mask: Option<&[bool]>) -> f64 {
    let (sum, count) =
        counted(image, mask).flatten().fold((0.0, 0u64), |(sum, count), &value| (sum + f64::from(value), count + 1));
    sum / count as f64
}

/// All linear measures of `image` against `truth`, over the pixels that count. NaN everywhere when none does.
///
/// # Panics
/// If the sizes differ.
pub fn linear_errors(image: &[Rgb], truth: &[Rgb], mask: Option<&[bool]>) -> LinearErrors {
    let floor = relative_floor(mean(truth, mask));
    let mut absolute = Vec::with_capacity(3 * image.len());
    let (mut relative, mut square, mut signed) = (0.0, 0.0, 0.0);
    // Weighted sums of x t, x x and t t, weights as in `rel_mse`: it is a parabola of the factor.
    let (mut mixed, mut own, mut true_own) = (0.0, 0.0, 0.0);
    for (value, true_value) in counted_pairs(image, truth, mask) {
        let difference = value - true_value;
        relative += relative_square(value, true_value, floor);
        let denominator = true_value * true_value + floor;
        // Where everything is black, nothing weighs.
        let weight = if denominator > 0.0 { 1.0 / denominator } else { 0.0 };
        mixed += weight * value * true_value;
        own += weight * value * value;
        true_own += weight * true_value * true_value;
        square += difference.powi(2);
        signed += difference;
        absolute.push(difference.abs());
    }
    let count = absolute.len() as f64;
    let best_factor = if own > 0.0 { mixed / own } else { 1.0 };
    LinearErrors {
        best_factor,
        scaled_rel_mse: ((true_own + best_factor * (best_factor * own - 2.0 * mixed)) / count).max(0.0),
        rel_mse: relative / count,
        rmse: (square / count).sqrt(),
        bias: signed / count,
        p95_abs: percentile(&mut absolute, 0.95),
        p999_abs: percentile(&mut absolute, 0.999),
    }
}
