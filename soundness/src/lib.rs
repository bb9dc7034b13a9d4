//! Numerical stress tests: whether techniques stay finite, bounded and invariant at the extremes.
//!
//! Each row is an extreme of geometry, image, light, material or parameters, a closed form, an invariance, a comparison
//! with a float64 oracle, a bad input or a fault from outside. Every row runs with every technique that is listed and with
//! settings that follow from the declarations of its parameters ([`switches`]), so that a new technique or parameter is
//! covered without a line of new code here. [`mutations`] puts deliberate bugs into the shaders and checks that rows fail.
//! `cargo xtask stability` runs all of it.
//!
//! ```no_run
//! use halflight_native::{AdapterChoice, NativeGpu};
//! use halflight_soundness::suite::{Options, Suite};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let native = NativeGpu::open(&AdapterChoice::Software)?;
//! let table = Suite::run(&native, &Options { rows: vec!["closed forms".into()], ..Options::default() })?;
//! for check in table.checks.iter().filter(|check| check.is_red()) {
//!     println!("{} {}: {} > {:?}", check.row, check.technique, check.worst, check.bound);
//! }
//! # Ok(())
//! # }
//! ```

pub mod check;
pub mod command;
pub mod faults;
pub mod fuzz;
pub mod mutations;
pub mod oracle;
mod panics;
pub mod random;
pub mod scenes;
mod settings;
pub mod suite;
pub mod switches;
pub mod table;
