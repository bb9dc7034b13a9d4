//! The path-traced reference on this computer. Traced samples are kept on disk, and a later call continues from them.

use std::{
    cell::OnceCell,
    ops::Range,
    time::{Duration, Instant},
};

use halflight_frame_graph::Gpu;
use halflight_renderer::{
    scene::{SceneBuffers, SceneSize},
    truth::{PART, Progress, Request, State, Stop, Sums, Trace, Tracer, Truth, TruthError, is_lit},
};
use halflight_scenes::{Camera, Scene};

use crate::{
    cache::{Cache, Key, KeyInputs},
    scene_hash::scene_hash,
};

/// Time between two copies of an unfinished trace on disk.
const CHECKPOINT: Duration = Duration::from_secs(20);
/// Raised when stored sums change their meaning, or when the code that prepares the tracer's buffers changes its result.
const FORMAT: u32 = 4;
/// The kind of cache entry that holds a whole reference.
const WHOLE: &str = "truth";

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

/// Sums of samples and where they came from.
#[derive(Clone, Debug)]
pub struct Sampled {
    /// The sums.
    pub sums: Sums,
    /// As [`Traced::inputs`].
    pub inputs: Key,
    /// As [`Traced::cached_samples`].
    pub cached_samples: u32,
    /// As [`Traced::traced`].
    pub traced: (u64, Duration),
    /// As [`Traced::warnings`].
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
        let sampled = self.sample(request, 0, WHOLE, stop, progress)?;
        let truth = sampled.sums.truth(request);
        let Sampled { inputs, cached_samples, traced, warnings, .. } = sampled;
        Ok(Traced { rel_error: self.rel_error(&truth, stop), truth, inputs, cached_samples, traced, warnings })
    }

    /// Traces a range of the samples of a reference, to be merged with others ([`Sums::merge`]). An interrupted range
    /// continues from the cache.
    ///
    /// # Errors
    /// As [`TruthSource::trace`], and where the range is empty or does not begin with a part ([`PART`]).
    pub fn trace_range(
        &self,
        request: &Request,
        range: Range<u32>,
        progress: &mut dyn FnMut(&Progress),
    ) -> Result<Sampled, TruthError> {
        if range.is_empty() || !range.start.is_multiple_of(PART) {
            return Err(TruthError(format!(
                "samples {} to {} are no range of parts: begin with a multiple of {PART}",
                range.start, range.end
            )));
        }
        let kind = format!("{WHOLE}-{}-{}", range.start, range.end);
        self.sample(request, range.start, &kind, Stop::at_samples(range.end - range.start), progress)
    }

    /// Puts sums of a whole reference into the cache, unless it has as many samples already. Returns what went wrong.
    pub fn keep(cache: &Cache, inputs: &Key, request: &Request, sums: &Sums) -> Option<String> {
        let known = cache.load(WHOLE, inputs).ok().flatten();
        let known = known.and_then(|bytes| Sums::from_bytes(&bytes, request).ok()).map_or(0, |known| known.samples());
        (known < sums.samples()).then(|| cache.store(WHOLE, inputs, &sums.to_bytes()).err()).flatten()
    }

    /// Traces samples from `first` on, with what the cache holds of this kind.
    fn sample(
        &self,
        request: &Request,
        first: u32,
        kind: &str,
        stop: Stop,
        progress: &mut dyn FnMut(&Progress),
    ) -> Result<Sampled, TruthError> {
        let inputs = self.key(request);
        let mut warnings = Vec::new();
        let stored = self.cache.as_ref().and_then(|cache| {
            let bytes = cache.load(kind, &inputs).unwrap_or_else(|warning| {
                warnings.push(warning);
                None
            })?;
            Sums::from_bytes(&bytes, request).map_err(|error| warnings.push(error.to_string())).ok()
        });
        let mut sums = stored.unwrap_or_else(|| Sums::new(first));
        let cached_samples = sums.samples();
        let judge = |sums: &Sums| match stop.rel_error {
            Some(_) if sums.samples() > 1 => self.rel_error(&sums.truth(request), stop),
            _ => None,
        };
        let is_finished = |sums: &Sums, rel_error| {
            sums.has_surfaces() && (!request.is_random() || stop.is_reached(sums.samples(), rel_error))
        };
        // An interrupted trace goes on to where it was to judge its error: it ends as if it was not interrupted.
        let interrupted = Some(sums.planned()).filter(|&planned| planned > sums.samples());
        let mut rel_error = if interrupted.is_some() { None } else { judge(&sums) };
        if is_finished(&sums, rel_error) {
            return Ok(Sampled { sums, inputs, cached_samples, traced: (0, Duration::ZERO), warnings });
        }
        let start = Instant::now();
        let before = if cached_samples > 0 { sums.truth(request).rays } else { 0 };
        // Refuses what is out of range; each part has a stop of its own.
        let mut trace = self.tracer()?.start(self.gpu, request, stop)?;
        let mut save = |sums: &Sums| {
            let Some(cache) = &self.cache else { return };
            if let Err(warning) = cache.store(kind, &inputs, &sums.to_bytes())
                && !warnings.contains(&warning)
            {
                warnings.push(warning);
            }
        };
        let mut saved = Instant::now();
        let mut target = interrupted.map(|planned| planned.min(stop.samples_per_pixel));
        loop {
            let target =
                target.take().unwrap_or_else(|| stop.next_check(sums.samples(), rel_error)).max(sums.samples() + 1);
            sums.plan(target);
            while sums.samples() < target || !sums.has_surfaces() {
                let next = sums.next_part();
                let whole_before = next - first;
                trace.begin(self.gpu, next, Stop::at_samples(PART.min(target - whole_before)));
                if let Some(part) = sums.unfinished() {
                    trace.restore(self.gpu, part);
                }
                while !trace.is_finished() {
                    let batch = Instant::now();
                    if trace.submit(self.gpu) {
                        self.wait()?;
                        trace.pace(batch.elapsed());
                    }
                    let samples = whole_before + trace.progress().samples;
                    let expected_samples = stop.expected_samples(sums.samples(), rel_error);
                    let fraction = (samples as f32 / expected_samples.max(1) as f32).min(1.0);
                    progress(&Progress { samples, expected_samples, rel_error, fraction });
                    if saved.elapsed() > CHECKPOINT && trace.is_between_passes() && !trace.is_finished() {
                        sums.add(self.read(&trace)?);
                        save(&sums);
                        saved = Instant::now();
                    }
                }
                sums.add(self.read(&trace)?);
                if saved.elapsed() > CHECKPOINT {
                    save(&sums);
                    saved = Instant::now();
                }
                if !request.is_random() {
                    break;
                }
            }
            rel_error = judge(&sums);
            if is_finished(&sums, rel_error) {
                break;
            }
        }
        sums.plan(0);
        save(&sums);
        let samples = sums.samples();
        progress(&Progress { samples, expected_samples: samples, rel_error, fraction: 1.0 });
        let traced = (sums.truth(request).rays - before, start.elapsed());
        Ok(Sampled { sums, inputs, cached_samples, traced, warnings })
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
        let Request { camera, size, bounce1, bounces, on_screen, glossy, ambient_occlusion, texture_filter, seed } =
            request;
        let Camera { eye, target, up, vertical_fov_degrees } = camera;
        inputs.add(&[*eye, *target, *up]).add(&[*vertical_fov_degrees]).add(size);
        inputs.add(&[
            u32::from(*bounce1),
            *bounces,
            u32::from(*on_screen),
            u32::from(*glossy),
            *texture_filter as u32,
            *seed,
        ]);
        inputs.add(ambient_occlusion.as_slice()).add_text(halflight_renderer::truth::shader_source());
        inputs.key()
    }
}
