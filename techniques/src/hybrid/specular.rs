//! What glossy surfaces show in their mirror direction, from the screen and, where it shows nothing there, from the lights'
//! views.

use glam::Vec3;
use wgpu::TextureFormat as Format;

use super::{Hybrid, Views, constants};
use halflight_frame_graph::{FramePlan, Part, ResourceId, variant};
use halflight_renderer::{
    gi::{Inputs, rsm::LightMaps, scene_voxels::SceneVoxels},
    scene::ShadowLayer,
};

/// Light in the mirror direction so far. Passes alternate between two textures, because none may read what it writes.
pub(super) struct Specular<'a> {
    inputs: &'a Inputs<'a>,
    material: ResourceId,
    materials: ResourceId,
    mirror_map: ResourceId,
    constants: Vec<(&'static str, f64)>,
    stride: f32,
    reach: f32,
    shown: Vec<ResourceId>,
    passes: usize,
}

impl<'a> Specular<'a> {
    /// Plans the march on the screen, once for all lights; nothing where no material is glossy or the setting is off.
    pub(super) fn new(plan: &mut FramePlan, inputs: &'a Inputs<'a>, parameters: &Hybrid) -> Option<Self> {
        let material = inputs.material.filter(|_| parameters.specular != Views::Off)?;
        let scene = inputs.scene.filter(|scene| scene.needs.glossy)?;
        let materials = plan.scene_buffer("scene.materials", "glossy materials");
        let size = plan.display_size;
        let mirror_map = plan.texture("mirror_map", size, Format::R32Uint, "pixels that mirror directions meet");
        plan.pass(Part::Technique, "mirror_map", "hybrid/mirror")
            .constants(&constants(parameters))
            .param("stride", parameters.specular_stride)
            .bind("depth", inputs.depth)
            .bind("normal", inputs.normal)
            .bind("material", material)
            .bind("materials", materials)
            .bind("mirror_map", mirror_map)
            .because("where mirror directions meet what the camera sees, once for all lights")
            .over(size);
        let views = if parameters.specular == Views::Both { inputs.shadow_layers().len() } else { 0 };
        let shown = (0..views.clamp(1, 2))
            .map(|i| plan.texture(format!("specular_{i}"), size, Format::Rgba32Float, "light in the mirror direction"))
            .collect();
        let [low, high] = scene.bounds.map(Vec3::from);
        let reach = (high - low).length().max(f32::MIN_POSITIVE * 1e10);
        let specular = Self {
            inputs,
            material,
            materials,
            mirror_map,
            constants: constants(parameters),
            stride: parameters.specular_stride,
            reach,
            shown,
            passes: 0,
        };
        if views == 0 {
            specular.show(plan, None, None);
        }
        Some(specular)
    }

    /// Plans the part of one light's view. Through `voxels`, what stands in between hides.
    pub(super) fn add(
        &mut self,
        plan: &mut FramePlan,
        maps: &LightMaps,
        index: usize,
        view: &ShadowLayer,
        voxels: Option<SceneVoxels>,
    ) {
        self.show(plan, Some((maps, index, view)), voxels);
        self.passes += 1;
    }

    fn show(
        &self,
        plan: &mut FramePlan,
        light: Option<(&LightMaps, usize, &ShadowLayer)>,
        voxels: Option<SceneVoxels>,
    ) {
        let further = self.passes > 0;
        let shader = variant(
            "hybrid/specular",
            &[("lights", light.is_some()), ("further", further), ("visibility", voxels.is_some())],
        );
        let (name, reason) = match light {
            Some((_, index, _)) => {
                (format!("specular_{index}"), "where the screen shows nothing, what a light sees there")
            }
            None => ("specular".into(), "light of the pixels that mirror directions meet"),
        };
        let size = plan.display_size;
        let mut pass = plan
            .pass(Part::Technique, name, shader)
            .constants(&self.constants)
            .bind("depth", self.inputs.depth)
            .bind("normal", self.inputs.normal)
            .bind("material", self.material)
            .bind("materials", self.materials)
            .bind("mirror_map", self.mirror_map)
            .bind("specular", self.shown[self.passes % 2])
            .because(reason);
        pass = match further {
            true => pass.bind("partial_sum", self.shown[(self.passes + 1) % 2]),
            false => pass.bind("direct", self.inputs.direct),
        };
        if let Some((maps, _, view)) = light {
            pass = pass
                .param("world_to_clip", view.world_to_clip)
                .param("stride", self.stride)
                .param("reach", self.reach)
                .bind("place", maps.place)
                .bind("light", maps.light);
        }
        if let Some(voxels) = voxels {
            pass = pass.bind("grid", voxels.grid).bind("cubes", voxels.cubes);
        }
        pass.over(size);
    }

    /// Where the light of all views is, and each pixel's material.
    pub(super) fn light(&self) -> (ResourceId, ResourceId) {
        let last = self.passes.saturating_sub(1) % 2;
        (self.shown[last], self.material)
    }
}
