//! The application: its state, and the loop that brings scene, sides and truth in line with it.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError},
};

use eframe::{
    egui::{self, Rect},
    egui_wgpu::{WgpuConfiguration, WgpuSetup, WgpuSetupCreateNew},
};
use halflight_frame_graph::Gpu;
use halflight_scenes::{Camera, Scene};
use web_time::{Duration, Instant};

use crate::{
    address,
    background::{Background, Subject},
    plot::Trade,
    readback::TextureReading,
    report::{PassReport, Report, ScannedReport, SideReport},
    stage::{Side, Stage},
    state::{LightChange, State},
    undo::Undo,
};

mod advance;
mod interface;
mod receive;

/// Time for which the camera must rest before the path tracer starts.
const REST: Duration = Duration::from_millis(500);
/// Radians a second that a playing light turns.
const PLAY_SPEED: f32 = 0.4;
/// Frames for which a scene rests after its last one before it plays again.
const PLAY_PAUSE: u32 = 12;

/// Parts of the names of software adapters, as browsers give them.
const SOFTWARE: [&str; 4] = ["swiftshader", "llvmpipe", "lavapipe", "Basic Render"];

/// What the surroundings do for the application: a page or a window.
pub trait Host {
    /// Shows the state where a link can be copied from.
    fn show_address(&mut self, state: &str);
    /// The link that brings this state back.
    fn link(&self, state: &str) -> String;
    /// Gives a file to the user; returns a sentence that says where it went, or why it did not.
    fn save(&mut self, name: &str, contents: &str) -> String;
    /// What the host knows of the adapter, where wgpu knows nothing.
    fn adapter(&self) -> Option<String> {
        None
    }
    /// Called once, when the first picture is on the screen.
    fn first_picture(&mut self) {}
    /// Whether files on disk can be read by their path.
    fn reads_disk(&self) -> bool {
        false
    }
}

/// What can go wrong with the device, shared with the device's own callbacks.
type Said = Arc<Mutex<Vec<String>>>;

/// Files that were dropped together, by name, or why they cannot be read.
type Dropped = Result<Vec<(String, Vec<u8>)>, String>;

/// Places of controls by name, for tests.
#[derive(Default)]
pub struct Marks(BTreeMap<String, Rect>);

impl Marks {
    /// Notes where a control is.
    pub fn add(&mut self, name: &str, rect: Rect) {
        self.0.insert(name.to_owned(), rect);
    }
}

/// How a device is opened for the application: what the renderer wants of it, nothing else.
pub fn configuration() -> WgpuConfiguration {
    let mut setup = WgpuSetupCreateNew::without_display_handle();
    setup.instance_descriptor.backends = wgpu::Backends::from_env().unwrap_or(wgpu::Backends::PRIMARY);
    setup.device_descriptor = Arc::new(|adapter| wgpu::DeviceDescriptor {
        label: Some("halflight"),
        required_features: adapter.features() & Gpu::WANTED_FEATURES,
        required_limits: Gpu::wanted_limits(&adapter.limits()),
        ..Default::default()
    });
    WgpuConfiguration { wgpu_setup: WgpuSetup::CreateNew(setup), ..Default::default() }
}

/// What moves while the picture plays.
#[derive(Clone, Copy, Debug)]
struct Playing {
    /// Number of the frame.
    frame: u32,
    /// Angle of the first light, radians, where nothing else moves.
    angle: f32,
    /// When the last step was taken.
    stepped: Instant,
}

impl Playing {
    /// The next frame, after `last` the first one again. Steps of light are bounded, so that a slow picture does not leap.
    fn step(self, last: Option<u32>) -> Self {
        let seconds = self.stepped.elapsed().as_secs_f32().min(0.1);
        let frame = match last {
            Some(last) if self.frame >= last + PLAY_PAUSE => 0,
            _ => self.frame.wrapping_add(1),
        };
        Self { frame, angle: self.angle + PLAY_SPEED * seconds, stepped: Instant::now() }
    }
}

/// The interactive application.
pub struct Viewer {
    ctx: egui::Context,
    host: Box<dyn Host>,
    /// The state. Change it, and the picture follows.
    state: State,
    undo: Undo,
    shown_address: String,
    gpu: Gpu,
    adapter: String,
    software: bool,
    stage: Option<Stage>,
    /// Scene of `stage`, or the one that could not be loaded.
    loaded: String,
    dropped: Option<Scene>,
    announced: bool,
    sides: [Option<Side>; 2],
    complaints: [Option<String>; 2],
    background: Background,
    truth_done: bool,
    trade: Trade,
    exposure: Option<f32>,
    exposure_of: Option<Subject>,
    exposure_reading: Option<(Subject, TextureReading)>,
    messages: Vec<String>,
    said: Said,
    inbox: Arc<Mutex<Vec<Dropped>>>,
    playing: Option<Playing>,
    changed: Instant,
    marks: Marks,
    started: Instant,
    first_picture: Option<Duration>,
    benchmark: bool,
    ready: bool,
    settled: bool,
    /// Sides whose scan somebody looks at.
    checking: [bool; 2],
    screen: egui::Vec2,
}

impl Viewer {
    /// Opens the application on the device of its host. `address` is a state as a link has it; with `benchmark` in it
    /// the benchmark page opens.
    ///
    /// # Errors
    /// Where the host has no wgpu device.
    pub fn new(
        context: &eframe::CreationContext,
        host: Box<dyn Host>,
        address: &str,
        lost: impl Fn(String) + Send + 'static,
    ) -> Result<Self, String> {
        let render = context.wgpu_render_state.as_ref().ok_or("the window was opened without a graphics device")?;
        let said = Said::default();
        let errors = said.clone();
        render.device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            let mend = "choose a smaller size or a smaller scene, then reload";
            let sentence = match error {
                wgpu::Error::OutOfMemory { .. } => format!("the graphics device is out of memory: {mend}"),
                other => format!("the graphics device refused something ({other}): {mend}"),
            };
            let mut said = errors.lock().unwrap_or_else(PoisonError::into_inner);
            if !said.contains(&sentence) {
                said.push(sentence);
            }
        }));
        render.device.set_device_lost_callback(move |reason, message| lost(format!("{reason:?}: {message}")));
        let info = render.adapter.get_info();
        let adapter = [&info.name, &info.driver].map(String::as_str).join(" ").trim().to_owned();
        let adapter = Some(adapter).filter(|name| !name.is_empty()).or_else(|| host.adapter());
        let adapter = adapter.unwrap_or_else(|| "unnamed adapter".into());
        let (benchmark, rest): (Vec<&str>, Vec<&str>) =
            address.split('&').partition(|part| part.starts_with("benchmark"));
        let (mut state, messages) = address::read(&rest.join("&"));
        let benchmark = !benchmark.is_empty();
        if benchmark {
            state.truth = false;
        }
        interface::style(&context.egui_ctx);
        Ok(Self {
            ctx: context.egui_ctx.clone(),
            host,
            undo: Undo::new(&state),
            state,
            shown_address: String::new(),
            gpu: Gpu::new(render.device.clone(), render.queue.clone()),
            software: info.device_type == wgpu::DeviceType::Cpu || SOFTWARE.iter().any(|name| adapter.contains(name)),
            adapter,
            stage: None,
            loaded: String::new(),
            dropped: None,
            announced: false,
            sides: [None, None],
            complaints: [None, None],
            background: Background::default(),
            truth_done: false,
            trade: Trade::default(),
            exposure: None,
            exposure_of: None,
            exposure_reading: None,
            messages,
            said,
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
            screen: egui::Vec2::ZERO,
        })
    }

    /// Takes over the state of a link.
    pub fn go_to(&mut self, address: &str) {
        let (state, complaints) = address::read(address);
        self.state = state;
        self.messages.extend(complaints);
        (self.ready, self.settled, self.changed) = (false, false, Instant::now());
        self.ctx.request_repaint();
    }

    /// Opens files as if they had been dropped.
    pub fn open(&mut self, files: Vec<(String, Vec<u8>)>) {
        self.ctx.request_repaint();
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner).push(Ok(files));
    }

    /// Loses the device, to see what happens then.
    pub fn lose_device(&self) {
        self.gpu.device.destroy();
    }

    /// An output of side A by name, on its way back from the device.
    pub fn read_output(&self, name: &str) -> Option<TextureReading> {
        let texture = self.sides[0].as_ref()?.output(name)?;
        Some(TextureReading::new(&self.gpu, texture))
    }

    /// What there is to know about the running application.
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
            rounds: side.times.rounds(),
            method: side.method.note().to_owned(),
            rel_mse: side.rel_mse,
            drawn: side.is_drawn() && side.picture().is_some(),
            scanned: side.scanned().map(|found| found.iter().map(ScannedReport::of).collect()),
        };
        let place = |rect: &Rect| [rect.left(), rect.top(), rect.width(), rect.height()];
        let known = self.background.known.as_ref();
        Report {
            address: address::write(&self.state),
            scene: self.stage.as_ref().map(|stage| stage.scene.name.clone()).unwrap_or_default(),
            messages: self.messages.clone(),
            sides: self.sides.iter().flatten().map(side).collect(),
            truth_samples: known.map_or(0, |known| known.samples),
            truth_noise: known.and_then(|known| known.noise),
            settled: self.settled,
            adapter: self.adapter.clone(),
            exposure: self.exposure_in_use(),
            frame: self.frame(),
            marks: self.marks.0.iter().map(|(name, rect)| (name.clone(), place(rect))).collect(),
            screen: self.screen.into(),
            tried: self.trade.tried.len(),
            first_picture_ms: self.first_picture.map(|time| time.as_secs_f64() * 1e3),
        }
    }

    /// [`Viewer::report`] as JSON.
    pub fn report_json(&self) -> String {
        serde_json::to_string(&self.report()).unwrap_or_default()
    }

    fn exposure_in_use(&self) -> Option<f32> {
        self.state.exposure.map(f32::exp2).or(self.exposure)
    }

    fn camera(&self) -> Camera {
        let own = || self.stage.as_ref().map(|stage| stage.camera(self.frame()));
        self.state.camera.or_else(own).unwrap_or_default()
    }

    /// Number of the frame: where what moves stands.
    fn frame(&self) -> u32 {
        self.playing.map_or(self.state.frame, |playing| playing.frame)
    }

    fn say(&mut self, sentence: impl Into<String>) {
        const MOST: usize = 5;
        let sentence = sentence.into();
        self.messages.retain(|said| *said != sentence);
        self.messages.push(sentence);
        if self.messages.len() > MOST {
            self.messages.remove(0);
        }
    }

    /// The state with the playing light where it is now.
    fn lights_now(&self, stage: &Stage) -> Vec<halflight_scenes::Light> {
        let mut lights = self.state.lights(&stage.original_lights);
        if let (Some(playing), Some(light), false) = (self.playing, lights.first_mut(), stage.moves()) {
            *light = turned(light, playing.angle, stage.centre()).apply(light);
        }
        lights
    }
}

/// The light, turned by this angle about the vertical: its direction, or its place where it has no direction.
fn turned(light: &halflight_scenes::Light, angle: f32, centre: glam::Vec3) -> LightChange {
    let mut change = LightChange::none(light);
    let turn = glam::Quat::from_rotation_y(angle);
    if let halflight_scenes::Light::Point { position, .. } = light {
        change.position = (centre + turn * (glam::Vec3::from(*position) - centre)).to_array();
    } else {
        change.direction = (turn * glam::Vec3::from(change.direction)).to_array();
    }
    change
}

impl eframe::App for Viewer {
    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        self.marks.0.clear();
        self.checking = [false; 2];
        self.screen = ui.max_rect().size();
        let ctx = ui.ctx().clone();
        self.receive(&ctx);
        // The next step waits for the picture of the last one.
        if self.sides.iter().flatten().all(Side::is_drawn)
            && let (Some(playing), Some(stage)) = (&mut self.playing, &self.stage)
        {
            *playing = playing.step(stage.moves().then(|| stage.scene.moves.last_frame()));
        }
        let before = (self.state.camera, self.state.lights.clone(), self.state.frame);
        self.interface(ui);
        if before != (self.state.camera, self.state.lights.clone(), self.state.frame) {
            self.changed = Instant::now();
        }
        if let Some(render) = frame.wgpu_render_state() {
            self.advance(&ctx, &mut render.renderer.write());
        }
        if self.first_picture.is_none()
            && self.sides[0].as_ref().is_some_and(|side| side.is_drawn() && side.picture().is_some())
        {
            self.first_picture = Some(self.started.elapsed());
            self.host.first_picture();
        }
        // A step of undo ends when nothing is held any more.
        if !ctx.input(|i| i.pointer.any_down() || !i.keys_down.is_empty()) {
            self.undo.commit(&self.state);
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
