//! How far an image is from the truth.
//!
//! Two families. [`linear_errors`] works on linear radiance (`albedo * indirect`), where energy and bias are real;
//! [`display_errors`] works on what a viewer sees. Every measure takes an optional mask (true = counts), by which sky
//! pixels are left out of every mean.

use serde::{Deserialize, Serialize};

pub use halflight_native::images::Rgb;

mod blocks;
mod error_map;
mod flip;
mod linear;
mod similarity;

pub use blocks::{block_mean, relative_rmse};
pub use error_map::{colour_map, error_map, relative_error};
pub use flip::{Exposures, flip_map, hdr_exposures, hdr_flip_map};
pub use linear::{LinearErrors, linear_errors, mean};
pub use similarity::{psnr_db, ssim, ssim_map};

use crate::serial;

/// Error of an image as a viewer sees it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DisplayErrors {
    /// Peak signal-to-noise ratio of display values, dB; infinite for equal images.
    #[serde(with = "serial::float")]
    pub psnr_db: f64,
    /// Mean structural similarity of display luma, -1..1; 1 for equal images.
    pub ssim: f64,
    /// Mean FLIP of display values, 0..1; 0 for equal images.
    pub flip: f64,
    /// Mean HDR-FLIP of linear radiance, 0..1; 0 for equal images.
    pub hdr_flip: f64,
}

/// An image and its truth, ready for every display measure: the same pixels as linear radiance and as display values.
#[derive(Clone, Copy, Debug)]
pub struct DisplayPair<'a> {
    /// Pixels per row.
    pub width: u32,
    /// Linear radiance of the image and of the truth.
    pub linear: [&'a [Rgb]; 2],
    /// Display values 0..1 of the image and of the truth ([`halflight_native::images::tone_map_all`] with one exposure).
    pub display: [&'a [Rgb]; 2],
    /// Which pixels count.
    pub mask: Option<&'a [bool]>,
}

/// All display measures of a pair.
pub fn display_errors(pair: &DisplayPair) -> DisplayErrors {
    let DisplayPair { width, linear: [image, truth], display: [shown, shown_truth], mask } = *pair;
    DisplayErrors {
        psnr_db: psnr_db(shown, shown_truth, mask),
        ssim: ssim(shown, shown_truth, width, mask),
        flip: masked_mean(&flip_map(shown, shown_truth, width), mask),
        hdr_flip: masked_mean(&hdr_flip_map(image, truth, width, mask), mask),
    }
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
fn counted_pairs<'a>(
    image: &'a [Rgb],
    truth: &'a [Rgb],
    mask: Option<&'a [bool]>,
) -> impl Iterator<Item = (f64, f64)> + 'a {
    assert_eq!(image.len(), truth.len(), "an image and its truth have the same size");
    counted(image, mask)
        .flatten()
        .zip(counted(truth, mask).flatten())
        .map(|(&value, &true_value)| (f64::from(value), f64::from(true_value)))
}

#[cfg(test)]
mod tests;
