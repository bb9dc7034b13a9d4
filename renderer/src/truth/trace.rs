//! A running trace.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    time::Duration,
};

use halflight_frame_graph::{Gpu, uniform};
use halflight_shared_shaders::{
    BindingKind, Call, EntryPoint,
    truth::path_trace::{self, PathTrace},
};

use super::{Request, State, Stop, Tracer, Truth, TruthError, request::Layout, state::PrimarySurface};
use crate::gi::TextureFilter;

/// Target time of one batch: short enough for a browser's watchdog and for a progress bar.
const BATCH: Duration = Duration::from_millis(100);
/// Samples of the first batches, before the device's speed is known: 8 x 8 blocks.
const FIRST_BATCH: u32 = 64;
/// Largest number of samples per pixel in one batch.
const MAX_BATCH_SAMPLES: u32 = 64;
/// An unlimited distance in the shader.
const FAR: f32 = 1e30;

/// A running trace. It holds what it needs of the [`Tracer`] and never blocks.
pub struct Trace {
    request: Request,
    stop: Stop,
    primary: Stage,
    paths: Stage,
    uniform: wgpu::Buffer,
    surfaces: wgpu::Buffer,
    sums: wgpu::Buffer,
    params: path_trace::Params,
    scale: f32,
    /// Number of the first sample.
    first: u32,
    /// Samples that every pixel has.
    samples: u32,
    /// Whether the primary rays are done.
    seen: bool,
    /// First block of the pass that is not done.
    next_block: u32,
    /// Samples per pixel of the pass.
    pass_samples: u32,
    /// Block samples per batch.
    batch: u32,
    /// Samples at which the error is estimated next.
    next_check: u32,
    rel_error: Option<f64>,
    /// Whether the scene has any light.
    lit: bool,
}

struct Stage {
    entry: &'static EntryPoint,
    pipeline: wgpu::ComputePipeline,
    bindings: wgpu::BindGroup,
}

/// Progress of a trace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Samples that every pixel has.
    pub samples: u32,
    /// Expected number of samples per pixel: the limit, or fewer if the error is reached earlier.
    pub expected_samples: u32,
    /// The last estimate of the relative error; `None` while it is unknown.
    pub rel_error: Option<f64>,
    /// Progress towards `expected_samples`, 0..1.
    pub fraction: f32,
}

impl Trace {
    pub(super) fn new(gpu: &Gpu, tracer: &Tracer, request: &Request, stop: Stop) -> Result<Self, TruthError> {
        request.check()?;
        if stop.samples_per_pixel == 0 {
            return Err(TruthError("the reference needs at least 1 sample per pixel".into()));
        }
        if stop.rel_error.is_some_and(|e| e.is_nan() || e <= 0.0) {
            return Err(TruthError("relative error: give a number above 0, for example 0.02".into()));
        }
        let layout = Layout::new(request);
        let pixels = u64::from(request.size[0]) * u64::from(request.size[1]);
        // Bytes of a pixel in the larger of the two buffers.
        let largest = (size_of::<PrimarySurface>() as u64).max(u64::from(layout.words) * 4);
        let buffer = |label, bytes: u64| {
            let limits = gpu.device.limits();
            let most = limits.max_storage_buffer_binding_size.min(limits.max_buffer_size);
            if bytes > most {
                let scale = (most as f64 / (pixels * largest) as f64).sqrt();
                let [w, h] = request.size;
                let [fits_w, fits_h] = request.size.map(|side| ((f64::from(side) * scale) as u32).max(1));
                return Err(TruthError(format!(
                    "truth of {w}x{h} pixels takes a buffer of {} MiB and the adapter allows {}: use at most \
                     {fits_w}x{fits_h} pixels",
                    bytes >> 20,
                    most >> 20
                )));
            }
            let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
            Ok(gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: bytes,
                usage,
                mapped_at_creation: false,
            }))
        };
        let surfaces = buffer("truth.surfaces", pixels * size_of::<PrimarySurface>() as u64)?;
        let sums = buffer("truth.sums", pixels * u64::from(layout.words) * 4)?;
        let uniform = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("truth.job"),
            size: 256,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let constants = path_trace::Constants {
            holes: tracer.has_holes,
            translucent: tracer.has_translucency,
            environment: tracer.has_environment,
            draw_emitters: tracer.emitter_count > 0,
            draw_sky: tracer.draws_sky,
            mips: request.texture_filter == TextureFilter::Mips,
            ..layout.constants(request.path_bounces())
        };
        let view = request.camera.view_matrix();
        let [width, height] = request.size;
        let radius = request.ambient_occlusion.filter(|&radius| radius > 0.0).unwrap_or(FAR);
        let params = path_trace::Params {
            world_to_view: view.to_cols_array_2d(),
            view_to_world: view.inverse().to_cols_array_2d(),
            tan_half_fov: request.camera.tan_half_fov(width, height),
            width,
            height,
            first_block: 0,
            block_count: 0,
            first_sample: 0,
            sample_count: 0,
            seed: request.seed,
            light_count: tracer.light_count,
            scene_radius: tracer.scene_radius,
            radiance_scale: tracer.radiance_scale,
            occlusion_radius: radius,
            emitter_count: tracer.emitter_count,
            emitter_density: tracer.emitter_density,
        };
        let call = Call::from(PathTrace {
            nodes: wgpu::BindingResource::TextureView(&tracer.nodes),
            triangles: wgpu::BindingResource::TextureView(&tracer.triangles),
            attributes: wgpu::BindingResource::TextureView(&tracer.attributes),
            materials: tracer.materials.as_entire_binding(),
            texels: wgpu::BindingResource::TextureView(&tracer.texels),
            lights: tracer.lights.as_entire_binding(),
            environment: tracer.environment.as_entire_binding(),
            emitters: wgpu::BindingResource::TextureView(&tracer.emitters),
            surfaces: surfaces.as_entire_binding(),
            sums: sums.as_entire_binding(),
            params,
            constants,
        });
        let stage = |name| Stage::new(gpu, &call, name, &uniform);
        let (primary, paths) = (stage("primary"), stage("paths"));
        let mut trace = Self {
            primary,
            paths,
            request: request.clone(),
            stop,
            uniform,
            surfaces,
            sums,
            params,
            scale: tracer.radiance_scale,
            first: 0,
            samples: 0,
            seen: false,
            next_block: 0,
            pass_samples: 1,
            batch: FIRST_BATCH,
            next_check: 0,
            rel_error: None,
            lit: tracer.lit,
        };
        trace.plan_check();
        Ok(trace)
    }

    /// Submits one batch of work. Returns false and submits nothing if the trace is finished or has to be read and
    /// judged first ([`Trace::wants_reading`]).
    pub fn submit(&mut self, gpu: &Gpu) -> bool {
        if self.is_finished() || self.wants_reading() {
            return false;
        }
        let blocks = self.request.size.iter().map(|v| v.div_ceil(8)).product::<u32>();
        if self.next_block == 0 && self.seen {
            self.pass_samples = (self.batch / blocks).clamp(1, MAX_BATCH_SAMPLES).min(self.next_check - self.samples);
        }
        let count = (self.batch / self.pass_samples).clamp(1, blocks - self.next_block);
        let stage = if self.seen { &self.paths } else { &self.primary };
        let params = path_trace::Params {
            first_block: self.next_block,
            block_count: count,
            first_sample: self.first + self.samples,
            sample_count: self.pass_samples,
            ..self.params
        };
        gpu.queue.write_buffer(&self.uniform, 0, &stage.pack(&params));
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&stage.pipeline);
            pass.set_bind_group(0, &stage.bindings, &[]);
            let across = count.min(1024);
            pass.dispatch_workgroups(across, count.div_ceil(across), 1);
        }
        gpu.queue.submit([encoder.finish()]);
        self.next_block += count;
        if self.next_block == blocks {
            self.next_block = 0;
            if self.seen {
                self.samples += self.pass_samples;
            }
            self.seen = true;
        }
        true
    }

    /// Starts again at another sample, with sums of nothing and another stop. What the eye sees is not traced again.
    ///
    /// # Panics
    /// In the middle of a pass.
    pub fn begin(&mut self, gpu: &Gpu, first_sample: u32, stop: Stop) {
        assert_eq!(self.next_block, 0, "parts begin between passes");
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(&self.sums, 0, None);
        gpu.queue.submit([encoder.finish()]);
        (self.first, self.samples, self.rel_error, self.stop) = (first_sample, 0, None, stop);
        self.plan_check();
    }

    /// Reports the time of the last batch, so that the next one takes about a tenth of a second.
    pub fn pace(&mut self, took: Duration) {
        let ratio = BATCH.as_secs_f64() / took.as_secs_f64().max(1e-4);
        // At most doubled: one quick batch (sky, for example) says little about the next.
        self.batch = (f64::from(self.batch) * ratio.clamp(0.1, 2.0)).clamp(1.0, 1e7) as u32;
    }

    /// Whether every pixel has the same number of samples, so that the sums can be read.
    pub fn is_between_passes(&self) -> bool {
        self.seen && self.next_block == 0
    }

    /// Whether the error has to be judged ([`Trace::read`], then [`Trace::judge`]) before the trace continues.
    pub fn wants_reading(&self) -> bool {
        self.is_between_passes() && self.samples >= self.next_check && !self.is_finished()
    }

    /// Whether the trace is finished.
    pub fn is_finished(&self) -> bool {
        let enough = self.stop.rel_error.zip(self.rel_error).is_some_and(|(target, e)| e <= f64::from(target));
        self.is_between_passes() && (!self.request.is_random() || self.samples >= self.stop.samples_per_pixel || enough)
    }

    /// Progress of the trace.
    pub fn progress(&self) -> Progress {
        let expected_samples =
            if self.request.is_random() { self.stop.expected_samples(self.samples, self.rel_error) } else { 0 };
        let fraction = match (self.is_finished(), expected_samples) {
            (true, _) => 1.0,
            (false, 0) => 0.0,
            (false, expected) => (self.samples as f32 / expected as f32).min(1.0),
        };
        Progress { samples: self.samples, expected_samples, rel_error: self.rel_error, fraction }
    }

    fn plan_check(&mut self) {
        self.next_check = self.stop.next_check(self.samples, self.rel_error);
    }

    /// Copies the sums for reading.
    ///
    /// # Panics
    /// In the middle of a pass: check [`Trace::is_between_passes`] first.
    pub fn read(&self, gpu: &Gpu) -> Reading {
        assert!(self.is_between_passes(), "sums are read between passes");
        Reading::new(gpu, self.samples, self.scale, [&self.surfaces, &self.sums])
    }

    /// Converts a reading to images, and uses their error to decide when to stop.
    pub fn judge(&mut self, state: &State) -> Truth {
        let truth = state.truth(&self.request);
        if self.stop.rel_error.is_some() && state.samples == self.samples && self.samples > 1 {
            self.rel_error = if self.lit { truth.rel_error(self.stop.error_block) } else { Some(0.0) };
        }
        self.plan_check();
        truth
    }

    /// Continues from a stored state of the same request and scene.
    pub fn restore(&mut self, gpu: &Gpu, state: &State) {
        gpu.queue.write_buffer(&self.surfaces, 0, bytemuck::cast_slice(&state.surfaces));
        gpu.queue.write_buffer(&self.sums, 0, bytemuck::cast_slice(&state.sums));
        (self.samples, self.seen, self.next_block, self.rel_error) = (state.samples, true, 0, None);
        self.judge(state);
    }
}

impl Stage {
    fn new(gpu: &Gpu, call: &Call<wgpu::BindingResource>, name: &str, uniform: &wgpu::Buffer) -> Self {
        let shader = call.shader;
        let entry = shader.entry_point(name).unwrap_or_else(|| panic!("{} has no entry point {name}", shader.name));
        let pipeline = gpu.compute_pipeline(shader, entry, &call.constants);
        let resource = |name: &str| {
            let given = call.bindings.iter().find(|(binding, _)| *binding == name);
            given.map_or_else(|| uniform.as_entire_binding(), |(_, resource)| resource.clone())
        };
        let entries: Vec<_> = entry
            .bindings
            .iter()
            .map(|binding| wgpu::BindGroupEntry { binding: binding.index, resource: resource(binding.name) })
            .collect();
        let bindings = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("truth"),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        Self { entry, pipeline, bindings }
    }

    fn pack(&self, params: &path_trace::Params) -> Vec<u8> {
        let values = params.values();
        let block = self.entry.bindings.iter().find_map(|binding| match binding.kind {
            BindingKind::Uniform { size, members } => Some(uniform::pack(size, members, &values, "truth")),
            _ => None,
        });
        block.unwrap_or_default()
    }
}

/// A pending reading of the sums.
pub struct Reading {
    samples: u32,
    scale: f32,
    staging: [wgpu::Buffer; 2],
    answers: Arc<Answers>,
}

/// The device's answers for the copies of a reading.
#[derive(Default)]
struct Answers {
    arrived: AtomicUsize,
    refused: AtomicBool,
}

impl Reading {
    fn new(gpu: &Gpu, samples: u32, scale: f32, sources: [&wgpu::Buffer; 2]) -> Self {
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let staging = sources.map(|source| {
            let copy = gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("truth.reading"),
                size: source.size(),
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            encoder.copy_buffer_to_buffer(source, 0, &copy, 0, source.size());
            copy
        });
        gpu.queue.submit([encoder.finish()]);
        let answers = Arc::new(Answers::default());
        for copy in &staging {
            let answers = answers.clone();
            copy.map_async(wgpu::MapMode::Read, .., move |result| match result {
                Ok(()) => drop(answers.arrived.fetch_add(1, Ordering::Release)),
                Err(_) => answers.refused.store(true, Ordering::Release),
            });
        }
        Self { samples, scale, staging, answers }
    }

    /// Whether the sums will never arrive, because the device was lost.
    pub fn is_lost(&self) -> bool {
        self.answers.refused.load(Ordering::Acquire)
    }

    /// The sums, once they have arrived. Poll the device (`wgpu::Device::poll`) or, in a browser, return to the event
    /// loop, and call again. If several threads poll, a finished poll of one thread may be delivered by another one
    /// later. A lost device never delivers ([`Self::is_lost`]).
    pub fn take(&self) -> Option<State> {
        if self.answers.arrived.load(Ordering::Acquire) < self.staging.len() {
            return None;
        }
        // If the device was lost meanwhile, the mapped memory is gone.
        let range = |copy: &wgpu::Buffer| {
            copy.get_mapped_range(..).inspect_err(|_| self.answers.refused.store(true, Ordering::Release)).ok()
        };
        let [surfaces, sums] = &self.staging;
        Some(State {
            samples: self.samples,
            scale: self.scale,
            surfaces: bytemuck::pod_collect_to_vec(&range(surfaces)?),
            sums: bytemuck::pod_collect_to_vec(&range(sums)?),
        })
    }
}
