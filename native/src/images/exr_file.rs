//! OpenEXR through the `exr` crate.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image as ExrImage, Layer};
use exr::meta::attribute::{AttributeValue, Text};
use exr::meta::header::LayerAttributes;
use exr::prelude::{ReadChannels, ReadLayers, WritableImage, read as exr_read};
use half::f16;

use super::{Image, ImageError};
use crate::files::write_whole;

/// Our header attributes carry this prefix, so that they never meet a standard one (`owner`, `exposure`).
const ATTRIBUTE_PREFIX: &str = "halflight.";

/// How samples are stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// float32: nothing is lost.
    #[default]
    Full,
    /// float16, half the size, 11 bits of mantissa. Finite values beyond 65,504 are clamped and counted. Depth `Z` and
    /// position `P` stay float32: in scene units they need the range and the digits.
    Half,
}

pub(super) fn read(path: &Path) -> Result<Image, ImageError> {
    let failed = |error: exr::error::Error| ImageError::read(path, error);
    let file = File::open(path).map_err(|error| ImageError::read(path, error))?;
    let file = exr_read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(BufReader::new(file))
        .map_err(failed)?;

    let layer = file.layer_data;
    let size = |length: usize| u32::try_from(length).map_err(|error| ImageError::read(path, error));
    let mut image = Image::new(size(layer.size.0)?, size(layer.size.1)?);
    for channel in layer.channel_data.list {
        let samples: Vec<f32> = channel.sample_data.values_as_f32().collect();
        if samples.len() != image.pixel_count() {
            return Err(ImageError::read(path, format!("channel {} is subsampled; store it in full", channel.name)));
        }
        image.channels.insert(channel.name.to_string(), samples);
    }
    // Depending on the writer, custom attributes sit with the image or with its only layer.
    for (name, value) in file.attributes.other.into_iter().chain(layer.attributes.other) {
        if let AttributeValue::Text(text) = value {
            let name = String::from_utf8_lossy(name.bytes()).into_owned();
            let name = name.strip_prefix(ATTRIBUTE_PREFIX).map_or(name.clone(), str::to_owned);
            image.metadata.insert(name, String::from_utf8_lossy(text.bytes()).into_owned());
        }
    }
    Ok(image)
}

pub(super) fn write(image: &Image, path: &Path, precision: Precision) -> Result<usize, ImageError> {
    let mut clamped = 0;
    let channels = image.channels.iter().map(|(name, samples)| {
        let samples = match precision {
            Precision::Half if name != "Z" && !name.starts_with("P.") => {
                FlatSamples::F16(samples.iter().map(|&value| to_half(value, &mut clamped)).collect())
            }
            _ => FlatSamples::F32(samples.clone()),
        };
        AnyChannel::new(utf8(name), samples)
    });
    let channels = AnyChannels::sort(channels.collect());
    let mut attributes = LayerAttributes::default();
    for (name, value) in &image.metadata {
        attributes.other.insert(utf8(&format!("{ATTRIBUTE_PREFIX}{name}")), AttributeValue::Text(utf8(value)));
    }
    let size = (image.width as usize, image.height as usize);
    let file = ExrImage::from_layer(Layer::new(size, attributes, Encoding::SMALL_FAST_LOSSLESS, channels));
    write_whole(path, |target| file.write().to_buffered(target)).map_err(|error| ImageError::write(path, error))?;
    Ok(clamped)
}

/// Nearest float16; finite values out of its range become the largest one and are counted. Infinity (sky) stays.
fn to_half(value: f32, clamped: &mut usize) -> f16 {
    let half = f16::from_f32(value);
    if value.is_finite() && half.is_infinite() {
        *clamped += 1;
        return f16::MAX.copysign(f16::from_f32(value.signum()));
    }
    half
}

/// OpenEXR stores bytes; every current reader takes them as UTF-8.
fn utf8(text: &str) -> Text {
    Text::from_slice_unchecked(text.as_bytes())
}
