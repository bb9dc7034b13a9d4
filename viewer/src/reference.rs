//! The path-traced reference, traced in the background while the camera is still.

use std::time::Duration;

use halflight_frame_graph::Gpu;
use halflight_metrics::{Rgb, mean, relative_floor};
use halflight_renderer::truth::{Reading, Request, Stop, Trace, Tracer, Truth, TruthError};
use halflight_scenes::{Camera, Light};
use wgpu::util::DeviceExt;

use crate::{
    error::{Errors, Estimate, Halves, Metric},
    show::ReferenceTextures,
    stage::Stage,
    timing::Work,
};

/// Samples per pixel after which the tracer stops.
pub const MOST_SAMPLES: u32 = 4096;

/// Bounces of a reference for techniques that compute all of them: later ones add less than a hundredth in closed rooms of
/// an albedo of one half.
pub const ALL_BOUNCES: u32 = 8;

/// Width of the blocks of pixels over which it is checked that enough light was found.
const FOUND_BLOCK: u32 = 4;

/// Batches between two passes of the interface on a software adapter, where painting takes as long as one batch.
const SOFTWARE_BATCHES: u32 = 4;

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
    /// Bounces of indirect light.
    pub bounces: u32,
}

/// The reference so far.
pub struct Reference {
    /// Pixels per row.
    pub width: u32,
    /// Samples per pixel.
    pub samples: u32,
    /// `albedo * indirect`.
    reflected: Vec<Rgb>,
    /// Diffuse reflectance.
    albedo: Vec<Rgb>,
    /// Pixels that show a surface.
    pub mask: Vec<bool>,
    /// The picture of this reading and of the one before, radiance.
    pub pictures: [Vec<Rgb>; 2],
    /// Two independent halves of the samples: of the reading before, if it had them, and of this one.
    halves: Vec<Halves>,
    /// Whether enough samples have found light to trust its noise.
    pub lit: bool,
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
    /// Whether it is being traced.
    pub fn has_begun(&self) -> bool {
        self.trace.is_some()
    }

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

    /// Continues the reference of this picture as far as the device and the BVH are ready. Returns whether there is more to
    /// do.
    ///
    /// # Errors
    /// If the scene or the picture is too large for the device.
    pub fn step(&mut self, gpu: &Gpu, stage: &Stage, subject: &Subject) -> Result<bool, TruthError> {
        if self.tracer.is_none() {
            stage.has_bvh().map_err(|error| error.clone())?;
            let Some((scene, buffers)) = stage.traceable(subject.frame) else { return Ok(true) };
            self.tracer = Some(Tracer::new(gpu, scene, buffers)?);
        }
        let texture_filter = stage.texture_filter();
        let request =
            Request { bounces: subject.bounces, texture_filter, ..Request::new(subject.camera, subject.size) };
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
            self.found = Some(Reference::new(gpu, &state.truth(&request), self.version, self.found.take()));
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
    /// `before`: the reading before this one.
    fn new(gpu: &Gpu, truth: &Truth, version: u64, before: Option<Self>) -> Self {
        let mask: Vec<bool> = truth.depth.iter().map(|&depth| depth > 0.0).collect();
        let pixels = mask.len();
        let black = vec![[0.0; 3]; pixels];
        let light = truth.indirect.as_ref().map_or(&black, |light| &light.mean);
        let times = |a: Rgb, b: Rgb| [a[0] * b[0], a[1] * b[1], a[2] * b[2]];
        let reflected: Vec<_> = light.iter().zip(&truth.albedo).map(|(&light, &albedo)| times(light, albedo)).collect();
        let floor = if mask.contains(&true) { relative_floor(mean(&reflected, Some(&mask))) } else { 0.0 };
        let picture: Vec<Rgb> = (0..pixels)
            .map(|i| std::array::from_fn(|c| truth.direct[i][c] + truth.transmitted[i][c] + reflected[i][c]))
            .collect();
        let earlier = before.as_ref().map_or_else(Vec::new, |old| old.pictures[0].clone());
        let halves = before.map_or_else(Vec::new, |mut old| {
            let latest = Halves::new(&old.reflected, old.samples, &reflected, truth.samples);
            old.halves.pop().into_iter().chain(latest).collect()
        });
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
                let [r, g, b] = picture[i];
                [r, g, b, 1.0]
            }),
            relative_floor: floor as f32,
        };
        Self {
            width: truth.size[0],
            samples: truth.samples,
            lit: truth.rel_error(FOUND_BLOCK).is_some(),
            albedo: truth.albedo.clone(),
            reflected,
            mask,
            pictures: [picture, earlier],
            halves,
            textures,
            version,
        }
    }

    /// Updates the errors of `albedo * indirect` for this incident indirect light.
    pub fn compare(&self, light: &[Rgb], errors: &mut Errors) {
        let Some(picture) = self.reflected(light) else { return };
        let of = |halves: &Halves| halves.errors(&picture, self.width, &self.mask);
        match self.halves.as_slice() {
            [.., before, latest] => errors.update(Some(of(before)), of(latest), self.lit),
            [latest] => errors.update(None, of(latest), self.lit),
            [] => {}
        }
    }

    /// Whether any pixel shows a surface.
    pub fn has_surfaces(&self) -> bool {
        self.mask.contains(&true)
    }

    /// The estimate of the error of this incident indirect light, however large the noise of the reference is; `None` before
    /// the second reading.
    pub fn estimate(&self, light: &[Rgb], metric: Metric) -> Option<Estimate> {
        let index = metric.linear_index()?;
        let picture = self.reflected(light)?;
        Some(self.halves.last()?.errors(&picture, self.width, &self.mask)[index])
    }

    /// `albedo * indirect` of incident indirect light of the same size.
    fn reflected(&self, light: &[Rgb]) -> Option<Vec<Rgb>> {
        let times = |(l, a): (&Rgb, &Rgb)| [l[0] * a[0], l[1] * a[1], l[2] * a[2]];
        (light.len() == self.mask.len()).then(|| light.iter().zip(&self.albedo).map(times).collect())
    }

    /// `albedo * indirect` of a pixel, and its albedo; `None` outside of the picture or in the sky.
    pub fn pixel(&self, [x, y]: [u32; 2]) -> Option<(Rgb, Rgb)> {
        let index = (x < self.width).then_some(y as usize * self.width as usize + x as usize)?;
        let is_surface = *self.mask.get(index)?;
        is_surface.then(|| (self.reflected[index], self.albedo[index]))
    }
}
