//! The sums read back, and the images made from them.

use bytemuck::{Pod, Zeroable};

use super::{Request, TruthError, request::Layout};

/// Twin of `PrimarySurface` in `truth/path_trace.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub(super) struct PrimarySurface {
    position: [f32; 3],
    depth: f32,
    normal: [f32; 3],
    geometric_normal: u32,
    albedo: [f32; 3],
    rays: u32,
    direct: [f32; 3],
    material: u32,
    transmitted: [f32; 3],
    unused: u32,
}

/// All sums of a trace so far. They can be stored ([`State::to_bytes`]) and continued ([`super::Trace::restore`]).
#[derive(Clone, Debug, PartialEq)]
pub struct State {
    pub(super) samples: u32,
    /// The power of two by which radiance was multiplied.
    pub(super) scale: f32,
    pub(super) surfaces: Vec<PrimarySurface>,
    pub(super) sums: Vec<f32>,
}

/// A mean image and its standard error (the standard deviation of the mean over repeated traces).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimate<T> {
    /// One value per pixel, rows from the top.
    pub mean: Vec<T>,
    /// Standard error of each value. After a single sample it is unknown and equals the mean.
    pub standard_error: Vec<T>,
}

/// The reference: images, rows from the top, linear float32. Pixels without a surface are zero.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Truth {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Samples per pixel.
    pub samples: u32,
    /// Rays traced, shadow rays included.
    pub rays: u64,
    /// Planar view depth, scene units; 0 without a surface.
    pub depth: Vec<f32>,
    /// World position.
    pub position: Vec<[f32; 3]>,
    /// Unit shading normal, world space, facing the eye.
    pub normal: Vec<[f32; 3]>,
    /// Diffuse reflectance.
    pub albedo: Vec<[f32; 3]>,
    /// Radiance after direct lighting, emission included. Its standard error is 0, because pixel centres and delta
    /// lights are deterministic.
    pub direct: Vec<[f32; 3]>,
    /// Radiance of directly lit far sides that passes through translucent surfaces. Its standard error is 0.
    pub transmitted: Vec<[f32; 3]>,
    /// First bounce, incident (albedo not included).
    pub bounce1: Option<Estimate<[f32; 3]>>,
    /// Sum of the requested number of bounces, incident (albedo not included).
    pub indirect: Option<Estimate<[f32; 3]>>,
    /// The part of the first bounce whose source the eye sees, inside the image and on the side that sends the light.
    pub on_screen: Option<Estimate<[f32; 3]>>,
    /// Radiance that mirror lobes (Ks, Ns) send to the eye, Ks included, from other surfaces after direct light.
    pub glossy: Option<Estimate<[f32; 3]>>,
    /// Ambient visibility, cosine-weighted, 0..1: 1 = open.
    pub ambient_occlusion: Option<Estimate<f32>>,
}

/// Samples that must have found light, all pixels together, before the error of an image is known: their effective
/// number (Kish 1965), so that a few bright ones do not hide that the rest is missing. The relative error of an error
/// that comes from 64 findings is about an eighth.
pub const FEWEST_FINDINGS: f64 = 64.0;

const MAGIC: [u8; 8] = *b"HLTRUTH2";

impl State {
    /// Samples per pixel.
    pub fn samples(&self) -> u32 {
        self.samples
    }

    /// The state in bytes, little-endian. It does not contain the request: store it with its [`Request`].
    pub fn to_bytes(&self) -> Vec<u8> {
        let counts = [self.samples, self.scale.to_bits(), self.surfaces.len() as u32, self.sums.len() as u32];
        [&MAGIC, bytemuck::cast_slice(&counts), bytemuck::cast_slice(&self.surfaces), bytemuck::cast_slice(&self.sums)]
            .concat()
    }

    /// Parses a state.
    ///
    /// # Errors
    /// If the bytes are not a state of this request.
    pub fn from_bytes(bytes: &[u8], request: &Request) -> Result<Self, TruthError> {
        let pixels = request.size[0] as usize * request.size[1] as usize;
        let words = pixels * Layout::new(request).words as usize;
        let read = || {
            let (counts, rest) = bytes.strip_prefix(&MAGIC)?.split_at_checked(16)?;
            let counts: [u32; 4] = bytemuck::pod_read_unaligned(counts);
            let (surfaces, sums) = rest.split_at_checked(pixels * size_of::<PrimarySurface>())?;
            (counts[2..] == [pixels as u32, words as u32] && sums.len() == words * 4).then(|| Self {
                samples: counts[0],
                scale: f32::from_bits(counts[1]),
                surfaces: bytemuck::pod_collect_to_vec(surfaces),
                sums: bytemuck::pod_collect_to_vec(sums),
            })
        };
        read().ok_or_else(|| TruthError("stored truth is damaged or belongs to another request; delete it".into()))
    }

    /// The images. `request` is that of the trace.
    pub fn truth(&self, request: &Request) -> Truth {
        let words = Layout::new(request).words as usize;
        truth_of(request, self.samples, self.scale, &self.surfaces, |index| self.sum(index, words))
    }

    /// A sum by its index. A pixel has this many `words`, and the first one counts rays.
    pub(super) fn sum(&self, index: usize, words: usize) -> f64 {
        let sum = self.sums[index];
        if index.is_multiple_of(words) { f64::from(sum.to_bits()) } else { f64::from(sum) }
    }
}

/// The images of sums over `samples`; `sum` gives a sum by its index.
pub(super) fn truth_of(
    request: &Request,
    samples: u32,
    scale: f32,
    surfaces: &[PrimarySurface],
    sum: impl Fn(usize) -> f64,
) -> Truth {
    let layout = Layout::new(request);
    let words = layout.words as usize;
    let count = f64::from(samples.max(1));
    let unscaled = |radiance: [f32; 3]| radiance.map(|v| clamp(f64::from(v) / f64::from(scale)));
    let pixels = || (0..surfaces.len()).map(|pixel| pixel * words);
    let radiance = |at: u32| {
        let values = pixels().map(|pixel| {
            let channels: [_; 3] = std::array::from_fn(|c| {
                let at = pixel + at as usize + c;
                mean_and_error(sum(at), sum(at + 3), count, f64::from(scale))
            });
            (channels.map(|c| c.0), channels.map(|c| c.1))
        });
        let (mean, standard_error) = values.unzip();
        Estimate { mean, standard_error }
    };
    let occlusion = |at: u32| {
        // Every sample is 0 or 1, so it equals its square.
        let values = pixels().map(|pixel| {
            let open = sum(pixel + at as usize);
            mean_and_error(open, open, count, 1.0)
        });
        let (mean, standard_error) = values.unzip();
        Estimate { mean, standard_error }
    };
    Truth {
        size: request.size,
        samples,
        rays: surfaces.iter().map(|s| u64::from(s.rays)).sum::<u64>()
            + pixels().map(|pixel| sum(pixel) as u64).sum::<u64>(),
        depth: surfaces.iter().map(|s| s.depth).collect(),
        position: surfaces.iter().map(|s| s.position).collect(),
        normal: surfaces.iter().map(|s| s.normal).collect(),
        albedo: surfaces.iter().map(|s| s.albedo).collect(),
        direct: surfaces.iter().map(|s| unscaled(s.direct)).collect(),
        transmitted: surfaces.iter().map(|s| unscaled(s.transmitted)).collect(),
        bounce1: layout.bounce1.map(radiance),
        indirect: layout.indirect.map(radiance),
        on_screen: layout.on_screen.map(radiance),
        glossy: layout.glossy.map(radiance),
        ambient_occlusion: layout.occlusion.map(occlusion),
    }
}

/// Mean and standard error of `count` samples from their sum and the sum of their squares, both scaled.
fn mean_and_error(sum: f64, squares: f64, count: f64, scale: f64) -> (f32, f32) {
    let mean = sum / count;
    let variance = if count > 1.0 { (squares / count - mean * mean).max(0.0) / (count - 1.0) } else { mean * mean };
    (clamp(mean / scale), clamp(variance.sqrt() / scale))
}

fn clamp(value: f64) -> f32 {
    value.min(f64::from(f32::MAX)) as f32
}

impl Truth {
    /// The relative error: the root mean square, over pixels with a surface and over channels, of the standard error of
    /// `albedo * indirect`, divided by the image's mean. With `block > 1` the image is first averaged over blocks of
    /// `block * block` pixels, whose errors are independent. Without indirect light it is that of `albedo * bounce1`,
    /// `albedo * on_screen`, `glossy` or the ambient visibility, whichever comes first. It is 0 if nothing is random.
    ///
    /// `None` if too few samples found light ([`FEWEST_FINDINGS`]): the image may then miss most of the light, and its
    /// standard error with it.
    pub fn rel_error(&self, block: u32) -> Option<f64> {
        let light = self.indirect.as_ref().or(self.bounce1.as_ref()).or(self.on_screen.as_ref());
        let pixel = |index: usize| -> ([f64; 3], [f64; 3]) {
            match (light, &self.glossy, &self.ambient_occlusion) {
                (Some(light), ..) => {
                    let times = |value: [f32; 3]| {
                        std::array::from_fn(|c| f64::from(value[c]) * f64::from(self.albedo[index][c]))
                    };
                    (times(light.mean[index]), times(light.standard_error[index]))
                }
                (None, Some(light), _) => {
                    (light.mean[index].map(f64::from), light.standard_error[index].map(f64::from))
                }
                (None, None, Some(open)) => {
                    ([f64::from(open.mean[index]); 3], [f64::from(open.standard_error[index]); 3])
                }
                (None, None, None) => ([0.0; 3], [0.0; 3]),
            }
        };
        let [width, height] = self.size.map(|v| v as usize);
        let block = block.max(1) as usize;
        let (mut mean, mut square, mut blocks) = (0.0, 0.0, 0.0);
        // Sums of the samples of all pixels, and of their squares, each over the number of samples.
        let (mut first, mut second) = (0.0, 0.0);
        let more = f64::from(self.samples.max(1) - 1);
        for y in (0..height).step_by(block) {
            for x in (0..width).step_by(block) {
                let inside =
                    (y..(y + block).min(height)).flat_map(|y| (x..(x + block).min(width)).map(move |x| y * width + x));
                let (mut sum, mut variance, mut count) = (0.0, 0.0, 0.0);
                for index in inside.filter(|&index| self.depth[index] > 0.0) {
                    let (value, error) = pixel(index);
                    sum += value.iter().sum::<f64>() / 3.0;
                    let of_pixel = error.iter().map(|e| e * e).sum::<f64>() / 3.0;
                    variance += of_pixel;
                    second += of_pixel * more + value.iter().map(|v| v * v).sum::<f64>() / 3.0;
                    count += 1.0;
                }
                if count > 0.0 {
                    first += sum;
                    mean += sum / count;
                    square += variance / (count * count);
                    blocks += 1.0;
                }
            }
        }
        let relative = if mean > 0.0 { (square / blocks).sqrt() / (mean / blocks) } else { 0.0 };
        // Kish's effective number: that of equal samples with the same ratio of sum and squares.
        let findings = if second > 0.0 { f64::from(self.samples) * first * first / second } else { 0.0 };
        let is_light = light.is_some() || self.glossy.is_some();
        (!is_light || findings >= FEWEST_FINDINGS).then_some(relative)
    }
}
