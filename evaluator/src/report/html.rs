//! index.html: one file with everything but the pictures in it, which it names by relative path.

use std::fmt::Write as _;

use halflight_metrics::{Metric, MetricId, colour_map};
use serde_json::{Value, json};

use super::chart::STYLE as CHART_STYLE;
use super::plots::Named;
use super::slice::Slice;
use super::strip::{self, Strip};
use super::tables::{Cell, Column, Kind, Table, TableRow};
use super::trade::{self, Trade};
use super::{FULL_SCALE, Part, Report, escape};
use crate::format::number;

const PAGE: &str = include_str!("page.html");
pub(super) const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// The whole page.
pub fn page(report: &Report, parts: &[Part]) -> String {
    let data: Vec<Value> = parts.iter().map(picture_data).collect();
    // "</script>" inside a text would end the element that holds the data.
    let data = Value::from(data).to_string().replace("</", "<\\/");
    let filled = [
        ("{{style}}", [CHART_STYLE, STYLE].concat()),
        ("{{magma}}", magma_gradient()),
        ("{{title}}", escape(&report.title)),
        ("{{summary}}", escape(&report.summary)),
        ("{{facts}}", facts(report)),
        ("{{warnings}}", warnings(report)),
        ("{{contents}}", contents(parts)),
        ("{{groups}}", parts.iter().enumerate().map(|(index, part)| section(index, part)).collect()),
        ("{{data}}", data),
        ("{{script}}", SCRIPT.into()),
    ];
    // One pass from left to right, so that a text that looks like a place is not filled again.
    let mut page = String::new();
    let mut rest = PAGE;
    while let Some((at, place, text)) = filled
        .iter()
        .filter_map(|(place, text)| rest.find(place).map(|at| (at, place, text)))
        .min_by_key(|found| found.0)
    {
        page += &rest[..at];
        page += text;
        rest = &rest[at + place.len()..];
    }
    page + rest
}

fn facts(report: &Report) -> String {
    let fact = |(name, value): (&str, String)| match name {
        "Command" => format!("<div class=\"wide\"><dt>{name}</dt><dd>{}</dd></div>", code(&value)),
        _ => format!(
            "<div><dt>{name}</dt><dd>{}</dd></div>",
            escape(&value).replace("(software)", "<span class=\"badge\">software</span>")
        ),
    };
    report.facts().into_iter().map(fact).collect()
}

fn warnings(report: &Report) -> String {
    let items: String = report.all_warnings().iter().map(|warning| format!("<li>{}</li>", escape(warning))).collect();
    if items.is_empty() {
        return String::new();
    }
    format!("<section class=\"warnings\" id=\"warnings\"><h2>Warnings</h2><ul>{items}</ul></section>")
}

fn contents(parts: &[Part]) -> String {
    if parts.len() < 2 {
        return String::new();
    }
    let link =
        |(index, part): (usize, &Part)| format!("<a href=\"#group-{index}\">{}</a>", escape(&part.group.title()));
    format!("<nav>{}</nav>", parts.iter().enumerate().map(link).collect::<String>())
}

/// Longest list of shared settings that stands open, bytes of HTML: four lines or so.
const SETTINGS_SHOWN: usize = 600;

fn section(index: usize, part: &Part) -> String {
    let row = part.group.first();
    let badge = if row.software_adapter { " <span class=\"badge\">software</span>" } else { "" };
    let settings = format!("<p class=\"settings\">{}</p>", escape(&part.settings()));
    // With many techniques they fill half a page, which nobody reads before the plot.
    let settings = match settings.len() {
        0..=SETTINGS_SHOWN => settings,
        _ => format!("<details><summary>Settings that all rows share</summary>{settings}</details>"),
    };
    let mut html = format!(
        "<section class=\"group\" id=\"group-{index}\" data-group=\"{index}\"><h2>{}</h2>{settings}\
         <p class=\"settings\">{} · {}{badge}</p>",
        escape(&part.group.title()),
        escape(&row.adapter),
        escape(&row.backend)
    );
    html += &slice(part);
    html += &strips(part);
    html += &figures(part);
    html += &trades(part);
    html += &compare(part);
    html += &error_maps(part);
    if !part.error_over_samples.is_empty() {
        let caption = "Where a line goes flat, noise is gone and bias is left: more samples no longer help.";
        html += &heading("Error over samples", caption);
        let panel = |plot: &Named| (plot.choice, figure(&plot.drawing.inline()));
        html += &choices(part.error_over_samples.iter().map(panel));
    }
    if let (Some(plot), Some(passes)) = (&part.cost_per_pass, &part.passes) {
        html += &heading(&passes.title, &passes.caption);
        html += &figure(&plot.drawing.inline());
        html += &format!("<details><summary>As a table</summary>{}</details>", rows(passes));
    }
    // The widest table may use the whole window.
    html += &table(&part.results).replace("class=\"scroll\"", "class=\"scroll wide\"");
    html += &part.temporal.iter().chain(&part.published).map(table).collect::<String>();
    if let Some(commands) = &part.commands {
        html += &format!("<details><summary>Commands that reproduce each row</summary>{}</details>", rows(commands));
    }
    html + "</section>"
}

/// What each millisecond buys, one measure at a time.
fn trades(part: &Part) -> String {
    if part.trades.is_empty() {
        return String::new();
    }
    let remark = part.remark.as_ref().map_or(String::new(), |text| format!("<p class=\"remark\">{}</p>", escape(text)));
    let panel = |Trade { plot, table, .. }: &Trade| (plot.choice, figure(&plot.drawing.inline()) + &rows(table));
    let choices = choices(part.trades.iter().map(panel));
    format!("{}{choices}{remark}", heading("What each millisecond buys", trade::CAPTION))
}

/// Panels of which one is shown, with a choice above. A choice holds for every place that offers it.
fn choices(panels: impl Iterator<Item = (&'static str, String)>) -> String {
    let (mut buttons, mut shown) = (String::new(), String::new());
    // Writing to a String cannot fail.
    for (index, (name, panel)) in panels.enumerate() {
        let _ = write!(buttons, "<button type=\"button\" aria-pressed=\"{}\">{name}</button>", index == 0);
        let hidden = if index == 0 { "" } else { " hidden" };
        let _ = write!(shown, "<div class=\"choice\" data-choice=\"{name}\"{hidden}>{panel}</div>");
    }
    format!(
        "<div class=\"choices\"><div class=\"segmented\" role=\"group\" aria-label=\"Error measure\">{buttons}</div>{shown}</div>"
    )
}

/// Equation 3 against Equation 4; empty for other presets.
fn slice(part: &Part) -> String {
    let Some(Slice { pictures, size: [width, height], line, plot, table, caption }) = &part.slice else {
        return String::new();
    };
    let at = 100.0 * (*line as f64 + 0.5) / f64::from(*height);
    let picture = |(title, path): &(String, String)| {
        format!(
            "<figure><a href=\"{path}\"><img src=\"{path}\" alt=\"{title}\" width=\"{width}\" height=\"{height}\">\
             <i class=\"cut\" style=\"top:{at:.2}%\"></i></a><figcaption>{title}</figcaption></figure>",
            path = escape(path)
        )
    };
    let pictures: String = pictures.iter().map(picture).collect();
    let plot = figure(&plot.drawing.inline());
    let figure = format!("{}<div class=\"strip three\">{pictures}</div>{plot}", heading(&table.title, caption));
    format!("{figure}<p class=\"caption\">{}</p>{}", escape(&table.caption), rows(table))
}

/// One picture a level; empty where rows do not differ in the level that they gather.
fn strips(part: &Part) -> String {
    let caption = "Indirect light (albedo · indirect) of each level alone under one exposure: a level adds the light of its own ring, \
                   and a coarser one reaches twice as far.";
    side_by_side(part, &strip::strips(part.group), "strip", heading("Level by level", caption))
}

/// The pictures of a paper's figure; empty for other presets.
fn figures(part: &Part) -> String {
    let caption = "Under one exposure, with the error against the first picture: RMSE and bias of a single frame, and the \
                   deviation from frame to frame. A click on a picture chooses its row everywhere.";
    side_by_side(part, &strip::figures(part.group), "strip large", heading("Side by side", caption))
}

fn side_by_side(part: &Part, strips: &[Strip], class: &str, heading: String) -> String {
    if strips.is_empty() {
        return String::new();
    }
    let [width, height] = [part.group.first().width, part.group.first().height];
    let picture = |(row, title, path): &(Option<usize>, String, &str)| {
        let row = row.map_or(String::new(), |row| format!(" data-row=\"{row}\""));
        let (path, title) = (escape(path), escape(title));
        format!(
            "<figure{row}><img src=\"{path}\" alt=\"{title}\" width=\"{width}\" height=\"{height}\">\
             <figcaption>{title}</figcaption></figure>"
        )
    };
    let strip = |Strip { name, pictures }: &Strip| {
        let name = if name.is_empty() { String::new() } else { format!("<p class=\"caption\">{}</p>", escape(name)) };
        format!("{name}<div class=\"{class}\">{}</div>", pictures.iter().map(picture).collect::<String>())
    };
    heading + &strips.iter().map(strip).collect::<String>()
}

pub(super) fn figure(svg: &str) -> String {
    format!("<div class=\"plot\">{svg}</div>")
}

/// A table under its heading and caption.
pub(super) fn table(table: &Table) -> String {
    heading(&table.title, &table.caption) + &rows(table)
}

pub(super) fn heading(title: &str, caption: &str) -> String {
    let caption =
        if caption.is_empty() { String::new() } else { format!("<p class=\"caption\">{}</p>", escape(caption)) };
    format!("<h3>{}</h3>{caption}", escape(title))
}

fn rows(table: &Table) -> String {
    let head = |Column { name, unit, meaning, kind }: &Column| {
        let class = if *kind == Kind::Number { " class=\"number\"" } else { "" };
        let unit =
            if unit.is_empty() { String::new() } else { format!("<span class=\"unit\">{}</span>", escape(unit)) };
        let meaning = if meaning.is_empty() { String::new() } else { format!(" title=\"{}\"", escape(meaning)) };
        format!("<th scope=\"col\"{class}><button type=\"button\"{meaning}>{}{unit}</button></th>", escape(name))
    };
    let row = |TableRow { row, cells }: &TableRow| {
        let row = row.map_or(String::new(), |row| format!(" data-row=\"{row}\""));
        let cells: String = cells.iter().zip(&table.columns).map(|(shown, column)| cell(shown, column.kind)).collect();
        format!("<tr{row}>{cells}</tr>")
    };
    format!(
        "<div class=\"scroll\"><table><thead><tr>{}</tr></thead><tbody>{}</tbody></table></div>",
        table.columns.iter().map(head).collect::<String>(),
        table.rows.iter().map(row).collect::<String>()
    )
}

fn cell(Cell { text, value, best }: &Cell, kind: Kind) -> String {
    let class = match (kind, best) {
        (Kind::Number, true) => " class=\"number best\"",
        (Kind::Number, false) => " class=\"number\"",
        _ => "",
    };
    let value = value.map_or(String::new(), |value| format!(" data-value=\"{value}\""));
    let shown = if kind == Kind::Code { code(text) } else { escape(text) };
    format!("<td{class}{value}>{shown}</td>")
}

fn code(command: &str) -> String {
    if command.is_empty() {
        return String::new();
    }
    format!("<code>{}</code><button type=\"button\" class=\"copy\">copy</button>", escape(command))
}

/// The slider between two pictures; empty when no row has pictures.
fn compare(part: &Part) -> String {
    let row = part.group.first();
    if part.group.rows.iter().all(|(_, row)| row.images.is_empty()) {
        return String::new();
    }
    format!(
        "<h3>Pictures</h3><p class=\"caption\">Drag the divider, or focus the picture: ← → move it, ↑ ↓ change the right \
         configuration, X swaps the sides. Choosing a point in a plot or a row in a table shows it on the right. Pictures of one kind share an exposure.</p>\
         <div class=\"compare\">\
         <div class=\"controls\">\
         <label>Left <select class=\"left\"></select></label>\
         <button type=\"button\" class=\"swap\" title=\"Swap sides (X)\" aria-label=\"Swap sides\">⇄</button>\
         <label>Right <select class=\"right\"></select></label>\
         <div class=\"segmented kinds\" role=\"group\" aria-label=\"Picture\"></div>\
         <div class=\"segmented zooms\" role=\"group\" aria-label=\"Zoom\"></div></div>\
         <div class=\"frame\"><div class=\"viewport\"><div class=\"stage\" tabindex=\"0\" role=\"slider\" \
         aria-label=\"Divider between the two pictures\" aria-valuemin=\"0\" aria-valuemax=\"100\" aria-valuenow=\"50\" \
         style=\"aspect-ratio:{w}/{h};--width:{w}px\">\
         <img class=\"under\" alt=\"\" draggable=\"false\"><img class=\"over\" alt=\"\" draggable=\"false\">\
         <div class=\"divider\"></div></div></div>\
         <span class=\"tag tag-left\"></span><span class=\"tag tag-right\"></span></div>{scale}\
         <p class=\"files\">Linear, as EXR: <a class=\"exr-left\"></a> <a class=\"exr-right\"></a></p>\
         <noscript>The pictures lie in the folder images/.</noscript></div>",
        w = row.width,
        h = row.height,
        scale = scale("scale of-kind"),
    )
}

fn scale(class: &str) -> String {
    let full = number(100.0 * f64::from(FULL_SCALE), 3);
    format!(
        "<p class=\"{class}\"><span>relative error of albedo · indirect</span><span>0</span><i class=\"magma\"></i>\
         <span>{full} % and more</span><span class=\"left-out\">sky, left out</span></p>"
    )
}

/// Thumbnails of every error map; empty without any.
fn error_maps(part: &Part) -> String {
    let thumbnails: String = part
        .group
        .rows
        .iter()
        .filter_map(|&(index, row)| {
            let headlines = Metric::ranked().into_iter().filter(|metric| metric.headline);
            let value = |metric: &Metric| Some(format!("{} {}", metric.title, number(row.errors.get(metric.id)?, 3)));
            let error = headlines.filter_map(value).collect::<Vec<_>>().join(" · ");
            Some(format!(
                "<button type=\"button\" class=\"thumbnail\" data-row=\"{index}\"><img src=\"{}\" alt=\"Error map of row {}\" \
                 loading=\"lazy\" width=\"{}\" height=\"{}\"><span>#{} {}</span><span class=\"value\">{error}</span></button>",
                escape(row.image("error")?),
                index + 1,
                row.width,
                row.height,
                index + 1,
                escape(&part.group.label(row))
            ))
        })
        .collect();
    if thumbnails.is_empty() {
        return String::new();
    }
    format!("<h3>Error maps</h3>{}<div class=\"thumbnails\">{thumbnails}</div>", scale("scale"))
}

/// What the slider needs to know about a group: its choices, truths first, and which two to show at first.
fn picture_data(part: &Part) -> Value {
    let rows = &part.group.rows;
    let mut truths: Vec<(usize, [Option<&str>; 3])> = Vec::new();
    for &(index, row) in rows {
        let pictures = ["truth_final", "truth_indirect", "truth_exr"].map(|kind| row.image(kind));
        if !truths.iter().any(|truth| truth.1 == pictures) && pictures.iter().any(Option::is_some) {
            truths.push((index, pictures));
        }
    }
    let several = truths.len() > 1;
    let truth = |&(index, [shown, indirect, exr]): &(usize, [Option<&str>; 3])| {
        let name = if several { format!("truth of #{}", index + 1) } else { "path-traced truth".into() };
        json!({"label": name, "images": {"final": shown, "indirect": indirect, "exr": exr}})
    };
    let cell = |&(index, row): &(usize, &crate::measurement::Measurement)| {
        let pictures = ["final", "indirect", "error", "exr"].map(|kind| (kind, row.image(kind)));
        json!({
            "label": format!("#{} {}", index + 1, part.group.label(row)),
            "row": index,
            "images": pictures.into_iter().collect::<std::collections::BTreeMap<_, _>>(),
        })
    };
    let best = rows
        .iter()
        .filter_map(|&(index, row)| {
            let error = |id| row.errors.get(id);
            Some((error(MetricId::FinalFlip).or(error(MetricId::IndirectRelMse))?, index))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .or(rows.last().map(|&(index, _)| (0.0, index)));
    json!({
        "choices": truths.iter().map(truth).chain(rows.iter().map(cell)).collect::<Vec<_>>(),
        "start": best.map(|(_, index)| index),
    })
}

/// The colour map as a CSS gradient.
fn magma_gradient() -> String {
    let stops = (0..=16).map(|step| {
        let [r, g, b] = colour_map()[(step * 255) / 16];
        format!("rgb({r} {g} {b})")
    });
    format!("linear-gradient(90deg,{})", stops.collect::<Vec<_>>().join(","))
}
