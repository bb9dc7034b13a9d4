//! Damaged files for every reader: models, materials, scenes, grids and presets. A reader returns a valid scene or one
//! sentence that names the file. It never panics and never hangs.

use std::{
    path::Path,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use glam::Vec3;
use halflight_evaluator::{Error, experiment::grid::Grid, progress::Progress};
use halflight_native::files::write_whole;
use halflight_renderer::parameters::Settings;
use halflight_scenes::{Light, MemoryFiles, Scene, load_scene};
use halflight_techniques::preset::Preset;

use crate::{check::Check, oracle::Random, panics::caught};

/// A reader, by the file that it reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reader {
    /// A model.
    Obj,
    /// Its materials.
    Mtl,
    /// A scene.
    Scene,
    /// A grid.
    Grid,
    /// A preset.
    Preset,
}

const READERS: [Reader; 5] = [Reader::Obj, Reader::Mtl, Reader::Scene, Reader::Grid, Reader::Preset];

const OBJ: &str = "# a model\nmtllib m.mtl\no first\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1e0\n\
                   vt 0 0\nvt 1 0\nvt 1 1\nvt 0.5 0.25 0\nvn 0 0 1\nvn 0 0.7 0.7\nusemtl red\ns 1\ng part one\n\
                   f 1/1/1 2/2/1 3/3/1 4/4/1\nf 1//1 2//2 5//1\nusemtl glow\ns off\nf -1 -2 -3\nf 1/1 2/2 3/3\nf 1 2 5\n";
const MTL: &str = "newmtl red\nKa 0 0 0\nKd 0.8 0.1 0.1\nKs 0.5 0.5 0.5\nNs 32\nKe 0 0 0\nd 1.0\nTr 0.0\nillum 2\n\
                   map_Kd -s 1 1 1 wall.png\nmap_d mask.png\n\nnewmtl glow\nKd 0.5 0.5 0.5\nKe 3 2 1\nKd spectral x\n";
const SCENE: &str = "name = \"fuzzed\"\n[[model]]\npath = \"m.obj\"\ntransform = { translate = [0.0, 1.0, 0.0], \
                     rotate_degrees = [0.0, 90.0, 0.0], scale = 2.0 }\npivot = [0.0, 0.0, 0.0]\nmoves = [\n  { frame = 0 },\n  \
                     { frame = 10, translate = [1.0, 0.0, 0.0], rotate_degrees = [0.0, 0.0, 90.0], scale = [1.0, 1.0, 1.0] },\n]\n\
                     receive_only = false\n[camera]\neye = [0.0, 1.0, 5.0]\ntarget = [0.0, 0.5, 0.0]\nup = [0.0, 1.0, 0.0]\n\
                     vertical_fov_degrees = 60.0\nmoves = [{ frame = 0, eye = [0.0, 1.0, 5.0], target = [0.0, 0.0, 0.0], cut = true }]\n\
                     [[light]]\nkind = \"spot\"\nposition = [0.0, 1.95, 0.0]\ndirection = [0.15, -1.0, 0.1]\n\
                     intensity = [4.0, 3.7, 3.2]\nhalf_angle_degrees = 40.0\nfull_intensity_half_angle_degrees = 35.0\n\
                     [[light]]\nkind = \"directional\"\ndirection = [0.3, -1.0, 0.1]\nirradiance = [10.0, 9.5, 8.5]\n";
const GRID: &str = "preset = \"soler2009_fig6\"\nscenes = [\"a.toml\", \"b.toml\"]\nsize = [\"64x36\", \"1280x720\"]\nframes = 3\n\
                    seed = 7\ndirect = \"truth\"\ntruth_samples = 16\ntruth_rel_error = 0.5\ntemporal = false\n[[sweep]]\n\
                    technique = \"hierarchical\"\n[sweep.fixed]\nradius = 20\n[sweep.grid]\nlevels = [4, 5]\n\
                    start_resolution = [\"half\", \"quarter\"]\n[[sweep]]\ntechnique = \"none\"\n";
const PRESET: &str = "technique = \"hierarchical\"\n\n[settings]\nsamples = 16\nradius = 20.5\nring = \"2009\"\n\
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

impl Reader {
    fn file(self) -> &'static str {
        match self {
            Self::Obj => "m.obj",
            Self::Mtl => "m.mtl",
            Self::Scene => "s.toml",
            Self::Grid => "g.toml",
            Self::Preset => "p.toml",
        }
    }

    fn good(self) -> &'static str {
        match self {
            Self::Obj => OBJ,
            Self::Mtl => MTL,
            Self::Scene => SCENE,
            Self::Grid => GRID,
            Self::Preset => PRESET,
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
        let took = start.elapsed();
        fault.or_else(|| (took > TOO_LONG).then(|| format!("takes {:.1} s", took.as_secs_f64())))
    }

    fn read(self, bytes: &[u8]) -> Result<Option<Scene>, String> {
        let load = |file: &str| {
            let good = [("s.toml", SCENE), ("m.obj", OBJ), ("m.mtl", MTL)];
            let with = |(name, text): (&'static str, &str)| {
                (name, if name == file { bytes.to_vec() } else { text.as_bytes().to_vec() })
            };
            let files: MemoryFiles = good.into_iter().map(with).collect();
            // A model without a scene file gets an automatic camera and sun.
            let first = if file == "s.toml" { "s.toml" } else { "m.obj" };
            load_scene(&files, Path::new(first)).map(Some).map_err(|e| e.to_string())
        };
        let text = || std::str::from_utf8(bytes).map_err(|_| format!("{} is not UTF-8", self.file()));
        match self {
            Self::Obj | Self::Mtl | Self::Scene => load(self.file()),
            Self::Grid => Grid::parse(Path::new("g.toml"), text()?).map(|_| None).map_err(|e| e.to_string()),
            Self::Preset => Preset::read(Path::new("p.toml"), text()?).map(|_| None).map_err(|e| e.to_string()),
        }
    }
}

/// Far more than a file of two kilobytes takes, which is some ten microseconds.
const TOO_LONG: Duration = Duration::from_secs(5);
/// A reader that takes longer counts as hanging.
const HANGS: Duration = Duration::from_secs(60);

fn bad_sentence(sentence: &str, file: &str) -> Option<String> {
    if sentence.lines().count() != 1 {
        return Some(format!("the sentence has {} lines: {sentence:?}", sentence.lines().count()));
    }
    // A valid scene file may name a broken model.
    let names = [file, "s.toml", "m.obj", "m.mtl"].iter().any(|name| sentence.contains(name));
    (!names).then(|| format!("the sentence names no file: {sentence:?}"))
}

/// What is invalid in a loaded scene, if anything.
fn invalid(scene: &Scene) -> Option<String> {
    let finite = |v: &[f32]| v.iter().all(|v| v.is_finite());
    for mesh in &scene.meshes {
        let count = mesh.positions.len();
        if mesh.normals.len() != count || mesh.uvs.len() != count || !mesh.indices.len().is_multiple_of(3) {
            return Some(format!("mesh {:?} has lists of different lengths", mesh.name));
        }
        if mesh.indices.iter().any(|&i| i as usize >= count) || mesh.material >= scene.materials.len() {
            return Some(format!("mesh {:?} has an index out of range", mesh.name));
        }
        if mesh.object.is_some_and(|object| object >= scene.moves.objects.len()) {
            return Some(format!("mesh {:?} moves with nothing", mesh.name));
        }
        if !finite(mesh.positions.as_flattened()) || !finite(mesh.uvs.as_flattened()) {
            return Some(format!("mesh {:?} has a number that is not finite", mesh.name));
        }
        if mesh.normals.iter().any(|&n| (Vec3::from(n).length() - 1.0).abs() > 1e-3 || !finite(&n)) {
            return Some(format!("mesh {:?} has a normal that is not of unit length", mesh.name));
        }
    }
    for material in &scene.materials {
        let unit = |v: &[f32]| v.iter().all(|v| (0.0..=1.0).contains(v));
        let glow = material.emission.iter().all(|v| v.is_finite() && *v >= 0.0);
        if !unit(&material.albedo)
            || !unit(&material.specular)
            || !unit(&material.translucency)
            || !material.absorption.iter().all(|v| (0.0..=1e9).contains(v))
            || !glow
            || !(0.0..=1e6).contains(&material.phong_exponent)
        {
            return Some(format!("material {:?} is out of range", material.name));
        }
        let textures = [material.albedo_texture, material.alpha_texture];
        if textures.into_iter().flatten().any(|texture| texture >= scene.textures.len()) {
            return Some(format!("material {:?} has a texture that is not there", material.name));
        }
    }
    let camera = scene.camera;
    let view: Vec<f32> = camera.view_matrix().to_cols_array().to_vec();
    if !finite(&view) || !(1.0..=170.0).contains(&camera.vertical_fov_degrees) {
        return Some("the camera is not finite".into());
    }
    let lit = scene.lights.iter().all(|light| match light {
        Light::Directional { direction, irradiance } => finite(direction) && finite(irradiance),
        Light::Point { position, intensity } => finite(position) && finite(intensity),
        Light::Spot { position, direction, intensity, .. } => {
            finite(position) && finite(direction) && finite(intensity)
        }
    });
    (!lit).then(|| "a light is not finite".into())
}

/// What a run found.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Number of files.
    pub run: u64,
    /// Number of files that were accepted, estimated from every 64th.
    pub accepted: u64,
    /// Faults as text, each with the smallest file that shows it.
    pub faults: Vec<(Reader, String, Vec<u8>)>,
}

impl Outcome {
    /// The outcome as a check of a table.
    pub fn check(&self) -> Check {
        let reason = "each is read as a valid scene or refused by one sentence that names the file";
        let faults: Vec<&str> = self.faults.iter().map(|(_, fault, _)| fault.as_str()).collect();
        let share = self.accepted as f64 / self.run.max(1) as f64;
        Check::new("random", "damaged models, materials, scenes, grids and presets", "readers", &Settings::new())
            .bounded("faults", faults.len() as f64, 0.0, reason)
            .detail(format!("{} files, {:.0} % of them accepted; {}", self.run, 100.0 * share, faults.join("; ")))
    }
}

/// A random whole number below `most`.
fn below(random: &mut Random, most: usize) -> usize {
    ((random.unit() * most as f64) as usize).min(most.saturating_sub(1))
}

/// A damaged file: a valid one with some edits of bytes, words and lines, or only noise.
fn damaged(random: &mut Random, reader: Reader) -> Vec<u8> {
    if below(random, 20) == 0 {
        return (0..below(random, 300)).map(|_| below(random, 256) as u8).collect();
    }
    let mut bytes = reader.good().as_bytes().to_vec();
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
                let other = READERS[below(random, READERS.len())].good().as_bytes();
                let from = below(random, other.len());
                let to = (from + below(random, 60)).min(other.len());
                drop(bytes.splice(at.min(bytes.len())..at.min(bytes.len()), other[from..to].iter().copied()));
            }
            _ => replace_word(&mut bytes, random),
        }
    }
    bytes
}

/// Duplicates, deletes or swaps lines.
fn edit_lines(bytes: &mut Vec<u8>, random: &mut Random) {
    let mut lines: Vec<Vec<u8>> = bytes.split(|&b| b == b'\n').map(<[u8]>::to_vec).collect();
    let (a, b) = (below(random, lines.len()), below(random, lines.len()));
    match below(random, 3) {
        0 => drop(lines.remove(a)),
        1 => lines.swap(a, b),
        _ => {
            let line = lines[a].clone();
            // Sometimes many copies of one line, which reveals quadratic run time.
            let times = if below(random, 50) == 0 { 500 } else { 1 };
            (0..times).for_each(|_| lines.insert(b, line.clone()));
        }
    }
    *bytes = lines.join(&b'\n');
}

/// Replaces one word by another: a number, a key or punctuation.
fn replace_word(bytes: &mut Vec<u8>, random: &mut Random) {
    let part = |b: u8| b.is_ascii_alphanumeric() || matches!(b, b'.' | b'-' | b'_' | b'/');
    let at = below(random, bytes.len().max(1));
    let Some(begin) = (at..bytes.len()).find(|&i| part(bytes[i])) else { return };
    let begin = (0..=begin).rev().take_while(|&i| part(bytes[i])).last().unwrap_or(begin);
    let end = (begin..bytes.len()).find(|&i| !part(bytes[i])).unwrap_or(bytes.len());
    drop(bytes.splice(begin..end, WORDS[below(random, WORDS.len())].bytes()));
}

/// The smallest file with the same fault that repeated deletion finds.
fn smallest(reader: Reader, bytes: &[u8]) -> Vec<u8> {
    let kind = |fault: &str| fault.split(':').next().unwrap_or_default().to_owned();
    let wanted = reader.fault(bytes).map(|fault| kind(&fault));
    let same = |bytes: &[u8]| reader.fault(bytes).map(|fault| kind(&fault)) == wanted;
    let mut best = bytes.to_vec();
    let mut piece = (best.len() / 2).max(1);
    loop {
        let mut at = 0;
        while at < best.len() {
            let mut less = best.clone();
            drop(less.drain(at..(at + piece).min(best.len())));
            if same(&less) { best = less } else { at += piece }
        }
        if piece == 1 {
            return best;
        }
        piece /= 2;
    }
}

/// Reads `count` damaged files, the same ones for the same seed. Faults are written to `folder` where one is given. A reader
/// that hangs ends the process with exit code 1 after its file is written.
///
/// # Errors
/// Where a fault cannot be written.
pub fn run(count: u64, seed: u64, folder: Option<&Path>) -> Result<Outcome, Error> {
    let mut random = Random(seed.wrapping_add(0x9E37_79B9_7F4A_7C15));
    let mut outcome = Outcome::default();
    let watch = Watch::start(folder);
    let progress = Progress::new("damaged files", count);
    for number in 0..count {
        let reader = READERS[below(&mut random, READERS.len())];
        let bytes = damaged(&mut random, reader);
        watch.begin(number, reader, &bytes);
        outcome.run += 1;
        if number % 1000 == 0 {
            progress.set(number, &format!("{} faults", outcome.faults.len()));
        }
        match reader.fault(&bytes) {
            None => outcome.accepted += u64::from(number % 64 == 0 && reader.read(&bytes).is_ok()),
            Some(fault) => {
                // After 20 faults, only those of a new kind are kept.
                let known = outcome
                    .faults
                    .iter()
                    .any(|(r, f, _)| *r == reader && f.split(':').next() == fault.split(':').next());
                if known && outcome.faults.len() > 20 {
                    continue;
                }
                let bytes = smallest(reader, &bytes);
                let fault = reader.fault(&bytes).unwrap_or(fault);
                if let Some(folder) = folder {
                    write(&folder.join(format!("fuzz_{}_{}", outcome.faults.len(), reader.file())), &bytes)?;
                }
                outcome.faults.push((reader, fault, bytes));
            }
        }
    }
    // Only every 64th was counted.
    outcome.accepted *= 64;
    progress.finish(&format!("{count} damaged files, {} faults", outcome.faults.len()));
    Ok(outcome)
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Error> {
    write_whole(path, |file| std::io::Write::write_all(file, bytes))
        .map_err(|e: std::io::Error| Error::unwritable(path, e))
}

/// The file that is being read, watched by a thread.
struct Watch {
    number: Arc<AtomicU64>,
    file: Arc<Mutex<(Option<Reader>, Vec<u8>)>>,
}

/// The number that ends the thread.
const DONE: u64 = u64::MAX;

impl Watch {
    fn start(folder: Option<&Path>) -> Self {
        let watch = Self { number: Arc::default(), file: Arc::default() };
        let (number, file, folder) = (watch.number.clone(), watch.file.clone(), folder.map(Path::to_path_buf));
        std::thread::spawn(move || {
            let mut last = (0, Instant::now());
            loop {
                std::thread::sleep(Duration::from_millis(500));
                let now = number.load(Ordering::Relaxed);
                if now == DONE {
                    return;
                }
                if now != last.0 {
                    last = (now, Instant::now());
                } else if last.1.elapsed() > HANGS {
                    let (reader, bytes) = file.lock().unwrap_or_else(PoisonError::into_inner).clone();
                    let name = reader.map_or("file", Reader::file);
                    let place = folder.unwrap_or_default().join(format!("fuzz_hangs_{name}"));
                    let written =
                        write(&place, &bytes).map_or_else(|e| e.to_string(), |()| place.display().to_string());
                    eprintln!("error: a reader hangs over damaged file {now}: {written}");
                    std::process::exit(1);
                }
            }
        });
        watch
    }

    fn begin(&self, number: u64, reader: Reader, bytes: &[u8]) {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.0 = Some(reader);
        file.1.clear();
        file.1.extend_from_slice(bytes);
        self.number.store(number, Ordering::Relaxed);
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        self.number.store(DONE, Ordering::Relaxed);
    }
}
