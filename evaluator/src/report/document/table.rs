//! A table as data: printed as Markdown and as HTML by the modules beside this one.

use crate::format::number;

/// A table with units in its heads.
#[derive(Debug)]
pub struct Table {
    /// Heading.
    pub title: String,
    /// One or two sentences on what it shows.
    pub caption: String,
    /// Heads.
    pub columns: Vec<Column>,
    /// As many cells a row as there are columns.
    pub rows: Vec<TableRow>,
}

/// A column's head.
#[derive(Debug)]
pub struct Column {
    /// What it holds.
    pub name: String,
    /// Unit; empty for none.
    pub unit: String,
    /// One sentence for a reader who sees it first; may be empty.
    pub meaning: String,
    /// What its cells are.
    pub kind: Kind,
}

/// What a column's cells are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Words.
    Text,
    /// Numbers: set right, sorted by size.
    Number,
    /// A command to copy.
    Code,
}

/// A row.
#[derive(Debug)]
pub struct TableRow {
    /// Index of the result that it shows, where it shows one.
    pub row: Option<usize>,
    /// Cells, by column.
    pub cells: Vec<Cell>,
}

/// A cell.
#[derive(Debug, Default)]
pub struct Cell {
    /// As printed; empty = no value.
    pub text: String,
    /// What a numeric column sorts by.
    pub value: Option<f64>,
    /// The best value of its column.
    pub best: bool,
}

impl Column {
    /// A column of words.
    pub fn text(name: impl Into<String>) -> Self {
        Self { name: name.into(), unit: String::new(), meaning: String::new(), kind: Kind::Text }
    }

    /// A column of numbers.
    pub fn numeric(name: impl Into<String>, unit: &str, meaning: &str) -> Self {
        Self { name: name.into(), unit: unit.into(), meaning: meaning.into(), kind: Kind::Number }
    }
}

impl Cell {
    /// Words.
    pub fn text(text: impl Into<String>) -> Self {
        Self { text: text.into(), ..Self::default() }
    }

    /// A number with so many significant digits; empty without a value.
    pub fn number(value: Option<f64>, digits: usize) -> Self {
        Self { text: value.map_or(String::new(), |value| number(value, digits)), value, best: false }
    }

    /// A whole number, in full.
    pub fn count(value: u32) -> Self {
        Self { text: value.to_string(), value: Some(value.into()), best: false }
    }

    /// The number of a row, counted from 1, of this index.
    pub fn row(index: usize) -> Self {
        Self { text: (index + 1).to_string(), value: Some(index as f64), best: false }
    }
}
