//! Multiple bounces by previous-frame bounces (Therrien et al. 2023, section 4.3), for any technique: every frame adds
//! one bounce.

use halflight_shared_shaders::previous_frame_bounce::{
    source::{self, Source},
    write_history::WriteHistory,
};
use wgpu::TextureFormat as Format;

use crate::gi::Inputs;
use halflight_frame_graph::{FramePlan, History, Part, ResourceId};

/// Light of the previous frame as a source of this one.
pub struct PreviousFrameBounce {
    /// The technique's source: direct light, and what surfaces reflect of the previous frame's light.
    pub source: ResourceId,
    light: History,
}

impl PreviousFrameBounce {
    /// Plans the source; `None`, and nothing planned, if `bound` is 0. `bound` is the largest albedo of the reflection,
    /// below 1. The added light stays below 1 / (1 - bound) times the first bounce.
    pub fn plan(plan: &mut FramePlan, inputs: &Inputs, bound: f32) -> Option<Self> {
        if bound <= 0.0 {
            return None;
        }
        let size = plan.display_size;
        let light = plan.history("light", size, Format::Rgba32Uint, "history of indirect light");
        let source = plan.texture("fed", size, Format::Rgba32Float, "direct light and the previous frame's bounces");
        let &Inputs { depth, normal, direct, albedo, .. } = inputs;
        let params = source::Params { bound };
        let run = Source { depth, normal, direct, albedo, light_before: light.before, source, params };
        plan.pass(Part::Technique, "feedback", run)
            .because(format!("previous-frame bounces, albedo at most {bound}"))
            .over(size);
        Some(Self { source, light })
    }

    /// Writes the history: this frame's light, at full resolution.
    pub fn write_history(&self, plan: &mut FramePlan, inputs: &Inputs, indirect: ResourceId) {
        let size = plan.display_size;
        let run = WriteHistory { depth: inputs.depth, normal: inputs.normal, indirect, light: self.light.now };
        plan.pass(Part::Technique, "remember", run).because("the next frame adds a bounce").over(size);
    }
}
