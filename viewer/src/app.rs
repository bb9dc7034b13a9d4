//! The application: its state, and the loop that updates scene, sides and reference from it.

use std::sync::{Arc, Mutex, PoisonError};

use eframe::egui;
use halflight_frame_graph::Gpu;
use halflight_scenes::{Camera, Light};
use web_time::{Duration, Instant};

use crate::{
    address, benchmark,
    error::Metric,
    hints::Hints,
    host::Host,
    marks::Marks,
    messages::{Messages, Severity},
    playing::{Playing, rotated},
    plot::Trade,
    readback::TextureReading,
    reference::{ReferenceTracer, Subject},
    report::{CheckReport, PassReport, Report, SideReport},
    seen::Comparison,
    side::Side,
    stage::Stage,
    state::{State, View},
    style::style,
    undo::{Undo, commit, undo_from},
};

mod advance;
mod bar;
mod best;
mod controls;
mod inspect;
mod interface;
mod load;
mod motion;
mod receive;
mod result;
mod save;

/// Time without changes after which the path tracer starts.
const REST: Duration = Duration::from_millis(500);

/// Rounds of repetitions after which a median is shown. One round can be wrong by a factor of several.
const ROUNDS: usize = 3;

/// Parts of the names of software adapters, as browsers give them.
const SOFTWARE: [&str; 4] = ["swiftshader", "llvmpipe", "lavapipe", "Basic Render"];

/// What is shown alone instead of both sides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Solo {
    A,
    B,
    Reference,
}

/// Pixels of the opening picture at most: on a software adapter, and on others.
const MOST_PIXELS: [f32; 2] = [640.0 * 360.0, 1920.0 * 1080.0];
/// Sides of the smallest and the largest picture that fits the screen, pixels.
const SIDES_OF_PICTURE: [f32; 2] = [64.0, 8192.0];

/// Errors of the device, shared with its callbacks.
type DeviceErrors = Arc<Mutex<Vec<String>>>;

/// Files that were dropped together, by name, or why they could not be read.
type Dropped = Result<Vec<(String, Vec<u8>)>, String>;

/// The interactive application.
pub struct Viewer {
    ctx: egui::Context,
    host: Box<dyn Host>,
    /// The state; the picture follows it.
    state: State,
    undo: Undo,
    shown_address: String,
    gpu: Gpu,
    adapter: String,
    software: bool,
    stage: Option<Stage>,
    loads: load::Loads,
    sides: [Option<Side>; 2],
    motion: motion::Motion,
    /// Sides that are no longer shown, but may be painted in this pass.
    closed: Vec<Side>,
    /// What is searched for in the parameters of each side.
    search: [String; 2],
    /// Why a side could not be drawn with its settings.
    side_errors: [Option<String>; 2],
    reference: ReferenceTracer,
    reference_done: bool,
    /// FLIP between the last two readings of the reference.
    reference_noise: Comparison,
    trade: Trade,
    best: best::Best,
    exposure: Option<f32>,
    exposure_of: Option<Subject>,
    exposure_reading: Option<(Subject, TextureReading)>,
    messages: Messages,
    device_errors: DeviceErrors,
    device_error_count: usize,
    inbox: Arc<Mutex<Vec<Dropped>>>,
    playing: Option<Playing>,
    changed: Instant,
    marks: Marks,
    started: Instant,
    first_picture: Option<Duration>,
    benchmark: bool,
    ready: bool,
    settled: bool,
    /// Sides whose NaN/Inf check is open in the interface.
    checking: [bool; 2],
    /// Sides whose list of times is open in the interface.
    listing: [bool; 2],
    screen: egui::Vec2,
    /// The space for the picture in the last pass, points.
    picture_space: egui::Vec2,
    /// Whether the picture takes the size of its space in the first pass: the address did not say.
    fit_at_start: bool,
    /// The camera of the link that was opened; `None` for the scene's own.
    home: Option<Camera>,
    help: bool,
    inspecting: bool,
    solo: Option<Solo>,
    /// The pointer above the picture, 0..1 from the left and from the top.
    pointer: Option<[f32; 2]>,
    /// A position in the picture whose depth is read, and the camera at that time.
    focusing: Option<([f32; 2], Camera, TextureReading)>,
    hints: Hints,
    /// Whether the controls are shown; `None` where the page's size decides.
    controls_shown: Option<bool>,
    /// A picture that is read back to be saved.
    saving: Option<save::Saving>,
    /// When the link was copied.
    copied: Option<Instant>,
    /// Changes of shader files.
    #[cfg(all(feature = "hot-reload", not(target_arch = "wasm32")))]
    shader_changes: std::sync::mpsc::Receiver<Result<crate::hot_reload::Changes, String>>,
}

impl Viewer {
    /// Opens the application on the device of its host. `address` is the state of a link; with `benchmark` in it, the
    /// benchmark page opens. `lost` is called with the reason if the device is lost.
    ///
    /// # Errors
    /// If the host has no wgpu device.
    pub fn new(
        context: &eframe::CreationContext,
        host: Box<dyn Host>,
        address: &str,
        lost: impl Fn(String) + Send + 'static,
    ) -> Result<Self, String> {
        let render = context.wgpu_render_state.as_ref().ok_or("the window was opened without a graphics device")?;
        let device_errors = DeviceErrors::default();
        let errors = device_errors.clone();
        render.device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let fix = "choose a smaller size or a smaller scene, then reload";
            let sentence = match error {
                wgpu::Error::OutOfMemory { .. } => format!("the graphics device is out of memory: {fix}"),
                other => format!("the graphics device reported an error ({other}): {fix}"),
            };
            let mut errors = errors.lock().unwrap_or_else(PoisonError::into_inner);
            if !errors.contains(&sentence) {
                errors.push(sentence);
            }
        }));
        render.device.set_device_lost_callback(move |reason, message| lost(format!("{reason:?}: {message}")));
        let info = render.adapter.get_info();
        let adapter = [&info.name, &info.driver].map(String::as_str).join(" ").trim().to_owned();
        let adapter = Some(adapter).filter(|name| !name.is_empty()).or_else(|| host.adapter());
        let adapter = adapter.unwrap_or_else(|| "unnamed adapter".into());
        let (benchmark, rest): (Vec<&str>, Vec<&str>) =
            address.split('&').partition(|part| part.starts_with("benchmark"));
        let link = rest.join("&");
        let (mut state, wrong) = address::read(if link.is_empty() { address::OPENING } else { &link });
        let (benchmark, home) = (!benchmark.is_empty(), state.camera);
        if benchmark {
            state.reference = false;
        }
        style(&context.egui_ctx);
        let mut messages = Messages::default();
        wrong.into_iter().for_each(|sentence| messages.add(Severity::Warning, sentence));
        Ok(Self {
            ctx: context.egui_ctx.clone(),
            host,
            undo: undo_from(&state),
            state,
            shown_address: String::new(),
            gpu: Gpu::new(render.device.clone(), render.queue.clone()),
            software: info.device_type == wgpu::DeviceType::Cpu || SOFTWARE.iter().any(|name| adapter.contains(name)),
            adapter,
            stage: None,
            loads: load::Loads::default(),
            sides: [None, None],
            motion: motion::Motion::default(),
            closed: Vec::new(),
            search: Default::default(),
            side_errors: [None, None],
            reference: ReferenceTracer::default(),
            reference_done: false,
            reference_noise: Comparison::default(),
            trade: Trade::default(),
            best: best::Best::default(),
            exposure: None,
            exposure_of: None,
            exposure_reading: None,
            messages,
            device_errors,
            device_error_count: 0,
            inbox: Arc::default(),
            playing: None,
            changed: Instant::now(),
            marks: Marks::default(),
            started: Instant::now(),
            first_picture: None,
            benchmark,
            ready: false,
            settled: false,
            checking: [false; 2],
            listing: [false; 2],
            screen: egui::Vec2::ZERO,
            picture_space: egui::Vec2::ZERO,
            home,
            fit_at_start: link.is_empty() && !benchmark,
            help: false,
            inspecting: false,
            solo: None,
            pointer: None,
            focusing: None,
            // A link shows something particular.
            hints: Hints { off: !link.is_empty(), ..Hints::default() },
            controls_shown: None,
            saving: None,
            copied: None,
            #[cfg(all(feature = "hot-reload", not(target_arch = "wasm32")))]
            shader_changes: crate::hot_reload::watch(context.egui_ctx.clone()),
        })
    }

    /// Opens the state of a link.
    pub fn go_to(&mut self, address: &str) {
        let (state, errors) = address::read(address);
        self.home = state.camera;
        self.state = state;
        errors.into_iter().for_each(|sentence| self.messages.add(Severity::Warning, sentence));
        (self.ready, self.settled, self.changed) = (false, false, Instant::now());
        self.ctx.request_repaint();
    }

    /// Opens files as if they had been dropped.
    pub fn open(&mut self, files: Vec<(String, Vec<u8>)>) {
        self.ctx.request_repaint();
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner).push(Ok(files));
    }

    /// Starts to read an output of side A by name.
    pub fn read_output(&self, name: &str) -> Option<TextureReading> {
        let texture = self.sides[0].as_ref()?.output(name)?;
        Some(TextureReading::new(&self.gpu, texture))
    }

    /// The state of the running application.
    pub fn report(&self) -> Report {
        let side = |side: &Side| SideReport {
            passes: side
                .times
                .medians()
                .map(|(name, part, ms)| PassReport {
                    name: name.to_owned(),
                    part: part.to_string(),
                    ms: ms.is_finite().then_some(ms),
                })
                .collect(),
            technique_ms: side.times.technique(),
            made_in: side.made_in,
            samples: side.samples(),
            rounds: side.times.rounds(),
            method: side.method.note().to_owned(),
            errors: Metric::ALL
                .into_iter()
                .filter_map(|metric| Some((metric.name().to_owned(), side.errors.get(metric)?.value())))
                .collect(),
            drawn: side.is_drawn() && side.picture().is_some(),
            check: side.check_results().map(|results| results.iter().map(CheckReport::of).collect()),
        };
        let reference = self.reference.found.as_ref();
        Report {
            address: address::write(&self.state),
            scene: self.stage.as_ref().map(|stage| stage.scene.name.clone()).unwrap_or_default(),
            messages: self.messages.texts(),
            device_errors: self.device_error_count,
            sides: self.sides.iter().flatten().map(side).collect(),
            reference_samples: reference.map_or(0, |reference| reference.samples),
            benchmark: self.benchmark,
            settled: self.settled,
            adapter: self.adapter.clone(),
            exposure: self.exposure_in_use(),
            frame: self.frame(),
            marks: self.marks.rectangles(),
            screen: self.screen.into(),
            tried: self.trade.tried.len(),
            best: self.best.report(),
            scene_ms: self.loads.milliseconds,
            first_picture_ms: self.first_picture.map(|time| time.as_secs_f64() * 1e3),
        }
    }

    /// [`Viewer::report`] as JSON.
    pub fn report_json(&self) -> String {
        serde_json::to_string(&self.report()).unwrap_or_default()
    }

    /// The view that is shown.
    fn view(&self) -> View {
        if self.solo == Some(Solo::Reference) { View::Reference } else { self.state.view.clone() }
    }

    /// The size of a picture that fills its space, with one pixel for each of the screen where the device is fast enough.
    fn fitting_size(&self, pixels_per_point: f32) -> [u32; 2] {
        fitting(self.picture_space * pixels_per_point, MOST_PIXELS[usize::from(!self.software)])
    }

    fn exposure_in_use(&self) -> Option<f32> {
        self.state.exposure.map(f32::exp2).or(self.exposure)
    }

    fn camera(&self) -> Camera {
        let own = || self.stage.as_ref().map(|stage| stage.camera(self.frame()));
        self.state.camera.or_else(own).unwrap_or_default()
    }

    /// Whether the page covers the interface with a picture of its own, until there is a first one here. Painting takes a
    /// software adapter longer than all the rest.
    fn is_covered(&self) -> bool {
        let laid_out = self.picture_space != egui::Vec2::ZERO;
        laid_out
            && self.software
            && self.host.covers_until_first_picture()
            && self.first_picture.is_none()
            && self.messages.is_empty()
            && !self.benchmark
    }

    /// Rounds of repetitions after which a median is shown.
    fn rounds(&self) -> usize {
        if self.benchmark { benchmark::ROUNDS } else { ROUNDS }
    }

    /// The current frame number of the animation.
    fn frame(&self) -> u32 {
        self.playing.map_or(self.state.frame, |playing| playing.frame)
    }

    /// The lights with the changes of the state and the rotation of a playing light.
    fn lights_now(&self, stage: &Stage) -> Vec<Light> {
        let mut lights = self.state.lights(&stage.original_lights);
        if let (Some(playing), Some(light), false) = (self.playing, lights.first_mut(), stage.is_animated()) {
            *light = rotated(light, playing.angle, stage.centre()).apply(light);
        }
        lights
    }
}

/// A size with the shape of this space, in pixels, of at most so many pixels.
fn fitting(space: egui::Vec2, most_pixels: f32) -> [u32; 2] {
    let scale = (most_pixels / (space.x * space.y).max(1.0)).sqrt().min(1.0);
    [space.x, space.y].map(|side| (side * scale).round().clamp(SIDES_OF_PICTURE[0], SIDES_OF_PICTURE[1]) as u32)
}

impl eframe::App for Viewer {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        self.marks.clear();
        self.sides.iter_mut().flatten().for_each(Side::free_old);
        self.motion.free_old();
        self.closed.drain(..).for_each(Side::destroy);
        (self.checking, self.listing) = ([false; 2], [false; 2]);
        self.screen = ui.max_rect().size();
        let ctx = ui.ctx().clone();
        self.receive(&ctx);
        #[cfg(all(feature = "hot-reload", not(target_arch = "wasm32")))]
        self.reload_shaders();
        // The animation advances once the picture of the last frame is drawn.
        if self.has_drawn()
            && let (Some(playing), Some(stage)) = (&mut self.playing, &self.stage)
        {
            *playing = playing.step(stage.is_animated().then(|| stage.scene.moves.last_frame()));
        }
        let before = (self.state.camera, self.state.lights.clone(), self.state.frame);
        let sides = self.state.sides.clone();
        // A view or a configuration without a picture has a sentence instead.
        let pictured = match &self.sides[0] {
            Some(side) => side.is_looked_at(),
            None => self.side_errors[0].is_some() && self.loads.step().is_none(),
        };
        if pictured || !self.is_covered() {
            self.interface(ui);
        }
        self.hints.settings |= sides != self.state.sides;
        self.hints.play |= self.playing.is_some();
        if before != (self.state.camera, self.state.lights.clone(), self.state.frame) {
            self.changed = Instant::now();
            self.motion.moved();
        }
        if let Some(render) = frame.wgpu_render_state() {
            self.advance(&ctx, &mut render.renderer.write());
        }
        // The interface has shown it in this pass.
        if self.first_picture.is_none() && pictured {
            self.first_picture = Some(self.started.elapsed());
            self.host.first_picture();
            ctx.request_repaint();
        }
        // An undo step ends when no button and no key is down.
        if !ctx.input(|i| i.pointer.any_down() || !i.keys_down.is_empty()) {
            commit(&mut self.undo, &self.state);
            let now = address::write(&self.state);
            if now != self.shown_address {
                self.host.show_address(&now);
                self.shown_address = now;
            }
        }
        if self.changed.elapsed() < REST {
            ctx.request_repaint_after(REST);
        }
    }

    #[cfg(target_arch = "wasm32")]
    fn as_any_mut(&mut self) -> Option<&mut dyn std::any::Any> {
        Some(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_opening_picture_fills_its_space() {
        assert_eq!(fitting(egui::vec2(918.0, 700.0), 1e9), [918, 700]);
        let [width, height] = fitting(egui::vec2(918.0, 700.0), MOST_PIXELS[0]);
        assert!(width * height <= 231_000 && (width as f32 / height as f32 - 918.0 / 700.0).abs() < 0.01);
        assert_eq!(fitting(egui::Vec2::ZERO, MOST_PIXELS[0]), [64, 64]);
    }
}
