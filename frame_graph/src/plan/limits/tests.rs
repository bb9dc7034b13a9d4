//! Each limit, with made-up devices.

use halflight_shared_shaders::{shadow::shadow_map::ShadowMap, source::Source};
use wgpu::TextureFormat as Format;

use super::*;
use crate::plan::Part;

/// A plan that touches every limit: two compute passes of 8x8 workgroups and a raster pass.
fn plan([width, height]: [u32; 2]) -> FramePlan {
    let mut plan = FramePlan::new([width, height]);
    let direct = plan.external("direct", "given");
    let material = plan.external("material", "given");
    let receive_only = plan.data("receive_only", vec![0; 400], "flags");
    let source = plan.texture("source", [width, height], Format::Rgba32Float, "light");
    plan.buffer("sums", 5000, "sums");
    plan.pass(Part::Technique, "source", Source { direct, material, receive_only, source, float16: false })
        .because("a test")
        .over([width, height]);
    let vertices = plan.scene_buffer("scene.vertices", "geometry");
    let shadow_view = plan.data("light_view_0", vec![0; 80], "a view");
    let maps = plan.texture_array("shadow_maps", [64; 2], 7, Format::Depth32Float, "shadow maps");
    let run = ShadowMap { shadow_view, vertices, alpha_tested: None, animated: None, triangles: None };
    plan.pass(Part::Direct, "shadow_0", run).because("a test").draw([("all", None)], vec![source], (maps, 0));
    plan
}

const SIZE: [u32; 2] = [1280, 720];

fn size(name: &str) -> Option<ExternalSize> {
    (name == "scene.vertices").then_some(ExternalSize { bytes: 3200, element: 32, elements: "vertices", texture: None })
}

/// A device that allows everything, changed by `change`.
fn device(change: impl FnOnce(&mut wgpu::Limits)) -> DeviceLimits {
    let mut limits = wgpu::Limits::default();
    change(&mut limits);
    DeviceLimits { limits, memory: None }
}

fn refusal(device: &DeviceLimits) -> String {
    plan(SIZE).check(device, &size).expect_err("it is too large").to_string()
}

#[test]
fn a_plan_within_all_limits_passes() {
    assert_eq!(plan(SIZE).check(&DeviceLimits::browser(), &size), Ok(()));
    assert!(plan(SIZE).demands(&DeviceLimits::browser(), &size).iter().all(Demand::fits));
    assert_eq!(FramePlan::new(SIZE).check(&DeviceLimits::browser(), &size), Ok(()));
}

#[test]
fn each_limit_is_checked_at_its_very_edge() {
    type Set = fn(&mut wgpu::Limits, u64);
    // The largest demand of the plan above, and how to set the limit.
    let cases: [(Limit, &str, u64, Set); 12] = [
        (Limit::TextureSide, "source", 1280, |limits, v| limits.max_texture_dimension_2d = v as u32),
        (Limit::TextureLayers, "shadow_maps", 7, |limits, v| limits.max_texture_array_layers = v as u32),
        (Limit::StorageBinding, "scene.vertices", 3200, |limits, v| limits.max_storage_buffer_binding_size = v),
        (Limit::UniformBinding, "light_view_0", 80, |limits, v| limits.max_uniform_buffer_binding_size = v),
        (Limit::Buffer, "sums", 5000, |limits, v| limits.max_buffer_size = v),
        (Limit::Workgroups, "source", 160, |limits, v| limits.max_compute_workgroups_per_dimension = v as u32),
        (Limit::SampledTextures, "source", 2, |limits, v| limits.max_sampled_textures_per_shader_stage = v as u32),
        (Limit::StorageTextures, "source", 1, |limits, v| limits.max_storage_textures_per_shader_stage = v as u32),
        (Limit::StorageBuffers, "source", 1, |limits, v| limits.max_storage_buffers_per_shader_stage = v as u32),
        (Limit::UniformBlocks, "shadow_0", 1, |limits, v| limits.max_uniform_buffers_per_shader_stage = v as u32),
        (Limit::ColorTargets, "shadow_0", 1, |limits, v| limits.max_color_attachments = v as u32),
        (Limit::Samplers, "source", 0, |limits, v| limits.max_samplers_per_shader_stage = v as u32),
    ];
    for (limit, of, needs, set) in cases {
        let allowed = device(|limits| set(limits, needs));
        let plan = plan(SIZE);
        assert_eq!(plan.check(&allowed, &size), Ok(()), "{limit:?}");
        let demand = plan.demands(&allowed, &size).into_iter().find(|demand| demand.limit == limit).expect("demanded");
        assert_eq!((demand.of.as_str(), demand.needs, demand.allows), (of, needs, Some(needs)), "{limit:?}");
        if needs > 0 {
            let BeyondLimits { demand, .. } =
                plan.check(&device(|limits| set(limits, needs - 1)), &size).expect_err("too large");
            assert_eq!((demand.limit, demand.of.as_str(), demand.allows), (limit, of, Some(needs - 1)));
        }
    }
}

#[test]
fn sentences_name_what_is_too_large_and_what_fits() {
    assert_eq!(
        refusal(&device(|limits| limits.max_texture_dimension_2d = 1024)),
        "the texture source needs 1280 texels along a side and this device allows 1024: use at most 1024x1024 texels"
    );
    assert_eq!(
        refusal(&device(|limits| limits.max_storage_buffer_binding_size = 3100)),
        "the buffer scene.vertices needs 3.2 kB in one storage binding and this device allows 3.1 kB: use at most 96 \
         vertices"
    );
    let refused = refusal(&device(|limits| limits.max_compute_workgroups_per_dimension = 100));
    assert!(refused.starts_with("the pass source needs 160 workgroups along an axis and this device allows 100: "));
}

#[test]
fn everything_together_is_compared_with_the_memory_where_it_is_known() {
    let holds = |memory| DeviceLimits { memory, ..DeviceLimits::browser() };
    // 16 bytes a pixel, seven maps of 64x64 texels, and the buffers.
    let total = 1280 * 720 * 16 + 7 * 64 * 64 * 4 + 400 + 5000 + 80 + 3200;
    assert_eq!(plan(SIZE).check(&holds(Some(total)), &size), Ok(()));
    let refused = refusal(&holds(Some(total - 1)));
    let parts = ["the frame, most of it source, needs 14868968 bytes in total", "allows 14868967: use a smaller image"];
    assert!(parts.iter().all(|part| refused.contains(part)), "{refused}");
    // Without a known memory the total is told and not judged.
    let demands = plan(SIZE).demands(&holds(None), &size);
    assert_eq!(
        demands.last().map(|demand| (demand.limit, demand.needs, demand.allows)),
        Some((Limit::Memory, total, None))
    );
}

#[test]
fn a_texture_of_the_caller_is_compared_by_its_layers() {
    // Words in layers of 2^20.
    let words = |layers| ExternalSize {
        bytes: u64::from(layers) << 22,
        element: 4,
        elements: "texels",
        texture: Some(([4096, 256], layers)),
    };
    // Far more than a storage binding allows.
    assert_eq!(check_external(&DeviceLimits::browser(), "scene.texels", words(256)), Ok(()));
    let refused = check_external(&DeviceLimits::browser(), "scene.texels", words(257)).expect_err("too many layers");
    assert_eq!(
        refused.to_string(),
        "the texture scene.texels needs 257 layers and this device allows 256: use at most 268.43 million texels"
    );
}

#[test]
fn amounts_that_look_equal_are_told_exactly() {
    let vertices = ExternalSize { bytes: 134_217_760, element: 32, elements: "vertices", texture: None };
    let refused =
        check_external(&DeviceLimits::browser(), "scene.vertices", vertices).expect_err("too large").to_string();
    assert!(
        refused.contains("needs 134217760 bytes in one storage binding and this device allows 134217728"),
        "{refused}"
    );
}

#[test]
fn huge_numbers_saturate() {
    let huge = plan([u32::MAX; 2]);
    assert!(huge.check(&DeviceLimits::browser(), &size).is_err());
    let total = huge.demands(&DeviceLimits::browser(), &size).pop().expect("it has a total");
    assert_eq!((total.limit, total.needs), (Limit::Memory, u64::MAX));
}
