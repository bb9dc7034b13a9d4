//! `cargo xtask test`: formatting, lints, documentation, then every test.

use std::{
    io::{BufRead, BufReader},
    process::{Command, ExitCode, Stdio},
};

use halflight_output::terminal;

use crate::{Stop, built_evaluator, cargo, program, run, setup};

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
/// The crates that are not published.
const PRIVATE: [&str; 5] =
    ["halflight-soundness", "halflight-web", "halflight-bundle", "halflight-tests", "halflight-xtask"];
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
    let tally = tests(&[&["--lib", "--bins"][..], &QUICK.map(|name| ["--test", name]).concat()].concat())?;
    tally.conclude()
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
    // Another program gets the techniques without the path tracer, the viewer and the evaluator.
    clippy(&["-p", "halflight-techniques", "--lib"])?;
    run(
        cargo(&["doc", "--workspace", "--no-deps", "--document-private-items"]).env("RUSTDOCFLAGS", "--deny warnings"),
        "fix the documentation that it names",
    )?;
    let private = PRIVATE.iter().flat_map(|name| ["--exclude", name]);
    // Without a build: the tests build the same files.
    run(
        cargo(&["package", "--workspace", "--no-verify", "--allow-dirty"]).args(private),
        "fix the manifest that it names",
    )?;
    let mut tally = tests(&[])?;
    if setup::for_node_tests()? {
        node_tests(&mut tally)?;
    } else {
        terminal::note("the tests of the JavaScript package are left out: this computer lacks Node.js with npm");
    }
    tally.conclude()
}

/// Installs what the examples and the type checks of the JavaScript package need. Runs its tests, on the evaluator that cargo
/// has built, and lists what npm would publish.
fn node_tests(tally: &mut Tally) -> Result<(), Stop> {
    let package = crate::root().join("js");
    for folder in [&package, &package.join("examples/three")] {
        let fix = "npm installs what package-lock.json pins: check the connection to its registry";
        run(program("npm").args(["ci", "--no-audit", "--no-fund"]).current_dir(folder), fix)?;
    }
    run(program("npm").args(["run", "types"]).current_dir(&package), "fix the types that it names")?;
    let mut node = program("node");
    node.args(["--test", "--test-reporter=tap"]).current_dir(&package).env("HALFLIGHT_EVALUATOR", built_evaluator()?);
    let before = tally.announced;
    read_tests(node, tally)?;
    if tally.announced == before {
        return Err(Stop::failed("no test of the JavaScript package ran: fix what Node.js printed"));
    }
    run(program("npm").args(["pack", "--dry-run"]).current_dir(&package), "fix js/package.json")
}

/// Runs these targets' tests, or every test where none is given.
fn tests(targets: &[&str]) -> Result<Tally, Stop> {
    // Always the workspace: alone, a crate's dependencies would have fewer features and be built once more.
    let mut command = cargo(&["test", "--workspace", "--no-fail-fast"]);
    command.args(targets);
    let mut tally = Tally::default();
    read_tests(command, &mut tally)?;
    if tally.announced == 0 {
        return Err(Stop::failed("no test ran: fix what cargo printed"));
    }
    Ok(tally)
}

/// Runs a command and counts the tests that its output reports.
fn read_tests(mut command: Command, tally: &mut Tally) -> Result<(), Stop> {
    terminal::note(format_args!("== {}", crate::typed(&command)));
    let unreadable = |error| Stop::failed(format!("the tests' output cannot be read ({error}): run again"));
    let mut child = command.stdout(Stdio::piped()).spawn().map_err(unreadable)?;
    for line in child.stdout.take().into_iter().flat_map(|out| BufReader::new(out).split(b'\n')) {
        let line = line.map_err(unreadable)?;
        let line = String::from_utf8_lossy(&line);
        terminal::print_line(&line)?;
        tally.read(&line);
    }
    tally.stopped |= !child.wait().map_err(unreadable)?.success();
    Ok(())
}

/// Sums over test binaries.
#[derive(Debug, Default, PartialEq)]
struct Tally {
    announced: usize,
    passed: usize,
    ignored: usize,
    /// Whether a program that ran tests failed.
    stopped: bool,
}

impl Tally {
    /// Prints `N passed, N failed`, the last line.
    fn conclude(&self) -> Result<ExitCode, Stop> {
        terminal::print_line(format_args!("{} passed, {} failed", self.passed, self.failed()))?;
        Ok(if !self.stopped && self.failed() == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
    }

    /// Counts a line that a test binary or Node.js printed.
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
        } else if let Some((what, count)) = line.strip_prefix("# ").and_then(|rest| rest.split_once(' ')) {
            // Node.js ends with one such line for each kind of result. Only numbers follow these words there.
            let Ok(count) = count.parse::<usize>() else { return };
            match what {
                "tests" => self.announced += count,
                "pass" => self.passed += count,
                "skipped" | "todo" => self.ignored += count,
                _ => {}
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
        assert_eq!(tally, Tally { announced: 13, passed: 10, ignored: 2, stopped: false });
        assert_eq!(tally.failed(), 1);
    }

    #[test]
    fn tests_of_node_count() {
        let mut tally = Tally::default();
        let lines = "# Subtest: pass 3\n    ok 1 - a\n# tests 52\n# suites 6\n# pass 48\n# fail 2\n# cancelled 1\n\
            # skipped 1\n# todo 0\n# duration_ms 882.9";
        lines.lines().for_each(|line| tally.read(line));
        assert_eq!(tally, Tally { announced: 52, passed: 48, ignored: 1, stopped: false });
        assert_eq!(tally.failed(), 3, "a cancelled test did not pass");
    }

    #[test]
    fn tests_of_a_crashed_binary_failed() {
        let mut tally = Tally::default();
        ["running 5 tests", "test a ... ok"].iter().for_each(|line| tally.read(line));
        assert_eq!((tally.passed, tally.failed()), (0, 5));
    }
}
