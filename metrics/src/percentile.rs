//! Order statistics of errors and of times.

/// The value below which the share `fraction` (0..=1) of `values` lies, with linear interpolation between ranks (the
/// default of NumPy and R). NaN when `values` is empty. Reorders `values`.
pub fn percentile(values: &mut [f64], fraction: f64) -> f64 {
    if values.is_empty() {
        return f64::NAN;
    }
    let rank = fraction.clamp(0.0, 1.0) * (values.len() - 1) as f64;
    let (_, &mut low, above) = values.select_nth_unstable_by(rank as usize, f64::total_cmp);
    let high = above.iter().copied().min_by(f64::total_cmp).unwrap_or(low);
    let share = rank.fract();
    // Without the branch an infinite neighbour would turn an exact rank into NaN.
    if share == 0.0 { low } else { low + (high - low) * share }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentile_interpolates_between_ranks() {
        let values = || [4.0, 1.0, 3.0, 2.0];
        assert_eq!(percentile(&mut values(), 0.0), 1.0);
        assert_eq!(percentile(&mut values(), 0.5), 2.5);
        assert_eq!(percentile(&mut values(), 1.0), 4.0);
        // Rank 0.95 * 3 = 2.85: 3 + 0.85 * (4 - 3); equal up to round-off.
        assert!((percentile(&mut values(), 0.95) - 3.85).abs() < 1e-12);
        assert_eq!(percentile(&mut [7.0], 0.3), 7.0);
        assert!(percentile(&mut [], 0.5).is_nan());
    }
}
