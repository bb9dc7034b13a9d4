//! Passes for tests of plans.

use halflight_shared_shaders::composite::Composite;

use super::{FramePlan, Part, ResourceId};

/// A pass over the plan's display that reads a texture and writes another.
pub(super) fn pass(plan: &mut FramePlan, name: &str, reads: ResourceId, writes: ResourceId) {
    let composite = Composite {
        direct: reads,
        albedo: reads,
        indirect: reads,
        final_image: writes,
        float16: false,
        glossy: None,
        transmitted: None,
    };
    let size = plan.display_size;
    plan.pass(Part::Technique, name, composite).over(size);
}
