//! Image files to textures.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageFormat, ImageReader};

use super::files::tidy;
use super::{Reader, reason};
use crate::Texture;

/// What a material uses an image for.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Role {
    /// Colour.
    Colour,
    /// Alpha mask.
    AlphaMask,
}

/// Textures requested so far, by path and role; `None` for a missing mask.
pub(super) type Found = HashMap<(String, Role), Option<usize>>;

/// Index of the texture in the file `name`, relative to `folder`. `material` names the material in warnings.
///
/// Each file is decoded once. A missing or broken colour becomes a magenta checker, a missing or broken mask is ignored
/// (`None`); both give a warning.
pub(super) fn texture(reader: &mut Reader, folder: &Path, name: &str, role: Role, material: &str) -> Option<usize> {
    let path = tidy(&folder.join(name.replace('\\', "/")));
    if let Some(&known) = reader.textures.get(&(path.clone(), role)) {
        return known;
    }
    let name = tidy(Path::new(name));
    let index = match decode(reader, &path) {
        Ok(image) => {
            let transparent = image.color().has_alpha() && image.to_rgba8().pixels().any(|pixel| pixel.0[3] < 255);
            let mut rgba = image.to_rgba8();
            if role == Role::AlphaMask && !transparent {
                rgba.pixels_mut()
                    .zip(image.to_luma8().pixels())
                    .for_each(|(pixel, luminance)| pixel.0[3] = luminance.0[0]);
            }
            let other = if role == Role::Colour { Role::AlphaMask } else { Role::Colour };
            match reader.textures.get(&(path.clone(), other)) {
                // The alpha channel holds the mask, so one texture serves both roles.
                Some(&Some(same)) if transparent => Some(same),
                _ => {
                    let (width, height) = rgba.dimensions();
                    reader.scene.textures.push(Texture { name, width, height, rgba: rgba.into_raw() });
                    Some(reader.scene.textures.len() - 1)
                }
            }
        }
        Err(why) if role == Role::AlphaMask => {
            reader.warn(format!("{material}: alpha mask {path} {why}; the surface is drawn opaque"));
            None
        }
        Err(why) => {
            reader.warn(format!("{material}: texture {path} {why}; it is replaced by a magenta checker"));
            reader.scene.textures.push(checker(&name));
            Some(reader.scene.textures.len() - 1)
        }
    };
    reader.textures.insert((path, role), index);
    index
}

/// The image, or why it cannot be used.
fn decode(reader: &Reader, path: &str) -> Result<DynamicImage, String> {
    let bytes = reader.files.read(Path::new(path)).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => "is missing".into(),
        _ => format!("cannot be read ({})", reason(&error)),
    })?;
    let mut image = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| error.to_string())?;
    if image.format().is_none() {
        // TGA files have no signature; only the file name identifies them.
        if let Ok(format) = ImageFormat::from_path(path) {
            image.set_format(format);
        }
    }
    image.decode().map_err(|error| format!("cannot be decoded ({error})"))
}

/// A magenta and grey checker of 8 x 8 squares.
fn checker(name: &str) -> Texture {
    const SIZE: u32 = 64;
    let texel = |i: u32| {
        if (i % SIZE / 8 + i / SIZE / 8).is_multiple_of(2) { [255, 0, 255, 255] } else { [128, 128, 128, 255] }
    };
    Texture {
        name: format!("replacement for {name}"),
        width: SIZE,
        height: SIZE,
        rgba: (0..SIZE * SIZE).flat_map(texel).collect(),
    }
}
