//! The temporal filter (Soler & Hoel 2010, Equation 6): a pass that any technique may add.

use wgpu::TextureFormat as Format;

use crate::gi::{Inputs, MotionInputs};
use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_shared_shaders::temporal::{self, Temporal};

/// Largest remaining share of an old image when a static image begins to average without limit.
const SETTLED: f32 = 1.0 / 256.0;

/// Number of frames after which a share `left` of old light remains in an average with weight `a`, 0..1. For a share of
/// one half this is the half-life: ln 2 / -ln a.
pub fn frames_until(a: f32, left: f32) -> f32 {
    if a > 0.0 { left.ln() / a.ln() } else { 0.0 }
}

/// Adds the filter after a technique that returned `indirect` (at full resolution), and returns the filtered light.
/// Adds nothing and returns its input if `a` is 0 or there is no light.
///
/// It consists of a pass and a history: the light, with depth and normal, in one texel of 128 bits. If objects are
/// animated, it follows them through `inputs.motion`.
pub fn temporal_filter(
    plan: &mut FramePlan,
    inputs: &Inputs,
    indirect: Option<ResourceId>,
    a: f32,
) -> Option<ResourceId> {
    let light = indirect?;
    Some(filter(plan, inputs, light, a, None))
}

/// As [`temporal_filter`] for the light of mirror lobes, with a separate history. Fewer frames are averaged for
/// narrower lobes, because their light changes faster. `material` is that of each pixel.
pub fn temporal_filter_of_gloss(
    plan: &mut FramePlan,
    inputs: &Inputs,
    glossy: ResourceId,
    a: f32,
    material: ResourceId,
) -> ResourceId {
    filter(plan, inputs, glossy, a, Some(material))
}

/// Fetches of a pixel: depth, normal, light, object and material, and four texels of the history.
const COST: u64 = 9;

fn filter(
    plan: &mut FramePlan,
    inputs: &Inputs,
    light: ResourceId,
    a: f32,
    material: Option<ResourceId>,
) -> ResourceId {
    if a <= 0.0 {
        return light;
    }
    let of = if material.is_some() { "_glossy" } else { "" };
    let size = plan.display_size;
    let half = plan.resources[light.0].format() == Some(Format::Rgba16Float);
    let format = if half { Format::Rgba16Float } else { Format::Rgba32Float };
    let history = plan.history(&format!("history{of}"), size, Format::Rgba32Uint, "history of the temporal filter");
    let filtered = plan.texture(format!("filtered{of}"), size, format, "indirect light, averaged over frames");
    let run = Temporal {
        depth: inputs.depth,
        normal: inputs.normal,
        indirect: light,
        history_before: history.before,
        history: history.now,
        filtered,
        float16: half,
        animated: inputs.motion.map(|MotionInputs { object, objects }| temporal::Animated { object, objects }),
        glossy: material.map(|material| temporal::Glossy {
            material,
            materials: plan.scene_buffer("scene.materials", "glossy materials"),
        }),
        params: temporal::Params { a, settle_frames: frames_until(a, SETTLED).ceil() as u32 },
    };
    plan.pass(Part::Technique, format!("temporal{of}"), run)
        .because(format!("temporal_a = {a}: half of an old image is gone after {:.1} frames", frames_until(a, 0.5)))
        .costs(COST)
        .over(size);
    filtered
}
