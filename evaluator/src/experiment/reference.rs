//! The path-traced reference: traced through the cache, with progress, and as images.

use std::{ops::Range, time::Duration};

use halflight_native::{
    NativeGpu,
    cache::Cache,
    images::{Image, Rgb},
    truth::{Sampled, Traced, TruthSource},
};
use halflight_renderer::truth::{Progress as TraceProgress, Request, Stop, Truth, TruthError};
use halflight_scenes::Scene;

use crate::{Error, progress::Progress};

/// Bounces of a reference with all light: further ones bring less than its noise.
pub const ALL_BOUNCES: u32 = 12;

/// Traces a request of a scene, or takes it from the cache.
///
/// # Errors
/// A request out of range, or a device that was lost.
pub fn trace(native: &NativeGpu, scene: &Scene, request: &Request, stop: Stop) -> Result<Traced, Error> {
    let source = TruthSource::new(&native.gpu, scene, Some(Cache::standard()));
    with_progress(scene, |progress| {
        let traced = source.trace(request, stop, progress)?;
        let reached = traced
            .rel_error
            .map_or("relative error unknown".into(), |error| format!("relative error {}", significant(error)));
        let done = Done { samples: traced.truth.samples, traced: traced.traced, more: format!(", {reached}") };
        Ok((traced, done))
    })
}

/// Traces some samples of a request, to be merged with the others.
///
/// # Errors
/// As [`trace`], and a range of samples that does not begin with a part.
pub fn trace_range(native: &NativeGpu, scene: &Scene, request: &Request, range: Range<u32>) -> Result<Sampled, Error> {
    let source = TruthSource::new(&native.gpu, scene, Some(Cache::standard()));
    with_progress(scene, |progress| {
        let sampled = source.trace_range(request, range, progress)?;
        let done = Done { samples: sampled.sums.samples(), traced: sampled.traced, more: String::new() };
        Ok((sampled, done))
    })
}

/// What a trace ends with.
struct Done {
    samples: u32,
    traced: (u64, Duration),
    more: String,
}

/// Runs a trace with a line of progress.
fn with_progress<T>(
    scene: &Scene,
    trace: impl FnOnce(&mut dyn FnMut(&TraceProgress)) -> Result<(T, Done), TruthError>,
) -> Result<T, Error> {
    let progress = Progress::new(&format!("reference of {}", scene.name), 100);
    let mut set = |now: &TraceProgress| {
        progress.set((now.fraction * 100.0) as u64, &format!("{} samples a pixel", now.samples));
    };
    let (traced, Done { samples, traced: (rays, time), more }) =
        trace(&mut set).map_err(|e| Error::BadInput(e.to_string()))?;
    let from = if rays > 0 {
        let rate = rays as f64 / time.as_secs_f64().max(1e-9) / 1e6;
        format!("in {:.0} s, {rate:.2} million rays a second", time.as_secs_f64())
    } else {
        "from the cache".into()
    };
    progress.finish(&format!("reference of {}: {samples} samples a pixel {from}{more}", scene.name));
    Ok(traced)
}

/// Two significant digits: a small error is never shown as 0.
fn significant(error: f64) -> String {
    let digits = if error > 0.0 { (1.0 - error.log10().floor()).clamp(0.0, 9.0) as usize } else { 0 };
    format!("{error:.digits$}")
}

/// What to tell about a reference whose error is unknown.
pub fn unknown_error(scene: &str, samples: u32) -> String {
    format!(
        "the reference of {scene}: after {samples} samples a pixel too little light was found to tell its error; give it \
         more samples, or check that light reaches what the camera sees"
    )
}

/// `direct + transmitted + albedo * indirect + glossy` of the reference, for its bounces.
pub fn final_radiance(truth: &Truth) -> Vec<Rgb> {
    let zero = vec![[0.0; 3]; truth.direct.len()];
    let indirect = truth.indirect.as_ref().map_or(&zero, |estimate| &estimate.mean);
    let glossy = truth.glossy.as_ref().map_or(&zero, |estimate| &estimate.mean);
    let passed = truth.direct.iter().zip(&truth.transmitted);
    let lit = passed.zip(&truth.albedo).zip(indirect.iter().zip(glossy));
    lit.map(|(((direct, transmitted), albedo), (indirect, glossy))| {
        std::array::from_fn(|c| direct[c] + transmitted[c] + albedo[c] * indirect[c] + glossy[c])
    })
    .collect()
}

/// Everything that was traced, with the channel names of the interchange format.
pub fn image(truth: &Truth) -> Image {
    let [width, height] = truth.size;
    let mut image = Image::new(width, height);
    image.set_rgb("", &final_radiance(truth));
    image.set_channel("Z", truth.depth.clone());
    image.set_vector("N", &truth.normal);
    image.set_vector("P", &truth.position);
    image.set_rgb("albedo", &truth.albedo);
    image.set_rgb("direct", &truth.direct);
    if truth.transmitted.iter().flatten().any(|&light| light > 0.0) {
        image.set_rgb("transmitted", &truth.transmitted);
    }
    for (layer, estimate) in [
        ("bounce1", &truth.bounce1),
        ("indirect", &truth.indirect),
        ("on_screen", &truth.on_screen),
        ("glossy", &truth.glossy),
    ] {
        if let Some(estimate) = estimate {
            image.set_rgb(layer, &estimate.mean);
        }
    }
    if let Some(estimate) = &truth.indirect {
        let variance: Vec<Rgb> = estimate.standard_error.iter().map(|e| e.map(|v| v * v)).collect();
        image.set_rgb("variance", &variance);
    }
    if let Some(estimate) = &truth.ambient_occlusion {
        image.set_channel("ambient_occlusion.Y", estimate.mean.clone());
    }
    image
}
