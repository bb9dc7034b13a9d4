//! Scenes that are loaded while the viewer runs.

use std::rc::Rc;

use eframe::egui;
use web_time::Instant;

use super::Viewer;
use crate::{
    loading::{Event, Found, Loaded, Loading, Source},
    messages::Severity,
    plot::Trade,
    reference::ReferenceTracer,
    stage::Stage,
    state::DROPPED,
};

/// Warnings of a scene that are shown.
const MOST_WARNINGS: usize = 4;

/// The user's own scene.
pub(super) struct Own {
    /// Its name.
    pub(super) name: String,
    source: Rc<Source>,
}

/// Scenes on their way to the device.
#[derive(Default)]
pub(super) struct Loads {
    /// Name of the scene of the stage, or of the scene that is loaded or could not be.
    name: String,
    /// The scene of this name, until it has its BVH.
    scene: Option<Loading>,
    /// Whether the scene of this name cannot be drawn yet.
    waits: bool,
    /// Files that were opened. Their scene is not shown before it can be drawn.
    opened: Option<Loading>,
    /// An animated scene in one frame, for the path tracer.
    posed: Option<Posing>,
    /// The source of the stage's scene.
    source: Option<Rc<Source>>,
    /// The user's own scene.
    pub(super) own: Option<Own>,
    begun: Option<Instant>,
    /// Milliseconds until the scene was read, until it could be drawn, and until it had its BVH.
    pub(super) milliseconds: [f64; 3],
}

/// An animated scene in one frame, on its way to the device.
struct Posing {
    frame: u32,
    loading: Loading,
    loaded: Option<Box<Loaded>>,
}

impl Loads {
    fn has_reached(&mut self, step: usize) {
        self.milliseconds[step] = self.begun.map_or(0.0, |begun| begun.elapsed().as_secs_f64() * 1e3);
    }

    /// Whether the wanted scene could not be loaded.
    pub(super) fn has_failed(&self, wanted: &str) -> bool {
        self.name == wanted && !self.waits
    }

    /// What is being done, for the user; `None` if everything is there.
    pub(super) fn step(&self) -> Option<&'static str> {
        self.opened.as_ref().or(self.scene.as_ref()).map(|loading| loading.step)
    }

    /// Whether the stage shows another scene than the wanted one, because that is still being loaded.
    pub(super) fn is_waiting(&self) -> bool {
        self.waits
    }
}

impl Viewer {
    /// Continues to load the scene of the state, and files that were opened; false while there is no scene to draw.
    pub(super) fn load(&mut self, ctx: &egui::Context) -> bool {
        self.load_opened(ctx);
        if self.loads.name != self.state.scene {
            let source = match self.loads.own.as_ref().filter(|_| self.state.scene == DROPPED) {
                Some(own) => own.source.clone(),
                None => Rc::new(Source::Bundled(self.state.scene.clone())),
            };
            (self.loads.begun, self.loads.milliseconds) = (Some(Instant::now()), [0.0; 3]);
            self.loads.name.clone_from(&self.state.scene);
            self.loads.scene = Some(self.start(ctx, source));
            self.loads.waits = true;
        }
        while let Some(loading) = &mut self.loads.scene {
            match loading.advance(&self.gpu, ctx) {
                Some(Event::Read { .. }) => self.loads.has_reached(0),
                Some(Event::Drawable(loaded)) => {
                    let source = loading.source.clone();
                    self.show(*loaded, source);
                }
                Some(Event::Bvh(bvh)) => {
                    self.loads.has_reached(2);
                    if let Some(stage) = &mut self.stage {
                        stage.set_bvh(bvh);
                    }
                }
                // A scene that does not load or fit leaves the old one in place.
                Some(Event::Failed(sentence)) => {
                    self.loads.waits = false;
                    self.messages.add(Severity::Failure, sentence);
                }
                None => break,
            }
        }
        self.loads.scene.take_if(|loading| loading.has_ended());
        self.stage.is_some() && !self.loads.waits
    }

    fn start(&mut self, ctx: &egui::Context, source: Rc<Source>) -> Loading {
        Loading::start(source, ctx, |source, delivery| self.host.load(source, delivery))
    }

    /// The scene that an environment map would light.
    pub(super) fn scene_source(&self) -> Option<Source> {
        match &**self.loads.source.as_ref()? {
            // Its environment map would be replaced.
            Source::Files(_, Some(under)) => Some((**under).clone()),
            source => Some(source.clone()),
        }
    }

    /// Opens the contents of a source.
    pub(super) fn open_source(&mut self, ctx: &egui::Context, source: Source) {
        self.loads.opened = Some(self.start(ctx, Rc::new(source)));
    }

    /// Continues to load files that were opened.
    fn load_opened(&mut self, ctx: &egui::Context) {
        while let Some(loading) = &mut self.loads.opened {
            match loading.advance(&self.gpu, ctx) {
                Some(Event::Read { has_scene, found }) => {
                    if let (Source::Files(_, under), false) = (Rc::make_mut(&mut loading.source), found.is_lit) {
                        *under = None;
                    }
                    if has_scene {
                        self.messages.clear();
                    }
                    self.take_found(found);
                }
                Some(Event::Drawable(loaded)) => {
                    let source = loading.source.clone();
                    self.loads.own = Some(Own { name: loaded.scene.name.clone(), source: source.clone() });
                    self.loads.scene = self.loads.opened.take();
                    DROPPED.clone_into(&mut self.loads.name);
                    self.state.open(DROPPED);
                    self.home = None;
                    self.show(*loaded, source);
                }
                Some(Event::Bvh(_)) => {}
                Some(Event::Failed(sentence)) => self.messages.add(Severity::Failure, sentence),
                None => break,
            }
        }
        self.loads.opened.take_if(|loading| loading.has_ended());
    }

    /// Shows warnings and applies presets.
    fn take_found(&mut self, found: Found) {
        let more = found.warnings.len().saturating_sub(MOST_WARNINGS);
        let warnings = found.warnings.into_iter().take(MOST_WARNINGS);
        warnings.for_each(|warning| self.messages.add(Severity::Warning, warning));
        if more > 0 {
            let sentence = format!("{more} more warnings: `evaluator render` prints all of them");
            self.messages.add(Severity::Warning, sentence);
        }
        for (name, text) in found.presets {
            match halflight_techniques::preset::Preset::read(name.as_ref(), &text) {
                Ok(preset) => {
                    crate::panels::apply(&mut self.state.sides[0], &preset);
                    self.messages.add(Severity::Note, format!("{name} was applied to A"));
                }
                Err(error) => self.messages.add(Severity::Failure, error.to_string()),
            }
        }
    }

    /// Shows a scene.
    fn show(&mut self, loaded: Loaded, source: Rc<Source>) {
        self.closed.extend(self.sides.iter_mut().filter_map(Option::take));
        self.closed.extend(self.motion.take());
        self.reference = ReferenceTracer::default();
        self.reference_done = false;
        self.trade = Trade::default();
        self.best.forget();
        (self.exposure, self.exposure_of, self.exposure_reading) = (None, None, None);
        self.playing = None;
        self.stage = Some(Stage::new(loaded, self.software));
        (self.loads.source, self.loads.posed, self.loads.waits) = (Some(source), None, false);
        self.loads.has_reached(1);
    }

    /// Continues to load an animated scene as it is in this frame, for the path tracer.
    pub(super) fn load_posed(&mut self, ctx: &egui::Context, stage: &mut Stage, frame: u32) {
        if !stage.is_animated() || stage.posed_frame() == Some(frame) {
            return;
        }
        if self.loads.posed.as_ref().is_none_or(|posing| posing.frame != frame) {
            let Some(source) = &self.loads.source else { return };
            let posed = Source::Posed(Box::new((**source).clone()), frame);
            let loading = self.start(ctx, Rc::new(posed));
            self.loads.posed = Some(Posing { frame, loading, loaded: None });
        }
        let Some(posing) = &mut self.loads.posed else { return };
        while let Some(event) = posing.loading.advance(&self.gpu, ctx) {
            let failed = match event {
                Event::Read { .. } => None,
                Event::Drawable(loaded) => {
                    posing.loaded = Some(loaded);
                    None
                }
                Event::Bvh(Ok(bvh)) => {
                    if let Some(loaded) = posing.loaded.take() {
                        stage.set_posed(&self.gpu, frame, *loaded, *bvh);
                    }
                    None
                }
                Event::Bvh(Err(error)) => Some(error.to_string()),
                Event::Failed(sentence) => Some(sentence),
            };
            if let Some(sentence) = failed {
                self.state.reference = false;
                self.messages.add(Severity::Warning, format!("{sentence}; the reference is switched off"));
            }
        }
        if posing.loading.has_ended() {
            self.loads.posed = None;
        }
    }
}
