//! Pieces of HTML pages.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::{
    chart::STYLE as CHART_STYLE,
    table::{Cell, Column, Kind, Table, TableRow},
};

/// A page with the style of a report; `style` is added to it. Everything but pictures is inside the file.
pub fn page(title: &str, style: &str, body: &Markup) -> String {
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(CHART_STYLE)) (PreEscaped(include_str!("page.css"))) (PreEscaped(style)) }
            }
            body { (body) }
        }
    };
    markup.into_string() + "\n"
}

/// A chart in its frame.
pub fn figure(svg: &str) -> Markup {
    html! { div class="plot" { (PreEscaped(svg)) } }
}

/// A heading with a caption, which may be empty.
pub fn heading(title: &str, caption: &str) -> Markup {
    html! {
        h3 { (title) }
        @if !caption.is_empty() { p class="caption" { (caption) } }
    }
}

/// A table under its heading and caption.
pub fn table(table: &Table) -> Markup {
    html! { (heading(&table.title, &table.caption)) (rows(table, "scroll")) }
}

/// A table without heading and caption, in a frame of this class.
pub fn rows(table: &Table, class: &str) -> Markup {
    html! {
        div class=(class) {
            table {
                thead { tr { @for column in &table.columns { (head(column)) } } }
                tbody {
                    @for TableRow { row, cells } in &table.rows {
                        tr data-row=[row] {
                            @for (shown, column) in cells.iter().zip(&table.columns) { (cell(shown, column.kind)) }
                        }
                    }
                }
            }
        }
    }
}

fn head(Column { name, unit, meaning, kind }: &Column) -> Markup {
    let class = (*kind == Kind::Number).then_some("number");
    let meaning = Some(meaning).filter(|meaning| !meaning.is_empty());
    html! {
        th scope="col" class=[class] {
            button type="button" title=[meaning] {
                (name)
                @if !unit.is_empty() { span class="unit" { (unit) } }
            }
        }
    }
}

fn cell(Cell { text, value, best }: &Cell, kind: Kind) -> Markup {
    let class = match (kind, best) {
        (Kind::Number, true) => Some("number best"),
        (Kind::Number, false) => Some("number"),
        _ => None,
    };
    html! {
        td class=[class] data-value=[value] {
            @if kind == Kind::Code { (code(text)) } @else { (text) }
        }
    }
}

/// A command with a button that copies it; empty for no command.
pub fn code(command: &str) -> Markup {
    html! {
        @if !command.is_empty() {
            code { (command) }
            button type="button" class="copy" { "copy" }
        }
    }
}

/// Names of facts that are commands to copy.
pub const COMMANDS: [&str; 2] = ["Command", "Reference"];

/// A list of facts: name and value.
pub fn facts(facts: &[(&'static str, String)]) -> Markup {
    html! {
        dl class="facts" {
            @for (name, value) in facts {
                @if COMMANDS.contains(name) {
                    div class="wide" { dt { (name) } dd { (code(value)) } }
                } @else {
                    div { dt { (name) } dd { (value) } }
                }
            }
        }
    }
}
