//! Finished cells on disk, so that a run that was stopped continues where it was.

use std::{fs, io::Write};

use halflight_native::files::write_whole;
use halflight_output::OutputFolder;
use serde_json::{Map, Value};

use crate::Error;
use crate::measurement::Measurement;

/// The file of one cell of a grid: its row, and the key of everything that the row depends on.
pub(super) struct CellFile<'a> {
    folder: &'a OutputFolder,
    number: usize,
}

impl<'a> CellFile<'a> {
    /// The file of the cell of this number.
    pub(super) fn new(folder: &'a OutputFolder, number: usize) -> Self {
        Self { folder, number }
    }

    /// The number of the cell in its grid.
    pub(super) fn number(&self) -> usize {
        self.number
    }

    fn name(&self) -> String {
        format!("cells/{:04}.json", self.number)
    }

    /// Reserves the file's name.
    pub(super) fn claim(&self) -> Result<(), Error> {
        self.folder.claim(&self.name())?;
        Ok(())
    }

    /// Removes the files of all cells.
    pub(super) fn remove_all(folder: &OutputFolder) -> Result<(), Error> {
        Ok(folder.remove(|name| name.starts_with("cells/"))?)
    }

    /// The row that an earlier run left, if it was measured under this key.
    pub(super) fn finished(&self, key: &str) -> Option<Measurement> {
        let text = fs::read_to_string(self.folder.path().join(self.name())).ok()?;
        let mut stored: Map<String, Value> = serde_json::from_str(&text).ok()?;
        (stored.get("key")?.as_str()? == key).then_some(())?;
        serde_json::from_value(stored.remove("row")?).ok()
    }

    /// Writes the file.
    pub(super) fn keep(&self, key: &str, row: &Measurement) -> Result<(), Error> {
        let stored = serde_json::json!({ "key": key, "row": row });
        let text = serde_json::to_string_pretty(&stored).map_err(|e| Error::Failed(e.to_string()))?;
        let path = self.folder.claim(&self.name())?;
        write_whole(&path, |file| file.write_all(text.as_bytes()))
            .map_err(|e: std::io::Error| Error::unwritable(&path, e))
    }
}
