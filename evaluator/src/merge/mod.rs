//! Merges report folders of one grid, measured in parts, to one.
//!
//! Rows are found by name and position in a first pass, and read one by one in a second: what is held in memory is about a
//! hundred bytes for each, until a report is made of them.

use std::{
    collections::HashMap,
    fs::File,
    io::Write as _,
    path::{Path, PathBuf},
};

use halflight_native::files::write_whole;
use halflight_output::{OutputFolder, terminal};

use crate::{
    Error,
    experiment::{
        cell_id::CellId,
        cell_log::{CELLS, Record, line, read_record, read_records},
        grid::Grid,
        manifest::{MANIFEST, Manifest},
        run::{add, empty_report},
    },
    format::count,
    progress::Progress,
    report::Report,
};

mod check;
mod pictures;
pub mod reference;
#[cfg(test)]
mod tests;

use check::{Results, same_run};

/// Name of the grid file of the missing cells.
pub const MISSING: &str = "missing.toml";

/// Most rows of a report page and of its tables: a row takes about 20 kB of memory while they are made.
pub const MOST_ROWS: u64 = 40_000;

/// What a merge gave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Merged {
    /// Cells with a row.
    pub found: u64,
    /// Cells of the grid, over all scenes and sizes.
    pub cells: u64,
}

impl Merged {
    /// Cells without a row.
    pub fn missing(&self) -> u64 {
        self.cells - self.found
    }
}

/// A folder to merge.
pub(crate) struct Part {
    pub(crate) path: PathBuf,
    pub(crate) manifest: Manifest,
    pub(crate) grid: Grid,
}

impl Part {
    fn read(path: &Path) -> Result<Self, Error> {
        let manifest = Manifest::read(path)?;
        let grid = Grid { only: None, ..manifest.grid(path)? };
        Ok(Self { path: path.into(), manifest, grid })
    }

    fn log(&self) -> PathBuf {
        self.path.join(CELLS)
    }
}

/// Where a row is.
#[derive(Clone, Copy)]
struct Place {
    part: u32,
    adapter: u32,
    position: u64,
    length: u32,
    /// Hash of what a second measurement of the cell must give again.
    results: u64,
}

/// Merges folders to one report folder. `command` is shown in the report.
///
/// # Errors
/// Folders that do not belong together (another commit, scene, grid or reference, a cell with two results): one sentence
/// with the folder and the key; nothing is written then. A file that cannot be read or written.
pub fn merge(folders: &[PathBuf], out: &Path, command: String) -> Result<Merged, Error> {
    let parts = folders.iter().map(|folder| Part::read(folder)).collect::<Result<Vec<_>, _>>()?;
    let (first, others) =
        parts.split_first().ok_or_else(|| Error::BadInput("no folder to merge: name at least one".into()))?;
    others.iter().try_for_each(|part| same_run(first, part))?;
    let own = |part: &Part| part.path.canonicalize().ok().zip(out.canonicalize().ok()).is_some_and(|(a, b)| a == b);
    if parts.iter().any(own) {
        return Err(Error::BadInput(format!(
            "--out {} is one of the folders to merge: choose another folder",
            out.display()
        )));
    }
    let mut warnings: Vec<String> = Vec::new();
    let places = find(&parts, &mut warnings)?;

    let grid = &first.grid;
    let folder = OutputFolder::open(out);
    for name in Report::FILES.into_iter().chain([MANIFEST, CELLS, MISSING]) {
        folder.claim(name)?;
    }
    for part in &parts {
        warnings
            .extend(part.manifest.warnings.iter().filter(|text| !warnings.contains(text)).cloned().collect::<Vec<_>>());
    }
    let cells = grid.len() * first.manifest.contexts.len() as u64;
    let mut report = empty_report(grid, &first.manifest.scenes, command.clone(), warnings);
    let mut files = parts.iter().map(|part| File::open(part.log()).ok()).collect::<Vec<_>>();
    let progress = Progress::new("merge", cells);
    let mut missing = Vec::new();
    let (mut found, mut pictures) = (0, pictures::Copied::default());
    let log = folder.claim(CELLS)?;
    let has_report = places.len() as u64 <= MOST_ROWS;
    let written = write_whole(&log, |file| {
        for id in cells_of(first) {
            let Some(places) = places.get(&id.number()) else {
                missing.push(id.to_string());
                continue;
            };
            found += 1;
            for place in places {
                let part = &parts[place.part as usize];
                let source = files[place.part as usize].as_mut();
                let source = source.ok_or_else(|| Error::unreadable(&part.log(), "it is gone"))?;
                let record = read_record(&part.log(), source, place.position, place.length as usize)?;
                pictures.copy(&part.path, &record.row, &folder)?;
                file.write_all(&line(&record)?)?;
                if has_report {
                    add(&mut report, record, grid.truth_rel_error);
                }
            }
            progress.set(found, "");
        }
        Ok(())
    });
    written.map_err(|stop| match stop {
        Stop::Unwritable(error) => Error::unwritable(&log, error),
        Stop::Other(error) => error,
    })?;
    report.warnings.extend(pictures.warning());
    let merged = Merged { found, cells };
    write_missing(&folder, grid, missing, &mut report)?;
    let manifest =
        Manifest { command, grid: grid.to_toml(), warnings: report.warnings.clone(), ..first.manifest.clone() };
    manifest.write(&folder.claim(MANIFEST)?)?;
    if has_report {
        report.write(&folder)?;
    } else {
        folder.remove(|name| Report::FILES.contains(&name))?;
        terminal::note(format_args!(
            "warning: {} rows are too many for a page and its tables ({} at most): {} holds them, one a line; merge fewer \
             folders for a report",
            count(places.len() as u64),
            count(MOST_ROWS),
            log.display()
        ));
    }
    progress.finish(&format!(
        "{}: {} of {} cells from {} folders in {}",
        grid.name,
        count(found),
        count(cells),
        parts.len(),
        if has_report { out.join("index.html") } else { log }.display()
    ));
    Ok(merged)
}

/// Why the merged file of cells is not written.
enum Stop {
    Unwritable(std::io::Error),
    Other(Error),
}

impl From<std::io::Error> for Stop {
    fn from(error: std::io::Error) -> Self {
        Self::Unwritable(error)
    }
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Other(error)
    }
}

impl From<halflight_output::FolderError> for Stop {
    fn from(error: halflight_output::FolderError) -> Self {
        Self::Other(error.into())
    }
}

/// Names of all cells of a grid, over its scenes and sizes.
fn cells_of(part: &Part) -> impl Iterator<Item = CellId> + '_ {
    let Part { manifest, grid, .. } = part;
    let subjects = manifest.scenes.iter().flat_map(|scene| grid.sizes.iter().map(move |&size| (scene, size)));
    subjects.flat_map(|(scene, size)| grid.cells().map(move |cell| CellId::new(&scene.hash, size, &cell)))
}

/// Where the row of each cell is: one for each adapter that measured it, in the order of the folders.
fn find(parts: &[Part], warnings: &mut Vec<String>) -> Result<HashMap<u64, Vec<Place>>, Error> {
    let mut tell = |warning: String| {
        terminal::note(format_args!("warning: {warning}"));
        warnings.push(warning);
    };
    let mut results = Results::default();
    let mut places: HashMap<u64, Vec<Place>> = HashMap::new();
    for (index, part) in parts.iter().enumerate() {
        let path = part.log();
        // The last record of a cell is the one that counts, so that all are read before any is compared.
        let mut own: HashMap<(u64, u32), Place> = HashMap::new();
        let mut stale = 0;
        let cut = read_records(&path, |position, length, record: Record| {
            let Some(subject) = part.manifest.contexts.iter().position(|context| *context == record.context) else {
                stale += 1;
                return Ok(());
            };
            let adapter = results.adapter(&record.row);
            results.check_reference(parts, index, subject, adapter, &record.row)?;
            let number = CellId::number_of(&record.cell);
            let length = u32::try_from(length).unwrap_or(u32::MAX);
            let place = Place { part: index as u32, adapter, position, length, results: check::hash(&record.row) };
            own.insert((number, adapter), place);
            Ok(())
        })?;
        cut.sentence(&path).into_iter().for_each(&mut tell);
        if stale > 0 {
            tell(format!(
                "{}: {stale} cells were measured by another program or with another scene, grid or reference than the last \
                 run of this folder, and are left out",
                path.display()
            ));
        }
        for ((number, adapter), place) in own {
            let known = places.entry(number).or_default();
            match known.iter().find(|known| known.adapter == adapter) {
                None => known.push(place),
                Some(&twin) => check_twins(parts, twin, place)?,
            }
        }
    }
    Ok(places)
}

/// Refuses a cell that two folders measured with different results. Of equal ones the first stays, with its times.
fn check_twins(parts: &[Part], first: Place, second: Place) -> Result<(), Error> {
    let read = |place: Place| {
        let path = parts[place.part as usize].log();
        let mut file = File::open(&path).map_err(|error| Error::unreadable(&path, error))?;
        read_record(&path, &mut file, place.position, place.length as usize)
    };
    let [a, b] = [&parts[first.part as usize].path, &parts[second.part as usize].path];
    let (record, other) = (read(first)?, read(second)?);
    if first.results != second.results {
        return Err(check::twice(a, &record, b, &other));
    }
    pictures::same(a, b, &record.row).map_err(|name| check::other_picture(a, b, &name))
}

/// Writes the grid of the missing cells, or removes that of an earlier merge.
fn write_missing(folder: &OutputFolder, grid: &Grid, missing: Vec<String>, report: &mut Report) -> Result<(), Error> {
    if missing.is_empty() {
        return Ok(folder.remove(|name| name == MISSING)?);
    }
    let path = folder.claim(MISSING)?;
    let warning = format!(
        "{} cells are missing: measure them with `evaluator run --grid {}` into a folder of their own, and merge again",
        count(missing.len() as u64),
        path.display()
    );
    terminal::note(format_args!("warning: {warning}"));
    report.warnings.push(warning);
    let text = Grid { only: Some(missing.into_iter().collect()), ..grid.clone() }.to_toml();
    write_whole(&path, |file| file.write_all(text.as_bytes())).map_err(|e: std::io::Error| Error::unwritable(&path, e))
}
