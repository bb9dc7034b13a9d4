//! How many million rays a second the path tracer reaches on a scene and an adapter.
//!
//!     cargo run --release -p halflight-native --example trace_rate -- [SCENE] [ADAPTER] [BOUNCES]
//!
//! SCENE is a scene file, an OBJ file or the name of a bundled generator (default: atrium); ADAPTER is `any`,
//! `software`, `gpu` or a name; BOUNCES defaults to 1. The rate counts primary, bounce and shadow rays. On a machine
//! with other work the rate per processor second is the steadier figure.
#![allow(clippy::disallowed_macros, reason = "an example for developers")]

use std::{error::Error, path::Path, time::Instant};

use halflight_native::{AdapterChoice, NativeGpu, truth::TruthSource};
use halflight_renderer::truth::{Request, Stop};
use halflight_scenes::{Camera, DiskFiles, Light, Scene, generators, load_scene};

const SIZE: [u32; 2] = [640, 360];
const SAMPLES: u32 = 16;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let argument = |index: usize, default: &str| arguments.get(index).map_or(default.to_owned(), Clone::clone);
    let scene = scene(&argument(0, "atrium"))?;
    let gpu = NativeGpu::open(&AdapterChoice::from(argument(1, "any").as_str()))?;
    let request = Request { bounces: argument(2, "1").parse()?, seed: 1, ..Request::new(scene.camera, SIZE) };
    let source = TruthSource::new(&gpu.gpu, &scene, None);
    println!("{} ({} triangles), {} bounces, {}", scene.name, scene.triangle_count(), request.bounces, gpu.info.name);
    let start = Instant::now();
    source.trace(&request, Stop::at_samples(1), &mut |_| ())?;
    println!("BVH, pipelines and first sample: {:.2} s", start.elapsed().as_secs_f64());
    let processor = processor_seconds();
    let traced = source.trace(&request, Stop::at_samples(SAMPLES), &mut |_| ())?;
    let (rays, time) = traced.traced;
    let million = rays as f64 / 1e6;
    println!("{million:.2} million rays, {:.2} million a second on the wall", million / time.as_secs_f64());
    if let (Some(before), Some(after)) = (processor, processor_seconds()) {
        println!("{:.2} million for each two processor seconds", million / (after - before) * 2.0);
    }
    println!("relative error of a pixel after {SAMPLES} samples: {:.2}", traced.rel_error.unwrap_or(f64::NAN));
    Ok(())
}

fn scene(name: &str) -> Result<Scene, Box<dyn Error>> {
    let Some(geometry) = generators::geometry(name) else { return Ok(load_scene(&DiskFiles, Path::new(name))?) };
    Ok(Scene {
        name: name.into(),
        meshes: geometry.meshes,
        materials: geometry.materials,
        textures: geometry.textures,
        lights: vec![Light::Directional { direction: [0.3, -1.0, 0.3], irradiance: [10.0, 9.5, 8.5] }],
        camera: Camera { eye: [-10.0, 2.0, 0.5], target: [10.0, 4.0, -0.5], ..Camera::default() },
        ..Scene::default()
    })
}

/// Processor time of this process, seconds; `None` where `/proc` does not tell it.
fn processor_seconds() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    let fields: Vec<&str> = text.rsplit(')').next()?.split_whitespace().collect();
    let ticks: f64 = fields.get(11..13)?.iter().filter_map(|f| f.parse::<f64>().ok()).sum();
    Some(ticks / 100.0)
}
