//! The path-traced reference, traced in the background while the camera is still.

use std::time::Duration;

use halflight_frame_graph::Gpu;
use halflight_metrics::{LinearPair, block_rel_mse_with_floor, rel_mse_with_floor, relative_floor, relative_square};
use halflight_renderer::{
    scene::SceneBuffers,
    truth::{Reading, Request, Stop, Trace, Tracer, Truth, TruthError},
};
use halflight_scenes::{Camera, Light};
use wgpu::util::DeviceExt;

use crate::{show::ReferenceTextures, stage::Stage, timing::Work};

/// Samples per pixel after which the tracer stops.
const MOST_SAMPLES: u32 = 4096;

/// Batches between two passes of the interface on a software adapter, where painting takes as long as one batch.
const SOFTWARE_BATCHES: u32 = 4;

/// relMSE of the reference's own noise above which errors are not recorded. A noisy reference has pixels that are too
/// dark, and relMSE divides by them, so it overestimates errors by more than its noise.
const MOST_NOISE: f64 = 0.05;

/// Batches on the device.
struct Batch {
    before: Work,
    after: Work,
    count: u32,
}

impl Batch {
    /// Time per batch, once all are complete.
    fn time(&self) -> Option<Duration> {
        Some(self.after.end()?.duration_since(self.before.end()?) / self.count)
    }
}

/// Whether the sums have to be read before the trace continues.
fn is_due(trace: &Trace, next_read: u32) -> bool {
    trace.is_between_passes() && trace.progress().samples >= next_read
}

/// What a reference shows.
#[derive(Clone, Debug, PartialEq)]
pub struct Subject {
    /// The camera.
    pub camera: Camera,
    /// The lights.
    pub lights: Vec<Light>,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Frame number of the scene.
    pub frame: u32,
}

/// The reference so far.
pub struct Reference {
    /// Pixels per row.
    pub width: u32,
    /// Samples per pixel.
    pub samples: u32,
    /// `albedo * indirect`.
    pub reflected: Vec<[f32; 3]>,
    /// Diffuse reflectance.
    pub albedo: Vec<[f32; 3]>,
    /// Pixels that show a surface.
    pub mask: Vec<bool>,
    /// The `0.01 m^2` of relMSE.
    pub floor: f64,
    /// The expected relMSE of a perfect image, caused by the noise of the reference; unknown after a single sample.
    pub noise: Option<f64>,
    /// The reference as textures on the device.
    pub textures: ReferenceTextures,
    /// Number of the reading, so that a new one is noticed.
    pub version: u64,
}

/// Traces the reference of a stage in the background.
#[derive(Default)]
pub struct ReferenceTracer {
    tracer: Option<Tracer>,
    subject: Option<Subject>,
    trace: Option<Trace>,
    batch: Option<Batch>,
    reading: Option<Reading>,
    next_read: u32,
    version: u64,
    /// The reference so far.
    pub found: Option<Reference>,
}

impl ReferenceTracer {
    /// Drops a reference that shows something else; true if there was one.
    pub fn reset_unless(&mut self, subject: &Subject) -> bool {
        let other = self.subject.as_ref().is_some_and(|current| current != subject);
        if other {
            // The BVH belongs to one frame of the animation.
            let same_geometry = self.subject.as_ref().is_some_and(|current| current.frame == subject.frame);
            let (tracer, version) = (self.tracer.take().filter(|_| same_geometry), self.version);
            *self = Self { tracer, version, ..Self::default() };
        }
        other
    }

    /// Continues the reference of this picture as far as the device is ready. Returns whether there is more to do. Does
    /// not wait for the device, but the first call for a scene blocks while it builds the BVH.
    ///
    /// # Errors
    /// If the scene or the picture is too large for the device.
    pub fn step(&mut self, gpu: &Gpu, stage: &Stage, subject: &Subject) -> Result<bool, TruthError> {
        if self.tracer.is_none() {
            self.tracer = Some(if stage.is_animated() {
                // A posed scene has no larger buffers than the stage's own, which fit.
                let posed = stage.scene.posed(subject.frame);
                Tracer::new(gpu, &posed, &SceneBuffers::new(gpu, &posed))?
            } else {
                Tracer::new(gpu, &stage.scene, &stage.buffers)?
            });
        }
        let request = Request { bounces: 1, ..Request::new(subject.camera, subject.size) };
        if self.trace.is_none() {
            let tracer = self
                .tracer
                .as_ref()
                .ok_or_else(|| TruthError("the scene has no path tracer; reload the page".into()))?;
            self.trace = Some(tracer.start(gpu, &request, Stop::at_samples(MOST_SAMPLES))?);
            (self.subject, self.next_read) = (Some(subject.clone()), 1);
        }
        let Some(trace) = &mut self.trace else { return Ok(false) };
        if let Some(batch) = &self.batch {
            let Some(time) = batch.time() else { return Ok(true) };
            trace.pace(time);
            self.batch = None;
        }
        if let Some(reading) = &self.reading {
            let Some(state) = reading.take() else { return Ok(true) };
            self.reading = None;
            self.version += 1;
            self.found = Some(Reference::new(gpu, &state.truth(&request), self.version));
        }
        // Noise halves with four times the samples, so a reading at every doubling is enough.
        if is_due(trace, self.next_read) {
            self.next_read = trace.progress().samples * 2;
            self.reading = Some(trace.read(gpu));
            return Ok(true);
        }
        if trace.is_finished() {
            return Ok(false);
        }
        // Work submitted earlier, such as the painting of the interface, is not part of the batch's time.
        let before = Work::submit(&gpu.queue, None);
        let most = if stage.software { SOFTWARE_BATCHES } else { 1 };
        let count = (0..most).take_while(|_| !is_due(trace, self.next_read) && trace.submit(gpu)).count() as u32;
        if count > 0 {
            self.batch = Some(Batch { before, after: Work::submit(&gpu.queue, None), count });
        }
        Ok(true)
    }
}

impl Reference {
    fn new(gpu: &Gpu, truth: &Truth, version: u64) -> Self {
        let mask: Vec<bool> = truth.depth.iter().map(|&depth| depth > 0.0).collect();
        let pixels = mask.len();
        let black = vec![[0.0; 3]; pixels];
        let (mean, error) = match &truth.indirect {
            Some(light) => (&light.mean, &light.standard_error),
            None => (&black, &black),
        };
        let times = |a: [f32; 3], b: [f32; 3]| [a[0] * b[0], a[1] * b[1], a[2] * b[2]];
        let reflected: Vec<_> = mean.iter().zip(&truth.albedo).map(|(&light, &albedo)| times(light, albedo)).collect();
        let counted = || (0..pixels).filter(|&i| mask[i]);
        let count = (3 * counted().count()).max(1) as f64;
        let sum: f64 = counted().flat_map(|i| reflected[i]).map(f64::from).sum();
        let floor = relative_floor(sum / count);
        // The expected relMSE of a perfect image: the variance of the reference instead of the squared difference.
        let variance: f64 = counted()
            .flat_map(|i| {
                let sigma = times(error[i], truth.albedo[i]);
                (0..3).map(move |c| (i, c, f64::from(sigma[c])))
            })
            .map(|(i, c, sigma)| {
                let t = f64::from(reflected[i][c]);
                relative_square(t + sigma, t, floor)
            })
            .sum();
        let texture = |texel: &dyn Fn(usize) -> [f32; 4]| {
            let texels: Vec<_> = (0..pixels).map(texel).collect();
            let descriptor = wgpu::TextureDescriptor {
                label: Some("reference"),
                size: wgpu::Extent3d { width: truth.size[0], height: truth.size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba32Float,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            };
            let order = wgpu::util::TextureDataOrder::LayerMajor;
            gpu.device.create_texture_with_data(&gpu.queue, &descriptor, order, bytemuck::cast_slice(&texels))
        };
        let textures = ReferenceTextures {
            reflected: texture(&|i| {
                let [r, g, b] = reflected[i];
                [r, g, b, f32::from(u8::from(mask[i]))]
            }),
            picture: texture(&|i| {
                let (direct, passed, light) = (truth.direct[i], truth.transmitted[i], reflected[i]);
                let [r, g, b] = std::array::from_fn(|c| direct[c] + passed[c] + light[c]);
                [r, g, b, 1.0]
            }),
            relative_floor: floor as f32,
        };
        Self {
            width: truth.size[0],
            samples: truth.samples,
            noise: (truth.samples > 1).then_some(variance / count),
            albedo: truth.albedo.clone(),
            reflected,
            mask,
            floor,
            textures,
            version,
        }
    }

    /// Whether its noise is low enough to compare errors.
    pub fn is_settled(&self) -> bool {
        self.noise.is_some_and(|noise| noise <= MOST_NOISE)
    }

    /// relMSE of `albedo * indirect` for this incident indirect light: over pixels, and over blocks of 4x4 pixels.
    pub fn rel_mse(&self, light: &[[f32; 3]]) -> [f64; 2] {
        let image: Vec<_> =
            light.iter().zip(&self.albedo).map(|(l, a)| [l[0] * a[0], l[1] * a[1], l[2] * a[2]]).collect();
        let pair = LinearPair::new(&image, &self.reflected, Some(&self.mask));
        [rel_mse_with_floor(&pair, self.floor), block_rel_mse_with_floor(&pair, self.width, self.floor)]
    }
}
