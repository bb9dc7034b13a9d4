//! One gather per level, and the filter that combines the levels: the same for every bounce and for glossy light.

use wgpu::TextureFormat as Format;

use super::{
    DiscArea, FormFactor, Hierarchical, VisibilityBounces, covering_radius, ring_radii, upsampling,
    visibility::{Froxels, LevelFroxels},
};
use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_renderer::gi::resolution::{Level, upsample_cost};
use halflight_shared_shaders::hierarchical::gather;

/// Shared inputs of the gathers of all bounces.
pub(super) struct Gather<'a> {
    pub(super) parameters: &'a Hierarchical,
    pub(super) levels: &'a [Level],
    /// The only level that gathers, if one is requested.
    pub(super) only: Option<u32>,
    pub(super) froxels: Option<&'a Froxels>,
    /// Materials of the pixels, for glossy light.
    pub(super) material: Option<ResourceId>,
    /// Near-field distance, scene units: beyond it, the first bounce comes from reflective shadow maps.
    pub(super) near_field_distance: Option<f32>,
}

/// Result of a gather.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Light {
    /// Diffuse light of this bounce, from 1.
    Bounce(u32),
    /// Glossy reflection of the first bounce's light.
    Glossy,
}

impl Light {
    /// Passes of the first bounce have no suffix.
    pub(super) fn pass_name(self, name: &str) -> String {
        match self {
            Self::Bounce(1) => name.into(),
            Self::Bounce(bounce) => format!("{name}_bounce_{bounce}"),
            Self::Glossy => format!("{name}_glossy"),
        }
    }

    /// Random-number stream: one for each level of each bounce, then those of glossy light.
    fn stream(self, k: usize) -> u32 {
        let turn = if let Self::Bounce(bounce) = self { bounce - 1 } else { MAX_BOUNCES };
        turn * MAX_LEVELS + k as u32
    }
}

/// Upper bounds of levels and bounces.
const MAX_LEVELS: u32 = 8;
const MAX_BOUNCES: u32 = 8;

/// Work of a ray through view-space voxels: it crosses about as many columns of its level.
const FROXEL_RAY: u64 = 32;

impl Gather<'_> {
    /// Gathers from these surfels, one texture per level, and combines the levels: light at the resolution of level 0.
    ///
    /// Bounces alternate between textures. Two successive bounces must not share the one of level 0, because the second
    /// one starts from the light of the first.
    pub(super) fn light(&self, plan: &mut FramePlan, light: Light, surfels: &[ResourceId]) -> Option<ResourceId> {
        let Self { parameters, levels, only, .. } = *self;
        let texture = |plan: &mut FramePlan, name: &str, k: usize, reason: &str| {
            let turn = match light {
                Light::Bounce(bounce) if k == 0 && bounce.is_multiple_of(2) => "_of_even_bounces",
                Light::Glossy if k == 0 => "_of_glossy",
                _ => "",
            };
            plan.texture_again(format!("{name}_{k}{turn}"), levels[k].size, Format::Rgba32Float, reason)
        };
        let mut gathered = Vec::new();
        for (k, &sources) in surfels.iter().enumerate() {
            let wanted = only.is_none_or(|only| only == k as u32);
            gathered.push(wanted.then(|| {
                let gathered = texture(plan, "gathered", k, "light from the ring of this level");
                self.level(plan, light, k, sources, gathered);
                gathered
            }));
        }
        // Coarsest first.
        let mut indirect = None;
        for (k, level) in levels.iter().enumerate().rev() {
            let own = gathered[k];
            indirect = match (indirect, own) {
                (None, own) => own.map(|own| (k, own)),
                (Some((coarse, coarse_light)), own) => {
                    let combined = texture(plan, "combined", k, "light of this level and all coarser ones");
                    let name = light.pass_name(&format!("combine_{k}"));
                    let run = upsampling(parameters).combine(&levels[coarse], coarse_light, level, own, combined);
                    plan.pass(Part::Technique, name, run)
                        .because(format!("adds the light of level {coarse} to level {k}"))
                        .costs(upsample_cost(levels[coarse].scale / level.scale))
                        .over(levels[coarse].size);
                    Some((k, combined))
                }
            };
        }
        match indirect {
            Some((0, light)) => Some(light),
            _ => None,
        }
    }

    /// Plans the gather of one level.
    fn level(&self, plan: &mut FramePlan, light: Light, k: usize, surfels: ResourceId, gathered: ResourceId) {
        let Self { parameters, levels, .. } = *self;
        let level = &levels[k];
        let radius = if parameters.radius > 0.0 {
            parameters.radius
        } else {
            covering_radius(parameters.ring, parameters.levels, levels[0].size)
        };
        let [inner, outer] = ring_radii(parameters.ring, radius, k as u32);
        // Texels that one sample stands for: its share of the ring.
        let texels = std::f32::consts::PI * (outer * outer - inner * inner) / parameters.samples as f32;
        let texel_area = (level.scale * level.scale) as f32;
        let (disc_area, discs) = match parameters.disc_area {
            DiscArea::Sample => (texels * texel_area, 1.0),
            DiscArea::Texel => (texel_area, texels),
        };
        let tested = !matches!(light, Light::Bounce(2..)) || parameters.visibility_bounces == VisibilityBounces::All;
        let froxels = self.froxels.filter(|_| tested).map(|froxels| froxels.level(k));
        let near_field_distance = self.near_field_distance.filter(|_| light == Light::Bounce(1));
        let rays = if froxels.is_some() { parameters.samples.div_ceil(parameters.samples_per_ray) } else { 0 };
        let cost = u64::from(parameters.samples) + u64::from(rays) * FROXEL_RAY;
        let run = gather::Gather {
            surfels,
            visibility: froxels
                .map(|LevelFroxels { froxels, depth_range }| gather::Visibility { froxels, depth_range }),
            near: near_field_distance.is_some(),
            glossy: self.material.map(|material| gather::Glossy {
                material,
                materials: plan.scene_buffer("scene.materials", "glossy materials"),
            }),
            gathered,
            params: gather::Params {
                scale: level.scale as f32,
                inner_square: inner * inner,
                outer_square: outer * outer,
                disc_area,
                discs,
                level: light.stream(k),
                near_field_distance,
            },
            constants: gather::Constants {
                samples: parameters.samples,
                point_to_disc: parameters.form_factor == FormFactor::PointToDisc,
                samples_per_ray: parameters.samples_per_ray,
                importance: parameters.glossy_importance as u32,
                over_frames: parameters.temporal_a > 0.0,
            },
        };
        plan.pass(Part::Technique, light.pass_name(&format!("gather_{k}")), run)
            .because(format!("ring of {inner:.1} to {outer:.1} texels of {0}x{0} pixels", level.scale))
            .costs(cost)
            .over(level.size);
    }
}
