//! Error maps.

use std::sync::OnceLock;

use crate::{Rgb, mean, relative_floor, relative_square};

/// Relative error per pixel: the square root of the pixel's share of relMSE, `sqrt(mean over channels of
/// (x - t)^2 / (t^2 + 0.01 m^2))`. 1 means an error as large as the reference itself.
pub fn relative_error(image: &[Rgb], reference: &[Rgb], mask: Option<&[bool]>) -> Vec<f32> {
    let floor = relative_floor(mean(reference, mask));
    let term = |(&value, &reference): (&f32, &f32)| relative_square(f64::from(value), f64::from(reference), floor);
    image
        .iter()
        .zip(reference)
        .map(|(pixel, reference)| (pixel.iter().zip(reference).map(term).sum::<f64>() / 3.0).sqrt() as f32)
        .collect()
}

/// Grey of pixels that do not count.
const LEFT_OUT: [u8; 3] = [96, 96, 96];

/// An error map in the colours of [`colour_map`]: 0 black, `full_scale` and above pale yellow, NaN pure green (no other
/// error has that colour), pixels that do not count grey.
pub fn error_map(error: &[f32], full_scale: f32, mask: Option<&[bool]>) -> Vec<[u8; 3]> {
    let colours = colour_map();
    let colour = |(index, &error): (usize, &f32)| match mask {
        Some(mask) if !mask[index] => LEFT_OUT,
        _ if error.is_nan() => [0, 255, 0],
        _ => colours[((error / full_scale).clamp(0.0, 1.0) * 255.0).round() as usize],
    };
    error.iter().enumerate().map(colour).collect()
}

/// Magma: 256 sRGB colours from black over purple and orange to pale yellow, perceptually even, readable in grey and
/// with common colour blindness; the map that FLIP's authors use.
pub fn colour_map() -> &'static [[u8; 3]] {
    static MAGMA: OnceLock<Vec<[u8; 3]>> = OnceLock::new();
    MAGMA.get_or_init(|| nv_flip::magma_lut().to_vec().as_chunks::<3>().0.to_vec())
}
