//! The pictures of a report: those of one scene and kind share an exposure.

use halflight_metrics::{error_map, relative_error};
use halflight_native::images::{Image, Precision, Rgb, write_png, write_png_srgb8};
use halflight_output::OutputFolder;
use serde_json::Value;

use crate::Error;

/// The relative error that an error map shows in its brightest colour: 1 means an error as large as the reference itself.
pub const FULL_SCALE: f32 = 1.0;

/// Where pictures of one size go.
#[derive(Clone, Copy, Debug)]
pub struct Pictures<'a> {
    /// The report folder; pictures go to `images/` in it.
    pub folder: &'a OutputFolder,
    /// Pixels per row.
    pub width: u32,
    /// Pixels that show a surface.
    pub mask: Option<&'a [bool]>,
}

impl Pictures<'_> {
    /// Writes linear radiance as `images/<name>.png` under an exposure, one for all pictures of a scene and kind
    /// ([`halflight_native::images::auto_exposure`] of the truth), and returns that path for [`crate::measurement::Measurement::images`].
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn radiance(&self, name: &str, pixels: &[Rgb], exposure: f32) -> Result<Value, Error> {
        let path = format!("images/{name}.png");
        write_png(&self.folder.claim(&path)?, self.width, pixels, exposure)?;
        Ok(path.into())
    }

    /// Writes `image` as `images/<name>.exr` in float16 and returns that path.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn exr(&self, name: &str, image: &Image) -> Result<Value, Error> {
        let path = format!("images/{name}.exr");
        image.write_exr(&self.folder.claim(&path)?, Precision::Half)?;
        Ok(path.into())
    }

    /// Writes the map of the relative error of `pixels` against `reference` as `images/<name>.png` and returns that path.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn error(&self, name: &str, pixels: &[Rgb], reference: &[Rgb]) -> Result<Value, Error> {
        let path = format!("images/{name}.png");
        let map = error_map(&relative_error(pixels, reference, self.mask), FULL_SCALE, self.mask);
        write_png_srgb8(&self.folder.claim(&path)?, self.width, &map)?;
        Ok(path.into())
    }
}
