//! Times, memory and plan of a side.

use eframe::egui::{self, Color32, Grid, RichText, ScrollArea, Ui, vec2};
use halflight_frame_graph::{FramePlan, Part, ResourceId, ResourceKind, bytes_in_words};

use crate::{side::Side, style::square};

/// Colour of each part of a frame, readable on dark and light themes. None is a colour of A or B.
pub fn part_colour(part: Part) -> Color32 {
    match part {
        Part::GBuffer => Color32::from_rgb(128, 134, 139),
        Part::Direct => Color32::from_rgb(171, 146, 208),
        Part::Technique => Color32::from_rgb(94, 178, 134),
    }
}

/// Times below this are below the resolution of the clock, milliseconds.
const CLOCK: f64 = 0.01;

/// Milliseconds with three significant digits; exactly 0 is no work at all.
pub fn milliseconds(ms: f64) -> String {
    match ms {
        _ if !ms.is_finite() => "…".into(),
        // The sum of an empty list is -0.0.
        0.0 => "0 ms".into(),
        _ if ms < CLOCK => format!("< {CLOCK} ms"),
        _ if ms < 1.0 => format!("{ms:.3} ms"),
        _ if ms < 10.0 => format!("{ms:.2} ms"),
        _ if ms < 100.0 => format!("{ms:.1} ms"),
        _ => format!("{ms:.0} ms"),
    }
}

/// [`milliseconds`] of measured work: what the clock cannot see is not 0.
pub fn measured(ms: f64) -> String {
    milliseconds(if ms == 0.0 { 0.5 * CLOCK } else { ms })
}

/// The running medians of all passes as bars, in the order of the frame.
pub fn times(ui: &mut Ui, side: &Side) {
    let longest = side.times.medians().map(|(_, _, ms)| ms).filter(|ms| ms.is_finite()).fold(1e-3, f64::max);
    Grid::new("times").num_columns(3).striped(true).show(ui, |ui| {
        for (index, ((name, part, ms), ran)) in side.times.medians().zip(side.causes()).enumerate() {
            let when = side.times.when(index).map(ToString::to_string).unwrap_or_default();
            let last = ran.as_ref().map_or("did not run".to_owned(), |cause| format!("ran because {cause}"));
            let name = if ran.is_some() { RichText::new(name) } else { RichText::new(name).weak() };
            ui.label(name).on_hover_text(format!("{part}\nRuns {when}\nLast frame: {last}"));
            let (rect, _) = ui.allocate_exact_size(vec2(90.0, 12.0), egui::Sense::hover());
            let length = if ms.is_finite() { (ms / longest) as f32 } else { 0.0 };
            let bar = egui::Rect::from_min_size(rect.min, vec2((rect.width() * length).max(1.0), rect.height()));
            ui.painter().rect_filled(bar, 2.0, part_colour(part));
            ui.label(RichText::new(measured(ms)).monospace());
            ui.end_row();
        }
    });
    if side.times.are_together(Part::Technique) {
        ui.label("The passes of this technique are timed together: they keep data from frame to frame.");
    }
    ui.horizontal_wrapped(|ui| {
        for part in [Part::GBuffer, Part::Direct, Part::Technique] {
            square(ui, part_colour(part));
            ui.label(format!("{part} {}", milliseconds(side.part_ms(part))));
        }
    });
    ui.label(format!(
        "{} where everything changes, {} where only the frame number does",
        milliseconds(side.times.changed_frame()),
        milliseconds(side.times.static_frame())
    ));
    if let Some(ms) = side.frame_ms {
        ui.label(format!("Wall-clock time of the last whole frame: {}", milliseconds(ms)));
    }
    ui.label(RichText::new(format!("Running medians; {}.", side.method.note())).weak());
}

/// The bytes of each texture and buffer.
pub fn memory(ui: &mut Ui, plan: &FramePlan, scene_bytes: u64) {
    ui.label(format!("{} for the frame; {} for the scene", plan.bytes_in_words(), bytes_in_words(scene_bytes)));
    let memory = plan.memory();
    ScrollArea::horizontal().id_salt("memory").show(ui, |ui| {
        Grid::new("memory").num_columns(3).striped(true).show(ui, |ui| {
            for (index, resource) in plan.resources.iter().enumerate() {
                if matches!(resource.kind, ResourceKind::External { .. }) {
                    continue;
                }
                let owner = memory.owner(ResourceId(index));
                let shares = format!("{}; in the memory of {}", resource.kind, plan.resources[owner.0].name);
                ui.label(&resource.name).on_hover_text(&resource.reason);
                ui.label(RichText::new(bytes_in_words(resource.bytes())).monospace());
                let kind = if owner.0 == index { resource.kind.to_string() } else { shares };
                ui.label(RichText::new(kind).weak());
                ui.end_row();
            }
        });
    });
}

/// The passes with their reasons.
pub fn plan(ui: &mut Ui, plan: &FramePlan) {
    let mut part = None;
    for (index, pass) in plan.passes.iter().enumerate() {
        if part.replace(pass.part) != Some(pass.part) {
            ui.colored_label(part_colour(pass.part), RichText::new(pass.part.to_string()).strong());
        }
        let names = |ids: Vec<halflight_frame_graph::ResourceId>| {
            ids.iter().map(|id| plan.resources[id.0].name.as_str()).collect::<Vec<_>>().join(", ")
        };
        let (reads, writes) = pass.reads_and_writes();
        ui.add(egui::Label::new(format!("{}  {}: {}", index + 1, pass.name, pass.reason)).wrap())
            .on_hover_text(format!("{}\nreads {}\nwrites {}", pass.shader.name, names(reads), names(writes)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_three_digits_and_no_false_zero() {
        let texts = [f64::NAN, -0.0, 0.002, 0.1234, 1.234, 12.34, 123.4].map(milliseconds);
        assert_eq!(texts, ["…", "0 ms", "< 0.01 ms", "0.123 ms", "1.23 ms", "12.3 ms", "123 ms"]);
        assert_eq!(measured(0.0), "< 0.01 ms");
    }
}
