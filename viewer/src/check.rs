//! The NaN/Inf check of all textures and buffers that a frame wrote, as a table.

use eframe::egui::{Grid, RichText, ScrollArea, Ui};
use halflight_frame_graph::{
    CompiledGraph, Gpu,
    non_finite::{NonFiniteCheck, ValueCounts},
};

use crate::readback::Reading;

/// The check of a side's last frame.
#[derive(Default)]
pub struct Check {
    running: Option<(NonFiniteCheck, Reading)>,
    results: Option<Vec<ValueCounts>>,
}

impl Check {
    /// Checks what the compiled graph wrote last, unless the results are known; true while the device works on it.
    pub fn step(&mut self, gpu: &Gpu, graph: &CompiledGraph) -> bool {
        if let Some((scan, reading)) = &self.running {
            let Some(bytes) = reading.take() else { return true };
            self.results = Some(scan.counts(&bytes));
            self.running = None;
        }
        if self.results.is_some() {
            return false;
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let scan = NonFiniteCheck::record(gpu, graph, &mut encoder);
        gpu.queue.submit([encoder.finish()]);
        let reading = Reading::of(scan.readable());
        self.running = Some((scan, reading));
        true
    }

    /// One result per texture and buffer, in the order of the plan, once they are known.
    pub fn results(&self) -> Option<&[ValueCounts]> {
        self.results.as_deref()
    }
}

/// A row per texture and buffer, with errors highlighted.
pub fn table(ui: &mut Ui, results: Option<&[ValueCounts]>) {
    let Some(results) = results else {
        ui.label("Checking the frame…");
        return;
    };
    let (values, bad) = results.iter().fold((0, 0), |(values, bad), r| (values + r.values, bad + r.not_finite()));
    let clamped: u64 = results.iter().map(|r| u64::from(r.clamped)).sum();
    let count = results.len();
    let summary = format!("{count} textures and buffers, {values} values: {bad} not finite, {clamped} clamped");
    if bad > 0 {
        ui.colored_label(ui.visuals().error_fg_color, summary);
    } else {
        ui.label(summary);
    }
    ui.label(RichText::new("All views show pixels that are not finite in magenta and clamped pixels in cyan.").weak());
    ScrollArea::horizontal().id_salt("check").show(ui, |ui| {
        Grid::new("check").num_columns(6).striped(true).show(ui, |ui| {
            for title in ["", "NaN", "infinite", "below 0", "clamped", "largest"] {
                ui.label(RichText::new(title).weak());
            }
            ui.end_row();
            for row in results {
                ui.label(&row.name).on_hover_text(format!("{} values", row.values));
                for (count, is_error) in
                    [(row.nan, true), (row.infinite, true), (row.negative, false), (row.clamped, true)]
                {
                    let text = RichText::new(count.to_string()).monospace();
                    let highlighted = is_error && count > 0;
                    ui.label(if highlighted { text.color(ui.visuals().error_fg_color) } else { text });
                }
                ui.label(RichText::new(short(row.largest)).monospace());
                ui.end_row();
            }
        });
    });
}

/// A magnitude with four significant digits.
fn short(value: f32) -> String {
    match value {
        0.0 => "0".into(),
        1e-3..1e5 => format!("{value:.*}", (3 - value.log10().floor() as i32).max(0) as usize),
        _ => format!("{value:.3e}"),
    }
}
