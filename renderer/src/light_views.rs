//! Lights as views: what each light sees, as a reflective shadow map (Dachsbacher & Stamminger 2005), and the few of its
//! lit surfaces that matter most to what the camera sees.

use wgpu::TextureFormat as Format;

use crate::{
    Gpu,
    frame::variant,
    parameters::SettingsError,
    plan::{FramePlan, Part, ResourceId},
    resolution::Level,
    techniques::Inputs,
};

/// Lit surfaces that stand for all that the lights light: two buffers with one entry for each.
pub(crate) struct VirtualLights {
    /// `array<vec4f>`: position in view space and area.
    pub(crate) places: ResourceId,
    /// `array<vec4u>`: normal, radiance and the factor of the radiance.
    pub(crate) lights: ResourceId,
    pub(crate) count: u32,
}

/// Bytes of an entry of any of the buffers.
const ENTRY: u64 = 16;

/// Plans maps of `size` texels a side for every light and chooses `count` of their surfaces by what they bring to
/// `receivers`; `None` in a scene without lights.
///
/// # Errors
/// Where only textures were given, without a scene and its lights.
pub(crate) fn plan_virtual_lights(
    plan: &mut FramePlan,
    inputs: &Inputs,
    technique: &str,
    size: u32,
    count: u32,
    receivers: &Level,
) -> Result<Option<VirtualLights>, SettingsError> {
    let Some(scene) = inputs.scene else {
        return Err(SettingsError(format!(
            "{technique} draws the scene as its lights see it and only textures were given: plan with the facts of a scene"
        )));
    };
    let views = plan.light_views.clone();
    if views.is_empty() {
        return Ok(None);
    }
    let texels = size * size;
    let surfaces = texels * views.len() as u32;
    let mut buffer =
        |name: &str, entries: u32, bytes: u64, reason: &str| plan.buffer(name, u64::from(entries) * bytes, reason);
    let places = buffer("lit_places", surfaces, ENTRY, "where the lights' surfaces are");
    let lights = buffer("lit_radiance", surfaces, ENTRY, "what the lights' surfaces send on");
    let importances = buffer("importances", surfaces, 4, "what each of them would bring");
    let chosen = VirtualLights {
        places: buffer("virtual_places", count, ENTRY, "surfaces that stand for all of them"),
        lights: buffer("virtual_lights", count, ENTRY, "what these send on"),
        count,
    };
    let place =
        plan.texture("light_view_place", [size; 2], Format::Rgba32Float, "what a light sees, one after another");
    let light = plan.texture("light_view_light", [size; 2], Format::Rgba32Uint, "what it sends there");
    let depth = plan.texture("light_view_depth", [size; 2], Gpu::DEPTH_FORMAT, "hidden surfaces");
    let vertices = plan.scene_buffer("scene.vertices", "the scene's geometry");
    let materials = plan.scene_buffer("scene.materials", "the scene's materials");
    let scene_lights = plan.scene_buffer("scene.lights", "the scene's lights");
    let texels_buffer =
        (scene.textured || scene.alpha_tested).then(|| plan.scene_buffer("scene.texels", "materials with textures"));
    let objects = scene.moving.then(|| plan.scene_buffer("scene.objects", "objects move"));
    for (index, view) in views.iter().enumerate() {
        let features = [("alpha_tested", scene.alpha_tested), ("textured", scene.textured), ("moving", scene.moving)];
        let mut pass = plan
            .pass(Part::Technique, format!("light_view_{index}"), variant("light_views/light_view", &features))
            .param("world_to_clip", view.world_to_clip)
            .param("light", view.light)
            .param("texel_width", view.width / size as f32)
            .bind("vertices", vertices)
            .bind("materials", materials)
            .bind("lights", scene_lights)
            .because("what a light lights sends light on");
        if let Some(texels) = texels_buffer {
            pass = pass.bind("texels", texels);
        }
        if let Some(objects) = objects {
            pass = pass.bind("objects", objects);
        }
        pass.draw(vec![place, light], (depth, 0));
        plan.pass(Part::Technique, format!("collect_{index}"), "light_views/collect+importance")
            .param("first", texels * index as u32)
            .param("scale", receivers.scale as f32)
            .bind("place", place)
            .bind("light", light)
            .bind("places", places)
            .bind("lights", lights)
            .bind("surfels", receivers.surfels)
            .bind("importances", importances)
            .because("what each surface would bring to what the camera sees")
            .over([size; 2]);
    }
    plan.pass(Part::Technique, "choose", "light_views/choose")
        .param("surfaces", surfaces)
        .param("chosen", count)
        .bind("importances", importances)
        .bind("places", places)
        .bind("lights", lights)
        .bind("virtual_places", chosen.places)
        .bind("virtual_lights", chosen.lights)
        .because(format!("{count} surfaces stand for all that are lit"))
        .over([1, 1]);
    Ok(Some(chosen))
}
