//! The report folder: index.html (opens from disk), results.csv, results.json, tables.md, plots/*.svg; the pictures in
//! images/ are written cell by cell through [`Pictures`].

use std::collections::BTreeSet;
use std::io::Write as _;
use std::path::Path;

use halflight_metrics::{METRICS, MetricId};
use halflight_native::files::write_whole;
use halflight_output::OutputFolder;

use crate::Error;
use crate::format::count;
use crate::measurement::{self, Measurement};

mod answer;
pub mod document;
mod grouping;
mod page;
mod pareto;
mod pictures;
mod plots;
mod published;
mod slice;
mod strip;
mod tables;
mod trade;

pub use pareto::frontier;
pub use pictures::{FULL_SCALE, Pictures};
pub use published::{PublishedTable, TABLES as PUBLISHED_TABLES};

use document::{markdown, table::Table};
use grouping::{Group, groups, subjects};

/// Everything that a report folder says.
#[derive(Clone, Debug, Default)]
pub struct Report {
    /// Heading.
    pub title: String,
    /// One or two sentences on what was asked.
    pub summary: String,
    /// Command that reproduces the whole run.
    pub command: String,
    /// Commands that trace what the rows are measured against.
    pub references: Vec<String>,
    /// What did not go as it should: replaced textures, clamped values, a noisy reference.
    pub warnings: Vec<String>,
    /// One row a cell.
    pub measurements: Vec<Measurement>,
}

impl Report {
    /// Files of every report; plots and pictures are added to them.
    pub const FILES: [&str; 4] = ["results.json", "results.csv", "tables.md", "index.html"];

    /// Writes the folder. Files of an earlier report are replaced; pictures are not touched. May be called after every
    /// cell of a long run.
    ///
    /// # Errors
    /// If a file cannot be written, or if the folder holds a file of that name that is not a report's.
    pub fn write(&self, folder: &OutputFolder) -> Result<(), Error> {
        measurement::write_json(&folder.claim("results.json")?, &self.measurements)?;
        measurement::write_csv(&folder.claim("results.csv")?, &self.measurements)?;
        let groups = groups(&self.measurements);
        let mut parts = Vec::new();
        let mut answers: Vec<(Vec<usize>, answer::Answer)> =
            subjects(&self.measurements).iter().filter_map(|all| Some((all.indices(), answer::answer(all)?))).collect();
        for (index, group) in groups.iter().enumerate() {
            // The first part of a subject has the answer of all.
            let own = group.indices();
            let answer = answers.iter().position(|(rows, _)| own.iter().any(|row| rows.contains(row)));
            let answer = answer.map(|position| answers.remove(position).1);
            parts.push(Part::new(index, group, &groups, answer, folder.path())?);
        }
        for plot in parts.iter().flat_map(Part::plots) {
            write_text(&folder.claim(&format!("plots/{}.svg", plot.file))?, &plot.drawing.file())?;
        }
        write_text(&folder.claim("tables.md")?, &self.markdown(&parts))?;
        write_text(&folder.claim("index.html")?, &page::report_page(self, &parts))
    }

    fn markdown(&self, parts: &[Part]) -> String {
        let mut text = format!("# {}\n\n{}\n\n", self.title, self.summary);
        for (name, value) in self.facts() {
            text += &format!("- {name}: {value}\n");
        }
        for warning in self.all_warnings() {
            text += &format!("- Warning: {warning}\n");
        }
        text += "\n";
        for part in parts {
            text += &format!("## {}\n\n{}\n\n", part.group.title(), part.settings());
            if let Some(remark) = &part.remark {
                text += &format!("{remark}\n\n");
            }
            part.tables().for_each(|table| text += &markdown::table(table, 3));
        }
        text
    }

    /// What holds for the whole report: name and value.
    fn facts(&self) -> Vec<(&'static str, String)> {
        let values = |of: &dyn Fn(&Measurement) -> String| -> BTreeSet<String> {
            self.measurements.iter().map(of).filter(|value| !value.is_empty()).collect()
        };
        let joined = |values: BTreeSet<String>| values.into_iter().collect::<Vec<_>>().join(", ");
        let distinct = |of: &dyn Fn(&Measurement) -> String| joined(values(of));
        let adapter = |row: &Measurement| {
            let kind = if row.software_adapter { " (software)" } else { "" };
            if row.adapter.is_empty() { String::new() } else { format!("{}{kind}", row.adapter) }
        };
        let machine = |row: &Measurement| match row.processor.as_str() {
            "" => row.machine.clone(),
            processor => format!("{} ({processor})", row.machine),
        };
        // A cluster has many.
        let machines = match values(&machine) {
            many if many.len() > MOST_MACHINES => format!("{} computers: column machine of results.csv", many.len()),
            few => joined(few),
        };
        let facts = vec![
            ("Adapter", distinct(&adapter)),
            ("Driver", distinct(&|row| row.driver.clone())),
            ("Backend", distinct(&|row| row.backend.clone())),
            ("Computer", machines),
            ("Commit", distinct(&|row| row.commit.clone())),
            ("Seed", distinct(&|row| row.seed.to_string())),
            ("Configurations", self.measurements.len().to_string()),
            ("Timed frames each", self.frames()),
            ("Command", self.command.clone()),
        ];
        let references = self.references.iter().map(|command| ("Reference", command.clone()));
        facts.into_iter().chain(references).filter(|(_, value)| !value.is_empty()).collect()
    }

    fn frames(&self) -> String {
        let frames = || self.measurements.iter().map(|row| row.frames);
        match (frames().min(), frames().max()) {
            (Some(least), Some(most)) if least < most => format!("{least} to {most}"),
            (Some(all), _) => all.to_string(),
            _ => String::new(),
        }
    }

    /// The run's warnings and those that the numbers themselves give.
    fn all_warnings(&self) -> Vec<String> {
        let rows = |test: &dyn Fn(&Measurement) -> bool| {
            let all = self.measurements.iter().enumerate().filter(|(_, row)| test(row)).map(|(index, _)| index + 1);
            all.collect::<Vec<_>>()
        };
        let is_nan =
            |row: &Measurement| METRICS.iter().any(|metric| row.errors.get(metric.id).is_some_and(f64::is_nan));
        let found = [
            (
                rows(&|row| row.software_adapter),
                "times come from a software adapter (a processor that plays a GPU): compare them by ratio, and only \
                 within this machine",
            ),
            (rows(&|row| row.frames < 10), "fewer than 10 frames were timed: medians are rough"),
            (
                rows(&|row| row.time_ms_p95 > 1.5 * row.time_ms_median),
                "p95 is over 1.5 times the median: the machine was busy",
            ),
            (rows(&is_nan), "a metric is NaN: the image holds a value that is not a number"),
            (
                rows(&|row| row.errors.get(MetricId::TruthRelError).is_some_and(|error| error > 0.05)),
                "the reference's own standard error is over 5 %: small differences between rows mean nothing",
            ),
        ];
        let found = found.into_iter().filter(|(rows, _)| !rows.is_empty()).map(|(rows, sentence)| {
            let named = |rows: &[usize]| rows.iter().map(|row| format!("#{row}")).collect::<Vec<_>>().join(", ");
            let rows = match rows.len() {
                all if all == self.measurements.len() => "All rows".into(),
                many if many > MOST_NAMED => {
                    format!("{} and {} more", named(&rows[..MOST_NAMED]), count((many - MOST_NAMED) as u64))
                }
                _ => named(&rows),
            };
            format!("{rows}: {sentence}.")
        });
        self.warnings.iter().cloned().chain(found).collect()
    }
}

/// Most computers that the head of a report names.
const MOST_MACHINES: usize = 4;
/// Most rows that a warning names.
const MOST_NAMED: usize = 24;

/// A group with its tables and plots.
struct Part<'a> {
    group: &'a Group<'a>,
    /// Rows that are shown with picture, passes and command.
    shown: Vec<(usize, &'a Measurement)>,
    /// The best of all rows of the scene, in its first part.
    answer: Option<answer::Answer>,
    trades: Vec<trade::Trade>,
    remark: Option<String>,
    slice: Option<slice::Slice>,
    results: Table,
    temporal: Option<Table>,
    passes: Option<Table>,
    published: Vec<Table>,
    commands: Option<Table>,
    error_over_samples: Vec<plots::Named>,
    cost_per_pass: Option<plots::Named>,
}

impl<'a> Part<'a> {
    fn new(
        index: usize,
        group: &'a Group<'a>,
        all: &[Group],
        answer: Option<answer::Answer>,
        folder: &Path,
    ) -> Result<Self, Error> {
        let positions = plots::shown_in_full(group);
        let shown = group.subset(&positions);
        let mut part = Self {
            group,
            answer,
            trades: trade::trades(group, &positions.iter().copied().collect()),
            remark: trade::remark_on_rel_mse(group),
            slice: slice::slice(group, folder)?,
            results: tables::results(group),
            temporal: tables::temporal(group),
            passes: tables::passes(&shown),
            published: tables::published(group, all),
            commands: tables::commands(&shown),
            error_over_samples: plots::error_over_samples(group),
            cost_per_pass: plots::cost_per_pass(&shown),
            shown: shown.rows,
        };
        if part.is_partial() {
            let of = format!(
                " Of {} rows, the {} on a frontier; results.csv has all.",
                count(group.rows.len() as u64),
                part.shown.len()
            );
            part.passes.iter_mut().chain(&mut part.commands).for_each(|table| table.caption += &of);
        }
        // Names are the same in every report; a second scene gets a number.
        if index > 0 {
            part.plots_mut().for_each(|plot| plot.file = format!("{}-{}", plot.file, index + 1));
        }
        Ok(part)
    }

    /// Whether there are more rows than are shown in full.
    fn is_partial(&self) -> bool {
        self.shown.len() < self.group.rows.len()
    }

    fn plots(&self) -> impl Iterator<Item = &plots::Named> {
        let answer = self.answer.iter().map(|answer| &answer.plot);
        let slice = self.slice.iter().map(|slice| &slice.plot);
        let trades = self.trades.iter().map(|trade| &trade.plot);
        answer.chain(slice).chain(trades).chain(&self.error_over_samples).chain(&self.cost_per_pass)
    }

    fn plots_mut(&mut self) -> impl Iterator<Item = &mut plots::Named> {
        let answer = self.answer.iter_mut().map(|answer| &mut answer.plot);
        let slice = self.slice.iter_mut().map(|slice| &mut slice.plot);
        let trades = self.trades.iter_mut().map(|trade| &mut trade.plot);
        answer.chain(slice).chain(trades).chain(&mut self.error_over_samples).chain(&mut self.cost_per_pass)
    }

    /// Those of tables.md: the frontier by what a viewer sees and by what the light's own error is.
    fn tables(&self) -> impl Iterator<Item = &Table> {
        let Self { answer, slice, trades, results, temporal, passes, published, commands, .. } = self;
        let answer = answer.iter().map(|answer| &answer.table);
        let headline = |trade: &&trade::Trade| trade.metric.headline;
        let slice = slice.iter().map(|slice| &slice.table);
        let trades = trades.iter().filter(headline).map(|trade| &trade.table);
        answer
            .chain(slice)
            .chain(trades)
            .chain([results])
            .chain(temporal)
            .chain(passes)
            .chain(published)
            .chain(commands)
    }

    /// What all rows of the group share, in a line.
    fn settings(&self) -> String {
        let row = self.group.first();
        let technique = (!self.group.mixed_techniques).then(|| row.technique.clone());
        let fixed = self.group.fixed.iter().map(|(name, value)| format!("{} = {value}", self.group.short_name(name)));
        technique.into_iter().chain(fixed).collect::<Vec<_>>().join(", ")
    }
}

fn write_text(path: &Path, text: &str) -> Result<(), Error> {
    write_whole(path, |file| file.write_all(text.as_bytes())).map_err(|error| Error::unwritable(path, error))
}

#[cfg(test)]
mod tests;
