//! Where a scene comes from.

use std::path::PathBuf;

use halflight_scenes::{Scene, SceneError, bulk, bundled};
use serde::{Deserialize, Serialize};

use crate::scenes::{Opened, dropped};

/// A file that was dropped or chosen.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct File {
    /// Its name, with folders where it is known in which it was.
    pub name: String,
    /// Its contents.
    #[serde(with = "bulk")]
    pub bytes: Vec<u8>,
}

/// Where a scene comes from. It can be read again at any time.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Source {
    /// A bundled scene, by name.
    Bundled(String),
    /// A file on disk, with the files beside it that it names.
    Disk(PathBuf),
    /// Files that were dropped together. An environment map without a scene lights the other source.
    Files(Vec<File>, Option<Box<Self>>),
    /// Another source as a static scene: as it is in one frame of its animation.
    Posed(Box<Self>, u32),
}

impl Source {
    /// Reads everything that it contains.
    ///
    /// # Errors
    /// One sentence: which file is missing, or what is wrong in a file, with its line.
    pub fn read(self) -> Result<Opened, SceneError> {
        let only = |scene: Scene| Opened { scene: Some(scene), ..Opened::default() };
        let mut opened = match self {
            Self::Bundled(name) => only(bundled::scene(&name)?),
            Self::Disk(path) => only(halflight_scenes::load_scene(&halflight_scenes::DiskFiles, &path)?),
            Self::Files(files, under) => {
                let mut opened = dropped(files.into_iter().map(|file| (file.name, file.bytes)).collect())?;
                if let (Some(environment), Some(under)) = (opened.environment.take(), under) {
                    opened.scene = under.read()?.scene;
                    if let Some(scene) = &mut opened.scene {
                        scene.environment = Some(environment);
                        opened.is_lit = true;
                    }
                }
                opened
            }
            Self::Posed(source, frame) => {
                let opened = source.read()?;
                let scene = opened.scene.map(|scene| scene.posed(frame));
                Opened { scene, ..opened }
            }
        };
        if let Some(scene) = &mut opened.scene {
            opened.warnings.append(&mut scene.warnings);
        }
        Ok(opened)
    }
}
