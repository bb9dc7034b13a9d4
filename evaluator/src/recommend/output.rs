//! The answer as text, as JSON and as a folder.

use std::{fmt, io::Write};

use halflight_native::{
    files::write_whole,
    images::{Rgb, write_png},
};
use halflight_output::OutputFolder;
use halflight_recommend::{Answer, Goal, Interval, Point, Step};
use halflight_scenes::{Scene, bundled};
use halflight_techniques::{invocation::Invocation, link, preset::Preset};
use serde_json::{Value, json};

use super::{Found, Measuring, Options};
use crate::{
    Error,
    experiment::COMMIT,
    format::{number, percent},
    report::document::{
        chart,
        chart::{Axis, Line, MARKERS, Plot, Series, Spacing},
        simple_page::SimplePage,
        table::{Cell, Column, Table, TableRow},
    },
};

/// Files of every answer.
pub(super) const FILES: [&str; 6] =
    ["index.html", "recommend.json", "preset.toml", "plots/frontier.svg", "images/answer.png", "images/reference.png"];

/// Everything that is told about a search.
pub struct Report<'a> {
    /// What was asked.
    pub options: &'a Options,
    /// The scene.
    pub scene: &'a Scene,
    /// The scene as the command line names it.
    pub path: String,
    /// What was found.
    pub found: &'a Found,
    /// The command that repeats the search.
    pub command: Invocation,
    /// Name of the adapter.
    pub adapter: String,
    /// Whether times compare only by ratio.
    pub software: bool,
}

impl Report<'_> {
    /// The preset of the answer.
    fn preset(&self, answer: &Answer) -> Preset {
        Preset { technique: answer.point.technique, settings: answer.point.settings.clone() }
    }

    /// The command that renders the answer.
    pub fn render_command(&self, answer: &Answer) -> Invocation {
        let Point { technique, settings, .. } = &answer.point;
        Invocation::render(&self.path, technique.name, settings, self.options.size)
            .option_if("frame", self.found.frame.map(|frame| frame - 1))
            .option("out", "frame.exr")
    }

    /// The address of the answer in the viewer; `None` for a scene that is not bundled, which a link cannot name.
    pub fn link(&self, answer: &Answer) -> Option<String> {
        let hash = halflight_native::scene_hash::scene_hash;
        let same = |name: &&&str| bundled::scene(name).is_ok_and(|scene| hash(&scene) == hash(self.scene));
        let stem = std::path::Path::new(&self.path).file_stem()?.to_str()?;
        let name = bundled::NAMES.iter().filter(|name| **name == stem).find(same)?;
        let Point { technique, settings, .. } = &answer.point;
        let side = link::side("a", Some(technique.name), settings);
        Some(format!("http://127.0.0.1:8080/#{}{side}", link::scene(name, self.options.size)))
    }

    /// What the error of the answer is of.
    fn light(&self) -> String {
        let Measuring { bounces, moving, .. } = self.options.measuring;
        let light = if bounces == 1 { "light of one bounce".into() } else { format!("light of {bounces} bounces") };
        let view = if moving { "moving" } else { "static" };
        let frame = self.found.frame.map(|frame| {
            let before = frame as f32 / 60.0;
            format!(", frame {frame} of a {view} view ({before:.0} s at 60 frames a second)")
        });
        light + &frame.unwrap_or_default()
    }

    fn question(&self) -> String {
        let name = self.options.metric.title;
        match self.options.goal {
            Goal::Budget(budget) => format!("Lowest {name} within {} ms", number(budget, 3)),
            Goal::ErrorBound(bound) => format!("Shortest time with {name} of at most {}", number(bound, 3)),
        }
    }

    /// The answer as JSON. Without an answer, `sentence` says why.
    pub fn json(&self) -> Value {
        let [width, height] = self.options.size;
        let answer = self.found.answer.as_ref().ok();
        json!({
            "scene": self.scene.name,
            "width": width,
            "height": height,
            "budget_ms": match self.options.goal { Goal::Budget(ms) => Some(ms), Goal::ErrorBound(_) => None },
            "error_bound": match self.options.goal { Goal::ErrorBound(bound) => Some(bound), Goal::Budget(_) => None },
            "metric": self.options.metric.key,
            "moving": self.options.measuring.moving,
            "bounces": self.options.measuring.bounces,
            "frame": self.found.frame,
            "answer": answer,
            "achieved": self.found.achieved.map(|[time, error]| json!({ "time_ms": time, "error": error })),
            "sentence": self.found.answer.as_ref().err().map(ToString::to_string),
            "preset": answer.map(|answer| self.preset(answer).to_toml()),
            "link": answer.and_then(|answer| self.link(answer)),
            "render": answer.map(|answer| self.render_command(answer).to_string()),
            "command": self.command.to_string(),
            "seconds": self.found.seconds,
            "stopped_by_time": self.found.stopped,
            "adapter": self.adapter,
            "software_adapter": self.software,
            "commit": COMMIT,
        })
    }

    /// Writes the folder of an answer: the page, the JSON, the preset, the plot and two pictures.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &OutputFolder, pictures: Option<&([Vec<Rgb>; 2], f32)>) -> Result<(), Error> {
        let text = |name: &str, text: &str| {
            let path = folder.claim(name)?;
            write_whole(&path, |file| file.write_all(text.as_bytes()))
                .map_err(|error: std::io::Error| Error::unwritable(&path, error))
        };
        let json = serde_json::to_string_pretty(&self.json()).map_err(|e| Error::Failed(e.to_string()))?;
        text("recommend.json", &(json + "\n"))?;
        let Ok(answer) = &self.found.answer else { return Ok(()) };
        text("preset.toml", &self.preset(answer).to_toml())?;
        let plot = self.plot(answer).draw();
        text("plots/frontier.svg", &plot.file())?;
        let mut shown = Vec::new();
        if let Some((images, exposure)) = pictures {
            for (image, (title, name)) in
                images.iter().zip([("the answer", "answer"), ("path-traced reference", "reference")])
            {
                let path = format!("images/{name}.png");
                write_png(&folder.claim(&path)?, self.options.size[0], image, *exposure)?;
                shown.push((title.to_owned(), path));
            }
        }
        let facts = self.facts(answer);
        let page = SimplePage {
            title: &format!("{} on {}", self.question(), self.scene.name),
            summary: &format!("{}.", answer.point.label()),
            facts: &facts,
            chart: &plot,
            tables: &[self.table(answer)],
            pictures_note: "Final images, under one exposure.",
            pictures: &shown,
        };
        text("index.html", &page.html())
    }

    fn facts(&self, answer: &Answer) -> Vec<(&'static str, String)> {
        let [width, height] = self.options.size;
        let mut facts = vec![
            ("Command", self.command.to_string()),
            ("Render", self.render_command(answer).to_string()),
            ("Size", format!("{width}x{height}")),
            ("Time", format!("{} ms", interval(answer.point.time_ms))),
            (self.options.metric.title, interval(answer.point.error)),
            ("Error of", self.light()),
            ("Without indirect light", number(answer.baseline_error, 3)),
        ];
        facts.extend(
            self.found
                .achieved
                .map(|[time, error]| ("Measured again", format!("{} ms, {}", interval(time), interval(error)))),
        );
        facts.extend(answer.remains.clone().map(|remains| ("What remains", remains)));
        facts.extend(self.link(answer).map(|link| ("Viewer", link)));
        facts.extend([
            ("Searched", self.effort(answer)),
            ("Adapter", self.adapter.clone()),
            ("Commit", COMMIT.to_owned()),
        ]);
        facts
    }

    fn effort(&self, answer: &Answer) -> String {
        let stopped = if self.found.stopped { ", stopped by --minutes" } else { "" };
        format!(
            "{} cells of {} candidates in {} s{stopped}",
            answer.cells,
            number(answer.candidates, 3),
            number(self.found.seconds, 2)
        )
    }

    /// Everything that was measured, one colour for each technique, and the frontier.
    fn plot(&self, answer: &Answer) -> Plot {
        let name = self.options.metric.plot.as_ref().map_or(self.options.metric.title, |plot| plot.label);
        let place = |point: &Point| chart::Point {
            x: point.time_ms.value,
            y: point.error.value,
            label: format!(
                "{}\n{} ms\n{} {}{}",
                point.label(),
                number(point.time_ms.value, 3),
                self.options.metric.title,
                number(point.error.value, 3),
                if point.verified { "" } else { "\npredicted from the reduced size" }
            ),
            row: None,
        };
        let points = answer.frontier.iter().map(place).collect();
        let mut series =
            vec![Series { name: "frontier".into(), colour: None, marker: None, line: Some(Line::Stairs), points }];
        let mut names: Vec<&str> = answer.measured.iter().map(|point| point.technique.name).collect();
        names.sort_unstable();
        names.dedup();
        for (index, name) in names.into_iter().enumerate() {
            let own = answer.measured.iter().filter(|point| point.technique.name == name);
            series.push(Series {
                name: name.into(),
                colour: Some(index),
                marker: Some(MARKERS[index % MARKERS.len()]),
                line: None,
                points: own.map(place).collect(),
            });
        }
        let axis = |label: String| Axis { label, spacing: Spacing::Logarithmic, ticks: Vec::new() };
        Plot { title: "What was measured".into(), x: axis("time, ms".into()), y: axis(name.to_owned()), series }
    }

    fn table(&self, answer: &Answer) -> Table {
        let metric = self.options.metric;
        let row = |point: &Point| TableRow {
            row: None,
            cells: vec![
                Cell { best: point.label() == answer.point.label(), ..Cell::text(point.label()) },
                Cell::number(Some(point.time_ms.value), 3),
                Cell::number(Some(point.error.value), metric.digits),
                Cell::text(if point.verified { "measured" } else { "predicted" }),
            ],
        };
        Table {
            title: format!("The frontier, by {}", metric.title),
            caption:
                "The configurations that no other beats in both time and error, fastest first. Predicted: measured at \
                      reduced size only."
                    .into(),
            columns: vec![
                Column::text("configuration"),
                Column::numeric("time", "ms", "median of every pass of the technique, with everything changed"),
                Column::numeric(metric.title, metric.unit, metric.meaning),
                Column::text("at full size"),
            ],
            rows: answer.frontier.iter().map(row).collect(),
        }
    }
}

/// A number with its interval.
fn interval(interval: Interval) -> String {
    let Interval { value, low, high } = interval;
    format!("{} ({} to {})", number(value, 3), number(low, 3), number(high, 3))
}

/// What a terminal shows.
impl fmt::Display for Report<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [width, height] = self.options.size;
        let answer = match &self.found.answer {
            Ok(answer) => answer,
            Err(sentence) => return writeln!(f, "{sentence}"),
        };
        writeln!(f, "{} on {} at {width}x{height}:\n\n  {}\n", self.question(), self.scene.name, answer.point.label())?;
        let mut line = |name: &str, text: String| writeln!(f, "  {name:<12} {text}");
        let how = if answer.point.verified { "measured" } else { "predicted" };
        line(
            "time",
            format!("{} ms, {how}; all passes of the technique, everything changed", interval(answer.point.time_ms)),
        )?;
        let shown = interval(answer.point.error);
        line(
            "error",
            format!("{} {shown}; no indirect light: {}", answer.metric.title, number(answer.baseline_error, 3)),
        )?;
        line("error of", self.light())?;
        if let Some([time, error]) = self.found.achieved {
            line("again", format!("{} ms, {} {}", interval(time), answer.metric.title, interval(error)))?;
        }
        let step = |step: &Step| {
            let sign = if step.more_ms > 0.0 { "more" } else { "less" };
            format!(
                "for {} ms {sign}, error {}: {}{}",
                number(step.more_ms.abs(), 2),
                percent(step.error_change),
                step.point.label(),
                if step.point.verified { "" } else { " (predicted)" }
            )
        };
        line("faster", answer.faster.as_ref().map_or("nothing faster is better than no indirect light".into(), step))?;
        line("better", answer.better.as_ref().map_or("nothing better was found at any time".into(), step))?;
        if let Some(remains) = &answer.remains {
            line("remains", remains.clone())?;
        }
        line("searched", self.effort(answer))?;
        line(
            "adapter",
            format!("{}{}", self.adapter, if self.software { "; compare its times by ratio" } else { "" }),
        )?;
        line("command", self.render_command(answer).to_string())?;
        if let Some(link) = self.link(answer) {
            line("viewer", format!("{link} (served by cargo xtask web)"))?;
        }
        Ok(())
    }
}
