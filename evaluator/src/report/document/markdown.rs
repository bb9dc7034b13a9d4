//! Tables as Markdown.

use std::fmt::Write as _;

use super::table::{Cell, Column, Kind, Table};

/// A table as GitHub-flavoured Markdown under a heading of `level`.
pub fn table(table: &Table, level: usize) -> String {
    let mut text = format!("{} {}\n\n", "#".repeat(level), table.title);
    if !table.caption.is_empty() {
        text += &format!("{}\n\n", table.caption);
    }
    let head = |column: &Column| match column.unit.as_str() {
        "" => cell(&column.name),
        unit => format!("{} [{unit}]", cell(&column.name)),
    };
    // Writing to a String cannot fail.
    let _ = writeln!(text, "| {} |", table.columns.iter().map(head).collect::<Vec<_>>().join(" | "));
    let rules = table.columns.iter().map(|column| if column.kind == Kind::Number { "---:" } else { ":---" });
    let _ = writeln!(text, "| {} |", rules.collect::<Vec<_>>().join(" | "));
    for row in &table.rows {
        let cells = row.cells.iter().zip(&table.columns).map(|(Cell { text, best, .. }, column)| match column.kind {
            Kind::Code if !text.is_empty() => format!("`{}`", cell(text)),
            _ if *best => format!("**{}**", cell(text)),
            _ => cell(text),
        });
        let _ = writeln!(text, "| {} |", cells.collect::<Vec<_>>().join(" | "));
    }
    text.push('\n');
    text
}

/// Text that cannot end a cell or a row.
fn cell(text: &str) -> String {
    text.replace('|', "\\|").replace('\n', " ")
}
