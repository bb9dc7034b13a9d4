//! Image files: OpenEXR with named float channels, PNG for eyes, and the one tone map between them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

mod exr_file;
mod png_file;

pub use exr_file::Precision;
pub use halflight_metrics::tone::{Rgb, auto_exposure, luminance, srgb_decode, srgb_encode, tone_map, tone_map_all};
pub use png_file::{read_png, write_png, write_png_srgb8};

/// Why an image file could not be read or written: one sentence that names the file.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file is missing, unreadable or not what its name says.
    #[error("cannot read image {}: {reason}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the operating system or the decoder said.
        reason: String,
    },
    /// The file cannot be created or filled.
    #[error("cannot write image {}: {reason}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the operating system or the encoder said.
        reason: String,
    },
    /// A file name that ends neither in `.exr` nor in `.png`.
    #[error("image {} is neither .exr nor .png; name it one or the other", .0.display())]
    UnknownKind(PathBuf),
}

impl ImageError {
    fn read(path: &Path, reason: impl ToString) -> Self {
        Self::Read { path: path.into(), reason: reason.to_string() }
    }

    fn write(path: &Path, reason: impl ToString) -> Self {
        Self::Write { path: path.into(), reason: reason.to_string() }
    }
}

/// An image of any number of named float channels, each `width * height` samples, rows from the top.
///
/// Channel names follow OpenEXR: `R G B` for the final radiance, `Z` for view depth, and `layer.component` for all
/// else: `albedo.R`, `N.X`, `ambient_occlusion.Y`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Image {
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Samples by channel name.
    pub channels: BTreeMap<String, Vec<f32>>,
    /// Text that travels in the header: settings, scene hash, camera, commit.
    pub metadata: BTreeMap<String, String>,
}

impl Image {
    /// An image without channels.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, ..Self::default() }
    }

    /// Number of pixels.
    pub fn pixel_count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Whether all channels of a pixel are finite.
    pub fn is_finite(&self, pixel: usize) -> bool {
        self.channels.values().all(|channel| channel[pixel].is_finite())
    }

    /// Sets one channel.
    ///
    /// # Panics
    /// If `samples` has not one sample a pixel.
    pub fn set_channel(&mut self, name: impl Into<String>, samples: Vec<f32>) {
        let name = name.into();
        assert_eq!(samples.len(), self.pixel_count(), "channel {name}: one sample a pixel");
        self.channels.insert(name, samples);
    }

    /// Sets the channels R, G and B of a layer; the empty layer is the final image.
    ///
    /// # Panics
    /// If `pixels` has not one value a pixel.
    pub fn set_rgb(&mut self, layer: &str, pixels: &[Rgb]) {
        self.set_components(layer, ["R", "G", "B"], pixels);
    }

    /// Sets the channels X, Y and Z of a layer: `N`, the world normal, or `P`, the world position.
    ///
    /// # Panics
    /// If `pixels` has not one value a pixel.
    pub fn set_vector(&mut self, layer: &str, pixels: &[[f32; 3]]) {
        self.set_components(layer, ["X", "Y", "Z"], pixels);
    }

    fn set_components(&mut self, layer: &str, components: [&str; 3], pixels: &[[f32; 3]]) {
        for (index, component) in components.into_iter().enumerate() {
            self.set_channel(channel_name(layer, component), pixels.iter().map(|pixel| pixel[index]).collect());
        }
    }

    /// One channel, `width * height` samples.
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        self.channels.get(name).map(Vec::as_slice)
    }

    /// The RGB pixels of a layer. A foreign file may hold a single grey channel instead of the final image: the empty
    /// layer then returns that channel three times.
    pub fn rgb(&self, layer: &str) -> Option<Vec<Rgb>> {
        let grey = || match (layer, self.channels.len()) {
            ("", 1) => self.channels.values().next(),
            _ => self.channels.get(&channel_name(layer, "Y")),
        };
        let grey = || grey().map(|samples| samples.iter().map(|&value| [value; 3]).collect());
        self.components(layer, ["R", "G", "B"]).or_else(grey)
    }

    /// The XYZ pixels of a layer.
    pub fn vector(&self, layer: &str) -> Option<Vec<[f32; 3]>> {
        self.components(layer, ["X", "Y", "Z"])
    }

    fn components(&self, layer: &str, components: [&str; 3]) -> Option<Vec<[f32; 3]>> {
        let [x, y, z] = components.map(|component| self.channel(&channel_name(layer, component)));
        let (x, y, z) = (x?, y?, z?);
        Some((0..x.len()).map(|index| [x[index], y[index], z[index]]).collect())
    }

    /// Which pixels show a surface: the depth `Z` is there, finite and positive. None without a `Z` channel.
    pub fn surface_mask(&self) -> Option<Vec<bool>> {
        Some(self.channel("Z")?.iter().map(|depth| depth.is_finite() && *depth > 0.0).collect())
    }

    /// Reads an `.exr` (every channel) or a `.png` (as linear R, G, B).
    ///
    /// # Errors
    /// If the file is missing, broken or of another kind.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        match kind(path) {
            Some(Kind::Exr) => exr_file::read(path),
            Some(Kind::Png) => read_png(path),
            None => Err(ImageError::UnknownKind(path.into())),
        }
    }

    /// Writes every channel and the metadata as OpenEXR (scan lines, lossless ZIP) and returns how many samples had to
    /// be clamped to the range of float16 (0 at full precision).
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_exr(&self, path: &Path, precision: Precision) -> Result<usize, ImageError> {
        exr_file::write(self, path, precision)
    }
}

fn channel_name(layer: &str, component: &str) -> String {
    if layer.is_empty() { component.to_owned() } else { format!("{layer}.{component}") }
}

enum Kind {
    Exr,
    Png,
}

fn kind(path: &Path) -> Option<Kind> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "exr" => Some(Kind::Exr),
        "png" => Some(Kind::Png),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
