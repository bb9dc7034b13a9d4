//! What folders must have in common to be merged.

use std::{
    collections::{HashMap, HashSet},
    hash::{DefaultHasher, Hash as _, Hasher as _},
    path::Path,
};

use serde_json::{Map, Value};

use super::Part;
use crate::{
    Error,
    experiment::{cell_log::Record, grid::Grid},
    measurement::{Measurement, plain},
};

/// Refuses a folder that was measured with anything else than the first.
pub(super) fn same_run(first: &Part, other: &Part) -> Result<(), Error> {
    let refuse = |key: &str, [a, b]: [String; 2], fix: &str| {
        Err(Error::BadInput(format!(
            "{} cannot be merged with {}: `{key}` is {b} there and {a} here: {fix}",
            other.path.display(),
            first.path.display()
        )))
    };
    let again = "measure one of them again";
    let (a, b) = (&first.manifest, &other.manifest);
    if a.commit != b.commit {
        return refuse("commit", [a.commit.clone(), b.commit.clone()], "measure both with the same program");
    }
    if a.shaders != b.shaders {
        let fix = "measure both with the same program (the commit is the same, but shaders were edited)";
        return refuse("shaders", [a.shaders.clone(), b.shaders.clone()], fix);
    }
    for (a, b) in settings(&first.grid).into_iter().zip(settings(&other.grid)) {
        if a != b {
            return refuse(a.0, [a.1, b.1], again);
        }
    }
    if a.scenes.len() != b.scenes.len() {
        return refuse("scenes", [a.scenes.len().to_string(), b.scenes.len().to_string()], again);
    }
    for (a, b) in a.scenes.iter().zip(&b.scenes) {
        if a.name != b.name {
            return refuse("scenes", [a.name.clone(), b.name.clone()], again);
        }
        if a.hash != b.hash {
            let [a, b] = [a, b].map(|scene| format!("{} with content {}", scene.name, scene.hash));
            return refuse("scenes", [a, b], "its files differ; measure one of them again with the same files");
        }
    }
    let [own, others] = [&first.grid, &other.grid].map(|grid| lines(&anonymous(grid)));
    if own != others {
        let differing = own.iter().zip(&others).find(|(a, b)| a != b);
        let end = || (own.get(others.len()), others.get(own.len()));
        let (a, b) = differing.map(|(a, b)| (Some(a), Some(b))).unwrap_or_else(end);
        let text = |line: Option<&String>| line.map_or("absent".to_owned(), |line| format!("({line})"));
        let fix = "run the folder of the smaller grid again with --resume, which measures only what is new";
        return refuse("sweep", [text(a), text(b)], fix);
    }
    if a.contexts != b.contexts {
        return refuse("contexts", ["other".into(), "other".into()], again);
    }
    Ok(())
}

/// Settings of a grid that a row depends on, by key.
fn settings(grid: &Grid) -> [(&'static str, String); 9] {
    let sizes = grid.sizes.iter().map(|[width, height]| format!("{width}x{height}"));
    [
        ("truth_samples", grid.truth_samples.to_string()),
        ("truth_rel_error", grid.truth_rel_error.to_string()),
        ("bounces", grid.bounces.to_string()),
        ("direct", if grid.direct_from_truth { "truth" } else { "rendered" }.to_owned()),
        ("seed", grid.seed.to_string()),
        ("frames", grid.frames.to_string()),
        ("temporal", grid.temporal.to_string()),
        ("preset", format!("{:?}", grid.preset)),
        ("size", sizes.collect::<Vec<_>>().join(", ")),
    ]
}

/// The grid without its name and the paths of its scenes, which may differ between computers.
fn anonymous(grid: &Grid) -> String {
    Grid { name: String::new(), scenes: Vec::new(), only: None, ..grid.clone() }.to_toml()
}

fn lines(text: &str) -> Vec<String> {
    text.lines().map(str::to_owned).collect()
}

/// Whether a column is a time, or names the computer that took it: two measurements of one cell may differ in it.
fn is_of_time(column: &str) -> bool {
    ["machine", "processor", "command", "first_frame_ms"].contains(&column)
        || ["time_ms_", "frame_ms_"].iter().any(|start| column.starts_with(start))
        || column.starts_with("pass_") && column.ends_with("_ms")
}

/// What a second measurement of the cell on the same adapter gives again.
pub(super) fn results(row: &Measurement) -> Map<String, Value> {
    row.columns().into_iter().filter(|(column, _)| !is_of_time(column)).collect()
}

pub(super) fn hash(row: &Measurement) -> u64 {
    let mut hasher = DefaultHasher::new();
    Value::Object(results(row)).to_string().hash(&mut hasher);
    hasher.finish()
}

/// Refuses a cell with two results.
pub(super) fn twice(first: &Path, record: &Record, second: &Path, other: &Record) -> Error {
    let (a, b) = (results(&record.row), results(&other.row));
    let keys = a.keys().chain(b.keys());
    let key = keys.into_iter().find(|key| a.get(*key) != b.get(*key)).cloned().unwrap_or_default();
    let text = |row: &Map<String, Value>| row.get(&key).map_or("absent".into(), plain);
    Error::BadInput(format!(
        "{} cannot be merged with {}: cell {} ({} of {}) has `{key}` {} there and {} here: one of them is wrong; measure it \
         again",
        second.display(),
        first.display(),
        record.cell,
        record.row.technique,
        record.row.scene,
        text(&b),
        text(&a)
    ))
}

/// Refuses two pictures of one name.
pub(super) fn other_picture(first: &Path, second: &Path, name: &str) -> Error {
    Error::BadInput(format!(
        "{} cannot be merged with {}: `{name}` shows something else there: one of them is wrong; measure it again",
        second.display(),
        first.display()
    ))
}

/// What is known of the rows so far.
#[derive(Default)]
pub(super) struct Results {
    adapters: Vec<[String; 3]>,
    /// The reference of each scene at each size on an adapter, and the folder that it was first seen in.
    references: HashMap<(usize, u32), (usize, String)>,
    /// Pictures of references that were compared, by folder.
    compared: HashSet<(usize, String)>,
}

impl Results {
    /// The number of a row's adapter.
    pub(super) fn adapter(&mut self, row: &Measurement) -> u32 {
        let adapter = [&row.adapter, &row.driver, &row.backend].map(String::clone);
        let known = self.adapters.iter().position(|known| *known == adapter);
        known.unwrap_or_else(|| {
            self.adapters.push(adapter);
            self.adapters.len() - 1
        }) as u32
    }

    /// Refuses a row that was measured against another image of the reference than those before: with other samples.
    pub(super) fn check_reference(
        &mut self,
        parts: &[Part],
        part: usize,
        subject: usize,
        adapter: u32,
        row: &Measurement,
    ) -> Result<(), Error> {
        let Some(name) = row.image("truth_exr") else { return Ok(()) };
        let Some((first, known)) = self.references.get(&(subject, adapter)) else {
            self.references.insert((subject, adapter), (part, name.to_owned()));
            return Ok(());
        };
        let [a, b] = [*first, part].map(|index| &parts[index].path);
        if known == name {
            // Pictures of one name are the same, unless one is damaged. Each folder is looked at once.
            let is_new = *first != part && self.compared.insert((part, name.to_owned()));
            return match is_new.then(|| super::pictures::same_file(a, b, name)) {
                Some(Err(name)) => Err(other_picture(a, b, &name)),
                _ => Ok(()),
            };
        }
        Err(Error::BadInput(format!(
            "{} cannot be merged with {}: its `reference` of {} at {}x{} is another image ({name}), with other samples: \
             delete the cells of one of them and measure them again from one cache (HALFLIGHT_CACHE)",
            b.display(),
            a.display(),
            row.scene,
            row.width,
            row.height
        )))
    }
}
