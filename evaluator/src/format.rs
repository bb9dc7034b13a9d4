//! Numbers and settings as a reader wants them.

use halflight_renderer::parameters::Settings;

/// `value` with `digits` significant digits: plain between 0.0001 and a million, else with an exponent.
pub fn number(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "NaN".into();
    }
    if value.is_infinite() {
        return if value > 0.0 { "∞".into() } else { "−∞".into() };
    }
    let magnitude = value.abs();
    let text = if magnitude == 0.0 {
        "0".into()
    } else if (1e-4..1e6).contains(&magnitude) {
        let decimals = (digits as i32 - 1 - magnitude.log10().floor() as i32).max(0) as usize;
        format!("{magnitude:.decimals$}")
    } else {
        format!("{magnitude:.*e}", digits.saturating_sub(1))
    };
    // A typographic minus is as wide as a digit.
    if value < 0.0 { format!("−{text}") } else { text }
}

/// A count with a comma between thousands.
pub fn count(value: u64) -> String {
    let digits = value.to_string();
    let grouped: Vec<&str> =
        digits.as_bytes().rchunks(3).rev().map(|group| str::from_utf8(group).unwrap_or_default()).collect();
    grouped.join(",")
}

/// Settings in one line, for files and messages.
pub fn settings(settings: &Settings) -> String {
    settings.iter().map(|(key, value)| format!("{key}={value}")).collect::<Vec<_>>().join(" ")
}

/// A change in percent with its sign.
pub fn percent(change: f64) -> String {
    let sign = if change > 0.0 { "+" } else { "" };
    format!("{sign}{} %", number(100.0 * change, if change.abs() < 0.1 { 2 } else { 3 }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_significant_digits() {
        let cases = [
            (0.0, "0"),
            (13.94, "13.9"),
            (1234.5, "1234"),
            (0.061_26, "0.0613"),
            (-0.5, "−0.500"),
            (0.000_012_3, "1.23e-5"),
            (2.5e9, "2.50e9"),
            (f64::INFINITY, "∞"),
            (f64::NAN, "NaN"),
        ];
        for (value, text) in cases {
            assert_eq!(number(value, 3), text);
        }
        assert_eq!([0, 12, 999, 1000, 1_234_567].map(count), ["0", "12", "999", "1,000", "1,234,567"]);
        assert_eq!(percent(-0.4567), "−45.7 %");
        assert_eq!(percent(0.0123), "+1.2 %");
    }
}
