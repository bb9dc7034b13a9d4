//! Long dispatches are divided, and no picture depends on how.
#![allow(clippy::unwrap_used)]

use std::{collections::BTreeSet, time::Instant};

use halflight_frame_graph::{
    Changed, CompiledGraph, Externals, FramePlan, Gpu, Part, WORK_ON_GPU, WORK_ON_PROCESSOR, Work,
};
use halflight_native::{
    AdapterChoice, NativeGpu,
    frames::{map, read_texture},
};
use halflight_renderer::{
    parameters::{Settings, Value},
    plan_frame,
    scene::{SceneBuffers, SceneFacts, camera_view},
};
use halflight_scenes::Scene;
use halflight_shared_shaders::hierarchical::sum::Sum;
use halflight_techniques::TECHNIQUES;
use halflight_tests::{bundled, device, known, settings};

/// Neither a multiple of a workgroup nor of a tile.
const SIZE: [u32; 2] = [70, 41];

/// A device of its own, because the bound is part of it.
fn with_work(work_at_once: u64) -> NativeGpu {
    let choice = std::env::var("HALFLIGHT_ADAPTER").unwrap_or_default();
    let mut native = NativeGpu::open(&AdapterChoice::from(choice.as_str())).unwrap();
    native.gpu.work_at_once = work_at_once;
    native
}

fn planned(scene: &Scene, technique: &str, settings: &Settings, size: [u32; 2]) -> FramePlan {
    plan_frame(&SceneFacts::of(scene), known(technique), settings, size, Default::default()).unwrap()
}

/// All images of a frame, and the number of command buffers that it took.
fn images(gpu: &Gpu, scene: &Scene, technique: &str, settings: &Settings) -> (Vec<Vec<u8>>, usize) {
    let buffers = SceneBuffers::new(gpu, scene);
    let externals = Externals { scene: Some(&buffers), ..Default::default() };
    let graph = CompiledGraph::new(gpu, planned(scene, technique, settings, SIZE), &externals);
    let view = camera_view(&scene.camera, SIZE, SceneFacts::of(scene).near);
    let commands = graph.commands(gpu, &view, Changed::Anything);
    let count = commands.len();
    for commands in commands {
        gpu.queue.submit([commands]);
    }
    let outputs = graph.plan().outputs.keys();
    (outputs.map(|output| read_texture(gpu, graph.output(output).unwrap()).unwrap()).collect(), count)
}

/// One shader of each kind that can be divided: levels of surfels, gathers of slices, of points and of levels, filters,
/// changes of resolution, the final image, lit surfaces and voxels.
const DIVIDED: [&str; 13] = [
    "ambient/ambient",
    "bitmask/gather",
    "composite/composite",
    "denoise/denoise",
    "direct/direct_light",
    "hierarchical/gather",
    "hierarchical/pyramid",
    "hierarchical/upsample",
    "hierarchical/upsample_linear",
    "hybrid/gather",
    "reflective_shadow_maps/lit_surfaces",
    "scene_voxels/fill",
    "temporal/temporal",
];

#[test]
fn pictures_do_not_depend_on_the_division() {
    /// Single workgroups of gathers and voxels; parts of rows of the filters; whole rows of the coarse levels.
    const AT_ONCE: u64 = 1 << 11;
    let [whole, divided] = [u64::MAX, AT_ONCE].map(with_work);
    let half: &[(&str, &str)] = &[("resolution", "half"), ("temporal_a", "0.9")];
    let cases = [
        ("cornell_sky", "bitmask", &[][..]),
        ("cornell_sky", "bitmask", half),
        ("cornell_sky", "gtao", &[]),
        ("lights", "hybrid", &[]),
        ("lights", "hierarchical", &[]),
    ];
    let mut shaders = BTreeSet::new();
    for (scene, technique, values) in cases {
        let scene = bundled(scene);
        let settings = settings(technique, &[&[("direct.shadow_map_size", "64")], values].concat());
        for pass in planned(&scene, technique, &settings, SIZE).passes {
            if pass.dispatches(AT_ONCE) > 1 {
                // Names of features follow the name of the shader.
                shaders.extend(pass.shader.name.split('+').next());
            }
        }
        let (expected, count) = images(&whole.gpu, &scene, technique, &settings);
        assert_eq!(count, 1, "{technique}: one submission");
        let (images, count) = images(&divided.gpu, &scene, technique, &settings);
        assert!(count > 1, "{technique}: several submissions");
        assert!(images == expected, "{} {technique}", scene.name);
    }
    for shader in DIVIDED {
        assert!(shaders.contains(shader), "{shader} is not among {shaders:?}");
    }
}

/// Passes whose work a setting scales, at the settings that cost most.
fn most_expensive() -> Vec<(&'static str, Settings, &'static str)> {
    let slices: &[(&str, &str)] = &[("slices", "64"), ("steps", "256")];
    vec![
        ("bitmask", settings("bitmask", slices), "gather"),
        ("gtao", settings("gtao", slices), "gather"),
        ("horizon", settings("horizon", slices), "gather"),
        ("ray-march", settings("ray-march", &[("rays", "256"), ("steps", "256")]), "gather"),
        ("ssao", settings("ssao", &[("samples", "1024"), ("start_resolution", "full")]), "gather"),
        ("ssdo", settings("ssdo", &[("samples", "1024"), ("start_resolution", "full")]), "gather"),
        ("rsm", settings("rsm", &[("samples", "1024"), ("start_resolution", "full")]), "rsm_0"),
        ("hybrid", settings("hybrid", &[("light_samples", "1024"), ("start_resolution", "full")]), "gather"),
        ("hierarchical", settings("hierarchical", &[("samples", "1024"), ("start_resolution", "full")]), "gather_0"),
        ("exhaustive", settings("exhaustive", &[]), "exhaustive_0"),
    ]
}

#[test]
fn expensive_passes_are_divided_and_cheap_ones_are_not() {
    let scene = bundled("atrium");
    for (technique, settings, pass) in most_expensive() {
        let plan = planned(&scene, technique, &settings, [1280, 720]);
        let pass = plan.find(pass).unwrap();
        let Work::Dispatch { size: [x, y], .. } = pass.work else { panic!("{technique}") };
        let work = pass.cost * u64::from(x) * u64::from(y);
        for at_once in [WORK_ON_GPU, WORK_ON_PROCESSOR] {
            // A workgroup is never divided.
            let of_group = 64 * pass.cost;
            let fewest = work.div_ceil(at_once.max(of_group)) as usize;
            assert!(pass.dispatches(at_once) >= fewest, "{technique}: {} of {fewest}", pass.dispatches(at_once));
        }
        assert!(pass.dispatches(WORK_ON_PROCESSOR) > 100, "{technique}");
    }
    // What is below the bound stays one dispatch: every technique at its defaults on a GPU.
    for technique in TECHNIQUES.iter().filter(|technique| technique.name != "exhaustive") {
        let plan = planned(&scene, technique.name, &Settings::new(), [1280, 720]);
        for pass in &plan.passes {
            // Sixteen rays to the sky of each pixel are above it.
            let most = if pass.name == "ambient" { 4 } else { 1 };
            assert!(pass.dispatches(WORK_ON_GPU) <= most, "{} of {}", pass.name, technique.name);
        }
    }
    let text = planned(&bundled("lights"), "bitmask", &most_expensive()[0].1, [1280, 720]).to_string();
    let line = text.lines().find(|line| line.contains("dispatches on a GPU")).unwrap();
    assert!(line.contains("60 dispatches on a GPU, 14400 on a software adapter"), "{line}");
}

#[test]
fn no_dispatch_takes_as_long_as_a_watchdog_waits() {
    /// Seconds. A dispatch is bounded to a tenth of a second on two free cores (evaluator/examples/dispatches.rs
    /// measures it), and the computer may be busy with other tests.
    const LONGEST: f64 = 2.0;
    let (gpu, scene, size) = (&device().gpu, bundled("lights"), [640, 360]);
    let (facts, buffers) = (SceneFacts::of(&scene), SceneBuffers::new(gpu, &scene));
    for (technique, mut settings, measured) in most_expensive() {
        settings.insert("direct.shadow_map_size".into(), Value::parse("64"));
        let externals = Externals { scene: Some(&buffers), ..Default::default() };
        let graph = CompiledGraph::new(gpu, planned(&scene, technique, &settings, size), &externals);
        let commands = graph.record_apart(gpu, &camera_view(&scene.camera, size, facts.near), Changed::Anything);
        let run = |commands: wgpu::CommandBuffer| {
            let begin = Instant::now();
            gpu.queue.submit([commands]);
            gpu.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
            begin.elapsed().as_secs_f64()
        };
        for (index, (pass, commands)) in graph.plan().passes.iter().zip(commands).enumerate() {
            let step = commands.len().div_ceil(2);
            let middle: Vec<_> = commands.into_iter().skip(step / 2).step_by(step.max(1)).collect();
            // Drivers compile a shader when it runs for the first time: that run does not count.
            let count = middle.len();
            let mut times: Vec<f64> = middle.into_iter().map(run).skip(1).collect();
            if count == 1 {
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                graph.record_repeated(&mut encoder, index, 1);
                times.push(run(encoder.finish()));
            }
            let longest = times.into_iter().fold(0.0, f64::max);
            assert!(longest < LONGEST, "{technique}: a dispatch of {} took {longest} s", pass.name);
            if pass.name == measured {
                break;
            }
        }
    }
}

#[test]
fn frames_of_many_passes_keep_their_times() {
    const PASSES: usize = 2500;
    let gpu = &device().gpu;
    if gpu.timestamp_period.is_none() {
        return;
    }
    let mut plan = FramePlan::new([8, 8]);
    let mut texture = |name: &str| plan.texture(name, [8, 8], wgpu::TextureFormat::Rgba32Float, "test");
    let [light, so_far, sum] = ["light", "so_far", "sum"].map(&mut texture);
    for index in 0..PASSES {
        plan.pass(Part::Technique, format!("sum_{index}"), Sum { light, so_far, sum, float16: false }).over([8, 8]);
    }
    let graph = CompiledGraph::new(gpu, plan, &Externals::default());
    let view = camera_view(&bundled("cornell").camera, [8, 8], 0.1);
    for commands in graph.commands(gpu, &view, Changed::Anything) {
        gpu.queue.submit([commands]);
    }
    let times = graph.pass_times(&map(gpu, graph.timing_buffer().unwrap()).unwrap());
    assert_eq!(times.len(), PASSES);
    assert_eq!(times[PASSES - 1].name, format!("sum_{}", PASSES - 1));
    assert!(times.iter().all(|time| time.milliseconds.is_finite() && time.milliseconds < 1e4));
}
