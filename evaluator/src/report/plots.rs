//! The plots of a report.

use std::collections::BTreeSet;

use halflight_metrics::{Best, Metric, Plotted};
use serde_json::Value;

use super::document::chart::{Axis, Bars, Drawing, Line, MARKERS, Marker, Plot, Point, Segment, Series, Spacing};
use super::grouping::{Group, MANY, is_baseline, last_segment, value_label};
use super::pareto::{frontier, frontiers};
use super::tables::pass_names;
use crate::format::number;
use crate::measurement::Measurement;

/// A drawing with the name of its file (without folder and `.svg`) and of its choice where several share one position.
pub struct Named {
    /// File name.
    pub file: String,
    /// Name of the metric that it shows; empty where there is no choice.
    pub choice: &'static str,
    /// The drawing.
    pub drawing: Drawing,
}

/// Positions of the rows that are shown in full: all, or where there are many those of the frontier of each metric.
pub fn shown_in_full(group: &Group) -> Vec<usize> {
    if group.rows.len() <= MANY {
        return (0..group.rows.len()).collect();
    }
    let best = shown_metrics(group).flat_map(|(metric, plotted)| frontiers(group, |row| error(metric, plotted, row)));
    let baselines = (0..group.rows.len()).filter(|&index| is_baseline(group.rows[index].1)).take(1);
    let chosen: BTreeSet<usize> = best.flat_map(|(_, positions)| positions).chain(baselines).collect();
    // Without any error, the first ones.
    if chosen.is_empty() { (0..MANY).collect() } else { chosen.into_iter().take(MANY).collect() }
}

/// Time against error with the frontier. Rows beside those that are `shown` in full are dots.
pub fn time_against_error(group: &Group, shown: &BTreeSet<usize>, metric: &'static Metric, plotted: &Plotted) -> Named {
    let style = Style::of(group, &group.varying);
    let mut series: Vec<Series> = Vec::new();
    let rows: Vec<&Measurement> = group.rows.iter().map(|&(_, row)| row).collect();
    let error = |row: &Measurement| error(metric, plotted, row);
    let pairs: Vec<(f64, f64)> = rows.iter().map(|row| (row.time_ms_median, error(row))).collect();
    let curves = frontiers(group, error);
    let count = curves.len();
    for (number, (frame, best)) in curves.into_iter().enumerate().filter(|(_, (_, best))| best.len() > 1) {
        let points = best.iter().map(|&index| point(group, index, pairs[index], metric)).collect();
        let name = frame.map_or("frontier".into(), |frame| format!("frontier, frame {frame}"));
        // Later frames are darker.
        let line = frame.map_or(Line::Stairs, |_| Line::PaleStairs((100 * (number + 1) / count) as u8));
        let marker = frame.map(|frame| frame_marker(group, frame));
        series.push(Series { name, colour: None, marker, line: Some(line), points });
    }
    if !group.has_several_frames() {
        series.extend(technique_frontiers(group, &style, &pairs, &error));
    }
    for (index, (_, row)) in group.rows.iter().enumerate() {
        let (colour, marker) = style.look(row);
        if !shown.contains(&index) {
            let (x, y) = pairs[index];
            let place = Point { x, y, label: String::new(), row: None };
            match series.iter_mut().find(|series| series.colour == colour && series.marker == Some(Marker::Dot)) {
                Some(series) => series.points.push(place),
                None => series.insert(
                    0,
                    Series {
                        name: format!("all {}", (style.colour.of)(row)).trim().to_owned(),
                        colour,
                        marker: Some(Marker::Dot),
                        line: None,
                        points: vec![place],
                    },
                ),
            }
            continue;
        }
        let place = point(group, index, pairs[index], metric);
        // A frontier may have the same look, and no other points.
        let same =
            |series: &&mut Series| series.colour == colour && series.marker == Some(marker) && series.line.is_none();
        match series.iter_mut().find(same) {
            Some(series) => series.points.push(place),
            None => {
                let name = style.name(row);
                // Frames are told by their shapes, which the legend shows with the curves.
                let is_known = group.has_several_frames() && series.iter().any(|series| series.name == name);
                series.push(Series {
                    name: if is_known { String::new() } else { name },
                    colour,
                    marker: Some(marker),
                    line: None,
                    points: vec![place],
                });
            }
        }
    }
    let drawing = Plot {
        title: format!("Time against {}", plotted.name),
        x: axis("time, ms", pairs.iter().map(|pair| pair.0)),
        y: axis(plotted.label, pairs.iter().map(|pair| pair.1)),
        series,
    };
    Named { file: format!("time-vs-{}", plotted.file), choice: plotted.name, drawing: drawing.draw() }
}

/// Shape of the points of a frame. The first shape is that of rows that are the same in every frame.
fn frame_marker(group: &Group, frame: u32) -> Marker {
    let number = group.frames.iter().position(|known| *known == frame).unwrap_or(0);
    MARKERS[(number + 1) % MARKERS.len()]
}

/// The frontier of each technique, in its colour; none where there is one technique only.
fn technique_frontiers(
    group: &Group,
    style: &Style,
    pairs: &[(f64, f64)],
    error: &impl Fn(&Measurement) -> f64,
) -> Vec<Series> {
    let mut techniques: Vec<&str> = Vec::new();
    for (_, row) in group.rows.iter().filter(|(_, row)| group.mixed_techniques && !is_baseline(row)) {
        if !techniques.contains(&row.technique.as_str()) {
            techniques.push(&row.technique);
        }
    }
    let of_technique = |technique: &str| {
        let own: Vec<usize> =
            (0..group.rows.len()).filter(|&index| group.rows[index].1.technique == technique).collect();
        let rows: Vec<&Measurement> = own.iter().map(|&index| group.rows[index].1).collect();
        let best = frontier(&rows, error);
        let point = |&index: &usize| {
            let (x, y) = pairs[own[index]];
            Point { x, y, label: String::new(), row: None }
        };
        (best.len() > 1).then(|| Series {
            name: String::new(),
            colour: style.look(rows[best[0]]).0,
            marker: None,
            line: Some(Line::Stairs),
            points: best.iter().map(point).collect(),
        })
    };
    techniques.into_iter().filter_map(of_technique).collect()
}

/// Error over the number of samples, one line for each combination of the other settings; empty when no number of
/// samples varies.
pub fn error_over_samples(group: &Group) -> Vec<Named> {
    // One line for each combination of thousands of settings shows nothing.
    if group.rows.len() > MANY || group.has_several_frames() {
        return vec![];
    }
    let is_samples = |name: &&String| ["samples", "slices", "rays"].contains(&last_segment(name));
    let Some(samples) = group.varying.iter().find(is_samples) else { return vec![] };
    let count = |row: &Measurement| row.parameters.get(samples).and_then(Value::as_f64);
    let plot = |metric: &'static Metric, plotted: &Plotted| {
        // Here the sign tells light that is lost from light that is too much.
        let signed = metric.best == Best::Nearest(0.0);
        let mut series: Vec<Series> = Vec::new();
        let others: Vec<String> = group.varying.iter().filter(|name| *name != samples).cloned().collect();
        let style = Style::of(group, &others);
        let (mut counts, mut errors) = (Vec::new(), Vec::new());
        for (index, (_, row)) in group.rows.iter().enumerate() {
            let (Some(count), Some(value)) = (count(row), row.errors.get(metric.id)) else { continue };
            let error = if signed { value } else { (plotted.value)(value) };
            counts.push(count);
            errors.push(error);
            let technique = group.mixed_techniques.then(|| row.technique.clone());
            let words = others.iter().filter_map(|name| Some(value_label(name, row.parameters.get(name)?)));
            let name = technique.into_iter().chain(words).collect::<Vec<_>>().join(" · ");
            let place = point(group, index, (count, error), metric);
            match series.iter_mut().find(|series| series.name == name) {
                Some(series) => series.points.push(place),
                None => {
                    let (colour, marker) = style.look(row);
                    let (marker, line) = (Some(marker), Some(Line::Solid));
                    series.push(Series { name, colour, marker, line, points: vec![place] });
                }
            }
        }
        counts.sort_by(f64::total_cmp);
        counts.dedup();
        series.iter_mut().for_each(|series| series.points.sort_by(|a, b| a.x.total_cmp(&b.x)));
        let (name, label) =
            if signed { (metric.title, plotted.label.replace('|', "")) } else { (plotted.name, plotted.label.into()) };
        let drawing = Plot {
            title: format!("{name} over {}", last_segment(samples).replace('_', " ")),
            x: Axis { ticks: counts.clone(), ..axis(&group.short_name(samples).replace('_', " "), counts.into_iter()) },
            y: axis(&label, errors.into_iter()),
            series,
        };
        Named { file: format!("samples-vs-{}", plotted.file), choice: plotted.name, drawing: drawing.draw() }
    };
    let mut plots: Vec<Named> = shown_metrics(group).map(|(metric, plotted)| plot(metric, plotted)).collect();
    // What is asked of the disc's area is how much light it loses.
    if group.varying.iter().any(|name| last_segment(name) == "disc_area") {
        plots.sort_by_key(|plot| plot.choice != "|bias|");
    }
    plots
}

/// Cost of each pass, one bar a row; None when no row has passes.
pub fn cost_per_pass(group: &Group) -> Option<Named> {
    let names = pass_names(group);
    let values = |row: &Measurement| names.iter().map(|name| row.pass(name).unwrap_or(0.0)).collect();
    let bars = Bars {
        title: "Cost per pass".into(),
        unit: "ms".into(),
        segments: segments(&names),
        bars: group
            .rows
            .iter()
            .map(|&(index, row)| (format!("#{} {}", index + 1, group.label(row)), values(row)))
            .collect(),
    };
    let file = "cost-per-pass".into();
    (!names.is_empty()).then(|| Named { file, choice: "", drawing: bars.draw() })
}

/// Passes that differ only in a number at the end, as those of the levels do, share a colour.
fn segments(passes: &[String]) -> Vec<Segment> {
    let family = |name: &str| name.trim_end_matches(|end: char| end.is_ascii_digit() || end == '_').to_owned();
    let mut families: Vec<(String, usize)> = Vec::new();
    let segment = |name: &String| {
        let colour = families.iter().position(|(known, _)| *known == family(name)).unwrap_or_else(|| {
            families.push((family(name), 0));
            families.len() - 1
        });
        let shade = families[colour].1;
        families[colour].1 += 1;
        Segment { name: name.replace('_', " "), colour, shade }
    };
    passes.iter().map(segment).collect()
}

/// Metrics that are plotted and that some row has, in reading order.
pub fn shown_metrics<'a>(group: &'a Group) -> impl Iterator<Item = (&'static Metric, &'static Plotted)> + 'a {
    let measured = |metric: &&Metric| group.rows.iter().any(|(_, row)| row.errors.get(metric.id).is_some());
    Metric::ranked().into_iter().filter(measured).filter_map(|metric| Some((metric, metric.plot.as_ref()?)))
}

/// A metric of a row as plots show it; NaN where it was not measured.
pub fn error(metric: &Metric, plotted: &Plotted, row: &Measurement) -> f64 {
    row.errors.get(metric.id).map_or(f64::NAN, plotted.value)
}

/// Logarithmic where the positive values span more than a factor of four and none is negative.
fn axis(label: &str, values: impl Iterator<Item = f64>) -> Axis {
    let (low, high) = values
        .filter(|value| value.is_finite() && *value != 0.0)
        .fold((f64::INFINITY, 0.0f64), |(low, high), value| (low.min(value), high.max(value)));
    let spacing = if low > 0.0 && high > 4.0 * low { Spacing::Logarithmic } else { Spacing::Linear };
    Axis { label: label.into(), spacing, ticks: vec![] }
}

fn point(group: &Group, index: usize, (x, y): (f64, f64), metric: &Metric) -> Point {
    let (row_index, row) = group.rows[index];
    let value = row.errors.get(metric.id).map_or(String::new(), |value| number(value, metric.digits));
    let unit = if metric.unit.is_empty() { String::new() } else { format!(" {}", metric.unit) };
    let time = number(row.time_ms_median, 3);
    let label = format!("#{} {}\n{time} ms\n{} {value}{unit}", row_index + 1, group.label(row), metric.title);
    Point { x, y, label, row: Some(row_index) }
}

/// What colour and shape mean in a group's plots: the technique and the first of some settings where techniques mix,
/// else the first two settings.
struct Style {
    colour: Meaning,
    shape: Meaning,
    /// Shapes are those of frames.
    frames: Vec<u32>,
}

/// A property of a row and its values in order of appearance.
struct Meaning {
    of: Box<dyn Fn(&Measurement) -> String>,
    values: Vec<String>,
}

impl Meaning {
    fn new(group: &Group, of: impl Fn(&Measurement) -> String + 'static) -> Self {
        let mut values = Vec::new();
        for (_, row) in group.rows.iter().filter(|(_, row)| !is_baseline(row)) {
            let value = of(row);
            if !values.contains(&value) {
                values.push(value);
            }
        }
        Self { of: Box::new(of), values }
    }

    fn index(&self, row: &Measurement) -> usize {
        let value = (self.of)(row);
        self.values.iter().position(|known| *known == value).unwrap_or(0)
    }
}

impl Style {
    fn of(group: &Group, settings: &[String]) -> Self {
        let parameter = |index: usize| {
            let name = settings.get(index).cloned();
            move |row: &Measurement| {
                let value = name.as_ref().and_then(|name| row.parameters.get(name).map(|value| (name, value)));
                value.map_or(String::new(), |(name, value)| value_label(name, value))
            }
        };
        let frames = if group.has_several_frames() { group.frames.clone() } else { Vec::new() };
        let (colour, shape) = if group.mixed_techniques {
            (Meaning::new(group, |row| row.technique.clone()), Meaning::new(group, parameter(0)))
        } else {
            (Meaning::new(group, parameter(0)), Meaning::new(group, parameter(1)))
        };
        Self { colour, shape, frames }
    }

    /// Colour and shape; the baseline is an ink cross.
    fn look(&self, row: &Measurement) -> (Option<usize>, Marker) {
        if is_baseline(row) {
            return (None, Marker::Cross);
        }
        let shape = if self.frames.is_empty() {
            self.shape.index(row)
        } else {
            let frame = row.at_frame.and_then(|frame| self.frames.iter().position(|known| *known == frame));
            frame.map_or(0, |number| number + 1)
        };
        (Some(self.colour.index(row)), MARKERS[shape % MARKERS.len()])
    }

    fn name(&self, row: &Measurement) -> String {
        if is_baseline(row) {
            return row.technique.clone();
        }
        let shape = if self.frames.is_empty() { (self.shape.of)(row) } else { String::new() };
        let words = [(self.colour.of)(row), shape];
        words.into_iter().filter(|word| !word.is_empty()).collect::<Vec<_>>().join(" · ")
    }
}
