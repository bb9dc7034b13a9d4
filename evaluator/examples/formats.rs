//! What narrower formats cost: block relMSE against the wide format. With `SCENE FRAMES`, and techniques if not all are
//! wanted, of the formats that a setting chooses, for means over that many frames. With pairs of EXR images of `evaluator render`, for each layer that both
//! have; the first image of a pair is the one under test.
//!
//!     cargo run --release -p halflight-evaluator --example formats -- atrium 1 hierarchical
//!     cargo run --release -p halflight-evaluator --example formats -- narrow.exr wide.exr ...
#![allow(clippy::disallowed_macros, reason = "an example prints")]

use std::{env, error::Error, path::Path};

use halflight_evaluator::experiment::session::{Request, Session};
use halflight_metrics::{LinearPair, Rgb, block_rel_mse};
use halflight_native::{AdapterChoice, NativeGpu, images::Image};
use halflight_renderer::parameters::{Settings, Value};
use halflight_scenes::{Scene, bundled};
use halflight_techniques::technique;

/// A technique, settings, the setting that chooses the format, and the output that is compared.
type Case = (&'static str, &'static [(&'static str, &'static str)], &'static str, &'static str);

const CASES: [Case; 7] = [
    ("none", &[], "direct.storage", "direct"),
    ("bitmask", &[], "direct.storage", "indirect"),
    ("hybrid", &[], "direct.storage", "indirect"),
    (
        "hierarchical",
        &[("hierarchical.visibility", "auto"), ("hierarchical.bounces", "2")],
        "direct.storage",
        "indirect",
    ),
    ("bitmask", &[], "bitmask.storage", "indirect"),
    ("horizon", &[], "horizon.storage", "indirect"),
    ("ray-march", &[], "ray-march.storage", "indirect"),
];

fn images(a: &[Rgb], b: &[Rgb], mask: Option<&[bool]>, width: u32, name: &str) {
    let error = block_rel_mse(&LinearPair::new(a, b, mask), width);
    let differ = a.iter().zip(b).filter(|(a, b)| a != b).count();
    println!("{name}: block relMSE {error:.2e}, {differ} pixels differ");
}

/// A layer as three channels; ambient visibility fills all of them.
fn layer(image: &Image, name: &str) -> Option<Vec<Rgb>> {
    match name {
        "ambient_occlusion" => image.channel("ambient_occlusion.Y").map(|open| open.iter().map(|&v| [v; 3]).collect()),
        "final" => image.rgb(""),
        _ => image.rgb(name),
    }
}

fn files(paths: &[String]) -> Result<(), Box<dyn Error>> {
    for pair in paths.chunks_exact(2) {
        let [narrow, wide] = [&pair[0], &pair[1]].map(|path| Image::read(Path::new(path)));
        let (narrow, wide) = (narrow?, wide?);
        let mask = wide.surface_mask();
        for name in ["direct", "indirect", "ambient_occlusion", "final"] {
            if let (Some(own), Some(wanted)) = (layer(&narrow, name), layer(&wide, name)) {
                images(&own, &wanted, mask.as_deref(), wide.width, &format!("{} {name}", pair[0]));
            }
        }
    }
    Ok(())
}

fn settings(scene: &Scene, frames: u32, wanted: &[String]) -> Result<(), Box<dyn Error>> {
    let native = NativeGpu::open(&AdapterChoice::from("any"))?;
    let session = Session::new(&native, scene);
    let is_wanted = |name: &str| wanted.is_empty() || wanted.iter().any(|wanted| wanted == name);
    for (name, values, key, output) in CASES.into_iter().filter(|case| is_wanted(case.0)) {
        let mut mask = Vec::new();
        let mut mean = |storage: &str| -> Result<Vec<Rgb>, Box<dyn Error>> {
            let of = |(key, value): (&str, &str)| (key.to_owned(), Value::parse(value));
            let settings: Settings = values.iter().copied().chain([(key, storage)]).map(of).collect();
            let technique = technique(name)?;
            let request = Request { technique, settings, size: [1280, 720], seed: 0, direct: None };
            let mut run = session.frames(&request)?;
            let (mean, _) = run.mean_over_frames(output, frames)?;
            mask = run.read("depth")?.unwrap_or_default().iter().map(|depth| depth[0] > 0.0).collect();
            Ok(mean)
        };
        let (narrow, wide) = (mean("float16")?, mean("float32")?);
        images(&narrow, &wide, Some(&mask), 1280, &format!("{name} {key} {output}, {frames} frames"));
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    match arguments.as_slice() {
        [scene, frames, wanted @ ..] if !scene.ends_with(".exr") => {
            settings(&bundled::scene(scene)?, frames.parse()?, wanted)
        }
        paths => files(paths),
    }
}
