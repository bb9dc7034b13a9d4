//! A page in the style of a report, without its comparisons: facts, a chart, tables and a row of pictures.

use maud::html;

use super::{chart::Drawing, html, table::Table};

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
        let body = html! {
            header {
                h1 { (self.title) }
                p class="summary" { (self.summary) }
                (html::facts(self.facts))
            }
            main {
                section {
                    (html::figure(&self.chart.inline()))
                    @for table in self.tables { (html::table(table)) }
                    (html::heading("Pictures", self.pictures_note))
                    div class="pictures" {
                        @for (name, path) in self.pictures {
                            figure {
                                a href=(path) { img src=(path) alt=(name); }
                                figcaption { (name) }
                            }
                        }
                    }
                }
            }
        };
        html::page(self.title, LAYOUT, &body)
    }
}
