//! Helpers of the tests that need more than one crate: one device per test binary, bundled scenes, requests and images.

pub mod show;
pub mod snapshot;

use std::{
    path::{Path, PathBuf},
    sync::OnceLock,
};

use halflight_evaluator::experiment::session::{Frames, Request, Session};
use halflight_native::{
    AdapterChoice, NativeGpu,
    images::{Rgb, luminance},
};
use halflight_renderer::{
    gi::Technique,
    parameters::{Settings, Value},
};
use halflight_scenes::Scene;
use halflight_techniques::technique;

/// Root of the workspace.
pub fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The device of this test binary, opened on first use. `HALFLIGHT_ADAPTER` chooses it as
/// `--adapter` does.
///
/// # Panics
/// Where there is no adapter: nothing could be tested.
pub fn device() -> &'static NativeGpu {
    static DEVICE: OnceLock<NativeGpu> = OnceLock::new();
    DEVICE.get_or_init(|| {
        let choice = std::env::var("HALFLIGHT_ADAPTER").unwrap_or_default();
        NativeGpu::open(&AdapterChoice::from(choice.as_str())).expect("tests need an adapter")
    })
}

/// A bundled scene.
///
/// # Panics
/// Where it does not load.
pub fn bundled(name: &str) -> Scene {
    halflight_scenes::bundled::scene(name).expect("a bundled scene loads")
}

/// A request for a technique with settings as grid files write them: `("levels", "4")`.
///
/// # Panics
/// Where there is no such technique.
pub fn request<'a>(name: &str, settings: &[(&str, &str)], size: [u32; 2]) -> Request<'a> {
    Request { technique: known(name), settings: self::settings(name, settings), size, seed: 0, direct: None }
}

/// The technique of this name.
///
/// # Panics
/// Where there is none.
pub fn known(name: &str) -> &'static Technique {
    technique(name).expect("the technique exists")
}

/// Settings of one technique; a name with a dot is a whole key.
pub fn settings(technique: &str, settings: &[(&str, &str)]) -> Settings {
    let key = |name: &str| if name.contains('.') { name.into() } else { format!("{technique}.{name}") };
    settings.iter().map(|(name, value)| (key(name), Value::parse(value))).collect()
}

/// A request ready to run.
///
/// # Panics
/// Where it cannot run.
pub fn frames<'a>(session: &'a Session, request: &Request) -> Frames<'a> {
    session.frames(request).expect("the request runs")
}

/// An output after one frame.
///
/// # Panics
/// Where the frame fails or there is no such output.
pub fn render(session: &Session, request: &Request, output: &str) -> Vec<Rgb> {
    let mut frames = frames(session, request);
    frames.run(0).expect("the frame runs");
    frames.read_rgb(output).expect("the output is read").expect("the output exists")
}

/// Mean over pixels, luminance.
pub fn mean_luminance(pixels: &[Rgb]) -> f64 {
    pixels.iter().map(|&p| f64::from(luminance(p))).sum::<f64>() / pixels.len() as f64
}
