//! Faults from outside: a killed process, a full disk, files that vanish, a lost device. Finished cells stay intact,
//! `--resume` continues from them, and the user gets one sentence.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Output, Stdio},
    sync::{
        OnceLock,
        atomic::{AtomicBool, Ordering},
    },
    thread::sleep,
    time::{Duration, Instant},
};

use halflight_evaluator::{
    Error,
    experiment::{
        RunOptions,
        cell_log::{CELLS as LOG, Record},
        grid::Grid,
        run as run_grid,
        shard::Shard,
    },
    measurement::{Measurement, read_json},
};
use halflight_native::{AdapterChoice, NativeGpu};
use halflight_renderer::parameters::Settings;
use halflight_techniques::invocation::Invocation;

use crate::{check::Check, oracle::Random, panics::caught};

/// A program with this environment variable runs the evaluator's command line in place of its own.
pub const AS_EVALUATOR: &str = "HALFLIGHT_SOUNDNESS_AS_EVALUATOR";

/// Group of the rows.
pub(crate) const GROUP: &str = "faults";

/// Number of times that a run is killed.
const KILLS: u32 = 10;

const GRID: &str = "scenes = ['scene.toml']\nsize = ['40x32']\nframes = 2\ntruth_samples = 4\ntruth_rel_error = 1.0\n\
                    [[sweep]]\ntechnique = 'hierarchical'\ngrid = { samples = [4, 8, 16], form_factor = ['eq3', 'eq4'] }\n\
                    [[sweep]]\ntechnique = 'none'\n";
/// Cells of the grid.
const CELLS: usize = 7;

/// Runs every row in this folder, which is created and removed. `program` must be an evaluator while [`AS_EVALUATOR`] is in
/// its environment.
///
/// # Errors
/// Where the folder cannot be written or the program cannot be started.
pub fn run(program: &Path, folder: &Path, adapter: &str) -> Result<Vec<Check>, Error> {
    let unbroken = OnceLock::new();
    let runs = Runs { program: program.into(), folder: folder.into(), adapter: adapter.into(), unbroken };
    runs.prepare()?;
    type Row = fn(&Runs) -> Result<Fault, Error>;
    let rows: [(&str, Row); 5] = [
        ("killed at ten random moments", killed),
        ("a full disk", full_disk),
        ("scene and model vanish while it runs", vanished_scene),
        ("the report's folder vanishes while it runs", vanished_folder),
        ("the device is lost while it runs", lost_device),
    ];
    let mut checks = Vec::new();
    for (row, run) in rows {
        let check = Check::new(GROUP, row, "evaluator run", &Settings::new());
        let reason = "finished cells stay intact, --resume completes with the same errors, and there is one sentence";
        checks.push(match caught(|| run(&runs)) {
            Ok(Ok(fault)) => check.bounded("faults", fault.wrong.len() as f64, 0.0, reason).detail(fault.words()),
            Ok(Err(error)) => check.bounded("faults", 1.0, 0.0, reason).detail(error.to_string()),
            Err(message) => check.bounded("faults", 1.0, 0.0, reason).detail(format!("panics: {message}")),
        });
    }
    // A file that cannot be removed does no harm.
    drop(fs::remove_dir_all(folder));
    Ok(checks)
}

/// What a row found.
#[derive(Default)]
struct Fault {
    wrong: Vec<String>,
    seen: String,
}

impl Fault {
    fn expect(&mut self, holds: bool, otherwise: impl FnOnce() -> String) {
        if !holds {
            self.wrong.push(otherwise());
        }
    }

    fn words(&self) -> String {
        let all: Vec<&str> = std::iter::once(&self.seen).chain(&self.wrong).map(String::as_str).collect();
        all.join("; ")
    }
}

struct Runs {
    program: PathBuf,
    folder: PathBuf,
    adapter: String,
    /// Errors and duration of a run without a fault, once there was one.
    unbroken: OnceLock<(Vec<String>, Duration)>,
}

impl Runs {
    fn prepare(&self) -> Result<(), Error> {
        drop(fs::remove_dir_all(&self.folder));
        let write = |name: &str, text: &str| {
            fs::create_dir_all(&self.folder)
                .and_then(|()| fs::write(self.folder.join(name), text))
                .map_err(|e| Error::unwritable(&self.folder, e))
        };
        write("grid.toml", GRID)?;
        write("scene.toml", include_str!("../../scenes/cornell.toml"))
    }

    fn out(&self) -> PathBuf {
        self.folder.join("out")
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.program);
        self.arguments(&mut command, arguments);
        command
    }

    fn arguments(&self, command: &mut Command, arguments: &[&str]) {
        command
            .current_dir(&self.folder)
            .env(AS_EVALUATOR, "1")
            .env("HALFLIGHT_CACHE", self.folder.join("cache"))
            .args(["run", "--grid", "grid.toml", "--out", "out", "--adapter", &self.adapter])
            .args(arguments)
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
    }

    fn output(&self, arguments: &[&str]) -> Result<Output, Error> {
        self.command(arguments).output().map_err(|e| self.unstartable(e))
    }

    fn spawn(&self, arguments: &[&str]) -> Result<Child, Error> {
        // Nobody reads its messages, and a pipe could fill up.
        self.command(arguments).stderr(Stdio::null()).spawn().map_err(|e| self.unstartable(e))
    }

    fn unstartable(&self, error: std::io::Error) -> Error {
        Error::Failed(format!("{} could not be started: {error}", self.program.display()))
    }

    /// Lines of finished cells by the name of the cell, as bytes. What a killed run left of a line is not among them.
    fn cells(&self) -> BTreeMap<String, Vec<u8>> {
        let bytes = fs::read(self.out().join(LOG)).unwrap_or_default();
        let whole = bytes.split_inclusive(|&byte| byte == b'\n').filter(|line| line.ends_with(b"\n"));
        let named = whole.filter_map(|line| {
            let record: Record = serde_json::from_slice(line).ok()?;
            Some((record.cell, line.to_vec()))
        });
        named.collect()
    }

    /// Waits until the first cell is finished, as long as `ended` says that the run goes on.
    fn wait_for_a_cell(&self, mut ended: impl FnMut() -> bool) -> bool {
        loop {
            // The last cell may be written between the two questions.
            let over = ended();
            if !self.cells().is_empty() {
                return true;
            }
            if over {
                return false;
            }
            sleep(Duration::from_millis(2));
        }
    }

    /// Errors of all rows of the report.
    fn errors(&self) -> Option<Vec<String>> {
        let rows = read_json(&self.out().join("results.json")).ok()?;
        Some(rows.iter().map(|row: &Measurement| format!("{:?}", row.errors)).collect())
    }

    /// Resumes a run, and expects all cells with these errors.
    fn resumes(&self, fault: &mut Fault, errors: &[String]) -> Result<(), Error> {
        let before = self.cells();
        let output = self.output(&["--resume"])?;
        fault
            .expect(output.status.success(), || format!("--resume ends with {}: {}", output.status, sentence(&output)));
        let after = self.cells();
        fault.expect(after.len() == CELLS, || format!("{} of {CELLS} cells after --resume", after.len()));
        let kept = before.iter().all(|(name, bytes)| after.get(name) == Some(bytes));
        fault.expect(kept, || "--resume changed a finished cell".into());
        fault.expect(self.errors().as_deref() == Some(errors), || "errors differ from those of an unbroken run".into());
        Ok(())
    }

    /// Errors and duration of a run without a fault.
    fn unbroken(&self) -> Result<(Vec<String>, Duration), Error> {
        if let Some(known) = self.unbroken.get() {
            return Ok(known.clone());
        }
        let start = Instant::now();
        let output = self.output(&[])?;
        if !output.status.success() {
            return Err(Error::Failed(format!("a plain run ends with {}: {}", output.status, sentence(&output))));
        }
        let errors = self.errors().ok_or_else(|| Error::Failed("a plain run leaves no results.json".into()))?;
        Ok(self.unbroken.get_or_init(|| (errors, start.elapsed())).clone())
    }

    /// Runs half of the grid, so that there are finished cells.
    fn half(&self) -> Result<BTreeMap<String, Vec<u8>>, Error> {
        drop(fs::remove_dir_all(self.out()));
        self.output(&["--shard", "0/2"])?;
        Ok(self.cells())
    }
}

/// Whether a process has ended; one that cannot be asked counts as ended.
fn has_ended(child: &mut Child) -> bool {
    child.try_wait().map_or(true, |status| status.is_some())
}

/// The error message of a command. Drivers may print other lines.
fn sentence(output: &Output) -> String {
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    let own = |line: &&str| !line.contains("XDG_RUNTIME_DIR");
    let errors: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("error: ")).filter(own).collect();
    match (errors.as_slice(), text.contains("panicked")) {
        (_, true) => format!("panics: {text}"),
        ([one], _) => (*one).to_owned(),
        (all, _) => format!("{} sentences: {}", all.len(), all.join(" / ")),
    }
}

/// Expects that a command ended with this exit code and one sentence that contains `part`.
fn says(fault: &mut Fault, output: &Output, code: i32, part: &str) {
    let said = sentence(output);
    fault.expect(output.status.code() == Some(code), || format!("ends with {} and not {code}", output.status));
    fault.expect(said.contains(part) && !said.contains("panics") && !said.contains(" sentences: "), || {
        format!("does not say {part}: {said}")
    });
    fault.seen = said;
}

fn is_whole(bytes: &[u8]) -> bool {
    serde_json::from_slice::<serde_json::Value>(bytes).is_ok()
}

fn killed(runs: &Runs) -> Result<Fault, Error> {
    let (errors, took) = runs.unbroken()?;
    drop(fs::remove_dir_all(runs.out()));
    let mut fault = Fault::default();
    let mut random = Random(11);
    let mut cells: BTreeMap<String, Vec<u8>> = BTreeMap::new();
    let mut counts = Vec::new();
    for _ in 0..KILLS {
        let mut child = runs.spawn(&["--resume"])?;
        sleep(took.mul_f64(random.unit()));
        // It may have ended already.
        drop(child.kill());
        drop(child.wait());
        let now = runs.cells();
        let kept = cells.iter().all(|(name, bytes)| now.get(name) == Some(bytes));
        fault.expect(kept, || "a finished cell changed or is gone".into());
        if let Ok(bytes) = fs::read(runs.out().join("results.json")) {
            fault.expect(is_whole(&bytes), || "results.json is cut off".into());
        }
        counts.push(now.len().to_string());
        cells = now;
    }
    fault.seen = format!("cells after each kill: {}", counts.join(" "));
    runs.resumes(&mut fault, &errors)?;
    Ok(fault)
}

/// A limit on the file size stands in for a full disk: writes fail in the same way.
fn full_disk(runs: &Runs) -> Result<Fault, Error> {
    let mut fault = Fault::default();
    if !cfg!(unix) {
        fault.seen = "not tested: this system has no limit on the file size".into();
        return Ok(fault);
    }
    let (errors, _) = runs.unbroken()?;
    let before = runs.half()?;
    fault.expect(!before.is_empty(), || "half a run finishes no cell".into());
    let mut command = Command::new("sh");
    // The signal is ignored, so that the write itself fails. 4 blocks are 2 or 4 KiB, less than any image.
    command.args(["-c", "trap '' XFSZ; ulimit -f 4; exec \"$0\" \"$@\""]).arg(&runs.program);
    runs.arguments(&mut command, &["--resume"]);
    let output = command.output().map_err(|e| runs.unstartable(e))?;
    says(&mut fault, &output, 2, "cannot write");
    let now = runs.cells();
    fault.expect(before.iter().all(|(name, bytes)| now.get(name) == Some(bytes)), || "a finished cell changed".into());
    let images = fs::read_dir(runs.out().join("images")).into_iter().flatten().flatten();
    let left = images.filter(|file| file.path().extension().is_some_and(|extension| extension == "tmp")).count();
    fault.expect(left == 0, || format!("{left} temporary files are left"));
    runs.resumes(&mut fault, &errors)?;
    Ok(fault)
}

fn vanished_scene(runs: &Runs) -> Result<Fault, Error> {
    let mut fault = Fault::default();
    let (errors, _) = runs.unbroken()?;
    drop(fs::remove_dir_all(runs.out()));
    let mut child = runs.spawn(&[])?;
    let began = runs.wait_for_a_cell(|| has_ended(&mut child));
    let (scene, aside) = (runs.folder.join("scene.toml"), runs.folder.join("aside.toml"));
    fs::rename(&scene, &aside).map_err(|e| Error::unwritable(&scene, e))?;
    let status = child.wait().map_err(|e| runs.unstartable(e))?;
    // Scenes are read before the first cell.
    fault.expect(began && status.success(), || format!("the run ends with {status}"));
    let cells = runs.cells();
    let output = runs.output(&["--resume"])?;
    says(&mut fault, &output, 2, "scene.toml");
    fault.expect(runs.cells() == cells, || "cells changed while the scene was gone".into());
    fs::rename(&aside, &scene).map_err(|e| Error::unwritable(&scene, e))?;
    runs.resumes(&mut fault, &errors)?;
    Ok(fault)
}

fn vanished_folder(runs: &Runs) -> Result<Fault, Error> {
    let mut fault = Fault::default();
    let (errors, _) = runs.unbroken()?;
    drop(fs::remove_dir_all(runs.out()));
    let mut child = runs.command(&[]).spawn().map_err(|e| runs.unstartable(e))?;
    fault.expect(runs.wait_for_a_cell(|| has_ended(&mut child)), || "no cell was finished".into());
    drop(fs::remove_dir_all(runs.out()));
    let output = child.wait_with_output().map_err(|e| runs.unstartable(e))?;
    if output.status.success() {
        fault.seen = "the folder is created again, and the run continues".into();
    } else {
        says(&mut fault, &output, 2, "cannot write");
    }
    runs.resumes(&mut fault, &errors)?;
    Ok(fault)
}

fn lost_device(runs: &Runs) -> Result<Fault, Error> {
    let mut fault = Fault::default();
    let (errors, _) = runs.unbroken()?;
    drop(fs::remove_dir_all(runs.out()));
    let choice = AdapterChoice::from(runs.adapter.as_str());
    let native = NativeGpu::open(&choice).map_err(|e| Error::BadInput(e.to_string()))?;
    let mut grid = Grid::read(&runs.folder.join("grid.toml"))?;
    // This process has another working folder.
    grid.scenes = vec![runs.folder.join("scene.toml")];
    let out = runs.out();
    let options =
        RunOptions { out: &out, resume: false, shard: Shard::ALL, command: Invocation::evaluator("run"), check: false };
    let device = native.gpu.device.clone();
    let ended = AtomicBool::new(false);
    let result = std::thread::scope(|scope| {
        scope.spawn(|| {
            runs.wait_for_a_cell(|| ended.load(Ordering::Relaxed));
            device.destroy();
            // The program notices when it polls the device next.
            drop(device.poll(wgpu::PollType::Poll));
        });
        let result = caught(|| run_grid(&native, &grid, &options));
        ended.store(true, Ordering::Relaxed);
        result
    });
    match result {
        Ok(Err(error)) => {
            let said = error.to_string();
            let one = said.contains("device") && said.contains("--resume") && said.lines().count() == 1;
            fault.expect(one, || format!("does not say that the device was lost: {said}"));
            fault.seen = said;
        }
        Ok(Ok(())) => fault.wrong.push("the run ends well without its device".into()),
        Err(message) => fault.wrong.push(format!("panics: {message}")),
    }
    let cells = runs.cells();
    fault.expect(!cells.is_empty() && cells.len() < CELLS, || format!("{} cells were finished", cells.len()));
    let native = NativeGpu::open(&choice).map_err(|e| Error::BadInput(e.to_string()))?;
    run_grid(&native, &grid, &RunOptions { resume: true, ..options })?;
    let after = runs.cells();
    let kept = cells.iter().all(|(name, bytes)| after.get(name) == Some(bytes));
    fault.expect(kept && after.len() == CELLS, || format!("{} cells after --resume", after.len()));
    fault.expect(runs.errors().as_ref() == Some(&errors), || "errors differ from those of an unbroken run".into());
    Ok(fault)
}
