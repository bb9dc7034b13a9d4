//! The answer that a report of several techniques opens with: the settings with the lowest error within four times, and their
//! pictures.

use halflight_metrics::{Metric, MetricId, Plotted};
use halflight_renderer::parameters::Settings;
use halflight_techniques::technique;
use serde_json::Value;

use super::document::table::{Cell, Column, Table, TableRow};
use super::grouping::{Group, is_baseline, value_label};
use super::pareto::frontiers;
use super::plots::{self, Named};
use crate::format::{number, percent};
use crate::measurement::Measurement;

/// The metric that decides, as in `evaluator recommend`.
const DECIDING: MetricId = MetricId::IndirectBlockRelMse;
/// Error relative to that of no indirect light from which on the first budget may start.
const USEFUL: f64 = 0.9;
/// Most budgets.
const BUDGETS: usize = 4;

/// The best settings of all techniques on one subject.
pub struct Answer {
    /// Time against error of all rows, with the frontier.
    pub plot: Named,
    /// The winner for each budget; without rows where nothing is better than no indirect light.
    pub table: Table,
    /// Row, title and path of each picture: no indirect light, the winners, the reference.
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
    let is_useful = |row: &Measurement| baseline.is_none_or(|baseline| error(row) <= USEFUL * baseline);
    let fastest = best.iter().find(|(_, row)| is_useful(row)).or(best.first()).map(|(_, row)| row.time_ms_median);
    let slowest = group.rows.iter().map(|(_, row)| row.time_ms_median).filter(|time| time.is_finite()).reduce(f64::max);
    let budgets = fastest.zip(slowest).map_or(Vec::new(), |(fastest, slowest)| budgets(fastest, slowest));
    let winner = |budget: f64| {
        let (index, row) = best.iter().rfind(|(_, row)| row.time_ms_median <= budget).copied()?;
        Some((budget, index, row, error(row)))
    };
    Winners { baseline, frame, winners: budgets.into_iter().filter_map(winner).collect() }
}

/// [`BUDGETS`] times at even ratios from that of the fastest useful configuration to that of the slowest of all, ms, rounded up to
/// two digits.
fn budgets(fastest: f64, slowest: f64) -> Vec<f64> {
    let step = |step: usize| fastest * (slowest / fastest).powf(step as f64 / (BUDGETS - 1) as f64);
    let mut budgets: Vec<f64> = (0..BUDGETS).map(step).map(rounded_up).collect();
    budgets.dedup();
    budgets
}

/// The next number of two digits.
fn rounded_up(time: f64) -> f64 {
    if time <= 0.0 {
        return time;
    }
    let unit = 10f64.powi(time.log10().floor() as i32 - 1);
    // A number of two digits stays as it is, whatever its last bit.
    (time / unit * (1.0 - 1e-12)).ceil() * unit
}

fn table(group: &Group, metric: &Metric, plotted: &Plotted, found: &Winners) -> Table {
    let Winners { baseline, frame, winners } = found;
    let others: Vec<&Metric> =
        Metric::ranked().into_iter().filter(|other| other.headline && other.title != metric.title).collect();
    let mut columns = vec![
        Column::numeric(
            "budget",
            "ms",
            "even ratios from the fastest with a tenth less error than none to the slowest",
        ),
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
            Cell::text(label(row)),
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
            "The lowest {} within each time, over all configurations. The times go at even ratios from the fastest \
             configuration with a tenth less error than no indirect light to the slowest of all, so they suit any computer. \
             Settings at their defaults are not named.",
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

/// A row's technique, the settings that differ from its defaults, and its frame.
fn label(row: &Measurement) -> String {
    let defaults = technique(&row.technique).ok().and_then(|technique| (technique.complete)(&Settings::new()).ok());
    let is_default = |name: &str, value: &Value| {
        let default = defaults.as_ref().and_then(|defaults| defaults.get(name));
        default.is_some_and(|default| serde_json::to_value(default).is_ok_and(|default| default == *value))
    };
    let changed = row.parameters.iter().filter(|(name, value)| !is_default(name, value));
    let changed = changed.map(|(name, value)| value_label(name, value));
    let frame = row.at_frame.map(|frame| format!("frame {frame}"));
    [row.technique.clone()].into_iter().chain(changed).chain(frame).collect::<Vec<_>>().join(" · ")
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
    if let Some((index, row)) = baseline {
        let title = format!("no indirect light, {name} {}", error(row));
        pictures.extend(row.image("final").map(|path| (Some(index), title, path.to_owned())));
    }
    for &(budget, index, row, _) in &found.winners {
        // What wins again is shown once.
        if pictures.iter().all(|(known, ..)| *known != Some(index)) {
            let title = format!("within {} ms: {}, {name} {}", number(budget, 2), label(row), error(row));
            pictures.extend(row.image("final").map(|path| (Some(index), title, path.to_owned())));
        }
    }
    pictures.extend(reference.map(|path| (None, "path-traced reference".to_owned(), path.to_owned())));
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
                // Better than nothing, but not useful.
                of(("a", 0.9, 0.82)),
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
        // Even ratios of 10.1 to 160, rounded up.
        let expected = [
            ["11", "a", "0.800", "−11.1 %"],
            ["26", "b", "0.700", "−22.2 %"],
            ["64", "b", "0.400", "−55.6 %"],
            ["160", "c", "0.100", "−88.9 %"],
        ];
        assert_eq!(texts(&found), expected.map(|row| row.map(str::to_owned)));
        let titles: Vec<(Option<usize>, &str)> =
            found.pictures.iter().map(|(row, title, _)| (*row, title.as_str())).collect();
        assert_eq!(titles[0], (Some(0), "no indirect light, block relMSE 0.900"));
        assert_eq!(titles[1], (Some(2), "within 11 ms: a, block relMSE 0.800"));
        assert_eq!(titles[5], (None, "path-traced reference"));
        let fast = rows(0.1);
        let quick = answer(&groups(&fast)[0]).unwrap();
        let rows = |answer: &Answer| answer.table.rows.iter().map(|row| row.row).collect::<Vec<_>>();
        assert_eq!(rows(&quick), rows(&found));
    }

    #[test]
    fn the_last_frame_decides() {
        let at = |frame: u32, time: f64, error: f64| Measurement { at_frame: Some(frame), ..row("cache", time, error) };
        let rows = [row("a", 2.0, 0.5), at(1, 1.0, 0.6), at(8, 3.0, 0.1), at(8, 4.0, 0.05), row("a", 16.0, 0.2)];
        let found = answer(&groups(&rows)[0]).unwrap();
        // 2, 4, 8 and 16 ms: more time brings nothing more, and the picture is shown once.
        assert_eq!(found.table.rows.iter().map(|row| row.row).collect::<Vec<_>>(), [0, 3, 3, 3].map(Some));
        assert_eq!(found.pictures.iter().map(|picture| picture.0).collect::<Vec<_>>(), [Some(0), Some(3), None]);
        assert!(found.pictures[1].1.contains("cache · frame 8"), "{}", found.pictures[1].1);
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
        let round = [0.0123, 9.1, 9.91, 10.0, 123.0].map(rounded_up).map(|v| number(v, 2));
        assert_eq!(round, ["0.013", "9.1", "10", "10", "130"]);
        assert_eq!(budgets(1.0, 8.0).len(), 4);
        assert_eq!(budgets(3.0, 3.0), [3.0]);
    }

    #[test]
    fn defaults_are_not_named() {
        let mut row = row("hierarchical", 1.0, 0.1);
        let technique = technique("hierarchical").unwrap();
        let settings = (technique.complete)(&Settings::new()).unwrap();
        row.parameters =
            settings.iter().map(|(key, value)| (key.clone(), serde_json::to_value(value).unwrap())).collect();
        assert_eq!(label(&row), "hierarchical");
        row.parameters.insert("hierarchical.levels".into(), 5.into());
        assert_eq!(label(&row), "hierarchical · levels 5");
    }
}
