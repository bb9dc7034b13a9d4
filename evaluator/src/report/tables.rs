//! The tables of a report.

use halflight_metrics::{Best, Metric};

use super::document::table::{Cell, Column, Kind, Table, TableRow};
use super::grouping::{Group, last_segment};
use super::published::{Claim, PublishedRow, PublishedTable, Share};
use crate::format::number;
use crate::measurement::temporal::{AFTER, Temporal, WARM_UP, WINDOW};
use crate::measurement::{Measurement, plain};

/// A column and how to fill it from a row.
type Filled<'a> = (Column, Box<dyn Fn(&Measurement) -> Cell + 'a>, Option<Best>);

/// Time, memory and every error of each row.
pub fn results(group: &Group) -> Table {
    let mut columns = configuration_columns(group);
    let time = |name: &str, meaning: &str, value: fn(&Measurement) -> Option<f64>| -> Filled {
        (Column::numeric(name, "ms", meaning), Box::new(move |row| Cell::number(value(row), 3)), Some(Best::Lowest))
    };
    columns.extend([
        time(
            "time",
            "median over the frames of every pass beyond G-buffer and direct light, with everything changed",
            |row| Some(row.time_ms_median),
        ),
        time("min", "the fastest frame", |row| Some(row.time_ms_min)),
        time("p95", "95th percentile over the frames", |row| Some(row.time_ms_p95)),
        time("static", "as time, where only the frame number has changed", |row| row.time_ms_static),
        time("frame", "median over the frames of the whole frame, with everything changed", |row| {
            Some(row.frame_ms_median)
        }),
        time("static frame", "as frame, where only the frame number has changed", |row| row.frame_ms_static),
    ]);
    let mib = |name, meaning, bytes: fn(&Measurement) -> u64| -> Filled {
        let cell = move |row: &Measurement| Cell::number(Some(bytes(row) as f64 / f64::from(1 << 20)), 3);
        (Column::numeric(name, "MiB", meaning), Box::new(cell), Some(Best::Lowest))
    };
    columns.extend([
        mib("memory", "textures and buffers that the technique writes", |row| row.memory_bytes),
        mib("frame memory", "all textures and buffers of the frame", |row| row.frame_bytes),
    ]);
    for metric in Metric::ranked() {
        let cell = move |row: &Measurement| Cell::number(row.errors.get(metric.id), metric.digits);
        columns.push((Column::numeric(metric.title, metric.unit, metric.meaning), Box::new(cell), Some(metric.best)));
    }
    let caption = "Times are medians over the frames; errors are against the path-traced reference, sky left out. Bold: best of the column.";
    fill("Every configuration", caption, columns, group)
}

/// Median time of each pass of each row; None when no row has passes.
pub fn passes(group: &Group) -> Option<Table> {
    let names = pass_names(group);
    if names.is_empty() {
        return None;
    }
    let mut columns = configuration_columns(group);
    for name in names {
        let head = Column::numeric(name.replace('_', " "), "ms", "");
        columns.push((head, Box::new(move |row: &Measurement| Cell::number(row.pass(&name), 3)), None));
    }
    Some(fill("Where the time goes", "Each pass, median over the frames.", columns, group))
}

/// Metrics over time; None where no grid asked for them.
pub fn temporal(group: &Group) -> Option<Table> {
    if group.rows.iter().all(|(_, row)| row.temporal.is_empty()) {
        return None;
    }
    let metric = |name: &str, unit: &str, meaning: &str, value: fn(&Temporal) -> Option<f64>| -> Filled {
        (
            Column::numeric(name, unit, meaning),
            Box::new(move |row| Cell::number(value(&row.temporal), 3)),
            Some(Best::Lowest),
        )
    };
    let mut columns = configuration_columns(group);
    columns.extend([
        metric(
            "still deviation",
            "radiance",
            "standard deviation at a pixel over frames, camera and scene static",
            |t| t.still_std,
        ),
        metric(
            "ghost half-life",
            "frames",
            "until half of the old light is gone after everything animated jumped",
            |t| t.ghost_half_life,
        ),
        metric(
            "recovery",
            "frames",
            "until surfaces that the jump uncovered are within a quarter of their final error",
            |t| t.recover,
        ),
        metric(
            "error on the path",
            "radiance",
            "RMS from the average of unfiltered frames, along the scene's moves",
            |t| t.path_rmse,
        ),
    ]);
    let caption = format!(
        "Linear albedo · indirect. Deviation over {WINDOW} frames of the static scene after {WARM_UP}; then the animated \
         parts jump to their last pose, measured for {AFTER} frames; then camera and scene follow the animation of the \
         scene file. A filter with weight a alone would give a half-life of ln 2 / -ln a frames."
    );
    Some(fill("Over time", &caption, columns, group))
}

/// Passes of all rows, in frame order: a pass that only some rows have comes after its predecessor in those rows.
pub fn pass_names(group: &Group) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for (_, row) in &group.rows {
        let mut next = 0;
        for name in row.pass_ms.keys() {
            next = 1 + names.iter().position(|known| known == name).unwrap_or_else(|| {
                names.insert(next, name.clone());
                next
            });
        }
    }
    names
}

/// Published against measured: the paper's claims, then each of its steps; empty without a published table for the
/// preset or without a row that it has. A table of several resolutions stands behind the last of the groups that it takes
/// rows from.
pub fn published(group: &Group, all: &[Group]) -> Vec<Table> {
    let Some(table) = PublishedTable::of(&group.first().preset) else { return vec![] };
    let same = |other: &&Group| {
        let key = |row: &Measurement| (row.scene.clone(), row.camera.clone(), row.adapter.clone(), row.backend.clone());
        key(other.first()) == key(group.first()) && other.first().preset == group.first().preset
    };
    let rows: Vec<(usize, &Measurement)> = match table.divisor {
        Some(_) => {
            let last = all.iter().rfind(same).is_some_and(|last| std::ptr::eq(last.first(), group.first()));
            if !last {
                return vec![];
            }
            all.iter().filter(same).flat_map(|group| group.rows.iter().copied()).collect()
        }
        None => group.rows.clone(),
    };
    let held = Held::new(table, &rows);
    if held.own.iter().all(Option::is_none) {
        return vec![];
    }
    let steps = table.steps.iter().map(|(step, _)| *step).chain(["total"]);
    [held.claims()].into_iter().chain(steps.map(|step| held.step(step))).collect()
}

/// A published table beside the rows of a group.
struct Held<'a> {
    table: &'static PublishedTable,
    published: Vec<PublishedRow>,
    /// The paper's GPUs, in its order.
    gpus: Vec<String>,
    /// Index in `published` of the first row of each distinct configuration.
    configurations: Vec<usize>,
    /// The measured row of each configuration.
    own: Vec<Option<(usize, &'a Measurement)>>,
}

impl<'a> Held<'a> {
    fn new(table: &'static PublishedTable, rows: &[(usize, &'a Measurement)]) -> Self {
        let published = table.rows();
        let (mut gpus, mut configurations) = (Vec::new(), Vec::<usize>::new());
        for (index, row) in published.iter().enumerate() {
            if !gpus.contains(&row.gpu) {
                gpus.push(row.gpu.clone());
            }
            if !configurations.iter().any(|&known| published[known].configuration() == row.configuration()) {
                configurations.push(index);
            }
        }
        let find = |&index: &usize| rows.iter().find(|(_, row)| published[index].matches(row, table.divisor)).copied();
        let own = configurations.iter().map(find).collect();
        Self { table, published, gpus, configurations, own }
    }

    /// Published time of a configuration's step on a GPU, ms.
    fn paper(&self, configuration: usize, gpu: &str, step: &str) -> Option<f64> {
        let wanted = self.published[self.configurations[configuration]].configuration();
        let row = self.published.iter().find(|row| row.gpu == gpu && row.configuration() == wanted)?;
        row.step(step)
    }

    /// Measured time of a configuration's step, ms.
    fn measured(&self, configuration: usize, step: &str) -> Option<f64> {
        self.table.measured(self.own[configuration]?.1, step)
    }

    fn claims(&self) -> Table {
        let ratio = |of: Option<f64>, over: Option<f64>| Cell::number(of.zip(over).map(|(of, over)| of / over), 4);
        let mut rows: Vec<TableRow> = Vec::new();
        for Claim { name, step, of, over, over_step } in self.table.claims {
            let mut cells = vec![Cell::text(*name), Cell::text(*step)];
            cells.extend(
                self.gpus.iter().map(|gpu| ratio(self.paper(*of, gpu, step), self.paper(*over, gpu, over_step))),
            );
            let measured = self.measured(*of, step).zip(self.measured(*over, over_step)).map(|(of, over)| of / over);
            cells.push(Cell::number(measured, 4));
            let published: Vec<f64> = self
                .gpus
                .iter()
                .filter_map(|gpu| Some(self.paper(*of, gpu, step)? / self.paper(*over, gpu, over_step)?))
                .collect();
            let is_busy = [*of, *over].iter().filter_map(|index| self.own[*index]).any(|(_, row)| was_busy(row));
            cells.push(Cell::text(verdict(&published, measured, is_busy)));
            rows.push(TableRow { row: None, cells });
        }
        if let Some(Share { name, step, pass, of, published }) = self.table.share {
            let own = self.own[of].and_then(|(_, row)| row.pass(pass)).zip(self.measured(of, step));
            let mut cells = vec![Cell::text(name), Cell::text(step), Cell::text(published)];
            cells.resize_with(2 + self.gpus.len(), Cell::default);
            let share = own.map(|(pass, step)| pass / step);
            let text = share.map_or(String::new(), |share| format!("{} %", number(100.0 * share, 3)));
            cells.push(Cell { text, value: share, best: false });
            cells.push(Cell::default());
            rows.push(TableRow { row: None, cells });
        }

        let mut columns = vec![Column::text("claim"), Column::text("step")];
        columns.extend(self.gpus.iter().map(|gpu| {
            Column::numeric(gpu.as_str(), "published ratio", "time of the first configuration over that of the second")
        }));
        columns.push(Column::numeric("measured", "ratio", ""));
        columns.push(Column::text("here"));
        let caption = format!(
            "{}. {} Times of different machines compare by ratio only. Confirmed: the measured ratio is within a fourth of \
             those published. Contradicted: it is not. Cannot be told: a frame at the 95th percentile took over {BUSY} \
             times the median, so the machine was busy.",
            self.table.source, self.table.remarks
        );
        Table { title: "Published and measured: what the paper concludes".into(), caption, columns, rows }
    }

    fn step(&self, step: &str) -> Table {
        let ratio = |time: Option<f64>, base: Option<f64>| time.zip(base).map(|(time, base)| time / base);
        let all = || 0..self.configurations.len();
        let row = |configuration: usize| {
            let PublishedRow { resolution, parameters, .. } = &self.published[self.configurations[configuration]];
            let size = resolution.map(|[w, h]| format!("{w}×{h}"));
            let words = parameters.iter().map(|(name, value)| match value.parse::<f64>() {
                Ok(_) => format!("{} {value}", last_segment(name)),
                Err(_) => value.clone(),
            });
            let published = |gpu: &String| self.paper(configuration, gpu, step);
            let measured = self.measured(configuration, step);
            let mut cells = vec![Cell::text(size.into_iter().chain(words).collect::<Vec<_>>().join(" · "))];
            cells.extend(self.gpus.iter().map(|gpu| Cell::number(published(gpu), 3)));
            cells.push(Cell::number(measured, 3));
            cells.extend(self.gpus.iter().map(|gpu| {
                let base = all().find_map(|configuration| self.paper(configuration, gpu, step));
                Cell::number(ratio(published(gpu), base), 3)
            }));
            // The same base as the paper's, though an earlier row may have such a step here.
            let base =
                all().find(|&configuration| self.gpus.iter().any(|gpu| self.paper(configuration, gpu, step).is_some()));
            cells.push(Cell::number(ratio(measured, base.and_then(|base| self.measured(base, step))), 3));
            TableRow { row: self.own[configuration].map(|(index, _)| index), cells }
        };
        let mut columns = vec![Column::text("configuration")];
        columns.extend(self.gpus.iter().map(|gpu| Column::numeric(gpu.as_str(), "ms", "published")));
        columns.push(Column::numeric("measured", "ms", "here"));
        let over_first = "time over that of the first row that has the step";
        columns.extend(self.gpus.iter().map(|gpu| Column::numeric(gpu.as_str(), "× first row", over_first)));
        columns.push(Column::numeric("measured", "× first row", over_first));
        Table {
            title: format!("Published and measured: {step}"),
            caption: String::new(),
            columns,
            rows: (0..self.configurations.len()).map(row).collect(),
        }
    }
}

/// How far a measured ratio may be from the published ones, and still confirm them.
const NEAR: f64 = 1.25;
/// 95th percentile of a row's time over its median above which ratios say nothing.
const BUSY: f64 = 1.5;

fn was_busy(row: &Measurement) -> bool {
    row.time_ms_p95 > BUSY * row.time_ms_median
}

/// Whether a measured ratio of times agrees with the published ones; empty where nothing was measured.
fn verdict(published: &[f64], measured: Option<f64>, is_busy: bool) -> &'static str {
    let low = published.iter().copied().fold(f64::INFINITY, f64::min);
    let high = published.iter().copied().fold(0.0, f64::max);
    match measured {
        Some(ratio) if ratio.is_finite() && !published.is_empty() => {
            if is_busy {
                "cannot be told"
            } else if (low / NEAR..=high * NEAR).contains(&ratio) {
                "confirmed"
            } else {
                "contradicted"
            }
        }
        _ => "",
    }
}

/// The command that reproduces each row; None when no row has one.
pub fn commands(group: &Group) -> Option<Table> {
    let columns: Vec<Filled> = vec![
        (Column::text("configuration"), Box::new(|row| Cell::text(group.label(row))), None),
        (Column { kind: Kind::Code, ..Column::text("command") }, Box::new(|row| Cell::text(&row.command)), None),
    ];
    let any = group.rows.iter().any(|(_, row)| !row.command.is_empty());
    any.then(|| fill("Commands", "Each reproduces its row.", columns, group))
}

/// Row number, technique where several mix, varying parameters.
fn configuration_columns<'a>(group: &'a Group) -> Vec<Filled<'a>> {
    let mut columns: Vec<Filled> = Vec::new();
    if group.mixed_techniques || group.has_baseline() {
        columns.push((Column::text("technique"), Box::new(|row| Cell::text(&row.technique)), None));
    }
    for name in &group.varying {
        let numeric =
            group.rows.iter().all(|(_, row)| row.parameters.get(name).is_none_or(serde_json::Value::is_number));
        let cell = move |row: &Measurement| {
            let value = row.parameters.get(name);
            Cell {
                text: value.map_or(String::new(), plain),
                value: value.and_then(|value| value.as_f64()),
                best: false,
            }
        };
        let kind = if numeric { Kind::Number } else { Kind::Text };
        let head = Column { kind, ..Column::text(group.short_name(name).replace('_', " ")) };
        columns.push((head, Box::new(cell), None));
    }
    let frame = |row: &Measurement| row.at_frame.map_or(Cell::default(), Cell::count);
    let head = Column::numeric("frame", "", "the frame that is measured, counted from 1; empty where all are alike");
    columns.push((head, Box::new(frame), None));
    columns
}

/// Fills the columns with the group's rows, drops columns without a single value, and marks the best.
fn fill(title: &str, caption: &str, columns: Vec<Filled>, group: &Group) -> Table {
    let mut heads = vec![Column::numeric("#", "", "row of results.csv")];
    let mut rows: Vec<TableRow> =
        group.rows.iter().map(|&(index, _)| TableRow { row: Some(index), cells: vec![Cell::row(index)] }).collect();
    for (head, cell, best) in columns {
        let mut cells: Vec<Cell> = group.rows.iter().map(|(_, row)| cell(row)).collect();
        if cells.iter().all(|cell| cell.text.is_empty()) {
            continue;
        }
        if let Some(best) = best {
            mark_best(&mut cells, best);
        }
        heads.push(head);
        rows.iter_mut().zip(cells).for_each(|(row, cell)| row.cells.push(cell));
    }
    Table { title: title.into(), caption: caption.into(), columns: heads, rows }
}

/// Marks every cell that prints as the best one does; none when all print alike.
fn mark_best(cells: &mut [Cell], best: Best) {
    let key = |cell: &Cell| cell.value.filter(|value| !value.is_nan()).map(|value| best.key(value));
    let Some(winner) = cells
        .iter()
        .filter(|cell| key(cell).is_some())
        .min_by(|a, b| key(a).unwrap_or(f64::INFINITY).total_cmp(&key(b).unwrap_or(f64::INFINITY)))
    else {
        return;
    };
    let text = winner.text.clone();
    if cells.iter().any(|cell| cell.text != text) {
        cells.iter_mut().for_each(|cell| cell.best = cell.text == text);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_is_judged_by_the_published_ratios() {
        let published = [2.0, 3.0];
        let judged = |ratio| verdict(&published, Some(ratio), false);
        assert_eq!([1.59, 1.61, 3.74, 3.76].map(judged), ["contradicted", "confirmed", "confirmed", "contradicted"]);
        assert_eq!(verdict(&published, Some(2.5), true), "cannot be told");
        assert_eq!(verdict(&published, None, false), "");
        assert_eq!(verdict(&published, Some(f64::INFINITY), false), "");
        assert_eq!(verdict(&[], Some(2.0), false), "");
    }
}
