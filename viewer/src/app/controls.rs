//! The controls beside the picture: the result, techniques, reference, times, plan, memory, check, lights, camera, exposure.

use eframe::egui::{CollapsingHeader, DragValue, Rect, RichText, ScrollArea, Slider, Ui, text::LayoutJob};

use super::Viewer;
use crate::{
    check, export,
    messages::Severity,
    numbers, panels,
    style::{SIDE_COLOURS, SIDE_NAMES},
};

/// The sides' names in marks, as in links.
const MARKS: [&str; 2] = ["a", "b"];

/// How the exposure is chosen.
const EXPOSURE: &str = "Keeps 95 % of the lit pixels of the direct light on the linear part of the tone curve";

impl Viewer {
    pub(super) fn controls(&mut self, ui: &mut Ui) {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            if self.is_tiny() {
                ui.horizontal_wrapped(|ui| self.bar_rest(ui));
            }
            self.result(ui);
            ui.separator();
            for (index, mark) in MARKS.into_iter().enumerate() {
                if index == 1 && !self.state.compare {
                    continue;
                }
                let technique = self.state.sides[index].technique().title;
                let letter = self.state.compare.then_some(index);
                side_section(ui, letter, technique, |ui| {
                    ui.push_id(index, |ui| {
                        let (side, search) = (&mut self.state.sides[index], &mut self.search[index]);
                        panels::configuration(ui, mark, side, search, &mut self.marks);
                    });
                    self.notes(ui, index);
                    if let Some(error) = &self.side_errors[index] {
                        ui.colored_label(ui.visuals().error_fg_color, error);
                    }
                    self.exports(ui, index);
                });
            }
            section(ui, "Reference", false, |ui| {
                let label = "path-trace a reference while the camera is still";
                let toggle = ui.checkbox(&mut self.state.reference, label);
                self.marks.add("reference", toggle.rect);
                ui.label(self.reference_state());
            });
            for (index, mark) in MARKS.into_iter().enumerate() {
                let Some(side) = &self.sides[index] else { continue };
                let of = if self.state.compare { format!(" of {}", SIDE_NAMES[index]) } else { String::new() };
                let (checking, listing) = (&mut self.checking[index], &mut self.listing[index]);
                ui.push_id(index, |ui| {
                    let times = section(ui, &format!("Times{of}"), false, |ui| {
                        *listing = true;
                        numbers::times(ui, side);
                    });
                    self.marks.add(&format!("{}.times", mark), times);
                    section(ui, &format!("Plan{of}"), false, |ui| numbers::plan(ui, side.plan()));
                    let scene = self.stage.as_ref().map_or(0, |stage| stage.buffers.bytes());
                    section(ui, &format!("Memory{of}"), false, |ui| numbers::memory(ui, side.plan(), scene));
                    // The check runs only while it is open.
                    let check = section(ui, &format!("NaN/Inf check{of}"), false, |ui| {
                        *checking = true;
                        check::table(ui, side.check_results());
                    });
                    self.marks.add(&format!("{}.check", mark), check);
                });
            }
            if let Some(stage) = &self.stage {
                let (original, diagonal) = (&stage.original_lights, stage.diagonal());
                section(ui, "Lights", false, |ui| panels::lights(ui, &mut self.state, original, diagonal));
                section(ui, "Camera", false, |ui| {
                    panels::camera(ui, &mut self.state, &stage.scene.camera, diagonal);
                });
            }
            section(ui, "Exposure and seed", false, |ui| self.exposure(ui));
            ui.add_space(6.0);
            ui.label(RichText::new(&self.adapter).weak().small());
        });
    }

    /// What the plan of a side leaves out.
    fn notes(&self, ui: &mut Ui, index: usize) {
        let Some(side) = &self.sides[index] else { return };
        let technique = side.configuration().technique();
        // The name of the baseline says what it leaves out.
        for note in side.plan().notes.iter().filter(|_| technique.name != "none") {
            let note = match note.strip_prefix(technique.name) {
                Some(rest) => format!("{}{rest}.", technique.title),
                None => note.clone(),
            };
            ui.label(RichText::new(note).color(ui.visuals().warn_fg_color).size(13.0));
        }
    }

    fn exposure(&mut self, ui: &mut Ui) {
        let mut automatic = self.state.exposure.is_none();
        ui.checkbox(&mut automatic, "automatic exposure").on_hover_text(EXPOSURE);
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
                self.messages.add(Severity::Note, "the command was copied");
            }
            if ui.button("Save preset").on_hover_text("Save a file for --preset, or to drop here").clicked() {
                let text = export::preset(&side).to_toml();
                let message = self.host.save(&format!("{}.toml", side.technique), text.as_bytes());
                self.messages.add(Severity::Note, message);
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
                    self.messages.add(Severity::Note, message);
                }
            }
            Err(error) => self.messages.add(Severity::Failure, error.to_string()),
        }
    }
}

/// A collapsible part of the controls. Returns the rectangle of its title.
fn section(ui: &mut Ui, title: &str, open: bool, contents: impl FnOnce(&mut Ui)) -> Rect {
    CollapsingHeader::new(RichText::new(title).strong()).default_open(open).show(ui, contents).header_response.rect
}

/// A collapsible part for a side, with its letter in its colour if two are compared.
fn side_section(ui: &mut Ui, side: Option<usize>, title: &str, contents: impl FnOnce(&mut Ui)) {
    let mut job = LayoutJob::default();
    let strong = ui.visuals().strong_text_color();
    let font = eframe::egui::TextStyle::Body.resolve(ui.style());
    if let Some(side) = side {
        let format = eframe::egui::TextFormat::simple(font.clone(), SIDE_COLOURS[side]);
        job.append(&format!("{}  ", SIDE_NAMES[side]), 0.0, format);
    }
    job.append(title, 0.0, eframe::egui::TextFormat::simple(font, strong));
    let id = ui.make_persistent_id(("side", side));
    CollapsingHeader::new(job).id_salt(id).default_open(true).show(ui, contents);
}
