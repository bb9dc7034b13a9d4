//! index.html: one file with everything but the pictures in it, which it names by relative path.

use halflight_metrics::{Metric, MetricId, colour_map};
use maud::{Markup, PreEscaped, html};
use serde_json::{Value, json};

use super::{
    FULL_SCALE, Part, Report,
    document::html::{COMMANDS, code, figure, heading, page, rows, table},
    slice::Slice,
    strip::{self, Strip},
    trade::{self, Trade},
};
use crate::format::number;

const SCRIPT: &str = include_str!("page.js");

/// The mark of the project: a disc, half of it filled.
const MARK: &str = "<svg viewBox=\"0 0 20 20\" width=\"20\" height=\"20\" aria-hidden=\"true\"><circle cx=\"10\" \
                    cy=\"10\" r=\"8.5\" fill=\"none\" stroke=\"currentColor\" stroke-width=\"1.5\"/><path \
                    d=\"M10 1.5a8.5 8.5 0 0 1 0 17z\" fill=\"currentColor\"/></svg>";

/// The whole page.
pub fn report_page(report: &Report, parts: &[Part]) -> String {
    let data: Vec<Value> = parts.iter().map(picture_data).collect();
    // "</script>" inside a text would end the element that holds the data.
    let data = Value::from(data).to_string().replace("</", "<\\/");
    let answers = parts.iter().any(|part| part.answer.is_some());
    let body = html! {
        header {
            p class="brand" { (PreEscaped(MARK)) "Halflight report" }
            h1 { (report.title) }
            p class="summary" { (report.summary) }
            @if !answers { (facts(report)) }
            (contents(report, parts, answers))
        }
        main {
            @if !answers { (warnings(report)) }
            @for (index, part) in parts.iter().enumerate() { (section(index, part)) }
            // A page that answers a question begins with the answer.
            @if answers {
                section class="group" id="measured" {
                    h2 { "How this was measured" }
                    (warnings(report))
                    (facts(report))
                }
            }
        }
        footer {
            p {
                "The same numbers: " a href="results.csv" { "results.csv" } ", " a href="results.json" { "results.json" } ", "
                a href="tables.md" { "tables.md" } ". Plots as files: " a href="plots/" { "plots/" } ". Pictures: "
                a href="images/" { "images/" } "."
            }
        }
        div id="tip" role="status" hidden {}
        script type="application/json" id="data" { (PreEscaped(data)) }
        script { (PreEscaped(SCRIPT)) }
    };
    page(&report.title, &format!(".magma{{background:{}}}", magma_gradient()), &body)
}

fn facts(report: &Report) -> Markup {
    let badge = |value: &str| value.split("(software)").map(str::to_owned).collect::<Vec<_>>();
    html! {
        dl class="facts" {
            @for (name, value) in report.facts() {
                @if COMMANDS.contains(&name) {
                    div class="wide" { dt { (name) } dd { (code(&value)) } }
                } @else {
                    div {
                        dt { (name) }
                        dd {
                            @for (index, text) in badge(&value).iter().enumerate() {
                                @if index > 0 { (software()) }
                                (text)
                            }
                        }
                    }
                }
            }
        }
    }
}

fn software() -> Markup {
    html! { span class="badge" { "software" } }
}

fn warnings(report: &Report) -> Markup {
    let warnings = report.all_warnings();
    html! {
        @if !warnings.is_empty() {
            section class="warnings" id="warnings" {
                h2 { "Warnings" }
                ul { @for warning in &warnings { li { (warning) } } }
            }
        }
    }
}

fn contents(report: &Report, parts: &[Part], answers: bool) -> Markup {
    let warnings = report.all_warnings().len();
    html! {
        @if parts.len() > 1 || answers {
            nav {
                @for (index, part) in parts.iter().enumerate() {
                    a href=(format!("#group-{index}")) { (part.group.title()) }
                }
                @if answers {
                    a href="#measured" {
                        "How this was measured"
                        @if warnings > 0 { " (" (warnings) @if warnings == 1 { " warning)" } @else { " warnings)" } }
                    }
                }
            }
        }
    }
}

/// Longest list of shared settings that is shown open, bytes: four lines or so.
const SETTINGS_SHOWN: usize = 570;

fn section(index: usize, part: &Part) -> Markup {
    let row = part.group.first();
    let settings = part.settings();
    let shared = html! { p class="settings" { (settings) } };
    html! {
        section class="group" id=(format!("group-{index}")) data-group=(index) {
            h2 { (part.group.title()) }
            // With many techniques they fill half a page, which nobody reads before the plot.
            @if settings.len() <= SETTINGS_SHOWN {
                (shared)
            } @else {
                details { summary { "Settings that all rows share" } (shared) }
            }
            p class="settings" {
                (row.adapter) " · " (row.backend)
                @if row.software_adapter { " " (software()) }
            }
            (answer(part))
            (slice(part))
            (strips(part))
            (figures(part))
            (trades(part))
            (compare(part))
            (error_maps(part))
            @if !part.error_over_samples.is_empty() {
                (heading(
                    "Error over samples",
                    "Where a line is flat, noise is gone and bias is left: more samples no longer help.",
                ))
                (choices(part.error_over_samples.iter().map(|plot| (plot.choice, figure(&plot.drawing.inline())))))
            }
            @if let (Some(plot), Some(passes)) = (&part.cost_per_pass, &part.passes) {
                (heading(&passes.title, &passes.caption))
                (figure(&plot.drawing.inline()))
                details { summary { "As a table" } (rows(passes, "scroll")) }
            }
            // The widest table may use the whole window.
            (heading(&part.results.title, &part.results.caption))
            (rows(&part.results, "scroll wide"))
            @for extra in part.temporal.iter().chain(&part.published) { (table(extra)) }
            @if let Some(commands) = &part.commands {
                details {
                    summary { "Commands that reproduce each row" }
                    p class="caption" { (commands.caption) }
                    (rows(commands, "scroll"))
                }
            }
        }
    }
}

/// The best settings for some times, with their pictures.
fn answer(part: &Part) -> Markup {
    let Some(answer) = &part.answer else { return Markup::default() };
    html! {
        (heading(&answer.table.title, &answer.table.caption))
        @if !answer.table.rows.is_empty() { (rows(&answer.table, "scroll")) }
        (shown_beside(part, &answer.pictures, if answer.pictures.len() == 4 { "strip two" } else { "strip three" }))
        (figure(&answer.plot.drawing.inline()))
    }
}

/// What each millisecond buys, one metric at a time.
fn trades(part: &Part) -> Markup {
    let panel = |Trade { plot, table, .. }: &Trade| {
        (plot.choice, html! { (figure(&plot.drawing.inline())) (rows(table, "scroll")) })
    };
    html! {
        @if !part.trades.is_empty() {
            @let frames = if part.group.has_several_frames() { trade::CAPTION_FRAMES } else { "" };
            (heading("What each millisecond buys", &format!("{}{frames}", trade::CAPTION)))
            (choices(part.trades.iter().map(panel)))
            @if let Some(remark) = &part.remark { p class="remark" { (remark) } }
        }
    }
}

/// Panels of which one is shown, with buttons above to choose it. A choice applies to all panels of the page.
fn choices(panels: impl Iterator<Item = (&'static str, Markup)>) -> Markup {
    let panels: Vec<_> = panels.collect();
    html! {
        div class="choices" {
            div class="segmented" role="group" aria-label="Error metric" {
                @for (index, (name, _)) in panels.iter().enumerate() {
                    button type="button" aria-pressed=(index == 0) { (name) }
                }
            }
            @for (index, (name, panel)) in panels.iter().enumerate() {
                div class="choice" data-choice=(name) hidden[index > 0] { (panel) }
            }
        }
    }
}

/// Equation 3 against Equation 4; empty for other presets.
fn slice(part: &Part) -> Markup {
    let Some(Slice { pictures, size: [width, height], line, plot, table, caption }) = &part.slice else {
        return Markup::default();
    };
    let at = 100.0 * (*line as f64 + 0.5) / f64::from(*height);
    html! {
        (heading(&table.title, caption))
        div class="strip three" {
            @for (title, path) in pictures {
                figure {
                    a href=(path) {
                        img src=(path) alt=(title) width=(width) height=(height);
                        i class="cut" style=(format!("top:{at:.2}%")) {}
                    }
                    figcaption { (title) }
                }
            }
        }
        (figure(&plot.drawing.inline()))
        p class="caption" { (table.caption) }
        (rows(table, "scroll"))
    }
}

/// One picture a level; empty where rows do not differ in the level that they gather.
fn strips(part: &Part) -> Markup {
    let caption = "Indirect light (albedo · indirect) of each level alone under one exposure: a level adds the light of its own ring, \
                   and a coarser one reaches twice as far.";
    side_by_side(part, &strip::strips(part.group), "strip", &heading("Level by level", caption))
}

/// The pictures of a paper's figure; empty for other presets.
fn figures(part: &Part) -> Markup {
    let caption = "Under one exposure, with the error against the first picture: RMSE and bias of a single frame, and the \
                   deviation from frame to frame. A click on a picture chooses its row everywhere.";
    side_by_side(part, &strip::figures(part.group), "strip large", &heading("Side by side", caption))
}

fn side_by_side(part: &Part, strips: &[Strip], class: &str, heading: &Markup) -> Markup {
    html! {
        @if !strips.is_empty() {
            (heading)
            @for Strip { name, pictures } in strips {
                @if !name.is_empty() { p class="caption" { (name) } }
                (shown_beside(part, pictures, class))
            }
        }
    }
}

/// Pictures with their titles; a click on one chooses its row.
fn shown_beside<P: AsRef<str>>(part: &Part, pictures: &[(Option<usize>, String, P)], class: &str) -> Markup {
    let [width, height] = [part.group.first().width, part.group.first().height];
    html! {
        div class=(class) {
            @for (row, title, path) in pictures {
                figure data-row=[row] {
                    img src=(path.as_ref()) alt=(title) width=(width) height=(height);
                    figcaption { (title) }
                }
            }
        }
    }
}

/// The slider between two pictures; empty when no row has pictures.
fn compare(part: &Part) -> Markup {
    let row = part.group.first();
    if part.group.rows.iter().all(|(_, row)| row.images.is_empty()) {
        return Markup::default();
    }
    html! {
        (heading(
            "Pictures",
            "Drag the divider, or focus the picture: ← → move it, ↑ ↓ change the right configuration, X swaps the sides. \
             Choosing a point in a plot or a row in a table shows it on the right. Pictures of one kind share an exposure.",
        ))
        div class="compare" {
            div class="controls" {
                label { "Left " select class="left" {} }
                button type="button" class="swap" title="Swap sides (X)" aria-label="Swap sides" { "⇄" }
                label { "Right " select class="right" {} }
                div class="segmented kinds" role="group" aria-label="Picture" {}
                div class="segmented zooms" role="group" aria-label="Zoom" {}
            }
            div class="frame" {
                div class="viewport" {
                    div class="stage" tabindex="0" role="slider" aria-label="Divider between the two pictures"
                        aria-valuemin="0" aria-valuemax="100" aria-valuenow="50"
                        style=(format!("aspect-ratio:{}/{};--width:{}px", row.width, row.height, row.width)) {
                        img class="under" alt="" draggable="false";
                        img class="over" alt="" draggable="false";
                        div class="divider" {}
                    }
                }
                span class="tag tag-left" {}
                span class="tag tag-right" {}
            }
            (scale("scale of-kind"))
            p class="files" { "Linear, as EXR: " a class="exr-left" {} " " a class="exr-right" {} }
            noscript { "The pictures are in the folder images/." }
        }
    }
}

fn scale(class: &str) -> Markup {
    html! {
        p class=(class) {
            span { "relative error of albedo · indirect" }
            span { "0" }
            i class="magma" {}
            span { (number(100.0 * f64::from(FULL_SCALE), 3)) " % and more" }
            span class="left-out" { "sky, left out" }
        }
    }
}

/// Thumbnails of every error map; empty without any.
fn error_maps(part: &Part) -> Markup {
    let maps: Vec<_> = part.shown.iter().filter_map(|&(index, row)| Some((index, row, row.image("error")?))).collect();
    let headlines: Vec<&Metric> = Metric::ranked().into_iter().filter(|metric| metric.headline).collect();
    html! {
        @if !maps.is_empty() {
            h3 { "Error maps" }
            @if part.is_partial() {
                p class="caption" { "Of the rows on a frontier. A click on any row of the tables shows its pictures above." }
            }
            (scale("scale"))
            div class="thumbnails" {
                @for &(index, row, path) in &maps {
                    @let name = format!("#{} {}", index + 1, part.group.label(row));
                    @let values = headlines.iter().filter_map(|metric| {
                        Some(format!("{} {}", metric.title, number(row.errors.get(metric.id)?, 3)))
                    });
                    button type="button" class="thumbnail" data-row=(index) {
                        img src=(path) alt=(format!("Error map of row {}", index + 1)) loading="lazy" width=(row.width) height=(row.height);
                        span { (name) }
                        span class="value" { (values.collect::<Vec<_>>().join(" · ")) }
                    }
                }
            }
        }
    }
}

/// What the slider needs to know about a group: its choices, references first, and which two to show at first.
fn picture_data(part: &Part) -> Value {
    let rows = &part.group.rows;
    let mut references: Vec<(usize, [Option<&str>; 3])> = Vec::new();
    for &(index, row) in rows {
        let pictures = ["truth_final", "truth_indirect", "truth_exr"].map(|kind| row.image(kind));
        if !references.iter().any(|reference| reference.1 == pictures) && pictures.iter().any(Option::is_some) {
            references.push((index, pictures));
        }
    }
    let several = references.len() > 1;
    let reference = |&(index, [shown, indirect, exr]): &(usize, [Option<&str>; 3])| {
        let name = if several { format!("reference of #{}", index + 1) } else { "path-traced reference".into() };
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
        "choices": references.iter().map(reference).chain(rows.iter().map(cell)).collect::<Vec<_>>(),
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
