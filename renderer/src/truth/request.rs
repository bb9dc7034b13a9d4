//! What to trace, and for how long.

use halflight_scenes::Camera;
use serde::{Deserialize, Serialize};

use halflight_shared_shaders::truth::path_trace;

use super::TruthError;

/// What is asked of the path tracer. Depth, normal, albedo, position and `direct` always come along: they cost one ray
/// a pixel and one a light.
#[derive(Clone, Debug, PartialEq)]
pub struct Request {
    /// Camera; primary rays pass through pixel centres.
    pub camera: Camera,
    /// Width and height, pixels, each 1..=65535.
    pub size: [u32; 2],
    /// Whether the first bounce is kept apart.
    pub bounce1: bool,
    /// Bounces of `indirect`, 0..=64; 0 for no indirect light.
    pub bounces: u32,
    /// Whether the part of the first bounce that comes from surfaces on screen is kept apart.
    pub on_screen: bool,
    /// Whether glossy light is traced: what glossy first hits send on to the eye of directly lit, diffuse surfaces.
    pub glossy: bool,
    /// Radius of the ambient occlusion, scene units; 0 for unlimited; `None` for no occlusion.
    pub ambient_occlusion: Option<f32>,
    /// Seed of every random number: the same seed gives the same sums, bit for bit, on the same adapter.
    pub seed: u32,
}

/// When to stop: at the number of samples, or before it at a relative error.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stop {
    /// Most samples a pixel, at least 1.
    pub samples_per_pixel: u32,
    /// Relative error to reach, over blocks of `error_block` pixels: see [`super::Truth::rel_error`].
    pub rel_error: Option<f32>,
    /// Edge of the blocks over which pixels are averaged before their error is judged, pixels; 1 for single pixels.
    pub error_block: u32,
}

impl Default for Stop {
    fn default() -> Self {
        Self { samples_per_pixel: 256, rel_error: None, error_block: 1 }
    }
}

impl Stop {
    /// Stops after this many samples a pixel.
    pub fn at_samples(samples_per_pixel: u32) -> Self {
        Self { samples_per_pixel, ..Self::default() }
    }

    /// Stops at this relative error of single pixels, or after 65536 samples a pixel.
    pub fn at_rel_error(rel_error: f32) -> Self {
        Self { samples_per_pixel: 1 << 16, rel_error: Some(rel_error), error_block: 1 }
    }
}

impl Request {
    /// Only what the eye sees and its direct light; switch on the rest.
    pub fn new(camera: Camera, size: [u32; 2]) -> Self {
        Self {
            camera,
            size,
            bounce1: false,
            bounces: 0,
            on_screen: false,
            glossy: false,
            ambient_occlusion: None,
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

/// Where the sums of each output start in a pixel's words: twin of the overrides of `truth/path_trace.wgsl`.
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

    /// Constants of the pipeline, for a scene that needs nothing special. Where `bounce1` shares its words with
    /// `indirect`, the shader writes them once.
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
            translucent: false,
            holes: false,
        }
    }
}
