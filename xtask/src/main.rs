//! Developer commands, run as `cargo xtask COMMAND`. No dependencies outside the workspace: the first command of a fresh
//! clone starts at once.

use std::{
    env,
    ffi::OsStr,
    path::{Path, PathBuf},
    process::{Command, ExitCode},
    time::Instant,
};

use halflight_output::{PrintError, terminal};

mod cluster;
mod evaluate;
mod setup;
mod snapshots;
mod stability;
mod test;
mod web;

const HELP: &str = "\
Developer commands of Halflight.

Usage: cargo xtask COMMAND

Commands:
  evaluate [--dev] [ARGUMENTS]  Measure a grid and write its report folder.
                                ARGUMENTS go to `evaluator run`; --grid and --out replace grids/default.toml
                                and reports/default. --dev builds in the profile that the tests use.
  stability [ARGUMENTS]         Run the numerical stress tests; `cargo xtask stability --help` lists ARGUMENTS.
  snapshots [--accept]          Compare small images of every technique with those in tests/snapshots;
                                --accept makes the new images the expected ones.
  test [--quick|--cluster]      Check formatting, lints (native and wasm32) and documentation, then run every test,
                                those of the JavaScript package too if Node.js is there.
                                --quick checks formatting and runs the tests that find most per second: under five
                                minutes after the build on two cores.
                                --cluster only runs deploy/slurm on a Slurm of its own on this computer (Debian or
                                Ubuntu, as root), and compares the report with that of a single run.
  web [--dist DIR] [--port PORT] [--source URL] [--report PATH]
                                Build the browser demo and serve it on 127.0.0.1, or write it to a folder.

All first install what is missing, or say what to install. Paths are relative to the root of the workspace.
Exit codes: 0 done, 1 failed, 2 bad input or something to install by hand.
";

/// Why a command stopped: its exit code and one sentence with the fix.
#[derive(Debug)]
struct Stop {
    code: u8,
    sentence: String,
}

impl Stop {
    fn failed(sentence: impl Into<String>) -> Self {
        Self { code: 1, sentence: sentence.into() }
    }

    fn bad_input(sentence: impl Into<String>) -> Self {
        Self { code: 2, sentence: sentence.into() }
    }
}

impl From<PrintError> for Stop {
    fn from(error: PrintError) -> Self {
        Self { code: error.exit_code(), sentence: error.to_string() }
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = env::args().skip(1).collect();
    dispatch(&arguments).unwrap_or_else(|Stop { code, sentence }| {
        // Nothing failed where only the reader of the output went away.
        if code != 0 {
            terminal::note(format_args!("error: {sentence}"));
        }
        ExitCode::from(code)
    })
}

fn dispatch(arguments: &[String]) -> Result<ExitCode, Stop> {
    let asks = |argument: &String| ["-h", "--help", "help"].contains(&argument.as_str());
    // These commands have help texts of their own.
    let own_help = |command: &String| ["web", "stability"].contains(&command.as_str());
    if arguments.iter().any(asks) && !arguments.first().is_some_and(own_help) {
        terminal::print(HELP)?;
        return Ok(ExitCode::SUCCESS);
    }
    let Some((command, rest)) = arguments.split_first() else {
        terminal::print(HELP)?;
        return Ok(ExitCode::from(2));
    };
    match (command.as_str(), rest) {
        ("evaluate", rest) => evaluate::run(rest),
        ("snapshots", []) => snapshots::compare(false),
        ("snapshots", [accept]) if accept == "--accept" => snapshots::compare(true),
        ("snapshots", [extra, ..]) => {
            Err(Stop::bad_input(format!("cargo xtask snapshots takes --accept or nothing, not {extra}")))
        }
        ("test", []) => test::run_all(),
        ("test", [quick]) if quick == "--quick" => test::run_quick(),
        ("test", [cluster]) if cluster == "--cluster" => cluster::test(),
        ("test", [extra, ..]) => Err(Stop::bad_input(format!(
            "cargo xtask test takes --quick, --cluster or nothing, not {extra}: to run some tests only, use cargo test"
        ))),
        ("stability", rest) => stability::run(rest),
        ("web", rest) => web::run(rest),
        (unknown, _) => Err(Stop::bad_input(format!(
            "there is no command {unknown}: choose evaluate, snapshots, stability, test or web, or ask for --help"
        ))),
    }
}

/// The root of the workspace.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new(".")).to_path_buf()
}

/// The cargo that runs this program, at the root of the workspace.
fn cargo(arguments: &[&str]) -> Command {
    let mut command = program(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.args(arguments);
    command
}

/// The evaluator that cargo has built in the tests' profile.
fn built_evaluator() -> Result<PathBuf, Stop> {
    // Cargo puts both side by side.
    let own = env::current_exe()
        .map_err(|error| Stop::failed(format!("this program's folder cannot be found ({error}): run again")))?;
    Ok(own.with_file_name(format!("evaluator{}", env::consts::EXE_SUFFIX)))
}

/// A program, at the root of the workspace.
fn program(path: impl AsRef<OsStr>) -> Command {
    let mut command = Command::new(path);
    command.current_dir(root());
    // Software Vulkan drivers complain where there is none, as on servers.
    if env::var_os("XDG_RUNTIME_DIR").is_none() {
        command.env("XDG_RUNTIME_DIR", env::temp_dir());
    }
    command
}

/// A command as one would type it.
fn typed(command: &Command) -> String {
    let name = Path::new(command.get_program()).file_stem().unwrap_or_default();
    [name].into_iter().chain(command.get_args()).map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}

/// Prints a command, runs it and returns its exit code where that is 0, 1 or 2, otherwise 1: other codes are cargo's own. The
/// program prints its own error.
///
/// # Errors
/// Where it cannot start.
fn forward(command: &mut Command) -> Result<ExitCode, Stop> {
    let name = typed(command);
    terminal::note(format_args!("== {name}"));
    let status = command.status().map_err(|error| {
        Stop::failed(format!("{name} does not start ({error}): install Rust from https://rustup.rs, then run again"))
    })?;
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).filter(|code| *code <= 2).unwrap_or(1).into())
}

/// Prints a command, runs it and waits.
///
/// # Errors
/// Where it cannot start or fails: one sentence that ends with `fix`.
fn run(command: &mut Command, fix: &str) -> Result<(), Stop> {
    let name = typed(command);
    terminal::note(format_args!("== {name}"));
    let start = Instant::now();
    match command.status() {
        Ok(status) if status.success() => {
            terminal::note(format_args!("== done in {:.0} s", start.elapsed().as_secs_f64()));
            Ok(())
        }
        Ok(status) => Err(Stop::failed(format!("{name} failed ({status}): {fix}"))),
        Err(error) => Err(Stop::failed(format!("{name} does not start ({error}): {fix}"))),
    }
}
