//! Where values lie along an axis, and which of them are marked.

use super::Spacing;
use crate::format::number;

/// From values to pixels.
pub struct Scale {
    spacing: Spacing,
    low: f64,
    high: f64,
    /// Of `low` and `high`.
    pixels: [f64; 2],
    /// Of 0 on a logarithmic axis that has one.
    zero: Option<f64>,
}

/// Where 0 stands on a logarithmic axis, and where its values begin, pixels from its start.
const ZERO_AT: f64 = 10.0;
const VALUES_FROM: f64 = 40.0;

impl Scale {
    /// A scale that shows all `values` with a little air around them.
    pub fn around(values: impl Iterator<Item = f64>, spacing: Spacing, [start, end]: [f64; 2]) -> Self {
        let (zeros, others): (Vec<f64>, Vec<f64>) =
            values.partition(|&value| spacing == Spacing::Logarithmic && value == 0.0);
        let forward = (end - start).signum();
        let zero = (!zeros.is_empty()).then_some(start + forward * ZERO_AT);
        let pixels = [if zero.is_some() { start + forward * VALUES_FROM } else { start }, end];
        let (low, high) = others
            .into_iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        let (low, high) = match spacing {
            _ if low > high => (1.0, 10.0), // no values: any axis will do
            Spacing::Logarithmic => {
                let air = (high / low).powf(0.07).max(1.15);
                (low / air, high * air)
            }
            Spacing::Linear => {
                // Zero is shown unless the values cluster far from it.
                let (low, high) = (if low < 0.7 * high { low.min(0.0) } else { low }, high.max(0.0));
                let air = 0.07 * (high - low).max(1e-9 + 0.1 * high.abs());
                (if low == 0.0 { 0.0 } else { low - air }, high + air)
            }
        };
        Self { spacing, low, high, pixels, zero }
    }

    /// Pixel of a value.
    pub fn at(&self, value: f64) -> f64 {
        if let Some(zero) = self.zero.filter(|_| value == 0.0) {
            return zero;
        }
        let place = |value: f64| if self.spacing == Spacing::Linear { value } else { value.ln() };
        let share = (place(value) - place(self.low)) / (place(self.high) - place(self.low));
        self.pixels[0] + share * (self.pixels[1] - self.pixels[0])
    }

    /// The `wanted` values or, without any, round values within the scale, with their text.
    pub fn ticks(&self, wanted: &[f64]) -> Vec<(f64, String)> {
        let values: Vec<f64> = match self.spacing {
            _ if !wanted.is_empty() => wanted.to_vec(),
            Spacing::Linear => {
                let step = round_up((self.high - self.low) / 7.0);
                let (first, last) = ((self.low / step).ceil() as i64, (self.high / step).floor() as i64);
                (first..=last).map(|index| index as f64 * step).collect()
            }
            Spacing::Logarithmic => {
                let (first, last) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
                let decades = self.high.log10() - self.low.log10();
                // Narrow ranges need more than powers of ten; wide ones have no room for more.
                let steps: &[f64] = match decades {
                    ..0.7 => &[1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
                    0.7..2.5 => &[1.0, 2.0, 5.0],
                    _ => &[1.0],
                };
                let decade = |power: i32| steps.iter().map(move |step| step * 10f64.powi(power));
                (first..=last).flat_map(decade).filter(|value| (self.low..=self.high).contains(value)).collect()
            }
        };
        let zero = self.zero.map(|_| 0.0);
        zero.into_iter().chain(values).map(|value| (value, tick_text(value))).collect()
    }
}

/// The next larger of 1, 2, 5 times a power of ten.
fn round_up(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|factor| factor * power).find(|&round| round >= step * 0.999).unwrap_or(step)
}

/// Ticks are round: no trailing zeros.
fn tick_text(value: f64) -> String {
    let text = number(value, 4);
    match (text.contains('.'), text.contains('e')) {
        (true, false) => text.trim_end_matches('0').trim_end_matches('.').into(),
        _ => text.replace(".000e", "e"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scales_hold_all_values_and_ticks_are_round() {
        let scale = Scale::around([0.02, 0.3].into_iter(), Spacing::Logarithmic, [0.0, 100.0]);
        let ticks: Vec<String> = scale.ticks(&[]).into_iter().map(|(_, text)| text).collect();
        assert_eq!(ticks, ["0.02", "0.05", "0.1", "0.2"]);
        assert!(scale.at(0.02) > 0.0 && scale.at(0.3) < 100.0);
        // Equal ratios, equal distances.
        assert!((scale.at(0.08) - scale.at(0.04) - (scale.at(0.2) - scale.at(0.1))).abs() < 1e-9);

        let scale = Scale::around([3.0, 110.0].into_iter(), Spacing::Linear, [0.0, 100.0]);
        assert_eq!(scale.at(0.0), 0.0);
        assert_eq!(
            scale.ticks(&[]).iter().map(|(_, text)| text.as_str()).collect::<Vec<_>>(),
            ["0", "20", "40", "60", "80", "100"]
        );
        // Nothing has no logarithm: it stands apart, before all else.
        let scale = Scale::around([0.0, 50.0, 2000.0].into_iter(), Spacing::Logarithmic, [100.0, 0.0]);
        assert_eq!(scale.at(0.0), 90.0);
        assert!(scale.at(50.0) < 60.0 && scale.at(2000.0) > 0.0);
        assert_eq!(scale.ticks(&[])[0].1, "0");
        for degenerate in [vec![], vec![5.0], vec![0.0]] {
            let scale = Scale::around(degenerate.into_iter(), Spacing::Linear, [0.0, 100.0]);
            assert!(scale.at(5.0).is_finite() && scale.ticks(&[]).len() < 20);
        }
    }
}
