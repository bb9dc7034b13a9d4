//! The path-traced reference on this computer. Traced samples are kept on disk, and a later call continues from them.

use std::{
    cell::OnceCell,
    time::{Duration, Instant},
};

use halflight_frame_graph::Gpu;
use halflight_renderer::{
    scene::{SceneBuffers, SceneSize},
    truth::{Progress, Request, State, Stop, Trace, Tracer, Truth, TruthError, is_lit},
};
use halflight_scenes::{Camera, Scene};

use crate::{
    cache::{Cache, Key, KeyInputs},
    scene_hash::scene_hash,
};

/// Time between two copies of an unfinished trace on disk.
const CHECKPOINT: Duration = Duration::from_secs(20);
/// Raised when stored sums change their meaning, or when the code that prepares the tracer's buffers changes its result.
const FORMAT: u32 = 3;

/// Traces one scene, through a cache where there is one. The BVH is built when the cache first lacks something.
pub struct TruthSource<'a> {
    gpu: &'a Gpu,
    scene: &'a Scene,
    cache: Option<Cache>,
    tracer: OnceCell<Tracer>,
    scene_hash: OnceCell<Key>,
}

/// Truth and where it came from.
#[derive(Clone, Debug)]
pub struct Traced {
    /// The images.
    pub truth: Truth,
    /// Relative error that was reached, over blocks of the request's `error_block`: [`Truth::rel_error`]. `None`
    /// if too few samples found light to tell.
    pub rel_error: Option<f64>,
    /// Hash of the scene, the request and the shader.
    pub inputs: Key,
    /// Samples a pixel that came from the cache.
    pub cached_samples: u32,
    /// Rays traced now and the time that took, on the wall; 0 rays where all came from the cache.
    pub traced: (u64, Duration),
    /// What went wrong with the cache, one sentence each.
    pub warnings: Vec<String>,
}

impl<'a> TruthSource<'a> {
    /// A source of references for this scene.
    pub fn new(gpu: &'a Gpu, scene: &'a Scene, cache: Option<Cache>) -> Self {
        Self { gpu, scene, cache, tracer: OnceCell::new(), scene_hash: OnceCell::new() }
    }

    /// Traces until the stop criterion holds. The cache may hold more samples than asked for; then they are all used.
    /// `progress` is called after every batch, about ten times a second.
    ///
    /// # Errors
    /// Where a value of the request is out of range, the scene or the image does not fit the device, or the device is
    /// lost. A cache that fails is a warning.
    pub fn trace(
        &self,
        request: &Request,
        stop: Stop,
        progress: &mut dyn FnMut(&Progress),
    ) -> Result<Traced, TruthError> {
        let inputs = self.key(request);
        let mut warnings = Vec::new();
        let stored = self.cache.as_ref().and_then(|cache| {
            let bytes = cache.load("truth", &inputs).unwrap_or_else(|warning| {
                warnings.push(warning);
                None
            })?;
            State::from_bytes(&bytes, request).map_err(|error| warnings.push(error.to_string())).ok()
        });
        let cached_samples = stored.as_ref().map_or(0, State::samples);
        if let Some(state) = &stored {
            let truth = state.truth(request);
            let rel_error = self.rel_error(&truth, stop);
            let precise = stop.rel_error.zip(rel_error).is_some_and(|(target, reached)| reached <= target.into());
            if cached_samples >= stop.samples_per_pixel || precise && cached_samples > 1 || !request.is_random() {
                return Ok(Traced { truth, rel_error, inputs, cached_samples, traced: (0, Duration::ZERO), warnings });
            }
        }
        let start = Instant::now();
        let mut trace = self.tracer()?.start(self.gpu, request, stop)?;
        let before = stored.as_ref().map_or(0, |state| state.truth(request).rays);
        if let Some(state) = &stored {
            trace.restore(self.gpu, state);
        }
        let mut save = |state: &State| {
            let Some(cache) = &self.cache else { return };
            if let Err(warning) = cache.store("truth", &inputs, &state.to_bytes())
                && !warnings.contains(&warning)
            {
                warnings.push(warning);
            }
        };
        let mut saved = Instant::now();
        while !trace.is_finished() {
            if trace.wants_reading() {
                trace.judge(&self.read(&trace)?);
            }
            let batch = Instant::now();
            if trace.submit(self.gpu) {
                self.wait()?;
                trace.pace(batch.elapsed());
            }
            progress(&trace.progress());
            if saved.elapsed() > CHECKPOINT && trace.is_between_passes() {
                save(&self.read(&trace)?);
                saved = Instant::now();
            }
        }
        let state = self.read(&trace)?;
        save(&state);
        let truth = state.truth(request);
        let traced = (truth.rays - before, start.elapsed());
        Ok(Traced { rel_error: self.rel_error(&truth, stop), truth, inputs, cached_samples, traced, warnings })
    }

    fn rel_error(&self, truth: &Truth, stop: Stop) -> Option<f64> {
        if is_lit(self.scene) { truth.rel_error(stop.error_block) } else { Some(0.0) }
    }

    fn tracer(&self) -> Result<&Tracer, TruthError> {
        if self.tracer.get().is_none() {
            let size = SceneSize::of(self.scene);
            size.check(&self.gpu.limits()).map_err(|error| TruthError(error.to_string()))?;
            let buffers = SceneBuffers::new(self.gpu, self.scene);
            // Nobody else fills the cell: it is not shared between threads.
            let _ = self.tracer.set(Tracer::new(self.gpu, self.scene, &buffers)?);
        }
        self.tracer.get().ok_or_else(|| TruthError("the scene could not be prepared; run again".into()))
    }

    fn wait(&self) -> Result<(), TruthError> {
        let status = self.gpu.device.poll(wgpu::PollType::wait_indefinitely());
        status.map(drop).map_err(|error| TruthError(format!("the device was lost while tracing ({error}); run again")))
    }

    fn read(&self, trace: &Trace) -> Result<State, TruthError> {
        let reading = trace.read(self.gpu);
        loop {
            self.wait()?;
            if let Some(state) = reading.take() {
                return Ok(state);
            }
            if reading.is_lost() {
                return Err(TruthError("the device was lost while tracing; run again".into()));
            }
            // Another thread that polls the same device took the news and is about to hand it over.
            std::thread::yield_now();
        }
    }

    /// Hash of everything that the sums depend on: scene, request and shader.
    fn key(&self, request: &Request) -> Key {
        let mut inputs = KeyInputs::default();
        inputs.add(&[FORMAT]).add_text(self.scene_hash.get_or_init(|| scene_hash(self.scene)).as_str());
        // Destructured, so that a new field cannot be left out.
        let Request { camera, size, bounce1, bounces, on_screen, glossy, ambient_occlusion, seed } = request;
        let Camera { eye, target, up, vertical_fov_degrees } = camera;
        inputs.add(&[*eye, *target, *up]).add(&[*vertical_fov_degrees]).add(size);
        inputs.add(&[u32::from(*bounce1), *bounces, u32::from(*on_screen), u32::from(*glossy), *seed]);
        inputs.add(ambient_occlusion.as_slice()).add_text(halflight_renderer::truth::shader_source());
        inputs.key()
    }
}
