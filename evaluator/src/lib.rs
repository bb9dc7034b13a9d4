//! Experiments on many frames: grids of settings are rendered, timed and compared with a path-traced reference; reports
//! show what each millisecond buys. The command `evaluator` is a thin layer over this library.
//!
//! [`experiment`] runs grids, [`measurement`] is a row of their results, [`report`] writes them as pages and tables,
//! [`merge`](mod@merge) joins folders that were measured in parts, [`explain`] splits
//! an error into its sources, [`recommend`](mod@recommend) chooses settings, [`compare`](mod@compare) compares two image files.
//!
//! ```no_run
//! use halflight_evaluator::{
//!     experiment::{RunOptions, grid::Grid, run, session::open_adapter, shard::Shard},
//!     measurement::read_json,
//! };
//! use halflight_metrics::MetricId;
//!
//! let native = open_adapter("any")?;
//! let grid = Grid::read("grids/default.toml".as_ref())?;
//! let out = "reports/default".as_ref();
//! run(&native, &grid, &RunOptions { out, resume: true, shard: Shard::ALL, command: Default::default(), check: false })?;
//! for row in read_json("reports/default/results.json".as_ref())? {
//!     println!("{:.1} ms, FLIP {:?}", row.time_ms_median, row.errors.get(MetricId::FinalFlip));
//! }
//! # Ok::<(), halflight_evaluator::Error>(())
//! ```

pub mod command;
pub mod compare;
pub mod error;
pub mod experiment;
pub mod explain;
pub mod export;
pub mod format;
pub mod measurement;
pub mod merge;
pub mod plan_graph;
pub mod progress;
pub mod recommend;
pub mod report;

pub use error::Error;
