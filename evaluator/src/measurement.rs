//! One measured cell of a grid: all that a report reads.
//!
//! A [`Measurement`] serialises to one flat object whose keys are the columns of results.csv, so that results.json and
//! results.csv hold the same table.

pub mod temporal;

use std::io::Write as _;
use std::path::Path;

use halflight_metrics::{Values, percentile};
use halflight_native::files::write_whole;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

use self::temporal::Temporal;
use crate::Error;

/// One row of results.csv.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// Name of the scene.
    pub scene: String,
    /// Name of the camera.
    pub camera: String,
    /// Width of the frame, pixels.
    pub width: u32,
    /// Height of the frame, pixels.
    pub height: u32,
    /// Name of the technique.
    pub technique: String,
    /// Settings in the order of their declaration, one column each, keyed `technique.parameter`.
    #[serde(flatten, with = "parameter_columns")]
    pub parameters: Map<String, Value>,
    /// Sources in the scene whose light the technique leaves out, separated by commas; empty for none.
    #[serde(default)]
    pub left_out: String,
    /// Part of the report that shows the row; empty for the first.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub section: String,
    /// What moves before the measured frame: `camera` or `lights`; empty for nothing.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub moving: String,
    /// Number of the frame that is shown and measured, counted from 1; `None` where all frames are alike.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub at_frame: Option<u32>,
    /// Timed frames after warm-up.
    pub frames: u32,
    /// Every pass that the technique needs beyond G-buffer and direct light: median over the frames, ms.
    pub time_ms_median: f64,
    /// The same, fastest frame, ms.
    pub time_ms_min: f64,
    /// The same, 95th percentile, ms.
    pub time_ms_p95: f64,
    /// The same where only the frame number has changed: median, ms.
    #[serde(default)]
    pub time_ms_static: Option<f64>,
    /// Passes that run once, in the first frame, ms; empty if there are none.
    #[serde(default)]
    pub first_frame_ms: Option<f64>,
    /// Everything in the frame: median, ms.
    pub frame_ms_median: f64,
    /// The same where only the frame number has changed: median, ms.
    #[serde(default)]
    pub frame_ms_static: Option<f64>,
    /// Median per pass, those of the scene included, ms, in frame order; key `gather` is the column `pass_gather_ms`.
    #[serde(flatten, with = "pass_columns")]
    pub pass_ms: Map<String, Value>,
    /// Textures and buffers that the technique writes, bytes.
    pub memory_bytes: u64,
    /// All textures and buffers of the frame's plan, G-buffer and direct light included, bytes.
    #[serde(default)]
    pub frame_bytes: u64,
    /// Buffers of the scene: geometry, materials, lights, textures, bytes.
    #[serde(default)]
    pub scene_bytes: u64,
    /// Metrics of the image against the reference.
    #[serde(flatten)]
    pub errors: Values,
    /// What happens over time, where the grid asked for it.
    #[serde(flatten)]
    pub temporal: Temporal,
    /// Name of the adapter.
    pub adapter: String,
    /// Name and version of its driver.
    pub driver: String,
    /// Graphics interface: Vulkan, Metal, Dx12, BrowserWebGpu.
    pub backend: String,
    /// Whether the adapter is a processor that plays a GPU: its times compare by ratio only.
    pub software_adapter: bool,
    /// Name of the computer.
    #[serde(default)]
    pub machine: String,
    /// Model of its processor, which is what a software adapter runs on.
    #[serde(default)]
    pub processor: String,
    /// Commit of the build.
    pub commit: String,
    /// Preset or grid that the row belongs to; empty for none. Reports look here for a published table.
    pub preset: String,
    /// Seed of every random number.
    pub seed: u64,
    /// Command that reproduces the row.
    pub command: String,
    /// Pictures of the cell, relative to the report folder; key `final` is the column `image_final`. Reports know
    /// `final`, `indirect` (`albedo * indirect`), `error`, `truth_final`, `truth_indirect`, and the image files `exr` and
    /// `truth_exr`.
    #[serde(flatten, with = "image_columns")]
    pub images: Map<String, Value>,
}

impl Measurement {
    /// Fills the three `time_ms` columns and `frames`.
    pub fn set_time(&mut self, time: &Timing) {
        self.frames = time.samples;
        self.time_ms_median = time.median;
        self.time_ms_min = time.min;
        self.time_ms_p95 = time.p95;
    }

    /// The row as column name and value, in the order of results.csv.
    ///
    /// # Panics
    /// Never: every field has a JSON form and every key is text.
    pub fn columns(&self) -> Map<String, Value> {
        match serde_json::to_value(self) {
            Ok(Value::Object(columns)) => columns,
            other => unreachable!("a measurement is an object: {other:?}"),
        }
    }

    /// Median of one pass, ms.
    pub fn pass(&self, name: &str) -> Option<f64> {
        self.pass_ms.get(name)?.as_f64()
    }

    /// A picture of the cell by its kind, relative to the report folder.
    pub fn image(&self, kind: &str) -> Option<&str> {
        self.images.get(kind)?.as_str()
    }
}

/// Order statistics of timing samples, ms.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Middle sample.
    pub median: f64,
    /// Fastest sample.
    pub min: f64,
    /// 95th percentile.
    pub p95: f64,
    /// Slowest sample.
    pub max: f64,
    /// How many samples.
    pub samples: u32,
}

impl Timing {
    /// Statistics of `samples`, ms; None without samples.
    pub fn of(samples: &[f64]) -> Option<Self> {
        let mut sorted = samples.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let (&min, &max) = (sorted.first()?, sorted.last()?);
        let median = percentile(&mut sorted, 0.5);
        Some(Self { median, min, p95: percentile(&mut sorted, 0.95), max, samples: samples.len() as u32 })
    }
}

/// Writes results.json: an array of rows.
///
/// # Errors
/// If the file cannot be written.
pub fn write_json(path: &Path, rows: &[Measurement]) -> Result<(), Error> {
    write_whole(path, |file| {
        serde_json::to_writer_pretty(&mut *file, rows)?;
        file.write_all(b"\n")
    })
    .map_err(|error| Error::unwritable(path, error))
}

/// Reads results.json back.
///
/// # Errors
/// If the file is missing or holds something else.
pub fn read_json(path: &Path) -> Result<Vec<Measurement>, Error> {
    let text = std::fs::read_to_string(path).map_err(|error| Error::unreadable(path, error))?;
    serde_json::from_str(&text).map_err(|error| Error::unreadable(path, error))
}

/// Writes results.csv: one row a cell, the union of all columns; a cell without a value is empty.
///
/// # Errors
/// If the file cannot be written.
pub fn write_csv(path: &Path, rows: &[Measurement]) -> Result<(), Error> {
    let rows: Vec<_> = rows.iter().map(Measurement::columns).collect();
    let columns = union_of_columns(&rows);
    write_whole(path, |file| {
        let mut table = csv::Writer::from_writer(file);
        table.write_record(&columns)?;
        for row in &rows {
            table.write_record(columns.iter().map(|column| row.get(column).map_or(String::new(), plain)))?;
        }
        table.flush()
    })
    .map_err(|error| Error::unwritable(path, error))
}

/// All columns of all rows: a column that only some rows have comes right after its predecessor in those rows, so
/// that parameters stay with parameters and passes with passes.
fn union_of_columns(rows: &[Map<String, Value>]) -> Vec<String> {
    let mut union: Vec<String> = Vec::new();
    for row in rows {
        let mut next = 0;
        for column in row.keys() {
            next = 1 + union.iter().position(|known| known == column).unwrap_or_else(|| {
                union.insert(next, column.clone());
                next
            });
        }
    }
    union
}

/// A JSON value as people write it: text without quotes, null as nothing.
pub(crate) fn plain(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.clone(),
        other => other.to_string(),
    }
}

/// A map that shares the row's flat object with every other column and is told apart by how its keys look.
macro_rules! columns {
    ($(#[$doc:meta])* $module:ident, $key:ident => $column:expr, $name:ident => $stripped:expr) => {
        $(#[$doc])*
        mod $module {
            use serde::{Deserialize, Deserializer, Serializer};
            use serde_json::{Map, Value};

            pub fn serialize<S: Serializer>(map: &Map<String, Value>, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.collect_map(map.iter().map(|($key, value)| ($column, value)))
            }

            pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Map<String, Value>, D::Error> {
                let all = Map::deserialize(deserializer)?;
                let own = all.into_iter().filter_map(|($name, value)| Some((String::from($stripped?), value)));
                Ok(own.collect())
            }
        }
    };
}

columns!(
    /// `hierarchical.levels`: the only columns with a dot.
    parameter_columns, key => key, name => name.contains('.').then_some(name)
);
columns!(
    /// `pass_<name>_ms`.
    pass_columns, key => format!("pass_{key}_ms"), name => name.strip_prefix("pass_").and_then(|n| n.strip_suffix("_ms"))
);
columns!(
    /// `image_<kind>`.
    image_columns, key => format!("image_{key}"), name => name.strip_prefix("image_")
);

#[cfg(test)]
mod tests;
