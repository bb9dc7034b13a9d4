//! A configuration of a technique that is drawn and measured.

mod making;
mod results;
mod samples;

use eframe::egui::Context;
use halflight_frame_graph::{
    Cause, Changed, CompiledGraph, Continuity, FramePlan, Gpu, Handle, Part, View as FrameView,
};
use halflight_renderer::scene::{LIGHTS, SceneMotion, camera_view};
use halflight_scenes::{Camera, Light};

pub use making::{Inputs, NotMade};

use crate::{
    check::Check,
    error::Errors,
    readback::{Reading, TextureReading},
    seen::Seen,
    show::{Look, ReferenceTextures, show},
    stage::Stage,
    state::{Configuration, View},
    timing::{Method, Round, Times, Work, is_coarse},
};

/// Frames that are measured after a change.
const MEASURED_FRAMES: u32 = 11;
/// Frames after a change until a picture that builds on frames before is settled: on a GPU, and on a software adapter, where
/// each takes a second and time and error would come late.
const FILTERED_FRAMES: [u32; 2] = [32, 8];

/// What a frame depends on apart from its plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// The camera.
    pub camera: Camera,
    /// Frame number, for animation and random numbers.
    pub frame: u32,
    /// Seed of every random number.
    pub seed: u32,
}

/// One side of the picture: a configuration that is drawn and measured.
pub struct Side {
    configuration: Configuration,
    graph: CompiledGraph,
    moment: Option<Moment>,
    /// The lights of the last frame.
    lights: Vec<Light>,
    shown: Option<(View, Look, u64)>,
    show: Option<CompiledGraph>,
    /// Earlier pictures, which the current pass of the interface may still paint.
    old: Vec<CompiledGraph>,
    texture: Option<eframe::egui::TextureId>,
    drawing: Option<Work>,
    /// A sample on the device.
    smoothing: Option<Work>,
    /// Samples in the picture; one more than their number once the view itself was drawn again.
    samples: u32,
    timestamps: Option<Reading>,
    round: Option<Round>,
    /// Running medians of the passes' times.
    pub times: Times,
    /// How they are measured.
    pub method: Method,
    frames_left: u32,
    /// Frames of the current moment that a temporal filter still needs.
    unfiltered: u32,
    /// Frames drawn so far, as frame numbers for the temporal filter of a static scene.
    drawn_frames: u32,
    /// Whether a frame of the current moment is complete.
    drawn: bool,
    indirect: Option<TextureReading>,
    /// Incident indirect light of the last frame, once it is read back.
    pub light: Option<Vec<[f32; 3]>>,
    /// The errors of `albedo * indirect` against the reference.
    pub errors: Errors,
    /// FLIP of its picture.
    seen: Seen,
    /// Version of the reference that `errors` belong to.
    pub compared_with: u64,
    /// Wall-clock time of the last whole frame, milliseconds.
    pub frame_ms: Option<f64>,
    check: Check,
    /// Time that each step of making it took, milliseconds: the plan, and textures and pipelines.
    pub made_in: [f64; 2],
}

/// The time of a side's technique.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SideTime {
    /// There is nothing to measure.
    NoPasses,
    /// Too few measurements for a median.
    Measuring {
        /// Measurements so far.
        done: usize,
        /// Measurements that are needed.
        of: usize,
    },
    /// The running median, milliseconds.
    Known(f64),
}

/// The times that `Side::draw` measures.
#[derive(Clone, Copy, Debug)]
pub struct Wanted {
    /// Whether it measures any.
    pub measure: bool,
    /// Least number of measurements, where passes are timed by repetition.
    pub rounds: usize,
    /// Whether passes of the scene are timed by repetition, too.
    pub of_scene: bool,
    /// Whether the picture is antialiased once there is nothing else to do.
    pub smooth: bool,
}

/// The result of `Side::draw`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// There is nothing left to do.
    Idle,
    /// Something else has to be done first, which requests the next pass.
    Waiting,
    /// The side waits for the device.
    Busy,
    /// A round of repetitions runs, which painting would disturb. It requests the next pass itself.
    Measuring,
    /// The picture is there, and gets smoother.
    Smoothing,
}

impl Side {
    /// Draws, and measures what is `wanted`, as far as the device is ready.
    pub fn draw(&mut self, ctx: &Context, gpu: &Gpu, stage: &Stage, moment: Moment, wanted: Wanted) -> Progress {
        let Wanted { measure, rounds, of_scene, smooth } = wanted;
        self.times.of_scene = of_scene || self.method == Method::Timestamps;
        if let Some(work) = &self.drawing {
            let Some(took) = work.milliseconds() else { return Progress::Busy };
            self.frame_ms = Some(took);
            self.drawing = None;
            self.drawn = true;
        }
        if let Some(reading) = &self.timestamps {
            let Some(bytes) = reading.take() else { return Progress::Busy };
            self.timestamps = None;
            let ticks: &[u64] = bytemuck::cast_slice(&bytes);
            if cfg!(target_arch = "wasm32") && is_coarse(ticks) {
                self.method = Method::CoarseTimestamps;
                self.times = Times::new(&self.graph, self.method);
            } else {
                let times = self.graph.pass_times(&bytes);
                for (index, (pass, _)) in
                    times.iter().zip(self.graph.causes()).enumerate().filter(|(_, (_, ran))| ran.is_some())
                {
                    self.times.add(index, pass.milliseconds);
                }
            }
        }
        if let Some(round) = &self.round
            && round.collect(&mut self.times)
        {
            self.round = None;
        }
        let moved = self.moment != Some(moment);
        if moved {
            self.round = None;
            self.frames_left = MEASURED_FRAMES;
            // In an animated scene the filter continues with the next frame of the animation.
            let frames = FILTERED_FRAMES[usize::from(stage.software)];
            self.unfiltered = if self.has_history() && !stage.is_animated() { frames } else { 0 };
            self.drawn = false;
        }
        let by_repetition = self.method != Method::Timestamps;
        if moved || self.unfiltered > 0 || (measure && self.frames_left > 0 && !by_repetition) {
            self.record(ctx, gpu, stage, moment, moved);
            return Progress::Busy;
        }
        if by_repetition && measure && self.times.rounds() < rounds {
            if self.round.is_none() {
                let ctx = ctx.clone();
                self.round = Some(Round::start(gpu, &self.graph, &self.times, move || ctx.request_repaint()));
            }
            return Progress::Measuring;
        }
        if smooth && self.smooth(ctx, gpu, stage, moment) {
            return Progress::Smoothing;
        }
        Progress::Idle
    }

    /// The view of the next frame, and what has changed since the last one.
    fn seen(&mut self, gpu: &Gpu, stage: &Stage, moment: Moment, moved: bool) -> (FrameView, Vec<Handle>) {
        let mut seen = camera_view(&moment.camera, self.graph.plan().display_size, stage.facts.near);
        (seen.frame, seen.seed) = (moment.frame, moment.seed);
        let mut changed = Vec::new();
        if self.lights != stage.scene.lights {
            self.lights.clone_from(&stage.scene.lights);
            changed.push(LIGHTS);
        }
        if let Some(motion) = SceneMotion::new(&stage.scene, &stage.buffers, &stage.facts) {
            motion.place(&mut seen);
            // The user may have moved the camera away from its path.
            seen.world_to_view = moment.camera.view_matrix();
            changed.extend(motion.write(gpu, &self.graph, &seen));
        } else if self.has_history() {
            seen.frame = self.drawn_frames;
            seen.continuity = if moved { Continuity::Changing } else { Continuity::Static };
        }
        self.drawn_frames = self.drawn_frames.wrapping_add(1);
        (seen, changed)
    }

    fn record(&mut self, ctx: &Context, gpu: &Gpu, stage: &Stage, moment: Moment, moved: bool) {
        self.frames_left = self.frames_left.saturating_sub(1);
        self.unfiltered = self.unfiltered.saturating_sub(1);
        self.moment = Some(moment);
        (self.light, self.indirect, self.compared_with) = (None, None, 0);
        (self.errors, self.seen) = (Errors::default(), Seen::default());
        self.check = Check::default();
        (self.smoothing, self.samples) = (None, 1);
        let (seen, changed) = self.seen(gpu, stage, moment, moved);
        // Frames of a moment after its first one are measured.
        let changed =
            if moved || self.method != Method::Timestamps { Changed::Only(&changed) } else { Changed::Anything };
        // Several submissions where a watchdog would end a long one.
        for commands in self.graph.commands(gpu, &seen, changed) {
            gpu.queue.submit([commands]);
        }
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
        if let Some(show) = &self.show {
            show.record(gpu, &mut encoder, &FrameView { frame: 0, ..seen }, Changed::Anything);
        }
        let ctx = ctx.clone();
        self.drawing = Some(Work::submit_then(&gpu.queue, Some(encoder.finish()), move || ctx.request_repaint()));
        if self.method == Method::Timestamps {
            self.timestamps = self.graph.timing_buffer().map(Reading::of);
        }
    }

    /// Shows a view of the last frame; true if the picture changed. `reference` comes with its version. There is no
    /// picture if the frame lacks the texture of the view.
    pub fn look(
        &mut self,
        gpu: &Gpu,
        view: &View,
        look: Look,
        reference: Option<(&ReferenceTextures, u64)>,
        renderer: &mut eframe::egui_wgpu::Renderer,
    ) -> bool {
        // Only these views show the reference.
        let reference = reference.filter(|_| matches!(view, View::Reference | View::Error));
        let look = Look { averaged: look.averaged && self.can_average(view), ..look };
        let key = (view.clone(), look, reference.map_or(0, |(_, version)| version));
        let changed = self.shown.as_ref() != Some(&key);
        if changed {
            self.shown = Some(key);
            self.old.extend(self.show.take());
            self.show = show(gpu, &self.graph, view, look, reference.map(|(textures, _)| textures));
            self.samples = self.samples.min(1);
            if let Some(show) = &self.show
                && let Some(display) = show.output("display")
            {
                let display = display.create_view(&Default::default());
                let filter = wgpu::FilterMode::Linear;
                match self.texture {
                    Some(id) => renderer.update_egui_texture_from_wgpu_texture(&gpu.device, &display, filter, id),
                    None => self.texture = Some(renderer.register_native_texture(&gpu.device, &display, filter)),
                }
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                let camera = self.moment.map(|moment| moment.camera).unwrap_or_default();
                let size = self.graph.plan().display_size;
                show.record(gpu, &mut encoder, &camera_view(&camera, size, 1.0), Changed::Anything);
                gpu.queue.submit([encoder.finish()]);
            }
        }
        changed
    }

    /// Whether the last frame was prepared for the screen. There is no picture if it lacks the texture of the view.
    pub fn is_looked_at(&self) -> bool {
        self.is_drawn() && self.shown.is_some()
    }

    /// The picture for the screen, if there is one.
    pub fn picture(&self) -> Option<eframe::egui::TextureId> {
        self.texture.filter(|_| self.moment.is_some() && self.show.is_some())
    }

    /// The display colours of the picture, if there is one.
    pub fn display(&self) -> Option<&wgpu::Texture> {
        self.show.as_ref()?.output("display")
    }

    /// The plan.
    pub fn plan(&self) -> &FramePlan {
        self.graph.plan()
    }

    /// An output of the plan.
    pub fn output(&self, name: &str) -> Option<&wgpu::Texture> {
        self.graph.output(name)
    }

    /// The configuration.
    pub fn configuration(&self) -> &Configuration {
        &self.configuration
    }

    /// Whether a frame of the current moment is complete. More frames may follow for measurement.
    pub fn is_drawn(&self) -> bool {
        self.moment.is_some() && self.drawn
    }

    /// Whether a frame of this moment is complete.
    pub fn shows(&self, moment: Moment) -> bool {
        self.drawn && self.moment == Some(moment)
    }

    /// Whether the picture of the current moment is final.
    pub fn is_settled(&self) -> bool {
        self.is_drawn() && self.unfiltered == 0 && self.drawing.is_none()
    }

    /// Whether a frame depends on earlier frames.
    fn has_history(&self) -> bool {
        self.graph.has_history()
    }

    /// Why each pass ran in the last frame; `None` for passes that did not run.
    pub fn causes(&self) -> Vec<Option<String>> {
        let passes = &self.graph.plan().passes;
        let text = |cause: Cause| match cause {
            Cause::First => "it had not run before".to_owned(),
            Cause::Changed(dependency) => format!("{dependency} changed"),
            Cause::Numbers => "a setting changed".to_owned(),
            Cause::Repeated => "it was measured".to_owned(),
            Cause::Pass(other) => format!("{} ran", passes[other].name),
        };
        self.graph.causes().into_iter().map(|cause| cause.map(text)).collect()
    }

    /// Ends a round of repetitions without its result. Another one starts later.
    pub fn interrupt(&mut self) {
        self.round = None;
    }

    /// Whether a round of repetitions runs.
    pub fn is_measuring(&self) -> bool {
        self.round.is_some()
    }

    /// The time of the technique. Where passes are timed by repetition, it needs this many `rounds`.
    pub fn time(&self, rounds: usize) -> SideTime {
        let of = if self.method == Method::Timestamps { MEASURED_FRAMES as usize / 2 } else { rounds };
        let done = self.times.rounds();
        match self.times.technique() {
            _ if !self.plan().passes.iter().any(|pass| pass.part == Part::Technique) => SideTime::NoPasses,
            Some(ms) if done >= of => SideTime::Known(ms),
            _ => SideTime::Measuring { done: done.min(of), of },
        }
    }

    /// Running medians of one part of the frame, milliseconds.
    pub fn part_ms(&self, wanted: Part) -> f64 {
        self.times.of_part(wanted)
    }
}
