//! The layout of the screen: bar, messages, controls and picture.

use eframe::egui::{CentralPanel, Key, KeyboardShortcut, Label, Modifiers, Panel, RichText, Ui};

use super::Viewer;
use crate::{
    benchmark, numbers,
    picture::{Shown, error_scale, picture},
    side::Side,
    stage::Stage,
    state::View,
};

/// Width of the page, points, below which the controls are below the picture instead of beside it.
const NARROW: f32 = 760.0;
/// Width of the controls, points.
const CONTROLS: f32 = 350.0;

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
    }

    fn show_messages(&mut self, ui: &mut Ui) {
        let mut dismissed = false;
        ui.horizontal_wrapped(|ui| {
            for message in &self.messages {
                ui.add(Label::new(RichText::new(message).color(ui.visuals().warn_fg_color)).wrap());
            }
            let button = ui.button("Dismiss");
            self.marks.add("dismiss", button.rect);
            dismissed = button.clicked();
        });
        if dismissed {
            self.messages.clear();
        }
    }

    fn show_picture(&mut self, ui: &mut Ui) {
        let mut camera = self.camera();
        let before = camera;
        let diagonal = self.stage.as_ref().map_or(1.0, Stage::diagonal);
        let placeholder = self.placeholder().map(str::to_owned);
        let textures = [0, 1].map(|index| self.sides[index].as_ref().and_then(Side::picture));
        let shown = Shown {
            textures: if placeholder.is_some() { [None, None] } else { textures },
            aspect: self.state.size[0] as f32 / self.state.size[1] as f32,
            captions: [self.caption(0), self.caption(1)],
            placeholder: placeholder.as_deref(),
        };
        let (rect, handle) = picture(ui, &shown, self.state.compare, &mut self.state.divider, &mut camera, diagonal);
        self.marks.add("picture", rect);
        if let Some(handle) = handle {
            self.marks.add("divider", handle);
        }
        if self.state.view == View::Error && placeholder.is_none() {
            error_scale(ui, rect);
        }
        if camera != before {
            self.state.camera = Some(camera);
        }
    }

    fn caption(&self, index: usize) -> String {
        let Some(side) = &self.sides[index] else { return String::new() };
        if let Some(error) = &self.side_errors[index] {
            return error.clone();
        }
        let name = if self.state.compare { ["A  ", "B  "][index] } else { "" };
        let time = side.times.technique().map_or("…".to_owned(), numbers::milliseconds);
        let error = side
            .rel_mse
            .map_or(String::new(), |error| format!("  root relMSE {} vs. reference", numbers::percent(error)));
        let notes: String = side.plan().notes.iter().map(|note| format!("\n{note}")).collect();
        format!("{name}{}  {time}{error}{notes}", side.configuration().technique)
    }

    /// What is shown instead of a picture; `None` if there is one.
    fn placeholder(&self) -> Option<&str> {
        let needs_reference = matches!(self.state.view, View::Error | View::Reference);
        match (&self.stage, &self.sides[0]) {
            (None, _) if self.loaded == self.state.scene => Some("This scene cannot be shown."),
            (None, _) => Some("Loading the scene…"),
            _ if needs_reference && self.reference.found.is_none() => Some(if self.state.reference {
                "The reference is being traced: keep the camera still."
            } else {
                "Switch the reference on to see this view."
            }),
            (_, side) if side.as_ref().is_none_or(|side| side.picture().is_none()) => {
                match (&self.side_errors[0], side) {
                    (Some(error), _) => Some(error.as_str()),
                    (None, Some(side)) if side.is_drawn() && self.exposure.is_some() => {
                        Some("This configuration has no such texture: choose another view.")
                    }
                    _ => Some("Drawing…"),
                }
            }
            _ => None,
        }
    }
}
