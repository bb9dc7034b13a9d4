//! Many frames: metrics, tables, comparisons and reports of what a millisecond buys.

pub mod command;
pub mod compare;
pub mod error;
pub mod experiment;
pub mod explain;
pub mod format;
pub mod plan_graph;
pub mod progress;
pub mod report;

pub use error::Error;
