//! The error of a picture against a reference that is still noisy.
//!
//! The samples of the reference are split into two independent halves a and b. For a picture x, the mean of
//! `(x - a) (x - b)` is the squared error against the converged reference: the noise of the halves cancels. `(a - b)^2`
//! gives the noise of their mean. The relative metrics also divide by the reference, and there its noise does not cancel.
//! So an error is known only once the noise is small, enough light was found, and two readings agree.

use halflight_metrics::{BLOCK, Rgb, relative_floor};

/// Noise of the reference, as relMSE, above which relative errors are unknown: division by a noisy reference
/// overestimates them.
const MOST_NOISE: f64 = 0.04;
/// Noise of the reference above which an error is unknown, as a factor of the error. Both are squares.
const MOST_NOISE_OF_ERROR: f64 = 1.0;
/// Noise of the reference below which it is small beside the error. Both are squares.
const SMALL_NOISE: f64 = 0.1;
/// Largest ratio of the errors of two readings that agree.
const AGREEMENT: f64 = 1.08;

/// A metric of `albedo * indirect` against the reference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Metric {
    /// Relative RMSE over means of 4x4 pixels.
    #[default]
    Blocks,
    /// Relative RMSE over pixels.
    Pixels,
    /// RMSE over pixels.
    Absolute,
    /// FLIP of the picture.
    Flip,
}

impl Metric {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Blocks, Self::Pixels, Self::Absolute, Self::Flip];
    /// Those of `albedo * indirect`, in linear radiance.
    const LINEAR: [Self; 3] = [Self::Blocks, Self::Pixels, Self::Absolute];

    /// Its position among the estimates of `albedo * indirect`.
    pub fn linear_index(self) -> Option<usize> {
        Self::LINEAR.iter().position(|&other| other == self)
    }

    /// Its name in links.
    pub fn name(self) -> &'static str {
        match self {
            Self::Blocks => "blocks",
            Self::Pixels => "pixels",
            Self::Absolute => "rmse",
            Self::Flip => "flip",
        }
    }

    /// Its column in tables of the evaluator. There, relMSE is the square of the relative RMSE here.
    pub fn column(self) -> &'static str {
        match self {
            Self::Blocks => "indirect_block_rel_mse",
            Self::Pixels => "indirect_rel_mse",
            Self::Absolute => "indirect_rmse",
            Self::Flip => "final_flip",
        }
    }

    /// A value of its column from the square of an error.
    pub fn of_square(self, square: f64) -> f64 {
        if matches!(self, Self::Absolute | Self::Flip) { square.sqrt() } else { square }
    }

    /// An error from the value of its column.
    pub fn of_column(self, value: f64) -> f64 {
        if matches!(self, Self::Absolute | Self::Flip) { value } else { value.max(0.0).sqrt() }
    }

    /// Its name in words.
    pub fn title(self) -> &'static str {
        match self {
            Self::Blocks => "relative RMSE, 4x4 blocks",
            Self::Pixels => "relative RMSE, pixels",
            Self::Absolute => "RMSE, radiance",
            Self::Flip => "FLIP of the picture",
        }
    }

    /// What it compares, in sentences.
    pub fn meaning(self) -> &'static str {
        match self {
            Self::Blocks => {
                "The square root of relMSE, over means of 4x4 pixels of albedo * indirect: the mean of (x - t)^2 / (t^2 \
                 + 0.01 m^2), where m is the mean of the reference t. Noise of single pixels counts little."
            }
            Self::Pixels => {
                "The square root of relMSE, over pixels of albedo * indirect: the mean of (x - t)^2 / (t^2 + 0.01 m^2), \
                 where m is the mean of the reference t."
            }
            Self::Absolute => "The root mean square of x - t, over pixels of albedo * indirect, in units of radiance.",
            Self::Flip => {
                "The mean difference that is seen when the picture and its reference are flipped in place, at this exposure, at \
                 67 pixels per degree: 0 for equal pictures, at most 1 (Andersson et al. 2020). Sharp noise counts much, \
                 and direct light counts, too."
            }
        }
    }

    /// A value with its unit and two or three significant digits.
    pub fn text(self, value: f64) -> String {
        match self {
            Self::Absolute if (1e-3..1e4).contains(&value) => {
                format!("{value:.*}", (2 - value.log10().floor() as i32).max(0) as usize)
            }
            Self::Absolute if value == 0.0 => "0".to_owned(),
            Self::Absolute => format!("{value:.2e}"),
            Self::Flip => format!("{value:.3}"),
            _ if value < 0.1 => format!("{:.1} %", 100.0 * value),
            _ => format!("{:.0} %", 100.0 * value),
        }
    }
}

/// An estimate of an error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// The squared error without the noise of the reference. It can be negative where the error is small.
    pub square: f64,
    /// The squared noise of the reference, in the same unit.
    pub noise: f64,
}

impl Estimate {
    /// The error: a relative error, 1 = 100 %, or radiance.
    pub fn value(&self) -> f64 {
        self.square.max(0.0).sqrt()
    }

    /// Whether the noise of the reference is small beside the error.
    pub fn is_clean(&self) -> bool {
        self.noise <= SMALL_NOISE * self.square
    }

    /// Whether the error is known, given the estimate of the reading before.
    fn is_known(&self, before: &Self, metric: Metric) -> bool {
        let quiet = metric == Metric::Absolute || self.noise <= MOST_NOISE;
        // From FLIP, no noise can be subtracted.
        let most = if metric == Metric::Flip { SMALL_NOISE } else { MOST_NOISE_OF_ERROR };
        let ratio = self.value() / before.value();
        // A picture that equals its reference has no error at all.
        let agree = (1.0 / AGREEMENT..=AGREEMENT).contains(&ratio) || (self.square == 0.0 && before.square == 0.0);
        quiet && self.noise <= most * self.square && agree
    }
}

/// Two independent halves of the samples of a reference.
pub struct Halves {
    /// `albedo * indirect` of each half.
    pub images: [Vec<Rgb>; 2],
    /// Samples per pixel of each half.
    pub samples: [u32; 2],
}

impl Halves {
    /// The halves of a mean of `samples`, of which the first ones had the mean `first`; `None` without further samples.
    pub fn new(first: &[Rgb], first_samples: u32, mean: &[Rgb], samples: u32) -> Option<Self> {
        let rest = samples.checked_sub(first_samples).filter(|&rest| rest > 0 && first_samples > 0)?;
        let (n, m) = (f64::from(first_samples), f64::from(samples));
        let later = |old: f32, new: f32| ((m * f64::from(new) - n * f64::from(old)) / f64::from(rest)) as f32;
        let second = first.iter().zip(mean).map(|(a, t)| std::array::from_fn(|c| later(a[c], t[c]))).collect();
        Some(Self { images: [first.to_vec(), second], samples: [first_samples, rest] })
    }

    /// The errors of a picture, of `albedo * indirect`: by blocks, by pixels, and absolute. `mask`: pixels that show a surface.
    pub fn errors(&self, picture: &[Rgb], width: u32, mask: &[bool]) -> [Estimate; 3] {
        let samples = self.samples.map(f64::from);
        let whole = samples[0] + samples[1];
        let share = samples.map(|samples| samples / whole);
        let mean = |a: f64, b: f64| share[0] * a + share[1] * b;
        let [first, second] = &self.images;
        let (mut sum, mut count) = (0.0, 0.0);
        for index in (0..mask.len()).filter(|&index| mask[index]) {
            sum += (0..3).map(|c| mean(f64::from(first[index][c]), f64::from(second[index][c]))).sum::<f64>();
            count += 3.0;
        }
        let floor = if count > 0.0 { relative_floor(sum / count) } else { 0.0 };
        // `weight` values are averaged in a, b and x; each counts that often.
        let add = |to: &mut Estimate, [a, b, x]: [f64; 3], weight: f64, relative: bool| {
            let t = mean(a, b);
            let divisor = if relative { t * t + floor } else { 1.0 };
            if divisor > 0.0 {
                to.square += weight * (x - a) * (x - b) / divisor;
                to.noise += weight * (a - b).powi(2) * share[0] * share[1] / divisor;
            }
        };
        let mut all = [Estimate::default(); 3];
        let [of_blocks, of_pixels, absolute] = &mut all;
        let (width, block) = (width.max(1) as usize, BLOCK as usize);
        let height = mask.len() / width;
        for (top, left) in (0..height).step_by(block).flat_map(|y| (0..width).step_by(block).map(move |x| (y, x))) {
            let (mut sums, mut pixels) = ([[0.0; 3]; 3], 0.0);
            for y in top..(top + block).min(height) {
                for index in (y * width + left..y * width + (left + block).min(width)).filter(|&index| mask[index]) {
                    pixels += 1.0;
                    for (c, sums) in sums.iter_mut().enumerate() {
                        let values = [first, second, picture].map(|image| f64::from(image[index][c]));
                        add(of_pixels, values, 1.0, true);
                        add(absolute, values, 1.0, false);
                        sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
                    }
                }
            }
            if pixels > 0.0 {
                sums.iter().for_each(|sums| add(of_blocks, sums.map(|sum| sum / pixels), pixels, true));
            }
        }
        for estimate in &mut all {
            estimate.square /= f64::max(count, 1.0);
            estimate.noise /= f64::max(count, 1.0);
        }
        all
    }
}

/// The errors of one picture while its reference is refined.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    latest: Option<[Estimate; 3]>,
    known: [bool; 3],
    seen: Option<Estimate>,
    is_seen_known: bool,
}

impl Errors {
    /// Takes the estimates of the latest reading of the reference, and of the one before it. `lit`: whether it has found
    /// enough light.
    pub fn update(&mut self, before: Option<[Estimate; 3]>, latest: [Estimate; 3], lit: bool) {
        if let Some(before) = before {
            for (index, metric) in Metric::LINEAR.into_iter().enumerate() {
                // An error that was known stays so: it only becomes more accurate.
                self.known[index] |= lit && latest[index].is_known(&before[index], metric);
            }
        }
        self.latest = Some(latest);
    }

    /// Takes FLIP against the latest reading of the reference, and the FLIP between this reading and the one before, as the
    /// noise. `lit`: whether the reference has found enough light.
    pub fn update_seen(&mut self, flip: f64, noise: f64, lit: bool) {
        let latest = Estimate { square: flip * flip, noise: noise * noise };
        if let Some(before) = self.seen.replace(latest) {
            self.is_seen_known |= lit && latest.is_known(&before, Metric::Flip);
        }
    }

    /// The error by a metric, once it is known.
    pub fn get(&self, metric: Metric) -> Option<Estimate> {
        if metric == Metric::Flip {
            return self.seen.filter(|_| self.is_seen_known);
        }
        let index = metric.linear_index()?;
        self.latest.map(|all| all[index]).filter(|_| self.known[index])
    }
}

#[cfg(test)]
mod tests {
    use halflight_metrics::{LinearPair, block_rel_mse, rel_mse, rmse};

    use super::*;

    const SIZE: [usize; 2] = [63, 41];

    /// Pseudo-random numbers, uniform in 0..1 (a linear congruential generator).
    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> f32 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 40) as f32 / (1 << 24) as f32
        }
    }

    fn truth() -> Vec<Rgb> {
        let level = |x: usize, y: usize| 0.1 + 0.9 * ((x * y) as f32 / (SIZE[0] * SIZE[1]) as f32);
        (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [level(x, y), 0.7 * level(x, y), 0.4])).collect()
    }

    /// Mean of samples that are `value / chance` with this chance, otherwise 0.
    fn noisy(value: f32, samples: u32, chance: f32, numbers: &mut Numbers) -> f32 {
        let hits = (0..samples).filter(|_| numbers.next() < chance).count();
        value * hits as f32 / (samples as f32 * chance)
    }

    #[test]
    fn errors_without_noise_are_those_of_the_metrics() {
        let (truth, mask) = (truth(), (0..SIZE[0] * SIZE[1]).map(|i| i % 7 != 0).collect::<Vec<_>>());
        let picture: Vec<Rgb> = truth.iter().map(|&[r, g, b]| [r + 0.1, 0.5 * g, b]).collect();
        let halves = Halves::new(&truth, 4, &truth, 12).expect("two halves");
        assert_eq!(halves.samples, [4, 8]);
        let found = halves.errors(&picture, SIZE[0] as u32, &mask);
        let pair = LinearPair::new(&picture, &truth, Some(&mask));
        let wanted = [block_rel_mse(&pair, SIZE[0] as u32), rel_mse(&pair), rmse(&pair).powi(2)];
        for (found, wanted) in found.iter().zip(wanted) {
            assert!((found.square - wanted).abs() < 1e-5 * wanted && found.noise < 1e-9, "{found:?}, not {wanted}");
        }
        assert!(Halves::new(&truth, 4, &truth, 4).is_none());
    }

    #[test]
    fn known_errors_are_close_to_the_converged_ones() {
        let (truth, width) = (truth(), SIZE[0] as u32);
        let mask = vec![true; truth.len()];
        for (factor, chance) in [(0.0, 0.5), (0.5, 0.5), (0.9, 0.5), (1.05, 0.5), (0.5, 0.05), (0.97, 0.1)] {
            let picture: Vec<Rgb> = truth.iter().map(|pixel| pixel.map(|v| factor * v)).collect();
            let pair = LinearPair::new(&picture, &truth, None);
            let wanted = [block_rel_mse(&pair, width), rel_mse(&pair), rmse(&pair).powi(2)].map(f64::sqrt);
            let (mut numbers, mut errors) = (Numbers(1), Errors::default());
            let (mut mean, mut samples) = (vec![[0.0; 3]; truth.len()], 0);
            let (mut shown, mut before) = ([0; 3], None);
            for _ in 0..12 {
                let more = u32::max(samples, 1);
                let both = |old: f32, new: f32| (samples as f32 * old + more as f32 * new) / (samples + more) as f32;
                let next: Vec<Rgb> = mean
                    .iter()
                    .zip(&truth)
                    .map(|(old, &t)| std::array::from_fn(|c| both(old[c], noisy(t[c], more, chance, &mut numbers))))
                    .collect();
                if let Some(halves) = Halves::new(&mean, samples, &next, samples + more) {
                    let latest = halves.errors(&picture, width, &mask);
                    errors.update(before.replace(latest), latest, true);
                }
                (mean, samples) = (next, samples + more);
                for (index, metric) in Metric::LINEAR.into_iter().enumerate() {
                    if let Some(error) = errors.get(metric) {
                        let ratio = error.value() / wanted[index];
                        let what = format!("{metric:?} of {factor}, chance {chance}, {samples} samples");
                        assert!((0.8..=1.25).contains(&ratio), "{what}: {ratio} times the converged error");
                        shown[index] += 1;
                    }
                }
            }
            // The error of 3 % needs more samples than these for single pixels.
            assert!(shown[0] > 1 && (shown[1] > 0 || factor == 0.97), "{factor}, {chance}: shown {shown:?} times");
        }
    }

    #[test]
    fn a_single_reading_shows_nothing() {
        let estimates = [Estimate { square: 0.25, noise: 0.001 }; 3];
        let mut errors = Errors::default();
        errors.update(None, estimates, true);
        assert_eq!(errors.get(Metric::Blocks), None);
        errors.update(Some(estimates), estimates, false);
        assert_eq!(errors.get(Metric::Blocks), None, "too little light was found");
        errors.update(Some(estimates), estimates, true);
        assert_eq!(errors.get(Metric::Blocks).map(|error| error.value()), Some(0.5));
        // A reading that is far from the one before is not shown, even if it is quiet.
        let mut other = Errors::default();
        other.update(Some(estimates), [Estimate { square: 0.5, noise: 0.001 }; 3], true);
        assert_eq!(other.get(Metric::Pixels), None);
    }

    #[test]
    fn columns_are_those_of_the_evaluator() {
        for metric in Metric::LINEAR {
            assert_eq!(halflight_recommend::metric(metric.column()).map(|found| found.key), Ok(metric.column()));
            // An error of one half.
            assert_eq!(metric.of_column(metric.of_square(0.25)), 0.5);
        }
        assert_eq!([Metric::Blocks, Metric::Absolute].map(|metric| metric.of_square(0.25)), [0.25, 0.5]);
    }

    #[test]
    fn flip_is_shown_once_the_reference_looks_quiet() {
        let mut errors = Errors::default();
        // The reference itself flickers by half of the error.
        errors.update_seen(0.1, 0.05, true);
        errors.update_seen(0.1, 0.05, true);
        assert_eq!(errors.get(Metric::Flip), None);
        errors.update_seen(0.1, 0.02, false);
        assert_eq!(errors.get(Metric::Flip), None, "too little light was found");
        errors.update_seen(0.13, 0.02, true);
        assert_eq!(errors.get(Metric::Flip), None, "two readings differ");
        errors.update_seen(0.128, 0.02, true);
        assert!(
            errors.get(Metric::Flip).is_some_and(|error| (error.value() - 0.128).abs() < 1e-12 && error.is_clean())
        );
        assert_eq!(errors.get(Metric::Blocks), None);
        assert_eq!(Metric::Flip.text(0.128), "0.128");
    }

    #[test]
    fn texts_have_units_and_few_digits() {
        assert_eq!(Metric::Blocks.text(0.7249), "72 %");
        assert_eq!(Metric::Pixels.text(0.0549), "5.5 %");
        assert_eq!(Metric::Absolute.text(0.017_49), "0.0175");
        assert_eq!(Metric::Absolute.text(12.34), "12.3");
        assert_eq!(Metric::Absolute.text(0.0), "0");
    }
}
