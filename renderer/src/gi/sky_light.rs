//! Light of the sky, bounded by the scene's voxel grid: what is off the screen closes a room, too.

use wgpu::TextureFormat as Format;

use crate::gi::{
    Inputs,
    denoise::denoised,
    resolution::Level,
    scene_voxels::{SceneVoxels, plan_scene_voxels, planned_scene_voxels},
};
use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_shared_shaders::{
    hierarchical::sum::Sum,
    sky::gather::{Constants, Gather, Params},
};

/// Voxels along the longest side of the scene, for rays to the sky. In a room of 10 m a voxel is 4 cm wide, small enough
/// for a window. A ray costs one step a voxel.
const VOXELS: u32 = 256;
/// Passes of the spatial filter after the gather.
const DENOISE: u32 = 2;

/// The sky of a scene and what hides it.
#[derive(Clone, Copy)]
pub struct Sky {
    /// `scene.environment` in the layout of `common/environment.wgsl`.
    pub environment: ResourceId,
    /// Occluders.
    pub voxels: SceneVoxels,
}

/// The sky, with the grid that the plan has already or a new one; `None` if the scene has no environment.
pub fn plan_sky(plan: &mut FramePlan, inputs: &Inputs) -> Option<Sky> {
    let scene = inputs.scene.filter(|scene| scene.needs.environment)?;
    let environment = plan.scene_buffer("scene.environment", "environment light");
    let voxels = planned_scene_voxels(plan).unwrap_or_else(|| plan_scene_voxels(plan, scene, VOXELS));
    Some(Sky { environment, voxels })
}

/// A gather of sky light.
pub struct SkyGather {
    /// Rays of a texel; 0 for no sky light.
    pub rays: u32,
    /// Whether a temporal filter averages successive frames.
    pub over_frames: bool,
}

impl SkyGather {
    /// Plans the gather at the resolution of `level`. `None` if the scene has no environment or there are no rays.
    pub fn plan(&self, plan: &mut FramePlan, inputs: &Inputs, level: &Level) -> Option<ResourceId> {
        if self.rays == 0 {
            return None;
        }
        let Sky { environment, voxels } = plan_sky(plan, inputs)?;
        let of_ray = voxels.ray_cost(plan);
        let gathered = plan.texture("gathered_from_sky", level.size, Format::Rgba32Float, "light of the sky");
        let run = Gather {
            surfels: level.surfels,
            gathered,
            environment,
            grid: voxels.grid,
            voxels: voxels.voxels,
            params: Params { scale: level.scale as f32 },
            constants: Constants { rays: self.rays, over_frames: self.over_frames },
        };
        plan.pass(Part::Technique, "gather_sky", run)
            .because(format!("the scene has an environment: {} rays through voxels", self.rays))
            .costs(u64::from(self.rays) * of_ray)
            .over(level.size);
        Some(denoised(plan, level, gathered, DENOISE))
    }
}

/// Adds sky light to the light so far, both of this size. Plans a pass only if there are both.
pub fn with_sky(
    plan: &mut FramePlan,
    size: [u32; 2],
    so_far: Option<ResourceId>,
    sky: Option<ResourceId>,
) -> Option<ResourceId> {
    let (Some(so_far), Some(sky)) = (so_far, sky) else { return so_far.or(sky) };
    let float16 = plan.resources[so_far.0].format() == Some(Format::Rgba16Float);
    let format = if float16 { Format::Rgba16Float } else { Format::Rgba32Float };
    let sum = plan.texture("with_sky", size, format, "light with that of the sky");
    plan.pass(Part::Technique, "add_sky", Sum { light: sky, so_far, sum, float16 })
        .because("adds the light of the sky")
        .over(size);
    Some(sum)
}
