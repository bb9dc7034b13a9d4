//! The viewer in a browser: an entry point that opens it on a canvas, and functions that the page calls.
//!
//! The page is in `web/page`. It checks for WebGPU before it loads anything, shows errors over the whole page, and opens
//! the viewer again after a lost device. On other targets than wasm32 the crate is empty.
//!
//! ```js
//! const viewer = await import("./halflight_web.js");
//! await viewer.default({ module_or_path: "halflight_web_bg.wasm" });
//! await viewer.start(document.getElementById("view"), "scene=cornell&size=640x360");
//! console.log(JSON.parse(viewer.report()).settled); // whether the picture is complete
//! viewer.go_to("scene=atrium"); // as if this link were opened
//! ```

#[cfg(target_arch = "wasm32")]
mod browser;
