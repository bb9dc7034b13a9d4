//! Tables of papers, to hold measurements against.
//!
//! Papers' times come from their own hardware, so they are compared by ratio: each row against the first row of its
//! table.

use halflight_techniques::invocation::parse_size;

use crate::measurement::{Measurement, plain};

mod data;

pub use data::TABLES;

/// A paper's table of times.
pub struct PublishedTable {
    /// `preset` of the rows that it belongs to.
    pub preset: &'static str,
    /// Where the figures come from.
    pub source: &'static str,
    /// How the paper's settings differ from what a row can say.
    pub remarks: &'static str,
    /// Where the table has several resolutions (a column `resolution`): how many times narrower and lower the images here
    /// may be.
    pub divisor: Option<u32>,
    /// The paper's steps and the passes here that do their work: those that carry one of the names, alone or numbered.
    pub steps: &'static [(&'static str, &'static [&'static str])],
    /// What the paper concludes from its table.
    pub claims: &'static [Claim],
    /// What the paper says about one pass within a step, where it does.
    pub share: Option<Share>,
    /// Parameters, `gpu`, and one `<step>_ms` column per step and for their `total`; the figures only. A step or a
    /// parameter that a configuration does not have is empty.
    csv: &'static str,
}

/// A statement about two configurations of a table: their times in one step have a certain ratio.
pub struct Claim {
    /// In words.
    pub name: &'static str,
    /// A step, or `total`.
    pub step: &'static str,
    /// The configuration whose time is divided, by its index among the table's distinct configurations.
    pub of: usize,
    /// The configuration that it is divided by.
    pub over: usize,
    /// The step whose time divides; mostly the same one.
    pub over_step: &'static str,
}

/// A statement about the share of a pass in its step, on the paper's first GPU.
pub struct Share {
    /// In words.
    pub name: &'static str,
    /// The step.
    pub step: &'static str,
    /// The pass here.
    pub pass: &'static str,
    /// The configuration, by its index among the table's distinct configurations.
    pub of: usize,
    /// The paper's words.
    pub published: &'static str,
}

/// One row of a published table: the same configuration on one GPU of the paper.
pub struct PublishedRow {
    /// Width and height, where the table has several.
    pub resolution: Option<[u32; 2]>,
    /// Parameter and value, as text.
    pub parameters: Vec<(String, String)>,
    /// The paper's GPU.
    pub gpu: String,
    /// Step and time, ms.
    pub steps: Vec<(String, f64)>,
}

impl PublishedTable {
    /// The table for a preset.
    pub fn of(preset: &str) -> Option<&'static Self> {
        TABLES.iter().find(|table| table.preset == preset)
    }

    /// The rows, in the paper's order.
    ///
    /// # Panics
    /// If the table in the repository is broken; a test reads them all.
    pub fn rows(&self) -> Vec<PublishedRow> {
        let mut table = csv::Reader::from_reader(self.csv.as_bytes());
        let head = table.headers().expect("a published table has a head").clone();
        table
            .records()
            .map(|record| {
                let record = record.expect("a published table is rectangular");
                let mut row = PublishedRow { resolution: None, parameters: vec![], gpu: String::new(), steps: vec![] };
                for (column, value) in head.iter().zip(&record) {
                    match column.strip_suffix("_ms") {
                        // A step that this configuration does not have.
                        Some(_) if value.is_empty() => {}
                        Some(step) => row.steps.push((step.into(), value.parse().expect("a time is a number"))),
                        None if column == "gpu" => row.gpu = value.into(),
                        None if column == "resolution" => row.resolution = parse_size(value).ok(),
                        None if value.is_empty() => {}
                        None => row.parameters.push((column.into(), value.into())),
                    }
                }
                row
            })
            .collect()
    }
}

impl PublishedRow {
    /// What tells the row from others of its table.
    pub fn configuration(&self) -> (Option<[u32; 2]>, &[(String, String)]) {
        (self.resolution, &self.parameters)
    }

    /// Whether a measured row has these settings, at this resolution or, where the table allows for a `divisor`, at that
    /// part of it.
    pub fn matches(&self, row: &Measurement, divisor: Option<u32>) -> bool {
        let fits = self.resolution.is_none_or(|size| size.map(|v| v / divisor.unwrap_or(1)) == [row.width, row.height]);
        let set = |(name, value): &(String, String)| row.parameters.get(name).is_some_and(|own| plain(own) == *value);
        fits && self.parameters.iter().all(set)
    }

    /// A step's time, ms.
    pub fn step(&self, name: &str) -> Option<f64> {
        self.steps.iter().find(|(step, _)| step == name).map(|(_, time)| *time)
    }
}

impl PublishedTable {
    /// What a measured row spent on a step, ms; `total` is the sum of the steps. None where no pass did such work.
    pub fn measured(&self, row: &Measurement, step: &str) -> Option<f64> {
        let names =
            self.steps.iter().filter(|(name, _)| step == "total" || *name == step).flat_map(|(_, passes)| *passes);
        let times: Vec<f64> = names.flat_map(|name| passes(row, name)).map(|(_, time)| time).collect();
        (!times.is_empty()).then(|| times.iter().sum())
    }
}

/// The passes of a row that carry a name, alone or numbered (`gather`, `gather_0`), with their time, ms. Another pass is not
/// the paper's step: `gather_sky` takes the light of a sky, which no paper here gathers apart.
pub fn passes<'a>(row: &'a Measurement, name: &'a str) -> impl Iterator<Item = (&'a str, f64)> {
    row.pass_ms.iter().filter_map(move |(pass, time)| {
        let rest = pass.strip_prefix(name)?;
        let is_own = rest.is_empty() || rest.strip_prefix('_')?.bytes().all(|byte| byte.is_ascii_digit());
        is_own.then_some((pass.as_str(), time.as_f64()?))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn tables_are_whole() {
        for table in &TABLES {
            let rows = table.rows();
            assert!(rows.len() >= 2, "{}", table.preset);
            for row in rows {
                let parts: f64 = row.steps.iter().filter(|(step, _)| step != "total").map(|(_, time)| time).sum();
                let total = row.step("total").unwrap_or(f64::NAN);
                // Printed to a tenth of a millisecond, three steps. The totals of 2010 with visibility are rounder than
                // that: one is 2.2 ms under the sum of its steps.
                let printed = if table.preset == "soler2010_fig9" { 0.018 * total } else { 0.0 };
                assert!((parts - total).abs() < 0.15 + printed, "{} {parts}", table.preset);
            }
        }
    }

    #[test]
    fn steps_find_their_passes() {
        let pass_ms = json!({
            "pyramid_2": 9.0, "gather_0": 4.0, "gather_1": 1.0, "gathering": 9.0, "gather_sky": 9.0, "upsample": 2.0,
            "combine_0": 1.0
        });
        let row = Measurement { pass_ms: pass_ms.as_object().cloned().unwrap_or_default(), ..Measurement::default() };
        let step = |name| TABLES[0].measured(&row, name);
        assert_eq!((step("gather"), step("combine"), step("composite")), (Some(5.0), Some(3.0), None));
        assert_eq!(step("total"), Some(8.0));
    }
}
