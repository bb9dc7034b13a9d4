//! What needs this computer: a device without a window, waiting and reading back, image files, the path-traced
//! reference and its cache on disk.

pub mod cache;
mod device;
pub mod files;
pub mod frames;
pub mod images;
mod memory;
pub mod scene_hash;
pub mod truth;

pub use device::{AdapterChoice, DeviceError, NativeGpu, Refusal, adapters};
