//! Shadow views of the lights as buffers of a plan. They follow animated lights.

use bytemuck::{Pod, Zeroable};
use glam::Mat4;
use halflight_frame_graph::{FramePlan, Handle, ResourceId};

use super::{ShadowAtlas, ShadowLayer};

/// Kinds of handles: one shadow map layer, by its index.
const SHADOW_VIEW: &str = "light_view";
/// One far shadow map layer, by its index.
const FAR_SHADOW_VIEW: &str = "far_view";
/// One light, by its index.
const LIGHT: &str = "light";
/// World to clip space of all layers.
const LIGHT_PROJECTIONS: &str = "light_projections";
/// All layers, by the width that the setting asks for, texels.
const SHADOW_LAYERS: &str = "shadow_layers";

/// Twin of `ShadowView` in common/shadow_view.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct ShadowView {
    world_to_clip: Mat4,
    width: f32,
    light: u32,
    index: u32,
    unused: u32,
}

/// Twin of `ShadowLayer` in common/shadow_maps.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct ShadowEntry {
    world_to_clip: Mat4,
    texel_width: f32,
    coarser: u32,
    map: u32,
    corner: u32,
}

/// There is no coarser layer.
const NO_LAYER: u32 = u32::MAX;

/// The uniform block `shadow_view` of layer `index`. `layer` is its state in the first frame.
pub fn shadow_view(plan: &mut FramePlan, index: usize, layer: &ShadowLayer) -> ResourceId {
    let handle = Handle { kind: SHADOW_VIEW, index: index as u32 };
    plan.changing_data(handle, format!("light_view_{index}"), || view_bytes(index, layer), "view of a shadow map layer")
}

/// As [`shadow_view`], of a layer of [`SceneFacts::far_shadow_layers`](super::SceneFacts::far_shadow_layers).
pub fn far_shadow_view(plan: &mut FramePlan, index: usize, layer: &ShadowLayer) -> ResourceId {
    let handle = Handle { kind: FAR_SHADOW_VIEW, index: index as u32 };
    plan.changing_data(
        handle,
        format!("far_view_{index}"),
        || view_bytes(index, layer),
        "view of a far shadow map layer",
    )
}

/// The light of a layer, as a uniform block `Light`. A pass that reads one light depends on no other.
pub fn light_of(plan: &mut FramePlan, layer: &ShadowLayer) -> ResourceId {
    let handle = Handle { kind: LIGHT, index: layer.light };
    let name = format!("light_{}", layer.light);
    plan.changing_data(handle, name, || bytemuck::bytes_of(&layer.source).to_vec(), "one of the scene's lights")
}

/// World to clip space of each layer, as `array<mat4x4f>`.
pub fn light_projections(plan: &mut FramePlan, layers: &[ShadowLayer]) -> ResourceId {
    let handle = Handle { kind: LIGHT_PROJECTIONS, index: 0 };
    plan.changing_data(
        handle,
        LIGHT_PROJECTIONS,
        || projection_bytes(layers),
        "projections of the reflective shadow maps",
    )
}

/// The layers of shadow maps in a [`ShadowAtlas`] of maps that are at most `wanted` texels wide, and after them the `far`
/// ones.
pub fn shadow_entries(plan: &mut FramePlan, layers: &[ShadowLayer], far: &[ShadowLayer], wanted: u32) -> ResourceId {
    let handle = Handle { kind: SHADOW_LAYERS, index: wanted };
    plan.changing_data(handle, SHADOW_LAYERS, || entry_bytes(layers, far, wanted), "views of the shadow map layers")
}

/// New contents of a handle after the lights changed to these layers and `far` ones.
///
/// # Panics
/// If the handle is of another kind: other dependencies need another source of contents.
pub(super) fn contents(handle: Handle, layers: &[ShadowLayer], far: &[ShadowLayer]) -> Vec<u8> {
    match handle {
        Handle { kind: SHADOW_VIEW, index } => view_bytes(index as usize, &layers[index as usize]),
        Handle { kind: FAR_SHADOW_VIEW, index } => view_bytes(index as usize, &far[index as usize]),
        Handle { kind: LIGHT, index } => {
            let own = layers.iter().find(|layer| layer.light == index);
            own.map(|layer| bytemuck::bytes_of(&layer.source).to_vec()).unwrap_or_default()
        }
        Handle { kind: LIGHT_PROJECTIONS, .. } => projection_bytes(layers),
        Handle { kind: SHADOW_LAYERS, index: wanted } => entry_bytes(layers, far, wanted),
        Handle { kind, index } => panic!("the scene has no contents for {kind} {index}"),
    }
}

fn view_bytes(index: usize, layer: &ShadowLayer) -> Vec<u8> {
    let &ShadowLayer { world_to_clip, width, light, .. } = layer;
    bytemuck::bytes_of(&ShadowView { world_to_clip, width, light, index: index as u32, unused: 0 }).to_vec()
}

fn projection_bytes(layers: &[ShadowLayer]) -> Vec<u8> {
    layers.iter().flat_map(|layer| bytemuck::bytes_of(&layer.world_to_clip).to_vec()).collect()
}

fn entry_bytes(layers: &[ShadowLayer], far: &[ShadowLayer], wanted: u32) -> Vec<u8> {
    let maps = (layers.len() + far.len()) as u32;
    // A plan has an atlas only if the maps fit.
    let atlas = ShadowAtlas::new(maps, wanted).unwrap_or(ShadowAtlas { maps, map_size: wanted, per_side: 1 });
    // The next coarser layer of a light that has far layers.
    let coarser = |index: usize, light: u32| {
        // A far layer is followed by the next one of its light.
        let first_far = (index + 1).saturating_sub(layers.len());
        let found = far.iter().enumerate().skip(first_far).find(|(_, layer)| layer.light == light);
        found.map_or(NO_LAYER, |(next, _)| (layers.len() + next) as u32)
    };
    let entry = |(index, layer): (usize, &ShadowLayer)| {
        let (map_layer, tile) = atlas.place(index as u32);
        let [x, y] = tile.map_or([0; 2], |tile| tile.corner);
        ShadowEntry {
            world_to_clip: layer.world_to_clip,
            texel_width: layer.width / atlas.map_size as f32,
            coarser: coarser(index, layer.light),
            map: map_layer | atlas.map_size << 16,
            corner: x | y << 16,
        }
    };
    bytemuck::cast_slice(&layers.iter().chain(far).enumerate().map(entry).collect::<Vec<_>>()).to_vec()
}
