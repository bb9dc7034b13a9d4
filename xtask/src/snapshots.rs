//! `cargo xtask snapshots`: the small images in `tests/snapshots`.

use std::process::ExitCode;

use crate::{Stop, cargo, run, setup};

/// Environment variable by which the test writes its images as the new expected ones: `halflight_tests::snapshot::ACCEPT`.
const ACCEPT: &str = "HALFLIGHT_ACCEPT_SNAPSHOTS";

/// Compares new images with the expected ones, or makes them the expected ones.
pub fn compare(accept: bool) -> Result<ExitCode, Stop> {
    setup::system()?;
    // As a part of the workspace, so that dependencies have the features that the other tests build them with.
    let mut command = cargo(&["test", "--workspace", "--test", "snapshots"]);
    if accept {
        command.env(ACCEPT, "1");
    }
    run(&mut command, "look at target/snapshots; if the new images are right, run cargo xtask snapshots --accept")?;
    Ok(ExitCode::SUCCESS)
}
