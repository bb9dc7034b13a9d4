//! The result: time and error of each side in large figures, with metric, unit and state.

use eframe::egui::{Align, ComboBox, Layout, RichText, Ui, UiBuilder};

use super::Viewer;
use crate::{
    error::Metric,
    numbers,
    reference::MOST_SAMPLES,
    side::SideTime,
    state::{Bounces, Configuration},
    style::letter,
};

/// Size of the figures, points.
const LARGE: f32 = 27.0;

/// A whole number with commas between thousands.
pub fn grouped(number: u32) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

impl Viewer {
    /// Time and error of the sides that are shown.
    pub(super) fn result(&mut self, ui: &mut Ui) {
        let count = if self.state.compare { 2 } else { 1 };
        ui.add_space(4.0);
        ui.columns(count, |columns| {
            for (index, column) in columns.iter_mut().enumerate() {
                // Columns would stretch their text to their width.
                let mut left = column.new_child(UiBuilder::new().layout(Layout::top_down(Align::Min)));
                let ui = &mut left;
                ui.spacing_mut().item_spacing.y = 2.0;
                let title = self.state.sides[index].technique().title;
                ui.horizontal(|ui| {
                    if count > 1 {
                        ui.label(letter(index).size(16.0));
                    }
                    ui.add(eframe::egui::Label::new(RichText::new(title).strong()).truncate());
                });
                let (time, about) = self.time_text(index);
                figure(ui, &time, &about);
                let (error, about) = self.error_text(index);
                let rect = figure(ui, &error, &about);
                self.marks.add(["a.error", "b.error"][index], rect);
                let used = left.min_rect();
                column.advance_cursor_after_rect(used);
            }
        });
        ui.horizontal_wrapped(|ui| {
            ui.spacing_mut().item_spacing.y = 2.0;
            ui.label(RichText::new(self.reference_state()).weak().size(12.0));
        });
        self.best_question(ui);
        self.plot(ui);
    }

    /// The time of a side and what it is.
    fn time_text(&self, index: usize) -> (String, String) {
        let Some(side) = &self.sides[index] else { return ("…".into(), "waiting".into()) };
        match side.time(self.rounds()) {
            SideTime::NoPasses => ("0 ms".into(), "no passes of its own".into()),
            SideTime::Measuring { done, of } => ("…".into(), format!("measuring, {done} of {of} rounds")),
            SideTime::Known(ms) => (numbers::measured(ms), "time of the technique".into()),
        }
    }

    /// The error of a side and what it is.
    fn error_text(&self, index: usize) -> (String, String) {
        let metric = self.state.metric;
        let known = self.sides[index].as_ref().and_then(|side| side.errors.get(metric));
        match known {
            Some(error) => (metric.text(error.value()), metric.title().into()),
            None if !self.state.reference => ("–".into(), "the reference is off".into()),
            None if self.reference_done => ("–".into(), "smaller than the noise of the reference".into()),
            None => ("…".into(), "measuring the error".into()),
        }
    }

    /// The state of the reference in one sentence.
    pub(super) fn reference_state(&self) -> String {
        if !self.state.reference {
            return "Errors need the reference: switch it on under \"Reference\".".into();
        }
        let Some(reference) = &self.reference.found else {
            if self.best.is_running() {
                return "The reference waits for the search.".into();
            }
            if self.reference.has_begun() {
                return "Reference: path-traced, its first sample of each pixel is on its way.".into();
            }
            return "The reference starts when the picture is drawn and timed.".into();
        };
        let shown = self.sides.iter().flatten().filter_map(|side| side.errors.get(self.state.metric));
        let noisy = shown.clone().any(|error| !error.is_clean());
        let samples = grouped(reference.samples);
        let bounces = match self.state.reference_bounces() {
            Bounces::Number(1) => "1 bounce".to_owned(),
            Bounces::Number(bounces) => format!("{bounces} bounces"),
            Bounces::All => "all bounces".to_owned(),
        };
        let progress = match reference.samples {
            MOST_SAMPLES.. => format!("{samples} samples"),
            _ => format!("{samples} of {} samples", grouped(MOST_SAMPLES)),
        };
        let note = match shown.count() {
            0 => "; errors appear when its noise is small",
            _ if noisy => "; its noise is subtracted",
            _ => "",
        };
        format!("Reference: path-traced, {bounces}, {progress}{note}.")
    }

    /// The plot of time against error, and the choice of the metric.
    fn plot(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            let label = ui.label("Error");
            let metric = &mut self.state.metric;
            let chosen =
                ComboBox::from_id_salt("metric").selected_text(metric.title()).width(200.0).show_ui(ui, |ui| {
                    for other in Metric::ALL {
                        let tip = format!("{}\n\nkey: {}", other.meaning(), other.name());
                        ui.selectable_value(metric, other, other.title()).on_hover_text(tip);
                    }
                });
            self.marks.add("metric", chosen.response.labelled_by(label.id).on_hover_text(metric.meaning()).rect);
        });
        let current: [Option<Configuration>; 2] =
            [0, 1].map(|index| self.sides[index].as_ref().map(|side| side.configuration().clone()));
        if let Some(chosen) = self.trade.show(ui, self.state.metric, [0, 1].map(|index| current[index].as_ref())) {
            self.state.sides[0] = chosen;
        }
    }
}

/// A large figure with a line below it that says what it is. Returns the rectangle of the figure.
fn figure(ui: &mut Ui, text: &str, about: &str) -> eframe::egui::Rect {
    let response = ui.add(eframe::egui::Label::new(RichText::new(text).size(LARGE).strong()).extend());
    let about = RichText::new(about).weak().size(12.0);
    ui.add(eframe::egui::Label::new(about).wrap());
    response.rect
}

#[cfg(test)]
mod tests {
    #[test]
    fn numbers_are_grouped() {
        assert_eq!([7, 64, 999, 1024, 1_000_000].map(super::grouped), ["7", "64", "999", "1,024", "1,000,000"]);
    }
}
