//! What a report folder was measured with, so that folders can be merged without their grid and scene files.

use std::{io::Write as _, path::Path};

use halflight_native::files::write_whole;
use serde::{Deserialize, Serialize};

use super::grid::Grid;
use crate::Error;

/// Name of the file in a report folder.
pub const MANIFEST: &str = "run.json";

/// What a report folder was measured with.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    /// Commit of the program.
    pub commit: String,
    /// Hash of its shaders.
    pub shaders: String,
    /// The grid as a grid file.
    pub grid: String,
    /// The grid's scenes by name and content, in its order.
    pub scenes: Vec<SceneContent>,
    /// [`Record::context`](super::cell_log::Record::context) of each scene at each size, in the grid's order.
    pub contexts: Vec<String>,
    /// Command that measured it.
    pub command: String,
    /// What did not go as it should before anything was measured.
    pub warnings: Vec<String>,
}

/// A scene by name and content.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneContent {
    /// Name.
    pub name: String,
    /// Hash of everything in it that a result depends on.
    pub hash: String,
}

impl Manifest {
    /// Reads that of a folder.
    ///
    /// # Errors
    /// If the file is missing or holds something else.
    pub fn read(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(MANIFEST);
        let text = std::fs::read_to_string(&path).map_err(|error| {
            Error::BadInput(format!(
                "cannot read {} ({error}): give folders that `evaluator run` wrote",
                path.display()
            ))
        })?;
        serde_json::from_str(&text).map_err(|error| Error::unreadable(&path, error))
    }

    /// Writes it.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        write_whole(path, |file| {
            serde_json::to_writer_pretty(&mut *file, self)?;
            file.write_all(b"\n")
        })
        .map_err(|error: std::io::Error| Error::unwritable(path, error))
    }

    /// The grid.
    ///
    /// # Errors
    /// If its text is no grid file; `folder` is named then.
    pub fn grid(&self, folder: &Path) -> Result<Grid, Error> {
        Grid::parse(&folder.join(MANIFEST), &self.grid).map_err(|e| Error::BadInput(e.to_string()))
    }
}
