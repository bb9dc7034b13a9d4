//! The layout of the screen: bar, messages, controls and picture.

use eframe::egui::{
    self, CentralPanel, Color32, Grid, Key, KeyboardShortcut, Modifiers, Panel, Rect, RichText, Ui, Window, vec2,
};
use halflight_scenes::Light;

use super::{Solo, Viewer};
use crate::{
    benchmark,
    error::Metric,
    messages::Severity,
    picture::{Caption, Shown, error_scale, picture},
    side::Side,
    stage::Stage,
    state::{BOOKMARKS, View},
    style::{SIDE_COLOURS, SIDE_NAMES},
    undo::undo_from,
    words,
};

/// Width of the page, points, below which the controls are below the picture instead of beside it.
const NARROW: f32 = 760.0;
/// Width of the controls, points.
const CONTROLS: f32 = 360.0;
/// Height of the page, points, below which a narrow page shows only a strip of controls.
const LOW: f32 = 420.0;

/// Height of a narrow page, points, below which it shows the picture or the controls: a page of 1280 x 960 at a zoom of 400 %
/// has 320 x 240.
const TINY: f32 = 300.0;

/// Width and height of the picture, points, below which it has no hint.
const LOWEST: f32 = 180.0;

/// Mouse, touch and keys, as the help lists them.
const HELP: [(&str, &str); 17] = [
    ("Drag", "orbit"),
    ("Right-drag", "look around"),
    ("Shift-drag, or drag two fingers", "move sideways"),
    ("Wheel, pinch, + and -", "zoom"),
    ("Arrow keys", "orbit, after a click into the picture"),
    ("W A S D Q E", "fly, after a click into the picture"),
    ("1, 2, 3", "A alone, B alone, the reference alone; again: both"),
    ("K", "keep this view"),
    ("4 to 9", "go back to a kept view"),
    ("F", "look at what is under the pointer"),
    ("Home, or double-click", "the first view of the scene"),
    ("I", "inspect single pixels"),
    ("P", "show or hide the controls"),
    ("Shift+F", "full screen"),
    ("Ctrl+Z, Ctrl+Shift+Z", "undo, redo"),
    ("Drop files", "open a scene, an environment map or a preset"),
    ("?", "show or hide this help"),
];

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
        if let Some(left) = self.messages.tidy() {
            ui.request_repaint_after(left);
        }
        if !self.messages.is_empty() {
            Panel::top("messages").show(ui, |ui| self.messages.show(ui, &mut self.marks));
        }
        if !self.controls_shown() {
        } else if self.is_tiny() {
            // There is room for one of the two.
            let height = ui.available_height();
            Panel::bottom("controls").exact_size(height).show(ui, |ui| self.controls(ui));
        } else if ui.available_width() < NARROW {
            let share = if self.screen.y < LOW { 0.35 } else { 0.52 };
            let height = ui.available_height() * share;
            Panel::bottom("controls").exact_size(height).show(ui, |ui| self.controls(ui));
        } else {
            Panel::right("controls").default_size(CONTROLS).size_range(300.0..=560.0).show(ui, |ui| self.controls(ui));
        }
        CentralPanel::no_frame().show(ui, |ui| self.show_picture(ui));
        self.show_help(ui);
        show_drop(ui);
    }

    /// Whether the page has room for the picture or the controls, but not for both.
    pub(super) fn is_tiny(&self) -> bool {
        self.screen.x < NARROW && self.screen.y < TINY
    }

    /// Whether the controls are shown.
    pub(super) fn controls_shown(&self) -> bool {
        self.controls_shown.unwrap_or(!self.is_tiny())
    }

    /// Shows the application on the full screen, or ends that.
    pub(super) fn toggle_fullscreen(&mut self, ui: &Ui) {
        if !self.host.toggle_fullscreen() {
            let full = ui.input(|i| i.viewport().fullscreen.unwrap_or(false));
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Fullscreen(!full));
        }
    }

    /// Keeps the camera, or goes back to a kept one.
    fn bookmark_keys(&mut self, pressed: impl Fn(Modifiers, Key) -> bool) {
        if pressed(Modifiers::NONE, Key::K) {
            let (severity, sentence) = match self.state.bookmark(self.camera()) {
                Some(key) => (Severity::Note, format!("this view is kept: the key {key} goes back to it")),
                None => (Severity::Warning, "no key is free for this view: remove one under \"Camera\"".to_owned()),
            };
            self.messages.add(severity, sentence);
        }
        for (number, key) in BOOKMARKS.zip([Key::Num4, Key::Num5, Key::Num6, Key::Num7, Key::Num8, Key::Num9]) {
            if pressed(Modifiers::NONE, key)
                && let Some(camera) = self.state.bookmarks.get(&number)
            {
                self.state.camera = Some(*camera);
            }
        }
    }

    fn keys(&mut self, ui: &Ui) {
        // While a text field has the focus, these keys edit its text.
        if ui.ctx().egui_wants_keyboard_input() && ui.ctx().text_edit_focused() {
            return;
        }
        let pressed = |modifiers, key| ui.input_mut(|i| i.consume_shortcut(&KeyboardShortcut::new(modifiers, key)));
        if pressed(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z) || pressed(Modifiers::COMMAND, Key::Y) {
            self.redo_step();
        } else if pressed(Modifiers::COMMAND, Key::Z) {
            self.undo_step();
        }
        // On some keyboards the question mark is typed with Shift.
        if ui.input(|i| i.key_pressed(Key::Questionmark)) {
            self.help = !self.help;
        }
        if pressed(Modifiers::NONE, Key::Escape) {
            self.help = false;
        }
        for (key, solo) in [(Key::Num1, Solo::A), (Key::Num2, Solo::B), (Key::Num3, Solo::Reference)] {
            if pressed(Modifiers::NONE, key) && (solo != Solo::B || self.state.compare) {
                self.solo = if self.solo == Some(solo) { None } else { Some(solo) };
            }
        }
        if pressed(Modifiers::NONE, Key::Home) {
            self.state.camera = self.home;
        }
        if pressed(Modifiers::NONE, Key::I) {
            self.inspecting = !self.inspecting;
        }
        if pressed(Modifiers::SHIFT, Key::F) {
            self.toggle_fullscreen(ui);
        } else if pressed(Modifiers::NONE, Key::F) {
            self.start_focus();
        }
        if pressed(Modifiers::NONE, Key::P) {
            self.controls_shown = Some(!self.controls_shown());
        }
        self.bookmark_keys(pressed);
    }

    fn show_help(&mut self, ui: &Ui) {
        let screen = self.screen;
        let window = Window::new("Help").open(&mut self.help).collapsible(false).resizable(false);
        let window = window.default_width(440.0_f32.min(screen.x - 32.0));
        let shown =
            window.anchor(egui::Align2::CENTER_CENTER, egui::Vec2::ZERO).show(ui.ctx(), |ui| {
                egui::ScrollArea::vertical().max_height((screen.y - 120.0).max(120.0)).show(ui, |ui| {
                    ui.label(
                        "Halflight computes indirect light in real time. A and B are two techniques: compare their pictures, \
                         times and errors. The error is against a path-traced reference of the same view.",
                    );
                    ui.add_space(6.0);
                    Grid::new("help").num_columns(2).striped(true).show(ui, |ui| {
                        for (what, does) in HELP {
                            ui.strong(what);
                            ui.label(does);
                            ui.end_row();
                        }
                    });
                });
            });
        if let Some(shown) = shown {
            self.marks.add("help.window", shown.response.rect);
        }
    }

    fn show_picture(&mut self, ui: &mut Ui) {
        let space = ui.available_rect_before_wrap();
        self.picture_space = space.size();
        if std::mem::take(&mut self.fit_at_start) {
            self.state.size = self.fitting_size(ui.pixels_per_point());
            self.undo = undo_from(&self.state);
        }
        let mut camera = self.camera();
        let before = (camera, self.state.divider);
        let diagonal = self.stage.as_ref().map_or(1.0, Stage::diagonal);
        let placeholder = self.placeholder();
        let mut textures = self.visible_sides().each_ref().map(|side| side.as_ref().and_then(Side::picture));
        // A is a better picture than nothing until there is one of B. Its caption says so.
        if self.is_coming(1) {
            textures[1] = textures[1].or(textures[0]);
        }
        let mut shown = Shown {
            textures: if placeholder.is_some() { [None, None] } else { textures },
            aspect: self.state.size[0] as f32 / self.state.size[1] as f32,
            captions: [self.caption(0), self.caption(1)],
            placeholder: placeholder.as_deref(),
        };
        let compare = self.state.compare && self.solo.is_none();
        if self.solo == Some(Solo::B) && placeholder.is_none() {
            shown.textures[0] = shown.textures[1].take();
            shown.captions.swap(0, 1);
        }
        let place = picture(ui, &shown, compare, &mut self.state.divider, &mut camera, diagonal);
        let (rect, handle) = (place.rect, place.divider);
        self.marks.add("picture", rect);
        if let Some(handle) = handle {
            self.marks.add("divider", handle);
        }
        self.hints.divider |= before.1 != self.state.divider;
        self.hints.camera |= before.0 != camera;
        self.pointer = place.pointer;
        if self.view() == View::Error && placeholder.is_none() {
            error_scale(ui, rect);
        }
        if camera != before.0 {
            self.state.camera = Some(camera);
        }
        if place.double_clicked {
            self.state.camera = self.home;
        }
        if self.inspecting && placeholder.is_none() {
            self.inspect(ui, rect, &shown.textures);
        }
        self.show_hint(ui, rect);
    }

    fn show_hint(&mut self, ui: &mut Ui, rect: Rect) {
        // A small picture would be covered.
        if rect.height() < LOWEST || rect.width() < LOWEST {
            return;
        }
        let moves = self.stage.as_ref().and_then(|stage| match stage.original_lights.first() {
            _ if stage.is_animated() => Some("the scene moves"),
            Some(Light::Directional { .. }) => Some("the sun moves"),
            Some(_) => Some("the lamp moves"),
            None => None,
        });
        let Some(hint) = self.hints.next(self.state.compare && self.solo.is_none(), moves) else { return };
        let width = (rect.width() - 32.0).clamp(120.0, 460.0);
        let area = Rect::from_center_size(rect.center_top() + vec2(0.0, 28.0), vec2(width, 30.0));
        let id = ui.scope_id().with("hint");
        let hint =
            egui::Area::new(id).fixed_pos(area.center_top()).pivot(egui::Align2::CENTER_TOP).show(ui.ctx(), |ui| {
                let frame = egui::Frame::new()
                    .fill(Color32::from_black_alpha(200))
                    .corner_radius(14)
                    .inner_margin(vec2(12.0, 5.0));
                frame
                    .show(ui, |ui| {
                        ui.set_max_width(width - 24.0);
                        ui.horizontal(|ui| {
                            ui.label(RichText::new("Try").color(Color32::WHITE).strong());
                            let text = RichText::new(hint).color(Color32::from_gray(235));
                            ui.add(egui::Label::new(text).wrap_mode(egui::TextWrapMode::Extend));
                            ui.small_button("x").on_hover_text("No more hints").clicked()
                        })
                        .inner
                    })
                    .inner
            });
        self.hints.off |= hint.inner;
    }

    /// Whether a side will be drawn, without anything that the user has to do.
    fn is_coming(&self, index: usize) -> bool {
        let looked_at = self.sides[index].as_ref().is_some_and(Side::is_looked_at);
        !looked_at && (self.side_errors[index].is_none() || self.loads.step().is_some())
    }

    fn caption(&self, index: usize) -> Caption {
        let letter = self.state.compare.then_some((SIDE_NAMES[index], SIDE_COLOURS[index]));
        if let Some(error) = &self.side_errors[index] {
            return Caption { letter, text: error.clone() };
        }
        let Some(side) = &self.sides[index] else {
            let text = if self.stage.is_some() { "Drawing…".into() } else { String::new() };
            return Caption { letter: letter.filter(|_| self.stage.is_some()), text };
        };
        if self.view() == View::Reference {
            return Caption { letter: None, text: if index == 0 { "Reference".into() } else { String::new() } };
        }
        let title = side.configuration().technique().title;
        let text = match self.motion.shown_size() {
            Some([width, height]) => format!("{title}, {width} x {height} while it moves"),
            None => title.to_owned(),
        };
        Caption { letter, text }
    }

    /// Whether errors of pixels are more than the noise of the reference.
    fn is_error_map_known(&self) -> bool {
        self.sides.iter().flatten().any(|side| side.errors.get(Metric::Pixels).is_some())
    }

    /// What is shown instead of a picture; `None` if there is one.
    fn placeholder(&self) -> Option<String> {
        let view = self.view();
        let needs_reference = matches!(view, View::Error | View::Reference);
        let sentence = match (&self.stage, &self.sides[0]) {
            _ if self.loads.is_waiting() => self.loads.step().unwrap_or("Loading the scene…"),
            (None, _) if self.loads.has_failed(&self.state.scene) => "This scene cannot be shown.",
            (None, _) => "Loading the scene…",
            _ if needs_reference && self.reference.found.is_none() => {
                if self.state.reference {
                    "The reference is being traced: keep the camera still."
                } else {
                    "This view needs the reference: switch it on under \"Reference\"."
                }
            }
            _ if view == View::Error && !self.is_error_map_known() => {
                "The error map appears once the noise of the reference is small: keep the camera still."
            }
            (_, side) if side.as_ref().is_none_or(|side| side.picture().is_none()) => {
                match (&self.side_errors[0], side) {
                    (Some(error), _) => error,
                    (None, Some(side)) if side.is_drawn() && self.exposure.is_some() => {
                        let technique = side.configuration().technique().title;
                        return Some(match &view {
                            View::Output(name) => {
                                let what = words::view(name).to_lowercase();
                                format!("{technique} does not compute {what}. Choose another view.")
                            }
                            _ => format!("{technique} has no texture {}. Choose another view.", view.name()),
                        });
                    }
                    _ => "Drawing…",
                }
            }
            _ => return None,
        };
        Some(sentence.to_owned())
    }
}

/// Says what can be dropped while files are above the page.
fn show_drop(ui: &Ui) {
    if ui.input(|i| i.raw.hovered_files.is_empty()) {
        return;
    }
    let screen = ui.ctx().content_rect();
    let painter = ui.ctx().layer_painter(egui::LayerId::new(egui::Order::Foreground, egui::Id::unique("drop")));
    painter.rect_filled(screen, 0.0, Color32::from_black_alpha(200));
    let frame = screen.shrink(16.0);
    painter.rect_stroke(frame, 8.0, egui::Stroke::new(2.0, SIDE_COLOURS[0]), egui::StrokeKind::Inside);
    let text = "Drop to open\n\nA model (.obj, .gltf, .glb) with its materials and textures,\na scene file (.toml), a .zip of them,\n\
                an environment map (.hdr, .exr), or a preset (.toml)";
    let font = egui::FontId::proportional(16.0);
    let galley = painter.layout(text.to_owned(), font, Color32::WHITE, frame.width() - 32.0);
    painter.galley(frame.center() - galley.size() / 2.0, galley, Color32::WHITE);
}
