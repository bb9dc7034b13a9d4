//! Many frames: metrics, tables, comparisons and reports of what a millisecond buys.

pub mod command;
pub mod compare;
pub mod error;
pub mod explain;
pub mod format;
pub mod grid;
pub mod measurement;
pub mod metrics;
pub mod plan_graph;
pub mod progress;
pub mod report;
pub mod run;
mod serial;
pub mod session;
pub mod statistics;
pub mod temporal;
pub mod truth;

pub use error::Error;
