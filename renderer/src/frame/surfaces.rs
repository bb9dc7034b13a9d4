//! What a technique starts from: G-buffer, shadow maps and direct light.

use halflight_scenes::SceneNeeds;
use wgpu::TextureFormat as Format;

use halflight_frame_graph::{FramePlan, Gpu, Part, ResourceId, variant};

use super::{DirectLight, DirectSource, SceneFacts};
use crate::{
    parameters::{Settings, SettingsError},
    scene::{ShadowLayer, triangles},
};

pub(super) struct SceneResources {
    pub(super) vertices: ResourceId,
    pub(super) materials: ResourceId,
    pub(super) texels: Option<ResourceId>,
    pub(super) objects: Option<ResourceId>,
}

pub(super) struct GBuffer {
    pub(super) depth: ResourceId,
    pub(super) normal: ResourceId,
    pub(super) albedo: ResourceId,
    pub(super) material: Option<ResourceId>,
    pub(super) object: Option<ResourceId>,
    pub(super) objects: Option<ResourceId>,
}

fn counted(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// What a technique looks up by a pixel's material.
#[derive(Clone, Copy, Default)]
pub(super) struct LookedUp {
    pub(super) glossy: bool,
    pub(super) translucent: bool,
}

impl LookedUp {
    pub(super) fn any(self) -> bool {
        self.glossy || self.translucent
    }
}

pub(super) fn plan_gbuffer(
    plan: &mut FramePlan,
    needs: &SceneNeeds,
    scene: &SceneResources,
    direct: DirectSource,
    follows: bool,
    looked_up: LookedUp,
) -> GBuffer {
    let size = plan.display_size;
    let depth = plan.texture("depth", size, Format::R32Float, "every technique reads it");
    let normal = plan.texture("normal", size, Format::Rgba16Float, "every technique reads it");
    let albedo = plan.texture("albedo", size, Format::Rgba8UnormSrgb, "reflects direct and indirect light");
    let emitters = needs.emitters && direct == DirectSource::Rendered;
    let material = (emitters || needs.receive_only || looked_up.any()).then(|| {
        let reasons = [
            (emitters, "the scene has emitters, direct light looks them up"),
            (needs.receive_only, "some materials only receive light"),
            (looked_up.glossy, "glossy light looks it up"),
            (looked_up.translucent, "light that passes translucent surfaces looks it up"),
        ];
        let reasons: Vec<_> = reasons.into_iter().filter(|(holds, _)| *holds).map(|(_, reason)| reason).collect();
        plan.texture("material", size, Format::R32Uint, reasons.join("; "))
    });
    let object = scene
        .objects
        .filter(|_| follows)
        .map(|_| plan.texture("object", size, Format::R32Uint, "objects move, and the temporal filter follows them"));
    let depth_test = plan.texture("depth_test", size, Gpu::DEPTH_FORMAT, "hidden surfaces");
    let shader = |alpha_tested| {
        variant(
            "gbuffer/gbuffer",
            &[
                ("alpha_tested", alpha_tested),
                ("textured", needs.textured),
                ("material_id", material.is_some()),
                ("moving", scene.objects.is_some()),
                ("object_id", object.is_some()),
            ],
        )
    };
    let mut pass = plan
        .pass(Part::GBuffer, "gbuffer", shader(needs.alpha_tested))
        .bind("vertices", scene.vertices)
        .bind("materials", scene.materials)
        .because("what the camera sees");
    if let Some(texels) = scene.texels {
        pass = pass.bind("texels", texels);
    }
    if let Some(objects) = scene.objects {
        pass = pass.bind("objects", objects);
    }
    let targets = [Some(depth), Some(normal), Some(albedo), material, object];
    pass.draw(
        triangles::by_alpha(needs.alpha_tested, || shader(false)),
        targets.into_iter().flatten().collect(),
        (depth_test, 0),
    );
    GBuffer { depth, normal, albedo, material, object, objects: scene.objects }
}

pub(super) fn plan_direct(
    plan: &mut FramePlan,
    facts: &SceneFacts,
    scene: &SceneResources,
    gbuffer: &GBuffer,
    shadow: Option<Shadows>,
) -> ResourceId {
    let size = plan.display_size;
    let lit = shadow.is_some();
    let direct = plan.texture("direct", size, Format::Rgba32Float, "the source of indirect light");
    let needs = &facts.needs;
    let emitters = gbuffer.material.filter(|_| needs.emitters);
    let shader = variant("direct/direct_light", &[("lit", lit), ("emitters", emitters.is_some())]);
    let lights = needs.directional_lights + needs.spot_lights + needs.point_lights;
    let lights_buffer = lit.then(|| plan.scene_buffer("scene.lights", "the scene's lights"));
    let mut pass = plan
        .pass(Part::Direct, "direct", shader)
        .constants(&[("LIGHTS", lights as f64)])
        .bind("depth", gbuffer.depth)
        .bind("normal", gbuffer.normal)
        .bind("direct", direct)
        .because(format!("{}{}", counted(lights, "light"), if needs.emitters { " and emitters" } else { "" }));
    if let (Some(Shadows { maps, entries }), Some(buffer)) = (shadow, lights_buffer) {
        pass = pass
            .bind("albedo", gbuffer.albedo)
            .bind("lights", buffer)
            .bind("shadow_layers", entries)
            .bind("shadow_maps", maps);
    }
    if let Some(material) = emitters {
        pass = pass.bind("material", material).bind("materials", scene.materials);
    }
    pass.over(size);
    direct
}

/// Shadow maps of all lights, and what each of them looks at.
#[derive(Clone, Copy)]
pub(super) struct Shadows {
    maps: ResourceId,
    entries: ResourceId,
}

pub(super) fn plan_shadows(
    plan: &mut FramePlan,
    facts: &SceneFacts,
    scene: &SceneResources,
    settings: &Settings,
) -> Result<Option<Shadows>, SettingsError> {
    let map_size = DirectLight::from_settings(settings)?.shadow_map_size;
    let layers = &facts.shadow_layers;
    if layers.is_empty() {
        return Ok(None);
    }
    let count = layers.len() as u32;
    let maps =
        plan.texture_array("shadow_maps", [map_size; 2], count, Gpu::DEPTH_FORMAT, counted(layers.len(), "shadow map"));
    let entries = plan.data("shadow_layers", shadow_entries(layers, map_size), "what the shadow maps look at");
    let shader = |alpha_tested| {
        variant("shadow/shadow_map", &[("alpha_tested", alpha_tested), ("moving", scene.objects.is_some())])
    };
    for (index, layer) in layers.iter().enumerate() {
        let mut pass = plan
            .pass(Part::Direct, format!("shadow_{index}"), shader(facts.needs.alpha_tested))
            .param("world_to_clip", layer.world_to_clip)
            .bind("vertices", scene.vertices)
            .because("a light casts shadows");
        if let (true, Some(texels)) = (facts.needs.alpha_tested, scene.texels) {
            pass = pass.bind("materials", scene.materials).bind("texels", texels);
        }
        if let Some(objects) = scene.objects {
            pass = pass.bind("objects", objects);
        }
        pass.draw(triangles::by_alpha(facts.needs.alpha_tested, || shader(false)), Vec::new(), (maps, index as u32));
    }
    Ok(Some(Shadows { maps, entries }))
}

/// Twin of `ShadowLayer` in direct_light.wgsl: a matrix, then the width of a texel.
pub(crate) fn shadow_entries(layers: &[ShadowLayer], map_size: u32) -> Vec<u8> {
    let words: Vec<f32> = layers
        .iter()
        .flat_map(|layer| {
            layer.world_to_clip.to_cols_array().into_iter().chain([layer.width / map_size as f32, 0.0, 0.0, 0.0])
        })
        .collect();
    bytemuck::cast_slice(&words).to_vec()
}
