//! Light that passes through translucent surfaces, from the reflective shadow maps (Lambru et al.). It is the output
//! `transmitted`.

use wgpu::TextureFormat as Format;

use crate::{
    gi::{Inputs, rsm::ReflectiveShadowMap},
    scene::{ShadowLayer, light_of, shadow_view},
};
use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_shared_shaders::translucency;

/// The sum over all maps, while it is planned.
pub struct Translucency<'a> {
    inputs: &'a Inputs<'a>,
    /// Index of each pixel's material; `None` if no material is translucent or the light is not wanted.
    material: Option<ResourceId>,
    sum: Option<ResourceId>,
}

impl<'a> Translucency<'a> {
    /// An empty sum. It stays empty if no material is translucent or `wanted` is false.
    pub fn new(inputs: &'a Inputs<'a>, wanted: bool) -> Self {
        let translucent = wanted && inputs.scene.is_some_and(|scene| scene.needs.translucent);
        Self { inputs, material: inputs.material.filter(|_| translucent), sum: None }
    }

    /// Adds the light that passes through from the light of this map.
    pub fn add(&mut self, plan: &mut FramePlan, maps: &ReflectiveShadowMap, index: usize, view: &ShadowLayer) {
        let Some(material) = self.material else { return };
        let size = plan.display_size;
        // No pass may read the texture that it writes.
        let name = format!("transmitted_{}", index % 2);
        let sum = plan.texture_again(name, size, Format::Rgba32Float, "light that passes through translucent surfaces");
        let materials = plan.scene_buffer("scene.materials", "the scene's materials");
        let run = translucency::Translucency {
            shadow_view: shadow_view(plan, index, view),
            depth: self.inputs.depth,
            normal: self.inputs.normal,
            material,
            materials,
            source: light_of(plan, view),
            rsm_position: maps.position,
            transmitted: sum,
            further: self.sum,
        };
        plan.pass(Part::Technique, format!("translucency_{index}"), run)
            .because("some materials are translucent")
            .over(size);
        self.sum = Some(sum);
    }

    /// Adds the sum to the plan's outputs.
    pub fn finish(self, plan: &mut FramePlan) {
        plan.outputs.extend(self.sum.map(|sum| ("transmitted", sum)));
    }
}
