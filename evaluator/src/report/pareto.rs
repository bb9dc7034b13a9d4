//! The frontier: configurations that no other beats in both time and error.

use super::grouping::Group;
use crate::measurement::Measurement;

/// The frontier of each frame of a group, as positions of its rows: [`Group::by_frame`] and [`frontier`].
pub fn frontiers(group: &Group, error: impl Fn(&Measurement) -> f64) -> Vec<(Option<u32>, Vec<usize>)> {
    let of = |(frame, positions): (Option<u32>, Vec<usize>)| {
        let rows: Vec<&Measurement> = positions.iter().map(|&position| group.rows[position].1).collect();
        (frame, frontier(&rows, &error).into_iter().map(|index| positions[index]).collect())
    };
    group.by_frame().into_iter().map(of).collect()
}

/// Positions in `rows` of the frontier by time and the error that `error` takes from a row, fastest first; lower is
/// better in both.
///
/// A row is beaten by one of lower error that is not measurably slower: whose fastest frame is no slower than the
/// row's median. So two rows whose times overlap are not ranked by luck; the one with the lower error stays. Rows
/// without a finite time and error are left out; of equal rows the first stays.
pub fn frontier(rows: &[&Measurement], error: impl Fn(&Measurement) -> f64) -> Vec<usize> {
    let finite = |&index: &usize| rows[index].time_ms_median.is_finite() && error(rows[index]).is_finite();
    // From the lowest error upwards, a row stays when it is faster than all before it.
    let mut order: Vec<usize> = (0..rows.len()).filter(finite).collect();
    order.sort_by(|&a, &b| {
        let (a, b) = (rows[a], rows[b]);
        error(a).total_cmp(&error(b)).then(a.time_ms_median.total_cmp(&b.time_ms_median))
    });
    let mut fastest = f64::INFINITY;
    order.retain(|&index| {
        let stays = rows[index].time_ms_median < fastest;
        fastest = fastest.min(rows[index].time_ms_min);
        stays
    });
    order.reverse();
    order
}

#[cfg(test)]
mod tests {
    use halflight_metrics::MetricId;

    use super::*;

    fn frontier_of(cells: &[(f64, f64, f64)]) -> Vec<usize> {
        let row = |&(min, median, error): &(f64, f64, f64)| {
            let mut row = Measurement { time_ms_min: min, time_ms_median: median, ..Measurement::default() };
            row.errors.set(MetricId::IndirectRelMse, Some(error));
            row
        };
        let rows: Vec<Measurement> = cells.iter().map(row).collect();
        frontier(&rows.iter().collect::<Vec<_>>(), |row| row.errors.get(MetricId::IndirectRelMse).unwrap_or(f64::NAN))
    }

    #[test]
    fn only_unbeaten_rows_stay() {
        let exact = |(time, error): (f64, f64)| (time, time, error);
        let pairs = [(2.0, 5.0), (1.0, 9.0), (3.0, 5.0), (4.0, 1.0), (1.0, 8.0), (f64::NAN, 0.0), (2.0, 5.0)];
        assert_eq!(frontier_of(&pairs.map(exact)), [4, 0, 3]);
        assert!(frontier_of(&[]).is_empty());
        // Nothing on the frontier is beaten, and everything off it is.
        let pairs: Vec<(f64, f64)> = (0..97).map(|i| (f64::from(i * 31 % 97), f64::from(i * 57 % 89))).collect();
        let best = frontier_of(&pairs.iter().copied().map(exact).collect::<Vec<_>>());
        let beats = |a: (f64, f64), b: (f64, f64)| a != b && a.0 <= b.0 && a.1 <= b.1;
        for (index, &pair) in pairs.iter().enumerate() {
            assert_eq!(best.contains(&index), !pairs.iter().any(|&other| beats(other, pair)));
        }
    }

    #[test]
    fn times_that_overlap_are_not_ranked() {
        // The second takes 0.1 ms more in the median but is as fast at its best, and its error is lower.
        assert_eq!(frontier_of(&[(9.9, 10.0, 5.0), (9.8, 10.1, 4.0), (30.0, 31.0, 1.0)]), [1, 2]);
        // Where they do not overlap, both stay.
        assert_eq!(frontier_of(&[(9.9, 10.0, 5.0), (10.05, 10.1, 4.0)]), [0, 1]);
    }
}
