//! A scene on a device, and a configuration that is drawn of it.

use eframe::egui::Context;
use glam::Vec3;
use halflight_frame_graph::{CompiledGraph, Continuity, Externals, FramePlan, Gpu, Part, ResourceKind, scan::Scanned};
use halflight_renderer::{
    parameters::SettingsError,
    plan_frame,
    scene::{SceneBuffers, SceneFacts, SceneMotion, camera_view},
};
use halflight_scenes::{Camera, Light, Scene};

use crate::{
    check::Check,
    readback::{Reading, TextureReading},
    show::{Look, TruthTextures, show},
    state::{Configuration, View},
    timing::{Method, Round, Times, Work, is_coarse},
};

/// Frames that are measured after a change.
const MEASURED_FRAMES: u32 = 11;
/// Frames that a temporal filter is given after a change, until the picture counts as settled.
const FILTERED_FRAMES: u32 = 32;

/// A scene on a device.
pub struct Stage {
    /// The scene, with its lights as they stand now.
    pub scene: Scene,
    /// Lights as they came with the scene.
    pub original_lights: Vec<Light>,
    /// What plans start from.
    pub facts: SceneFacts,
    /// The scene's buffers.
    pub buffers: SceneBuffers,
    /// Whether the device is software.
    pub software: bool,
}

impl Stage {
    /// Uploads a scene; `software` says what kind of device it is.
    pub fn new(gpu: &Gpu, scene: Scene, software: bool) -> Self {
        let (facts, buffers) = (SceneFacts::of(&scene), SceneBuffers::new(gpu, &scene));
        Self { original_lights: scene.lights.clone(), scene, facts, buffers, software }
    }

    /// Takes over lights that moved; false where nothing changed.
    pub fn relight(&mut self, gpu: &Gpu, lights: Vec<Light>) -> bool {
        if lights == self.scene.lights {
            return false;
        }
        self.buffers.relight(gpu, &lights);
        self.scene.lights = lights;
        self.facts = SceneFacts::of(&self.scene);
        true
    }

    /// Where the camera stands at a frame of the scene.
    pub fn camera(&self, frame: u32) -> Camera {
        if self.moves() { self.scene.pose(frame).camera } else { self.scene.camera }
    }

    /// Whether anything moves in the scene by itself.
    pub fn moves(&self) -> bool {
        !self.scene.moves.is_empty()
    }

    /// Middle of the bounding box, world space.
    pub fn centre(&self) -> Vec3 {
        self.scene.bounds().map_or(Vec3::ZERO, |(low, high)| 0.5 * (low + high))
    }

    /// Length of the bounding box's diagonal, scene units.
    pub fn diagonal(&self) -> f32 {
        self.scene.bounds().map_or(1.0, |(low, high)| (high - low).length())
    }
}

/// What a frame depends on besides its plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moment {
    /// The camera.
    pub camera: Camera,
    /// Number of the frame: what moves in the scene, and random numbers.
    pub frame: u32,
    /// Seed of every random number.
    pub seed: u32,
}

/// One side of the picture: a configuration, drawn and measured.
pub struct Side {
    configuration: Configuration,
    recording: CompiledGraph,
    moment: Option<Moment>,
    shown: Option<(View, Look, u64)>,
    show: Option<CompiledGraph>,
    texture: Option<eframe::egui::TextureId>,
    drawing: Option<Work>,
    timestamps: Option<Reading>,
    round: Option<Round>,
    /// Running times.
    pub times: Times,
    /// How they are measured.
    pub method: Method,
    frames_left: u32,
    /// Frames that a temporal filter still wants of the current moment.
    unfiltered: u32,
    /// Frames drawn so far: a temporal filter goes on where their numbers do.
    drawn_frames: u32,
    /// Whether a frame of the current moment has been drawn to its end.
    drawn: bool,
    indirect: Option<TextureReading>,
    /// Incident indirect light of the last frame, once it was read.
    pub light: Option<Vec<[f32; 3]>>,
    /// relMSE of `albedo * indirect` against the truth, once both are known.
    pub rel_mse: Option<f64>,
    /// Version of the truth that `rel_mse` was found against.
    pub judged: u64,
    /// Wall time of the last whole frame, milliseconds.
    pub frame_ms: Option<f64>,
    check: Check,
}

/// What `Side::draw` did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// Nothing is left to do.
    Idle,
    /// Waits for the device.
    Busy,
    /// A round of repetitions runs, which painting would disturb; it asks for the next pass itself.
    Measuring,
}

/// The plan of a configuration, or why there is none: a setting out of range, a size that the device cannot hold.
fn plan(gpu: &Gpu, stage: &Stage, configuration: &Configuration, size: [u32; 2]) -> Result<FramePlan, SettingsError> {
    let plan = plan_frame(&stage.facts, configuration.technique(), &configuration.settings, size, Default::default())?;
    let largest = gpu.device.limits().max_texture_dimension_2d;
    let too_large = plan.resources.iter().find(|resource| match resource.kind {
        ResourceKind::Texture { size, .. } => size.iter().any(|&v| v > largest),
        _ => false,
    });
    match too_large {
        Some(resource) => Err(SettingsError(format!(
            "the texture {} does not fit this device, which takes {largest} pixels a side: choose a smaller size",
            resource.name
        ))),
        None => Ok(plan),
    }
}

impl Side {
    /// Plans and prepares a configuration.
    ///
    /// # Errors
    /// A setting out of range, or a size that the device cannot hold.
    pub fn new(gpu: &Gpu, stage: &Stage, configuration: &Configuration, size: [u32; 2]) -> Result<Self, SettingsError> {
        let plan = plan(gpu, stage, configuration, size)?;
        let recording = CompiledGraph::new(gpu, plan, &Externals { scene: Some(&stage.buffers), ..Default::default() });
        let method = match gpu.timestamp_period {
            _ if stage.software => Method::Software,
            Some(_) => Method::Timestamps,
            None => Method::NoTimestamps,
        };
        Ok(Self {
            configuration: configuration.clone(),
            times: Times::new(&recording),
            recording,
            moment: None,
            shown: None,
            show: None,
            texture: None,
            drawing: None,
            timestamps: None,
            round: None,
            method,
            frames_left: 0,
            unfiltered: 0,
            drawn_frames: 0,
            drawn: false,
            indirect: None,
            light: None,
            rel_mse: None,
            judged: 0,
            frame_ms: None,
            check: Check::default(),
        })
    }

    /// Follows a change of settings, size or lights; true where anything changed.
    ///
    /// # Errors
    /// A setting out of range, or a size that the device cannot hold; the side stays as it was.
    pub fn follow(
        &mut self,
        gpu: &Gpu,
        stage: &Stage,
        configuration: &Configuration,
        size: [u32; 2],
    ) -> Result<bool, SettingsError> {
        let new = plan(gpu, stage, configuration, size)?;
        self.configuration.clone_from(configuration);
        if new == *self.recording.plan() {
            return Ok(false);
        }
        self.round = None;
        (self.moment, self.drawn) = (None, false);
        self.check = Check::default();
        if self.recording.update(gpu, &new) {
            return Ok(true);
        }
        // What a temporal filter remembers goes on under the new settings.
        let scene = Externals { scene: Some(&stage.buffers), ..Default::default() };
        self.recording.replan(gpu, new, &scene);
        self.times = Times::new(&self.recording);
        self.show.take().into_iter().for_each(CompiledGraph::destroy);
        (self.shown, self.timestamps) = (None, None);
        Ok(true)
    }

    /// Frees what it holds on the device.
    pub fn destroy(self) {
        self.recording.destroy();
        self.show.into_iter().for_each(CompiledGraph::destroy);
    }

    /// Draws and measures as far as the device is ready. `measure` asks for times, too: at least this many `rounds`
    /// where passes are timed by repetition.
    pub fn draw(
        &mut self,
        ctx: &Context,
        gpu: &Gpu,
        stage: &Stage,
        moment: Moment,
        measure: bool,
        rounds: usize,
    ) -> Progress {
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
            } else {
                for (index, pass) in self.recording.pass_times(&bytes).iter().enumerate() {
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
            // Where the scene moves, a filter goes on with the next frame of the scene.
            self.unfiltered = if self.has_history() && !stage.moves() { FILTERED_FRAMES } else { 0 };
            self.drawn = false;
        }
        let by_repetition = self.method != Method::Timestamps;
        if moved || self.unfiltered > 0 || (measure && self.frames_left > 0 && !by_repetition) {
            self.record(gpu, stage, moment, moved);
            return Progress::Busy;
        }
        if by_repetition && measure && self.times.rounds() < rounds {
            if self.round.is_none() {
                let ctx = ctx.clone();
                self.round = Some(Round::start(gpu, &self.recording, &self.times, move || ctx.request_repaint()));
            }
            return Progress::Measuring;
        }
        Progress::Idle
    }

    fn record(&mut self, gpu: &Gpu, stage: &Stage, moment: Moment, moved: bool) {
        self.frames_left = self.frames_left.saturating_sub(1);
        self.unfiltered = self.unfiltered.saturating_sub(1);
        self.moment = Some(moment);
        (self.light, self.indirect, self.rel_mse, self.judged) = (None, None, None, 0);
        self.check = Check::default();
        let mut seen = camera_view(&moment.camera, self.recording.plan().display_size, stage.facts.near);
        (seen.frame, seen.seed) = (moment.frame, moment.seed);
        if let Some(motion) = SceneMotion::new(&stage.scene, &stage.buffers) {
            motion.place(&mut seen);
            // The user may hold the camera.
            seen.world_to_view = moment.camera.view_matrix();
            motion.write(gpu, &self.recording, &seen);
        } else if self.has_history() {
            seen.frame = self.drawn_frames;
            seen.continuity = if moved { Continuity::Changing } else { Continuity::Still };
        }
        self.drawn_frames = self.drawn_frames.wrapping_add(1);
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
        self.recording.record(gpu, &mut encoder, &seen);
        if let Some(show) = &self.show {
            show.record(gpu, &mut encoder, &seen);
        }
        self.drawing = Some(Work::submit(&gpu.queue, Some(encoder.finish())));
        if self.method == Method::Timestamps {
            self.timestamps = self.recording.timing_buffer().map(Reading::of);
        }
    }

    /// Shows a view of the last frame, where it is not shown already; true where the picture is another one now. The
    /// number beside the truth counts what was traced so far. A frame that lacks what the view shows has no picture.
    pub fn look(
        &mut self,
        gpu: &Gpu,
        view: &View,
        look: Look,
        truth: Option<(&TruthTextures, u64)>,
        renderer: &mut eframe::egui_wgpu::Renderer,
    ) -> bool {
        let key = (view.clone(), look, truth.map_or(0, |(_, version)| version));
        let other = self.shown.as_ref() != Some(&key);
        if other {
            self.shown = Some(key);
            if let Some(old) = self.show.take() {
                old.destroy();
            }
            self.show = show(gpu, &self.recording, view, look, truth.map(|(textures, _)| textures));
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
                let size = self.recording.plan().display_size;
                show.record(gpu, &mut encoder, &camera_view(&camera, size, 1.0));
                gpu.queue.submit([encoder.finish()]);
            }
        }
        other
    }

    /// The picture for the screen, once there is one.
    pub fn picture(&self) -> Option<eframe::egui::TextureId> {
        self.texture.filter(|_| self.moment.is_some() && self.show.is_some())
    }

    /// Reads the indirect light of the last frame, once for each change; black where the technique gives none.
    pub fn read_light(&mut self, gpu: &Gpu) {
        if self.light.is_some() || self.moment.is_none() {
            return;
        }
        match (&self.indirect, self.recording.output("indirect")) {
            (None, Some(texture)) => self.indirect = Some(TextureReading::new(gpu, texture)),
            (Some(reading), _) => {
                if let Some(texels) = reading.take() {
                    self.light = Some(texels.into_iter().map(|[r, g, b, _]| [r, g, b]).collect());
                    self.indirect = None;
                }
            }
            (None, None) => {
                let [width, height] = self.recording.plan().display_size;
                self.light = Some(vec![[0.0; 3]; width as usize * height as usize]);
            }
        }
    }

    /// Scans what the last frame wrote, once for each change; true while the device works on it.
    pub fn scan(&mut self, gpu: &Gpu) -> bool {
        self.check.step(gpu, &self.recording)
    }

    /// What the scan found, once it is known.
    pub fn scanned(&self) -> Option<&[Scanned]> {
        self.check.found()
    }

    /// The plan that is drawn.
    pub fn plan(&self) -> &FramePlan {
        self.recording.plan()
    }

    /// An output of the plan.
    pub fn output(&self, name: &str) -> Option<&wgpu::Texture> {
        self.recording.output(name)
    }

    /// The configuration that is drawn.
    pub fn configuration(&self) -> &Configuration {
        &self.configuration
    }

    /// Whether a frame of the current moment has been drawn to its end; more of them may be under way, to be measured.
    pub fn is_drawn(&self) -> bool {
        self.moment.is_some() && self.drawn
    }

    /// Whether nothing more will change in the picture of the current moment.
    pub fn is_settled(&self) -> bool {
        self.is_drawn() && self.unfiltered == 0 && self.drawing.is_none()
    }

    /// Whether frames depend on the ones before.
    fn has_history(&self) -> bool {
        self.recording.plan().has_history()
    }

    /// Whether a round of repetitions runs.
    pub fn is_measuring(&self) -> bool {
        self.round.is_some()
    }

    /// Whether enough was measured for a median to count.
    pub fn is_measured(&self) -> bool {
        self.times.rounds() >= if self.method == Method::Timestamps { MEASURED_FRAMES as usize / 2 } else { 1 }
    }

    /// Running medians of one part of the frame, milliseconds.
    pub fn part_ms(&self, wanted: Part) -> f64 {
        self.times.of_part(wanted)
    }
}
