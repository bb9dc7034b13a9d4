//! Shadow maps of the lights, which direct light and techniques read.

use halflight_frame_graph::{FramePlan, Gpu, Part, ResourceId};
use halflight_shared_shaders::shadow::shadow_map::{self, ShadowMap};
use wgpu::TextureFormat as Format;

use crate::{
    gi::Storage,
    parameters,
    parameters::{Settings, SettingsError},
    scene::{SceneFacts, ShadowAtlas, ShadowLayer, far_shadow_view, shadow_entries, shadow_view, triangles},
};

parameters! {
    /// Parameters of direct light.
    pub struct DirectLight("direct") {
        /// Width and height of each shadow map; less if the maps of many lights would take more than 1 GiB.
        shadow_map_size: u32 = 4096, in 64..=8192, unit "px", grid [1024, 2048, 4096], role Plan;
        /// Storage of direct light. float16 has half the bytes and clamps at 65,504. Images and measurements of the
        /// evaluator have float32, unless this is set.
        storage: Storage = Storage::Float16, unit "", grid [Storage::Float16, Storage::Float32], role Plan;
    }
}

pub(crate) fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Shadow maps of all lights, and their layers: the bindings of `common/shadow_maps.wgsl`.
#[derive(Clone, Copy, Debug)]
pub struct ShadowMaps {
    /// Depths, a texture with one or more maps in each layer.
    pub maps: ResourceId,
    /// `array<ShadowLayer>`.
    pub layers: ResourceId,
}

/// Smallest number of steps of 16-bit depth along the width of a texel. A receiver is offset by 0.7 texels
/// (`OFFSET` in common/shadow_maps.wgsl), so rounding by half a step is a tenth of that at most.
const STEPS_OF_TEXEL: f32 = 8.0;

/// Format of the maps: 16 bits of depth if these are fine enough for every map and stay so, otherwise float32. The depth
/// of lights at a position is not linear.
fn format(facts: &SceneFacts, map_size: u32) -> Format {
    let steps = f32::from(u16::MAX);
    let is_fine = |layer: &ShadowLayer| {
        let (texel, step) = (layer.width / map_size as f32, layer.depth.map(|depth| depth / steps));
        step.is_some_and(|step| step * STEPS_OF_TEXEL <= texel)
    };
    let mut layers = facts.shadow_layers.iter().chain(&facts.far_shadow_layers);
    let narrow = !facts.needs.moving_lights && layers.all(is_fine);
    if narrow { Format::Depth16Unorm } else { Gpu::DEPTH_FORMAT }
}

/// The name of the texture.
const MAPS: &str = "shadow_maps";

/// The shadow maps that the plan has already, or new ones; `None` for a scene without lights.
///
/// # Errors
/// A setting that its declaration does not allow, or more lights than a device has layers for.
pub fn plan_shadow_maps(
    plan: &mut FramePlan,
    facts: &SceneFacts,
    settings: &Settings,
) -> Result<Option<ShadowMaps>, SettingsError> {
    let map_size = DirectLight::from_settings(settings)?.shadow_map_size;
    let (layers, far) = (&facts.shadow_layers, &facts.far_shadow_layers);
    if layers.is_empty() {
        return Ok(None);
    }
    if let Some(maps) = plan.resources.iter().position(|resource| resource.name == MAPS) {
        let layers = shadow_entries(plan, layers, far, map_size);
        return Ok(Some(ShadowMaps { maps: ResourceId(maps), layers }));
    }
    let count = layers.len() + far.len();
    let lights = facts.needs.lights;
    let atlas = ShadowAtlas::of_lights(count as u32, map_size, lights)?;
    plan.notes.extend(atlas.note(map_size));
    let reason = counted(count, "shadow map");
    let format = format(facts, atlas.map_size);
    let maps = plan.texture_array(MAPS, [atlas.layer_size(); 2], atlas.layers(), format, reason);
    let entries = shadow_entries(plan, layers, far, map_size);
    let draw = |plan: &mut FramePlan, layer: usize, name: String, view: ResourceId, reason: &str| {
        let vertices = plan.scene_buffer("scene.vertices", "the scene's geometry");
        let alpha_tested = facts.needs.alpha_tested.then(|| {
            let [materials, texels] =
                ["scene.materials", "scene.texels"].map(|name| plan.scene_buffer(name, "alpha-masked surfaces"));
            shadow_map::AlphaTested { materials, texels }
        });
        let animated = facts.animated().then(|| plan.changing_scene_buffer("scene.objects", "objects are animated"));
        let run = ShadowMap { shadow_view: view, vertices, alpha_tested, animated, triangles: None };
        let opaque = shadow_map::Features { alpha_tested: false, ..run.features() }.shader();
        let drawn = triangles::by_alpha(facts.needs.alpha_tested, opaque);
        let pass = plan.pass(Part::Direct, name, run).because(reason);
        match atlas.place(layer as u32) {
            (layer, None) => pass.draw(drawn, Vec::new(), (maps, layer)),
            (layer, Some(tile)) => pass.draw_tile(drawn, (maps, layer), tile),
        }
    };
    for (index, layer) in layers.iter().enumerate() {
        let view = shadow_view(plan, index, layer);
        draw(plan, index, format!("shadow_{index}"), view, "a light casts shadows");
    }
    for (index, layer) in far.iter().enumerate() {
        let view = far_shadow_view(plan, index, layer);
        let reason = format!(
            "shadows far from what is looked at, in a coarser map{}",
            if facts.extent.is_covered() { "" } else { "; surfaces even farther out are lit" },
        );
        draw(plan, layers.len() + index, format!("far_shadow_{index}"), view, &reason);
    }
    Ok(Some(ShadowMaps { maps, layers: entries }))
}
