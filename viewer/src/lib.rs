//! The interactive application: one egui program that a browser page (`web`) and a desktop window (`native`) both open.
//!
//! [`Viewer`] holds a [`state::State`], plain data that a link can carry. Each pass of the interface brings a
//! `stage::Stage` (a scene on the device) and one or two `stage::Side`s (a configuration, drawn and measured) in
//! line with it, and shows what they left. Nothing here waits: results are asked for again in the next pass.

pub mod address;
mod app;
mod background;
mod benchmark;
mod camera;
mod check;
mod command;
mod numbers;
mod panels;
mod picture;
mod plot;
mod readback;
mod report;
pub mod scenes;
mod show;
mod stage;
pub mod state;
mod timing;
mod undo;

pub use app::{Host, Viewer, configuration};
