//! A page in the style of a report, without its comparisons: facts, a chart, tables and a row of pictures.

use super::{
    chart::{Drawing, STYLE as CHART_STYLE},
    escape, html,
    tables::Table,
};

/// What the page says.
pub struct SimplePage<'a> {
    /// Heading.
    pub title: &'a str,
    /// Under the heading.
    pub summary: &'a str,
    /// Name and value.
    pub facts: &'a [(&'static str, String)],
    /// Above the tables.
    pub chart: &'a Drawing,
    /// In this order.
    pub tables: &'a [Table],
    /// Above the pictures.
    pub pictures_note: &'a str,
    /// Name and path relative to the page.
    pub pictures: &'a [(String, String)],
}

const LAYOUT: &str = ".pictures{display:grid;grid-template-columns:repeat(auto-fill,minmax(19rem,1fr));gap:1rem}\
                      .pictures figure{margin:0}.pictures img{width:100%;height:auto;display:block;border-radius:4px}";

impl SimplePage<'_> {
    /// One file; pictures are named by relative path.
    pub fn html(&self) -> String {
        let facts: String = self
            .facts
            .iter()
            .map(|(name, value)| format!("<div><dt>{}</dt><dd>{}</dd></div>", escape(name), escape(value)))
            .collect();
        let pictures: String = self
            .pictures
            .iter()
            .map(|(name, path)| {
                let (name, path) = (escape(name), escape(path));
                format!("<figure><a href=\"{path}\"><img src=\"{path}\" alt=\"{name}\"></a><figcaption>{name}</figcaption></figure>")
            })
            .collect();
        format!(
            "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\">\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
             <meta name=\"color-scheme\" content=\"light dark\"><title>{title}</title>\
             <style>{CHART_STYLE}{}{LAYOUT}</style></head><body><header><h1>{title}</h1><p class=\"summary\">{}</p>\
             <dl class=\"facts\">{facts}</dl></header><main><section>{}{}{}<div class=\"pictures\">{pictures}</div>\
             </section></main></body></html>\n",
            html::STYLE,
            escape(self.summary),
            html::figure(&self.chart.inline()),
            self.tables.iter().map(html::table).collect::<String>(),
            html::heading("Pictures", self.pictures_note),
            title = escape(self.title),
        )
    }
}
