//! `cargo xtask test`: formatting, lints, documentation, then every test.

use std::{
    io::{BufRead, BufReader},
    process::{ExitCode, Stdio},
};

use halflight_output::terminal;

use crate::{Stop, cargo, run, setup};

/// The crates that run in a browser.
const PORTABLE: [&str; 18] = [
    "-p",
    "halflight-metrics",
    "-p",
    "halflight-scenes",
    "-p",
    "halflight-shared-shaders",
    "-p",
    "halflight-frame-graph",
    "-p",
    "halflight-renderer",
    "-p",
    "halflight-techniques",
    "-p",
    "halflight-recommend",
    "-p",
    "halflight-viewer",
    "-p",
    "halflight-web",
];
const DENY_WARNINGS: [&str; 3] = ["--", "--deny", "warnings"];

/// The integration tests of a quick run, each by its name in any crate: shaders, readers, plans, parameters, closed forms, and
/// one small image or more of every technique. Unit tests run besides.
const QUICK: [&str; 12] = [
    "architecture",
    "bad_input",
    "compile",
    "dependencies",
    "exhaustive",
    "explain",
    "load",
    "parameters",
    "plans",
    "showing",
    "snapshots",
    "views",
];

/// Formatting, unit tests and the integration tests of [`QUICK`].
pub fn run_quick() -> Result<ExitCode, Stop> {
    setup::system()?;
    setup::rust()?;
    run(&mut cargo(&["fmt", "--all", "--check"]), "run cargo fmt --all")?;
    tests(&[&["--lib", "--bins"][..], &QUICK.map(|name| ["--test", name]).concat()].concat())
}

/// Stops at the first kind of check that fails; of the tests, runs all.
pub fn run_all() -> Result<ExitCode, Stop> {
    setup::system()?;
    setup::for_tests()?;
    setup::rust()?;
    run(&mut cargo(&["fmt", "--all", "--check"]), "run cargo fmt --all")?;
    let clippy = |targets: &[&str]| {
        run(cargo(&["clippy"]).args(targets).args(DENY_WARNINGS), "fix the warnings that it printed")
    };
    // With every feature that a default build leaves out.
    clippy(&["--workspace", "--all-targets", "--features", "halflight-viewer/hot-reload"])?;
    clippy(&[&["--target", setup::WASM], PORTABLE.as_slice()].concat())?;
    run(
        cargo(&["doc", "--workspace", "--no-deps", "--document-private-items"]).env("RUSTDOCFLAGS", "--deny warnings"),
        "fix the documentation that it names",
    )?;
    tests(&[])
}

/// Runs these targets' tests, or every test where none is given. The last line is `N passed, N failed`.
fn tests(targets: &[&str]) -> Result<ExitCode, Stop> {
    // Always the workspace: alone, a crate's dependencies would have fewer features and be built once more.
    let mut command = cargo(&["test", "--workspace", "--no-fail-fast"]);
    command.args(targets);
    terminal::note(format_args!("== {}", crate::typed(&command)));
    let unreadable = |error| Stop::failed(format!("the tests' output cannot be read ({error}): run again"));
    let mut child = command.stdout(Stdio::piped()).spawn().map_err(unreadable)?;
    let mut tally = Tally::default();
    for line in child.stdout.take().into_iter().flat_map(|out| BufReader::new(out).split(b'\n')) {
        let line = line.map_err(unreadable)?;
        let line = String::from_utf8_lossy(&line);
        terminal::print_line(&line)?;
        tally.read(&line);
    }
    let status = child.wait().map_err(unreadable)?;
    if tally.announced == 0 {
        return Err(Stop::failed("no test ran: fix what cargo printed"));
    }
    terminal::print_line(format_args!("{} passed, {} failed", tally.passed, tally.failed()))?;
    Ok(if status.success() && tally.failed() == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Sums over test binaries.
#[derive(Debug, Default, PartialEq)]
struct Tally {
    announced: usize,
    passed: usize,
    ignored: usize,
}

impl Tally {
    /// Counts a line that a test binary printed.
    fn read(&mut self, line: &str) {
        let number = |words: &str| words.trim().split(' ').next().and_then(|word| word.parse().ok()).unwrap_or(0);
        if let Some(rest) =
            line.strip_prefix("running ").filter(|rest| rest.ends_with(" test") || rest.ends_with(" tests"))
        {
            self.announced += number(rest);
        } else if let Some((_, counts)) = line.strip_prefix("test result: ").and_then(|rest| rest.split_once(". ")) {
            for count in counts.split(';') {
                match count.trim().split_once(' ') {
                    Some((n, "passed")) => self.passed += number(n),
                    Some((n, "ignored")) => self.ignored += number(n),
                    _ => {}
                }
            }
        }
    }

    /// Tests that did not pass, also those of a binary that crashed before it could report them.
    fn failed(&self) -> usize {
        self.announced.saturating_sub(self.passed + self.ignored)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_binary_counts() {
        let mut tally = Tally::default();
        let lines = "running 12 tests\n\
            test a ... ok\n\
            test result: FAILED. 9 passed; 1 failed; 2 ignored; 0 measured; 3 filtered out; finished in 0.01s\n\
            running 1 test\n\
            test result: ok. 1 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.00s\n\
            running late";
        lines.lines().for_each(|line| tally.read(line));
        assert_eq!(tally, Tally { announced: 13, passed: 10, ignored: 2 });
        assert_eq!(tally.failed(), 1);
    }

    #[test]
    fn tests_of_a_crashed_binary_failed() {
        let mut tally = Tally::default();
        ["running 5 tests", "test a ... ok"].iter().for_each(|line| tally.read(line));
        assert_eq!((tally.passed, tally.failed()), (0, 5));
    }
}
