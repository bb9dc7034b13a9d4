//! Metrics of linear radiance.

use crate::{LinearPair, Rgb, counted, percentile};

/// The `0.01 m^2` of relMSE, where m is the mean of the reference. It keeps a black reference from dividing by zero:
/// below a tenth of the mean, an error counts relative to that tenth.
pub fn relative_floor(reference_mean: f64) -> f64 {
    0.01 * reference_mean * reference_mean
}

/// A sample's term of relMSE: `(x - t)^2 / (t^2 + floor)`.
pub fn relative_square(value: f64, reference: f64, floor: f64) -> f64 {
    let difference = value - reference;
    // Where both are black, 0 / 0 is no error.
    if difference == 0.0 { 0.0 } else { difference.powi(2) / (reference.powi(2) + floor) }
}

/// Mean over the pixels that count and their channels; NaN when none does.
pub fn mean(image: &[Rgb], mask: Option<&[bool]>) -> f64 {
    let (sum, count) =
        counted(image, mask).flatten().fold((0.0, 0u64), |(sum, count), &value| (sum + f64::from(value), count + 1));
    sum / count as f64
}

/// Mean of `(x - t)^2 / (t^2 + 0.01 m^2)`, m the mean of the reference t; no unit. NaN when no pixel counts.
pub fn rel_mse(pair: &LinearPair) -> f64 {
    rel_mse_with_floor(pair, relative_floor(mean(pair.reference, pair.mask)))
}

/// [`rel_mse`] with a floor that is already known.
pub fn rel_mse_with_floor(pair: &LinearPair, floor: f64) -> f64 {
    average(pair, |value, reference| relative_square(value, reference, floor))
}

/// Root mean square of `x - t`, radiance.
pub fn rmse(pair: &LinearPair) -> f64 {
    average(pair, |value, reference| (value - reference).powi(2)).sqrt()
}

/// Mean of `x - t`, radiance: positive is too bright.
pub fn bias(pair: &LinearPair) -> f64 {
    average(pair, |value, reference| value - reference)
}

/// 95th percentile of `|x - t|`, radiance.
pub fn p95_abs(pair: &LinearPair) -> f64 {
    percentile(&mut absolute(pair), 0.95)
}

/// 99.9th percentile of `|x - t|`, radiance: fireflies and leaks show here.
pub fn p999_abs(pair: &LinearPair) -> f64 {
    percentile(&mut absolute(pair), 0.999)
}

/// The factor on the image that minimizes [`rel_mse`]: the exposure that an artist would set for a method without
/// units. 1 for a black image.
pub fn best_factor(pair: &LinearPair) -> f64 {
    Parabola::of(pair).best_factor()
}

/// [`rel_mse`] of the image times its [`best_factor`].
pub fn scaled_rel_mse(pair: &LinearPair) -> f64 {
    let parabola = Parabola::of(pair);
    let factor = parabola.best_factor();
    let Parabola { mixed, image, reference, count } = parabola;
    ((reference + factor * (factor * image - 2.0 * mixed)) / count).max(0.0)
}

/// Mean of a function of the two samples; NaN when no pixel counts.
fn average(pair: &LinearPair, of: impl Fn(f64, f64) -> f64) -> f64 {
    let (sum, count) =
        pair.samples().fold((0.0, 0u64), |(sum, count), (value, reference)| (sum + of(value, reference), count + 1));
    sum / count as f64
}

fn absolute(pair: &LinearPair) -> Vec<f64> {
    pair.samples().map(|(value, reference)| (value - reference).abs()).collect()
}

/// relMSE as a function of a factor on the image is a parabola; these are its weighted sums of x t, x x and t t, with
/// the weights of relMSE.
struct Parabola {
    mixed: f64,
    image: f64,
    reference: f64,
    count: f64,
}

impl Parabola {
    fn of(pair: &LinearPair) -> Self {
        let floor = relative_floor(mean(pair.reference, pair.mask));
        let (mut mixed, mut image, mut own, mut count) = (0.0, 0.0, 0.0, 0u64);
        for (value, reference) in pair.samples() {
            let denominator = reference * reference + floor;
            // Where everything is black, nothing has weight.
            let weight = if denominator > 0.0 { 1.0 / denominator } else { 0.0 };
            mixed += weight * value * reference;
            image += weight * value * value;
            own += weight * reference * reference;
            count += 1;
        }
        Self { mixed, image, reference: own, count: count as f64 }
    }

    fn best_factor(&self) -> f64 {
        if self.image > 0.0 { self.mixed / self.image } else { 1.0 }
    }
}
