//! `cargo xtask test --cluster`: a grid in parts on a Slurm that runs on this computer alone.

use std::process::ExitCode;

use crate::{Stop, built_evaluator, cargo, program, root, run, setup};

/// Builds the evaluator in the tests' profile and runs `deploy/slurm/test.sh`.
pub fn test() -> Result<ExitCode, Stop> {
    setup::system()?;
    setup::for_cluster()?;
    run(&mut cargo(&["build", "--package", "halflight-evaluator"]), "fix what cargo printed")?;
    let mut test = program(root().join("deploy/slurm/test.sh"));
    test.env("EVALUATOR", built_evaluator()?);
    run(&mut test, "fix what it printed; KEEP=1 keeps its folder with all logs")?;
    Ok(ExitCode::SUCCESS)
}
