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
        // The first error is the one worth telling; a left-over *.tmp is overwritten by the next attempt.
        let _ = fs::remove_file(&partial);
    }
    written
}

/// `cell.png` -> `cell.png.<process id>.tmp`: two processes that write the same file do not meet in one temporary.
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
}
