//! The benchmark page: a table with the median time of every pass.

use eframe::egui::{Grid, RichText, ScrollArea, Ui};
use halflight_frame_graph::Part;

use crate::{
    numbers::{measured, milliseconds},
    side::Side,
};

/// Number of measurements per pass.
pub const ROUNDS: usize = 5;

/// The table of the benchmark page.
pub fn page(ui: &mut Ui, side: &Side, adapter: &str) {
    let [width, height] = side.plan().display_size;
    let configuration = side.configuration();
    ui.heading(format!("{} at {width}x{height}", configuration.technique().title));
    ui.label(format!("{adapter}; {}; {} of {ROUNDS} rounds", side.method.note(), side.times.rounds().min(ROUNDS)));
    ScrollArea::both().show(ui, |ui| {
        Grid::new("benchmark").num_columns(3).striped(true).show(ui, |ui| {
            for title in ["pass", "part", "median"] {
                ui.strong(title);
            }
            ui.end_row();
            for (name, part, ms) in side.times.medians() {
                ui.label(name);
                ui.label(part.to_string());
                ui.label(RichText::new(measured(ms)).monospace());
                ui.end_row();
            }
            ui.strong("whole technique");
            ui.label("");
            ui.label(RichText::new(milliseconds(side.part_ms(Part::Technique))).monospace().strong());
            ui.end_row();
        });
    });
}
