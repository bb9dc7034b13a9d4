//! Screen space and light space together (Lambru et al.): near light comes from the screen, far light from reflective
//! shadow maps. Specular reflections and ambient visibility use both.

mod ambient_visibility;
mod patterns;
mod specular;

use wgpu::TextureFormat as Format;

use self::{
    ambient_visibility::{AmbientVisibility, attenuated},
    patterns::Patterns,
    specular::Specular,
};
use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_renderer::gi::{GBufferNeeds, Inputs, LightSources, Reach, Technique};
use halflight_renderer::{
    choice,
    gi::{
        Sources, StartResolution, Storage, Switch, UpsamplingKernel,
        resolution::{Level, Upsampling, pyramid, to_display},
        rsm::{ReflectiveShadowMap, VirtualPointLights, plan_reflective_shadow_maps, plan_virtual_point_lights},
        scene_voxels::{SceneVoxels, plan_scene_voxels},
        sky_light::{SkyGather, with_sky},
        temporal::{temporal_filter, temporal_filter_of_gloss},
        translucency::Translucency,
    },
    parameters,
    parameters::{Settings, SettingsError},
    scene::ShadowLayer,
};
use halflight_shared_shaders::hybrid::gather;

choice! {
    /// Sampling and weighting.
    pub enum Weighting {
        /// Absolute units: near samples by their screen area, far light from virtual point lights chosen by their
        /// contribution.
        Radiometric = "radiometric",
        /// Absolute units by the paper's patterns: each sample by the area of its share of the pattern.
        Pattern = "pattern",
        /// Patterns and weights as published: a mean without units, scaled by one intensity.
        Published = "published",
    }
}

choice! {
    /// Views that are used.
    pub enum Views {
        /// None.
        Off = "off",
        /// The screen only.
        Screen = "screen",
        /// The screen and the reflective shadow maps.
        Both = "both",
    }
}

parameters! {
    /// Parameters of the hybrid technique.
    pub struct Hybrid("hybrid") {
        /// Domains of light: both, the screen within the radius and reflective shadow maps beyond it; screen or lights
        /// alone.
        sources: Sources = Sources::Both, unit "", grid [Sources::Both, Sources::Screen, Sources::Lights], role Plan;
        /// Samples and weights: radiometric, absolute units, virtual point lights chosen by their contribution;
        /// pattern, absolute units, the paper's patterns; published, patterns and weights as in the paper, without
        /// units.
        weighting: Weighting = Weighting::Radiometric, unit "",
        grid [Weighting::Radiometric, Weighting::Pattern, Weighting::Published], role Plan;
        /// Resolution of the gather. Its cost is proportional to the number of pixels; coarse resolutions lose detail
        /// of nearby light.
        start_resolution: StartResolution = StartResolution::Quarter, unit "",
        grid [StartResolution::Half, StartResolution::Quarter], role Plan;
        /// Smallest weight of coarse texels that show a pixel's surface. Pixels below it are recomputed at full
        /// resolution; 0 interpolates everywhere. Patterns always interpolate.
        recompute_below: f32 = 0.0, in 0.0..=1.0, unit "1", grid [0.0, 0.1, 0.3], role Plan;
        /// Near-field distance: light comes from the screen within it; 0 for a thirtieth of the diagonal of what is
        /// looked at.
        radius: f32 = 0.0, in 0.0..=1e9, unit "scene units", grid [0.0], role Plan;
        /// Radius of the large hemisphere, in which patterns sample reflective shadow maps; 0 for ten times the small
        /// one, as published.
        far_radius: f32 = 0.0, in 0.0..=1e9, unit "scene units", grid [0.0], role Uniform;
        /// Brightness of the published weighting.
        intensity: f32 = 1.0, in 0.0..=1e9, unit "scene units squared", grid [1.0], role Uniform;
        /// Screen samples per receiver.
        screen_samples: u32 = 32, in 1..=1024, unit "1", grid [16, 32, 64], role Override;
        /// Virtual point lights per receiver; for patterns, samples of each map.
        light_samples: u32 = 64, in 1..=1024, unit "1", grid [16, 64, 256], role Plan;
        /// Number of virtual point lights, chosen by their contribution to the image. Receivers share them.
        virtual_lights: u32 = 1024, in 1..=16384, unit "1", grid [256, 1024, 4096], role Plan;
        /// Width and height of each reflective shadow map.
        light_view_size: u32 = 128, in 8..=512, unit "px", grid [64, 128, 256], role Plan;
        /// Whether light from reflective shadow maps is tested for occluders, in a voxel grid over what is looked at.
        visibility: Switch = Switch::On, unit "", grid [Switch::Off, Switch::On], role Plan;
        /// Voxels along the longest side of the scene.
        voxel_resolution: u32 = 256, in 8..=960, unit "1", grid [128, 256, 512], role Plan;
        /// Successive virtual point lights, or samples of a pattern, that share one visibility ray. The mean is
        /// unchanged, the noise of visibility grows, and its cost decreases.
        samples_per_ray: u32 = 8, in 1..=64, unit "1", grid [1, 4, 8], role Override;
        /// Specular reflection of glossy materials (Ks, Ns): off; screen; both, reflective shadow maps where the screen
        /// has no hit.
        specular: Views = Views::Off, unit "", grid [Views::Off, Views::Screen, Views::Both], role Plan;
        /// Largest step of the reflection ray, in pixels of the screen and texels of a reflective shadow map. Smaller
        /// steps find thinner surfaces at a higher cost.
        specular_stride: f32 = 2.0, in 1.0..=64.0, unit "px", grid [1.0, 2.0, 4.0], role Uniform;
        /// Whether reflection rays sample the whole lobe, which leaves noise for the temporal filter. Off, as
        /// published: all glossy materials are mirrors.
        specular_lobe: Switch = Switch::Off, unit "", grid [Switch::Off, Switch::On], role Override;
        /// Ambient visibility that attenuates indirect light: off; screen; both, screen and reflective shadow maps.
        ambient_occlusion: Views = Views::Off, unit "", grid [Views::Off, Views::Screen, Views::Both], role Plan;
        /// Samples of the hemisphere in each view, for ambient visibility.
        occlusion_samples: u32 = 32, in 1..=1024, unit "1", grid [16, 32, 64], role Uniform;
        /// Radius of occluders for ambient visibility; 0 for a thirtieth of the diagonal of what is looked at.
        occlusion_radius: f32 = 0.0, in 0.0..=1e9, unit "scene units", grid [0.0], role Uniform;
        /// Whether light passes through translucent surfaces, by the reflective shadow maps. Requires sources that
        /// include lights.
        translucency: Switch = Switch::On, unit "", grid [Switch::Off, Switch::On], role Plan;
        /// Rays to the sky, tested for occluders in a voxel grid over the whole scene; 0 leaves the sky out.
        sky_rays: u32 = 8, in 0..=1024, unit "1", grid [0, 4, 8, 32], role Plan;
        /// Storage of light at full resolution. float16 has half the bytes and clamps at 65,504.
        storage: Storage = Storage::Float16, unit "", grid [Storage::Float16, Storage::Float32], role Plan;
        /// Share a of the history in the filtered light; 0 is off. Half of an old image is gone after ln 2 / -ln a
        /// frames.
        temporal_a: f32 = 0.0, in 0.0..=0.999, unit "1", grid [0.0, 0.9], role Plan;
    }
}

/// The technique. See the module.
pub const TECHNIQUE: Technique = Technique {
    name: Hybrid::TECHNIQUE,
    title: "Screen and light maps",
    summary: "screen space for nearby light, light space for the rest (Lambru et al.)",
    parameters: Hybrid::parameters,
    main: &["sources", "screen_samples", "light_samples", "virtual_lights", "visibility"],
    complete: |settings| Ok(Hybrid::from_settings(settings)?.to_settings()),
    needs: |settings| {
        let parameters = Hybrid::from_settings(settings)?;
        let glossy_material = parameters.specular != Views::Off;
        let translucent_material = parameters.translucency == Switch::On && parameters.sources != Sources::Screen;
        Ok(GBufferNeeds { glossy_material, translucent_material, ..GBufferNeeds::NONE })
    },
    sources: |settings| {
        let parameters = Hybrid::from_settings(settings)?;
        let reach = if parameters.sources == Sources::Screen { Reach::Screen } else { Reach::Scene };
        // Patterns draw from reflective shadow maps alone, which have no emitters.
        let patterns = parameters.weighting != Weighting::Radiometric;
        let emitters = match parameters.sources {
            Sources::Lights if patterns => Reach::Nowhere,
            _ if patterns => Reach::Screen,
            _ => reach,
        };
        let sky = if parameters.sky_rays > 0 { Reach::Scene } else { Reach::Nowhere };
        Ok(LightSources { lamps: reach, emitters, sky })
    },
    plan,
};

impl Hybrid {
    /// Whether random numbers are stratified over frames, for the temporal filter.
    fn over_frames(&self) -> bool {
        self.temporal_a > 0.0
    }
}

/// Levels between the receivers of the gather and those that estimate importance.
const IMPORTANCE_LEVELS: u32 = 2;

fn plan(plan: &mut FramePlan, inputs: &Inputs, settings: &Settings) -> Result<Option<ResourceId>, SettingsError> {
    let parameters = Hybrid::from_settings(settings)?;
    let near = parameters.sources != Sources::Lights;
    let lit = inputs.may_be_lit();
    let far = parameters.sources != Sources::Screen && lit;
    let sky = parameters.sky_rays > 0 && inputs.scene.is_some_and(|scene| scene.needs.environment);
    if !near && !far && !sky && parameters.ambient_occlusion == Views::Off {
        return Ok(None);
    }
    let chosen = far && parameters.weighting == Weighting::Radiometric;
    let divisor = parameters.start_resolution.divisor();
    let levels = pyramid(plan, inputs, false, divisor, if chosen { IMPORTANCE_LEVELS } else { 0 });
    let (level, coarse) = (&levels[0], &levels[levels.len() - 1]);
    let radius = inputs.nearby(parameters.radius, Hybrid::TECHNIQUE)?;

    // The screen's parts come first, once for all lights.
    let mut patterns = (parameters.weighting != Weighting::Radiometric && (near || far))
        .then(|| Patterns::new(plan, inputs, &parameters, level, radius));
    let mut specular = Specular::new(plan, inputs, &parameters);
    let mut ambient_visibility = AmbientVisibility::new(plan, inputs, &parameters, level)?;
    // Light from reflective shadow maps is tested for occluders wherever it is used. Published weights have no test.
    let mirrors = specular.is_some() && parameters.specular == Views::Both && lit;
    let voxels = inputs.scene.filter(|_| {
        parameters.visibility == Switch::On
            && parameters.weighting != Weighting::Published
            && (chosen || (far || mirrors) && !inputs.shadow_layers().is_empty())
    });
    let voxels = voxels.map(|scene| plan_scene_voxels(plan, scene, parameters.voxel_resolution));
    let mut translucency = Translucency::new(inputs, far && parameters.translucency == Switch::On);

    // Each map is drawn, then read by all passes that use it.
    let asks = |views: Views| views == Views::Both && lit;
    let mut look = |plan: &mut FramePlan, maps: &ReflectiveShadowMap, index: usize, view: &ShadowLayer| {
        if let Some(patterns) = patterns.as_mut().filter(|_| far) {
            patterns.add(plan, maps, index, view, voxels);
        }
        if let Some(specular) = specular.as_mut().filter(|_| mirrors) {
            specular.add(plan, maps, index, view, voxels);
        }
        if let Some(ambient_visibility) = ambient_visibility.as_mut().filter(|_| asks(parameters.ambient_occlusion)) {
            ambient_visibility.add(plan, maps, index, view);
        }
        translucency.add(plan, maps, index, view);
    };
    let size = parameters.light_view_size;
    let mut lights = None;
    if chosen {
        let count = parameters.virtual_lights;
        lights = plan_virtual_point_lights(plan, inputs, Hybrid::TECHNIQUE, size, count, coarse, look)?;
    } else if far || mirrors || asks(parameters.ambient_occlusion) {
        plan_reflective_shadow_maps(plan, inputs, Hybrid::TECHNIQUE, size, &mut look)?;
    }

    translucency.finish(plan);
    let open = ambient_visibility.map(|ambient_visibility| ambient_visibility.finish(plan, inputs));
    if let Some((light, material)) = specular.map(|specular| specular.light()) {
        let light = open.map_or(light, |open| attenuated(plan, light, open, "glossy"));
        let light = temporal_filter_of_gloss(plan, inputs, light, parameters.temporal_a, material);
        plan.outputs.insert("glossy", light);
    }
    let upsampling = Upsampling { kernel: UpsamplingKernel::Spline, storage: parameters.storage };
    let light = match patterns {
        Some(patterns) => patterns.sum().map(|sum| to_display(plan, inputs, &upsampling, level, sum, "indirect")),
        None => Gather::new(&parameters, level, radius, lights, voxels).map(|gather| {
            let gathered = gather.gather(plan);
            let light = to_display(plan, inputs, &upsampling, level, gathered, "indirect");
            gather.recompute(plan, inputs, light)
        }),
    };
    let light = light.map(|light| open.map_or(light, |open| attenuated(plan, light, open, "indirect")));
    // Rays to the sky have their own test for occluders.
    let gather = SkyGather { rays: parameters.sky_rays, over_frames: parameters.over_frames() };
    let sky = gather.plan(plan, inputs, level);
    let sky = sky.map(|sky| to_display(plan, inputs, &upsampling, level, sky, "sky"));
    let light = with_sky(plan, plan.display_size, light, sky);
    Ok(temporal_filter(plan, inputs, light, parameters.temporal_a))
}

/// Near light from the screen and far light from virtual point lights.
struct Gather<'a> {
    parameters: &'a Hybrid,
    level: &'a Level,
    radius: f32,
    lights: Option<VirtualPointLights>,
    voxels: Option<SceneVoxels>,
}

impl<'a> Gather<'a> {
    /// `voxels` is the voxel grid of the visibility rays; `None` if no virtual point light is used.
    fn new(
        parameters: &'a Hybrid,
        level: &'a Level,
        radius: f32,
        lights: Option<VirtualPointLights>,
        voxels: Option<SceneVoxels>,
    ) -> Option<Self> {
        if parameters.sources == Sources::Lights && lights.is_none() {
            return None;
        }
        let voxels = voxels.filter(|_| lights.is_some());
        Some(Self { parameters, level, radius, lights, voxels })
    }

    /// The gather into this texture: at the start resolution, or of single display pixels.
    fn run(
        &self,
        gathered: ResourceId,
        float16: bool,
        recompute: Option<gather::Recompute<ResourceId>>,
    ) -> gather::Gather<ResourceId> {
        let Self { parameters, level, radius, lights, voxels } = self;
        gather::Gather {
            gathered,
            near: parameters.sources != Sources::Lights,
            far: lights.as_ref().map(|lights| lights.lights),
            visibility: voxels.is_some(),
            float16,
            recompute,
            surfels: Some(level.surfels),
            grid: voxels.map(|voxels| voxels.grid),
            voxels: voxels.map(|voxels| voxels.voxels),
            params: gather::Params {
                scale: level.scale as f32,
                radius: *radius,
                virtual_point_lights: lights.as_ref().map_or(0, |lights| lights.count),
                stride: lights.as_ref().map_or(1, |lights| (lights.count / parameters.light_samples).max(1)),
                least_weight: recompute.map(|_| parameters.recompute_below),
            },
            constants: gather::Constants {
                near_samples: parameters.screen_samples,
                samples_per_ray: parameters.samples_per_ray,
                over_frames: parameters.over_frames(),
            },
        }
    }

    /// Work of one receiver: its samples and rays.
    fn cost(&self, plan: &FramePlan) -> u64 {
        let parameters = self.parameters;
        let near = if parameters.sources == Sources::Lights { 0 } else { parameters.screen_samples };
        let far = if self.lights.is_some() { parameters.light_samples } else { 0 };
        let rays = u64::from(far.div_ceil(parameters.samples_per_ray));
        u64::from(near) + u64::from(far) + rays * self.voxels.map_or(0, |voxels| voxels.ray_cost(plan))
    }

    /// Plans the gather at the start resolution.
    fn gather(&self, plan: &mut FramePlan) -> ResourceId {
        let size = self.level.size;
        let gathered = plan.texture("gathered", size, Format::Rgba32Float, "light at the start resolution");
        let cost = self.cost(plan);
        plan.pass(Part::Technique, "gather", self.run(gathered, false, None))
            .because("near light from the screen, far light from virtual point lights")
            .costs(cost)
            .over(size);
        gathered
    }

    /// Plans the gather of those display pixels whose surfaces the coarse texels hardly show. Returns its input if no
    /// pixel is to be recomputed.
    fn recompute(&self, plan: &mut FramePlan, inputs: &Inputs, interpolated: ResourceId) -> ResourceId {
        if self.parameters.recompute_below <= 0.0 || self.level.scale == 1 {
            return interpolated;
        }
        let half = self.parameters.storage == Storage::Float16;
        let format = if half { Format::Rgba16Float } else { Format::Rgba32Float };
        let size = plan.display_size;
        let recomputed = plan.texture("recomputed", size, format, "light with recomputed pixels");
        let of_pixel = gather::Recompute { depth: inputs.depth, normal: inputs.normal, interpolated };
        let cost = self.cost(plan);
        plan.pass(Part::Technique, "recompute", self.run(recomputed, half, Some(of_pixel)))
            .because("recomputes pixels whose surface no coarse texel shows")
            .costs(cost)
            .over(size);
        recomputed
    }
}
