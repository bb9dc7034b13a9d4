//! The pictures of merged rows.

use std::{
    collections::HashSet,
    fs,
    path::{Path, PathBuf},
};

use halflight_native::images::Image;
use halflight_output::OutputFolder;

use crate::{Error, measurement::Measurement};

/// Pictures that were copied.
#[derive(Default)]
pub(super) struct Copied {
    /// Those of references, which many rows share.
    shared: HashSet<String>,
    lost: Vec<PathBuf>,
}

impl Copied {
    /// Copies the pictures of a row.
    pub(super) fn copy(&mut self, from: &Path, row: &Measurement, folder: &OutputFolder) -> Result<(), Error> {
        for (kind, path) in &row.images {
            let Some(name) = path.as_str() else { continue };
            if kind.starts_with("truth") && !self.shared.insert(name.to_owned()) {
                continue;
            }
            let (source, target) = (from.join(name), folder.claim(name)?);
            match fs::copy(&source, &target) {
                Err(_) if !source.is_file() => self.lost.push(source),
                copied => drop(copied.map_err(|error| Error::unwritable(&target, error))?),
            }
        }
        Ok(())
    }

    /// What to tell about pictures that are gone.
    pub(super) fn warning(&self) -> Option<String> {
        let first = self.lost.first()?;
        Some(format!("{} pictures are gone, the first of them is {}", self.lost.len(), first.display()))
    }
}

/// Compares the pictures of a row in two folders.
///
/// # Errors
/// The name of the first that differs.
pub(super) fn same(a: &Path, b: &Path, row: &Measurement) -> Result<(), String> {
    row.images.values().filter_map(|name| name.as_str()).try_for_each(|name| same_file(a, b, name))
}

/// Compares a picture in two folders: the bytes, or else the values of an EXR file without its header, in which commands
/// may differ. A picture that only one folder has is no difference.
///
/// # Errors
/// The picture's name where it differs.
pub(super) fn same_file(a: &Path, b: &Path, name: &str) -> Result<(), String> {
    let paths = [a, b].map(|folder| folder.join(name));
    let [Ok(first), Ok(second)] = paths.each_ref().map(fs::read) else { return Ok(()) };
    if first == second {
        return Ok(());
    }
    let bits = |path: &PathBuf| {
        let image = Image::read(path).ok().filter(|_| name.ends_with(".exr"))?;
        let channel = |values: &Vec<f32>| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        let channels: Vec<_> = image.channels.iter().map(|(name, values)| (name.clone(), channel(values))).collect();
        Some((image.width, image.height, channels))
    };
    let [first, second] = paths.each_ref().map(bits);
    if first.is_some() && first == second { Ok(()) } else { Err(name.to_owned()) }
}
