//! A cache on disk. An entry is stored under the hash of everything that it depends on.

use std::{
    env, fs, io,
    io::Write,
    path::{Path, PathBuf},
};

use sha2::{Digest, Sha256};

use crate::files::write_whole;

/// A folder of entries. An entry is its bytes followed by their SHA-256, so that damage is detected.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Cache {
    folder: PathBuf,
}

impl Cache {
    /// The cache in this folder. The folder is made when the first entry is stored.
    pub fn at(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into() }
    }

    /// The cache in the folder that the environment variable `HALFLIGHT_CACHE` names. Without it, the cache is in
    /// `.halflight-cache` of the working directory.
    pub fn standard() -> Self {
        Self::at(env::var_os("HALFLIGHT_CACHE").filter(|v| !v.is_empty()).unwrap_or_else(|| ".halflight-cache".into()))
    }

    /// Where the cache is.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The file of an entry.
    pub fn path(&self, kind: &str, key: &Key) -> PathBuf {
        self.folder.join(format!("{key}.{kind}"))
    }

    /// The entry, or `None` where there is none.
    ///
    /// # Errors
    /// One sentence where the entry cannot be read or is damaged. The caller should recompute and replace it.
    pub fn load(&self, kind: &str, key: &Key) -> Result<Option<Vec<u8>>, String> {
        let path = self.path(kind, key);
        let mut bytes = match fs::read(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => {
                return Err(format!("cache entry {} cannot be read ({error}); it is computed again", path.display()));
            }
            Ok(bytes) => bytes,
        };
        let length = bytes.len().saturating_sub(32);
        let intact = bytes.len() >= 32 && Sha256::digest(&bytes[..length])[..] == bytes[length..];
        bytes.truncate(length);
        if intact {
            Ok(Some(bytes))
        } else {
            Err(format!("cache entry {} is damaged; it is computed again", path.display()))
        }
    }

    /// Stores an entry: whole or not at all.
    ///
    /// # Errors
    /// One sentence where it cannot be written, for example on a full disk.
    pub fn store(&self, kind: &str, key: &Key, bytes: &[u8]) -> Result<(), String> {
        let path = self.path(kind, key);
        write_whole(&path, |file| {
            file.write_all(bytes)?;
            file.write_all(&Sha256::digest(bytes))
        })
        .map_err(|error: io::Error| {
            format!("cache entry {} cannot be written ({error}); set HALFLIGHT_CACHE to another folder", path.display())
        })
    }
}

/// The hash of everything that an entry depends on, in hexadecimal.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Key(String);

impl Key {
    /// A hash that was printed before.
    pub fn parse(text: &str) -> Self {
        Self(text.to_owned())
    }

    /// The hash as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl std::fmt::Display for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

/// Hashes everything that a result depends on into a [`Key`].
#[derive(Clone, Default)]
pub struct KeyInputs(Sha256);

impl KeyInputs {
    /// Adds plain values, preceded by their number, so that two lists never run into each other.
    pub fn add<T: bytemuck::NoUninit>(&mut self, values: &[T]) -> &mut Self {
        self.0.update((values.len() as u64).to_le_bytes());
        self.0.update(bytemuck::cast_slice(values));
        self
    }

    /// Adds a text.
    pub fn add_text(&mut self, text: &str) -> &mut Self {
        self.add(text.as_bytes())
    }

    /// The hash of what was added.
    pub fn key(self) -> Key {
        Key(self.0.finalize()[..16].iter().map(|byte| format!("{byte:02x}")).collect())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn key(values: &[u32]) -> Key {
        let mut inputs = KeyInputs::default();
        inputs.add(values);
        inputs.key()
    }

    #[test]
    fn a_stored_entry_is_loaded_and_a_damaged_one_is_reported() {
        let cache = Cache::at(env::temp_dir().join(format!("halflight-cache-{}", std::process::id())));
        let key = key(&[1, 2]);
        assert_eq!(cache.load("truth", &key), Ok(None));
        cache.store("truth", &key, b"light").unwrap();
        assert_eq!(cache.load("truth", &key), Ok(Some(b"light".to_vec())));
        let path = cache.path("truth", &key);
        let mut bytes = fs::read(&path).unwrap();
        bytes[0] ^= 1;
        fs::write(&path, &bytes).unwrap();
        assert!(cache.load("truth", &key).unwrap_err().contains("is damaged"));
        fs::write(&path, b"short").unwrap();
        assert!(cache.load("truth", &key).unwrap_err().contains("is damaged"));
        fs::remove_dir_all(cache.folder()).unwrap();
    }

    #[test]
    fn lists_do_not_run_into_each_other() {
        let two = |a: &[u32], b: &[u32]| {
            let mut inputs = KeyInputs::default();
            inputs.add(a).add(b);
            inputs.key()
        };
        assert_ne!(two(&[1], &[2, 3]), two(&[1, 2], &[3]));
        assert_eq!(key(&[7]), key(&[7]));
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_reported() {
        let file = env::temp_dir().join(format!("halflight-cache-file-{}", std::process::id()));
        fs::write(&file, b"in the way").unwrap();
        let message = Cache::at(&file).store("truth", &key(&[1]), b"light").unwrap_err();
        assert!(message.contains("cannot be written") && message.contains("HALFLIGHT_CACHE"), "{message}");
        fs::remove_file(file).unwrap();
    }
}
