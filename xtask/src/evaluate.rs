//! `cargo xtask evaluate`: the main job, from a fresh clone to a report.

use std::process::{Command, ExitCode};

use halflight_output::terminal;

use crate::{Stop, built_evaluator, cargo, forward, program, root, setup};

/// Builds the evaluator and runs a grid; `arguments` go to `evaluator run`.
pub fn run(arguments: &[String]) -> Result<ExitCode, Stop> {
    setup::system()?;
    let (dev, arguments): (Vec<&str>, Vec<&str>) = arguments.iter().map(String::as_str).partition(|a| *a == "--dev");
    let mut command = if dev.is_empty() {
        cargo(&["run", "--release", "--package", "halflight-evaluator", "--", "run"])
    } else {
        let mut command = built_like_the_tests()?;
        command.arg("run");
        command
    };
    for (option, value) in [("--grid", "grids/default.toml"), ("--out", "reports/default")] {
        if value_of(&arguments, option).is_none() {
            command.args([option, value]);
        }
    }
    command.args(&arguments);
    let code = forward(&mut command)?;
    if code == ExitCode::SUCCESS {
        let page = root().join(value_of(&arguments, "--out").unwrap_or("reports/default")).join("index.html");
        terminal::print_line(format_args!("Report: {}", page.display()))?;
    }
    Ok(code)
}

/// The evaluator in the tests' profile. It is built with the whole workspace: alone, its dependencies would have fewer
/// features, and the tests would build most of them again.
fn built_like_the_tests() -> Result<Command, Stop> {
    let mut build = cargo(&["build", "--workspace", "--bin", "evaluator"]);
    crate::run(&mut build, "fix what cargo printed")?;
    Ok(program(built_evaluator()?))
}

/// The value of an option, written `--option value` or `--option=value`.
fn value_of<'a>(arguments: &[&'a str], option: &str) -> Option<&'a str> {
    let apart = arguments.iter().position(|argument| *argument == option).and_then(|at| arguments.get(at + 1).copied());
    apart.or_else(|| arguments.iter().find_map(|argument| argument.strip_prefix(option)?.strip_prefix('=')))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_found_in_both_forms() {
        let arguments = ["--out", "a", "--grid=b.toml", "--output=c"];
        assert_eq!(value_of(&arguments, "--out"), Some("a"));
        assert_eq!(value_of(&arguments, "--grid"), Some("b.toml"));
        assert_eq!(value_of(&arguments, "--adapter"), None);
        assert_eq!(value_of(&arguments[3..], "--out"), None, "an option that only begins like this one");
    }
}
