//! Diffuse light by the paper's patterns: a small hemisphere on the screen, and the shell around it in each reflective
//! shadow map.

use wgpu::TextureFormat as Format;

use super::{Hybrid, Weighting};
use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_renderer::gi::Sources;
use halflight_renderer::{
    gi::{Inputs, resolution::Level, rsm::ReflectiveShadowMap, scene_voxels::SceneVoxels},
    scene::{ShadowLayer, shadow_view},
};
use halflight_shared_shaders::hybrid::{
    pattern_far::{self, PatternFar},
    pattern_near::{self, PatternNear},
};

/// Default ratio of the shell's radius to the small hemisphere's: radii 3 and 30 in the paper.
pub(super) const SHELL: f32 = 10.0;

/// Sums of light so far. Passes alternate between two textures, because no pass may read the texture that it writes.
pub(super) struct Patterns<'a> {
    parameters: &'a Hybrid,
    level: &'a Level,
    radius: f32,
    weight: f32,
    sums: Vec<ResourceId>,
    passes: usize,
}

impl<'a> Patterns<'a> {
    /// Plans the screen's part, if requested. `radius` is that of the small hemisphere, scene units.
    pub(super) fn new(
        plan: &mut FramePlan,
        inputs: &Inputs,
        parameters: &'a Hybrid,
        level: &'a Level,
        radius: f32,
    ) -> Self {
        let near = parameters.sources != Sources::Lights;
        let far = parameters.sources != Sources::Screen;
        let views = if far { inputs.shadow_layers().len() } else { 0 };
        // Equations 2 and 5: the mean over the samples of all patterns. The faces around a point light share one
        // pattern.
        let lights = inputs.shadow_layers().last().map_or(0, |view| view.light + 1);
        let samples = u32::from(near) * parameters.screen_samples + u32::from(far) * lights * parameters.light_samples;
        let weight = parameters.intensity / samples.max(1) as f32;
        let textures = (usize::from(near) + views).min(2);
        let sums = (0..textures)
            .map(|i| plan.texture(format!("sum_{i}"), level.size, Format::Rgba32Float, "light of the patterns so far"))
            .collect();
        let mut patterns = Self { parameters, level, radius, weight, sums, passes: 0 };
        if near {
            let run = PatternNear {
                surfels: level.surfels,
                gathered: patterns.sums[0],
                published: patterns.published(),
                params: pattern_near::Params {
                    scale: level.scale as f32,
                    radius,
                    samples: parameters.screen_samples,
                    weight,
                },
            };
            plan.pass(Part::Technique, "near", run)
                .because("points of a small hemisphere, projected to the screen")
                .costs(parameters.screen_samples.into())
                .over(level.size);
            patterns.passes = 1;
        }
        patterns
    }

    fn published(&self) -> bool {
        self.parameters.weighting == Weighting::Published
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
        let Self { parameters, level, radius, weight, ref sums, passes } = *self;
        let outer = if parameters.far_radius > 0.0 { parameters.far_radius } else { SHELL * radius };
        let inner = if parameters.sources == Sources::Lights { 0.0 } else { radius.min(outer) };
        let rays = u64::from(parameters.light_samples.div_ceil(parameters.samples_per_ray));
        let of_ray = voxels.map_or(0, |voxels| voxels.ray_cost(plan));
        let run = PatternFar {
            shadow_view: shadow_view(plan, index, view),
            surfels: level.surfels,
            rsm_position: maps.position,
            light: maps.light,
            gathered: sums[passes % 2],
            further: (passes > 0).then(|| sums[(passes + 1) % 2]),
            published: self.published(),
            visibility: voxels.map(|SceneVoxels { grid, voxels }| pattern_far::Visibility { grid, voxels }),
            params: pattern_far::Params {
                scale: level.scale as f32,
                inner,
                outer,
                samples: parameters.light_samples,
                weight,
            },
            constants: pattern_far::Constants { samples_per_ray: parameters.samples_per_ray },
        };
        plan.pass(Part::Technique, format!("rsm_{index}"), run)
            .because("points of the shell around the small hemisphere, projected into a reflective shadow map")
            .costs(u64::from(parameters.light_samples) + rays * of_ray)
            .over(level.size);
        self.passes += 1;
    }

    /// The sum of all patterns.
    pub(super) fn sum(&self) -> Option<ResourceId> {
        self.sums.get((self.passes + 1) % 2).or(self.sums.first()).copied()
    }
}
