//! The one measure of error that grids, reports and the viewer share.

use crate::tone::Rgb;

/// The `0.01 m^2` of relMSE, m the mean of the truth: it keeps black truth from dividing by zero. Below a tenth of the
/// mean an error counts against that tenth.
pub fn relative_floor(truth_mean: f64) -> f64 {
    0.01 * truth_mean * truth_mean
}

/// A value's share of relMSE: `(x - t)^2 / (t^2 + floor)`.
pub fn relative_square(value: f64, truth: f64, floor: f64) -> f64 {
    let difference = value - truth;
    // Where everything is black and equal, 0 / 0 is no error.
    if difference == 0.0 { 0.0 } else { difference.powi(2) / (truth.powi(2) + floor) }
}

/// relMSE of an image: the mean of [`relative_square`] over the pixels that count and their channels; NaN when none
/// does. `mask`: pixels that count (true).
pub fn rel_mse(image: &[Rgb], truth: &[Rgb], mask: &[bool], floor: f64) -> f64 {
    let pairs =
        image.iter().zip(truth).zip(mask).filter(|(_, counts)| **counts).flat_map(|((x, t), _)| x.iter().zip(t));
    let (sum, count) = pairs.fold((0.0, 0u64), |(sum, count), (&x, &t)| {
        (sum + relative_square(f64::from(x), f64::from(t), floor), count + 1)
    });
    sum / count as f64
}
