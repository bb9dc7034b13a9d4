//! PSNR and SSIM of display values.
//!
//! SSIM is written here because the crates at hand compute something else under its name: `image-compare` takes
//! non-overlapping 8x8 blocks and sums where Wang et al. average (so its constants weigh 64 times less), and `dssim`
//! is a different multi-scale measure under the AGPL.

use crate::{Rgb, counted_samples, masked_mean};

/// Peak signal-to-noise ratio, dB, of display values (peak 1), over pixels and channels. Infinite for equal images.
pub fn psnr_db(shown: &[Rgb], shown_reference: &[Rgb], mask: Option<&[bool]>) -> f64 {
    let (sum, count) = counted_samples(shown, shown_reference, mask)
        .fold((0.0, 0u64), |(sum, count), (value, reference)| (sum + (value - reference).powi(2), count + 1));
    -10.0 * (sum / count as f64).log10()
}

/// Mean of [`ssim_map`] over the pixels that count.
pub fn ssim(shown: &[Rgb], shown_reference: &[Rgb], width: u32, mask: Option<&[bool]>) -> f64 {
    masked_mean(&ssim_map(shown, shown_reference, width), mask)
}

/// Radius of the 11x11 window and standard deviation of its Gaussian, in pixels (Wang et al. 2004, section III-C).
const WINDOW_RADIUS: usize = 5;
const WINDOW_SIGMA: f64 = 1.5;
/// (K1 L)^2 and (K2 L)^2 with K1 = 0.01, K2 = 0.03 and the dynamic range L = 1.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Structural similarity per pixel, -1..1, of display luma (Wang, Bovik, Sheikh, Simoncelli 2004, Eq. 13).
///
/// At the border the window is cut and its weights are normalised again, so that an image of any size has a value at
/// every pixel (the authors' program leaves a border of 5 pixels out).
pub fn ssim_map(shown: &[Rgb], shown_reference: &[Rgb], width: u32) -> Vec<f32> {
    let luma = |pixels: &[Rgb]| pixels.iter().map(|&pixel| display_luma(pixel)).collect::<Vec<f64>>();
    let (x, y) = (luma(shown), luma(shown_reference));
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).collect::<Vec<f64>>();
    let window = Window::new(width as usize);
    let [mean_x, mean_y, xx, yy, xy] =
        [&x, &y, &product(&x, &x), &product(&y, &y), &product(&x, &y)].map(|image| window.average(image));
    (0..x.len())
        .map(|i| {
            let (mx, my) = (mean_x[i], mean_y[i]);
            let (variance_x, variance_y, covariance) = (xx[i] - mx * mx, yy[i] - my * my, xy[i] - mx * my);
            let luminance = (2.0 * mx * my + C1) / (mx * mx + my * my + C1);
            let structure = (2.0 * covariance + C2) / (variance_x + variance_y + C2);
            (luminance * structure) as f32
        })
        .collect()
}

/// Rec. 601 luma of display values, as in the authors' program.
fn display_luma([r, g, b]: Rgb) -> f64 {
    0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b)
}

/// The Gaussian window, applied as a row pass and a column pass.
struct Window {
    width: usize,
    weights: [f64; 2 * WINDOW_RADIUS + 1],
}

impl Window {
    fn new(width: usize) -> Self {
        let weight = |index| {
            let distance = index as f64 - WINDOW_RADIUS as f64;
            (-0.5 * (distance / WINDOW_SIGMA).powi(2)).exp()
        };
        Self { width, weights: std::array::from_fn(weight) }
    }

    fn average(&self, image: &[f64]) -> Vec<f64> {
        let height = image.len() / self.width.max(1);
        let rows = self.pass(image, self.width, 1);
        self.pass(&rows, height, self.width)
    }

    /// Averages along lines of `length` samples that lie `stride` apart.
    fn pass(&self, image: &[f64], length: usize, stride: usize) -> Vec<f64> {
        let mut result = vec![0.0; image.len()];
        for position in 0..length {
            let first = position.saturating_sub(WINDOW_RADIUS);
            let last = (position + WINDOW_RADIUS).min(length - 1);
            let weights = &self.weights[first + WINDOW_RADIUS - position..=last + WINDOW_RADIUS - position];
            let scale = 1.0 / weights.iter().sum::<f64>();
            for line in 0..image.len() / length {
                // Rows: lines are `width` apart and samples 1; columns: the other way round.
                let start = if stride == 1 { line * length } else { line };
                let sum: f64 =
                    weights.iter().zip(first..).map(|(weight, at)| weight * image[start + at * stride]).sum();
                result[start + position * stride] = sum * scale;
            }
        }
        result
    }
}
