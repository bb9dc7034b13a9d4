//! Input from outside: dropped files, errors of the device, scenes to load.

use std::sync::PoisonError;

use eframe::egui;
use halflight_renderer::scene::SceneSize;
use halflight_scenes::Scene;
use web_time::Instant;

use super::Viewer;
#[cfg(all(feature = "hot-reload", not(target_arch = "wasm32")))]
use crate::side::Side;
use crate::{messages::Severity, plot::Trade, reference::ReferenceTracer, scenes, stage::Stage, state::DROPPED};

/// Warnings of a scene that are shown.
const MOST_WARNINGS: usize = 4;

impl Viewer {
    /// Opens dropped files and shows errors of the device.
    pub(super) fn receive(&mut self, ctx: &egui::Context) {
        let errors: Vec<_> = self.device_errors.lock().unwrap_or_else(PoisonError::into_inner).drain(..).collect();
        self.device_error_count += errors.len();
        errors.into_iter().for_each(|sentence| self.messages.add(Severity::Failure, sentence));
        let files = ctx.input(|i| i.raw.dropped_files.clone());
        if !files.is_empty() {
            self.read_dropped(ctx, files);
        }
        let arrived: Vec<_> = self.inbox.lock().unwrap_or_else(PoisonError::into_inner).drain(..).collect();
        for files in arrived {
            if let Err(sentence) = files.and_then(|files| self.open_now(files)) {
                self.messages.add(Severity::Failure, sentence);
            }
        }
    }

    /// Uses changed shaders. A shader that cannot be compiled is reported and keeps its old source.
    #[cfg(all(feature = "hot-reload", not(target_arch = "wasm32")))]
    pub(super) fn reload_shaders(&mut self) {
        while let Ok(changes) = self.shader_changes.try_recv() {
            let changes = changes.unwrap_or_else(|error| {
                self.messages.add(Severity::Failure, format!("shaders are not reloaded: {error}"));
                Vec::new()
            });
            let mut replaced = 0;
            for (name, source) in changes {
                match (source, halflight_shared_shaders::shader(&name)) {
                    (Ok(source), Some(shader)) => {
                        self.gpu.replace_source(shader, source);
                        replaced += 1;
                    }
                    (Ok(_), None) => {
                        let sentence = format!("{name} is a new shader: build the program again to use it");
                        self.messages.add(Severity::Warning, sentence);
                    }
                    (Err(error), _) => self.messages.add(Severity::Failure, error),
                }
            }
            if replaced > 0 {
                // Everything that was made with the old shaders is made again.
                self.sides.iter_mut().filter_map(Option::take).for_each(Side::destroy);
                self.reference = ReferenceTracer::default();
                self.reference_done = false;
                self.trade = Trade::default();
                self.best.stop();
                self.messages.add(Severity::Note, format!("{replaced} shaders were reloaded"));
            }
        }
    }

    #[cfg(target_arch = "wasm32")]
    fn read_dropped(&mut self, ctx: &egui::Context, files: Vec<egui::DroppedFileHandle>) {
        let (inbox, ctx) = (self.inbox.clone(), ctx.clone());
        wasm_bindgen_futures::spawn_local(async move {
            let mut read = Vec::new();
            for file in files {
                let name = file.path().to_string_lossy().into_owned();
                read.push(match file.bytes_async().await {
                    Ok(bytes) => Ok((name, bytes)),
                    Err(reason) => Err(format!("{name} cannot be read ({reason}); drop it again")),
                });
            }
            inbox.lock().unwrap_or_else(PoisonError::into_inner).push(read.into_iter().collect());
            ctx.request_repaint();
        });
    }

    #[cfg(not(target_arch = "wasm32"))]
    fn read_dropped(&mut self, _: &egui::Context, files: Vec<egui::DroppedFileHandle>) {
        // A single model is opened from disk, where its materials are beside it.
        if let ([file], true) = (files.as_slice(), self.host.reads_disk())
            && file
                .path()
                .extension()
                .is_some_and(|e| ["obj", "gltf", "glb", "toml"].iter().any(|known| e.eq_ignore_ascii_case(known)))
            && !scenes::is_preset(file.bytes().as_deref().unwrap_or_default())
        {
            match halflight_scenes::load_scene(&halflight_scenes::DiskFiles, file.path()) {
                Ok(mut scene) => {
                    let warnings = std::mem::take(&mut scene.warnings);
                    self.open_scene(scene, warnings);
                }
                Err(error) => self.messages.add(Severity::Failure, error.to_string()),
            }
            return;
        }
        let read = files.iter().map(|file| {
            let name = file.path().file_name().unwrap_or_default().to_string_lossy().into_owned();
            file.bytes()
                .map(|bytes| (name.clone(), bytes))
                .map_err(|reason| format!("{name} cannot be read ({reason})"))
        });
        let read = read.collect();
        self.inbox.lock().unwrap_or_else(PoisonError::into_inner).push(read);
    }

    fn open_now(&mut self, files: Vec<(String, Vec<u8>)>) -> Result<(), String> {
        let opened = scenes::dropped(files).map_err(|error| error.to_string())?;
        let mut scene = opened.scene;
        if let (Some(environment), Some(stage)) = (opened.environment, &self.stage) {
            let mut lit = stage.scene.clone();
            lit.lights.clone_from(&stage.original_lights);
            lit.environment = Some(environment);
            scene = Some(lit);
        }
        if let Some(scene) = scene {
            self.open_scene(scene, opened.warnings);
        }
        for (name, preset) in opened.presets {
            crate::panels::apply(&mut self.state.sides[0], &preset);
            self.messages.add(Severity::Note, format!("{name} was applied to A"));
        }
        Ok(())
    }

    fn open_scene(&mut self, scene: Scene, warnings: Vec<String>) {
        self.messages.clear();
        let more = warnings.len().saturating_sub(MOST_WARNINGS);
        warnings.into_iter().take(MOST_WARNINGS).for_each(|warning| self.messages.add(Severity::Warning, warning));
        if more > 0 {
            let sentence = format!("{more} more warnings: `evaluator render` prints all of them");
            self.messages.add(Severity::Warning, sentence);
        }
        self.dropped = Some(scene);
        self.loaded.clear();
        self.state.open(DROPPED);
        self.home = None;
    }

    /// Loads the scene of the state; false while there is no scene to draw.
    pub(super) fn load(&mut self) -> bool {
        if self.loaded == self.state.scene {
            return self.stage.is_some();
        }
        // Loading blocks, so the loading message is painted first.
        if !std::mem::replace(&mut self.announced, true) {
            return false;
        }
        self.announced = false;
        self.loaded.clone_from(&self.state.scene);
        let begun = Instant::now();
        let scene = match self.dropped.as_ref().filter(|_| self.state.scene == DROPPED) {
            Some(scene) => Ok(scene.clone()),
            None => halflight_scenes::bundled::scene(&self.state.scene),
        };
        // A scene that does not load or fit leaves the old one in place.
        let limits = self.gpu.limits();
        let fitting = scene.map_err(|error| error.to_string()).and_then(|scene| {
            SceneSize::of(&scene).check(&limits).map_err(|error| error.to_string())?;
            Ok(scene)
        });
        let scene = match fitting {
            Ok(scene) => scene,
            Err(sentence) => {
                self.messages.add(Severity::Failure, sentence);
                return self.stage.is_some();
            }
        };
        self.closed.extend(self.sides.iter_mut().filter_map(Option::take));
        self.reference = ReferenceTracer::default();
        self.reference_done = false;
        self.trade = Trade::default();
        self.best.forget();
        (self.exposure, self.exposure_of, self.exposure_reading) = (None, None, None);
        (self.stage, self.playing) = (None, None);
        let read = begun.elapsed();
        self.stage = Some(Stage::new(&self.gpu, scene, self.software));
        self.scene_ms = [read, begun.elapsed() - read].map(|time| time.as_secs_f64() * 1e3);
        self.stage.is_some()
    }
}
