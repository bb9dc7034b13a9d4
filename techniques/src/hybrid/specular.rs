//! Specular reflections of glossy surfaces, from the screen and, where it has no hit, from reflective shadow maps.

use glam::Vec3;
use wgpu::TextureFormat as Format;

use super::{Hybrid, Views};
use halflight_frame_graph::{FramePlan, Part, ResourceId, ResourceKind};
use halflight_renderer::{
    gi::{Inputs, Switch, rsm::ReflectiveShadowMap, scene_voxels::SceneVoxels},
    scene::{ShadowLayer, shadow_view},
};
use halflight_shared_shaders::hybrid::{
    mirror::{self, Mirror},
    specular,
};

/// Reflected light so far. Passes alternate between two textures, because no pass may read the texture that it writes.
pub(super) struct Specular<'a> {
    inputs: &'a Inputs<'a>,
    material: ResourceId,
    materials: ResourceId,
    mirror_map: ResourceId,
    constants: specular::Constants,
    stride: f32,
    reach: f32,
    shown: Vec<ResourceId>,
    passes: usize,
}

/// Steps of a reflection ray across an image, texels wide: half of it on average.
fn steps(width: u32, stride: f32) -> u64 {
    (0.5 * width as f32 / stride).ceil() as u64
}

/// Width of a reflective shadow map, texels.
fn map_width(plan: &FramePlan, map: &ReflectiveShadowMap) -> u32 {
    match plan.resources[map.position.0].kind {
        ResourceKind::Texture { size, .. } => size[0],
        _ => 1,
    }
}

impl<'a> Specular<'a> {
    /// Plans the ray march on the screen, once for all lights; nothing if no material is glossy or the setting is off.
    pub(super) fn new(plan: &mut FramePlan, inputs: &'a Inputs<'a>, parameters: &Hybrid) -> Option<Self> {
        let material = inputs.material.filter(|_| parameters.specular != Views::Off)?;
        let scene = inputs.scene.filter(|scene| scene.needs.glossy)?;
        let materials = plan.scene_buffer("scene.materials", "glossy materials");
        let size = plan.display_size;
        let mirror_map = plan.texture("mirror_map", size, Format::R32Uint, "pixels that reflection rays hit");
        let (lobe, over_frames) = (parameters.specular_lobe == Switch::On, parameters.over_frames());
        let run = Mirror {
            depth: inputs.depth,
            normal: inputs.normal,
            material,
            materials,
            mirror_map,
            params: mirror::Params { stride: parameters.specular_stride },
            constants: mirror::Constants { lobe, over_frames },
        };
        plan.pass(Part::Technique, "mirror_map", run)
            .because("reflection rays against the screen, once for all lights")
            .costs(steps(size[0].max(size[1]), parameters.specular_stride))
            .over(size);
        let views = if parameters.specular == Views::Both { inputs.shadow_layers().len() } else { 0 };
        let shown = (0..views.clamp(1, 2))
            .map(|i| plan.texture(format!("specular_{i}"), size, Format::Rgba32Float, "reflected light"))
            .collect();
        let [low, high] = scene.bounds.map(Vec3::from);
        let reach = (high - low).length().max(f32::MIN_POSITIVE * 1e10);
        let specular = Self {
            inputs,
            material,
            materials,
            mirror_map,
            constants: specular::Constants { lobe, over_frames },
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

    /// Plans the part of one map. `voxels` holds the occluders.
    pub(super) fn add(
        &mut self,
        plan: &mut FramePlan,
        maps: &ReflectiveShadowMap,
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
        light: Option<(&ReflectiveShadowMap, usize, &ShadowLayer)>,
        voxels: Option<SceneVoxels>,
    ) {
        let (name, reason) = match light {
            Some((_, index, _)) => {
                (format!("specular_{index}"), "where the screen has no hit, a reflective shadow map")
            }
            None => ("specular".into(), "light of the hit pixels"),
        };
        let size = plan.display_size;
        let further = (self.passes > 0).then(|| self.shown[(self.passes + 1) % 2]);
        let run = specular::Specular {
            depth: self.inputs.depth,
            normal: self.inputs.normal,
            material: self.material,
            materials: self.materials,
            mirror_map: self.mirror_map,
            specular: self.shown[self.passes % 2],
            lights: light.map(|(maps, index, view)| specular::Lights {
                shadow_view: shadow_view(plan, index, view),
                rsm_position: maps.position,
                light: maps.light,
            }),
            further,
            visibility: voxels.is_some(),
            direct: further.is_none().then_some(self.inputs.direct),
            grid: voxels.map(|voxels| voxels.grid),
            voxels: voxels.map(|voxels| voxels.voxels),
            params: specular::Params { stride: light.map(|_| self.stride), reach: light.map(|_| self.reach) },
            constants: self.constants,
        };
        let cost = light
            .map_or(1, |(maps, ..)| steps(map_width(plan, maps), self.stride) + voxels.map_or(0, |v| v.ray_cost(plan)));
        plan.pass(Part::Technique, name, run).because(reason).costs(cost).over(size);
    }

    /// The light of all views, and each pixel's material.
    pub(super) fn light(&self) -> (ResourceId, ResourceId) {
        let last = self.passes.saturating_sub(1) % 2;
        (self.shown[last], self.material)
    }
}
