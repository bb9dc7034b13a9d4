//! Measured cells on disk, so that a search goes on where another was stopped.

use std::{fs, io::Write};

use halflight_native::files::write_whole;
use halflight_output::OutputFolder;
use halflight_recommend::{Cell, Outcome};
use serde::{Deserialize, Serialize};

use crate::{Error, format};

/// Name of the file.
pub(super) const FILE: &str = "cells.json";

/// Cells of searches that measure in the same way.
pub(super) struct Store<'a> {
    folder: Option<&'a OutputFolder>,
    content: Content,
}

#[derive(Default, Serialize, Deserialize)]
struct Content {
    /// Everything that the numbers depend on.
    key: String,
    cells: Vec<Stored>,
}

#[derive(Clone, Serialize, Deserialize)]
struct Stored {
    technique: String,
    settings: String,
    size: [u32; 2],
    outcome: Outcome,
}

impl<'a> Store<'a> {
    /// The cells of an earlier search with the same key, if `resume` is on.
    pub(super) fn open(folder: Option<&'a OutputFolder>, resume: bool, key: String) -> Result<Self, Error> {
        let earlier = folder.filter(|_| resume).and_then(|folder| {
            let text = fs::read_to_string(folder.path().join(FILE)).ok()?;
            serde_json::from_str(&text).ok().filter(|content: &Content| content.key == key)
        });
        Ok(Self { folder, content: earlier.unwrap_or(Content { key, cells: Vec::new() }) })
    }

    /// What is known of a cell.
    pub(super) fn get(&self, cell: &Cell) -> Option<Outcome> {
        let settings = format::settings(&cell.settings);
        let same = |stored: &&Stored| {
            stored.technique == cell.technique.name && stored.settings == settings && stored.size == cell.size
        };
        let stored = self.content.cells.iter().find(same)?;
        Some(stored.outcome.clone())
    }

    /// Keeps a cell. One that was refused, or whose error is not a number, is measured again next time.
    pub(super) fn keep(&mut self, cell: &Cell, outcome: &Outcome) -> Result<(), Error> {
        let lasts = match outcome {
            Outcome::Measured(measured) => measured.errors.iter().all(|error| error.is_finite()),
            Outcome::TooSlow(_) => true,
            Outcome::Refused(_) => false,
        };
        if !lasts {
            return Ok(());
        }
        self.content.cells.push(Stored {
            technique: cell.technique.name.into(),
            settings: format::settings(&cell.settings),
            size: cell.size,
            outcome: outcome.clone(),
        });
        let Some(folder) = self.folder else { return Ok(()) };
        let text = serde_json::to_string(&self.content).map_err(|e| Error::Failed(e.to_string()))?;
        let path = folder.claim(FILE)?;
        write_whole(&path, |file| file.write_all(text.as_bytes()))
            .map_err(|e: std::io::Error| Error::unwritable(&path, e))
    }
}
