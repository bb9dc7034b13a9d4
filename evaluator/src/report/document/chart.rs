//! Small SVG charts: an XY plot and stacked bars.
//!
//! Written by hand rather than with a plotting crate, because text is placed by its anchor alone (nothing measures
//! fonts), colours follow the reader's light or dark theme, and points carry what the page needs to be interactive.

use std::{collections::BTreeSet, fmt::Write as _};

use super::escape;
use crate::format::number;

mod scale;

use scale::Scale;

/// Style of every chart; a page that inlines charts includes it once, a chart in a file carries it.
pub const STYLE: &str = include_str!("chart.css");

/// How many series colours [`STYLE`] defines; more series repeat them.
const COLOURS: usize = 8;

/// How values lie along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spacing {
    /// Evenly, from 0 unless all values are far from it.
    Linear,
    /// By ratio; 0 stands apart at the start of the axis.
    Logarithmic,
}

/// One axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// What is measured, with its unit.
    pub label: String,
    /// How values lie along it.
    pub spacing: Spacing,
    /// Values to mark; empty = round ones.
    pub ticks: Vec<f64>,
}

/// Shape of a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Marker {
    /// Filled circle.
    Circle,
    /// Filled square.
    Square,
    /// Filled triangle.
    Triangle,
    /// Filled diamond.
    Diamond,
    /// Upright cross.
    Cross,
    /// A small dot without a label. Of dots that cover each other one is drawn: a series may have very many.
    Dot,
}

/// Markers in the order in which series take them.
pub const MARKERS: [Marker; 5] = [Marker::Circle, Marker::Square, Marker::Triangle, Marker::Diamond, Marker::Cross];

/// How points are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Line {
    /// Straight from point to point.
    Solid,
    /// Dashed, straight from point to point.
    Dashed,
    /// Right, then down: a frontier, on which nothing lies between two points.
    Stairs,
    /// As [`Line::Stairs`], of this percentage of opacity: frontiers that follow each other.
    PaleStairs(u8),
}

/// One point.
#[derive(Clone, Debug)]
pub struct Point {
    /// Position in the axes' units.
    pub x: f64,
    /// Position in the axes' units.
    pub y: f64,
    /// Shown on hover, lines separated by `\n`.
    pub label: String,
    /// Row of results that the point stands for.
    pub row: Option<usize>,
}

/// Points that belong together.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name in the legend; empty = not listed.
    pub name: String,
    /// Colour by number; None = ink.
    pub colour: Option<usize>,
    /// Shape of the points; None = only a line.
    pub marker: Option<Marker>,
    /// How they are joined; None = only points.
    pub line: Option<Line>,
    /// In drawing order.
    pub points: Vec<Point>,
}

/// Points and lines over two axes.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Heading; also the accessible name.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Later series lie on top.
    pub series: Vec<Series>,
}

/// Horizontal bars made of segments.
#[derive(Clone, Debug)]
pub struct Bars {
    /// Heading; also the accessible name.
    pub title: String,
    /// Unit of the values.
    pub unit: String,
    /// The segments, in stacking order.
    pub segments: Vec<Segment>,
    /// Name of each bar and its value per segment (0 where it has none).
    pub bars: Vec<(String, Vec<f64>)>,
}

/// What a piece of a bar stands for.
#[derive(Clone, Debug)]
pub struct Segment {
    /// Name in the legend; empty = not listed.
    pub name: String,
    /// Colour by number; kindred segments share one.
    pub colour: usize,
    /// Index among the segments of its colour: later ones are paler.
    pub shade: usize,
}

impl Segment {
    /// Colour class and opacity.
    fn look(&self) -> String {
        let opacity = (1.0 / (1.0 + 0.45 * self.shade as f64)).max(0.3);
        format!("class=\"bar point {}\" fill-opacity=\"{opacity:.2}\"", colour_class(Some(self.colour)))
    }
}

/// A finished chart.
#[derive(Clone, Debug)]
pub struct Drawing {
    width: f64,
    height: f64,
    title: String,
    body: String,
}

impl Drawing {
    fn new(title: &str, width: f64, height: f64) -> Self {
        Self { width, height, title: title.into(), body: String::new() }
    }

    /// For a page that already has [`STYLE`].
    pub fn inline(&self) -> String {
        self.element("")
    }

    /// For a file of its own.
    pub fn file(&self) -> String {
        self.element(&format!("<style>{STYLE}</style><rect class=\"paper\" width=\"100%\" height=\"100%\"/>"))
    }

    fn element(&self, head: &str) -> String {
        let Self { width, height, title, body } = self;
        let title = escape(title);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"chart\" viewBox=\"0 0 {width} {height}\" \
             width=\"{width}\" height=\"{height}\" role=\"img\" aria-label=\"{title}\">{head}{body}</svg>\n"
        )
    }

    fn push(&mut self, element: std::fmt::Arguments) {
        // Writing to a String cannot fail.
        let _ = self.body.write_fmt(element);
    }

    fn text(&mut self, class: &str, x: f64, y: f64, text: &str) {
        self.push(format_args!("<text class=\"{class}\" x=\"{x:.1}\" y=\"{y:.1}\">{}</text>", escape(text)));
    }

    fn line(&mut self, class: &str, [x1, y1, x2, y2]: [f64; 4]) {
        self.push(format_args!(
            "<line class=\"{class}\" x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\"/>"
        ));
    }
}

/// Height of the plotting area and of a bar's row, pixels.
const PLOT_HEIGHT: f64 = 330.0;
const BAR_ROW: f64 = 24.0;
/// Width of the plotting area, pixels.
const PLOT_WIDTH: f64 = 700.0;
/// Room above for the title and below for ticks and axis label.
const TOP: f64 = 42.0;
const BOTTOM: f64 = 52.0;
/// A generous width of a character of the 12-pixel chart font: reserves room, places nothing.
const CHARACTER: f64 = 6.9;

fn text_room<'a>(texts: impl Iterator<Item = &'a str>) -> f64 {
    texts.map(|text| text.chars().count()).max().unwrap_or(0) as f64 * CHARACTER
}

impl Plot {
    /// Draws the plot. Points that the axes cannot show (not finite, or negative on a logarithmic axis) are left out.
    pub fn draw(&self) -> Drawing {
        let shown = |point: &&Point| {
            let fits = |value: f64, axis: &Axis| value.is_finite() && (axis.spacing == Spacing::Linear || value >= 0.0);
            fits(point.x, &self.x) && fits(point.y, &self.y)
        };
        let points = || self.series.iter().flat_map(|series| &series.points).filter(shown);
        let left = 74.0;
        let legend = text_room(self.series.iter().map(|series| series.name.as_str()));
        let legend_room = if legend > 0.0 { legend + 44.0 } else { 24.0 };
        let mut drawing = Drawing::new(&self.title, left + PLOT_WIDTH + legend_room, TOP + PLOT_HEIGHT + BOTTOM);
        let x = Scale::around(points().map(|point| point.x), self.x.spacing, [left, left + PLOT_WIDTH]);
        let y = Scale::around(points().map(|point| point.y), self.y.spacing, [TOP + PLOT_HEIGHT, TOP]);

        drawing.text("title", left, 22.0, &self.title);
        let floor = TOP + PLOT_HEIGHT;
        for (value, label) in x.ticks(&self.x.ticks) {
            drawing.line("grid", [x.at(value), TOP, x.at(value), floor]);
            drawing.text("tick below", x.at(value), floor + 18.0, &label);
        }
        for (value, label) in y.ticks(&self.y.ticks) {
            drawing.line("grid", [left, y.at(value), left + PLOT_WIDTH, y.at(value)]);
            drawing.text("tick beside", left - 8.0, y.at(value) + 4.0, &label);
        }
        drawing.line("axis", [left, floor, left + PLOT_WIDTH, floor]);
        drawing.line("axis", [left, TOP, left, floor]);
        drawing.text("label below", left + PLOT_WIDTH / 2.0, floor + 40.0, &self.x.label);
        let (label_x, label_y) = (16.0, TOP + PLOT_HEIGHT / 2.0);
        drawing.push(format_args!(
            "<text class=\"label below\" transform=\"translate({label_x} {label_y}) rotate(-90)\">{}</text>",
            escape(&self.y.label)
        ));

        for series in &self.series {
            let at: Vec<_> = series.points.iter().filter(shown).map(|p| (x.at(p.x), y.at(p.y), p)).collect();
            if let Some(line) = series.line {
                drawing.path(line, series.colour, at.iter().map(|&(x, y, _)| (x, y)));
            }
            if series.marker == Some(Marker::Dot) {
                drawing.dots(series.colour, at.iter().map(|&(x, y, _)| (x, y)));
                continue;
            }
            for (x, y, point) in at {
                if let Some(marker) = series.marker {
                    drawing.marker(marker, series.colour, x, y, Some(point));
                }
            }
        }
        drawing.legend(left + PLOT_WIDTH + 20.0, &self.series);
        drawing
    }
}

impl Drawing {
    fn path(&mut self, line: Line, colour: Option<usize>, mut points: impl Iterator<Item = (f64, f64)>) {
        let Some((x, y)) = points.next() else { return };
        let mut path = format!("M{x:.1} {y:.1}");
        for (x, y) in points {
            let _ = match line {
                Line::Stairs | Line::PaleStairs(_) => write!(path, "H{x:.1}V{y:.1}"),
                Line::Solid | Line::Dashed => write!(path, "L{x:.1} {y:.1}"),
            };
        }
        let kind = if line == Line::Dashed { "line dashed" } else { "line" };
        let opacity = match line {
            Line::PaleStairs(percent) => format!(" stroke-opacity=\"{:.2}\"", f64::from(percent.min(100)) / 100.0),
            Line::Solid | Line::Dashed | Line::Stairs => String::new(),
        };
        self.push(format_args!("<path class=\"{kind} {}\" d=\"{path}\"{opacity}/>", colour_class(colour)));
    }

    /// Dots as one element, on a raster of pixels.
    fn dots(&mut self, colour: Option<usize>, points: impl Iterator<Item = (f64, f64)>) {
        let places: BTreeSet<[i64; 2]> = points.map(|(x, y)| [x.round() as i64, y.round() as i64]).collect();
        let path: String = places.iter().map(|[x, y]| format!("M{x} {y}h0")).collect();
        self.push(format_args!("<path class=\"line dots {}\" d=\"{path}\"/>", colour_class(colour)));
    }

    fn marker(&mut self, marker: Marker, colour: Option<usize>, x: f64, y: f64, point: Option<&Point>) {
        let shape = match marker {
            Marker::Circle => "M-5 0a5 5 0 1 0 10 0a5 5 0 1 0 -10 0z",
            Marker::Square => "M-4.5 -4.5h9v9h-9z",
            Marker::Triangle => "M0 -5.8L5.6 4.4H-5.6z",
            Marker::Diamond => "M0 -6.2L6.2 0L0 6.2L-6.2 0z",
            Marker::Dot => "M-2 0a2 2 0 1 0 4 0a2 2 0 1 0 -4 0z",
            Marker::Cross => "M-1.6 -5.5h3.2v3.9h3.9v3.2h-3.9v3.9h-3.2v-3.9h-3.9v-3.2h3.9z",
        };
        let colour = colour_class(colour);
        match point {
            None => self.push(format_args!(
                "<path class=\"mark {colour}\" transform=\"translate({x:.1} {y:.1})\" d=\"{shape}\"/>"
            )),
            Some(Point { label, row, .. }) => {
                let row = row.map_or(String::new(), |row| format!(" data-row=\"{row}\""));
                self.push(format_args!(
                    "<path class=\"mark point {colour}\" transform=\"translate({x:.1} {y:.1})\" d=\"{shape}\"{row}>\
                     <title>{}</title></path>",
                    escape(label)
                ));
            }
        }
    }

    fn legend(&mut self, x: f64, series: &[Series]) {
        for (index, series) in series.iter().filter(|series| !series.name.is_empty()).enumerate() {
            let y = TOP + 8.0 + 20.0 * index as f64;
            if let Some(line) = series.line {
                let sample = [(x - 8.0, y), (x + 8.0, y)];
                // A stair of two points on one height is the flat line that a legend wants.
                self.path(line, series.colour, sample.into_iter());
            }
            if let Some(marker) = series.marker {
                self.marker(marker, series.colour, x, y, None);
            }
            self.text("legend", x + 14.0, y + 4.0, &series.name);
        }
    }
}

fn colour_class(colour: Option<usize>) -> String {
    colour.map_or("ink".into(), |index| format!("c{}", index % COLOURS))
}

impl Bars {
    /// Draws the bars.
    pub fn draw(&self) -> Drawing {
        let left = text_room(self.bars.iter().map(|(name, _)| name.as_str())) + 16.0;
        let totals: Vec<f64> = self.bars.iter().map(|(_, values)| values.iter().sum()).collect();
        let listed = || self.segments.iter().filter(|segment| !segment.name.is_empty());
        let legend_room = text_room(listed().map(|segment| segment.name.as_str())) + 44.0;
        let total_room = 64.0;
        let right = left + PLOT_WIDTH;
        let floor = TOP + BAR_ROW * self.bars.len().max(listed().count()) as f64;
        let mut drawing = Drawing::new(&self.title, right + total_room + legend_room, floor + BOTTOM);
        let scale = Scale::around(totals.iter().copied().chain([0.0]), Spacing::Linear, [left, right]);

        drawing.text("title", 4.0, 22.0, &self.title);
        for (value, label) in scale.ticks(&[]) {
            drawing.line("grid", [scale.at(value), TOP, scale.at(value), floor]);
            drawing.text("tick below", scale.at(value), floor + 18.0, &label);
        }
        drawing.text("label below", left + PLOT_WIDTH / 2.0, floor + 40.0, &self.unit);
        for (index, ((name, values), total)) in self.bars.iter().zip(&totals).enumerate() {
            let y = TOP + BAR_ROW * index as f64;
            drawing.text("bar-name", left - 8.0, y + 16.0, name);
            let mut start = 0.0;
            for (segment, value) in self.segments.iter().zip(values).filter(|(_, value)| **value > 0.0) {
                let (from, to) = (scale.at(start), scale.at(start + value));
                let of = if segment.name.is_empty() { String::new() } else { format!("{}: ", segment.name) };
                let label = format!("{name}\n{of}{} {}", number(*value, 3), self.unit);
                drawing.push(format_args!(
                    "<rect {} x=\"{from:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"><title>{}</title></rect>",
                    segment.look(),
                    y + 4.0,
                    to - from,
                    BAR_ROW - 8.0,
                    escape(&label)
                ));
                start += value;
            }
            drawing.text("total", scale.at(*total) + 8.0, y + 16.0, &number(*total, 3));
        }
        for (index, segment) in listed().enumerate() {
            let (x, y) = (right + total_room, TOP + 3.0 + 20.0 * index as f64);
            let look = segment.look().replace(" point", "");
            drawing.push(format_args!("<rect {look} x=\"{x:.1}\" y=\"{y:.1}\" width=\"10\" height=\"10\"/>"));
            drawing.text("legend", x + 16.0, y + 9.0, &segment.name);
        }
        drawing
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64, y: f64) -> Point {
        Point { x, y, label: format!("<{x}> & {y}"), row: Some(3) }
    }

    fn plot(points: Vec<Point>) -> Plot {
        let axis = |label: &str| Axis { label: label.into(), spacing: Spacing::Logarithmic, ticks: vec![] };
        let series = Series {
            name: "half & half".into(),
            colour: Some(9),
            marker: Some(Marker::Circle),
            line: Some(Line::Stairs),
            points,
        };
        Plot { title: "a < b".into(), x: axis("time, ms"), y: axis("relMSE"), series: vec![series] }
    }

    #[test]
    fn text_is_escaped_and_unshowable_points_left_out() {
        let drawing = plot(vec![point(1.0, 1.0), point(2.0, f64::NAN), point(-1.0, 1.0), point(3.0, 0.5)]).draw();
        let svg = drawing.file();
        assert_eq!(svg.matches("data-row=\"3\"").count(), 2);
        assert!(svg.contains("a &lt; b") && svg.contains("half &amp; half") && svg.contains("&lt;1&gt; &amp; 1"));
        assert!(svg.contains("class=\"mark point c1\""), "the ninth colour is the first again");
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
        assert!(plot(vec![]).draw().inline().starts_with("<svg"));
    }

    #[test]
    fn dots_are_one_element_and_covered_ones_are_left_out() {
        let points = (0..1000).map(|i| point(1.0 + f64::from(i % 10), 1.0)).collect();
        let mut plot = plot(points);
        (plot.series[0].marker, plot.series[0].line) = (Some(Marker::Dot), None);
        let svg = plot.draw().inline();
        let dots = svg.split("class=\"line dots c1\" d=\"").nth(1).map(|rest| rest.split('"').next());
        assert_eq!(dots.flatten().map(|path| path.matches("h0").count()), Some(10));
        assert_eq!(svg.matches("<title>").count(), 0);
    }

    #[test]
    fn bars_stack_to_their_total() {
        let segment = |name: &str, colour| Segment { name: name.into(), colour, shade: colour };
        let bars = Bars {
            title: "cost".into(),
            unit: "ms".into(),
            segments: vec![segment("gather", 0), segment("combine", 1)],
            bars: vec![("quarter".into(), vec![3.0, 1.0]), ("half".into(), vec![12.0, 0.0])],
        };
        let svg = bars.draw().inline();
        assert_eq!(svg.matches("<title>").count(), 3, "an empty segment is not drawn");
        assert!(svg.contains(">4.00<") && svg.contains(">12.0<"));
    }
}
