//! Textures that do not live at once share memory, and no picture differs for it.
#![allow(clippy::unwrap_used)]

use halflight_frame_graph::{ResourceId, ResourceKind};
use halflight_renderer::parameters::{Settings, Value};
use halflight_scenes::{Camera, Scene};
use halflight_techniques::TECHNIQUES;
use halflight_tests::{
    bundled, device, settings,
    show::{Show, turned},
};
use wgpu::TextureUsages;

/// Techniques with settings that give them many textures. Shadow maps are small, to save time.
fn configurations() -> Vec<(&'static str, Settings)> {
    let small = ("direct.shadow_map_size", "128");
    let with = |technique: &'static str, values: &[(&str, &str)]| {
        (technique, settings(technique, &[&[small], values].concat()))
    };
    let mut all = vec![
        with("bitmask", &[("denoise", "3")]),
        with("bitmask", &[("resolution", "half"), ("denoise", "2"), ("feedback", "0.9"), ("temporal_a", "0.9")]),
        with("hierarchical", &[("visibility", "auto"), ("bounces", "2")]),
        with(
            "hierarchical",
            &[("sources", "both"), ("temporal_a", "0.9"), ("bounces", "3"), ("voxel_resolution", "32")],
        ),
        with("hybrid", &[("voxel_resolution", "32")]),
        with(
            "hybrid",
            &[
                ("weighting", "pattern"),
                ("specular", "both"),
                ("ambient_occlusion", "both"),
                ("temporal_a", "0.9"),
                ("voxel_resolution", "32"),
            ],
        ),
        with("radiance-cache", &[]),
        with("gtao", &[("resolution", "half"), ("denoise", "3")]),
    ];
    let others = TECHNIQUES.iter().filter(|technique| all.iter().all(|(name, _)| *name != technique.name));
    let others: Vec<_> = others.map(|technique| with(technique.name, &[])).collect();
    all.extend(others);
    all
}

/// Runs a sequence of changes on two shows, and checks that all outputs are equal after each frame. `before` is called
/// for the second one before each frame.
#[track_caller]
fn same_in_a_sequence(name: &str, shows: [Show; 2], before: &dyn Fn(&Show)) {
    let [mut one, mut other] = shows;
    let mut camera = one.scene.camera;
    let mut frame = 0;
    let mut same = |one: &mut Show, other: &mut Show, camera: &Camera, advances: bool, step: &str| {
        frame += u32::from(advances);
        before(other);
        assert_eq!(one.differing(other, camera, frame), [""; 0], "{name} {:?}: {step}", one.settings);
    };
    same(&mut one, &mut other, &camera, false, "the first frame");
    same(&mut one, &mut other, &camera, false, "the same frame again");
    same(&mut one, &mut other, &camera, true, "the next frame");
    camera.eye[0] += 0.05;
    same(&mut one, &mut other, &camera, false, "a moved camera");
    same(&mut one, &mut other, &camera, true, "the frame after it");
    for index in 0..one.scene.lights.len().min(2) {
        for show in [&mut one, &mut other] {
            show.relight(turned(&show.scene.lights, index));
        }
        same(&mut one, &mut other, &camera, index == 0, "another light");
    }
    for show in [&mut one, &mut other] {
        show.settings.insert("direct.shadow_map_size".into(), Value::parse("64"));
        // A number of one pass alone, where the technique has it.
        let thickness = format!("{name}.thickness_slope");
        if ["bitmask", "ray-march"].contains(&name) {
            show.settings.insert(thickness, Value::parse("0.05"));
        }
        show.replan();
    }
    same(&mut one, &mut other, &camera, false, "another setting");
    same(&mut one, &mut other, &camera, true, "the frame after it");
    for show in [&mut one, &mut other] {
        show.size = [50, 41];
        show.replan();
    }
    same(&mut one, &mut other, &camera, true, "another size");
    same(&mut one, &mut other, &camera, true, "and again");
}

fn scenes() -> [(&'static str, Scene); 2] {
    let mut sky = bundled("bars_sky");
    sky.lights.extend(bundled("lights").lights.into_iter().take(1));
    [("lights", bundled("lights")), ("a lit scene with a sky", sky)]
}

#[test]
fn pictures_are_equal_if_memory_is_shared() {
    let mut sharing = 0;
    for (_, scene) in scenes() {
        for (technique, settings) in configurations() {
            let shared = Show::new(&scene, technique, &settings);
            let (plan, memory) = (shared.graph.plan(), shared.graph.plan().memory());
            sharing += u32::from((0..plan.resources.len()).any(|index| memory.owner(ResourceId(index)).0 != index));
            let alone = Show::new(&scene, technique, &settings).keeping_all();
            assert!(shared.graph.shares_memory() && !alone.graph.shares_memory());
            same_in_a_sequence(technique, [shared, alone], &|_| {});
        }
    }
    assert!(sharing > 8, "only {sharing} plans share memory");
}

#[test]
fn what_lives_in_one_frame_is_written_before_it_is_read() {
    // Fills everything that need not outlive a frame with NaN before each frame.
    let spoil = |show: &Show| {
        let (gpu, plan) = (&device().gpu, show.graph.plan());
        let memory = plan.memory();
        for index in 0..plan.resources.len() {
            let id = ResourceId(index);
            let Some(texture) = show.graph.texture(id).filter(|_| memory.is_of_one_frame(id)) else { continue };
            let ResourceKind::Texture { format, layers, size: [width, height] } = plan.resources[index].kind else {
                continue;
            };
            // Depth cannot be written from outside; draws clear it.
            if format.is_depth_stencil_format() || !texture.usage().contains(TextureUsages::COPY_DST) {
                continue;
            }
            let row = width * format.block_copy_size(None).unwrap();
            // NaN as float16 and as float32.
            let bytes = [0xc0, 0x7f].repeat((row * height * layers / 2) as usize);
            let layout =
                wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: Some(height) };
            gpu.queue.write_texture(texture.as_image_copy(), &bytes, layout, texture.size());
        }
    };
    for (_, scene) in scenes() {
        for (technique, settings) in configurations() {
            let show = || Show::new(&scene, technique, &settings).reusing(false).keeping_all();
            same_in_a_sequence(technique, [show(), show()], &spoil);
        }
    }
}
