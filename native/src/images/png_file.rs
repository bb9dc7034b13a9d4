//! PNG: 8 bits a channel, sRGB.

use std::path::Path;

use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder, ImageReader};

use super::{Image, ImageError, Rgb, srgb_decode, tone_map_all};
use crate::files::write_whole;

/// Writes linear radiance as an 8-bit sRGB PNG through [`super::tone_map`].
///
/// # Errors
/// If the file cannot be written.
///
/// # Panics
/// If `pixels` has not `width` times a whole number of pixels.
pub fn write_png(path: &Path, width: u32, pixels: &[Rgb], exposure: f32) -> Result<(), ImageError> {
    let quantised: Vec<[u8; 3]> = tone_map_all(pixels, exposure)
        .into_iter()
        .map(|pixel| pixel.map(|value| (value * 255.0).round() as u8))
        .collect();
    write_png_srgb8(path, width, &quantised)
}

/// Writes pixels that are display values already (error maps, normals).
///
/// # Errors
/// If the file cannot be written.
///
/// # Panics
/// If `pixels` has not `width` times a whole number of pixels.
pub fn write_png_srgb8(path: &Path, width: u32, pixels: &[[u8; 3]]) -> Result<(), ImageError> {
    let rows = pixels.len() as u32 / width.max(1);
    assert_eq!(pixels.len(), width as usize * rows as usize, "{}: whole rows", path.display());
    write_whole(path, |file| {
        let encoder = PngEncoder::new(file);
        encoder.write_image(pixels.as_flattened(), width, rows, ExtendedColorType::Rgb8).map_err(std::io::Error::other)
    })
    .map_err(|error| ImageError::write(path, error))
}

/// Reads a PNG as linear R, G, B (the sRGB curve undone, alpha dropped; no tone map is undone).
///
/// # Errors
/// If the file is missing or broken.
pub fn read_png(path: &Path) -> Result<Image, ImageError> {
    let reader = ImageReader::open(path).map_err(|error| ImageError::read(path, error))?;
    let reader = reader.with_guessed_format().map_err(|error| ImageError::read(path, error))?;
    let decoded = reader.decode().map_err(|error| ImageError::read(path, error))?.into_rgb32f();
    let mut image = Image::new(decoded.width(), decoded.height());
    let pixels: Vec<Rgb> = decoded.pixels().map(|pixel| pixel.0.map(srgb_decode)).collect();
    image.set_rgb("", &pixels);
    Ok(image)
}
