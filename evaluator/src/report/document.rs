//! Pieces of documents: tables, charts, HTML and Markdown. They know nothing of measurements.

pub mod chart;
pub mod html;
pub mod markdown;
pub mod simple_page;
pub mod table;

/// Text for the content or a quoted attribute of an SVG element.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
