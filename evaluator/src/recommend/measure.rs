//! Measures single cells of a search: times of passes, and the deciding metric.

use std::{
    collections::{BTreeMap, btree_map::Entry},
    time::Instant,
};

use halflight_frame_graph::Part;
use halflight_metrics::{DisplayPair, Function, LinearPair, Metric, MetricId, percentile};
use halflight_native::{
    NativeGpu,
    cache::Cache,
    images::{Rgb, auto_exposure, tone_map_all},
    truth::TruthSource,
};
use halflight_recommend::{Cell, Measured, Outcome, Stage};
use halflight_renderer::truth::{Request as TruthRequest, Stop};
use halflight_scenes::Scene;

use crate::{
    Error,
    experiment::{
        frames::{Shown, modulate},
        moving::Moving,
        reference::final_radiance,
        session::{Frames, Request, Session},
    },
};

/// How cells are measured.
#[derive(Clone, Debug)]
pub struct Measuring {
    /// Whether the camera moves, as [`Moving::Camera`] says. It matters for techniques with a history.
    pub moving: bool,
    /// Bounces of the reference.
    pub bounces: u32,
    /// Seed of every random number.
    pub seed: u32,
}

/// Timed frames at reduced and at full size.
const FRAMES: [u32; 2] = [5, 11];
/// Fewer frames are timed if all together take longer than this, seconds; at least three.
const LONG: f64 = 4.0;
/// Frames whose error counts, of a technique without history.
const IMAGES: u32 = 3;
/// The frame that counts of a technique with a history, counted from 1: what is seen after a second at 60 frames a second.
pub const SETTLED_FRAME: u32 = 60;
/// Samples per pixel of the reference: of the first try, and the most. The number doubles from try to try.
const SAMPLES: [u32; 2] = [16, 512];
/// Relative error over 8x8 blocks at which the reference is precise enough. Its noise adds the square of it to block
/// relMSE, and that is subtracted.
const REL_ERROR: f32 = 0.015;
/// Share of the time left that refining the reference may take.
const REFERENCE_SHARE: f64 = 0.2;

/// Measures cells on one scene. What cells share is made when the first one needs it.
pub struct Measurer<'a> {
    native: &'a NativeGpu,
    scene: &'a Scene,
    metric: &'static Metric,
    measuring: Measuring,
    session: Session<'a>,
    references: BTreeMap<[u32; 2], Reference>,
    scene_frames: BTreeMap<([u32; 2], String), Frames<'a>>,
}

/// The path-traced reference at one size.
struct Reference {
    /// `albedo * indirect`.
    indirect: Vec<Rgb>,
    final_image: Vec<Rgb>,
    direct: Vec<Rgb>,
    mask: Vec<bool>,
    exposure: f32,
    /// The error that the noise of the reference alone causes.
    noise: f64,
}

impl<'a> Measurer<'a> {
    /// A measurer of this scene by this metric.
    pub fn new(native: &'a NativeGpu, scene: &'a Scene, metric: &'static Metric, measuring: Measuring) -> Self {
        Self {
            native,
            scene,
            metric,
            measuring,
            session: Session::new(native, scene),
            references: BTreeMap::new(),
            scene_frames: BTreeMap::new(),
        }
    }

    /// Measures a cell. `left` is the time left for everything, seconds.
    ///
    /// # Errors
    /// A reference that cannot be traced, or a device that was lost.
    pub fn measure(&mut self, cell: &Cell, left: f64) -> Result<Outcome, Error> {
        if !self.references.contains_key(&cell.size) {
            let reference = self.trace(cell.size, left)?;
            self.references.insert(cell.size, reference);
        }
        if cell.technique.name == "none" {
            return Ok(Outcome::Measured(self.baseline(cell.size)));
        }
        match self.measure_technique(cell) {
            Err(Error::BadInput(reason)) => Ok(Outcome::Refused(reason)),
            other => other,
        }
    }

    /// The image of a configuration and the reference, final radiance, with an exposure for both.
    ///
    /// # Errors
    /// As [`Measurer::measure`].
    pub fn pictures(&mut self, cell: &Cell) -> Result<([Vec<Rgb>; 2], f32), Error> {
        self.measure(cell, 0.0)?;
        let mut frames = self.frames(cell)?;
        let count = if frames.plan().has_history() { SETTLED_FRAME } else { 1 };
        for frame in 0..count {
            frames.run(frame)?;
        }
        let shown = Shown::read(&frames)?;
        let reference = &self.references[&cell.size];
        Ok(([shown.image, reference.final_image.clone()], reference.exposure))
    }

    fn frames(&mut self, cell: &Cell) -> Result<Frames<'a>, Error> {
        let needs = (cell.technique.needs)(&cell.settings).map_err(|e| Error::BadInput(e.to_string()))?;
        let key = (cell.size, format!("{needs:?}"));
        if let Entry::Vacant(slot) = self.scene_frames.entry(key.clone()) {
            let mut frames = self.session.scene_frames(&cell.settings, cell.size)?;
            frames.run(0)?;
            slot.insert(frames);
        }
        let request = self.request(cell);
        let scene_frames = &self.scene_frames[&key];
        self.session.technique_frames(&request, scene_frames)
    }

    fn measure_technique(&mut self, cell: &Cell) -> Result<Outcome, Error> {
        let mut frames = self.frames(cell)?;
        let has_history = frames.plan().has_history();
        let reference = &self.references[&cell.size];
        let error = |frames: &Frames| Ok::<_, Error>(self.error(reference, &Shown::read(frames)?, cell.size[0]));
        let of_technique = |frames: &mut Frames, frame: u32| -> Result<(f64, Vec<(String, f64)>), Error> {
            let time = frames.run(frame)?;
            let passes = time.passes.iter().filter(|pass| pass.part == Part::Technique);
            let passes: Vec<_> = passes.map(|pass| (pass.name.clone(), pass.milliseconds)).collect();
            Ok((passes.iter().map(|(_, ms)| ms).sum(), passes))
        };
        let start = Instant::now();
        let (first, _) = of_technique(&mut frames, 0)?;
        let mut errors = vec![error(&frames)?];
        if first > cell.slowest_ms {
            return Ok(Outcome::TooSlow(first));
        }
        let mut times = Vec::new();
        let mut passes: Vec<(String, Vec<f64>)> = Vec::new();
        let full = cell.stage == Stage::Verification;
        for frame in 1..=FRAMES[usize::from(full)] {
            let (time, of_passes) = of_technique(&mut frames, frame)?;
            times.push(time);
            passes.resize_with(of_passes.len(), Default::default);
            for (slot, (name, ms)) in passes.iter_mut().zip(of_passes) {
                slot.0 = name;
                slot.1.push(ms);
            }
            if !has_history && frame < IMAGES {
                errors.push(error(&frames)?);
            }
            if frame >= IMAGES && start.elapsed().as_secs_f64() > LONG {
                break;
            }
        }
        if has_history && self.measuring.moving {
            errors = vec![self.error_of_moving(cell)?];
        } else if has_history {
            for frame in times.len() as u32 + 1..SETTLED_FRAME {
                frames.run(frame)?;
            }
            errors = vec![error(&frames)?];
        }
        let passes = passes.into_iter().map(|(name, mut times)| (name, percentile(&mut times, 0.5))).collect();
        let reference_noise = self.noise(reference);
        Ok(Outcome::Measured(Measured { times, passes, errors, reference_noise }))
    }

    /// The error in [`SETTLED_FRAME`], to which the camera has moved.
    fn error_of_moving(&self, cell: &Cell) -> Result<f64, Error> {
        let (moved, _) = Moving::Camera.apply(self.scene.clone(), SETTLED_FRAME);
        let session = Session::new(self.native, &moved);
        let mut frames = session.frames(&self.request(cell))?;
        for frame in 0..SETTLED_FRAME {
            frames.run(frame)?;
        }
        Ok(self.error(&self.references[&cell.size], &Shown::read(&frames)?, cell.size[0]))
    }

    fn request<'r>(&self, cell: &Cell) -> Request<'r> {
        Request {
            technique: cell.technique,
            settings: cell.settings.clone(),
            size: cell.size,
            seed: self.measuring.seed,
            direct: None,
        }
    }

    /// What showing no indirect light gives.
    fn baseline(&self, size: [u32; 2]) -> Measured {
        let reference = &self.references[&size];
        let black = vec![[0.0; 3]; reference.indirect.len()];
        let shown =
            Shown { image: reference.direct.clone(), indirect: black.clone(), incident: black, open: None, lit: false };
        Measured {
            times: Vec::new(),
            passes: Vec::new(),
            errors: vec![self.error(reference, &shown, size[0])],
            reference_noise: self.noise(reference),
        }
    }

    /// The deciding metric as plots show it, without what the noise of the reference adds to a mean of squares.
    fn error(&self, reference: &Reference, shown: &Shown, width: u32) -> f64 {
        let error = plotted(self.metric, value(self.metric, reference, &shown.indirect, &shown.image, width));
        let clean = if is_mean_of_squares(self.metric) { error - reference.noise } else { error };
        // Not `max`, which would hide NaN: an error that is not defined.
        if clean < 0.0 { 0.0 } else { clean }
    }

    /// How far the noise of the reference may move the error. Where it is subtracted, its own error is left: standard errors
    /// of some tens of samples are known to a tenth, their squares to a fifth.
    fn noise(&self, reference: &Reference) -> f64 {
        if is_mean_of_squares(self.metric) { 0.2 * reference.noise } else { reference.noise }
    }

    /// Traces a reference that refines until it is precise enough or has taken its share of the time.
    fn trace(&self, size: [u32; 2], left: f64) -> Result<Reference, Error> {
        let bad = |e: halflight_renderer::truth::TruthError| Error::BadInput(e.to_string());
        let source = TruthSource::new(&self.native.gpu, self.scene, Some(Cache::standard()));
        let request = TruthRequest {
            bounce1: true,
            bounces: self.measuring.bounces,
            seed: self.measuring.seed,
            ..TruthRequest::new(self.scene.camera, size)
        };
        let start = Instant::now();
        let mut samples = SAMPLES[0];
        let traced = loop {
            let stop = Stop { samples_per_pixel: samples, rel_error: Some(REL_ERROR), error_block: 8 };
            let traced = source.trace(&request, stop, &mut |_| {}).map_err(bad)?;
            let precise = traced.rel_error.is_some_and(|error| error <= REL_ERROR.into());
            // The next try takes as long as all so far.
            let long = 2.0 * start.elapsed().as_secs_f64() > REFERENCE_SHARE * left;
            samples = traced.truth.samples.saturating_mul(2);
            if precise || long || samples > SAMPLES[1] {
                break traced.truth;
            }
        };
        let black = vec![[0.0; 3]; traced.albedo.len()];
        let (mean, sigma) = match &traced.indirect {
            Some(light) => (&light.mean, &light.standard_error),
            None => (&black, &black),
        };
        let indirect = modulate(&traced.albedo, mean);
        let sigma = modulate(&traced.albedo, sigma);
        let final_image = final_radiance(&traced);
        let mask: Vec<bool> = traced.depth.iter().map(|&depth| depth > 0.0).collect();
        let exposure = auto_exposure(&final_image, Some(&mask));
        let direct = final_image.iter().zip(&indirect).map(|(all, own)| std::array::from_fn(|c| all[c] - own[c]));
        let mut reference = Reference { direct: direct.collect(), indirect, final_image, mask, exposure, noise: 0.0 };
        // The metric between the reference and the reference with its noise once more.
        let add = |image: &[Rgb]| -> Vec<Rgb> {
            let noisy = |(pixel, (value, sigma)): (usize, (&Rgb, &Rgb))| {
                std::array::from_fn(|c| value[c] + if sign(pixel, c) { sigma[c] } else { -sigma[c] })
            };
            image.iter().zip(&sigma).enumerate().map(noisy).collect()
        };
        let (noisy, noisy_final) = (add(&reference.indirect), add(&reference.final_image));
        reference.noise = plotted(self.metric, value(self.metric, &reference, &noisy, &noisy_final, size[0]));
        Ok(reference)
    }
}

/// A sign that has no pattern over pixels and channels: the top bit of a multiplicative hash (Knuth).
fn sign(pixel: usize, channel: usize) -> bool {
    let hash = ((3 * pixel + channel) as u32).wrapping_mul(0x9E37_79B1);
    (hash ^ hash >> 15).wrapping_mul(0x85EB_CA77) >> 31 == 0
}

/// Whether independent noise of the reference adds to the metric's mean.
fn is_mean_of_squares(metric: &Metric) -> bool {
    [MetricId::IndirectRelMse, MetricId::IndirectBlockRelMse].contains(&metric.id)
}

fn value(metric: &Metric, reference: &Reference, indirect: &[Rgb], image: &[Rgb], width: u32) -> f64 {
    let mask = Some(reference.mask.as_slice());
    let pair = LinearPair::new(indirect, &reference.indirect, mask);
    match metric.function {
        Function::Indirect(of) => of(&pair),
        Function::IndirectBlocks(of) => of(&pair, width),
        Function::Final(of) => {
            let display = [image, &reference.final_image].map(|image| tone_map_all(image, reference.exposure));
            of(&DisplayPair {
                width,
                linear: [image, &reference.final_image],
                display: [&display[0], &display[1]],
                mask,
            })
        }
        Function::Occlusion(_) | Function::Recorded => f64::NAN,
    }
}

fn plotted(metric: &Metric, value: f64) -> f64 {
    metric.plot.as_ref().map_or(value, |plot| (plot.value)(value))
}
