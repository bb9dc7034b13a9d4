//! Sources of files.

use std::collections::BTreeMap;
use std::io;
use std::path::{Component, Path, PathBuf};

/// A set of readable files. Every reader of this crate uses it, so that the same code serves a disk, files dropped onto
/// a web page, and a test.
///
/// Implementations look for the path as given first. If there is no such file, they take `\` for a separator, and then
/// fall back to a name that differs only in case. Both are common in OBJ files written on Windows.
pub trait FileSource {
    /// The bytes of one file.
    ///
    /// # Errors
    /// [`io::ErrorKind::NotFound`] if there is no such file; on a disk also anything else that reading can return.
    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;
}

/// Files on disk.
#[derive(Clone, Copy, Debug, Default)]
pub struct DiskFiles;

impl FileSource for DiskFiles {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let missing = |result: &io::Result<_>| matches!(result, Err(error) if error.kind() == io::ErrorKind::NotFound);
        let as_given = std::fs::read(path);
        if !missing(&as_given) {
            return as_given;
        }
        // A backslash is a legal part of a name on most systems, but a folder in the files of Windows.
        let turned = path.to_string_lossy().contains('\\').then(|| PathBuf::from(forward_slashes(path)));
        let turned_file = turned.as_ref().map(std::fs::read).filter(|result| !missing(result));
        let ignoring_case = || {
            let paths = [Some(path), turned.as_deref()].into_iter().flatten();
            paths.filter_map(find_ignoring_case).next().map(std::fs::read)
        };
        turned_file.or_else(ignoring_case).unwrap_or(as_given)
    }
}

/// Follows `path` from folder to folder. Takes the entry with the exact name or else the alphabetically first entry
/// whose name differs only in case.
fn find_ignoring_case(path: &Path) -> Option<PathBuf> {
    path.components().try_fold(PathBuf::new(), |folder, component| {
        let exact = folder.join(component);
        if !matches!(component, Component::Normal(_)) || exact.exists() {
            return Some(exact);
        }
        let wanted = component.as_os_str().to_string_lossy().to_lowercase();
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { &folder };
        let entries = std::fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path());
        entries.filter(|p| p.file_name().is_some_and(|name| name.to_string_lossy().to_lowercase() == wanted)).min()
    })
}

/// Files in memory, by path.
#[derive(Clone, Debug, Default)]
pub struct MemoryFiles(BTreeMap<String, Vec<u8>>);

impl MemoryFiles {
    /// Adds a file; replaces an earlier one of the same path.
    pub fn insert(&mut self, path: impl AsRef<Path>, bytes: impl Into<Vec<u8>>) {
        self.0.insert(tidy(path.as_ref()), bytes.into());
    }
}

impl<P: AsRef<Path>, B: Into<Vec<u8>>> FromIterator<(P, B)> for MemoryFiles {
    fn from_iter<I: IntoIterator<Item = (P, B)>>(files: I) -> Self {
        Self(files.into_iter().map(|(path, bytes)| (tidy(path.as_ref()), bytes.into())).collect())
    }
}

impl FileSource for MemoryFiles {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let wanted = tidy(path);
        let ignoring_case = || self.0.iter().find(|(name, _)| name.to_lowercase() == wanted.to_lowercase());
        self.0
            .get(&wanted)
            .or_else(|| ignoring_case().map(|(_, bytes)| bytes))
            .cloned()
            .ok_or_else(|| io::Error::new(io::ErrorKind::NotFound, "no such file"))
    }
}

fn forward_slashes(path: &Path) -> String {
    path.to_string_lossy().replace('\\', "/")
}

/// The path with `/` as separator and without `.` and `..`, so that each file has one spelling.
pub(super) fn tidy(path: &Path) -> String {
    clean(Path::new(&forward_slashes(path)))
}

/// The path without `.` and `..`.
pub(super) fn clean(path: &Path) -> String {
    let path = path.to_string_lossy();
    let mut parts = Vec::new();
    for part in path.split('/') {
        match part {
            "" | "." => {}
            ".." if parts.last().is_some_and(|&last| last != "..") => {
                parts.pop();
            }
            part => parts.push(part),
        }
    }
    let root = if path.starts_with('/') { "/" } else { "" };
    root.to_owned() + &parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_files_are_found_under_any_spelling() {
        let files = MemoryFiles::from_iter([("Scene/Textures/Brick.png", "brick")]);
        for path in ["Scene/Textures/Brick.png", "scene\\textures\\BRICK.PNG", "./Scene/x/../Textures/Brick.png"] {
            assert_eq!(files.read(Path::new(path)).expect(path), b"brick");
        }
        let missing = files.read(Path::new("Brick.png")).expect_err("another path");
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
    }

    #[test]
    fn disk_files_are_found_under_any_spelling() {
        let folder = std::env::temp_dir().join(format!("halflight-files-{}", std::process::id()));
        std::fs::create_dir_all(folder.join("Textures")).expect("a temporary folder");
        std::fs::write(folder.join("Textures/Brick.PNG"), "brick").expect("a temporary file");
        for path in
            ["Textures/Brick.PNG", "textures/brick.png", "TEXTURES\\brick.PNG", "./Textures/../textures/brick.png"]
        {
            assert_eq!(DiskFiles.read(&folder.join(path)).expect(path), b"brick");
        }
        // A backslash is part of the name where such a file is.
        if cfg!(unix) {
            std::fs::write(folder.join("two\\parts.obj"), "parts").expect("a temporary file");
            assert_eq!(DiskFiles.read(&folder.join("two\\parts.obj")).expect("as given"), b"parts");
        }
        let missing = DiskFiles.read(&folder.join("Textures/tile.png")).expect_err("no such file");
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
        std::fs::remove_dir_all(&folder).expect("the temporary folder is removed");
    }
}
