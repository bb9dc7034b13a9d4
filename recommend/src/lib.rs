//! Which settings for 4 ms? Searches all techniques and their declared grid values for the lowest error within a budget,
//! or for the shortest time within an error bound.
//!
//! The crate measures nothing, waits for nothing and reads no file or clock. A [`Search`] names the next [`Cell`] to
//! measure. The caller measures it where and when it likes, and hands back an [`Outcome`]. At the end, or at any time
//! before, [`Search::answer`] gives an [`Answer`], or one sentence that says why there is none.
//!
//! ```text
//! while let Some(cell) = search.next(share_of_time_spent) {
//!     search.report(measure(&cell));
//! }
//! println!("{}", search.answer()?.technique.name);
//! ```
//!
//! The search has four stages (see [`Stage`]):
//!
//! 1. *Defaults*: each technique once, at reduced size; the best ones at full size too, to learn what the size changes.
//! 2. *Effects*: single settings are changed, at reduced size. Techniques share the cells by successive halving (Jamieson
//!    & Talwalkar 2016): after each round the better half stays.
//! 3. *Combinations*: the cell with the lowest predicted error within the budget, at reduced size, until the prediction
//!    has been measured.
//! 4. *Verification*: the best at full size, until the best prediction has been measured; then a step up and a step down.
//!
//! Predictions come from [`Model`]s that the measured cells calibrate: the time of each pass for each invocation, which
//! the plan counts, and the error, both with a factor for each value of each setting.

mod family;
mod least_squares;
mod model;
mod search;

pub use family::{Axis, Family, Planned};
pub use model::Model;
pub use search::{
    Advice, Answer, Cell, Goal, Interval, Measured, NoAnswer, Outcome, Point, Request, Search, Stage, Step, metric,
    metric_names,
};
