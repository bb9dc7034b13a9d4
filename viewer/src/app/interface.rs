//! What is on the screen, and where.

use eframe::egui::{self, CentralPanel, CollapsingHeader, ComboBox, Panel, RichText, ScrollArea, Slider, Ui};
use halflight_scenes::generators::NAMES;
use web_time::Instant;

use super::Viewer;
use crate::{
    address, benchmark, check, command, numbers, panels,
    picture::{Shown, picture},
    show::{ERROR_COLOURS, ERROR_FULL_SCALE, showable},
    state::{DROPPED, OUTPUTS, SIZES, View},
};

/// Width of a page, points, under which the controls stand below the picture and not beside it.
const NARROW: f32 = 760.0;
/// Width of the controls, points.
const CONTROLS: f32 = 350.0;

/// Text sizes and spacing: fingers fit, and nothing is smaller than a browser's small print.
pub(super) fn style(ctx: &egui::Context) {
    ctx.set_theme(egui::ThemePreference::Dark);
    // On a slow device a frame may take longer than a click: it is one all the same.
    ctx.options_mut(|options| options.input_options.max_click_duration = 10.0);
    ctx.all_styles_mut(|style| {
        style.spacing.item_spacing = egui::vec2(8.0, 6.0);
        style.spacing.interact_size.y = 24.0;
        style.spacing.slider_width = 96.0;
        style.spacing.combo_width = 110.0;
        // At least 7 : 1 for text and 6 : 1 for asides against the panels.
        style.visuals.widgets.noninteractive.fg_stroke.color = egui::Color32::from_gray(208);
        style.visuals.weak_text_color = Some(egui::Color32::from_gray(164));
        for (kind, size) in [
            (egui::TextStyle::Small, 12.0),
            (egui::TextStyle::Body, 14.0),
            (egui::TextStyle::Button, 14.0),
            (egui::TextStyle::Monospace, 13.0),
            (egui::TextStyle::Heading, 19.0),
        ] {
            style.text_styles.entry(kind).and_modify(|font| font.size = size);
        }
    });
}

impl Viewer {
    pub(super) fn interface(&mut self, ui: &mut Ui) {
        self.keys(ui);
        if self.benchmark {
            CentralPanel::default().show(ui, |ui| match &self.sides[0] {
                Some(side) => benchmark::page(ui, side, &self.adapter),
                None => drop(ui.label("Loading…")),
            });
            return;
        }
        Panel::top("bar").show(ui, |ui| self.bar(ui));
        if !self.messages.is_empty() {
            Panel::top("messages").show(ui, |ui| self.show_messages(ui));
        }
        let narrow = ui.available_width() < NARROW;
        if narrow {
            let height = ui.available_height() * 0.52;
            Panel::bottom("controls").exact_size(height).show(ui, |ui| self.controls(ui));
        } else {
            Panel::right("controls").default_size(CONTROLS).size_range(280.0..=560.0).show(ui, |ui| self.controls(ui));
        }
        CentralPanel::no_frame().show(ui, |ui| self.show_picture(ui));
    }

    fn keys(&mut self, ui: &Ui) {
        use egui::{Key, KeyboardShortcut, Modifiers};
        let shortcut = |modifiers, key| KeyboardShortcut::new(modifiers, key);
        // While somebody types, these keys belong to the text.
        if ui.ctx().egui_wants_keyboard_input() && ui.ctx().text_edit_focused() {
            return;
        }
        let pressed = |modifiers, key| ui.input_mut(|i| i.consume_shortcut(&shortcut(modifiers, key)));
        if pressed(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z) || pressed(Modifiers::COMMAND, Key::Y) {
            self.undo.redo(&mut self.state);
        } else if pressed(Modifiers::COMMAND, Key::Z) {
            self.undo.undo(&mut self.state);
        }
    }

    fn bar(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            ui.strong("Halflight");
            let mut chosen = self.state.scene.clone();
            let scene = ComboBox::from_id_salt("scene").selected_text(&chosen).show_ui(ui, |ui| {
                for name in NAMES {
                    ui.selectable_value(&mut chosen, (*name).to_owned(), *name);
                }
                if let Some(dropped) = &self.dropped {
                    ui.selectable_value(&mut chosen, DROPPED.to_owned(), format!("{DROPPED}: {}", dropped.name));
                }
            });
            self.marks
                .add("scene", scene.response.on_hover_text("Scene; drop an OBJ with its files for your own").rect);
            if chosen != self.state.scene {
                self.state.open(&chosen);
            }
            let words = |[w, h]: [u32; 2]| format!("{w} x {h}");
            ComboBox::from_id_salt("size")
                .selected_text(words(self.state.size))
                .show_ui(ui, |ui| {
                    for size in SIZES {
                        ui.selectable_value(&mut self.state.size, size, words(size));
                    }
                })
                .response
                .on_hover_text("Size of the picture, pixels");
            self.view_choice(ui);
            let compare = ui.toggle_value(&mut self.state.compare, "A | B").on_hover_text("Compare two configurations");
            self.marks.add("compare", compare.rect);
            let mut playing = self.playing.is_some();
            let last = self.stage.as_ref().filter(|stage| stage.moves()).map(|stage| stage.scene.moves.last_frame());
            let lit = self.stage.as_ref().is_some_and(|stage| !stage.original_lights.is_empty());
            let title = if playing { "Stop" } else { "Play" };
            let play = ui
                .add_enabled(last.is_some() || lit, egui::Button::selectable(playing, title))
                .on_hover_text(match last {
                    Some(_) => "Play the motion of the scene",
                    None => "Turn the first light, to see how the picture behaves in motion",
                })
                .on_disabled_hover_text("Nothing moves in this scene: choose motion, or one that has a light");
            playing ^= play.clicked();
            self.marks.add("play", play.rect);
            if let Some(last) = last {
                let mut frame = self.frame().min(last);
                let slider = ui.add(Slider::new(&mut frame, 0..=last).text("frame"));
                self.marks.add("frame", slider.rect);
                if slider.changed() {
                    (self.state.frame, self.playing, playing) = (frame, None, false);
                }
            }
            if playing != self.playing.is_some() {
                self.play(playing);
            }
            let [back, forth] = self.undo.can();
            let undo = ui.add_enabled(back, egui::Button::new("Undo")).on_hover_text("Ctrl+Z");
            self.marks.add("undo", undo.rect);
            if undo.clicked() {
                self.undo.undo(&mut self.state);
            }
            if ui.add_enabled(forth, egui::Button::new("Redo")).on_hover_text("Ctrl+Shift+Z").clicked() {
                self.undo.redo(&mut self.state);
            }
            if ui.button("Copy link").on_hover_text("A link that brings this view back").clicked() {
                ui.copy_text(self.host.link(&address::write(&self.state)));
            }
        });
    }

    fn view_choice(&mut self, ui: &mut Ui) {
        let view = &mut self.state.view;
        let textures: Vec<String> =
            self.sides[0].iter().flat_map(|side| showable(side.plan())).map(str::to_owned).collect();
        let response = ComboBox::from_id_salt("view")
            .selected_text(view.name())
            .height(420.0)
            .show_ui(ui, |ui| {
                for (name, what) in OUTPUTS {
                    ui.selectable_value(view, View::Output(name), name).on_hover_text(what);
                }
                ui.selectable_value(view, View::Truth, "truth").on_hover_text("the path-traced picture");
                ui.selectable_value(view, View::Error, "error")
                    .on_hover_text("how far albedo * indirect is from the truth");
                ui.separator();
                ui.label(RichText::new("Textures of the frame").weak());
                for name in &textures {
                    ui.selectable_value(view, View::Texture(name.clone()), name);
                }
            })
            .response
            .on_hover_text("What the picture shows");
        self.marks.add("view", response.rect);
    }

    fn play(&mut self, on: bool) {
        let Some(stage) = &self.stage else { return };
        if on {
            self.playing = Some(super::Playing { frame: self.state.frame, angle: 0.0, stepped: Instant::now() });
            return;
        }
        // Everything stays where it was stopped.
        let Some(playing) = self.playing.take() else { return };
        if stage.moves() {
            self.state.frame = playing.frame.min(stage.scene.moves.last_frame());
        } else if let Some(light) = stage.original_lights.first() {
            let own = self.state.lights.iter().find(|(at, _)| *at == 0);
            let mut change = own.map_or(super::LightChange::none(light), |(_, change)| *change);
            let turned = super::turned(&change.apply(light), playing.angle, stage.centre());
            (change.position, change.direction) = (turned.position, turned.direction);
            self.state.change_light(0, light, change);
        }
    }

    fn show_messages(&mut self, ui: &mut Ui) {
        let mut read = false;
        ui.horizontal_wrapped(|ui| {
            for message in &self.messages {
                ui.add(egui::Label::new(RichText::new(message).color(ui.visuals().warn_fg_color)).wrap());
            }
            let button = ui.button("Dismiss");
            self.marks.add("dismiss", button.rect);
            read = button.clicked();
        });
        if read {
            self.messages.clear();
        }
    }

    fn show_picture(&mut self, ui: &mut Ui) {
        let mut camera = self.camera();
        let before = camera;
        let diagonal = self.stage.as_ref().map_or(1.0, crate::stage::Stage::diagonal);
        let caption = |index: usize| {
            let Some(side) = &self.sides[index] else { return String::new() };
            if let Some(complaint) = &self.complaints[index] {
                return complaint.clone();
            }
            let name = if !self.state.compare {
                ""
            } else if index == 0 {
                "A  "
            } else {
                "B  "
            };
            let time = side.times.technique().map_or("…".to_owned(), numbers::milliseconds);
            let error = side.rel_mse.map_or(String::new(), |error| format!("  error {}", numbers::percent(error)));
            format!("{name}{}  {time}{error}", side.configuration().technique)
        };
        let waiting = match (&self.stage, &self.state.view) {
            (None, _) if self.loaded == self.state.scene => Some("This scene cannot be shown."),
            (None, _) => Some("Loading the scene…"),
            (_, View::Error | View::Truth) if self.background.known.is_none() && self.state.truth => {
                Some("The truth is on its way: keep the camera still.")
            }
            (_, View::Error | View::Truth) if self.background.known.is_none() => {
                Some("Switch the truth on to see this.")
            }
            (Some(_), _) if self.sides[0].as_ref().is_none_or(|side| side.picture().is_none()) => {
                match (&self.complaints[0], &self.sides[0]) {
                    (Some(complaint), _) => Some(complaint.as_str()),
                    (None, Some(side)) if side.is_drawn() && self.exposure.is_some() => {
                        Some("This configuration has no such texture: choose another view.")
                    }
                    _ => Some("Drawing…"),
                }
            }
            _ => None,
        };
        let textures = [0, 1].map(|index| self.sides[index].as_ref().and_then(crate::stage::Side::picture));
        let shown = Shown {
            textures: if waiting.is_some() { [None, None] } else { textures },
            aspect: self.state.size[0] as f32 / self.state.size[1] as f32,
            captions: [caption(0), caption(1)],
            missing: waiting,
        };
        let (rect, handle) = picture(ui, &shown, self.state.compare, &mut self.state.divider, &mut camera, diagonal);
        self.marks.add("picture", rect);
        if let Some(handle) = handle {
            self.marks.add("divider", handle);
        }
        if self.state.view == View::Error && waiting.is_none() {
            scale(ui, rect);
        }
        if camera != before {
            self.state.camera = Some(camera);
        }
    }

    fn controls(&mut self, ui: &mut Ui) {
        ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
            for (index, name) in ["A", "B"].into_iter().enumerate() {
                if index == 1 && !self.state.compare {
                    continue;
                }
                let title = if self.state.compare { format!("Technique {name}") } else { "Technique".to_owned() };
                section(ui, &title, true, |ui| {
                    ui.push_id(name, |ui| {
                        let side = &mut self.state.sides[index];
                        panels::configuration(ui, &name.to_lowercase(), side, &mut self.marks);
                    });
                    if let Some(complaint) = &self.complaints[index] {
                        ui.colored_label(ui.visuals().error_fg_color, complaint);
                    }
                    self.outputs(ui, index);
                });
            }
            section(ui, "Truth and error", true, |ui| self.truth(ui));
            for (index, name) in ["A", "B"].into_iter().enumerate() {
                let Some(side) = &self.sides[index] else { continue };
                let of = if self.state.compare { format!(" of {name}") } else { String::new() };
                let checking = &mut self.checking[index];
                ui.push_id(name, |ui| {
                    section(ui, &format!("Times{of}"), index == 0, |ui| numbers::times(ui, side));
                    section(ui, &format!("Plan{of}"), false, |ui| numbers::plan(ui, side.plan()));
                    let scene = self.stage.as_ref().map_or(0, |stage| stage.buffers.bytes());
                    section(ui, &format!("Memory{of}"), false, |ui| numbers::memory(ui, side.plan(), scene));
                    // Nothing is scanned while nobody looks.
                    let check = section(ui, &format!("Check{of}"), false, |ui| {
                        *checking = true;
                        check::table(ui, side.scanned());
                    });
                    self.marks.add(&format!("{}.check", name.to_lowercase()), check);
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
        ui.checkbox(&mut automatic, "exposure from the picture")
            .on_hover_text("95 % of the lit pixels of direct light stay on the straight part of the tone curve");
        let found = self.exposure.map_or(0.0, f32::log2);
        let mut stops = self.state.exposure.unwrap_or(found);
        let slider = ui.add_enabled(!automatic, Slider::new(&mut stops, -12.0..=12.0).text("stops").max_decimals(2));
        self.marks.add("exposure", slider.rect);
        self.state.exposure = (!automatic).then_some(stops);
        let mut seed = self.state.seed;
        ui.horizontal(|ui| {
            ui.label("seed");
            ui.add(egui::DragValue::new(&mut seed).speed(0.05));
        });
        self.state.seed = seed;
    }

    /// What leaves the viewer: a command line, a preset, a scene file.
    fn outputs(&mut self, ui: &mut Ui, index: usize) {
        let side = self.state.sides[index].clone();
        ui.horizontal_wrapped(|ui| {
            let line = command::evaluator_command(&self.state, &side);
            let copy = ui.button("Copy command").on_hover_text(format!("The same picture from a terminal:\n{line}"));
            self.marks.add(&format!("{}.command", ["a", "b"][index]), copy.rect);
            if copy.clicked() {
                ui.copy_text(line);
            }
            if ui.button("Save preset").on_hover_text("A file for --preset, or to drop here again").clicked() {
                let text = command::preset(&side).to_toml();
                let said = self.host.save(&format!("{}.toml", side.technique), &text);
                self.say(said);
            }
            let saved = ui.button("Save scene").on_hover_text("Camera and lights as they stand, for --scene");
            if saved.clicked()
                && let Some(stage) = &self.stage
            {
                let (name, text) = command::scene_file(&self.state, &stage.scene, &self.camera());
                let said = self.host.save(&name, &text);
                self.say(said);
            }
            if index == 0 && self.state.compare && ui.button("Copy A to B").clicked() {
                self.state.sides[1] = side.clone();
            }
        });
    }

    fn truth(&mut self, ui: &mut Ui) {
        let toggle = ui.checkbox(&mut self.state.truth, "path-trace the truth while the camera rests");
        self.marks.add("truth", toggle.rect);
        match &self.background.known {
            Some(known) => {
                let noise = known.noise.map_or("unknown".to_owned(), numbers::percent);
                ui.label(format!("{} samples a pixel; its own noise is {noise}", known.samples));
                if !known.is_settled() {
                    ui.label(RichText::new("Still rough: errors look larger than they are.").weak());
                }
                for (index, name) in ["A", "B"].into_iter().enumerate() {
                    if let Some(error) = self.sides[index].as_ref().and_then(|side| side.rel_mse) {
                        let clean = (error - known.noise.unwrap_or(0.0)).max(0.0);
                        ui.label(format!(
                            "Error of {name}: {}, without that noise {}",
                            numbers::percent(error),
                            numbers::percent(clean)
                        ))
                        .on_hover_text(format!(
                            "relMSE {error:.4} of albedo * indirect, as in reports; shown as its square root"
                        ));
                    }
                }
            }
            None if self.state.truth => drop(ui.label("Not yet: the picture is drawn and timed first.")),
            None => drop(ui.label("Off.")),
        }
        let current = [0, 1].map(|index| self.sides[index].as_ref().map(|side| side.configuration()));
        if let Some(chosen) = self.trade.show(ui, current) {
            self.state.sides[0] = chosen;
        }
    }
}

/// A part of the controls that folds; where its title is.
fn section(ui: &mut Ui, title: &str, open: bool, contents: impl FnOnce(&mut Ui)) -> egui::Rect {
    CollapsingHeader::new(RichText::new(title).strong()).default_open(open).show(ui, contents).header_response.rect
}

/// The colours of the error map, with their values.
fn scale(ui: &Ui, rect: egui::Rect) {
    let bar = egui::Rect::from_min_size(rect.min + egui::vec2(10.0, 10.0), egui::vec2(120.0, 10.0));
    let painter = ui.painter();
    let mut mesh = egui::Mesh::default();
    for (index, colour) in ERROR_COLOURS.iter().enumerate() {
        let [r, g, b] = colour.map(|v| (v * 255.0).round() as u8);
        let x = bar.left() + bar.width() * index as f32 / (ERROR_COLOURS.len() - 1) as f32;
        for y in [bar.top(), bar.bottom()] {
            mesh.colored_vertex(egui::pos2(x, y), egui::Color32::from_rgb(r, g, b));
        }
        if index > 0 {
            let first = 2 * index as u32 - 2;
            mesh.add_triangle(first, first + 1, first + 2);
            mesh.add_triangle(first + 1, first + 2, first + 3);
        }
    }
    painter.rect_filled(
        bar.expand2(egui::vec2(6.0, 6.0)).with_max_y(bar.bottom() + 22.0),
        3.0,
        egui::Color32::from_black_alpha(170),
    );
    painter.add(mesh);
    let font = egui::FontId::proportional(12.0);
    for (x, text, align) in [
        (bar.left(), "0 %".to_owned(), egui::Align2::LEFT_TOP),
        (bar.right(), format!("{:.0} %", 100.0 * ERROR_FULL_SCALE), egui::Align2::RIGHT_TOP),
    ] {
        painter.text(egui::pos2(x, bar.bottom() + 3.0), align, text, font.clone(), egui::Color32::WHITE);
    }
}
