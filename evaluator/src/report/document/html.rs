//! Pieces of HTML pages.

use std::collections::HashMap;

use maud::{DOCTYPE, Markup, PreEscaped, html};
use serde_json::{Value, json};

use super::{
    chart::STYLE as CHART_STYLE,
    table::{Cell, Column, Kind, Table, TableRow},
};
use crate::format::count;

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

/// Rows up to which a table is written as such. A longer one is data, of which the page makes the rows that are in view.
const LONG: usize = 400;

/// A table without heading and caption, in a frame of this class.
pub fn rows(table: &Table, class: &str) -> Markup {
    if table.rows.len() > LONG {
        return long_table(table, class);
    }
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

/// A table whose rows the page makes, with a field to filter them.
fn long_table(table: &Table, class: &str) -> Markup {
    let columns: Vec<Value> =
        table.columns.iter().enumerate().map(|(index, head)| column(table, index, head)).collect();
    let rows: Vec<Option<usize>> = table.rows.iter().map(|row| row.row).collect();
    // "</script>" inside a text would end the element that holds the data.
    let data = json!({ "columns": columns, "rows": rows }).to_string().replace("</", "<\\/");
    html! {
        div class="long" {
            p class="controls" {
                input type="search" placeholder="Filter: quarter  samples=64  time<5" aria-label="Filter rows"
                    title="Words that a row must contain, or a column with =, <, > and a value; all must hold" size="44";
                span class="count" { (count(table.rows.len() as u64)) " rows" }
            }
            div class=(format!("{class} window")) {
                table {
                    thead { tr { @for column in &table.columns { (head(column)) } } }
                    tbody {}
                }
            }
            noscript { "The rows are in results.csv." }
            script type="application/json" { (PreEscaped(data)) }
        }
    }
}

/// The cells of a column: texts as indices into the distinct ones where few are, and values where a text does not say all.
fn column(table: &Table, index: usize, head: &Column) -> Value {
    let cells = || table.rows.iter().map(|row| &row.cells[index]);
    let mut known: HashMap<&str, usize> = HashMap::new();
    let mut distinct = Vec::new();
    let indices: Vec<usize> = cells()
        .map(|cell| {
            *known.entry(&cell.text).or_insert_with(|| {
                distinct.push(cell.text.as_str());
                distinct.len() - 1
            })
        })
        .collect();
    // Seven digits sort as well as seventeen.
    let value = |cell: &Cell| cell.value.map_or(Value::Null, |value| json!(value as f32));
    let says_all = |cell: &Cell| cell.value.is_none_or(|value| cell.text.parse() == Ok(value));
    let values = (head.kind == Kind::Number && !cells().all(says_all)).then(|| cells().map(value).collect::<Vec<_>>());
    let best: Vec<usize> = cells().enumerate().filter(|(_, cell)| cell.best).map(|(row, _)| row).collect();
    let few = distinct.len() * 4 < indices.len();
    json!({
        "name": head.name,
        "number": head.kind == Kind::Number,
        "code": head.kind == Kind::Code,
        "texts": if few { json!(distinct) } else { json!(cells().map(|cell| &cell.text).collect::<Vec<_>>()) },
        "of": few.then_some(indices),
        "values": values,
        "best": best,
    })
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
