//! Damaged files for every reader: models, materials, skies, scenes, grids and presets. A reader returns a valid scene or
//! one sentence that names the file. It never panics and never hangs.

use std::{
    path::Path,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::{Duration, Instant},
};

use halflight_evaluator::{Error, progress::Progress};
use halflight_native::files::write_whole;
use halflight_output::{OutputFolder, terminal};
use halflight_renderer::parameters::Settings;

use crate::{check::Check, oracle::Random};

mod edits;
mod gltf;
mod invalid;
mod reader;
mod sky;
mod text;

pub use reader::Reader;

use edits::below;
use reader::{HANGS, READERS};

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
        Check::new("random", "damaged models, materials, skies, scenes, grids and presets", "readers", &Settings::new())
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
        let bytes = reader.damaged(&mut random);
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
                // A slow reader would take hours over thousands of smaller files.
                let bytes = if fault.starts_with(reader::SLOW) { bytes } else { smallest(reader, &bytes) };
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
