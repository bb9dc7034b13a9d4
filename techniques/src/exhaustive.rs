//! Exhaustive sum: every pixel sums over every pixel, without hierarchy or sampling.

use halflight_shared_shaders::exhaustive;
use wgpu::TextureFormat as Format;

use crate::hierarchical::FormFactor;
use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_renderer::gi::{GBufferNeeds, Inputs, LightSources, Technique};
use halflight_renderer::{
    parameters,
    parameters::{Settings, SettingsError},
};

parameters! {
    /// Parameters of the exhaustive sum.
    pub struct Exhaustive("exhaustive") {
        /// Form factor between receiver and source: eq3 between points, unbounded; eq4 from point to disc.
        form_factor: FormFactor = FormFactor::PointToDisc, unit "", grid [FormFactor::PointToDisc],
        role Override;
    }
}

/// The technique. See the module.
pub const TECHNIQUE: Technique = Technique {
    name: Exhaustive::TECHNIQUE,
    title: "Every pair of pixels",
    summary: "every pixel sums over every pixel (Soler 2009, Equation 1 with 4): slow, without sampling or hierarchy",
    parameters: Exhaustive::parameters,
    main: &["form_factor"],
    complete: |settings| Ok(Exhaustive::from_settings(settings)?.to_settings()),
    needs: |_| Ok(GBufferNeeds::NONE),
    sources: |_| Ok(LightSources::SCREEN),
    plan,
};

/// Pairs of pixels per pass. No invocation sums over more than 11,586 of them, because software drivers of the Mesa project
/// silently end the loops of an invocation after 65,535 iterations.
const PAIRS_A_PASS: u64 = 1 << 27;

fn plan(plan: &mut FramePlan, inputs: &Inputs, settings: &Settings) -> Result<Option<ResourceId>, SettingsError> {
    let parameters = Exhaustive::from_settings(settings)?;
    let size = plan.display_size;
    let [width, height] = size;
    let pairs_a_row = u64::from(width) * u64::from(width) * u64::from(height);
    let rows = (PAIRS_A_PASS / pairs_a_row).clamp(1, u64::from(height)) as u32;
    // Passes alternate between two textures, because no pass may read the texture that it writes.
    let sums = [0, 1].map(|i| plan.texture(format!("sum_{i}"), size, Format::Rgba32Float, "sum over the rows so far"));
    let mut written = sums[0];
    for (index, first_row) in (0..height).step_by(rows as usize).enumerate() {
        let (partial, sum) = (sums[(index + 1) % 2], sums[index % 2]);
        let run = exhaustive::Exhaustive {
            depth: inputs.depth,
            normal: inputs.normal,
            direct: inputs.direct,
            partial_sum: partial,
            indirect: sum,
            params: exhaustive::Params { first_row, end_row: (first_row + rows).min(height) },
            constants: exhaustive::Constants { point_to_disc: parameters.form_factor == FormFactor::PointToDisc },
        };
        plan.pass(Part::Technique, format!("exhaustive_{index}"), run)
            .because("every pixel sums over these rows")
            .costs(u64::from(rows) * u64::from(width))
            .over(size);
        written = sum;
    }
    Ok(Some(written))
}
