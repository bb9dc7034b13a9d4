//! Folders of results, which hold files of the program and may hold files of the user.

use std::{
    cell::RefCell,
    collections::BTreeSet,
    fmt, fs,
    io::{self, Write},
    path::{Path, PathBuf},
};

/// Name of the file that lists what the program wrote to a folder: one relative path a line.
pub const LIST: &str = ".halflight-files";

/// A folder of results. It keeps a list of the files that the program wrote there ([`LIST`]); files that are not in it
/// are the user's and are neither replaced nor removed.
///
/// Several processes may write to one folder: names are only ever appended to the list.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    own: RefCell<BTreeSet<String>>,
}

/// Why a file of a folder cannot be written or removed.
#[derive(Debug)]
pub enum FolderError {
    /// The folder holds a file of this name that the program did not write.
    NotOurs(PathBuf),
    /// The file system refuses.
    Unwritable(PathBuf, io::Error),
}

impl fmt::Display for FolderError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotOurs(path) => write!(
                f,
                "{} is not in the list of files that this program wrote there ({LIST}): choose another folder, or move \
                 the file away",
                path.display()
            ),
            Self::Unwritable(path, error) => write!(f, "cannot write {}: {error}", path.display()),
        }
    }
}

impl std::error::Error for FolderError {}

impl OutputFolder {
    /// The folder at this path. Nothing is made before the first [`claim`](Self::claim).
    pub fn open(path: impl Into<PathBuf>) -> Self {
        let folder = Self { path: path.into(), own: RefCell::default() };
        folder.read_list();
        folder
    }

    /// Where the folder is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The path at which to write a file of the program, given relative to the folder with `/` as separator. Missing
    /// folders are made. The file enters the list first, so that it is known even where the program is killed while it
    /// writes.
    ///
    /// # Errors
    /// Where there is such a file that the program did not write, or where the list cannot be written.
    pub fn claim(&self, name: &str) -> Result<PathBuf, FolderError> {
        let path = self.path.join(name);
        let known = || self.own.borrow().contains(name);
        if !known() && path.symlink_metadata().is_ok() {
            // Another process may have written it since.
            self.read_list();
            if !known() {
                return Err(FolderError::NotOurs(path));
            }
        }
        let folder = path.parent().unwrap_or(&self.path);
        fs::create_dir_all(folder).map_err(|error| FolderError::Unwritable(path.clone(), error))?;
        let list = self.path.join(LIST);
        let is_new = self.own.borrow_mut().insert(name.to_owned());
        // A folder that was removed during a run is made again, and its list with it.
        let lines = match (list.exists(), is_new) {
            (true, false) => return Ok(path),
            (true, true) => format!("{name}\n"),
            (false, _) => self.own.borrow().iter().fold(
                "# Files that Halflight wrote to this folder. It replaces and removes no others.\n".to_owned(),
                |lines, name| lines + name + "\n",
            ),
        };
        let opened = fs::OpenOptions::new().create(true).append(true).open(&list);
        let written = opened.and_then(|mut file| file.write_all(lines.as_bytes()));
        if let Err(error) = written {
            self.own.borrow_mut().remove(name);
            return Err(FolderError::Unwritable(path, error));
        }
        Ok(path)
    }

    /// Removes those of the program's files whose relative path `wanted` accepts.
    ///
    /// # Errors
    /// Where a file cannot be removed.
    pub fn remove(&self, wanted: impl Fn(&str) -> bool) -> Result<(), FolderError> {
        for name in self.own.borrow().iter().filter(|name| wanted(name)) {
            let path = self.path.join(name);
            match fs::remove_file(&path) {
                Err(error) if error.kind() != io::ErrorKind::NotFound => {
                    return Err(FolderError::Unwritable(path, error));
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn read_list(&self) {
        // A folder without a list holds nothing of the program's.
        let Ok(list) = fs::read_to_string(self.path.join(LIST)) else { return };
        let names = list.lines().filter(|line| !line.is_empty() && !line.starts_with('#') && stays_inside(line));
        self.own.borrow_mut().extend(names.map(str::to_owned));
    }
}

/// Whether a listed path stays inside the folder: a list may have been edited or come from elsewhere.
fn stays_inside(name: &str) -> bool {
    Path::new(name).components().all(|part| matches!(part, std::path::Component::Normal(_)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn in_folder(test: &str, body: impl FnOnce(&Path)) {
        let path = std::env::temp_dir().join(format!("halflight-output-{test}-{}", std::process::id()));
        fs::create_dir_all(&path).expect("a temporary folder");
        body(&path);
        fs::remove_dir_all(path).expect("the temporary folder");
    }

    #[test]
    fn files_of_the_user_are_refused_and_kept() {
        in_folder("user", |path| {
            fs::create_dir_all(path.join("cells")).expect("a folder");
            for name in ["index.html", "cells/notes.txt", "cells/0000.json"] {
                fs::write(path.join(name), "mine").expect("a file");
            }
            let folder = OutputFolder::open(path);
            for name in ["index.html", "cells/0000.json"] {
                assert!(matches!(folder.claim(name), Err(FolderError::NotOurs(_))), "{name}");
            }
            fs::write(folder.claim("cells/0001.json").expect("a new name"), "{}").expect("a file");
            folder.remove(|name| name.starts_with("cells/")).expect("all can be removed");
            assert!(!path.join("cells/0001.json").exists());
            for name in ["index.html", "cells/notes.txt", "cells/0000.json"] {
                assert_eq!(fs::read_to_string(path.join(name)).expect("it is kept"), "mine");
            }
        });
    }

    #[test]
    fn own_files_are_known_to_a_later_run_and_to_other_processes() {
        in_folder("own", |path| {
            let (first, other) = (OutputFolder::open(path), OutputFolder::open(path));
            fs::write(first.claim("results.csv").expect("a new name"), "1").expect("a file");
            fs::write(other.claim("images/a.png").expect("a new name"), "2").expect("a file");
            other.claim("results.csv").expect("the first process wrote it");
            let later = OutputFolder::open(path);
            later.claim("results.csv").expect("an earlier run wrote it");
            later.claim("images/a.png").expect("an earlier run wrote it");
        });
    }

    #[test]
    fn a_folder_that_was_removed_is_made_again_with_its_list() {
        in_folder("removed", |path| {
            let folder = OutputFolder::open(path.join("out"));
            folder.claim("a").expect("a new name");
            fs::remove_dir_all(path.join("out")).expect("it was made");
            for name in ["a", "b"] {
                fs::write(folder.claim(name).expect("it may be made again"), "").expect("a file");
            }
            let later = OutputFolder::open(path.join("out"));
            later.claim("a").expect("it is in the list");
            later.claim("b").expect("it is in the list");
        });
    }

    #[test]
    fn a_list_cannot_lead_out_of_the_folder() {
        in_folder("outside", |path| {
            fs::write(path.join("precious"), "mine").expect("a file");
            fs::create_dir_all(path.join("out")).expect("a folder");
            let absolute = path.join("precious");
            fs::write(path.join("out").join(LIST), format!("../precious\n{}\n", absolute.display())).expect("a list");
            OutputFolder::open(path.join("out")).remove(|_| true).expect("there is nothing to remove");
            assert!(absolute.exists());
        });
    }

    #[test]
    fn a_file_in_place_of_the_folder_is_one_sentence() {
        in_folder("file", |path| {
            fs::write(path.join("out"), "mine").expect("a file");
            let error = OutputFolder::open(path.join("out")).claim("index.html").expect_err("it is no folder");
            assert!(error.to_string().starts_with("cannot write "), "{error}");
        });
    }
}
