//! Bounces after the first (Soler & Hoel 2010). Each one gathers the reflected light of the previous one. Depth,
//! normals and froxels are reused; only the radiance of the surfels changes.

use wgpu::TextureFormat as Format;

use super::gather::{Gather, Light};
use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_renderer::gi::{Inputs, MotionInputs, ReceiveOnlyInputs, resolution::Level};
use halflight_shared_shaders::hierarchical::{
    albedo::{self, Albedo},
    interleave::{self, Interleave},
    relight::{self, Relight},
    reproject::{self, Reproject},
    sum::Sum,
};

/// Plans the bounces after the first and returns the sum of all, at the resolution of level 0. `first` is the light of
/// the first bounce.
pub(super) fn plan_bounces(plan: &mut FramePlan, inputs: &Inputs, gather: &Gather, first: ResourceId) -> ResourceId {
    let bounces = gather.parameters.bounces;
    if bounces < 2 {
        return first;
    }
    let start = &gather.levels[0];
    let albedo = plan_albedo(plan, inputs, start);
    let (mut light, mut total) = (first, first);
    for bounce in 2..=bounces {
        let surfels = relight(plan, gather, albedo, light, bounce, false);
        let Some(next) = gather.light(plan, Light::Bounce(bounce), &surfels) else { return total };
        light = next;
        let turn = bounce % 2;
        let sum =
            plan.texture_again(format!("sum_{turn}"), start.size, Format::Rgba32Float, "light of all bounces so far");
        plan.pass(Part::Technique, format!("sum_bounce_{bounce}"), Sum { light, so_far: total, sum, float16: false })
            .because("bounces add up")
            .over(start.size);
        total = sum;
    }
    total
}

/// Plans two bounces that alternate between frames, at the cost of one, and returns their sum at the resolution of
/// level 0 (2010, section 5.3); `None` if level 0 does not gather. A bounce is reprojected to the next frame's
/// surfaces. Surfaces that come into view, and the first frame, lack the other bounce.
pub(super) fn plan_interleaved(plan: &mut FramePlan, inputs: &Inputs, gather: &Gather) -> Option<ResourceId> {
    let start = &gather.levels[0];
    let kept = plan.history("bounce", start.size, Format::Rgba32Uint, "history of the bounce");
    let reprojected = plan.texture("recalled_bounce", start.size, Format::Rgba32Float, "the other bounce, reprojected");
    let scale = start.scale as f32;
    let run = Reproject {
        surfels: start.surfels,
        bounce_before: kept.before,
        reprojected,
        animated: inputs.motion.map(|MotionInputs { object, objects }| reproject::Animated { object, objects }),
        params: reproject::Params { scale },
    };
    plan.pass(Part::Technique, "recall_bounce", run).because("two bounces alternate between frames").over(start.size);
    let albedo = plan_albedo(plan, inputs, start);
    let surfels = relight(plan, gather, albedo, reprojected, 2, true);
    let light = gather.light(plan, Light::Bounce(1), &surfels)?;
    let both = plan.texture("both_bounces", start.size, Format::Rgba32Float, "light of both bounces");
    let run = Interleave {
        surfels: start.surfels,
        light,
        reprojected,
        bounce: kept.now,
        both,
        animated: inputs.motion.map(|motion| motion.object),
        params: interleave::Params { scale: inputs.motion.map(|_| scale) },
    };
    plan.pass(Part::Technique, "interleave_bounces", run).because("bounces add up").over(start.size);
    Some(both)
}

/// Albedo of the surfels of level 0.
fn plan_albedo(plan: &mut FramePlan, inputs: &Inputs, start: &Level) -> ResourceId {
    let surfel_albedo =
        plan.texture("albedo_of_surfels", start.size, Format::Rgba16Float, "albedo between two bounces");
    let receive_only = inputs
        .receive_only
        .map(|ReceiveOnlyInputs { material, flags }| albedo::ReceiveOnly { material, receive_only: flags });
    let run = Albedo {
        surfels: start.surfels,
        depth: inputs.depth,
        normal: inputs.normal,
        albedo: inputs.albedo,
        surfel_albedo,
        receive_only,
        params: albedo::Params { scale: start.scale as f32 },
    };
    plan.pass(Part::Technique, "albedo_of_surfels", run).because("several bounces").over(start.size);
    surfel_albedo
}

/// The surfels with the radiance that they reflect of `light`.
fn relight(
    plan: &mut FramePlan,
    gather: &Gather,
    albedo: ResourceId,
    light: ResourceId,
    bounce: u32,
    interleaved: bool,
) -> Vec<ResourceId> {
    let mut all: Vec<ResourceId> = Vec::new();
    for level in gather.levels {
        let relit = plan.texture_again(
            format!("relit_surfels_{}", level.scale),
            level.size,
            Format::Rgba32Uint,
            "surfels with reflected light",
        );
        let children = all.last().copied();
        let run = Relight {
            surfels: level.surfels,
            relit,
            finest: children.is_none().then_some(relight::Finest { albedo, light }),
            interleaved,
            children,
            params: relight::Params { child_scale: children.map(|_| 0.5 * level.scale as f32) },
        };
        plan.pass(Part::Technique, Light::Bounce(bounce).pass_name(&format!("relight_{}", level.scale)), run)
            .because(format!("bounce {bounce} starts from the light of bounce {}", bounce - 1))
            .over(level.size);
        all.push(relit);
    }
    all
}
