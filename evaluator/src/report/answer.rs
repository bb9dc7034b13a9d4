//! The answer that a report of several techniques opens with: the settings with the lowest error within four times, and their
//! pictures.

use halflight_metrics::{Metric, MetricId, Plotted};

use super::document::table::{Cell, Column, Table, TableRow};
use super::grouping::{Group, is_baseline};
use super::pareto::frontiers;
use super::plots::{self, Named};
use crate::format::{number, percent};
use crate::measurement::Measurement;

/// The metric that decides, as in `evaluator recommend`.
const DECIDING: MetricId = MetricId::IndirectBlockRelMse;
/// Most budgets.
const BUDGETS: usize = 4;

/// The best settings of all techniques on one subject.
pub struct Answer {
    /// Time against error of all rows, with the frontier.
    pub plot: Named,
    /// The winner for each budget; without rows where nothing is better than no indirect light.
    pub table: Table,
    /// Row, title and path of each picture: the reference, no indirect light, the winners.
    pub pictures: Vec<(Option<usize>, String, String)>,
}

/// The answer of a group with all rows of a subject; `None` where it has one technique, or no error that decides.
pub fn answer(group: &Group) -> Option<Answer> {
    let metric = DECIDING.metric();
    let plotted = metric.plot.as_ref()?;
    let is_measured = group.rows.iter().any(|(_, row)| row.errors.get(DECIDING).is_some());
    if !group.mixed_techniques || !is_measured {
        return None;
    }
    let shown = plots::shown_in_full(group).into_iter().collect();
    let mut plot = plots::time_against_error(group, &shown, metric, plotted);
    plot.file = "frontier".into();
    plot.choice = "";
    let baseline = group.rows.iter().find(|(_, row)| is_baseline(row)).copied();
    let winners = winners(group, metric, plotted, baseline.map(|(_, row)| row));
    Some(Answer { plot, table: table(group, metric, plotted, &winners), pictures: pictures(group, &winners, baseline) })
}

/// What wins.
struct Winners<'a> {
    /// Error without indirect light.
    baseline: Option<f64>,
    /// The frame that errors are of, where rows were measured at several.
    frame: Option<u32>,
    /// Budget in ms, index of the row in the results, the row, and its error.
    winners: Vec<(f64, usize, &'a Measurement, f64)>,
}

fn winners<'a>(group: &Group<'a>, metric: &Metric, plotted: &Plotted, baseline: Option<&Measurement>) -> Winners<'a> {
    let error = |row: &Measurement| plots::error(metric, plotted, row);
    let baseline = baseline.map(error).filter(|error| error.is_finite());
    // After the most frames: what a static view comes to.
    let (frame, best) = frontiers(group, error).pop().unwrap_or_default();
    let better = |row: &Measurement| !is_baseline(row) && baseline.is_none_or(|baseline| error(row) < baseline);
    let best: Vec<(usize, &Measurement)> =
        best.into_iter().map(|at| group.rows[at]).filter(|(_, row)| better(row)).collect();
    let mut winners: Vec<(f64, usize, &Measurement, f64)> = Vec::new();
    for budget in budgets(&best.iter().map(|(_, row)| row.time_ms_median).collect::<Vec<_>>()) {
        let within = best.iter().rfind(|(_, row)| row.time_ms_median <= budget);
        if let Some(&(index, row)) = within.filter(|(index, _)| winners.iter().all(|known| known.1 != *index)) {
            winners.push((budget, index, row, error(row)));
        }
    }
    Winners { baseline, frame, winners }
}

/// Budgets for these times of a frontier, in rising order, ms: at most [`BUDGETS`] of them, at even ratios from the fastest to
/// the slowest, rounded up to two digits.
fn budgets(times: &[f64]) -> Vec<f64> {
    let (Some(&first), Some(&last)) = (times.first(), times.last()) else { return Vec::new() };
    let chosen: Vec<f64> = if times.len() <= BUDGETS {
        times.to_vec()
    } else {
        let mut free = times.to_vec();
        let target = |step: usize| first * (last / first).powf(step as f64 / (BUDGETS - 1) as f64);
        let mut chosen: Vec<f64> = (0..BUDGETS)
            .filter_map(|step| {
                let distance = |time: f64| (time / target(step)).ln().abs();
                let nearest = (0..free.len()).min_by(|&a, &b| distance(free[a]).total_cmp(&distance(free[b])))?;
                Some(free.remove(nearest))
            })
            .collect();
        chosen.sort_by(f64::total_cmp);
        chosen
    };
    chosen.into_iter().map(rounded_up).collect()
}

/// The next number of two digits.
fn rounded_up(time: f64) -> f64 {
    if time <= 0.0 {
        return time;
    }
    let unit = 10f64.powi(time.log10().floor() as i32 - 1);
    (time / unit).ceil() * unit
}

fn table(group: &Group, metric: &Metric, plotted: &Plotted, found: &Winners) -> Table {
    let Winners { baseline, frame, winners } = found;
    let others: Vec<&Metric> =
        Metric::ranked().into_iter().filter(|other| other.headline && other.title != metric.title).collect();
    let mut columns = vec![
        Column::numeric("budget", "ms", "a time of the frontier, rounded up"),
        Column::text("best within it"),
        Column::numeric("time", "ms", "median over the frames of every pass beyond G-buffer and direct light"),
        Column::numeric(plotted.name, metric.unit, metric.meaning),
        Column::numeric("change", "", "against no indirect light"),
    ];
    columns.extend(others.iter().map(|other| Column::numeric(other.title, other.unit, other.meaning)));
    let rows = winners.iter().map(|&(budget, index, row, error)| {
        let change = baseline.map(|baseline| error / baseline - 1.0);
        let mut cells = vec![
            Cell::number(Some(budget), 2),
            Cell::text(group.label(row)),
            Cell::number(Some(row.time_ms_median), 3),
            Cell::number(Some(error), metric.digits),
            Cell { text: change.map_or(String::new(), percent), value: change, best: false },
        ];
        cells.extend(others.iter().map(|other| Cell::number(row.errors.get(other.id), other.digits)));
        TableRow { row: Some(index), cells }
    });
    let mut caption = match (baseline, winners.is_empty()) {
        (Some(baseline), true) => format!(
            "No configuration has a lower {} than no indirect light ({}): add visibility, samples, or a technique that traces \
             rays.",
            plotted.name,
            number(*baseline, 3)
        ),
        (None, true) => format!("No configuration has a finite time and {}.", plotted.name),
        (_, false) => format!(
            "The lowest {} within each time, over all configurations. The budgets are times of the frontier at even ratios, so \
             they suit any computer.",
            plotted.name
        ),
    };
    if let (Some(baseline), false) = (baseline, winners.is_empty()) {
        caption += &format!(" No indirect light has {}; what is worse is left out.", number(*baseline, 3));
    }
    if let Some(frame) = frame {
        caption += &format!(" Techniques with a history count with their error in frame {frame}.");
    } else if winners.iter().any(|(_, _, row, _)| row.at_frame.is_some()) {
        caption += " A technique with a history counts with its error in the frame that its label names.";
    }
    if !group.first().moving.is_empty() {
        caption += match group.first().moving.as_str() {
            "camera" => " The camera moves.",
            _ => " The lights have turned before.",
        };
    }
    Table { title: "Which settings for which time".into(), caption, columns, rows: rows.collect() }
}

fn pictures(
    group: &Group,
    found: &Winners,
    baseline: Option<(usize, &Measurement)>,
) -> Vec<(Option<usize>, String, String)> {
    let reference = group.rows.iter().find_map(|(_, row)| row.image("truth_final"));
    let error = |row: &Measurement| row.errors.get(DECIDING).map_or(String::new(), |error| number(error, 3));
    let name = DECIDING.metric().title;
    let mut pictures: Vec<(Option<usize>, String, String)> = Vec::new();
    pictures.extend(reference.map(|path| (None, "path-traced reference".to_owned(), path.to_owned())));
    for &(budget, index, row, _) in &found.winners {
        let title = format!("within {} ms: {}, {name} {}", number(budget, 2), group.label(row), error(row));
        pictures.extend(row.image("final").map(|path| (Some(index), title, path.to_owned())));
    }
    if let Some((index, row)) = baseline {
        let title = format!("no indirect light, {name} {}", error(row));
        pictures.extend(row.image("final").map(|path| (Some(index), title, path.to_owned())));
    }
    // The reference alone shows nothing.
    if pictures.len() > 1 { pictures } else { Vec::new() }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use serde_json::json;

    use super::*;
    use crate::report::grouping::groups;

    fn row(technique: &str, time: f64, error: f64) -> Measurement {
        let mut row = Measurement {
            technique: technique.into(),
            time_ms_median: time,
            time_ms_min: time,
            images: json!({"final": format!("{technique}{time}.png"), "truth_final": "t.png"})
                .as_object()
                .cloned()
                .unwrap(),
            ..Measurement::default()
        };
        row.errors.set(DECIDING, Some(error));
        row
    }

    fn texts(answer: &Answer) -> Vec<[String; 4]> {
        let cells = |row: &TableRow| [0, 1, 3, 4].map(|index| row.cells[index].text.clone());
        answer.table.rows.iter().map(cells).collect()
    }

    #[test]
    fn each_budget_has_the_lowest_error_within_it_on_any_computer() {
        let rows = |scale: f64| {
            let of = |(technique, time, error)| row(technique, time * scale, error);
            vec![
                of(("none", 0.0, 0.9)),
                of(("a", 1.01, 0.8)),
                of(("b", 2.0, 0.7)),
                of(("a", 3.9, 0.5)),
                of(("b", 4.2, 0.4)),
                // Slower and worse than the one above, and worse than nothing.
                of(("b", 5.0, 0.45)),
                of(("a", 0.5, 0.95)),
                of(("b", 9.0, 0.3)),
                of(("c", 16.0, 0.1)),
            ]
        };
        let slow = rows(10.0);
        let found = answer(&groups(&slow)[0]).unwrap();
        // Even ratios of 10.1 to 160 are 10.1, 25.4, 63.7 and 160.
        let expected = [
            ["11", "a", "0.800", "−11.1 %"],
            ["20", "b", "0.700", "−22.2 %"],
            ["90", "b", "0.300", "−66.7 %"],
            ["160", "c", "0.100", "−88.9 %"],
        ];
        assert_eq!(texts(&found), expected.map(|row| row.map(str::to_owned)));
        let titles: Vec<(Option<usize>, &str)> =
            found.pictures.iter().map(|(row, title, _)| (*row, title.as_str())).collect();
        assert_eq!(titles[0], (None, "path-traced reference"));
        assert_eq!(titles[1], (Some(1), "within 11 ms: a, block relMSE 0.800"));
        assert_eq!(titles[5], (Some(0), "no indirect light, block relMSE 0.900"));
        let fast = rows(0.1);
        let quick = answer(&groups(&fast)[0]).unwrap();
        let rows = |answer: &Answer| answer.table.rows.iter().map(|row| row.row).collect::<Vec<_>>();
        assert_eq!(rows(&quick), rows(&found));
    }

    #[test]
    fn the_last_frame_decides() {
        let at = |frame: u32, time: f64, error: f64| Measurement { at_frame: Some(frame), ..row("cache", time, error) };
        let rows = [row("a", 2.0, 0.5), at(1, 1.0, 0.6), at(8, 3.0, 0.1), at(8, 4.0, 0.05)];
        let found = answer(&groups(&rows)[0]).unwrap();
        assert_eq!(found.table.rows.iter().map(|row| row.row).collect::<Vec<_>>(), [Some(0), Some(2), Some(3)]);
        assert!(found.table.caption.contains("in frame 8"), "{}", found.table.caption);
    }

    #[test]
    fn without_an_answer_one_sentence_says_why() {
        let rows = [row("none", 0.0, 0.5), row("a", 1.0, 0.6), row("b", 1.0, 0.7)];
        let found = answer(&groups(&rows)[0]).unwrap();
        assert!(found.table.rows.is_empty());
        assert!(
            found.table.caption.starts_with("No configuration has a lower block relMSE than no indirect light (0.500)")
        );
        // One technique, or no metric that decides: no answer.
        assert!(answer(&groups(&rows[..2])[0]).is_none());
        let mut bare = rows;
        bare.iter_mut().for_each(|row| row.errors.set(DECIDING, None));
        assert!(answer(&groups(&bare)[0]).is_none());
    }

    #[test]
    fn budgets_are_round() {
        assert_eq!(
            [0.0123, 9.1, 9.91, 10.0, 123.0].map(rounded_up).map(|v| number(v, 2)),
            ["0.013", "9.1", "10", "10", "130"]
        );
        assert_eq!(budgets(&[]), [0.0; 0]);
        assert_eq!(budgets(&[3.0]), [3.0]);
    }
}
