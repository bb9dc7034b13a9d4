//! Inputs of a technique: G-buffer, shadow maps and direct light.

use halflight_frame_graph::{FramePlan, Gpu, Part, ResourceId};
use halflight_shared_shaders::{
    direct::direct_light::{self, DirectLight},
    gbuffer::{self, Gbuffer},
};
use wgpu::TextureFormat as Format;

use super::{DirectSource, SceneFacts};
use crate::{
    gi::{
        Storage, TextureFilter,
        shadow_maps::{ShadowMaps, counted},
    },
    parameters,
    scene::triangles,
};

parameters! {
    /// Parameters of the G-buffer.
    pub struct Surfaces("gbuffer") {
        /// How textures of materials are read. Images and measurements of the evaluator are bilinear, unless this is set; so are
        /// pictures of the viewer on a software adapter.
        texture_filter: TextureFilter = TextureFilter::Mips, unit "",
        grid [TextureFilter::Mips, TextureFilter::Bilinear], role Plan;
    }
}

pub(super) struct SceneResources {
    pub(super) vertices: ResourceId,
    pub(super) materials: ResourceId,
    pub(super) texels: Option<ResourceId>,
    pub(super) objects: Option<ResourceId>,
    /// Storage of direct light.
    pub(super) direct: Storage,
    pub(super) texture_filter: TextureFilter,
}

pub(super) struct GBuffer {
    pub(super) depth: ResourceId,
    pub(super) normal: ResourceId,
    pub(super) albedo: ResourceId,
    pub(super) material: Option<ResourceId>,
    pub(super) object: Option<ResourceId>,
    pub(super) objects: Option<ResourceId>,
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

/// The narrowest format for indices below `count`.
fn index_format(count: u64) -> Format {
    match count {
        0..=0x100 => Format::R8Uint,
        0x101..=0x1_0000 => Format::R16Uint,
        _ => Format::R32Uint,
    }
}

pub(super) fn plan_gbuffer(
    plan: &mut FramePlan,
    facts: &SceneFacts,
    scene: &SceneResources,
    direct: DirectSource,
    follows: bool,
    looked_up: LookedUp,
) -> GBuffer {
    let (size, needs) = (plan.display_size, &facts.needs);
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
        plan.texture("material", size, index_format(facts.size.count("scene.materials")), reasons.join("; "))
    });
    let object = scene.objects.filter(|_| follows).map(|_| {
        // Object 0 is everything that does not move.
        let format = index_format(needs.moving_objects as u64 + 1);
        plan.texture("object", size, format, "objects are animated, and the temporal filter follows them")
    });
    let depth_test = plan.texture("depth_test", size, Gpu::DEPTH_FORMAT, "depth test");
    let run = Gbuffer {
        vertices: scene.vertices,
        materials: scene.materials,
        alpha_tested: needs.alpha_tested,
        textured: needs.textured,
        mips: needs.textured && scene.texture_filter == TextureFilter::Mips,
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
    shadow: Option<ShadowMaps>,
) -> ResourceId {
    let size = plan.display_size;
    let float16 = scene.direct == Storage::Float16;
    let format = if float16 { Format::Rgba16Float } else { Format::Rgba32Float };
    let direct = plan.texture("direct", size, format, "the source of indirect light");
    let needs = &facts.needs;
    let lights = needs.lights;
    let lit = shadow.map(|ShadowMaps { maps, layers }| direct_light::Lit {
        albedo: gbuffer.albedo,
        lights: plan.changing_scene_buffer("scene.lights", "the scene's lights"),
        layers,
        maps,
    });
    let emitters = gbuffer.material.filter(|_| needs.emitters);
    let emitters = emitters.map(|material| direct_light::Emitters { material, materials: scene.materials });
    let constants = direct_light::Constants { lights: lights as u32 };
    let (depth, normal) = (gbuffer.depth, gbuffer.normal);
    plan.pass(Part::Direct, "direct", DirectLight { depth, normal, direct, lit, emitters, float16, constants })
        .because(format!("{}{}", counted(lights, "light"), if needs.emitters { " and emitters" } else { "" }))
        .costs(LIGHT_COST * lights as u64)
        .over(size);
    direct
}
