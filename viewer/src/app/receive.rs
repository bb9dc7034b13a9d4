//! What comes in: dropped files, what the device says, scenes to load.

use std::sync::PoisonError;

use eframe::egui;
use halflight_scenes::Scene;

use super::Viewer;
use crate::{background::Background, plot::Trade, scenes, stage::Stage, state::DROPPED};

impl Viewer {
    /// Takes what was dropped, and what the device complained about.
    pub(super) fn receive(&mut self, ctx: &egui::Context) {
        let said: Vec<_> = self.said.lock().unwrap_or_else(PoisonError::into_inner).drain(..).collect();
        said.into_iter().for_each(|sentence| self.say(sentence));
        let files = ctx.input(|i| i.raw.dropped_files.clone());
        if !files.is_empty() {
            self.read_dropped(ctx, files);
        }
        let arrived: Vec<_> = self.inbox.lock().unwrap_or_else(PoisonError::into_inner).drain(..).collect();
        for files in arrived {
            if let Err(sentence) = files.and_then(|files| self.open_now(files)) {
                self.say(sentence);
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
        // A single model on disk finds its materials beside itself.
        if let ([file], true) = (files.as_slice(), self.host.reads_disk())
            && file.path().extension().is_some_and(|e| e.eq_ignore_ascii_case("obj") || e.eq_ignore_ascii_case("toml"))
            && !is_preset(file.bytes().as_deref().unwrap_or_default())
        {
            match halflight_scenes::load_scene(&halflight_scenes::DiskFiles, file.path()) {
                Ok(scene) => self.take_scene(scene),
                Err(error) => self.say(error.to_string()),
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
        if let [(name, bytes)] = files.as_slice()
            && name.ends_with(".toml")
            && is_preset(bytes)
        {
            let text = String::from_utf8_lossy(bytes);
            let preset =
                halflight_techniques::preset::Preset::read(name.as_ref(), &text).map_err(|error| error.to_string())?;
            crate::panels::apply(&mut self.state.sides[0], &preset);
            self.say(format!("{name} was taken over for A"));
            return Ok(());
        }
        let scene = scenes::dropped(files).map_err(|error| error.to_string())?;
        self.take_scene(scene);
        Ok(())
    }

    fn take_scene(&mut self, scene: Scene) {
        self.messages.clear();
        for warning in scene.warnings.iter().take(3) {
            self.say(warning.clone());
        }
        self.dropped = Some(scene);
        self.loaded.clear();
        self.state.open(DROPPED);
    }

    /// Loads the scene that the state names; false where the picture has to wait for it.
    pub(super) fn load(&mut self) -> bool {
        if self.loaded == self.state.scene {
            return self.stage.is_some();
        }
        // Loading takes a while; what it waits for is on the screen before it begins.
        if !std::mem::replace(&mut self.announced, true) {
            return false;
        }
        self.announced = false;
        self.loaded.clone_from(&self.state.scene);
        let scene = match self.dropped.as_ref().filter(|_| self.state.scene == DROPPED) {
            Some(scene) => Ok(scene.clone()),
            None => scenes::bundled(&self.state.scene),
        };
        self.sides = [None, None];
        self.background = Background::default();
        self.trade = Trade::default();
        (self.exposure, self.exposure_of, self.exposure_reading) = (None, None, None);
        (self.stage, self.playing) = (None, None);
        match scene {
            Ok(scene) => self.stage = Some(Stage::new(&self.gpu, scene, self.software)),
            Err(error) => self.say(error.to_string()),
        }
        self.stage.is_some()
    }
}

/// Whether a TOML file is a preset: it names a technique and no scene.
fn is_preset(bytes: &[u8]) -> bool {
    String::from_utf8_lossy(bytes).lines().any(|line| line.trim_start().starts_with("technique"))
}
