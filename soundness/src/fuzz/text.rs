//! Valid text files, and damage to them.

use super::edits::{any, below, edit_lines, replace_word};
use crate::oracle::Random;

/// A valid model.
pub(super) const OBJ: &str = "# a model\nmtllib m.mtl\no first\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1e0\n\
                   vt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 0.25 0\nvn 0 0 1\nvn 0 0.7 0.7\nusemtl red\ns 1\ng part one\n\
                   f 1/1/1 2/2/1 3/3/1 4/4/1\nf 1//1 2//2 5//1\nusemtl glow\ns off\nf -1 -2 -3\nf 1/1 2/2 3/3\nf 1 2 5\n";
/// Its materials.
pub(super) const MTL: &str = "newmtl red\nKa 0 0 0\nKd 0.8 0.1 0.1\nKs 0.5 0.5 0.5\nNs 32\nKe 0 0 0\nd 1.0\nTr 0.0\nillum 2\n\
                   map_Kd -s 1 1 1 wall.png\nmap_d mask.png\n\nnewmtl glow\nKd 0.5 0.5 0.5\nKe 3 2 1\nKd spectral x\n";
/// A scene with the model.
pub(super) const SCENE: &str = "name = \"fuzzed\"\n[[model]]\npath = \"m.obj\"\ntransform = { translate = [0.0, 1.0, 0.0], \
                     rotate_degrees = [0.0, 90.0, 0.0], scale = 2.0 }\npivot = [0.0, 0.0, 0.0]\nmoves = [\n  { frame = 0 },\n  \
                     { frame = 10, translate = [1.0, 0.0, 0.0], rotate_degrees = [0.0, 0.0, 90.0], scale = [1.0, 1.0, 1.0] },\n]\n\
                     receive_only = false\n[camera]\neye = [0.0, 1.0, 5.0]\ntarget = [0.0, 0.5, 0.0]\nup = [0.0, 1.0, 0.0]\n\
                     vertical_fov_degrees = 60.0\nmoves = [{ frame = 0, eye = [0.0, 1.0, 5.0], target = [0.0, 0.0, 0.0], cut = true }]\n\
                     [[light]]\nkind = \"spot\"\nposition = [0.0, 1.95, 0.0]\ndirection = [0.15, -1.0, 0.1]\n\
                     intensity = [4.0, 3.7, 3.2]\nhalf_angle_degrees = 40.0\nfull_intensity_half_angle_degrees = 35.0\n\
                     [[light]]\nkind = \"directional\"\ndirection = [0.3, -1.0, 0.1]\nirradiance = [10.0, 9.5, 8.5]\n";
/// A scene with a glTF model, whose camera and lights it takes.
pub(super) const MODEL_SCENE: &str = "[[model]]\npath = \"m.gltf\"\ntransform = { translate = [5.0, 1.0, 0.0], \
                     rotate_degrees = [0.0, 90.0, 10.0], scale = 2.0 }\n";
/// A scene under an OpenEXR sky.
pub(super) const EXR_SCENE: &str = "[[model]]\npath = \"m.obj\"\n[camera]\neye = [0.0, 1.0, 5.0]\n\
                     target = [0.0, 0.5, 0.0]\n[environment]\nmap = \"sky.exr\"\n";
/// A scene under a Radiance sky.
pub(super) const HDR_SCENE: &str = "[[model]]\npath = \"m.obj\"\n[camera]\neye = [0.0, 1.0, 5.0]\n\
                     target = [0.0, 0.5, 0.0]\n[environment]\nmap = \"sky.hdr\"\n";
/// A valid grid.
pub(super) const GRID: &str = "preset = \"soler2009_fig6\"\nscenes = [\"a.toml\", \"b.toml\"]\nsize = [\"64x36\", \"1280x720\"]\nframes = 3\n\
                    seed = 7\ndirect = \"truth\"\ntruth_samples = 16\ntruth_rel_error = 0.5\ntemporal = false\n[[sweep]]\n\
                    technique = \"hierarchical\"\n[sweep.fixed]\nradius = 20\n[sweep.grid]\nlevels = [4, 5]\n\
                    start_resolution = [\"half\", \"quarter\"]\n[[sweep]]\ntechnique = \"none\"\n";
/// A valid preset.
pub(super) const PRESET: &str = "technique = \"hierarchical\"\n\n[settings]\nsamples = 16\nradius = 20.5\nring = \"2009\"\n\
                      start_resolution = \"half\"\n\"direct.shadow_map_size\" = 1024\n";

/// Words that readers know, and numbers at the limits of their ranges.
const WORDS: &[&str] = &[
    "nan",
    "inf",
    "-inf",
    "1e400",
    "-1e400",
    "1e-400",
    "1e38",
    "3.5e38",
    "-0",
    "0",
    "1",
    "-1",
    "0.5",
    "2",
    "4294967296",
    "9223372036854775808",
    "-2147483649",
    "1_000",
    "0x10",
    "true",
    "false",
    "\"\"",
    "\"x\"",
    "[]",
    "{}",
    "[[",
    "]]",
    "=",
    ",",
    "#",
    "\\",
    "/",
    "//",
    "1/1",
    "1//1",
    "1/2/3",
    "-1/-1/-1",
    "0/0/0",
    "f",
    "v",
    "vt",
    "vn",
    "usemtl",
    "mtllib",
    "s",
    "o",
    "g",
    "newmtl",
    "Kd",
    "Ke",
    "Ks",
    "Ns",
    "map_Kd",
    "map_d",
    "d",
    "Tr",
    "m.mtl",
    "m.obj",
    "s.toml",
    "path",
    "[[model]]",
    "[camera]",
    "[[light]]",
    "[[sweep]]",
    "[sweep.grid]",
    "[settings]",
    "technique",
    "hierarchical",
    "exhaustive",
    "none",
    "samples",
    "levels",
    "radius",
    "moves",
    "frame",
    "cut",
    "generator = \"bars\"",
    "\u{feff}",
    "é",
    "\u{0}",
    "\r\n",
    "\t",
    "1x1",
    "0x0",
    "16384x16385",
    "..",
    "\"../m.obj\"",
    "1e",
    "+",
    "--",
    "1.2.3",
];

/// The valid files, parts of which damage others.
const FILES: [&str; 5] = [OBJ, MTL, SCENE, GRID, PRESET];

/// A damaged copy of a valid file.
pub(super) fn damaged(random: &mut Random, good: &[u8]) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..=below(random, 5) {
        let at = below(random, bytes.len().max(1));
        match below(random, 10) {
            0 if !bytes.is_empty() => bytes[at] = below(random, 256) as u8,
            1 => bytes.insert(
                at.min(bytes.len()),
                WORDS[below(random, WORDS.len())].as_bytes().first().copied().unwrap_or(0),
            ),
            2 if !bytes.is_empty() => drop(bytes.remove(at)),
            3 if below(random, 4) == 0 => bytes.truncate(at),
            4 => edit_lines(&mut bytes, random),
            5 => {
                // A part of another file.
                let other = any(random, &FILES).as_bytes();
                let from = below(random, other.len());
                let to = (from + below(random, 60)).min(other.len());
                drop(bytes.splice(at.min(bytes.len())..at.min(bytes.len()), other[from..to].iter().copied()));
            }
            _ => replace_word(&mut bytes, random, WORDS),
        }
    }
    bytes
}
