//! The checks of a run.

use crate::check::Check;

mod output;

/// What a run found.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// All checks, in the order of their rows.
    pub checks: Vec<Check>,
    /// Combinations of values that techniques refuse, one message each.
    pub refused: Vec<String>,
    /// Settings that each technique ran with: technique, number of settings, number of its parameters.
    pub covered: Vec<(String, usize, usize)>,
}

impl Table {
    /// Checks that are red and not explained.
    pub fn unexplained(&self) -> impl Iterator<Item = &Check> {
        self.checks.iter().filter(|check| check.is_red() && check.explanation().is_none())
    }
}
