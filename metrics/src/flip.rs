//! FLIP and HDR-FLIP through NVIDIA's own code (`nv-flip`).

use std::thread;

use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8};

use crate::{
    DisplayPair, Rgb, counted, masked_mean, percentile,
    tone::{luminance, srgb_encode},
};

/// Mean FLIP of display values, 0..1; 0 for equal images.
pub fn flip(pair: &DisplayPair) -> f64 {
    let [shown, shown_reference] = pair.display;
    masked_mean(&flip_map(shown, shown_reference, pair.width), pair.mask)
}

/// Mean HDR-FLIP of linear radiance, 0..1; 0 for equal images.
pub fn hdr_flip(pair: &DisplayPair) -> f64 {
    let [image, reference] = pair.linear;
    masked_mean(&hdr_flip_map(image, reference, pair.width, pair.mask), pair.mask)
}

/// FLIP error per pixel, 0..1, of display values (Andersson et al. 2020), seen from the authors' default distance of
/// 67 pixels per degree. The binding takes 8 bits a channel, which is what a display gets.
pub fn flip_map(shown: &[Rgb], shown_reference: &[Rgb], width: u32) -> Vec<f32> {
    let height = shown.len() as u32 / width.max(1);
    let image = |pixels: &[Rgb]| {
        let bytes: Vec<u8> =
            pixels.iter().flatten().map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8).collect();
        FlipImageRgb8::with_data(width, height, &bytes)
    };
    nv_flip::flip(image(shown_reference), image(shown), DEFAULT_PIXELS_PER_DEGREE).to_vec()
}

/// The exposures that HDR-FLIP looks through, in stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposures {
    /// Darkest: the reference's brightest pixel just clips.
    pub start: f64,
    /// Brightest: the reference's median pixel just clips.
    pub stop: f64,
    /// How many, evenly spaced, ends included.
    pub count: u32,
}

impl Exposures {
    fn stops(self) -> Vec<f64> {
        let step = (self.stop - self.start) / f64::from(self.count - 1);
        (0..self.count).map(|index| self.start + f64::from(index) * step).collect()
    }
}

/// Coefficients of the tone mapper that the authors' program uses by default, ACES as fitted by Narkowicz with the
/// exposure of 0.6 undone: `(a x^2 + b x) / (c x^2 + d x + e)`.
const ACES: [f64; 5] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];
/// The tone-mapped luminance that counts as "just clips" (the paper's t).
const CLIP: f64 = 0.85;
/// The median is taken to be at most this many stops under the maximum: beyond, a mostly black reference would ask for
/// any number of exposures, and a wholly black one for infinitely many.
const MOST_STOPS: f64 = 16.0;

/// The exposures for a reference, chosen as the authors' program does (Andersson et al. 2021): from where its
/// maximum luminance maps to 0.85 to where its median does, one a stop, at least two.
pub fn hdr_exposures(reference: &[Rgb], mask: Option<&[bool]>) -> Exposures {
    let [a, b, c, d, e] = ACES;
    let (a, b, c) = (a - CLIP * c, b - CLIP * d, -CLIP * e);
    let clips_at = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);

    let mut luminances: Vec<f64> = counted(reference, mask).map(|&pixel| f64::from(luminance(pixel))).collect();
    let highest = luminances.iter().copied().filter(|value| value.is_finite()).fold(0.0, f64::max);
    if highest <= 0.0 {
        return Exposures { start: 0.0, stop: 0.0, count: 2 };
    }
    let median = percentile(&mut luminances, 0.5).max(highest * (-MOST_STOPS).exp2());
    let (start, stop) = ((clips_at / highest).log2(), (clips_at / median).log2());
    Exposures { start, stop, count: (stop - start).ceil().max(2.0) as u32 }
}

/// HDR-FLIP error per pixel, 0..1, of linear radiance: the largest FLIP over the exposures of [`hdr_exposures`]
/// (Andersson et al. 2021). The binding has only the LDR measure; the loop around it is the paper's. Runs one exposure
/// per processor at a time.
pub fn hdr_flip_map(image: &[Rgb], reference: &[Rgb], width: u32, mask: Option<&[bool]>) -> Vec<f32> {
    let stops = hdr_exposures(reference, mask).stops();
    let workers = thread::available_parallelism().map_or(1, usize::from).min(stops.len());
    let worst_of = |stops: &[f64]| {
        stops.iter().fold(vec![0.0f32; image.len()], |mut worst, &stop| {
            let map = flip_map(&aces(image, stop), &aces(reference, stop), width);
            worst.iter_mut().zip(map).for_each(|(worst, error)| *worst = worst.max(error));
            worst
        })
    };
    thread::scope(|scope| {
        let running: Vec<_> =
            stops.chunks(stops.len().div_ceil(workers)).map(|stops| scope.spawn(|| worst_of(stops))).collect();
        running.into_iter().fold(vec![0.0; image.len()], |mut worst, one| {
            let map = one.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
            worst.iter_mut().zip(map).for_each(|(worst, error)| *worst = f32::max(*worst, error));
            worst
        })
    })
}

/// Display values of linear radiance under an exposure in stops, through [`ACES`], clipped to 0..1.
fn aces(pixels: &[Rgb], stop: f64) -> Vec<Rgb> {
    let [a, b, c, d, e] = ACES.map(|coefficient| coefficient as f32);
    let exposure = stop.exp2() as f32;
    let curve = |value: f32| {
        let x = (value * exposure).max(0.0);
        // Large x would overflow to infinity over infinity; the limit a / c is above 1 already.
        if x > 1e9 { 1.0 } else { ((a * x + b) * x / ((c * x + d) * x + e)).min(1.0) }
    };
    pixels.iter().map(|pixel| pixel.map(|value| srgb_encode(curve(value)))).collect()
}
