//! The readers, and what may be wrong with what they return.

use std::{
    path::Path,
    sync::LazyLock,
    time::{Duration, Instant},
};

use halflight_evaluator::experiment::grid::Grid;
use halflight_scenes::{MemoryFiles, Scene, load_scene};
use halflight_techniques::preset::Preset;

use super::{
    edits::{below, one_in},
    gltf,
    invalid::invalid,
    sky, text,
};
use crate::{oracle::Random, panics::caught};

/// A reader, by the file that it reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reader {
    /// A model.
    Obj,
    /// Its materials.
    Mtl,
    /// A binary glTF model.
    Glb,
    /// A glTF model as text.
    Gltf,
    /// An OpenEXR sky.
    Exr,
    /// A Radiance sky.
    Hdr,
    /// A scene.
    Scene,
    /// A grid.
    Grid,
    /// A preset.
    Preset,
}

pub(super) const READERS: [Reader; 9] = [
    Reader::Obj,
    Reader::Mtl,
    Reader::Glb,
    Reader::Gltf,
    Reader::Exr,
    Reader::Hdr,
    Reader::Scene,
    Reader::Grid,
    Reader::Preset,
];

/// The valid text files.
static TEXTS: LazyLock<[Vec<Vec<u8>>; 5]> = LazyLock::new(|| {
    [text::OBJ, text::MTL, text::SCENE, text::GRID, text::PRESET].map(|text| vec![text.as_bytes().to_vec()])
});

/// Far more than a file of some kilobytes takes, which is a millisecond at most.
const TOO_LONG: Duration = Duration::from_secs(5);
/// The begin of the fault of a reader that takes longer.
pub(super) const SLOW: &str = "takes long";
/// A reader that takes longer counts as hanging.
pub(super) const HANGS: Duration = Duration::from_secs(60);

impl Reader {
    pub(super) fn file(self) -> &'static str {
        match self {
            Self::Obj => "m.obj",
            Self::Mtl => "m.mtl",
            Self::Glb => "m.glb",
            Self::Gltf => "m.gltf",
            Self::Exr => "sky.exr",
            Self::Hdr => "sky.hdr",
            Self::Scene => "s.toml",
            Self::Grid => "g.toml",
            Self::Preset => "p.toml",
        }
    }

    /// Valid files, of every kind that the reader knows.
    pub(super) fn good(self) -> &'static [Vec<u8>] {
        match self {
            Self::Obj => &TEXTS[0],
            Self::Mtl => &TEXTS[1],
            Self::Glb => &gltf::BINARY,
            Self::Gltf => &gltf::TEXT,
            Self::Exr => &sky::EXR,
            Self::Hdr => &sky::HDR,
            Self::Scene => &TEXTS[2],
            Self::Grid => &TEXTS[3],
            Self::Preset => &TEXTS[4],
        }
    }

    /// A damaged file: a valid one with some edits of bytes, words and lines, or only noise.
    pub(super) fn damaged(self, random: &mut Random) -> Vec<u8> {
        if one_in(random, 20) {
            // Behind the letters that tell the format.
            let begin = usize::from(matches!(self, Self::Glb | Self::Exr | Self::Hdr)) * below(random, 12);
            let noise = (0..below(random, 300)).map(|_| below(random, 256) as u8);
            return self.good()[0].iter().take(begin).copied().chain(noise).collect();
        }
        match self {
            Self::Glb => gltf::damaged_binary(random),
            Self::Gltf => gltf::damaged_text(random),
            Self::Exr => sky::damaged_exr(random),
            Self::Hdr => sky::damaged_hdr(random),
            _ => text::damaged(random, &self.good()[0]),
        }
    }

    /// What the reader does wrong with these bytes, if anything.
    pub fn fault(self, bytes: &[u8]) -> Option<String> {
        let start = Instant::now();
        let fault = match caught(|| self.read(bytes)) {
            Err(message) => Some(format!("panics: {message}")),
            Ok(Err(sentence)) => bad_sentence(&sentence, self.file()),
            Ok(Ok(None)) => None,
            Ok(Ok(Some(scene))) => invalid(&scene),
        };
        let mut took = start.elapsed();
        if took > TOO_LONG {
            // On a busy computer another program may have taken the time: a second reading decides.
            let start = Instant::now();
            drop(caught(|| self.read(bytes)));
            took = took.min(start.elapsed());
        }
        fault.or_else(|| (took > TOO_LONG).then(|| format!("{SLOW}: {:.1} s", took.as_secs_f64())))
    }

    pub(super) fn read(self, bytes: &[u8]) -> Result<Option<Scene>, String> {
        let load = |first: &str, others: &[(&str, &[u8])]| {
            let mut files: MemoryFiles = others.iter().copied().collect();
            files.insert(self.file(), bytes);
            load_scene(&files, Path::new(first)).map(Some).map_err(|e| e.to_string())
        };
        let utf8 = || std::str::from_utf8(bytes).map_err(|_| format!("{} is not UTF-8", self.file()));
        let (obj, mtl) = (("m.obj", text::OBJ.as_bytes()), ("m.mtl", text::MTL.as_bytes()));
        match self {
            // A model without a scene file gets an automatic camera and sun.
            Self::Obj => load("m.obj", &[mtl]),
            Self::Mtl => load("m.obj", &[obj]),
            Self::Scene => load("s.toml", &[obj, mtl]),
            Self::Glb => load("m.glb", &[]),
            Self::Gltf => {
                load("s.toml", &[("s.toml", text::MODEL_SCENE.as_bytes()), (gltf::BESIDE, gltf::file_beside())])
            }
            Self::Exr => load("s.toml", &[("s.toml", text::EXR_SCENE.as_bytes()), obj, mtl]),
            Self::Hdr => load("s.toml", &[("s.toml", text::HDR_SCENE.as_bytes()), obj, mtl]),
            Self::Grid => Grid::parse(Path::new("g.toml"), utf8()?).map(|_| None).map_err(|e| e.to_string()),
            Self::Preset => Preset::read(Path::new("p.toml"), utf8()?).map(|_| None).map_err(|e| e.to_string()),
        }
    }
}

fn bad_sentence(sentence: &str, file: &str) -> Option<String> {
    if sentence.lines().count() != 1 {
        return Some(format!("the sentence has {} lines: {sentence:?}", sentence.lines().count()));
    }
    // A valid scene file may name a broken model.
    let names = [file, "s.toml", "m.obj", "m.mtl"].iter().any(|name| sentence.contains(name));
    (!names).then(|| format!("the sentence names no file: {sentence:?}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_valid_file_is_read() {
        for reader in READERS {
            for (number, bytes) in reader.good().iter().enumerate() {
                let fault = reader.read(bytes).err().or_else(|| reader.fault(bytes));
                assert_eq!(fault, None, "{reader:?} {number}");
            }
        }
    }

    #[test]
    fn the_model_reaches_every_part_of_its_reader() {
        let scene = Reader::Glb.read(&gltf::BINARY[0]).expect("valid").expect("a scene");
        assert!(scene.meshes.len() >= 7 && scene.textures.len() >= 2 && scene.lights.len() == 3, "{scene:?}");
        assert!(scene.moves.objects.len() >= 2 && scene.moves.lights.len() == 3 && scene.moves.camera.len() >= 2);
        let notes = scene.warnings.join("\n");
        for part in ["morph", "averaged over each face", "unlit", "orthographic", "lines", "border"] {
            assert!(notes.contains(part), "{part}: {notes}");
        }
    }
}
