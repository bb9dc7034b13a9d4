//! Hierarchical screen-space indirect illumination (Soler et al. 2009): a pyramid of surfels, one gather per level, and
//! a joint bilateral filter that combines the levels. Visibility through a froxel grid and further bounces are those of
//! Soler & Hoel 2010.

mod bounces;
mod gather;
mod lights;
mod views;
mod visibility;

use self::gather::{Gather, Light};

use halflight_renderer::gi::{GBufferNeeds, Inputs, LightSources, Reach, Technique};

use halflight_frame_graph::{FramePlan, ResourceId};
use halflight_renderer::{
    choice,
    gi::{
        Sources, StartResolution, Storage, Switch, UpsamplingKernel,
        resolution::{Upsampling, pyramid, to_display},
        sky_light::{SkyGather, with_sky},
        temporal::{temporal_filter, temporal_filter_of_gloss},
    },
    parameters,
    parameters::{Settings, SettingsError},
};

choice! {
    /// Form factor between receiver and source.
    pub enum FormFactor {
        /// Point to differential area (Equation 3): unbounded where surfaces meet.
        PointToPoint = "eq3",
        /// Point to disc (Equation 4): bounded.
        PointToDisc = "eq4",
    }
}

choice! {
    /// The area of the disc in the form factor.
    pub enum DiscArea {
        /// The whole area that a sample stands for, as published: bounded, and darker with fewer samples.
        Sample = "sample",
        /// One texel of the level, multiplied by the number of texels per sample: the mean does not depend on the
        /// number of samples.
        Texel = "texel",
    }
}

choice! {
    /// The child that a texel of the pyramid keeps.
    pub enum PyramidFilter {
        /// The nearest one (2009).
        Nearest = "nearest",
        /// The one that most of its neighbours support (2010, Equation 5).
        Vote = "vote",
    }
}

choice! {
    /// Radii of the ring of a level.
    pub enum Ring {
        /// From r to 2 r (2009).
        Outer = "2009",
        /// From r / 2 to r (2010).
        Inner = "2010",
    }
}

choice! {
    /// Levels that gather. Single levels show what each one contributes (2009, Figure 4).
    pub enum OnlyLevel {
        /// All levels.
        All = "all",
        /// Level 0 alone.
        L0 = "0",
        /// Level 1 alone.
        L1 = "1",
        /// Level 2 alone.
        L2 = "2",
        /// Level 3 alone.
        L3 = "3",
        /// Level 4 alone.
        L4 = "4",
        /// Level 5 alone.
        L5 = "5",
        /// Level 6 alone.
        L6 = "6",
        /// Level 7 alone.
        L7 = "7",
    }
}

choice! {
    /// Voxelization of the scene for occluders between a surface and its source (2010).
    pub enum Visibility {
        /// None: all surfaces are visible to each other.
        Off = "off",
        /// Every mesh is the boundary of a solid.
        Solid = "solid",
        /// Every mesh is a set of surfaces.
        Surface = "surface",
        /// Watertight meshes are solid, the others are surfaces.
        Auto = "auto",
    }
}

choice! {
    /// Reduction of four columns of the froxel grid to one of the next level.
    pub enum VisibilityDownsampling {
        /// A slice is set if all four have it (2010). Thin occluders are lost.
        And = "and",
        /// A slice is set if any has it. Occluders grow.
        Or = "or",
    }
}

choice! {
    /// Bounces with a visibility test.
    pub enum VisibilityBounces {
        /// All bounces.
        All = "all",
        /// The first bounce only.
        First = "first",
    }
}

choice! {
    /// Visibility test of light from reflective shadow maps.
    pub enum LightVisibility {
        /// None: all surfaces are visible to each other.
        Off = "off",
        /// A voxel grid over what is looked at.
        Voxels = "cubes",
    }
}

choice! {
    /// Sampling density of glossy light.
    pub enum GlossyImportance {
        /// Uniform.
        Off = "off",
        /// Denser in the screen directions of the mirror lobe, by alpha + exp(-s t^2 / (2 pi)) (2010).
        Paper = "2010",
        /// In the directions of the mirror lobe, up to its vanishing point and the screen edge.
        Lobe = "lobe",
    }
}

parameters! {
    /// Parameters of the hierarchical gather.
    pub struct Hierarchical("hierarchical") {
        /// Resolution of level 0. The cost of the gather is proportional to the number of pixels; coarse resolutions
        /// lose detail of nearby light.
        start_resolution: StartResolution = StartResolution::Quarter, unit "",
        grid [StartResolution::Half, StartResolution::Quarter], role Plan;
        /// Number of levels, each of half the resolution of the previous one. More levels reach farther at almost no
        /// cost.
        levels: u32 = 4, in 1..=8, unit "1", grid [4, 5], role Plan;
        /// Samples per texel and level. Noise decreases with the square root, cost is proportional.
        samples: u32 = 64, in 1..=1024, unit "1", grid [16, 64, 256], role Override;
        /// Radius r of the ring, in texels of the level; 0 for the smallest radius that covers the screen.
        radius: f32 = 0.0, in 0.0..=16384.0, unit "texels", grid [0.0, 20.0, 40.0], role Uniform;
        /// Radii of the ring: 2009 from r to 2 r, 2010 from r / 2 to r. Level 0 samples the whole disc.
        ring: Ring = Ring::Inner, unit "", grid [Ring::Inner, Ring::Outer], role Uniform;
        /// Form factor: eq3 between points, unbounded; eq4 from point to disc.
        form_factor: FormFactor = FormFactor::PointToDisc, unit "",
        grid [FormFactor::PointToPoint, FormFactor::PointToDisc], role Override;
        /// Disc of the form factor: sample, as published, is bounded but loses light with few samples; texel keeps the
        /// mean at several times the noise.
        disc_area: DiscArea = DiscArea::Sample, unit "", grid [DiscArea::Sample, DiscArea::Texel], role Uniform;
        /// Child that a texel of the pyramid keeps: nearest (2009) or by vote (2010).
        pyramid_filter: PyramidFilter = PyramidFilter::Nearest, unit "",
        grid [PyramidFilter::Nearest, PyramidFilter::Vote], role Override;
        /// Upsampling kernel from a level to the next finer one and to the display.
        upsampling_kernel: UpsamplingKernel = UpsamplingKernel::Spline, unit "",
        grid [UpsamplingKernel::Spline], role Override;
        /// Storage of the indirect and final image. float16 has half the bytes and clamps at 65,504.
        storage: Storage = Storage::Float16, unit "", grid [Storage::Float16, Storage::Float32], role Plan;
        /// Share a of the history in the filtered light: F = a F_before + (1 - a) I; 0 is off. Half of an old image is
        /// gone after ln 2 / -ln a frames; for glossy light sooner, the narrower its lobe.
        temporal_a: f32 = 0.0, in 0.0..=0.999, unit "1", grid [0.0, 0.9], role Plan;
        /// Whether the scene's extra cameras gather too. Each pixel keeps the largest result.
        extra_cameras: Switch = Switch::On, unit "", grid [Switch::Off, Switch::On], role Plan;
        /// Gather one level only and leave the others black.
        only_level: OnlyLevel = OnlyLevel::All, unit "", grid [OnlyLevel::All], role Plan;
        /// Bounces of indirect light. Each bounce gathers what the previous one reflected.
        bounces: u32 = 1, in 0..=8, unit "1", grid [1, 2], role Plan;
        /// Whether two bounces alternate between frames, at the cost of one. Only used if bounces is 2.
        bounce_interleaving: Switch = Switch::Off, unit "", grid [Switch::Off, Switch::On], role Plan;
        /// Occluders between a surface and its source: off, none; solid, surface or auto, a froxel grid of every mesh
        /// as solid, as surfaces, or by the type of each mesh.
        visibility: Visibility = Visibility::Off, unit "", grid [Visibility::Off, Visibility::Auto], role Plan;
        /// Reduction of froxels to a coarser level: and, as published, loses thin occluders; or lets them grow.
        visibility_downsampling: VisibilityDownsampling = VisibilityDownsampling::Or, unit "",
        grid [VisibilityDownsampling::And, VisibilityDownsampling::Or], role Override;
        /// Bounces with a visibility test: all, or only the first one. Interleaved bounces are both tested.
        visibility_bounces: VisibilityBounces = VisibilityBounces::All, unit "",
        grid [VisibilityBounces::All, VisibilityBounces::First], role Plan;
        /// Successive samples that share one visibility ray. The mean is unchanged, the noise of visibility grows, and
        /// its cost decreases. 1 as published.
        samples_per_ray: u32 = 16, in 1..=64, unit "1", grid [1, 4, 16], role Override;
        /// Glossy reflection (Ks, Ns) towards the eye. Its sources are diffuse and directly lit.
        glossy: Switch = Switch::Off, unit "", grid [Switch::Off, Switch::On], role Plan;
        /// Sampling density of glossy light: off, uniform; 2010, denser in the mirror lobe's screen directions, as
        /// published; lobe, in its directions and reach.
        glossy_importance: GlossyImportance = GlossyImportance::Lobe, unit "",
        grid [GlossyImportance::Off, GlossyImportance::Paper, GlossyImportance::Lobe], role Override;
        /// Source of first-bounce light: screen; lights, reflective shadow maps; both, the screen within `border` and
        /// reflective shadow maps beyond it. With lights or both, bounces are not interleaved and extra cameras add
        /// nothing.
        sources: Sources = Sources::Screen, unit "", grid [Sources::Screen, Sources::Lights, Sources::Both], role Plan;
        /// Near-field distance: light comes from the screen within it if sources is both; 0 for a thirtieth of the
        /// diagonal of what is looked at.
        border: f32 = 0.0, in 0.0..=1e9, unit "scene units", grid [0.0], role Plan;
        /// Width and height of each reflective shadow map, rounded up to a multiple of its coarsest texel.
        light_view_size: u32 = 128, in 8..=512, unit "px", grid [64, 128, 256], role Plan;
        /// Visibility test of light from reflective shadow maps: off, none; cubes, a voxel grid over what is looked at.
        light_visibility: LightVisibility = LightVisibility::Voxels, unit "",
        grid [LightVisibility::Off, LightVisibility::Voxels], role Plan;
        /// Voxels along the longest side of the scene.
        voxel_resolution: u32 = 256, in 8..=960, unit "1", grid [128, 256, 512], role Plan;
        /// Rays to the sky, tested for occluders in a voxel grid over the whole scene; 0 leaves the sky out.
        sky_rays: u32 = 8, in 0..=1024, unit "1", grid [0, 4, 8, 32], role Plan;
    }
}

/// The technique. See the module.
pub const TECHNIQUE: Technique = Technique {
    name: Hierarchical::TECHNIQUE,
    title: "Hierarchical gathering",
    summary: "hierarchical screen-space indirect illumination (Soler et al. 2009)",
    parameters: Hierarchical::parameters,
    main: &["samples", "levels", "start_resolution", "bounces", "visibility"],
    complete: |settings| Ok(Hierarchical::from_settings(settings)?.to_settings()),
    needs: |settings| {
        let parameters = Hierarchical::from_settings(settings)?;
        Ok(GBufferNeeds {
            glossy_material: parameters.glossy == Switch::On,
            translucent_material: false,
            extra_cameras: parameters.extra_cameras == Switch::On
                && parameters.bounces > 0
                && parameters.sources == Sources::Screen,
        })
    },
    sources: |settings| {
        let parameters = Hierarchical::from_settings(settings)?;
        if parameters.bounces == 0 {
            return Ok(LightSources::NONE);
        }
        let reach = if parameters.sources == Sources::Screen { Reach::Screen } else { Reach::Scene };
        let sky = if parameters.sky_rays > 0 { Reach::Scene } else { Reach::Nowhere };
        Ok(LightSources { lamps: reach, emitters: reach, sky })
    },
    plan: |plan, inputs, settings| {
        let light = self::plan(plan, inputs, settings)?;
        let light = views::keep_the_most(plan, inputs, light, |plan, inputs| self::plan(plan, inputs, settings))?;
        Ok(temporal_filter(plan, inputs, light, Hierarchical::from_settings(settings)?.temporal_a))
    },
};

/// Inner and outer radius of the ring of a level, in its texels.
pub fn ring_radii(ring: Ring, radius: f32, level: u32) -> [f32; 2] {
    let [inner, outer] = match ring {
        Ring::Inner => [0.5 * radius, radius],
        Ring::Outer => [radius, 2.0 * radius],
    };
    if level == 0 { [0.0, outer] } else { [inner, outer] }
}

/// Smallest radius of a ring that contains more than the receiver's own texel, texels. With smaller radii, many levels
/// on a small image would see only themselves.
const LEAST_OUTER_RADIUS: f32 = 2.0;

/// The smallest radius whose rings cover the screen from any pixel and reach beyond the receiver's own texel. The
/// outermost ring reaches as far as the diagonal of level 0.
pub fn covering_radius(ring: Ring, levels: u32, size: [u32; 2]) -> f32 {
    let diagonal = (size[0] as f32).hypot(size[1] as f32);
    let outermost = (diagonal / (1u32 << (levels - 1)) as f32).max(LEAST_OUTER_RADIUS);
    match ring {
        Ring::Inner => outermost,
        Ring::Outer => 0.5 * outermost,
    }
}

/// Upsampling of the levels.
fn upsampling(parameters: &Hierarchical) -> Upsampling {
    Upsampling { kernel: parameters.upsampling_kernel, storage: parameters.storage }
}

/// Materials of the pixels, if glossy light is gathered.
fn glossy_material(inputs: &Inputs, parameters: &Hierarchical) -> Option<ResourceId> {
    inputs.material.filter(|_| parameters.glossy == Switch::On)
}

fn plan(plan: &mut FramePlan, inputs: &Inputs, settings: &Settings) -> Result<Option<ResourceId>, SettingsError> {
    let parameters = Hierarchical::from_settings(settings)?;
    let only = match parameters.only_level {
        OnlyLevel::All => None,
        level => Some(level as u32 - 1),
    };
    if let Some(level) = only.filter(|&level| level >= parameters.levels) {
        let message =
            format!("hierarchical.only_level = {level} does not exist: there are {} levels, from 0", parameters.levels);
        return Err(SettingsError(message));
    }
    if parameters.bounces == 0 {
        return Ok(None);
    }
    let lit = inputs.may_be_lit();
    let has_sky = parameters.sky_rays > 0 && inputs.scene.is_some_and(|scene| scene.needs.environment);
    let sources = match parameters.sources {
        Sources::Lights if !lit && !has_sky => return Ok(None),
        sources => sources,
    };
    let screen_gathers =
        sources != Sources::Lights || parameters.bounces > 1 || glossy_material(inputs, &parameters).is_some();
    // Levels coarser than the only requested one contribute nothing.
    let last = if screen_gathers { only.unwrap_or(parameters.levels - 1) } else { 0 };
    let vote = parameters.pyramid_filter == PyramidFilter::Vote;
    let levels = pyramid(plan, inputs, vote, parameters.start_resolution.divisor(), last);
    let tested = sources != Sources::Lights
        || parameters.bounces > 1 && parameters.visibility_bounces == VisibilityBounces::All
        || glossy_material(inputs, &parameters).is_some();
    let froxels = if tested { visibility::plan_froxels(plan, inputs, &parameters, &levels)? } else { None };
    let near_field_distance = match sources {
        Sources::Both => Some(inputs.length_or_share(parameters.border, "hierarchical.border")?),
        Sources::Screen | Sources::Lights => None,
    };
    let gather = Gather {
        parameters: &parameters,
        levels: &levels,
        only,
        froxels: froxels.as_ref(),
        material: None,
        near_field_distance,
    };
    let surfels: Vec<_> = levels.iter().map(|level| level.surfels).collect();
    // After the lights, whose voxel grid it shares.
    let gather_sky = |plan: &mut FramePlan| {
        let gather = SkyGather { rays: parameters.sky_rays, over_frames: parameters.temporal_a > 0.0 };
        if only.is_none_or(|only| only == 0) { gather.plan(plan, inputs, &levels[0]) } else { None }
    };
    let interleaved = parameters.bounces == 2 && parameters.bounce_interleaving == Switch::On;
    let light = if interleaved && sources == Sources::Screen {
        let light = bounces::plan_interleaved(plan, inputs, &gather);
        let sky = gather_sky(plan);
        with_sky(plan, levels[0].size, light, sky)
    } else {
        let first = match sources {
            Sources::Lights => None,
            Sources::Screen | Sources::Both => gather.light(plan, Light::Bounce(1), &surfels),
        };
        let first = match sources {
            Sources::Screen => first,
            Sources::Lights | Sources::Both => {
                let near = first.zip(near_field_distance);
                lights::plan_light_from_lights(plan, inputs, &parameters, &levels[0], only, near)?
            }
        };
        let sky = gather_sky(plan);
        let first = with_sky(plan, levels[0].size, first, sky);
        first.map(|first| bounces::plan_bounces(plan, inputs, &gather, first))
    };
    let Some(light) = light else { return Ok(None) };
    if let Some(material) = glossy_material(inputs, &parameters) {
        let gather = Gather { material: Some(material), ..gather };
        if let Some(light) = gather.light(plan, Light::Glossy, &surfels) {
            let glossy = to_display(plan, inputs, &upsampling(&parameters), &levels[0], light, "glossy");
            let glossy = temporal_filter_of_gloss(plan, inputs, glossy, parameters.temporal_a, material);
            plan.outputs.insert("glossy", glossy);
        }
    }
    Ok(Some(to_display(plan, inputs, &upsampling(&parameters), &levels[0], light, "indirect")))
}
