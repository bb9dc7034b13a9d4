//! Whether what a frame wrote is sound: the renderer's scan of all its textures and buffers, as a table.

use eframe::egui::{Grid, RichText, ScrollArea, Ui};
use halflight_frame_graph::{
    CompiledGraph, Gpu,
    scan::{Scan, Scanned},
};

use crate::readback::Reading;

/// The scan of a side's last frame.
#[derive(Default)]
pub struct Check {
    scanning: Option<(Scan, Reading)>,
    found: Option<Vec<Scanned>>,
}

impl Check {
    /// Scans what the recording wrote last, unless that is known; true while the device works on it.
    pub fn step(&mut self, gpu: &Gpu, recording: &CompiledGraph) -> bool {
        if let Some((scan, reading)) = &self.scanning {
            let Some(bytes) = reading.take() else { return true };
            self.found = Some(scan.found(&bytes));
            self.scanning = None;
        }
        if self.found.is_some() {
            return false;
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let scan = Scan::record(gpu, recording, &mut encoder);
        gpu.queue.submit([encoder.finish()]);
        let reading = Reading::of(scan.readable());
        self.scanning = Some((scan, reading));
        true
    }

    /// What every texture and buffer held, in the order of the plan, once it is known.
    pub fn found(&self) -> Option<&[Scanned]> {
        self.found.as_deref()
    }
}

/// A line for each texture and buffer, with what should not be there in a loud colour.
pub fn table(ui: &mut Ui, found: Option<&[Scanned]>) {
    let Some(found) = found else {
        ui.label("Scanning what the frame wrote…");
        return;
    };
    let (values, bad) = found.iter().fold((0, 0), |(values, bad), f| (values + f.values, bad + f.not_finite()));
    let clamped: u64 = found.iter().map(|f| u64::from(f.clamped)).sum();
    let verdict = format!("{} textures and buffers, {values} values: {bad} not finite, {clamped} clamped", found.len());
    if bad > 0 {
        ui.colored_label(ui.visuals().error_fg_color, verdict);
    } else {
        ui.label(verdict);
    }
    ui.label(RichText::new("In every view a pixel that is not finite is magenta, a clamped one cyan.").weak());
    ScrollArea::horizontal().id_salt("check").show(ui, |ui| {
        Grid::new("check").num_columns(6).striped(true).show(ui, |ui| {
            for title in ["", "NaN", "infinite", "below 0", "clamped", "largest"] {
                ui.label(RichText::new(title).weak());
            }
            ui.end_row();
            for line in found {
                ui.label(&line.name).on_hover_text(format!("{} values", line.values));
                for (count, wrong) in
                    [(line.nan, true), (line.infinite, true), (line.negative, false), (line.clamped, true)]
                {
                    let text = RichText::new(count.to_string()).monospace();
                    let loud = wrong && count > 0;
                    ui.label(if loud { text.color(ui.visuals().error_fg_color) } else { text });
                }
                ui.label(RichText::new(short(line.largest)).monospace());
                ui.end_row();
            }
        });
    });
}

/// A magnitude with four digits.
fn short(value: f32) -> String {
    match value {
        0.0 => "0".into(),
        1e-3..1e5 => format!("{value:.*}", (3 - value.log10().floor() as i32).max(0) as usize),
        _ => format!("{value:.3e}"),
    }
}
