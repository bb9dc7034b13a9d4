//! What each millisecond buys: for each metric, the frontier of time and error as a plot and as a table.

use std::collections::BTreeSet;

use halflight_metrics::{Metric, MetricId, Plotted};

use super::document::table::{Cell, Column, Table, TableRow};
use super::grouping::{Group, is_baseline};
use super::pareto::frontiers;
use super::plots::{self, Named};
use crate::format::{number, percent};
use crate::measurement::Measurement;

/// Time against one metric.
pub struct Trade {
    /// The metric.
    pub metric: &'static Metric,
    /// Every configuration, and the frontier.
    pub plot: Named,
    /// The frontier, fastest first, with what each step costs and brings.
    pub table: Table,
}

/// One trade for each metric that is plotted and that some row has, in reading order.
///
/// Rows beside those that are `shown` in full, by position, are dots.
pub fn trades(group: &Group, shown: &BTreeSet<usize>) -> Vec<Trade> {
    plots::shown_metrics(group)
        .map(|(metric, plotted)| Trade {
            metric,
            plot: plots::time_against_error(group, shown, metric, plotted),
            table: frontier_table(group, metric, plotted),
        })
        .collect()
}

fn frontier_table(group: &Group, metric: &Metric, plotted: &Plotted) -> Table {
    let error = |row: &Measurement| plots::error(metric, plotted, row);
    let others: Vec<&Metric> =
        Metric::ranked().into_iter().filter(|other| other.in_frontiers && other.title != plotted.name).collect();
    let table_row = |index: usize, previous: Option<&Measurement>, frame: Option<u32>| {
        let (row_index, row) = group.rows[index];
        let more = previous.map(|before| row.time_ms_median - before.time_ms_median);
        let change = previous.map(|before| error(row) / error(before) - 1.0);
        let signed = |value: Option<f64>, text: &dyn Fn(f64) -> String| Cell {
            text: value.map_or(String::new(), text),
            value,
            best: false,
        };
        let mut cells = vec![Cell::row(row_index)];
        cells.extend(frame.map(Cell::count));
        cells.extend([
            Cell::text(group.label(row)),
            Cell::number(Some(row.time_ms_median), 3),
            signed(more, &|more| format!("+{}", number(more, 3))),
            Cell::number(Some(error(row)), metric.digits),
            signed(change, &percent),
        ]);
        cells.extend(others.iter().map(|other| Cell::number(row.errors.get(other.id), other.digits)));
        TableRow { row: Some(row_index), cells }
    };
    let mut rows = Vec::new();
    for (frame, best) in frontiers(group, error) {
        let mut previous = None;
        for index in best {
            rows.push(table_row(index, previous, frame));
            previous = Some(group.rows[index].1);
        }
    }
    let mut columns = vec![Column::numeric("#", "", "row of results.csv")];
    if group.has_several_frames() {
        columns.push(Column::numeric("frame", "", "the frame that is measured, counted from 1"));
    }
    columns.extend([
        Column::text("configuration"),
        Column::numeric("time", "ms", "median over the frames of every pass beyond G-buffer and direct light"),
        Column::numeric("more time", "ms", "than the row above"),
        Column::numeric(plotted.name, metric.unit, metric.meaning),
        Column::numeric("change", "", &format!("of {} against the row above", plotted.name)),
    ]);
    columns.extend(others.iter().map(|other| Column::numeric(other.title, other.unit, other.meaning)));
    Table { title: format!("What each millisecond buys, by {}", plotted.name), caption: String::new(), columns, rows }
}

/// What every frontier is.
pub const CAPTION: &str = "The configurations that no other beats in both time and error, fastest first: each row is the \
                           cheapest way to its error, and the difference from the row above is what the extra \
                           milliseconds buy. Of configurations whose times overlap, only the one with the lower error \
                           is here.";

/// What is different where rows were measured at several frames.
pub const CAPTION_FRAMES: &str = " A technique with a history needs frames, so each frame has a frontier of its own: of the rows \
                                  measured at it and of those that are the same in every frame.";

/// Why relMSE ranks the image without indirect light above configurations that other metrics rank far above it; `None`
/// where it does not.
pub fn remark_on_rel_mse(group: &Group) -> Option<String> {
    let (_, baseline) = group.rows.iter().find(|(_, row)| is_baseline(row))?;
    let others = || group.rows.iter().filter(|(_, row)| !is_baseline(row));
    let better = |metric: &Metric, plotted: &Plotted| {
        let error = |row: &Measurement| plots::error(metric, plotted, row);
        others().filter(|(_, row)| error(row) < error(baseline)).count()
    };
    let all = others().count();
    let (by_rel_mse, by_others): (Vec<_>, Vec<_>) =
        plots::shown_metrics(group).partition(|(metric, _)| metric.id == MetricId::IndirectRelMse);
    let &(rel_mse, plotted) = by_rel_mse.first()?;
    let worse = all - better(rel_mse, plotted);
    let by_others = by_others.iter().map(|(metric, plotted)| format!("{} {}", plotted.name, better(metric, plotted)));
    let by_others = by_others.collect::<Vec<_>>().join(", ");
    (worse > 0).then(|| {
        format!(
            "By relMSE, {worse} of {all} configurations are worse than showing no indirect light (none). By other metrics, \
             this many are better than none: {by_others}. relMSE divides each squared error by the square of the \
             reference. Missing light counts at most 1, so none never exceeds 1; light in dark areas counts without \
             bound, and a gather that tests no visibility leaks light there. RMSE and bias weigh energy, FLIP and SSIM \
             what a viewer sees."
        )
    })
}
