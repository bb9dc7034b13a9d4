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
use halflight_output::{OutputFolder, terminal};
use halflight_renderer::parameters::Settings;
use halflight_scenes::{Light, MemoryFiles, Scene, load_scene};
use halflight_techniques::preset::Preset;

use crate::{check::Check, oracle::Random, panics::caught};

mod damage;

use damage::{below, damaged};

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
            Self::Obj => damage::OBJ,
            Self::Mtl => damage::MTL,
            Self::Scene => damage::SCENE,
            Self::Grid => damage::GRID,
            Self::Preset => damage::PRESET,
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
        fault.or_else(|| (took > TOO_LONG).then(|| format!("takes {:.1} s", took.as_secs_f64())))
    }

    fn read(self, bytes: &[u8]) -> Result<Option<Scene>, String> {
        let load = |file: &str| {
            let good = [("s.toml", damage::SCENE), ("m.obj", damage::OBJ), ("m.mtl", damage::MTL)];
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
                    let name = format!("fuzz_{}_{}", outcome.faults.len(), reader.file());
                    write(&OutputFolder::open(folder).claim(&name)?, &bytes)?;
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
                    let path = folder.unwrap_or_default().join(format!("fuzz_hangs_{name}"));
                    let written = write(&path, &bytes).map_or_else(|e| e.to_string(), |()| path.display().to_string());
                    terminal::note(format_args!("error: a reader hangs over damaged file {now}: {written}"));
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
