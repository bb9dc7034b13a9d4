//! This computer: a device without a window, image files and a cache on disk.

pub mod cache;
mod device;
pub mod files;
pub mod frames;
pub mod images;
pub mod truth;

pub use device::{AdapterChoice, DeviceError, NativeGpu, adapters};
