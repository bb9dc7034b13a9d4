//! The command that `cargo xtask stability` runs.

use std::process::ExitCode;

use halflight_soundness::{command, faults};

fn main() -> ExitCode {
    // The rows of faults start this program as an evaluator that they may kill.
    if std::env::var_os(faults::AS_EVALUATOR).is_some() {
        return halflight_evaluator::command::main();
    }
    command::main()
}
