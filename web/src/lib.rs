//! The browser's side of the viewer: an entry point that opens it on a canvas, and functions that the page calls.
//!
//! The page is `web/page`: it looks for WebGPU before anything is loaded, shows what went wrong over the whole page, and
//! opens the viewer again after a lost device. Elsewhere than on wasm32 the crate is empty.

#[cfg(target_arch = "wasm32")]
mod browser;
