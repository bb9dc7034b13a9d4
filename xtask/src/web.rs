//! `cargo xtask web`: the browser demo, built and served, or written to a folder.

use std::process::ExitCode;

use crate::{Stop, cargo, forward, setup};

/// Builds the demo with these arguments. The crate `web/bundle` knows wasm-bindgen.
pub fn run(arguments: &[String]) -> Result<ExitCode, Stop> {
    setup::wasm()?;
    let mut command = cargo(&["run", "--package", "halflight-bundle", "--"]);
    forward(command.args(arguments))
}
