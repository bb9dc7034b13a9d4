//! What to trace, and when to stop.

use halflight_scenes::Camera;
use serde::{Deserialize, Serialize};

use halflight_shared_shaders::truth::path_trace;

use super::TruthError;
use crate::gi::TextureFilter;

/// A request to the path tracer. Depth, normal, albedo, position and `direct` are always included: they cost one ray
/// per pixel and one per light.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Camera. Primary rays pass through pixel centres.
    pub camera: Camera,
    /// Width and height, pixels, each 1..=65535.
    pub size: [u32; 2],
    /// Whether to store the first bounce separately.
    pub bounce1: bool,
    /// Bounces of `indirect`, 0..=64; 0 for no indirect light.
    pub bounces: u32,
    /// Whether to store the part of the first bounce whose source is on the screen.
    pub on_screen: bool,
    /// Whether to trace glossy light: what the mirror lobe of the first hit sends to the eye, from directly lit,
    /// diffuse surfaces.
    pub glossy: bool,
    /// Radius of the ambient visibility, scene units; 0 for unlimited; `None` for no ambient visibility.
    pub ambient_occlusion: Option<f32>,
    /// How textures are read at primary hits. Further hits are always bilinear.
    pub texture_filter: TextureFilter,
    /// Seed of all random numbers. The same seed gives the same sums, bit for bit, on the same adapter.
    pub seed: u32,
}

/// When to stop: at a number of samples, or earlier at a relative error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stop {
    /// Largest number of samples per pixel, at least 1.
    pub samples_per_pixel: u32,
    /// Relative error to reach, over blocks of `error_block` pixels: see [`super::Truth::rel_error`].
    pub rel_error: Option<f32>,
    /// Width of the blocks over which pixels are averaged before their error is estimated, pixels; 1 for single pixels.
    pub error_block: u32,
}

impl Stop {
    /// Samples after which the error of a trace without samples is judged first.
    const FIRST_CHECK: u32 = 16;

    /// Whether a trace with these samples and this error, where it is known, is finished.
    pub fn is_reached(&self, samples: u32, rel_error: Option<f64>) -> bool {
        let enough = self.rel_error.zip(rel_error).is_some_and(|(target, error)| error <= f64::from(target));
        samples >= self.samples_per_pixel || enough && samples > 1
    }

    /// Expected number of samples per pixel at the end.
    pub fn expected_samples(&self, samples: u32, rel_error: Option<f64>) -> u32 {
        let needed = match (self.rel_error, rel_error) {
            // The error decreases with the square root of the samples. 5 % more samples, so that one more estimate
            // suffices.
            (Some(target), Some(error)) => f64::from(samples) * (error / f64::from(target)).powi(2) * 1.05,
            _ => f64::INFINITY,
        };
        needed.min(f64::from(self.samples_per_pixel)).max(1.0) as u32
    }

    /// Samples at which the error is judged next.
    pub fn next_check(&self, samples: u32, rel_error: Option<f64>) -> u32 {
        let limit = self.samples_per_pixel;
        match (self.rel_error, rel_error) {
            (None, _) => limit,
            (Some(_), None) => limit.min(samples.saturating_mul(2).max(Self::FIRST_CHECK)),
            // A first estimate is not reliable enough for a large step.
            (Some(_), Some(_)) => {
                let most = samples.saturating_mul(8).max(samples + 1);
                self.expected_samples(samples, rel_error).clamp(samples + 1, most).min(limit)
            }
        }
    }
}

impl Default for Stop {
    fn default() -> Self {
        Self { samples_per_pixel: 256, rel_error: None, error_block: 1 }
    }
}

impl Stop {
    /// Stops after this many samples per pixel.
    pub fn at_samples(samples_per_pixel: u32) -> Self {
        Self { samples_per_pixel, ..Self::default() }
    }

    /// Stops at this relative error of single pixels, or after 65536 samples per pixel.
    pub fn at_rel_error(rel_error: f32) -> Self {
        Self { samples_per_pixel: 1 << 16, rel_error: Some(rel_error), error_block: 1 }
    }
}

impl Request {
    /// Only primary hits and direct light. Set the other fields for more.
    pub fn new(camera: Camera, size: [u32; 2]) -> Self {
        Self {
            camera,
            size,
            bounce1: false,
            bounces: 0,
            on_screen: false,
            glossy: false,
            ambient_occlusion: None,
            texture_filter: TextureFilter::Bilinear,
            seed: 0,
        }
    }

    pub(super) fn check(&self) -> Result<(), TruthError> {
        let [width, height] = self.size;
        if !(1..=65535).contains(&width) || !(1..=65535).contains(&height) {
            return Err(TruthError(format!("truth of {width}x{height} pixels: width and height must be 1 to 65535")));
        }
        if self.bounces > 64 {
            return Err(TruthError(format!("truth of {} bounces: at most 64 are traced", self.bounces)));
        }
        match self.ambient_occlusion {
            Some(radius) if !(radius.is_finite() && radius >= 0.0) => {
                Err(TruthError(format!("ambient occlusion radius {radius}: give a length, or 0 for unlimited")))
            }
            _ => Ok(()),
        }
    }

    /// Bounces of the longest path.
    pub(super) fn path_bounces(&self) -> u32 {
        self.bounces.max((self.bounce1 || self.on_screen).into())
    }

    /// Whether anything needs samples.
    pub fn is_random(&self) -> bool {
        self.path_bounces() > 0 || self.glossy || self.ambient_occlusion.is_some()
    }
}

/// Offset of each output's sums in a pixel's words. Twin of the overrides of `truth/path_trace.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Layout {
    pub(super) words: u32,
    pub(super) bounce1: Option<u32>,
    pub(super) indirect: Option<u32>,
    pub(super) on_screen: Option<u32>,
    pub(super) glossy: Option<u32>,
    pub(super) occlusion: Option<u32>,
}

impl Layout {
    pub(super) fn new(request: &Request) -> Self {
        // Word 0 counts rays.
        let mut words = 1;
        let mut place = |wanted: bool, size: u32| {
            wanted.then(|| {
                words += size;
                words - size
            })
        };
        let indirect = place(request.bounces > 0, 6);
        // One bounce of indirect light is the first bounce.
        let bounce1 = if request.bounces == 1 { indirect } else { place(request.bounce1, 6) };
        let on_screen = place(request.on_screen, 6);
        let glossy = place(request.glossy, 6);
        let occlusion = place(request.ambient_occlusion.is_some(), 1);
        Self { words, bounce1: bounce1.filter(|_| request.bounce1), indirect, on_screen, glossy, occlusion }
    }

    /// Pipeline constants for a scene without special features. If `bounce1` shares its words with `indirect`, the
    /// shader writes them once.
    pub(super) fn constants(&self, bounces: u32) -> path_trace::Constants {
        let place = |at: Option<u32>| at.unwrap_or(0);
        path_trace::Constants {
            sum_words: self.words,
            bounce1: place(self.bounce1.filter(|_| self.bounce1 != self.indirect)),
            indirect: place(self.indirect),
            on_screen: place(self.on_screen),
            glossy: place(self.glossy),
            occlusion: place(self.occlusion),
            bounces,
            environment: false,
            draw_emitters: false,
            draw_sky: false,
            translucent: false,
            holes: false,
            mips: false,
        }
    }
}
