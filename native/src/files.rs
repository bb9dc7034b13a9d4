//! Files that are either whole or absent.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes `path` through a neighbouring `*.tmp` file and a rename, so that a killed run leaves no half file under the
/// real name and a reader never sees one being written. Missing parent folders are made.
///
/// # Errors
/// Whatever `fill` or the file system reports; the temporary file is removed then.
pub fn write_whole<E: From<io::Error>>(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<File>) -> Result<(), E>,
) -> Result<(), E> {
    if let Some(folder) = path.parent() {
        fs::create_dir_all(folder)?;
    }
    let partial = partial_name(path);
    let written = File::create(&partial).map_err(E::from).and_then(|file| {
        let mut file = BufWriter::new(file);
        fill(&mut file)?;
        file.flush()?;
        Ok(fs::rename(&partial, path)?)
    });
    if written.is_err() {
        // The first error is the one to report; a left-over *.tmp is overwritten by the next attempt.
        let _ = fs::remove_file(&partial);
    }
    written
}

/// Writes a new file to a folder and returns its name. Where the name is taken it gets a number, as in `preset (2).toml`:
/// a file that is there is never replaced.
///
/// # Errors
/// Whatever the file system reports.
pub fn write_new(folder: &Path, name: &str, contents: &[u8]) -> io::Result<String> {
    let (stem, extension) =
        name.rsplit_once('.').map_or((name, String::new()), |(stem, end)| (stem, format!(".{end}")));
    let mut free = name.to_owned();
    for number in 2.. {
        match File::create_new(folder.join(&free)) {
            Ok(mut file) => {
                let written = file.write_all(contents);
                if written.is_err() {
                    // The first error is the one to report.
                    let _ = fs::remove_file(folder.join(&free));
                }
                return written.map(|()| free);
            }
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                free = format!("{stem} ({number}){extension}")
            }
            Err(error) => return Err(error),
        }
    }
    Ok(free)
}

/// `cell.png` -> `cell.png.<process id>.tmp`: two processes that write the same file do not share a temporary file.
fn partial_name(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(format!(".{}.tmp", std::process::id()));
    name.into()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn a_failed_write_keeps_the_old_file_and_no_temporary() {
        let folder = std::env::temp_dir().join(format!("halflight-files-{}", std::process::id()));
        let path = folder.join("deep/results.json");
        write_whole(&path, |file| file.write_all(b"first")).unwrap();
        let failed = write_whole(&path, |file| {
            file.write_all(b"second, ha")?;
            Err(io::Error::other("killed"))
        });
        assert_eq!(failed.unwrap_err().to_string(), "killed");
        assert_eq!(fs::read(&path).unwrap(), b"first");
        assert_eq!(fs::read_dir(path.parent().unwrap()).unwrap().count(), 1);
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_new_file_never_replaces_another() {
        let folder = std::env::temp_dir().join(format!("halflight-new-files-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let names: Vec<String> =
            (0..3).map(|i| write_new(&folder, "preset.toml", format!("{i}").as_bytes()).unwrap()).collect();
        assert_eq!(names, ["preset.toml", "preset (2).toml", "preset (3).toml"]);
        assert_eq!(fs::read(folder.join("preset.toml")).unwrap(), b"0");
        assert!(write_new(&folder.join("preset.toml"), "a", b"").is_err(), "a file is no folder");
        fs::remove_dir_all(folder).unwrap();
    }
}
