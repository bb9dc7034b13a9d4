//! Hierarchical screen-space indirect illumination (Soler et al. 2009): a pyramid of surfels, one
//! gather per level, and a joint bilateral filter that brings the levels together. Visibility through a
//! voxel grid and further bounces are those of Soler & Hoel 2010.

mod bounces;
mod gather;
mod lights;
mod views;
mod visibility;

use self::gather::{Gather, Light};

use halflight_renderer::gi::{GBufferNeeds, Inputs, Technique};

use halflight_frame_graph::{FramePlan, ResourceId};
use halflight_renderer::{
    choice,
    gi::{
        Sources, StartResolution, Storage, Switch, UpsamplingKernel,
        resolution::{Upsampling, pyramid, to_display},
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
    /// The disc whose area enters the form factor.
    pub enum DiscArea {
        /// All the area that a sample stands for, as published: bounded, and darker with fewer samples.
        Sample = "sample",
        /// One texel of the level, counted as often as the sample stands for texels: a mean that does not depend on the number of samples.
        Texel = "texel",
    }
}

choice! {
    /// Which child a texel of the pyramid keeps.
    pub enum PyramidFilter {
        /// The one closest to the eye (2009).
        Nearest = "nearest",
        /// The one that most of its neighbours agree with (2010, Equation 5).
        Vote = "vote",
    }
}

choice! {
    /// Radii of the ring that a level samples.
    pub enum Ring {
        /// From r to 2 r (2009).
        Outer = "2009",
        /// From r / 2 to r (2010).
        Inner = "2010",
    }
}

choice! {
    /// Levels that gather; the others are left out, to see what each one contributes (2009, Figure 4).
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
    /// How the scene is voxelised, to find what stands between a surface and its source (2010).
    pub enum Visibility {
        /// Not at all: light passes through everything.
        Off = "off",
        /// Every mesh as the skin of solid matter.
        Solid = "solid",
        /// Every mesh as surfaces.
        Surface = "surface",
        /// Watertight meshes as solid, the others as surfaces.
        Auto = "auto",
    }
}

choice! {
    /// How four columns of the voxel grid become one of the next level.
    pub enum VisibilityDownsampling {
        /// A slice is set where all four have it (2010): thin occluders get lost.
        And = "and",
        /// A slice is set where any has it: occluders grow.
        Or = "or",
    }
}

choice! {
    /// Bounces whose light is tested for visibility.
    pub enum VisibilityBounces {
        /// Every bounce.
        All = "all",
        /// The first one alone.
        First = "first",
    }
}

choice! {
    /// What light from the lights' views is tested by.
    pub enum LightVisibility {
        /// Nothing: light passes through everything.
        Off = "off",
        /// A grid of cubes over the whole scene.
        Voxels = "cubes",
    }
}

choice! {
    /// Where samples of glossy light are drawn.
    pub enum GlossyImportance {
        /// As many everywhere.
        Off = "off",
        /// More in the screen directions of the mirror lobe, by alpha + exp(-s t^2 / (2 pi)) (2010).
        Paper = "2010",
        /// Where the mirror lobe's light comes from: in its directions, up to its vanishing point and the screen's edge.
        Lobe = "lobe",
    }
}

parameters! {
    /// Parameters of the hierarchical gather.
    pub struct Hierarchical("hierarchical") {
        /// Resolution of level 0: the cost of the gather falls with its square, detail of nearby light with it.
        start_resolution: StartResolution = StartResolution::Quarter, unit "",
        grid [StartResolution::Half, StartResolution::Quarter], role Plan;
        /// Number of levels, each half as fine as the one before; more levels reach farther at almost no cost.
        levels: u32 = 4, in 1..=8, unit "1", grid [4, 5], role Plan;
        /// Samples per texel and level: noise falls with its square root, cost rises with it.
        samples: u32 = 64, in 1..=1024, unit "1", grid [16, 64, 256], role Override;
        /// Radius r of the ring, in texels of the current level; 0 takes the smallest that covers the screen.
        radius: f32 = 0.0, in 0.0..=16384.0, unit "texels", grid [0.0, 20.0, 40.0], role Uniform;
        /// Radii of the ring: 2009 from r to 2 r, 2010 from r / 2 to r; level 0 samples the whole disc.
        ring: Ring = Ring::Inner, unit "", grid [Ring::Inner, Ring::Outer], role Uniform;
        /// Form factor: eq3 between points, unbounded; eq4 from point to disc.
        form_factor: FormFactor = FormFactor::PointToDisc, unit "",
        grid [FormFactor::PointToPoint, FormFactor::PointToDisc], role Override;
        /// Disc of the form factor: sample, as published, loses light with few samples but is bounded; texel keeps the mean at several times the noise.
        disc_area: DiscArea = DiscArea::Sample, unit "", grid [DiscArea::Sample, DiscArea::Texel], role Uniform;
        /// Child that a texel of the pyramid keeps: nearest to the eye (2009) or by vote (2010).
        pyramid_filter: PyramidFilter = PyramidFilter::Nearest, unit "",
        grid [PyramidFilter::Nearest, PyramidFilter::Vote], role Override;
        /// Kernel that brings a level to the next finer one and to the display.
        upsampling_kernel: UpsamplingKernel = UpsamplingKernel::Spline, unit "",
        grid [UpsamplingKernel::Spline], role Override;
        /// Storage of the indirect and final image: float16 has half the bytes and clamps at 65,504.
        storage: Storage = Storage::Float16, unit "", grid [Storage::Float16, Storage::Float32], role Plan;
        /// Share a of the frames before in the filtered light: F = a F_before + (1 - a) I; 0 is off. Half of an old image is gone after ln 2 / -ln a frames; of glossy light sooner, the narrower its lobe.
        temporal_a: f32 = 0.0, in 0.0..=0.999, unit "1", grid [0.0, 0.9], role Plan;
        /// Whether light that the scene's extra cameras see is kept where it is more than the display's camera finds.
        extra_cameras: Switch = Switch::On, unit "", grid [Switch::Off, Switch::On], role Plan;
        /// Gather one level only and leave the others black.
        only_level: OnlyLevel = OnlyLevel::All, unit "", grid [OnlyLevel::All], role Plan;
        /// Bounces of indirect light; each one more gathers what the one before it sent.
        bounces: u32 = 1, in 0..=8, unit "1", grid [1, 2], role Plan;
        /// Whether two bounces take interleaved from frame to frame, at the price of one; takes effect where bounces is 2.
        bounce_interleaving: Switch = Switch::Off, unit "", grid [Switch::Off, Switch::On], role Plan;
        /// What stands between a surface and its source: off, light passes; solid, surface or auto, a voxel grid of every mesh as solid, as surfaces, or as each mesh is.
        visibility: Visibility = Visibility::Off, unit "", grid [Visibility::Off, Visibility::Auto], role Plan;
        /// Voxels of a coarser level: and, as published, loses thin occluders; or lets them grow.
        visibility_downsampling: VisibilityDownsampling = VisibilityDownsampling::Or, unit "",
        grid [VisibilityDownsampling::And, VisibilityDownsampling::Or], role Override;
        /// Bounces that are tested for visibility: all, or the first alone; interleaved bounces are tested both.
        visibility_bounces: VisibilityBounces = VisibilityBounces::All, unit "",
        grid [VisibilityBounces::All, VisibilityBounces::First], role Plan;
        /// Successive samples that share one ray through the voxels: the mean stays, the noise of visibility grows, its cost falls; 1 as published.
        samples_per_ray: u32 = 16, in 1..=64, unit "1", grid [1, 4, 16], role Override;
        /// Light that glossy materials (Ks, Ns) send on towards the eye; its sources stay diffuse and lit directly.
        glossy: Switch = Switch::Off, unit "", grid [Switch::Off, Switch::On], role Plan;
        /// Where samples of glossy light are drawn: off, as many everywhere; 2010, more in the mirror lobe's screen directions, as published; lobe, where its light comes from.
        glossy_importance: GlossyImportance = GlossyImportance::Lobe, unit "",
        grid [GlossyImportance::Off, GlossyImportance::Paper, GlossyImportance::Lobe], role Override;
        /// Where first-bounce light comes from: screen, what the camera sees; lights, what the lights see; both, from within `border` what the camera sees, from beyond it what the lights see. With lights or both, bounces do not take interleaved and extra cameras add nothing.
        sources: Sources = Sources::Screen, unit "", grid [Sources::Screen, Sources::Lights, Sources::Both], role Plan;
        /// Distance up to which light comes from the screen where sources is both; 0 takes a thirtieth of the scene's diagonal.
        border: f32 = 0.0, in 0.0..=1e9, unit "scene units", grid [0.0], role Plan;
        /// Width and height of each light's view, rounded up to a multiple of its coarsest texel.
        light_view_size: u32 = 128, in 8..=512, unit "px", grid [64, 128, 256], role Plan;
        /// What light from the lights' views is tested by: off, it passes through everything; cubes, a grid over the whole scene.
        light_visibility: LightVisibility = LightVisibility::Voxels, unit "",
        grid [LightVisibility::Off, LightVisibility::Voxels], role Plan;
        /// Cubes along the longest side of the scene.
        voxel_resolution: u32 = 256, in 8..=960, unit "1", grid [128, 256, 512], role Plan;
    }
}

/// See the module.
pub const TECHNIQUE: Technique = Technique {
    name: Hierarchical::TECHNIQUE,
    summary: "hierarchical screen-space indirect illumination (Soler et al. 2009)",
    parameters: Hierarchical::parameters,
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
    plan: |plan, inputs, settings| {
        let light = self::plan(plan, inputs, settings)?;
        let light = views::keep_the_most(plan, inputs, light, |plan, inputs| self::plan(plan, inputs, settings))?;
        Ok(temporal_filter(plan, inputs, light, Hierarchical::from_settings(settings)?.temporal_a))
    },
};

/// Radii, inner and outer, of the ring of a level, in its texels.
pub fn ring_radii(ring: Ring, radius: f32, level: u32) -> [f32; 2] {
    let [inner, outer] = match ring {
        Ring::Inner => [0.5 * radius, radius],
        Ring::Outer => [radius, 2.0 * radius],
    };
    if level == 0 { [0.0, outer] } else { [inner, outer] }
}

/// Radius of a ring that holds more than the receiver's own texel, texels: with less, many levels on a small picture
/// would see nothing but themselves.
const LEAST_OUTER_RADIUS: f32 = 2.0;

/// The smallest radius whose rings cover the screen from any pixel of it and reach beyond the receiver's own texel: the
/// outermost ring reaches as far as the diagonal of level 0.
pub fn covering_radius(ring: Ring, levels: u32, size: [u32; 2]) -> f32 {
    let diagonal = (size[0] as f32).hypot(size[1] as f32);
    let outermost = (diagonal / (1u32 << (levels - 1)) as f32).max(LEAST_OUTER_RADIUS);
    match ring {
        Ring::Inner => outermost,
        Ring::Outer => 0.5 * outermost,
    }
}

/// How levels are brought to finer ones.
fn upsampling(parameters: &Hierarchical) -> Upsampling {
    Upsampling { kernel: parameters.upsampling_kernel, storage: parameters.storage }
}

/// Materials of the pixels, where glossy light is gathered.
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
    let sources = match parameters.sources {
        Sources::Lights if !lit => return Ok(None),
        sources => sources,
    };
    let screen_gathers =
        sources != Sources::Lights || parameters.bounces > 1 || glossy_material(inputs, &parameters).is_some();
    // Levels coarser than the only one wanted have nothing to add.
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
    let interleaved = parameters.bounces == 2 && parameters.bounce_interleaving == Switch::On;
    let light = if interleaved && sources == Sources::Screen {
        bounces::plan_interleaved(plan, inputs, &gather)
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
