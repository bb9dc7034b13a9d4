//! The browser demo in a real browser: headless Chromium, WebGPU on SwiftShader. Screenshots are saved in
//! `target/browser`.
#![allow(clippy::unwrap_used)]
#![allow(clippy::disallowed_macros, reason = "`cargo test` captures what a test prints")]

mod best;
mod chromium;
mod controls;
mod errors;
mod failures;
mod first;
mod patience;
mod pictures;
mod random;
mod speed;

use std::{
    net::SocketAddr,
    path::{Path, PathBuf},
    sync::{Mutex, MutexGuard, OnceLock, PoisonError},
};

use serde_json::Value;

/// Size of the page in most tests, CSS pixels.
const SIZE: [u32; 2] = [1180, 720];

/// Runs one browser at a time, because two would disturb each other's times.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

fn target() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("..").join("browser")
}

/// Builds the demo as `cargo xtask web` does, serves it, and returns the address of its page.
fn demo() -> String {
    static DEMO: OnceLock<SocketAddr> = OnceLock::new();
    let address = DEMO.get_or_init(|| {
        let dist = target().join("dist");
        let size = halflight_bundle::build(&dist, None, None).unwrap();
        println!("bundle: {:.2} MB, {:.2} MB compressed", size.raw as f64 / 1e6, size.gzip as f64 / 1e6);
        // With brotli, as most hosts send it, about two thirds of this: 2 MB.
        assert!(size.gzip < 3_200_000, "the compressed bundle has {} bytes", size.gzip);
        halflight_bundle::serve(&dist, 0).unwrap()
    });
    format!("http://{address}/")
}

/// Opens a page with this state, without antialiasing: the pictures are those of one frame.
fn open(state: &str) -> chromium::Page {
    let mut page = chromium::Page::open(SIZE, 1.0);
    page.go(&format!("{}#{state}&antialiasing=off", demo()));
    page
}

/// Whether the picture of every side is complete.
fn settled(report: &Value) -> bool {
    let sides = report["sides"].as_array().map(Vec::as_slice).unwrap_or_default();
    report["settled"] == true && !sides.is_empty() && sides.iter().all(|side| side["drawn"] == true)
}

/// Left, top, width and height of a control.
fn rect(report: &Value, mark: &str) -> [f64; 4] {
    let numbers = report["marks"][mark].as_array().unwrap_or_else(|| panic!("{mark} is not on the page: {report}"));
    std::array::from_fn(|i| numbers[i].as_f64().unwrap())
}

/// Centre of a control.
fn centre(report: &Value, mark: &str) -> [f64; 2] {
    let [x, y, w, h] = rect(report, mark);
    [x + w / 2.0, y + h / 2.0]
}

/// The part of a screenshot inside a rectangle.
fn cut(shot: &image::RgbImage, [x, y, w, h]: [f64; 4]) -> image::RgbImage {
    let round = |v: f64| v.round() as u32;
    image::imageops::crop_imm(shot, round(x), round(y), round(w), round(h)).to_image()
}

/// Mean absolute difference of two pictures, 0..255.
fn difference(a: &image::RgbImage, b: &image::RgbImage) -> f64 {
    assert_eq!(a.dimensions(), b.dimensions());
    let sum: u64 = a.as_raw().iter().zip(b.as_raw()).map(|(&a, &b)| u64::from(a.abs_diff(b))).sum();
    sum as f64 / a.as_raw().len() as f64
}

/// Mean and standard deviation of a picture's values, 0..255.
fn spread(picture: &image::RgbImage) -> (f64, f64) {
    let values = picture.as_raw().iter().map(|&v| f64::from(v));
    let (count, mean) = (picture.as_raw().len() as f64, values.clone().sum::<f64>() / picture.as_raw().len() as f64);
    (mean, (values.map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt())
}
