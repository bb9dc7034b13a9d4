//! Ambient visibility (1 = open, 0 = closed; ambient occlusion is 1 minus it) from the screen and the reflective shadow
//! maps.

use wgpu::TextureFormat as Format;

use super::{Hybrid, Views};
use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_renderer::{
    gi::{
        Inputs, Storage, UpsamplingKernel,
        denoise::denoised,
        resolution::{Level, Upsampling, to_display},
        rsm::ReflectiveShadowMap,
    },
    parameters::SettingsError,
    scene::{ShadowLayer, shadow_view},
};
use halflight_shared_shaders::hybrid::{ambient_visibility, attenuate::Attenuate, average::Average};

/// Passes of the filter. Two passes average 25 texels; 32 samples then leave about 2 % of noise.
const BLUR: u32 = 2;

/// Sums over the views so far. Passes alternate between two textures, because no pass may read the texture that it
/// writes.
pub(super) struct AmbientVisibility<'a> {
    parameters: &'a Hybrid,
    level: &'a Level,
    radius: f32,
    views: Vec<ResourceId>,
    passes: usize,
}

impl<'a> AmbientVisibility<'a> {
    /// Plans the screen's part, once for all lights; nothing if the setting is off.
    ///
    /// # Errors
    /// If the radius is 0 and there is no scene to derive it from.
    pub(super) fn new(
        plan: &mut FramePlan,
        inputs: &Inputs,
        parameters: &'a Hybrid,
        level: &'a Level,
    ) -> Result<Option<Self>, SettingsError> {
        if parameters.ambient_occlusion == Views::Off {
            return Ok(None);
        }
        let radius = inputs.nearby(parameters.occlusion_radius, Hybrid::TECHNIQUE)?;
        let lights = if parameters.ambient_occlusion == Views::Both { inputs.shadow_layers().len() } else { 0 };
        let views = (0..(1 + lights).min(2))
            .map(|i| {
                plan.texture(
                    format!("views_{i}"),
                    level.size,
                    Format::Rg32Float,
                    "ambient visibility of the views so far",
                )
            })
            .collect();
        let mut ambient_visibility = Self { parameters, level, radius, views, passes: 0 };
        ambient_visibility.look(plan, None);
        Ok(Some(ambient_visibility))
    }

    /// Plans the part of one map.
    pub(super) fn add(&mut self, plan: &mut FramePlan, maps: &ReflectiveShadowMap, index: usize, view: &ShadowLayer) {
        self.look(plan, Some((maps, index, view)));
    }

    fn look(&mut self, plan: &mut FramePlan, light: Option<(&ReflectiveShadowMap, usize, &ShadowLayer)>) {
        let (name, reason) = match light {
            None => ("occlusion_screen".into(), "hemisphere samples against the screen"),
            Some((_, index, _)) => (format!("occlusion_{index}"), "hemisphere samples against a reflective shadow map"),
        };
        let run = ambient_visibility::AmbientVisibility {
            surfels: self.level.surfels,
            views: self.views[self.passes % 2],
            light: light.map(|(maps, index, view)| ambient_visibility::Light {
                shadow_view: shadow_view(plan, index, view),
                rsm_position: maps.position,
                light: maps.light,
                partial_sum: self.views[(self.passes + 1) % 2],
            }),
            params: ambient_visibility::Params {
                scale: self.level.scale as f32,
                radius: self.radius,
                samples: self.parameters.occlusion_samples,
            },
        };
        plan.pass(Part::Technique, name, run)
            .because(reason)
            .costs(self.parameters.occlusion_samples.into())
            .over(self.level.size);
        self.passes += 1;
    }

    /// Plans the mean of all views, its filter and its upsampling. The result is also an output.
    pub(super) fn finish(self, plan: &mut FramePlan, inputs: &Inputs) -> ResourceId {
        let level = self.level;
        let ambient_visibility =
            plan.texture("openness", level.size, Format::R32Float, "ambient visibility at the start resolution");
        plan.pass(
            Part::Technique,
            "occlusion",
            Average { views: self.views[(self.passes + 1) % 2], ambient_visibility },
        )
        .because("mean of the views, weighted by their reliability")
        .over(level.size);
        let smooth = denoised(plan, level, ambient_visibility, BLUR);
        let upsampling = Upsampling { kernel: UpsamplingKernel::Spline, storage: Storage::Float32 };
        let open = to_display(plan, inputs, &upsampling, level, smooth, "ambient_occlusion");
        plan.outputs.insert("ambient_occlusion", open);
        plan.attributes.insert("ambient_occlusion.radius", self.radius);
        open
    }
}

/// Plans light times ambient visibility.
pub(super) fn attenuated(
    plan: &mut FramePlan,
    light: ResourceId,
    ambient_visibility: ResourceId,
    name: &str,
) -> ResourceId {
    let size = plan.display_size;
    let half = plan.resources[light.0].format() == Some(Format::Rgba16Float);
    let format = if half { Format::Rgba16Float } else { Format::Rgba32Float };
    let attenuated =
        plan.texture(format!("attenuated_{name}"), size, format, format!("{name} light times ambient visibility"));
    plan.pass(
        Part::Technique,
        format!("attenuate_{name}"),
        Attenuate { light, ambient_visibility, attenuated, float16: half },
    )
    .because("occluded surfaces receive less light")
    .over(size);
    attenuated
}
