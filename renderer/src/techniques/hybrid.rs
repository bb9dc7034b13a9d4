//! Screen space and light space together (Lambru et al.): light from nearby comes from what the camera sees, light from
//! farther away from what the lights see, on the screen or not.

use wgpu::TextureFormat as Format;

use super::{GBufferNeeds, Inputs, Technique};
use crate::{
    choice,
    frame::variant,
    light_views::plan_virtual_lights,
    parameters,
    parameters::{Settings, SettingsError},
    plan::{FramePlan, Part, ResourceId},
    resolution::{Storage, Upsampling, UpsamplingKernel, pyramid, to_display},
    scene_voxels::plan_scene_voxels,
    techniques::hierarchical::{StartResolution, Switch},
    temporal::temporal_filter,
    translucency::Translucency,
};

choice! {
    /// Where light comes from.
    pub enum Sources {
        /// Nearby from the screen, from farther away from the lights' views.
        Both = "both",
        /// From the screen alone, within the radius.
        Screen = "screen",
        /// From the lights' views alone, at any distance.
        Lights = "lights",
    }
}

parameters! {
    /// Parameters of the hybrid technique.
    pub struct Hybrid("hybrid") {
        /// Where light comes from: both, nearby from the screen and otherwise from what the lights see; screen or lights alone.
        sources: Sources = Sources::Both, unit "", grid [Sources::Both, Sources::Screen, Sources::Lights], role Plan;
        /// Resolution of the gather: its cost falls with the square, detail of nearby light with it.
        start_resolution: StartResolution = StartResolution::Quarter, unit "",
        grid [StartResolution::Half, StartResolution::Quarter], role Plan;
        /// Distance up to which light comes from the screen; 0 takes a thirtieth of the scene's diagonal.
        radius: f32 = 0.0, in 0.0..=1e9, unit "scene units", grid [0.0], role Plan;
        /// Samples of the screen for each receiver.
        screen_samples: u32 = 32, in 1..=1024, unit "1", grid [16, 32, 64], role Override("NEAR_SAMPLES");
        /// Virtual lights that each receiver looks at.
        light_samples: u32 = 64, in 1..=1024, unit "1", grid [16, 64, 256], role Plan;
        /// Virtual lights in all, chosen by what they bring to the picture; receivers share them out among one another.
        virtual_lights: u32 = 1024, in 1..=16384, unit "1", grid [256, 1024, 4096], role Plan;
        /// Width and height of each light's view.
        light_view_size: u32 = 128, in 8..=512, unit "px", grid [64, 128, 256], role Plan;
        /// Whether light from the lights' views is tested for what stands in between, in a grid of cubes over the whole scene.
        visibility: Switch = Switch::On, unit "", grid [Switch::Off, Switch::On], role Plan;
        /// Cubes along the longest side of the scene.
        voxel_resolution: u32 = 256, in 8..=960, unit "1", grid [128, 256, 512], role Plan;
        /// Successive virtual lights that share one ray: the mean stays, the noise of visibility grows, its cost falls.
        samples_per_ray: u32 = 8, in 1..=64, unit "1", grid [1, 4, 8], role Override("SAMPLES_PER_RAY");
        /// Whether light from behind passes translucent surfaces, along the lights' views; takes effect where sources has those.
        translucency: Switch = Switch::On, unit "", grid [Switch::Off, Switch::On], role Plan;
        /// Storage of light at full resolution: float16 has half the bytes and clamps at 65,504.
        storage: Storage = Storage::Float16, unit "", grid [Storage::Float16, Storage::Float32], role Plan;
        /// Share a of the frames before in the filtered light; 0 is off. Half of an old image is gone after ln 2 / -ln a frames.
        temporal_a: f32 = 0.0, in 0.0..=0.999, unit "1", grid [0.0, 0.9], role Plan;
    }
}

/// See the module.
pub const TECHNIQUE: Technique = Technique {
    name: Hybrid::TECHNIQUE,
    summary: "screen space for nearby light, light space for the rest (Lambru et al.)",
    parameters: Hybrid::parameters,
    complete: |settings| Ok(Hybrid::from_settings(settings)?.to_settings()),
    needs: |settings| {
        let parameters = Hybrid::from_settings(settings)?;
        let translucent_material = parameters.translucency == Switch::On && parameters.sources != Sources::Screen;
        Ok(GBufferNeeds { translucent_material, ..GBufferNeeds::NONE })
    },
    plan,
};

/// Levels between the receivers of the gather and those that decide which virtual lights matter.
const IMPORTANCE_LEVELS: u32 = 2;

fn plan(plan: &mut FramePlan, inputs: &Inputs, settings: &Settings) -> Result<Option<ResourceId>, SettingsError> {
    let parameters = Hybrid::from_settings(settings)?;
    let near = parameters.sources != Sources::Lights;
    // Without a scene its lights are asked for all the same, to be told that they are missing.
    let lit = inputs.scene.is_none() || !plan.light_views.is_empty() || !plan.emitters.is_empty();
    let wants_far = parameters.sources != Sources::Screen && lit;
    if !near && !wants_far {
        return Ok(None);
    }
    let divisor = parameters.start_resolution.divisor();
    let levels = pyramid(plan, inputs, &[("VOTE", 0.0)], divisor, if wants_far { IMPORTANCE_LEVELS } else { 0 });
    let (level, coarse) = (&levels[0], &levels[levels.len() - 1]);
    let mut translucency = Translucency::new(inputs, parameters.translucency == Switch::On);
    let lights = match wants_far {
        true => plan_virtual_lights(
            plan,
            inputs,
            Hybrid::TECHNIQUE,
            parameters.light_view_size,
            parameters.virtual_lights,
            coarse,
            |plan, maps, index, view| translucency.add(plan, maps, index, view),
        )?,
        false => None,
    };
    translucency.finish(plan);
    let radius = inputs.nearby(parameters.radius, Hybrid::TECHNIQUE)?;
    let voxels = match (&lights, inputs.scene) {
        (Some(_), Some(scene)) if parameters.visibility == Switch::On => {
            Some(plan_scene_voxels(plan, &scene, parameters.voxel_resolution))
        }
        _ => None,
    };
    let gathered = plan.texture("gathered", level.size, Format::Rgba32Float, "light at the start resolution");
    let features = [("near", near), ("far", lights.is_some()), ("visibility", voxels.is_some())];
    let stride = lights.as_ref().map_or(1, |lights| (lights.count / parameters.light_samples).max(1));
    let mut constants = parameters.constants();
    constants.push(("OVER_FRAMES", f64::from(u8::from(parameters.temporal_a > 0.0))));
    let mut pass = plan
        .pass(Part::Technique, "gather", variant("hybrid/gather", &features))
        .constants(&constants)
        .param("scale", level.scale as f32)
        .param("radius", radius)
        .param("virtual_lights", lights.as_ref().map_or(0, |lights| lights.count))
        .param("stride", stride)
        .bind("surfels", level.surfels)
        .bind("gathered", gathered);
    if let Some(lights) = &lights {
        pass = pass.bind("virtual_lights", lights.lights);
    }
    if let Some(voxels) = voxels {
        pass = pass.bind("grid", voxels.grid).bind("cubes", voxels.cubes);
    }
    pass.because("nearby light from the screen, the rest from the lights' views").over(level.size);
    let upsampling = Upsampling { kernel: UpsamplingKernel::Spline, storage: parameters.storage };
    let light = to_display(plan, inputs, &upsampling, level, gathered, "indirect");
    Ok(temporal_filter(plan, inputs, Some(light), parameters.temporal_a))
}
