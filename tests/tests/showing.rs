//! What a picture on the screen goes through besides the frame itself: the tone map's twin on the device, and plans that
//! change only in their numbers.
#![allow(clippy::unwrap_used)]

use halflight_frame_graph::{Changed, CompiledGraph, Externals, FramePlan, Part};
use halflight_metrics::tone::{Rgb, tone_map};
use halflight_native::frames::{Timing, read_texture, run_frame};
use halflight_renderer::{
    plan_frame,
    scene::{SceneBuffers, SceneFacts, camera_view},
};
use halflight_scenes::{Camera, Light};
use halflight_shared_shaders::viewer::show::{self, Show};
use halflight_tests::{bundled, device, known};
use wgpu::{TextureFormat as Format, TextureUsages, util::DeviceExt};

/// What the shader that shows a picture makes of this radiance.
fn shown(pixels: &[Rgb], exposure: f32, limit: f32) -> Vec<[u8; 4]> {
    let gpu = &device().gpu;
    let size = [pixels.len() as u32, 1];
    let mut plan = FramePlan::new(size);
    let display = plan.texture("display", size, Format::Rgba8Unorm, "what the screen shows");
    let image = plan.external("image", "the texture to show");
    plan.outputs.insert("display", display);
    let params = show::Params { content: 0, divisor: 1, exposure, range: 1.0, limit };
    plan.pass(Part::Technique, "show", Show { image, display, params }).over(size);
    let texels: Vec<_> = pixels.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
    let descriptor = wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width: size[0], height: 1, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: Format::Rgba32Float,
        usage: TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    let texture =
        gpu.device.create_texture_with_data(&gpu.queue, &descriptor, Default::default(), bytemuck::cast_slice(&texels));
    let recording =
        CompiledGraph::new(gpu, plan, &Externals { textures: [("image", texture)].into(), ..Default::default() });
    run_frame(gpu, &recording, &camera_view(&Camera::default(), size, 0.1), Timing::Clock, Changed::Anything).unwrap();
    let bytes = read_texture(gpu, recording.output("display").unwrap()).unwrap();
    bytes.as_chunks::<4>().0.to_vec()
}

#[test]
fn the_screen_shows_what_png_files_show() {
    let values = [0.0, 1e-30, 1e-4, 0.0031308, 0.02, 0.1, 0.5, 0.79, 0.81, 1.0, 3.0, 100.0, 1e6, 1e30];
    let mut pixels: Vec<Rgb> = values.iter().map(|&v| [v, 0.5 * v, 0.1 * v]).collect();
    pixels.extend(values.map(|v| [0.3, v, 0.0]));
    pixels.push([-1.0, 0.5, 0.0]);
    for exposure in [0.01, 1.0, 7.5] {
        for (pixel, got) in pixels.iter().zip(shown(&pixels, exposure, f32::MAX)) {
            let wanted = tone_map(*pixel, exposure).map(|v| (v * 255.0).round());
            for (wanted, got) in wanted.iter().zip(got) {
                // One step: the device rounds its powers and its last step in its own way.
                assert!((wanted - f32::from(got)).abs() <= 1.0, "{pixel:?} at {exposure}: {wanted} and {got}");
            }
        }
    }
}

#[test]
fn what_is_not_sound_has_a_colour_of_its_own() {
    let (magenta, cyan, black) = ([255, 0, 255, 255], [0, 255, 255, 255], [0, 0, 0, 255]);
    let pixels = [
        ([f32::NAN, 0.0, 0.0], magenta),
        ([0.0, -f32::NAN, 0.0], magenta),
        ([0.0, 0.0, f32::INFINITY], magenta),
        ([f32::NEG_INFINITY, 65504.0, 0.0], magenta),
        ([65504.0, 0.0, 0.0], cyan),
        ([0.0, 1e30, 0.0], cyan),
        // A normal may have any sign, and the number below the largest one was not clamped.
        ([-65504.0, 0.0, 0.0], black),
        ([0.0; 3], black),
        ([0.0, f32::from_bits(65504f32.to_bits() - 1), 0.0], [0, 255, 0, 255]),
    ];
    for ((pixel, wanted), got) in pixels.iter().zip(shown(&pixels.map(|(pixel, _)| pixel), 1.0, 65504.0)) {
        assert_eq!(*wanted, got, "{pixel:?}");
    }
}

#[test]
fn a_recording_that_followed_a_light_draws_what_a_new_one_draws() {
    let gpu = &device().gpu;
    let mut scene = bundled("cornell");
    let buffers = SceneBuffers::new(gpu, &scene);
    let plan = |scene: &_, samples: i64| {
        let settings =
            [("hierarchical.samples".to_owned(), halflight_renderer::parameters::Value::Int(samples))].into();
        plan_frame(&SceneFacts::of(scene), known("hierarchical"), &settings, [64, 36], Default::default()).unwrap()
    };
    let externals = |buffers| Externals { scene: Some(buffers), ..Default::default() };
    let draw = |recording: &CompiledGraph, scene: &halflight_scenes::Scene| {
        let view = camera_view(&scene.camera, [64, 36], SceneFacts::of(scene).near);
        run_frame(gpu, recording, &view, Timing::Clock, Changed::Anything).unwrap();
        read_texture(gpu, recording.output("final").unwrap()).unwrap()
    };
    let mut followed = CompiledGraph::new(gpu, plan(&scene, 16), &externals(&buffers));
    let before = draw(&followed, &scene);
    if let Light::Spot { position, direction, .. } = &mut scene.lights[0] {
        (*position, *direction) = ([0.4, 1.8, 0.3], [-0.3, -1.0, -0.2]);
    }
    assert!(buffers.relight(gpu, &scene.lights));
    assert!(followed.update(gpu, &plan(&scene, 16)));
    let after = draw(&followed, &scene);
    assert_ne!(before, after, "the light did not move");
    let fresh = SceneBuffers::new(gpu, &scene);
    assert_eq!(after, draw(&CompiledGraph::new(gpu, plan(&scene, 16), &externals(&fresh)), &scene));
    // Another constant is another pipeline, another number of lights another plan.
    assert!(!followed.update(gpu, &plan(&scene, 17)));
    assert!(!buffers.relight(gpu, &[]));
}
