//! Where commands write: the terminal, and folders of results.
//!
//! Every command of the workspace prints through [`terminal`], so that a closed pipe or a full disk never ends in a
//! panic. Every command that fills a folder claims its files through [`OutputFolder`], so that a file of the user's is
//! never replaced or removed.
//!
//! ```
//! use halflight_output::{OutputFolder, terminal};
//!
//! # let path = std::env::temp_dir().join(format!("halflight-output-example-{}", std::process::id()));
//! let folder = OutputFolder::open(&path);
//! std::fs::write(folder.claim("tables.md")?, "# Results\n")?;
//! terminal::print_line(format_args!("report: {}", folder.path().display()))?;
//! # std::fs::remove_dir_all(&path)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The crate has no dependencies, because the developer commands start with it.

mod folder;
pub mod terminal;

pub use folder::{FolderError, LIST, OutputFolder};
pub use terminal::PrintError;
