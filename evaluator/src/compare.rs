//! `evaluator compare`: every metric of two image files.

use std::fmt;
use std::path::{Path, PathBuf};

use halflight_metrics::{
    DisplayPair, Function, LinearPair, METRICS, Metric, Rgb, Values, block_mean, float, mean, relative_rmse,
};
use halflight_native::images::{Image, auto_exposure, srgb_encode, tone_map_all};
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::format::{number, percent};

/// Side of the blocks over which noise is averaged away, pixels.
pub const BLOCK: u32 = 8;

/// What [`compare`] found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// The image under test.
    pub image: PathBuf,
    /// What it is measured against.
    pub reference: PathBuf,
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Pixels that count: those where the reference's depth `Z`, if it comes with one, shows a surface.
    pub counted_pixels: usize,
    /// Exposure of the display metrics, taken from the reference; 1 where a PNG has fixed it already.
    pub exposure: f32,
    /// One entry per layer that both files have: the final image, and `albedo * indirect`.
    pub layers: Vec<LayerComparison>,
    /// What a reader should know before using the numbers.
    pub notes: Vec<String>,
}

/// All metrics of one layer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LayerComparison {
    /// `final` or `albedo * indirect`.
    pub layer: String,
    /// Mean of the image, radiance.
    #[serde(with = "float")]
    pub mean: f64,
    /// Mean of the reference, radiance.
    #[serde(with = "float")]
    pub reference_mean: f64,
    /// `sqrt(mean((a - b)^2)) / mean(b)` over blocks of 8x8 pixels.
    #[serde(with = "float")]
    pub block_relative_rmse: f64,
    /// Every metric of two images.
    #[serde(flatten, with = "layer_values")]
    pub values: Values,
}

/// Measures `image` against `reference`, two EXR or PNG files of one size.
///
/// # Errors
/// If a file cannot be read, the sizes differ, no pixel counts, or the two share no layer.
pub fn compare(image: &Path, reference: &Path) -> Result<Comparison, Error> {
    let files = [image, reference];
    let [a, b] = [Image::read(image)?, Image::read(reference)?];
    if (a.width, a.height) != (b.width, b.height) {
        let size = |path: &Path, image: &Image| format!("{} is {}x{}", path.display(), image.width, image.height);
        let sentence = format!("{} but {}; compare images of one size", size(image, &a), size(reference, &b));
        return Err(Error::BadInput(sentence));
    }
    // An image of depth alone is the thing compared, not a mask.
    let surfaces = b.surface_mask().filter(|_| b.channels.len() > 1);
    // One pixel that is not finite would make every mean so.
    let finite: Vec<bool> = (0..b.pixel_count()).map(|index| a.is_finite(index) && b.is_finite(index)).collect();
    let broken = finite.iter().filter(|finite| !**finite).count();
    let mask = match surfaces {
        Some(mask) => Some(mask.iter().zip(&finite).map(|(surface, finite)| *surface && *finite).collect()),
        None => (broken > 0).then_some(finite),
    };
    let counted_pixels = mask.as_ref().map_or(b.pixel_count(), |mask| mask.iter().filter(|counts| **counts).count());
    if counted_pixels == 0 {
        let what = if broken > 0 { "no surface whose pixels are finite" } else { "no surface" };
        return Err(Error::BadInput(format!("{} shows {what}: nothing to compare", reference.display())));
    }

    let layers = [("final", a.rgb("").zip(b.rgb(""))), ("albedo * indirect", reflected(&a).zip(reflected(&b)))];
    let layers: Vec<_> = layers.into_iter().filter_map(|(name, pair)| pair.map(|(a, b)| (name, [a, b]))).collect();
    let Some((_, [_, shown_reference])) = layers.first() else {
        return Err(Error::BadInput(format!(
            "{} and {} share no layer; both need R, G and B, or one grey channel, or albedo and indirect",
            image.display(),
            reference.display()
        )));
    };

    let is_png = files.map(|path| path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")));
    let exposure = if is_png.contains(&true) { 1.0 } else { auto_exposure(shown_reference, mask.as_deref()) };
    let layers = layers
        .iter()
        .map(|(name, pixels)| compare_layer(name, pixels, is_png, exposure, b.width, mask.as_deref()))
        .collect();
    let notes = files.iter().zip(is_png).filter(|(_, png)| *png).map(|(path, _)| {
        format!("{} is a PNG: its linear metrics see 8-bit, clipped, tone-mapped values", path.display())
    });
    let left_out = (broken > 0).then(|| format!("{broken} pixels are not finite in one of the files and do not count"));
    let notes = notes.chain(left_out);
    Ok(Comparison {
        image: image.into(),
        reference: reference.into(),
        width: b.width,
        height: b.height,
        counted_pixels,
        exposure,
        layers,
        notes: notes.collect(),
    })
}

fn compare_layer(
    name: &str,
    [image, truth]: &[Vec<Rgb>; 2],
    is_png: [bool; 2],
    exposure: f32,
    width: u32,
    mask: Option<&[bool]>,
) -> LayerComparison {
    // A PNG holds display values already: only linear radiance goes through the tone map.
    let shown = |pixels: &[Rgb], is_png: bool| match is_png {
        true => pixels.iter().map(|pixel| pixel.map(srgb_encode)).collect(),
        false => tone_map_all(pixels, exposure),
    };
    let display = [shown(image, is_png[0]), shown(truth, is_png[1])];
    let blocks = [image, truth].map(|pixels| block_mean(pixels, width, BLOCK, mask));
    let mut values = Values::default();
    values.measure_indirect(&LinearPair::new(image, truth, mask), width);
    values.measure_final(&DisplayPair { width, linear: [image, truth], display: [&display[0], &display[1]], mask });
    LayerComparison {
        layer: name.into(),
        mean: mean(image, mask),
        reference_mean: mean(truth, mask),
        block_relative_rmse: relative_rmse(&blocks[0], &blocks[1]),
        values,
    }
}

/// `albedo * indirect`, where the file has both.
fn reflected(image: &Image) -> Option<Vec<Rgb>> {
    let product = |(albedo, indirect): (Rgb, Rgb)| std::array::from_fn(|channel| albedo[channel] * indirect[channel]);
    Some(image.rgb("albedo")?.into_iter().zip(image.rgb("indirect")?).map(product).collect())
}

impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        writeln!(f, "image      {}", self.image.display())?;
        writeln!(f, "reference  {}", self.reference.display())?;
        let pixels = self.width as usize * self.height as usize;
        let share = 100.0 * self.counted_pixels as f64 / pixels as f64;
        writeln!(f, "size       {}x{}, {} % of the pixels count", self.width, self.height, number(share, 3))?;
        writeln!(f, "exposure   {}", number(self.exposure.into(), 3))?;
        for layer in &self.layers {
            writeln!(f, "\n{}", layer.layer)?;
            for (name, value, unit) in layer.lines() {
                writeln!(f, "{}", format!("  {name:<22}{value:>10}  {unit}").trim_end())?;
            }
        }
        self.notes.iter().try_for_each(|note| writeln!(f, "\nnote: {note}"))
    }
}

/// How much larger a mean is than that of the reference, relative to it. Equal means differ by 0, also if both are black.
fn difference(mean: f64, reference: f64) -> f64 {
    if mean == reference { 0.0 } else { mean / reference - 1.0 }
}

impl LayerComparison {
    /// Name, value and unit of every metric, in reading order.
    fn lines(&self) -> Vec<(&'static str, String, &'static str)> {
        let line = |name, value, unit| (name, number(value, 4), unit);
        let mut lines = vec![
            line("mean", self.mean, "radiance"),
            line("mean of reference", self.reference_mean, "radiance"),
            ("difference of means", percent(difference(self.mean, self.reference_mean)), ""),
            line("relative RMSE, 8x8", self.block_relative_rmse, "over block means"),
        ];
        let metrics = METRICS.iter().filter(|metric| layer_key(metric).is_some());
        lines.extend(metrics.filter_map(|metric| Some(line(metric.title, self.values.get(metric.id)?, metric.unit))));
        lines
    }
}

/// Key of a metric that compares two images of any layer: that of its column without the layer. `None` for the others.
fn layer_key(metric: &Metric) -> Option<&'static str> {
    match metric.function {
        Function::Indirect(_) | Function::IndirectBlocks(_) | Function::Final(_) => {
            metric.key.split_once('_').map(|(_, key)| key)
        }
        Function::Occlusion(_) | Function::Recorded => None,
    }
}

/// Values of a layer under [`layer_key`]s.
mod layer_values {
    use std::collections::BTreeMap;

    use halflight_metrics::{METRICS, Values, float};
    use serde::{Deserialize, Deserializer, Serialize, Serializer, ser::SerializeMap};

    use super::layer_key;

    #[derive(Serialize, Deserialize)]
    #[serde(transparent)]
    struct Float(#[serde(with = "float")] f64);

    pub fn serialize<S: Serializer>(values: &Values, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        for metric in METRICS {
            if let (Some(key), Some(value)) = (layer_key(metric), values.get(metric.id)) {
                map.serialize_entry(key, &Float(value))?;
            }
        }
        map.end()
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Values, D::Error> {
        let all = BTreeMap::<String, serde_json::Value>::deserialize(deserializer)?;
        let mut values = Values::default();
        for metric in METRICS {
            let value = layer_key(metric).and_then(|key| all.get(key));
            if let Some(value) = value {
                let Float(value) = Float::deserialize(value).map_err(serde::de::Error::custom)?;
                values.set(metric.id, Some(value));
            }
        }
        Ok(values)
    }
}

#[cfg(test)]
mod tests;
