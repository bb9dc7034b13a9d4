//! Additional views that gather light which the display's camera does not see (Soler et al. 2009, Figure 9).

use wgpu::TextureFormat as Format;

use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_renderer::{gi::Inputs, parameters::SettingsError};
use halflight_shared_shaders::views::merge::{self, Merge};

/// Gathers in each additional view of the plan by `gather`. Each pixel keeps the largest light that any view found on
/// its surface. `light` (at full resolution) is that of the display.
pub(super) fn keep_the_most(
    plan: &mut FramePlan,
    inputs: &Inputs,
    light: Option<ResourceId>,
    gather: impl Fn(&mut FramePlan, &Inputs) -> Result<Option<ResourceId>, SettingsError>,
) -> Result<Option<ResourceId>, SettingsError> {
    let Some(mut light) = light else { return Ok(None) };
    for extra in inputs.extra_views {
        let view = plan.views[extra.view].clone();
        let other = extra.inputs(inputs);
        let Some(other_light) = plan.from_view(extra.view, |plan| gather(plan, &other))? else { continue };
        let size = plan.display_size;
        let half = plan.resources[light.0].format() == Some(Format::Rgba16Float);
        let format = if half { Format::Rgba16Float } else { Format::Rgba32Float };
        let most = plan.texture(format!("most_with_{}", view.name), size, format, "largest light of any view");
        let run = Merge {
            depth: inputs.depth,
            normal: inputs.normal,
            light,
            other_depth: other.depth,
            other_normal: other.normal,
            other_light,
            most,
            float16: half,
            params: merge::Params {
                world_to_other: view.world_to_view.to_cols_array_2d(),
                other_tan_half_fov: view.tan_half_fov,
            },
        };
        plan.pass(Part::Technique, format!("merge_{}", view.name), run)
            .because("an extra camera sees light that the display's does not")
            .over(size);
        light = most;
    }
    Ok(Some(light))
}
