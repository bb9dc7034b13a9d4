//! Finished cells on disk, so that a run that was stopped continues where it was, and folders can be merged.

use std::{
    collections::HashMap,
    fs::{File, OpenOptions},
    io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
};

use halflight_output::OutputFolder;
use serde::{Deserialize, Serialize};

use super::cell_id::CellId;
use crate::{Error, measurement::Measurement};

/// Name of the file in a report folder: one finished cell a line, as JSON, in the order in which they were finished.
pub const CELLS: &str = "cells.jsonl";

/// A finished cell: a line of [`CELLS`].
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Record {
    /// The cell's [`CellId`].
    pub cell: String,
    /// Hash of everything that the row depends on beside the cell and the adapter: a row counts only where it is the same.
    pub context: String,
    /// Commands that trace what the row was measured against.
    pub references: Vec<String>,
    /// The row.
    pub row: Measurement,
}

/// Lines of a file of finished cells that do not hold one, by number from 1: a run that was killed leaves half a line at
/// its end.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CutLines(pub Vec<u64>);

impl CutLines {
    /// What to tell about them; `None` where there are none.
    pub fn sentence(&self, path: &Path) -> Option<String> {
        let lines: Vec<String> = self.0.iter().map(u64::to_string).collect();
        let (noun, verb) = if lines.len() == 1 { ("line", "is") } else { ("lines", "are") };
        (!lines.is_empty()).then(|| {
            format!(
                "{}: {noun} {} {verb} cut off and left out; the cells of whole lines are kept",
                path.display(),
                lines.join(", ")
            )
        })
    }
}

/// Reads a file of finished cells line by line and calls `each` with the position of a line, its length, both in bytes,
/// and the record on it. A file that is missing has no lines.
///
/// # Errors
/// Where the file cannot be read, and those of `each`.
pub fn read_records(
    path: &Path,
    mut each: impl FnMut(u64, usize, Record) -> Result<(), Error>,
) -> Result<CutLines, Error> {
    let mut cut = CutLines::default();
    let file = match File::open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(cut),
        opened => opened.map_err(|error| Error::unreadable(path, error))?,
    };
    let mut reader = BufReader::with_capacity(1 << 16, file);
    let (mut position, mut number, mut line) = (0, 0, Vec::new());
    loop {
        line.clear();
        let length = reader.read_until(b'\n', &mut line).map_err(|error| Error::unreadable(path, error))?;
        if length == 0 {
            return Ok(cut);
        }
        number += 1;
        match serde_json::from_slice(&line).ok() {
            Some(record) => each(position, length, record)?,
            None if line.trim_ascii().is_empty() => {}
            None => cut.0.push(number),
        }
        position += length as u64;
    }
}

/// Reads the record at a position that [`read_records`] found.
///
/// # Errors
/// Where the file cannot be read or has changed since.
pub fn read_record(path: &Path, file: &mut File, position: u64, length: usize) -> Result<Record, Error> {
    let mut line = vec![0; length];
    let read = file.seek(SeekFrom::Start(position)).and_then(|_| file.read_exact(&mut line));
    read.map_err(|error| Error::unreadable(path, error))?;
    serde_json::from_slice(&line).map_err(|error| Error::unreadable(path, format_args!("{error}; it has changed")))
}

/// The finished cells of a report folder.
pub(super) struct CellLog<'a> {
    folder: &'a OutputFolder,
    path: PathBuf,
    finished: HashMap<String, Vec<Record>>,
    /// Whether the file ends within a line.
    is_cut: bool,
}

impl<'a> CellLog<'a> {
    /// The finished cells that earlier runs left in a folder, and lines that hold none.
    pub(super) fn resume(folder: &'a OutputFolder) -> Result<(Self, CutLines), Error> {
        let mut log = Self::empty(folder)?;
        let mut finished: HashMap<String, Vec<Record>> = HashMap::new();
        let cut = read_records(&log.path, |_, _, record| {
            finished.entry(record.cell.clone()).or_default().push(record);
            Ok(())
        })?;
        log.is_cut = ends_within_a_line(&log.path);
        log.finished = finished;
        Ok((log, cut))
    }

    /// A folder that no cell is taken from.
    pub(super) fn empty(folder: &'a OutputFolder) -> Result<Self, Error> {
        Ok(Self { folder, path: folder.claim(CELLS)?, finished: HashMap::new(), is_cut: false })
    }

    /// The record of a cell that was measured in this context and that `fits` accepts; of several the last.
    pub(super) fn finished(
        &self,
        cell: &CellId,
        context: &str,
        fits: impl Fn(&Measurement) -> bool,
    ) -> Option<&Record> {
        let records = self.finished.get(cell.as_str())?;
        records.iter().rfind(|record| record.context == context && fits(&record.row))
    }

    /// Adds a record to the file.
    pub(super) fn keep(&mut self, record: &Record) -> Result<(), Error> {
        let mut line = line(record)?;
        if std::mem::take(&mut self.is_cut) {
            line.insert(0, b'\n');
        }
        // Claimed again: the folder may have been removed since.
        let path = self.folder.claim(CELLS)?;
        // One write, so that lines of processes that share a folder do not mix.
        let written =
            OpenOptions::new().create(true).append(true).open(&path).and_then(|mut file| file.write_all(&line));
        written.map_err(|error| Error::unwritable(&path, error))
    }
}

/// Whether the last line of a file has no end.
fn ends_within_a_line(path: &Path) -> bool {
    let mut last = [b'\n'];
    // An empty file has no last byte.
    let read = File::open(path).and_then(|mut file| {
        file.seek(SeekFrom::End(-1))?;
        file.read_exact(&mut last)
    });
    read.is_ok() && last != *b"\n"
}

/// A record as a line of [`CELLS`].
pub(crate) fn line(record: &Record) -> Result<Vec<u8>, Error> {
    let mut line = serde_json::to_vec(record).map_err(|error| Error::Failed(error.to_string()))?;
    line.push(b'\n');
    Ok(line)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use std::fs;

    use super::*;

    fn record(cell: &str) -> Record {
        let row = Measurement { scene: cell.repeat(3), time_ms_median: 0.1, ..Measurement::default() };
        Record { cell: cell.into(), context: "c".into(), references: vec![], row }
    }

    fn names(path: &Path) -> (Vec<String>, Vec<u64>) {
        let mut names = Vec::new();
        let cut = read_records(path, |_, _, record| {
            names.push(record.cell);
            Ok(())
        });
        (names, cut.unwrap().0)
    }

    #[test]
    fn a_file_that_is_cut_off_anywhere_loses_its_last_line_only() {
        let path = std::env::temp_dir().join(format!("halflight-log-{}", std::process::id()));
        drop(fs::remove_dir_all(&path));
        let folder = OutputFolder::open(&path);
        let mut log = CellLog::empty(&folder).unwrap();
        for cell in ["a", "b", "c"] {
            log.keep(&record(cell)).unwrap();
        }
        let file = path.join(CELLS);
        let whole = fs::read(&file).unwrap();
        let last = whole.len() - line(&record("c")).unwrap().len();
        assert_eq!(names(&file), (["a", "b", "c"].map(String::from).to_vec(), vec![]));
        for length in last + 1..whole.len() - 1 {
            fs::write(&file, &whole[..length]).unwrap();
            assert_eq!(names(&file), (["a", "b"].map(String::from).to_vec(), vec![3]), "after {length} bytes");
        }
        // Only the end of the line is missing.
        fs::write(&file, &whole[..whole.len() - 1]).unwrap();
        assert_eq!(names(&file).0.len(), 3);
        let (mut log, cut) = CellLog::resume(&folder).unwrap();
        log.keep(&record("d")).unwrap();
        assert_eq!((cut.sentence(&file), names(&file).0.len()), (None, 4));
        // The next cell stands on a line of its own.
        fs::write(&file, &whole[..whole.len() - 9]).unwrap();
        let (mut log, cut) = CellLog::resume(&folder).unwrap();
        assert!(cut.sentence(&file).unwrap().contains("line 3 is cut off"));
        for cell in ["d", "e"] {
            log.keep(&record(cell)).unwrap();
        }
        assert_eq!(names(&file), (["a", "b", "d", "e"].map(String::from).to_vec(), vec![3]));
        let mut opened = File::open(&file).unwrap();
        let mut places = Vec::new();
        read_records(&file, |position, length, record| {
            places.push((position, length, record.cell));
            Ok(())
        })
        .unwrap();
        for (position, length, cell) in places {
            assert_eq!(read_record(&file, &mut opened, position, length).unwrap().cell, cell);
        }
        fs::remove_dir_all(path).unwrap();
    }
}
