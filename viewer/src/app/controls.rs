//! The controls beside the picture: techniques, reference, times, plan, memory, check, lights, camera, exposure.

use eframe::egui::{CollapsingHeader, DragValue, Rect, RichText, ScrollArea, Slider, Ui};

use super::Viewer;
use crate::{check, export, numbers, panels};

/// The sides' names in titles.
const NAMES: [&str; 2] = ["A", "B"];
/// The sides' names in marks, as in links.
const MARKS: [&str; 2] = ["a", "b"];

impl Viewer {
    pub(super) fn controls(&mut self, ui: &mut Ui) {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            for (index, name) in NAMES.into_iter().enumerate() {
                if index == 1 && !self.state.compare {
                    continue;
                }
                let title = if self.state.compare { format!("Technique {name}") } else { "Technique".to_owned() };
                section(ui, &title, true, |ui| {
                    ui.push_id(name, |ui| {
                        let side = &mut self.state.sides[index];
                        panels::configuration(ui, MARKS[index], side, &mut self.marks);
                    });
                    if let Some(error) = &self.side_errors[index] {
                        ui.colored_label(ui.visuals().error_fg_color, error);
                    }
                    self.exports(ui, index);
                });
            }
            section(ui, "Reference and error", true, |ui| self.reference_and_error(ui));
            for (index, name) in NAMES.into_iter().enumerate() {
                let Some(side) = &self.sides[index] else { continue };
                let of = if self.state.compare { format!(" of {name}") } else { String::new() };
                let checking = &mut self.checking[index];
                ui.push_id(name, |ui| {
                    section(ui, &format!("Times{of}"), index == 0, |ui| numbers::times(ui, side));
                    section(ui, &format!("Plan{of}"), false, |ui| numbers::plan(ui, side.plan()));
                    let scene = self.stage.as_ref().map_or(0, |stage| stage.buffers.bytes());
                    section(ui, &format!("Memory{of}"), false, |ui| numbers::memory(ui, side.plan(), scene));
                    // The check runs only while it is open.
                    let check = section(ui, &format!("NaN/Inf check{of}"), false, |ui| {
                        *checking = true;
                        check::table(ui, side.check_results());
                    });
                    self.marks.add(&format!("{}.check", MARKS[index]), check);
                });
            }
            if let Some(stage) = &self.stage {
                let (original, diagonal) = (&stage.original_lights, stage.diagonal());
                section(ui, "Lights", false, |ui| panels::lights(ui, &mut self.state, original, diagonal));
                section(ui, "Camera", false, |ui| {
                    panels::camera(ui, &mut self.state, &stage.scene.camera, diagonal);
                });
            }
            section(ui, "Picture", false, |ui| self.exposure(ui));
            ui.add_space(6.0);
            ui.label(RichText::new(&self.adapter).weak().small());
        });
    }

    fn exposure(&mut self, ui: &mut Ui) {
        let mut automatic = self.state.exposure.is_none();
        ui.checkbox(&mut automatic, "automatic exposure")
            .on_hover_text("Keeps 95 % of the lit pixels of the direct light on the linear part of the tone curve");
        let found = self.exposure.map_or(0.0, f32::log2);
        let mut stops = self.state.exposure.unwrap_or(found);
        let slider = ui.add_enabled(!automatic, Slider::new(&mut stops, -12.0..=12.0).text("stops").max_decimals(2));
        self.marks.add("exposure", slider.rect);
        self.state.exposure = (!automatic).then_some(stops);
        ui.horizontal(|ui| {
            ui.label("seed");
            ui.add(DragValue::new(&mut self.state.seed).speed(0.05));
        });
    }

    /// Buttons for a command line, a preset and a scene file.
    fn exports(&mut self, ui: &mut Ui, index: usize) {
        let side = self.state.sides[index].clone();
        ui.horizontal_wrapped(|ui| {
            let line = export::evaluator_command(&self.state, &side);
            let copy =
                ui.button("Copy command").on_hover_text(format!("Renders this picture from a terminal:\n{line}"));
            self.marks.add(&format!("{}.command", MARKS[index]), copy.rect);
            if copy.clicked() {
                ui.copy_text(line);
            }
            if ui.button("Save preset").on_hover_text("Save a file for --preset, or to drop here").clicked() {
                let text = export::preset(&side).to_toml();
                let message = self.host.save(&format!("{}.toml", side.technique), text.as_bytes());
                self.say(message);
            }
            let save = ui
                .button("Save scene")
                .on_hover_text("Save a scene file with this camera and these lights, for --scene");
            if save.clicked() {
                self.save_scene();
            }
            if index == 0 && self.state.compare && ui.button("Copy A to B").clicked() {
                self.state.sides[1] = side.clone();
            }
        });
    }

    fn save_scene(&mut self) {
        let Some(stage) = &self.stage else { return };
        match export::scene_files(&self.state, &stage.scene) {
            Ok(files) => {
                for (name, bytes) in files {
                    let message = self.host.save(&name, &bytes);
                    self.say(message);
                }
            }
            Err(error) => self.say(error.to_string()),
        }
    }

    fn reference_and_error(&mut self, ui: &mut Ui) {
        let toggle = ui.checkbox(&mut self.state.reference, "path-trace a reference while the camera is still");
        self.marks.add("reference", toggle.rect);
        match &self.reference.found {
            Some(reference) => {
                let noise = reference.noise.map_or("unknown".to_owned(), numbers::percent);
                ui.label(format!("{} samples per pixel; noise of the reference: {noise}", reference.samples));
                if !reference.is_settled() {
                    ui.label(
                        RichText::new("The reference is still noisy, so errors look larger than they are.").weak(),
                    );
                }
                for (index, name) in NAMES.into_iter().enumerate() {
                    let side = self.sides[index].as_ref();
                    if let Some((error, blocks)) = side.and_then(|side| side.rel_mse.zip(side.block_rel_mse)) {
                        let clean = (error - reference.noise.unwrap_or(0.0)).max(0.0);
                        ui.label(format!(
                            "Error of {name}: {}; without the reference's noise: {}",
                            numbers::percent(error),
                            numbers::percent(clean)
                        ))
                        .on_hover_text(format!(
                            "Square root of relMSE, which compares albedo * indirect with the reference. relMSE is \
                             {error:.4}, and {blocks:.4} over means of 4x4 pixels; reports show the same metrics."
                        ));
                    }
                }
            }
            None if self.state.reference => {
                ui.label("The reference starts after the picture is drawn and timed.");
            }
            None => drop(ui.label("Off.")),
        }
        let current = [0, 1].map(|index| self.sides[index].as_ref().map(|side| side.configuration()));
        if let Some(chosen) = self.trade.show(ui, current) {
            self.state.sides[0] = chosen;
        }
    }
}

/// A collapsible part of the controls. Returns the rectangle of its title.
fn section(ui: &mut Ui, title: &str, open: bool, contents: impl FnOnce(&mut Ui)) -> Rect {
    CollapsingHeader::new(RichText::new(title).strong()).default_open(open).show(ui, contents).header_response.rect
}
