//! Image metrics: images in, numbers out. The crate knows no device, file or report.
//!
//! [`METRICS`] is the one table of metrics. Each entry is declared together with the function that computes it; columns
//! of results.csv, tables and plots of reports, and the command `compare` are made from the table. Adding a metric is
//! adding one entry.
//!
//! Linear metrics compare linear radiance (`albedo * indirect`), where energy and bias have a meaning. Display metrics
//! compare what a viewer sees. Every metric takes an optional mask (true = the pixel counts), which leaves sky pixels
//! out.
//!
//! ```
//! use halflight_metrics::{LinearPair, METRICS, MetricId, Values};
//!
//! let reference = [[0.5; 3], [1.0; 3]];
//! let image = [[0.5; 3], [1.5; 3]];
//! let mut values = Values::default();
//! values.measure_indirect(&LinearPair::new(&image, &reference, None), 2);
//! assert_eq!(values.get(MetricId::IndirectBias), Some(0.25));
//! for metric in METRICS {
//!     if let Some(value) = values.get(metric.id) {
//!         println!("{} = {value} {}: {}", metric.title, metric.unit, metric.meaning);
//!     }
//! }
//! ```

mod blocks;
#[cfg(feature = "flip")]
mod error_map;
#[cfg(feature = "flip")]
mod flip;
pub mod float;
mod linear;
mod percentile;
mod similarity;
mod table;
pub mod tone;
mod values;

pub use blocks::{BLOCK, block_mean, block_rel_mse, block_rel_mse_with_floor, relative_rmse};
#[cfg(feature = "flip")]
pub use error_map::{colour_map, error_map, relative_error};
#[cfg(feature = "flip")]
pub use flip::{Exposures, flip, flip_map, hdr_exposures, hdr_flip, hdr_flip_map};
pub use linear::{
    best_factor, bias, mean, p95_abs, p999_abs, rel_mse, rel_mse_with_floor, relative_floor, relative_square, rmse,
    scaled_rel_mse,
};
pub use percentile::percentile;
pub use similarity::{psnr_db, ssim, ssim_map};
pub use table::{Best, Function, METRICS, Metric, MetricId, Plotted};
pub use tone::Rgb;
pub use values::Values;

/// An image and its reference as linear values, and which pixels count.
#[derive(Clone, Copy, Debug)]
pub struct LinearPair<'a> {
    /// The image.
    pub image: &'a [Rgb],
    /// What it is compared with.
    pub reference: &'a [Rgb],
    /// Pixels that count (true); `None` counts all.
    pub mask: Option<&'a [bool]>,
}

impl<'a> LinearPair<'a> {
    /// A pair of two images of one size.
    pub fn new(image: &'a [Rgb], reference: &'a [Rgb], mask: Option<&'a [bool]>) -> Self {
        Self { image, reference, mask }
    }

    /// Samples of both images, over the channels of the pixels that count.
    ///
    /// # Panics
    /// If the sizes differ.
    fn samples(&self) -> impl Iterator<Item = (f64, f64)> {
        counted_samples(self.image, self.reference, self.mask)
    }
}

/// An image and its reference, ready for every display metric: the same pixels as linear radiance and as display
/// values.
#[derive(Clone, Copy, Debug)]
pub struct DisplayPair<'a> {
    /// Pixels per row.
    pub width: u32,
    /// Linear radiance of the image and of the reference.
    pub linear: [&'a [Rgb]; 2],
    /// Display values 0..1 of the image and of the reference ([`tone::tone_map_all`] with one exposure).
    pub display: [&'a [Rgb]; 2],
    /// Pixels that count (true); `None` counts all.
    pub mask: Option<&'a [bool]>,
}

/// Mean of a per-pixel map over the pixels that count; NaN when none does.
pub fn masked_mean(map: &[f32], mask: Option<&[bool]>) -> f64 {
    let (sum, count) = counted(map, mask).fold((0.0, 0u64), |(sum, count), &value| (sum + f64::from(value), count + 1));
    sum / count as f64
}

/// The items whose mask is true (all without a mask).
fn counted<'a, T>(items: &'a [T], mask: Option<&'a [bool]>) -> impl Iterator<Item = &'a T> {
    items.iter().enumerate().filter(move |&(index, _)| mask.is_none_or(|mask| mask[index])).map(|(_, item)| item)
}

/// Pairs of samples (all channels) of the pixels that count.
fn counted_samples<'a>(
    image: &'a [Rgb],
    reference: &'a [Rgb],
    mask: Option<&'a [bool]>,
) -> impl Iterator<Item = (f64, f64)> + 'a {
    assert_eq!(image.len(), reference.len(), "an image and its reference have the same size");
    counted(image, mask)
        .flatten()
        .zip(counted(reference, mask).flatten())
        .map(|(&value, &reference)| (f64::from(value), f64::from(reference)))
}

#[cfg(all(test, feature = "flip"))]
mod tests;
