//! Time against error of every configuration that was measured on one picture.

use eframe::egui::{self, Align2, Color32, FontId, Pos2, Rect, Sense, Stroke, Ui, pos2, vec2};

use crate::{numbers::milliseconds, numbers::percent, state::Configuration};

/// A measured configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct Tried {
    /// The configuration.
    pub configuration: Configuration,
    /// Time of its technique, milliseconds.
    pub milliseconds: f64,
    /// relMSE of `albedo * indirect` against the reference.
    pub rel_mse: f64,
}

/// The measured configurations of one picture.
#[derive(Debug, Default)]
pub struct Trade {
    /// In the order of their first measurement.
    pub tried: Vec<Tried>,
}

impl Trade {
    /// Adds a point; replaces an earlier one of the same configuration.
    pub fn add(&mut self, point: Tried) {
        match self.tried.iter_mut().find(|other| other.configuration == point.configuration) {
            Some(other) => *other = point,
            None => self.tried.push(point),
        }
    }

    /// Draws the points on logarithmic axes; those of the current sides are filled. Returns the configuration of a clicked
    /// point.
    pub fn show(&self, ui: &mut Ui, current: [Option<&Configuration>; 2]) -> Option<Configuration> {
        if self.tried.is_empty() {
            ui.label("Each configuration appears here once it is timed and compared with the reference.");
            return None;
        }
        let (rect, response) =
            ui.allocate_exact_size(vec2(ui.available_width().clamp(160.0, 420.0), 170.0), Sense::click());
        let frame = Rect::from_min_max(rect.min + vec2(46.0, 8.0), rect.max - vec2(10.0, 30.0));
        let range = |values: &mut dyn Iterator<Item = f64>| {
            let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
            // A factor of two beyond the points on each side.
            (low.max(1e-9).log2() - 1.0, high.max(1e-9).log2() + 1.0)
        };
        let x = range(&mut self.tried.iter().map(|p| p.milliseconds));
        let y = range(&mut self.tried.iter().map(|p| p.rel_mse.sqrt()));
        let fraction = |value: f64, (low, high): (f64, f64)| ((value.max(1e-9).log2() - low) / (high - low)) as f32;
        let position = |point: &Tried| -> Pos2 {
            let (right, up) = (fraction(point.milliseconds, x), fraction(point.rel_mse.sqrt(), y));
            pos2(frame.left() + frame.width() * right, frame.bottom() - frame.height() * up)
        };
        let painter = ui.painter();
        let (font, ink) = (FontId::proportional(11.0), ui.visuals().text_color());
        painter.rect_stroke(frame, 0.0, Stroke::new(1.0, ui.visuals().weak_text_color()), egui::StrokeKind::Inside);
        for (at, align) in [(0.0, Align2::LEFT_TOP), (1.0, Align2::RIGHT_TOP)] {
            let value = (x.0 + (x.1 - x.0) * f64::from(at)).exp2();
            let corner = pos2(frame.left() + frame.width() * at, frame.bottom() + 3.0);
            painter.text(corner, align, milliseconds(value), font.clone(), ink);
            let value = (y.0 + (y.1 - y.0) * f64::from(at)).exp2();
            let align = if at == 0.0 { Align2::RIGHT_BOTTOM } else { Align2::RIGHT_TOP };
            let corner = pos2(frame.left() - 4.0, frame.bottom() - frame.height() * at);
            painter.text(corner, align, percent(value * value), font.clone(), ink);
        }
        let below = pos2(frame.center().x, rect.bottom());
        painter.text(below, Align2::CENTER_BOTTOM, "time of the technique", font.clone(), ink);
        for point in &self.tried {
            let is = |side: usize| current[side] == Some(&point.configuration);
            let colour = Color32::from_rgb(80, 150, 220);
            if is(0) || is(1) {
                painter.circle_filled(position(point), 6.0, colour);
                let name = if is(0) { "A" } else { "B" };
                painter.text(position(point) + vec2(8.0, 0.0), Align2::LEFT_CENTER, name, font.clone(), ink);
            } else {
                painter.circle_stroke(position(point), 4.0, Stroke::new(1.5, colour));
            }
        }
        let pointer = response.hover_pos()?;
        let near = |point: &&Tried| position(point).distance(pointer) < 12.0;
        let point = self
            .tried
            .iter()
            .filter(near)
            .min_by(|a, b| f32::total_cmp(&position(a).distance(pointer), &position(b).distance(pointer)))?;
        let settings: Vec<String> =
            point.configuration.settings.iter().map(|(key, v)| format!("{key} = {v}")).collect();
        let text = format!(
            "{}\n{}\n{}, root relMSE {}\nClick to use these settings for A.",
            point.configuration.technique,
            if settings.is_empty() { "all defaults".to_owned() } else { settings.join("\n") },
            milliseconds(point.milliseconds),
            percent(point.rel_mse)
        );
        let clicked = response.clicked();
        response.on_hover_text(text);
        clicked.then(|| point.configuration.clone())
    }
}
