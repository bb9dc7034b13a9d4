//! FLIP of a side against a reference that is still refined.

use halflight_frame_graph::Gpu;
use halflight_metrics::{
    Rgb,
    tone::{srgb_decode, tone_map},
};
use web_time::{Duration, Instant};

use crate::{flip::Flip, readback::TextureReading, reference::Reference};

/// Time of one step.
const STEP: Duration = Duration::from_millis(25);
/// Pixels between two looks at the clock.
const PIXELS: usize = 1000;

/// What a comparison belongs to: the reading of the reference, and the bits of the exposure.
pub type Key = (u64, u32);

/// Linear values of a display under this exposure.
fn shown(pixels: &[Rgb], exposure: f32) -> Vec<Rgb> {
    pixels.iter().map(|&pixel| tone_map(pixel, exposure).map(srgb_decode)).collect()
}

/// A comparison that is done in steps, and its latest result.
#[derive(Default)]
pub struct Comparison {
    running: Option<(Key, Flip)>,
    found: Option<(Key, f64)>,
}

impl Comparison {
    /// Continues the comparison of two pictures of radiance under the exposure of this key, which are asked for at its start;
    /// its result, if it has one for this key.
    pub fn step<'a>(
        &mut self,
        key: Key,
        reference: &Reference,
        pictures: impl FnOnce() -> Option<[&'a [Rgb]; 2]>,
    ) -> Option<f64> {
        if let Some((_, found)) = self.found.filter(|(of, _)| *of == key) {
            return Some(found);
        }
        if self.running.as_ref().is_none_or(|(of, _)| *of != key) {
            let pictures = pictures()?;
            // The picture may have another size for a moment.
            if pictures.iter().any(|picture| picture.len() != reference.mask.len()) {
                return None;
            }
            let [first, second] = pictures.map(|picture| shown(picture, f32::from_bits(key.1)));
            self.running = Some((key, Flip::new(&first, &second, reference.width, reference.mask.clone())));
            return None;
        }
        let (_, flip) = self.running.as_mut()?;
        let start = Instant::now();
        while start.elapsed() < STEP {
            if let Some(found) = flip.step(PIXELS) {
                (self.running, self.found) = (None, Some((key, found)));
                return Some(found);
            }
        }
        None
    }
}

/// The final picture of a side, read back, and its comparison.
#[derive(Default)]
pub struct Seen {
    reading: Option<TextureReading>,
    picture: Option<Vec<Rgb>>,
    comparison: Comparison,
    /// What its error was last updated with.
    pub taken: Option<Key>,
}

impl Seen {
    /// Continues; FLIP against this reading of the reference once it is known. `texture`: the final picture.
    pub fn step(&mut self, gpu: &Gpu, texture: Option<&wgpu::Texture>, key: Key, reference: &Reference) -> Option<f64> {
        if self.picture.is_none() {
            match &self.reading {
                None => self.reading = texture.map(|texture| TextureReading::new(gpu, texture)),
                Some(reading) => {
                    let texels = reading.take()?;
                    self.picture = Some(texels.into_iter().map(|[r, g, b, _]| [r, g, b]).collect());
                    self.reading = None;
                }
            }
        }
        let picture = self.picture.as_ref()?;
        self.comparison.step(key, reference, || Some([&reference.pictures[0], picture]))
    }
}
