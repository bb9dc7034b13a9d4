//! The browser's side. It has no page yet: the crate stands here so that everything the browser will use compiles for
//! `wasm32-unknown-unknown` from the first day.

pub use halflight_renderer as renderer;
pub use halflight_scenes as scenes;
