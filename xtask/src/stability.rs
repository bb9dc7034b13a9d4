//! `cargo xtask stability`: the numerical stress tests.

use std::process::ExitCode;

use crate::{Stop, cargo, forward, setup};

/// Builds the crate `soundness` and runs it with these arguments.
pub fn run(arguments: &[String]) -> Result<ExitCode, Stop> {
    setup::system()?;
    let mut command = cargo(&["run", "--release", "--package", "halflight-soundness", "--"]);
    forward(command.args(arguments))
}
