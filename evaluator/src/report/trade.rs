//! What each millisecond buys: for each measure, the frontier of time and error as a plot and as a table.

use super::grouping::{Group, is_baseline};
use super::measure::{MEASURES, Measure, Plotted};
use super::pareto::frontier;
use super::plots::{self, Named};
use super::tables::{Cell, Column, Table, TableRow};
use crate::format::{number, percent};
use crate::measurement::Measurement;

/// Time against one measure.
pub struct Trade {
    /// The measure.
    pub measure: &'static Measure,
    /// Every configuration, and the frontier.
    pub plot: Named,
    /// The frontier, fastest first, with what each step costs and brings.
    pub table: Table,
}

/// One trade for each measure that is plotted and that some row has, in the order of [`MEASURES`].
pub fn trades(group: &Group) -> Vec<Trade> {
    plots::shown_measures(group)
        .map(|(measure, plotted)| Trade {
            measure,
            plot: plots::time_against_error(group, measure, plotted),
            table: frontier_table(group, measure, plotted),
        })
        .collect()
}

/// Columns that every frontier has, whatever measure it is by.
const ALWAYS: [&str; 3] = ["FLIP", "relMSE", "bias"];

fn frontier_table(group: &Group, measure: &Measure, plotted: &Plotted) -> Table {
    let error = |row: &Measurement| plotted.error(measure, row);
    let measured: Vec<&Measurement> = group.rows.iter().map(|&(_, row)| row).collect();
    let others = || MEASURES.iter().filter(|other| ALWAYS.contains(&other.name) && other.name != plotted.name);
    let mut previous: Option<&Measurement> = None;
    let rows = frontier(&measured, error).into_iter().map(|index| {
        let (row_index, row) = group.rows[index];
        let more = previous.map(|before| row.time_ms_median - before.time_ms_median);
        let change = previous.map(|before| error(row) / error(before) - 1.0);
        previous = Some(row);
        let signed = |value: Option<f64>, text: &dyn Fn(f64) -> String| Cell {
            text: value.map_or(String::new(), text),
            value,
            best: false,
        };
        let mut cells = vec![
            Cell::row(row_index),
            Cell::text(group.label(row)),
            Cell::number(Some(row.time_ms_median), 3),
            signed(more, &|more| format!("+{}", number(more, 3))),
            Cell::number(Some(error(row)), measure.digits),
            signed(change, &percent),
        ];
        cells.extend(others().map(|other| Cell::number((other.value)(row), other.digits)));
        TableRow { row: Some(row_index), cells }
    });
    let rows = rows.collect();
    let mut columns = vec![
        Column::numeric("#", "", "row of results.csv"),
        Column::text("configuration"),
        Column::numeric("time", "ms", "median over the frames of every pass beyond G-buffer and direct light"),
        Column::numeric("more time", "ms", "than the row above"),
        Column::numeric(plotted.name, measure.unit, measure.meaning),
        Column::numeric("change", "", &format!("of {} against the row above", plotted.name)),
    ];
    columns.extend(others().map(|other| Column::numeric(other.name, other.unit, other.meaning)));
    Table { title: format!("What each millisecond buys, by {}", plotted.name), caption: String::new(), columns, rows }
}

/// What every frontier is.
pub const CAPTION: &str = "The configurations that no other beats in both time and error, fastest first: each row is the \
                           cheapest way to its error, and the difference from the row above is what the extra \
                           milliseconds buy. Of configurations whose times overlap, only the one with the lower error \
                           is here.";

/// Why relMSE puts no indirect light at all above configurations that other measures put far ahead of it; None where
/// it does not.
pub fn remark_on_rel_mse(group: &Group) -> Option<String> {
    let (_, baseline) = group.rows.iter().find(|(_, row)| is_baseline(row))?;
    let others = || group.rows.iter().filter(|(_, row)| !is_baseline(row));
    let better = |measure: &Measure, plotted: &Plotted| {
        others().filter(|(_, row)| plotted.error(measure, row) < plotted.error(measure, baseline)).count()
    };
    let all = others().count();
    let (told, others_told): (Vec<_>, Vec<_>) =
        plots::shown_measures(group).partition(|(measure, _)| measure.name == "relMSE");
    let &(rel_mse, plotted) = told.first()?;
    let worse = all - better(rel_mse, plotted);
    let by_others =
        others_told.iter().map(|(measure, plotted)| format!("{} {}", plotted.name, better(measure, plotted)));
    let by_others = by_others.collect::<Vec<_>>().join(", ");
    (worse > 0).then(|| {
        format!(
            "By relMSE, {worse} of {all} configurations rank below none, the image without indirect light; better than it \
             are, by {by_others}. relMSE divides each squared error by the square of the truth: light that is missing \
             counts at most 1, so none never exceeds 1, but light where the truth is dark counts without bound. A gather \
             that tests no visibility lets light leak into just these places. RMSE and bias weigh energy, FLIP and SSIM \
             what a viewer sees."
        )
    })
}
