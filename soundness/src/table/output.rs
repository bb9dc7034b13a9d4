//! The table of a run: for a terminal, as Markdown, as CSV and as a page.

use std::{io::Write as _, path::Path};

use halflight_evaluator::{
    Error,
    format::number,
    report::document::{
        chart::{Bars, Drawing, Segment},
        markdown, simple_page,
        table::{Cell, Column, Table as Printed, TableRow},
    },
};
use halflight_native::files::write_whole;
use halflight_output::OutputFolder;

use super::Table;
use crate::check::Check;

/// All checks of one row, technique and metric.
struct Line<'a> {
    checks: Vec<&'a Check>,
}

impl<'a> Line<'a> {
    fn all(table: &'a Table) -> Vec<Self> {
        let mut lines: Vec<Self> = Vec::new();
        for check in &table.checks {
            let same = |line: &&mut Self| {
                let first = line.checks[0];
                (first.group, &first.row, &first.technique, first.metric, first.bound.is_some())
                    == (check.group, &check.row, &check.technique, check.metric, check.bound.is_some())
            };
            match lines.iter_mut().rev().take(200).find(same) {
                Some(line) => line.checks.push(check),
                None => lines.push(Self { checks: vec![check] }),
            }
        }
        lines
    }

    /// The check with the largest value relative to its bound.
    fn worst(&self) -> &'a Check {
        let key = |check: &Check| match check.bound {
            _ if check.worst.is_nan() => f64::INFINITY,
            Some(bound) if bound > 0.0 => check.worst / bound,
            _ => check.worst,
        };
        let worst = self.checks.iter().copied().max_by(|a, b| key(a).total_cmp(&key(b)));
        worst.unwrap_or(self.checks[0])
    }

    fn result(&self) -> String {
        let red = self.checks.iter().filter(|check| check.is_red()).count();
        let open = self.checks.iter().filter(|check| check.is_red() && check.explanation().is_none()).count();
        match (self.worst().bound, red, open) {
            (None, ..) => "reported".into(),
            (Some(_), 0, _) => "holds".into(),
            (Some(_), red, 0) => format!("RED in {red}, explained"),
            (Some(_), red, _) => format!("RED in {red}"),
        }
    }
}

impl std::fmt::Display for Table {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for line in Line::all(self) {
            let worst = line.worst();
            let bound = worst.bound.map_or(String::new(), |bound| format!(" (bound {})", number(bound, 3)));
            writeln!(
                f,
                "{:<9} {:<13} {} | {}: {} {}{bound}",
                line.result(),
                worst.technique,
                worst.row,
                line.checks.len(),
                worst.metric,
                number(worst.worst, 3),
            )?;
        }
        for check in self.checks.iter().filter(|check| check.is_red()) {
            let Check { group, row, technique, settings, metric, worst, detail, .. } = check;
            let bound = check.bound.unwrap_or(f64::NAN);
            writeln!(
                f,
                "\nRED {group}: {row}\n    {technique} {settings}\n    {metric}: {worst} over {bound}; {detail}"
            )?;
            writeln!(f, "    {}", check.explanation().unwrap_or("not explained"))?;
        }
        writeln!(f, "\n{}", self.summary())
    }
}

impl Table {
    /// Number of checks by result.
    pub fn summary(&self) -> String {
        let red = self.checks.iter().filter(|check| check.is_red()).count();
        let reported = self.checks.iter().filter(|check| check.bound.is_none()).count();
        let open = self.unexplained().count();
        format!(
            "{} checks: {} hold, {reported} are reported without a bound, {red} are red, of which {open} are not explained",
            self.checks.len(),
            self.checks.len() - reported - red
        )
    }

    /// Writes digest.md (a line per row), stability.md (a line per row and technique), stability.csv (every check) and
    /// index.html.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &Path, facts: &[(&'static str, String)]) -> Result<(), Error> {
        let folder = OutputFolder::open(folder);
        let text = |name: &str, text: &[u8]| {
            let path = folder.claim(name)?;
            write_whole(&path, |file| file.write_all(text)).map_err(|e: std::io::Error| Error::unwritable(&path, e))
        };
        text("digest.md", self.digest().as_bytes())?;
        text("stability.md", self.markdown(facts).as_bytes())?;
        text("stability.csv", &self.csv()?)?;
        let chart = self.chart();
        let page = simple_page::SimplePage {
            title: "Sound at the extremes",
            summary: &format!("{}.", self.summary()),
            facts,
            chart: &chart,
            tables: &self.tables(),
            pictures_note: "No images: rows are numbers.",
            pictures: &[],
        };
        text("index.html", page.html().as_bytes())
    }

    /// The tables below a list of facts.
    pub fn markdown(&self, facts: &[(&'static str, String)]) -> String {
        let mut text = format!("# Sound at the extremes\n\n{}.\n\n", self.summary());
        facts.iter().for_each(|(name, value)| text += &format!("- {name}: {value}\n"));
        text.push('\n');
        self.tables().iter().for_each(|table| text += &markdown::table(table, 2));
        text
    }

    /// A line per row and bounded metric, over all techniques and settings.
    pub fn digest(&self) -> String {
        let mut rows: Vec<Vec<&Check>> = Vec::new();
        for check in self.checks.iter().filter(|check| check.bound.is_some()) {
            let same = |row: &&mut Vec<&Check>| {
                (row[0].group, &row[0].row, row[0].metric) == (check.group, &check.row, check.metric)
            };
            match rows.iter_mut().find(same) {
                Some(row) => row.push(check),
                None => rows.push(vec![check]),
            }
        }
        let line = |checks: Vec<&Check>| {
            let line = Line { checks };
            let worst = line.worst();
            TableRow {
                row: None,
                cells: vec![
                    Cell::text(worst.group),
                    Cell::text(worst.row.clone()),
                    Cell::text(line.result()),
                    count(line.checks.len()),
                    Cell::text(worst.metric),
                    Cell::number(Some(worst.worst), 3),
                    Cell::number(worst.bound, 3),
                ],
            }
        };
        let table = Printed {
            title: "Every row".into(),
            caption: "Over all techniques and settings.".into(),
            columns: vec![
                Column::text("group"),
                Column::text("row"),
                Column::text("result"),
                Column::numeric("checks", "", ""),
                Column::text("metric"),
                Column::numeric("worst", "", ""),
                Column::numeric("bound", "", ""),
            ],
            rows: rows.into_iter().map(line).collect(),
        };
        markdown::table(&table, 2)
    }

    fn csv(&self) -> Result<Vec<u8>, Error> {
        let failed = |e: &dyn std::fmt::Display| Error::Failed(format!("the table could not be written: {e}"));
        let mut writer = csv::Writer::from_writer(Vec::new());
        writer
            .write_record([
                "group",
                "row",
                "technique",
                "settings",
                "result",
                "measure",
                "worst",
                "bound",
                "reason",
                "detail",
                "clamped",
                "largest",
                "percentile_99_9",
                "explanation",
            ])
            .map_err(|e| failed(&e))?;
        for check in &self.checks {
            let result = match check.bound {
                None => "reported",
                Some(_) if check.is_red() => "red",
                Some(_) => "holds",
            };
            writer
                .write_record([
                    check.group,
                    &check.row,
                    &check.technique,
                    &check.settings,
                    result,
                    check.metric,
                    &check.worst.to_string(),
                    &check.bound.map_or(String::new(), |bound| bound.to_string()),
                    &check.reason,
                    &check.detail,
                    &check.clamped.to_string(),
                    &check.largest.to_string(),
                    &check.percentile.to_string(),
                    check.explanation().unwrap_or_default(),
                ])
                .map_err(|e| failed(&e))?;
        }
        writer.into_inner().map_err(|e| failed(&e))
    }

    fn tables(&self) -> Vec<Printed> {
        let mut tables = Vec::new();
        let red: Vec<&Check> = self.checks.iter().filter(|check| check.is_red()).collect();
        if !red.is_empty() {
            tables.push(red_table(&red));
        }
        let lines = Line::all(self);
        let mut groups: Vec<&str> = Vec::new();
        for line in &lines {
            if !groups.contains(&line.checks[0].group) {
                groups.push(line.checks[0].group);
            }
        }
        for group in groups {
            tables.push(group_table(group, lines.iter().filter(|line| line.checks[0].group == group)));
        }
        tables
    }

    /// One bar per group: checks that hold, that are reported and that are red.
    fn chart(&self) -> Drawing {
        let mut bars: Vec<(String, Vec<f64>)> = Vec::new();
        for check in &self.checks {
            let kind = if check.is_red() { 2 } else { usize::from(check.bound.is_none()) };
            match bars.iter_mut().find(|(group, _)| group == check.group) {
                Some((_, counts)) => counts[kind] += 1.0,
                None => {
                    let mut counts = vec![0.0; 3];
                    counts[kind] = 1.0;
                    bars.push((check.group.into(), counts));
                }
            }
        }
        let segment = |(index, name): (usize, &str)| Segment { name: name.into(), colour: index, shade: 0 };
        Bars {
            title: "Checks by group".into(),
            unit: "checks".into(),
            segments: ["holds", "reported", "red"].into_iter().enumerate().map(segment).collect(),
            bars,
        }
        .draw()
    }
}

fn group_table<'a>(group: &str, lines: impl Iterator<Item = &'a Line<'a>>) -> Printed {
    let row = |line: &Line| {
        let worst = line.worst();
        let settings = if worst.settings.is_empty() { "defaults" } else { &worst.settings };
        TableRow {
            row: None,
            cells: vec![
                Cell::text(worst.row.clone()),
                Cell::text(worst.technique.clone()),
                Cell::text(line.result()),
                count(line.checks.len()),
                Cell::text(worst.metric),
                Cell::number(Some(worst.worst), 3),
                Cell::number(worst.bound, 3),
                Cell::number(above_zero(line.checks.iter().map(|check| check.percentile)), 3),
                Cell::number(above_zero(line.checks.iter().map(|check| check.largest)), 3),
                Cell::text(worst.reason.clone()),
                Cell::text(settings),
                Cell::text(worst.detail.clone()),
            ],
        }
    };
    Printed {
        title: group.to_owned(),
        caption: String::new(),
        columns: vec![
            Column::text("row"),
            Column::text("technique"),
            Column::text("result"),
            Column::numeric("settings tried", "", "number of different settings that the row ran with"),
            Column::text("metric"),
            Column::numeric("worst", "", "over all settings"),
            Column::numeric("bound", "", "largest value that passes; empty where the value is reported"),
            Column::numeric("99.9th percentile", "", "of indirect light over pixels, radiance; over all settings"),
            Column::numeric("largest", "", "value of light, radiance; over all settings"),
            Column::text("reason"),
            Column::text("settings of the worst"),
            Column::text("detail"),
        ],
        rows: lines.map(row).collect(),
    }
}

/// The largest number; `None` if no check measured one.
fn above_zero(numbers: impl Iterator<Item = f64>) -> Option<f64> {
    Some(numbers.fold(0.0, f64::max)).filter(|&number| number > 0.0)
}

/// A whole number.
fn count(number: usize) -> Cell {
    Cell { text: number.to_string(), value: Some(number as f64), best: false }
}

fn red_table(red: &[&Check]) -> Printed {
    let row = |check: &&Check| TableRow {
        row: None,
        cells: vec![
            Cell::text(check.row.clone()),
            Cell::text(check.technique.clone()),
            Cell::text(check.settings.clone()),
            Cell::text(check.metric),
            Cell::number(Some(check.worst), 3),
            Cell::number(check.bound, 3),
            Cell::text(check.explanation().unwrap_or("not explained")),
        ],
    };
    Printed {
        title: "Red checks".into(),
        caption: "Each with its cause and fix.".into(),
        columns: vec![
            Column::text("row"),
            Column::text("technique"),
            Column::text("settings"),
            Column::text("metric"),
            Column::numeric("value", "", ""),
            Column::numeric("bound", "", ""),
            Column::text("cause and fix"),
        ],
        rows: red.iter().map(row).collect(),
    }
}
