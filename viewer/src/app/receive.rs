//! Input from outside: dropped files, errors of the device.

use std::sync::PoisonError;

use eframe::egui;

use super::Viewer;
#[cfg(all(feature = "hot-reload", not(target_arch = "wasm32")))]
use crate::side::Side;
use crate::{
    loading::{File, Source},
    messages::Severity,
    scenes,
};
#[cfg(all(feature = "hot-reload", not(target_arch = "wasm32")))]
use crate::{plot::Trade, reference::ReferenceTracer};

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
            match files {
                Ok(files) => self.open_files(ctx, files),
                Err(sentence) => self.messages.add(Severity::Failure, sentence),
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
                self.motion.take().for_each(Side::destroy);
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
    fn read_dropped(&mut self, ctx: &egui::Context, files: Vec<egui::DroppedFileHandle>) {
        // A single model is opened from disk, where its materials are beside it.
        if let ([file], true) = (files.as_slice(), self.host.reads_disk())
            && file
                .path()
                .extension()
                .is_some_and(|e| ["obj", "gltf", "glb", "toml"].iter().any(|known| e.eq_ignore_ascii_case(known)))
            && !scenes::is_preset(file.bytes().as_deref().unwrap_or_default())
        {
            self.open_source(ctx, Source::Disk(file.path().to_owned()));
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

    /// Opens files that were dropped together.
    fn open_files(&mut self, ctx: &egui::Context, files: Vec<(String, Vec<u8>)>) {
        // An environment map lights the scene that is shown.
        let may_light = files.iter().any(|(name, _)| scenes::may_be_map(name));
        let under = may_light.then(|| self.scene_source()).flatten();
        let files = files.into_iter().map(|(name, bytes)| File { name, bytes }).collect();
        self.open_source(ctx, Source::Files(files, under.map(Box::new)));
    }
}
