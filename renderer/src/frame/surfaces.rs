//! Inputs of a technique: G-buffer, shadow maps and direct light.

use halflight_frame_graph::{FramePlan, Gpu, Part, ResourceId};
use halflight_scenes::SceneNeeds;
use halflight_shared_shaders::{
    direct::direct_light::{self, DirectLight},
    gbuffer::{self, Gbuffer},
    shadow::shadow_map::{self, ShadowMap},
};
use wgpu::TextureFormat as Format;

use super::{DirectSource, SceneFacts};
use crate::{
    parameters::{Settings, SettingsError},
    scene::{ShadowAtlas, far_shadow_view, shadow_entries, shadow_view, triangles},
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

/// What a technique reads from a pixel's material.
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
    let depth = plan.texture("depth", size, Format::R32Float, "input of every technique");
    let normal = plan.texture("normal", size, Format::Rgba16Float, "input of every technique");
    let albedo = plan.texture("albedo", size, Format::Rgba8UnormSrgb, "reflects direct and indirect light");
    let emitters = needs.emitters && direct == DirectSource::Rendered;
    let material = (emitters || needs.receive_only || looked_up.any()).then(|| {
        let reasons = [
            (emitters, "emission of emitters"),
            (needs.receive_only, "some materials are receive-only"),
            (looked_up.glossy, "glossy light"),
            (looked_up.translucent, "translucent light"),
        ];
        let reasons: Vec<_> = reasons.into_iter().filter(|(holds, _)| *holds).map(|(_, reason)| reason).collect();
        plan.texture("material", size, Format::R32Uint, reasons.join("; "))
    });
    let object = scene.objects.filter(|_| follows).map(|_| {
        plan.texture("object", size, Format::R32Uint, "objects are animated, and the temporal filter follows them")
    });
    let depth_test = plan.texture("depth_test", size, Gpu::DEPTH_FORMAT, "depth test");
    let run = Gbuffer {
        vertices: scene.vertices,
        materials: scene.materials,
        alpha_tested: needs.alpha_tested,
        textured: needs.textured,
        texels: scene.texels,
        material_id: material.is_some(),
        animated: scene.objects,
        object_id: object.is_some(),
    };
    let opaque = gbuffer::Features { alpha_tested: false, ..run.features() }.shader();
    let targets = [Some(depth), Some(normal), Some(albedo), material, object];
    plan.pass(Part::GBuffer, "gbuffer", run).because("visible surfaces").draw(
        triangles::by_alpha(needs.alpha_tested, opaque),
        targets.into_iter().flatten().collect(),
        (depth_test, 0),
    );
    GBuffer { depth, normal, albedo, material, object, objects: scene.objects }
}

/// Fetches of the shadow test of one light.
const LIGHT_COST: u64 = 16;

pub(super) fn plan_direct(
    plan: &mut FramePlan,
    facts: &SceneFacts,
    scene: &SceneResources,
    gbuffer: &GBuffer,
    shadow: Option<Shadows>,
) -> ResourceId {
    let size = plan.display_size;
    let direct = plan.texture("direct", size, Format::Rgba32Float, "the source of indirect light");
    let needs = &facts.needs;
    let lights = needs.lights;
    let lit = shadow.map(|Shadows { maps, entries }| direct_light::Lit {
        albedo: gbuffer.albedo,
        lights: plan.changing_scene_buffer("scene.lights", "the scene's lights"),
        shadow_layers: entries,
        shadow_maps: maps,
    });
    let emitters = gbuffer.material.filter(|_| needs.emitters);
    let emitters = emitters.map(|material| direct_light::Emitters { material, materials: scene.materials });
    let constants = direct_light::Constants { lights: lights as u32 };
    let (depth, normal) = (gbuffer.depth, gbuffer.normal);
    plan.pass(Part::Direct, "direct", DirectLight { depth, normal, direct, lit, emitters, constants })
        .because(format!("{}{}", counted(lights, "light"), if needs.emitters { " and emitters" } else { "" }))
        .costs(LIGHT_COST * lights as u64)
        .over(size);
    direct
}

/// Shadow maps of all lights, and their views.
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
    let map_size = super::DirectLight::from_settings(settings)?.shadow_map_size;
    let (layers, far) = (&facts.shadow_layers, &facts.far_shadow_layers);
    if layers.is_empty() {
        return Ok(None);
    }
    let count = layers.len() + far.len();
    let lights = facts.needs.lights;
    let atlas = ShadowAtlas::of_lights(count as u32, map_size, lights)?;
    plan.notes.extend(atlas.note(map_size));
    let reason = counted(count, "shadow map");
    let maps = plan.texture_array("shadow_maps", [atlas.layer_size(); 2], atlas.layers(), Gpu::DEPTH_FORMAT, reason);
    let entries = shadow_entries(plan, layers, far, map_size);
    let draw = |plan: &mut FramePlan, layer: usize, name: String, view: ResourceId, reason: &str| {
        let textures = scene.texels.filter(|_| facts.needs.alpha_tested);
        let materials = scene.materials;
        let run = ShadowMap {
            shadow_view: view,
            vertices: scene.vertices,
            alpha_tested: textures.map(|texels| shadow_map::AlphaTested { materials, texels }),
            animated: scene.objects,
            triangles: None,
        };
        let opaque = shadow_map::Features { alpha_tested: false, ..run.features() }.shader();
        let drawn = triangles::by_alpha(facts.needs.alpha_tested, opaque);
        let pass = plan.pass(Part::Direct, name, run).because(reason);
        match atlas.place(layer as u32) {
            (layer, None) => pass.draw(drawn, Vec::new(), (maps, layer)),
            (layer, Some(tile)) => pass.draw_tile(drawn, (maps, layer), tile),
        }
    };
    for (index, layer) in layers.iter().enumerate() {
        let view = shadow_view(plan, index, layer);
        draw(plan, index, format!("shadow_{index}"), view, "a light casts shadows");
    }
    for (index, layer) in far.iter().enumerate() {
        let view = far_shadow_view(plan, index, layer);
        let reason = format!(
            "shadows far from what is looked at, in a coarser map{}",
            if facts.extent.is_covered() { "" } else { "; surfaces even farther out are lit" },
        );
        draw(plan, layers.len() + index, format!("far_shadow_{index}"), view, &reason);
    }
    Ok(Some(Shadows { maps, entries }))
}
