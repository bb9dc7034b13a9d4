//! The plan of a whole frame of a scene: G-buffer, direct light, a technique, and the final image.

mod surfaces;
mod within;

use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_shared_shaders::{
    composite::{self, Composite},
    sky::Sky,
    source::Source,
};
use wgpu::TextureFormat as Format;

pub use self::surfaces::Surfaces;
pub use within::{PlanInputs, Planner, plan_within};

use self::surfaces::{GBuffer, LookedUp, SceneResources, plan_direct, plan_gbuffer};
use crate::{
    gi::{
        ExtraView, GBufferNeeds, Inputs, MotionInputs, ReceiveOnlyInputs, Storage, Technique,
        shadow_maps::{DirectLight, ShadowMaps, plan_shadow_maps},
    },
    parameters::{Parameter, Settings, SettingsError},
    scene::SceneFacts,
};

/// Pixels that one invocation of `composite.wgsl` computes.
const COMPOSITE_PIXELS: u32 = 4;
/// Fetches of a pixel of the final image: direct, albedo, indirect, glossy light with its material, transmitted light.
const COMPOSITE_COST: u64 = 7;

/// Source of a frame's direct light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DirectSource {
    /// Lights and shadow maps.
    #[default]
    Rendered,
    /// A texture `direct` of the caller, for example a path-traced one.
    Given,
}

/// Parameters of every frame, whatever its technique: those of the G-buffer and of direct light.
pub fn frame_parameters() -> Vec<Parameter> {
    [Surfaces::parameters(), DirectLight::parameters()].concat()
}

/// Plans a whole frame: `technique` with `settings` on a scene with these facts, at this size in pixels.
///
/// Outputs are `depth`, `normal`, `albedo`, `direct`, `final` and those of the technique.
///
/// # Errors
/// A setting that its declaration does not allow.
pub fn plan_frame(
    facts: &SceneFacts,
    technique: &Technique,
    settings: &Settings,
    size: [u32; 2],
    direct: DirectSource,
) -> Result<FramePlan, SettingsError> {
    let plan = |facts: &SceneFacts| plan_frame_of(facts, technique, settings, size, direct);
    let planned = takes_light(technique, settings, Some(facts))?.then(|| plan(facts)).transpose()?;
    match planned {
        Some(planned) if facts.receive_only.is_empty() || reads_senders(&planned) => Ok(planned),
        _ => plan(&facts.without_senders()),
    }
}

/// Whether some pass reads which surfaces of a view send light, or the light that they send.
fn reads_senders(plan: &FramePlan) -> bool {
    let readers = plan.passes.iter().filter(|pass| !pass.shader.name.starts_with("source/"));
    let mut read = readers.flat_map(|pass| pass.reads_and_writes().0);
    read.any(|id| ["source", "receive_only"].iter().any(|name| plan.resources[id.0].name.ends_with(name)))
}

/// As [`plan_frame`], and the surfaces that send no light are marked even if nothing reads that.
fn plan_frame_of(
    facts: &SceneFacts,
    technique: &Technique,
    settings: &Settings,
    size: [u32; 2],
    direct: DirectSource,
) -> Result<FramePlan, SettingsError> {
    let follows = facts.needs.moving_objects > 0 && follows_objects(facts, technique, settings, size)?;
    let needs = (technique.needs)(settings)?;
    let (mut plan, ScenePart { gbuffer, scene, shadow }) =
        plan_scene_for(facts, settings, size, direct, needs, follows)?;
    let mut extra = Vec::new();
    if extra_views(facts, technique, settings)? {
        let shadow = match (shadow, direct) {
            (None, DirectSource::Given) => plan_shadow_maps(&mut plan, facts, settings)?,
            (shadow, _) => shadow,
        };
        extra = plan_extra_views(&mut plan, facts, &scene, shadow);
    }
    let motion = gbuffer.object.zip(gbuffer.objects).map(|(object, objects)| MotionInputs { object, objects });
    let receive_only = plan_receive_only(&mut plan, facts, &gbuffer);
    let output = |name| plan.outputs[name];
    let inputs = Inputs {
        depth: output("depth"),
        normal: output("normal"),
        direct: output("direct"),
        albedo: output("albedo"),
        motion,
        material: plan.outputs.get("material").copied(),
        receive_only,
        scene: Some(facts),
        extra_views: &extra,
    };
    let source = plan_source(&mut plan, inputs.direct, receive_only);
    plan_indirect_from(&mut plan, technique, settings, &Inputs { direct: source, ..inputs }, inputs.direct)?;
    Ok(plan)
}

/// Whether a technique with these settings reprojects the previous frame, and therefore needs the motion of objects.
fn follows_objects(
    facts: &SceneFacts,
    technique: &Technique,
    settings: &Settings,
    size: [u32; 2],
) -> Result<bool, SettingsError> {
    Ok(plan_technique_of_scene(facts, technique, settings, size)?.has_previous_images())
}

/// Marks receive-only surfaces, if the scene has any.
fn plan_receive_only(plan: &mut FramePlan, facts: &SceneFacts, gbuffer: &GBuffer) -> Option<ReceiveOnlyInputs> {
    let material = gbuffer.material.filter(|_| !facts.receive_only.is_empty())?;
    let flags = bytemuck::cast_slice(&facts.receive_only).to_vec();
    let flags = plan.data("receive_only", flags, "receive-only materials");
    Some(ReceiveOnlyInputs { material, flags })
}

/// The source of indirect light: direct light without that of receive-only surfaces.
fn plan_source(plan: &mut FramePlan, direct: ResourceId, receive_only: Option<ReceiveOnlyInputs>) -> ResourceId {
    let Some(ReceiveOnlyInputs { material, flags }) = receive_only else { return direct };
    let size = plan.display_size;
    let float16 = plan.resources[direct.0].format() == Some(Format::Rgba16Float);
    let format = if float16 { Format::Rgba16Float } else { Format::Rgba32Float };
    let source = plan.texture("source", size, format, "direct light without receive-only surfaces");
    plan.pass(Part::Technique, "source", Source { direct, material, receive_only: flags, source, float16 })
        .because("some materials are receive-only")
        .over(size);
    source
}

/// The part of a frame before the technique: G-buffer and direct light, with the channels that a technique with these
/// `needs` reads.
///
/// # Errors
/// A setting that its declaration does not allow.
pub fn plan_scene(
    facts: &SceneFacts,
    needs: GBufferNeeds,
    settings: &Settings,
    size: [u32; 2],
    direct: DirectSource,
) -> Result<FramePlan, SettingsError> {
    Ok(plan_scene_for(facts, settings, size, direct, needs, false)?.0)
}

/// Results of the first part of a frame, for additional views.
struct ScenePart {
    gbuffer: GBuffer,
    scene: SceneResources,
    shadow: Option<ShadowMaps>,
}

/// Whether a technique with these settings also gathers in the scene's extra cameras.
///
/// # Errors
/// A setting that its declaration does not allow.
pub fn extra_views(facts: &SceneFacts, technique: &Technique, settings: &Settings) -> Result<bool, SettingsError> {
    Ok(!facts.extra_cameras.is_empty() && (technique.needs)(settings)?.extra_cameras)
}

/// G-buffer and direct light of each extra camera.
fn plan_extra_views(
    plan: &mut FramePlan,
    facts: &SceneFacts,
    scene: &SceneResources,
    shadow: Option<ShadowMaps>,
) -> Vec<ExtraView> {
    let [width, height] = plan.display_size;
    let mut views = Vec::new();
    for (index, camera) in facts.extra_cameras.iter().enumerate() {
        let tan_half_fov = camera.tan_half_fov(width, height);
        let view = plan.add_view(format!("camera_{}", index + 1), camera.view_matrix(), tan_half_fov);
        views.push(plan.from_view(view, |plan| {
            let gbuffer = plan_gbuffer(plan, facts, scene, DirectSource::Rendered, false, LookedUp::default());
            let direct = plan_direct(plan, facts, scene, &gbuffer, shadow);
            let receive_only = plan_receive_only(plan, facts, &gbuffer);
            let direct = plan_source(plan, direct, receive_only);
            let GBuffer { depth, normal, albedo, .. } = gbuffer;
            ExtraView { view, depth, normal, direct, albedo, receive_only }
        }));
    }
    views
}

/// As [`plan_scene`], with the `needs` of a technique, and a channel for the animated object of each pixel if a
/// technique `follows` objects.
fn plan_scene_for(
    facts: &SceneFacts,
    settings: &Settings,
    size: [u32; 2],
    direct: DirectSource,
    needs: GBufferNeeds,
    follows: bool,
) -> Result<(FramePlan, ScenePart), SettingsError> {
    let mut plan = FramePlan::new(size);
    let scene = SceneResources {
        vertices: plan.scene_buffer("scene.vertices", "the scene's geometry"),
        materials: plan.scene_buffer("scene.materials", "the scene's materials"),
        texels: (facts.needs.textured || facts.needs.alpha_tested)
            .then(|| plan.scene_buffer("scene.texels", "materials with textures")),
        objects: (facts.needs.moving_objects > 0)
            .then(|| plan.changing_scene_buffer("scene.objects", "objects are animated")),
        direct: DirectLight::from_settings(settings)?.storage,
        texture_filter: Surfaces::from_settings(settings)?.texture_filter,
    };
    let looked_up = LookedUp {
        glossy: facts.needs.glossy && needs.glossy_material,
        translucent: facts.needs.translucent && needs.translucent_material,
    };
    let gbuffer = plan_gbuffer(&mut plan, facts, &scene, direct, follows, looked_up);
    let (direct, shadow) = match direct {
        DirectSource::Given => (plan.external("direct", "direct light of the caller"), None),
        DirectSource::Rendered => {
            let shadow = plan_shadow_maps(&mut plan, facts, settings)?;
            let direct = plan_direct(&mut plan, facts, &scene, &gbuffer, shadow);
            if facts.needs.environment {
                let environment = plan.scene_buffer("scene.environment", "environment light");
                let float16 = scene.direct == Storage::Float16;
                plan.pass(Part::Direct, "sky", Sky { depth: gbuffer.depth, environment, direct, float16 })
                    .because("the environment is visible where there is no surface")
                    .over(size);
            }
            (direct, shadow)
        }
    };
    let outputs =
        [("depth", gbuffer.depth), ("normal", gbuffer.normal), ("albedo", gbuffer.albedo), ("direct", direct)];
    plan.outputs.extend(outputs);
    plan.outputs.extend(gbuffer.material.filter(|_| looked_up.any()).map(|material| ("material", material)));
    Ok((plan, ScenePart { gbuffer, scene, shadow }))
}

/// The part of a frame after direct light, on textures `depth`, `normal`, `direct` and `albedo` of the caller. A
/// temporal filter follows the camera only. The history of an object that moved is rejected, unless depth and normal
/// match by coincidence.
///
/// # Errors
/// A setting that its declaration does not allow, or one that needs the scene's triangles.
pub fn plan_technique(technique: &Technique, settings: &Settings, size: [u32; 2]) -> Result<FramePlan, SettingsError> {
    plan_on_textures(None, technique, settings, size)
}

/// As [`plan_technique`], with a scene whose buffers the graph receives too. Some settings read its triangles.
///
/// # Errors
/// A setting that its declaration does not allow.
pub fn plan_technique_of_scene(
    facts: &SceneFacts,
    technique: &Technique,
    settings: &Settings,
    size: [u32; 2],
) -> Result<FramePlan, SettingsError> {
    plan_on_textures(Some(facts), technique, settings, size)
}

fn plan_on_textures(
    facts: Option<&SceneFacts>,
    technique: &Technique,
    settings: &Settings,
    size: [u32; 2],
) -> Result<FramePlan, SettingsError> {
    let mut plan = FramePlan::new(size);
    let mut given = |name| plan.external(name, "provided by the caller");
    let inputs = Inputs {
        depth: given("depth"),
        normal: given("normal"),
        direct: given("direct"),
        albedo: given("albedo"),
        motion: None,
        material: None,
        receive_only: None,
        scene: facts,
        extra_views: &[],
    };
    let needs = (technique.needs)(settings)?;
    let looked_up = LookedUp {
        glossy: needs.glossy_material && facts.is_some_and(|facts| facts.needs.glossy),
        translucent: needs.translucent_material && facts.is_some_and(|facts| facts.needs.translucent),
    };
    let inputs =
        Inputs { material: looked_up.any().then(|| plan.external("material", "provided by the caller")), ..inputs };
    plan.outputs.extend([
        ("depth", inputs.depth),
        ("normal", inputs.normal),
        ("albedo", inputs.albedo),
        ("direct", inputs.direct),
    ]);
    plan_indirect(&mut plan, technique, settings, &inputs)?;
    Ok(plan)
}

/// Adds a technique and the final image to a plan that already has the technique's inputs.
///
/// # Errors
/// A setting that its declaration does not allow.
pub fn plan_indirect(
    plan: &mut FramePlan,
    technique: &Technique,
    settings: &Settings,
    inputs: &Inputs,
) -> Result<(), SettingsError> {
    plan_indirect_from(plan, technique, settings, inputs, inputs.direct)
}

/// Whether a technique takes some light of a scene. Without facts about a scene, the light may come from anywhere.
fn takes_light(technique: &Technique, settings: &Settings, facts: Option<&SceneFacts>) -> Result<bool, SettingsError> {
    facts.map_or(Ok(true), |facts| Ok((technique.sources)(settings)?.takes_any(&facts.needs)))
}

/// Plans a technique in a scene without light that it takes: nothing, unless it finds ambient visibility.
fn plan_without_light(
    plan: &mut FramePlan,
    technique: &Technique,
    settings: &Settings,
    inputs: &Inputs,
) -> Result<Option<ResourceId>, SettingsError> {
    let mut planned = plan.clone();
    let indirect = (technique.plan)(&mut planned, inputs, settings)?;
    if planned.outputs.contains_key("ambient_occlusion") {
        *plan = planned;
        return Ok(indirect);
    }
    if indirect.is_some() {
        plan.notes.push(format!("{} plans no pass, because the scene has no light that it takes", technique.name));
    }
    Ok(None)
}

/// As [`plan_indirect`], if the source of indirect light (`inputs.direct`) is not all of the visible direct light.
fn plan_indirect_from(
    plan: &mut FramePlan,
    technique: &Technique,
    settings: &Settings,
    inputs: &Inputs,
    shown: ResourceId,
) -> Result<(), SettingsError> {
    let size = plan.display_size;
    if let Some(scene) = inputs.scene {
        plan.notes.extend(technique.left_out(settings, &scene.needs)?);
    }
    let indirect = if takes_light(technique, settings, inputs.scene)? {
        (technique.plan)(plan, inputs, settings)?
    } else {
        plan_without_light(plan, technique, settings, inputs)?
    };
    let Some(indirect) = indirect else {
        // Without indirect light the final image is the direct light.
        plan.outputs.insert("final", shown);
        return Ok(());
    };
    // The final image has the precision of its parts.
    let half = plan.resources[indirect.0].format() == Some(Format::Rgba16Float);
    let format = if half { Format::Rgba16Float } else { Format::Rgba32Float };
    let image = plan.texture("final", size, format, "the image to show");
    let glossy = plan.outputs.get("glossy").copied().zip(inputs.material).map(|(glossy, material)| composite::Glossy {
        glossy,
        material,
        materials: plan.scene_buffer("scene.materials", "glossy materials"),
    });
    let transmitted = plan.outputs.get("transmitted").copied();
    let (albedo, final_image, float16) = (inputs.albedo, image, half);
    let composite = Composite { direct: shown, albedo, indirect, final_image, float16, glossy, transmitted };
    plan.pass(Part::Technique, "composite", composite)
        .because("final = direct + albedo * indirect")
        .costs(COMPOSITE_COST * u64::from(COMPOSITE_PIXELS))
        .over([size[0].div_ceil(COMPOSITE_PIXELS), size[1]]);
    plan.outputs.extend([("indirect", indirect), ("final", image)]);
    Ok(())
}
