//! Time against error of every configuration that was measured on one picture.

use eframe::egui::{self, Align2, FontId, Pos2, Rect, Sense, Stroke, Ui, pos2, vec2};

use crate::{
    error::Metric,
    numbers::milliseconds,
    state::Configuration,
    style::{SIDE_COLOURS, SIDE_NAMES},
};

/// Shortest time on the axis, milliseconds: what is faster is below the clock.
const SHORTEST: f64 = 0.01;

/// A measured configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct Tried {
    /// The configuration.
    pub configuration: Configuration,
    /// Time of its technique, milliseconds.
    pub milliseconds: f64,
    /// The errors that are known, in the order of [`Metric::ALL`].
    pub errors: [Option<f64>; 4],
}

impl Tried {
    fn error(&self, metric: Metric) -> Option<f64> {
        let index = Metric::ALL.iter().position(|&other| other == metric)?;
        self.errors[index]
    }
}

/// The measured configurations of one picture.
#[derive(Debug, Default)]
pub struct Trade {
    /// In the order of their first measurement.
    pub tried: Vec<Tried>,
}

/// A logarithmic axis from `low` to `high`.
#[derive(Clone, Copy)]
struct Axis {
    low: f64,
    high: f64,
}

impl Axis {
    /// An axis with room around these values.
    fn around(values: impl Iterator<Item = f64>, least: f64) -> Self {
        let (low, high) = values.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
        Self { low: low.max(least) / 1.8, high: high.max(least) * 1.8 }
    }

    fn fraction(self, value: f64) -> f32 {
        let fraction = (value.max(self.low) / self.low).ln() / (self.high / self.low).ln();
        fraction.clamp(0.0, 1.0) as f32
    }

    /// Round values for its ticks, at most six: 1, 2 and 5 times powers of ten, or powers alone.
    fn ticks(self) -> Vec<f64> {
        let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
        for steps in [&[1.0, 2.0, 5.0][..], &[1.0, 3.0], &[1.0]] {
            let all = decades.clone().flat_map(|decade| steps.iter().map(move |step| step * 10f64.powi(decade)));
            let inside: Vec<f64> = all.filter(|v| (self.low..=self.high).contains(v)).collect();
            if inside.len() <= 6 {
                return inside;
            }
        }
        let every = decades.clone().count().div_ceil(6);
        decades.step_by(every).map(|decade| 10f64.powi(decade)).filter(|v| (self.low..=self.high).contains(v)).collect()
    }
}

/// A time on an axis, without superfluous digits.
fn short_time(ms: f64) -> String {
    if ms < 1.0 { format!("{ms:.2}").trim_end_matches('0').to_owned() } else { format!("{ms:.0}") }
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
    pub fn show(&self, ui: &mut Ui, metric: Metric, current: [Option<&Configuration>; 2]) -> Option<Configuration> {
        let known: Vec<(&Tried, f64)> =
            self.tried.iter().filter_map(|point| Some((point, point.error(metric)?))).collect();
        let (rect, response) =
            ui.allocate_exact_size(vec2(ui.available_width().clamp(160.0, 460.0), 168.0), Sense::click());
        let frame = Rect::from_min_max(rect.min + vec2(48.0, 6.0), rect.max - vec2(8.0, 36.0));
        let painter = ui.painter();
        let (font, ink, weak) = (FontId::proportional(12.0), ui.visuals().text_color(), ui.visuals().weak_text_color());
        painter.rect_stroke(frame, 0.0, Stroke::new(1.0, weak), egui::StrokeKind::Inside);
        let below = pos2(frame.center().x, rect.bottom());
        painter.text(below, Align2::CENTER_BOTTOM, "time of the technique, ms", font.clone(), weak);
        if known.is_empty() {
            let text = "Each configuration appears here\nonce its time and error are known.";
            let galley = painter.layout(text.to_owned(), FontId::proportional(13.0), weak, frame.width() - 16.0);
            painter.galley(frame.center() - galley.size() / 2.0, galley, weak);
            return None;
        }
        let x = Axis::around(known.iter().map(|(point, _)| point.milliseconds), SHORTEST);
        let y = Axis::around(known.iter().map(|&(_, error)| error), 1e-4);
        let line = Stroke::new(1.0, weak.gamma_multiply(0.25));
        for tick in x.ticks() {
            let at = frame.left() + frame.width() * x.fraction(tick);
            painter.vline(at, frame.y_range(), line);
            painter.text(pos2(at, frame.bottom() + 2.0), Align2::CENTER_TOP, short_time(tick), font.clone(), ink);
        }
        for tick in y.ticks() {
            let at = frame.bottom() - frame.height() * y.fraction(tick);
            painter.hline(frame.x_range(), at, line);
            let text = match metric {
                Metric::Absolute => format!("{tick:.0e}"),
                Metric::Flip => short_time(tick),
                _ if tick < 0.01 => format!("{:.1} %", 100.0 * tick),
                _ => format!("{:.0} %", 100.0 * tick),
            };
            painter.text(pos2(frame.left() - 4.0, at), Align2::RIGHT_CENTER, text, font.clone(), ink);
        }
        let position = |point: &Tried, error: f64| -> Pos2 {
            let (right, up) = (x.fraction(point.milliseconds), y.fraction(error));
            pos2(frame.left() + frame.width() * right, frame.bottom() - frame.height() * up)
        };
        for &(point, error) in &known {
            let at = position(point, error);
            match (0..2).find(|&side| current[side] == Some(&point.configuration)) {
                Some(side) => {
                    painter.circle_filled(at, 6.0, SIDE_COLOURS[side]);
                    // Inside the frame, also at its right end.
                    let (offset, align) = if at.x > frame.right() - 20.0 {
                        (vec2(-9.0, 0.0), Align2::RIGHT_CENTER)
                    } else {
                        (vec2(9.0, 0.0), Align2::LEFT_CENTER)
                    };
                    painter.text(at + offset, align, SIDE_NAMES[side], FontId::proportional(13.0), SIDE_COLOURS[side]);
                }
                None => drop(painter.circle_stroke(at, 4.0, Stroke::new(1.5, ink))),
            }
        }
        let pointer = response.hover_pos()?;
        let away = |&(point, error): &(&Tried, f64)| position(point, error).distance(pointer);
        let near = known.iter().filter(|point| away(point) < 12.0);
        let &(point, error) = near.min_by(|a, b| f32::total_cmp(&away(a), &away(b)))?;
        let settings: Vec<String> =
            point.configuration.settings.iter().map(|(key, v)| format!("{key} = {v}")).collect();
        let text = format!(
            "{}\n{}\n{}, {} ({})\nClick to use these settings for A.",
            point.configuration.technique().title,
            if settings.is_empty() { "all defaults".to_owned() } else { settings.join("\n") },
            milliseconds(point.milliseconds),
            metric.text(error),
            metric.title(),
        );
        let clicked = response.clicked();
        response.on_hover_text(text);
        clicked.then(|| point.configuration.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        let close = |found: Vec<f64>, wanted: &[f64]| {
            assert_eq!(found.len(), wanted.len(), "{found:?}");
            assert!(found.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-9 * b), "{found:?}");
        };
        close(Axis { low: 0.9, high: 11.0 }.ticks(), &[1.0, 2.0, 5.0, 10.0]);
        close(Axis { low: 0.05, high: 20.0 }.ticks(), &[0.1, 0.3, 1.0, 3.0, 10.0]);
        for decades in 1..14 {
            let ticks = Axis { low: 1e-4, high: 1e-4 * 10f64.powi(decades) }.ticks();
            assert!((2..=6).contains(&ticks.len()), "{decades} decades have {ticks:?}");
        }
        assert_eq!([short_time(0.5), short_time(0.01), short_time(20.0)], ["0.5", "0.01", "20"]);
    }
}
