//! `cargo xtask web`: the browser demo, built and served, or written to a folder.

use std::process::ExitCode;

use halflight_output::terminal;

use crate::{Stop, cargo, setup, typed};

/// Builds the demo; `arguments` go to the crate `bundle`, which knows wasm-bindgen.
pub fn run(arguments: &[String]) -> Result<ExitCode, Stop> {
    setup::wasm()?;
    let mut command = cargo(&["run", "--package", "halflight-bundle", "--"]);
    command.args(arguments);
    let name = typed(&command);
    terminal::note(format_args!("== {name}"));
    let status = command.status().map_err(|error| {
        Stop::failed(format!("{name} does not start ({error}): install Rust from https://rustup.rs, then run again"))
    })?;
    // The program has said what went wrong; other codes are cargo's own.
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).filter(|code| *code <= 2).unwrap_or(1).into())
}
