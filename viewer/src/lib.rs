//! The interactive viewer: one egui application for a browser page (crate `web`) and a desktop window (crate `native`).
//!
//! [`Viewer`] holds a [`state::State`], plain data that a link can hold. Each pass of the interface changes the state.
//! The viewer then updates a `Stage` (a scene on the device), one or two `Side`s (a configuration that is drawn and
//! measured) and the path-traced reference from it, and shows their results. Nothing waits for the device: results are
//! asked for again in the next pass.
//!
//! A program opens the viewer with eframe and implements [`Host`] for what the viewer cannot do by itself:
//!
//! ```no_run
//! struct Window;
//!
//! impl halflight_viewer::Host for Window {
//!     fn show_address(&mut self, _state: &str) {}
//!     fn link(&self, state: &str) -> String {
//!         state.to_owned()
//!     }
//!     fn save(&mut self, name: &str, _contents: &[u8]) -> String {
//!         format!("{name} was not saved")
//!     }
//!     fn save_picture(&mut self, name: &str, _width: u32, _pixels: &[u8]) -> String {
//!         format!("{name} was not saved")
//!     }
//! }
//!
//! let wgpu_options = halflight_viewer::configuration();
//! let options = eframe::NativeOptions { wgpu_options, ..Default::default() };
//! eframe::run_native(
//!     "viewer",
//!     options,
//!     Box::new(|context| {
//!         let lost = |reason| eprintln!("the device was lost: {reason}");
//!         Ok(Box::new(halflight_viewer::Viewer::new(context, Box::new(Window), "scene=cornell", lost)?))
//!     }),
//! )?;
//! # Ok::<(), eframe::Error>(())
//! ```

pub mod address;
mod app;
mod benchmark;
mod best;
mod camera;
mod check;
pub mod error;
mod export;
mod flip;
mod hints;
mod host;
#[cfg(all(feature = "hot-reload", not(target_arch = "wasm32")))]
mod hot_reload;
pub mod loading;
mod marks;
mod messages;
mod numbers;
mod panels;
mod picture;
mod playing;
mod plot;
mod readback;
mod reference;
mod report;
pub mod scenes;
mod seen;
mod show;
mod side;
mod stage;
pub mod state;
mod style;
mod timing;
mod undo;
mod words;

pub use app::Viewer;
pub use host::{Host, configuration};
