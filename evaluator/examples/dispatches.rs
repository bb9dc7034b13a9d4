//! The longest dispatch of each technique at its default and at its most expensive settings: milliseconds, by the
//! computer's clock. Of a pass with many dispatches a few are run, spread over the image, and the time of all is
//! estimated.
//!
//!     cargo run --release -p halflight-evaluator --example dispatches -- 1280x720
#![allow(clippy::disallowed_macros, reason = "an example prints")]

use std::{error::Error, time::Instant};

use halflight_frame_graph::{Changed, CompiledGraph, Externals, Work};
use halflight_native::{AdapterChoice, NativeGpu};
use halflight_renderer::{
    parameters::{Settings, Value},
    plan_frame,
    scene::{SceneBuffers, SceneFacts, camera_view},
};
use halflight_scenes::bundled;
use halflight_techniques::{invocation::parse_size, technique};

/// Dispatches of a pass that are run.
const RUN: usize = 8;

/// A technique, a scene and settings.
type Case = (&'static str, &'static str, &'static [(&'static str, &'static str)]);

/// Techniques with the settings that scale their cost.
const CASES: [Case; 17] = [
    ("bitmask", "atrium", &[]),
    ("bitmask", "atrium", &[("slices", "64"), ("steps", "256")]),
    ("bitmask", "cornell_sky", &[("slices", "16"), ("steps", "32")]),
    ("gtao", "atrium", &[("slices", "64"), ("steps", "256")]),
    ("horizon", "atrium", &[("slices", "64"), ("steps", "256")]),
    ("ray-march", "atrium", &[("rays", "256"), ("steps", "256")]),
    ("ssao", "atrium", &[("samples", "1024")]),
    ("ssdo", "atrium", &[("samples", "1024"), ("start_resolution", "full")]),
    ("rsm", "atrium", &[("samples", "1024"), ("start_resolution", "full")]),
    ("hybrid", "atrium", &[]),
    ("hybrid", "atrium", &[("light_samples", "1024"), ("screen_samples", "1024"), ("samples_per_ray", "1")]),
    ("hybrid", "lights", &[("weighting", "pattern"), ("light_samples", "1024"), ("ambient_occlusion", "both")]),
    ("hierarchical", "atrium", &[("samples", "1024")]),
    ("hierarchical", "atrium", &[("samples", "1024"), ("sources", "lights"), ("samples_per_ray", "1")]),
    ("hierarchical", "atrium", &[("samples", "256"), ("visibility", "auto"), ("samples_per_ray", "1")]),
    ("hierarchical", "cornell_sky", &[("sky_rays", "1024")]),
    ("exhaustive", "cornell", &[]),
];

fn main() -> Result<(), Box<dyn Error>> {
    let size = parse_size(&std::env::args().nth(1).unwrap_or_else(|| "1280x720".into()))?;
    let only = std::env::args().nth(2);
    let native = NativeGpu::open(&AdapterChoice::from("any"))?;
    let gpu = &native.gpu;
    println!("{}, {}x{}, at most {} fetches a dispatch", native.info.name, size[0], size[1], gpu.work_at_once);
    println!("| technique | pass | dispatches | longest, ms | all, s | ns a fetch |");
    println!("|---|---|---:|---:|---:|---:|");
    for (name, scene, settings) in CASES.iter().filter(|(name, ..)| only.as_deref().is_none_or(|only| only == *name)) {
        let scene = bundled::scene(scene)?;
        let settings: Settings =
            settings.iter().map(|(key, value)| (format!("{name}.{key}"), Value::parse(value))).collect();
        let (facts, buffers) = (SceneFacts::of(&scene), SceneBuffers::new(gpu, &scene));
        let plan = plan_frame(&facts, technique(name)?, &settings, size, Default::default())?;
        let graph = CompiledGraph::new(gpu, plan, &Externals { scene: Some(&buffers), ..Default::default() });
        let commands = graph.record_apart(gpu, &camera_view(&scene.camera, size, facts.near), Changed::Anything);
        for (index, (pass, commands)) in graph.plan().passes.iter().zip(commands).enumerate() {
            let count = commands.len();
            // Drivers compile a shader when it runs for the first time.
            let mut encoder = gpu.device.create_command_encoder(&Default::default());
            graph.record_repeated(&mut encoder, index, u32::from(count == 1));
            gpu.queue.submit([encoder.finish()]);
            gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
            // Spread over the image.
            let step = if count > 4 * RUN { count.div_ceil(RUN) } else { 1 };
            let mut times = Vec::new();
            for (_, commands) in commands.into_iter().enumerate().filter(|(index, _)| index % step == step / 2) {
                let begin = Instant::now();
                gpu.queue.submit([commands]);
                gpu.device.poll(wgpu::PollType::wait_indefinitely())?;
                times.push(begin.elapsed().as_secs_f64());
            }
            if times.len() > 1 {
                times.remove(0);
            }
            let longest = times.iter().copied().fold(0.0, f64::max);
            let all = times.iter().sum::<f64>() / times.len().max(1) as f64 * count as f64;
            if let Work::Dispatch { size: [x, y], .. } = pass.work
                && longest > 0.02
            {
                let fetches = pass.cost as f64 * f64::from(x) * f64::from(y);
                println!(
                    "| `{name}` | `{}` | {count} | {:.0} | {all:.1} | {:.1} |",
                    pass.name,
                    longest * 1e3,
                    all * 1e9 / fetches
                );
            }
        }
    }
    Ok(())
}
