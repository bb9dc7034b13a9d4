//! Reflective shadow maps (Dachsbacher & Stamminger 2005) of all lights, and virtual point lights chosen from them.

use wgpu::TextureFormat as Format;

use crate::{
    gi::{
        Inputs,
        emitters::{EmitterPoints, plan_emitter_points},
        resolution::Level,
    },
    parameters::SettingsError,
    scene::{SceneFacts, ShadowLayer, light_of, light_projections, shadow_view, triangles},
};
use halflight_frame_graph::{FramePlan, Gpu, Part, ResourceId, bytes_in_words};
use halflight_shared_shaders::{
    reflective_shadow_maps::{
        choose::{self, Choose},
        collect::{self, Collect},
        emitters,
        lit_surfaces::{self, LitSurfaces},
        pyramid::{self, Pyramid},
    },
    shadow::shadow_map::{self, ShadowMap},
};

/// Virtual point lights that stand for all lit surfaces.
pub struct VirtualPointLights {
    /// `array<LightSurface>` of `reflective_shadow_maps/light_surface.wgsl`, view space.
    pub lights: ResourceId,
    /// Number of virtual point lights.
    pub count: u32,
}

/// A pyramid over the reflective shadow maps of all lights.
pub struct LightPyramid {
    /// Two `vec4u` per texel, in the layout of `reflective_shadow_maps/light_pyramid.wgsl`.
    pub texels: ResourceId,
    /// World to clip space of each map, in the order of [`Inputs::shadow_layers`].
    pub projections: ResourceId,
    /// Number of maps.
    pub views: u32,
}

/// A reflective shadow map.
#[derive(Clone, Copy)]
pub struct ReflectiveShadowMap {
    /// World position of each texel's surface.
    pub position: ResourceId,
    /// Area, normal and reflected radiance of that surface.
    pub light: ResourceId,
}

/// Bytes of a texel of a map.
const MAP_TEXEL: u64 = 32;

/// Bytes that the maps of all views may take together. 128 maps of 256 texels a side fit, the default of `rsm`: those of 21
/// point lights.
const MAPS_BUDGET: u64 = 1 << 28;

/// The maps of all views. Each has textures of its own, so that a map is drawn again only if its own light changes. If they
/// do not fit the budget, all views share one map: each is drawn after the passes that read the one before it, in every
/// frame in which any of them is read.
struct Maps {
    maps: Vec<ReflectiveShadowMap>,
}

impl Maps {
    fn new(plan: &mut FramePlan, size: u32, views: usize) -> Self {
        let needed = views as u64 * MAP_TEXEL * u64::from(size).pow(2);
        let own = needed <= MAPS_BUDGET;
        let shared = format!(
            "; all {views} views share it, because their own would take {}, more than {}: every view is drawn again in \
             every frame",
            bytes_in_words(needed),
            bytes_in_words(MAPS_BUDGET)
        );
        let maps = (0..if own { views } else { 1 }).map(|index| {
            let mut map = |name: &str, format, reason: &str| {
                let name = if own { format!("{name}_{index}") } else { name.to_owned() };
                let more = if own { "" } else { &shared };
                plan.texture(name, [size; 2], format, format!("{reason}{more}"))
            };
            ReflectiveShadowMap {
                position: map("light_view_place", Format::Rgba32Float, "world positions of a reflective shadow map"),
                light: map("light_view_light", Format::Rgba32Uint, "light that the map's surfaces reflect"),
            }
        });
        Self { maps: maps.collect() }
    }

    /// The map of a view.
    fn of(&self, view: usize) -> ReflectiveShadowMap {
        self.maps[view % self.maps.len()]
    }
}

/// Work of a lit surface: three corners, a material and its texture.
const LIT_SURFACE: u64 = 16;

/// Where the surfaces of a view are written.
enum Target {
    Map(ReflectiveShadowMap),
    /// The finest level of a [`LightPyramid`].
    Pyramid(ResourceId),
}

/// What all views are drawn with, one after another.
struct ViewDrawing {
    triangles: ResourceId,
    depth: ResourceId,
    size: u32,
}

/// The scene; an error if only textures are available.
fn scene_of<'a>(inputs: &Inputs<'a>, technique: &str) -> Result<&'a SceneFacts, SettingsError> {
    inputs.scene.ok_or_else(|| {
        SettingsError(format!(
            "{technique} draws reflective shadow maps, and only textures were given: plan with the facts of a scene"
        ))
    })
}

impl ViewDrawing {
    /// Plans the textures, `size` texels wide and high.
    fn new(plan: &mut FramePlan, size: u32) -> Self {
        let mut map = |name: &str, format, reason: &str| plan.texture(name, [size; 2], format, reason);
        Self {
            triangles: map("light_view_triangles", Format::R32Uint, "visible triangles of a reflective shadow map"),
            depth: map("light_view_depth_test", Gpu::DEPTH_FORMAT, "depth test"),
            size,
        }
    }

    /// Plans the map of one view: the visible triangle of each texel, then the light that its surface reflects.
    fn draw(
        &self,
        plan: &mut FramePlan,
        scene: &SceneFacts,
        inputs: &Inputs,
        (index, view): (usize, &ShadowLayer),
        target: &Target,
    ) {
        let receive_only = inputs.receive_only.map(|surfaces| surfaces.flags);
        let depth = inputs.depth;
        let vertices = plan.scene_buffer("scene.vertices", "the scene's geometry");
        let indices = plan.scene_buffer("scene.indices", "the scene's indices");
        let corners = plan.scene_buffer("scene.corners", "numbers of the scene's triangles");
        let materials = plan.scene_buffer("scene.materials", "the scene's materials");
        let texels = (scene.needs.textured || scene.needs.alpha_tested)
            .then(|| plan.scene_buffer("scene.texels", "materials with textures"));
        let objects = scene.animated().then(|| plan.changing_scene_buffer("scene.objects", "objects are animated"));
        let shadow_view = shadow_view(plan, index, view);
        let run = ShadowMap {
            shadow_view,
            vertices,
            alpha_tested: texels
                .filter(|_| scene.needs.alpha_tested)
                .map(|texels| shadow_map::AlphaTested { materials, texels }),
            animated: objects,
            triangles: Some(corners),
        };
        let opaque = shadow_map::Features { alpha_tested: false, ..run.features() }.shader();
        let is_part = scene.far_shadow_layers.iter().any(|far| far.light == view.light);
        let left_out = if is_part { "; without surfaces far from what is looked at" } else { "" };
        plan.pass(Part::Technique, format!("light_view_{index}"), run)
            .because(format!("visible triangles of a reflective shadow map{left_out}"))
            .draw(
                triangles::numbered_by_alpha(scene.needs.alpha_tested, opaque),
                vec![self.triangles],
                (self.depth, 0),
            );
        let (map, pyramid) = match *target {
            Target::Map(map) => (Some(map), None),
            Target::Pyramid(texels) => (None, Some(texels)),
        };
        let run = LitSurfaces {
            shadow_view,
            vertices,
            indices,
            materials,
            source: light_of(plan, view),
            triangles: self.triangles,
            rsm_position: map.map(|map| map.position),
            light: map.map(|map| map.light),
            textured: texels.filter(|_| scene.needs.textured),
            animated: objects,
            receive_only,
            seen: scene.only_seen_surfaces_send.then_some(depth),
            kept: pyramid,
        };
        let pass = plan
            .pass(Part::Technique, format!("lit_surfaces_{index}"), run)
            .because("lit surfaces reflect light")
            .costs(LIT_SURFACE);
        let pass = if let Some(pyramid) = pyramid { pass.into_part(pyramid, index as u32) } else { pass };
        pass.over([self.size; 2]);
    }
}

/// Plans maps of `size` texels a side for every light. `use_map` adds the passes that read a map after it is drawn.
/// Plans nothing in a scene without lights.
///
/// # Errors
/// If only textures are available, without a scene and its lights.
pub fn plan_reflective_shadow_maps(
    plan: &mut FramePlan,
    inputs: &Inputs,
    technique: &str,
    size: u32,
    mut use_map: impl FnMut(&mut FramePlan, &ReflectiveShadowMap, usize, &ShadowLayer),
) -> Result<(), SettingsError> {
    let scene = scene_of(inputs, technique)?;
    let views = inputs.shadow_layers();
    if views.is_empty() {
        return Ok(());
    }
    let (maps, drawing) = (Maps::new(plan, size, views.len()), ViewDrawing::new(plan, size));
    for (index, view) in views.iter().enumerate() {
        let map = maps.of(index);
        drawing.draw(plan, scene, inputs, (index, view), &Target::Map(map));
        use_map(plan, &map, index, view);
    }
    Ok(())
}

/// Whether the plan draws reflective shadow maps.
pub fn has_reflective_shadow_maps(plan: &FramePlan) -> bool {
    let shaders = [lit_surfaces::FILE, emitters::FILE];
    plan.passes.iter().any(|pass| shaders.contains(&pass.shader.file()))
}

/// Largest storage buffer binding that every device supports: WebGPU's default.
const LARGEST_BUFFER: u64 = 1 << 27;

/// Number of points on all emitters: as many as a map has texels that matter.
const EMITTER_POINTS: u32 = 1024;

/// Receivers that estimate the importance of a surface: the square of `RECEIVERS` in reflective_shadow_maps/importance.wgsl.
const RECEIVERS: u64 = 64;

/// Bytes of a surface in each buffer of all surfaces, and of a virtual point light.
const ENTRY: u64 = 16;
const VIRTUAL_POINT_LIGHT: u64 = 48;

/// An error if `views` maps of `size` texels a side have more than `most` texels in total.
fn refuse_too_large(technique: &str, size: u32, views: u64, most: u64) -> Result<(), SettingsError> {
    if views * u64::from(size) * u64::from(size) <= most {
        return Ok(());
    }
    Err(SettingsError(format!(
        "{technique}.light_view_size = {size} is too much for the {views} views of this scene's lights (a point light has \
         six): choose at most {}",
        ((most / views.max(1)) as f64).sqrt() as u32
    )))
}

/// Bytes of a texel of the pyramid.
const TEXEL: u64 = 32;

/// Plans a pyramid of `levels` levels over maps of `size` texels a side, a multiple of the coarsest texel; `None` in a
/// scene without lights.
///
/// # Errors
/// If only textures are available, without a scene and its lights, or if the maps do not fit a buffer.
pub fn plan_light_pyramid(
    plan: &mut FramePlan,
    inputs: &Inputs,
    technique: &str,
    size: u32,
    levels: u32,
) -> Result<Option<LightPyramid>, SettingsError> {
    let scene = scene_of(inputs, technique)?;
    let layers = inputs.shadow_layers();
    if layers.is_empty() {
        return Ok(None);
    }
    let views = layers.len() as u32;
    // The coarser levels have at most a third as many texels as the finest one.
    refuse_too_large(technique, size, u64::from(views), LARGEST_BUFFER / TEXEL * 3 / 4)?;
    let count: u64 = (0..levels).map(|level| u64::from(views) * u64::from(size >> level).pow(2)).sum();
    let texels = plan.buffer("light_pyramid", count * TEXEL, "lit surfaces at several scales");
    let projections = light_projections(plan, layers);
    let drawing = ViewDrawing::new(plan, size);
    for view in layers.iter().enumerate() {
        drawing.draw(plan, scene, inputs, view, &Target::Pyramid(texels));
    }
    for level in 1..levels {
        let params = pyramid::Params { size, views, level };
        plan.pass(Part::Technique, format!("light_pyramid_{level}"), Pyramid { light_pyramid: texels, params })
            .because("far light is gathered in coarser texels")
            .after_parts(texels, views + level)
            .over([size >> level, (size >> level) * views]);
    }
    Ok(Some(LightPyramid { texels, projections, views }))
}

/// Plans maps of `size` texels a side for every light and chooses `count` virtual point lights from them by their
/// contribution to `receivers`; `None` in a scene without lights and emitters. `use_map` adds other passes that read a
/// map.
///
/// # Errors
/// If only textures are available, without a scene and its lights.
pub fn plan_virtual_point_lights(
    plan: &mut FramePlan,
    inputs: &Inputs,
    technique: &str,
    size: u32,
    count: u32,
    receivers: &Level,
    mut use_map: impl FnMut(&mut FramePlan, &ReflectiveShadowMap, usize, &ShadowLayer),
) -> Result<Option<VirtualPointLights>, SettingsError> {
    let scene = scene_of(inputs, technique)?;
    let layers = inputs.shadow_layers();
    if layers.is_empty() && scene.emitters.is_empty() {
        return Ok(None);
    }
    let texels = size * size;
    let views = layers.len() as u64;
    let points = if scene.emitters.is_empty() { 0 } else { EMITTER_POINTS };
    refuse_too_large(technique, size, views, LARGEST_BUFFER / ENTRY - 2 * u64::from(EMITTER_POINTS))?;
    let of_views = texels * views as u32;
    let surfaces = of_views + 2 * points;
    let mut buffer =
        |name: &str, entries: u32, bytes: u64, reason: &str| plan.buffer(name, u64::from(entries) * bytes, reason);
    let positions = buffer("lit_places", surfaces, ENTRY, "positions of the lit surfaces");
    let lights = buffer("lit_radiance", surfaces, ENTRY, "light that the lit surfaces reflect");
    let importances = buffer("importances", surfaces, 4, "importance of each lit surface");
    let chosen = VirtualPointLights {
        lights: buffer("virtual_lights", count, VIRTUAL_POINT_LIGHT, "virtual point lights"),
        count,
    };
    plan_reflective_shadow_maps(plan, inputs, technique, size, |plan, maps, index, view| {
        let params = collect::Params { first: texels * index as u32, scale: receivers.scale as f32 };
        let &ReflectiveShadowMap { position, light, .. } = maps;
        let run = Collect {
            rsm_position: position,
            light,
            positions,
            lights,
            surfels: receivers.surfels,
            importances,
            params,
        };
        plan.pass(Part::Technique, format!("collect_{index}"), run)
            .because("importance of each lit surface for the camera's view")
            .costs(RECEIVERS)
            .over([size; 2]);
        use_map(plan, maps, index, view);
    })?;
    if points > 0 {
        let to = EmitterPoints { positions, lights, first: of_views, points };
        plan_emitter_points(plan, scene, &to, Some((importances, receivers)));
    }
    let params = choose::Params { surfaces, chosen: count };
    plan.pass(
        Part::Technique,
        "choose",
        Choose { importances, positions, lights, virtual_point_lights: chosen.lights, params },
    )
    .because(format!("{count} virtual point lights stand for all lit surfaces"))
    .over([1, 1]);
    Ok(Some(chosen))
}
