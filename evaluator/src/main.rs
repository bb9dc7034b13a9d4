//! The command; everything it does is in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    halflight_evaluator::command::main()
}
