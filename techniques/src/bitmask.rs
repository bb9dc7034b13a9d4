//! Screen-space indirect light with a visibility bitmask (Therrien et al. 2023). Along slices through the view ray,
//! every sample occludes some sectors of the hemisphere and lights the receiver through those that were not occluded
//! before.

use halflight_frame_graph::{FramePlan, ResourceId};
use halflight_renderer::gi::{GBufferNeeds, Inputs, Technique};
use halflight_renderer::{
    choice,
    gi::{
        Finds, Resolution, Spacing, Storage, Switch,
        previous_frame_bounce::PreviousFrameBounce,
        slices::{SliceGather, SliceInputs},
        temporal::temporal_filter,
    },
    parameters,
    parameters::{Settings, SettingsError},
};
use halflight_shared_shaders::{
    Call,
    bitmask::gather::{self, Gather},
};

choice! {
    /// Weighting of sectors and light.
    pub enum Estimator {
        /// As published: sectors of equal angle, light weighted by the cosines at both ends.
        Published = "published",
        /// Sectors of equal cosine-weighted solid angle. Converges to ray-traced light of the visible surfaces.
        Radiometric = "radiometric",
    }
}

choice! {
    /// Number of sectors of a slice.
    pub enum Sectors {
        /// One word.
        S32 = "32",
        /// Two words.
        S64 = "64",
        /// Four words.
        S128 = "128",
    }
}

impl Sectors {
    fn count(self) -> u32 {
        32 << self as u32
    }
}

choice! {
    /// Source of environment light.
    pub enum Ambient {
        /// The irradiance of the normal, times ambient visibility.
        Normal = "normal",
        /// The irradiance of the bent normal (the mean open direction), times ambient visibility.
        BentNormal = "bent-normal",
        /// Four directions per slice, each through its open sectors.
        Bitmask = "bitmask",
    }
}

parameters! {
    /// Parameters of the visibility bitmask.
    pub struct Bitmask("bitmask") {
        /// Result: indirect light, or ambient visibility alone.
        finds: Finds = Finds::Light, unit "", grid [Finds::Light, Finds::Occlusion], role Plan;
        /// Sectors and weights: published, as in the paper; radiometric, consistent with ray tracing.
        estimator: Estimator = Estimator::Radiometric, unit "",
        grid [Estimator::Published, Estimator::Radiometric], role Override;
        /// Radius of occluders and senders; 0 for the whole screen.
        radius: f32 = 0.0, in 0.0..=1e9, unit "scene units", grid [0.0, 1.0, 4.0], role Uniform;
        /// Thickness of every surface, away from the eye.
        thickness: f32 = 0.0, in 0.0..=1e9, unit "scene units", grid [0.1, 0.25, 0.5, 1.0], role Uniform;
        /// Additional thickness per unit of depth. It has no unit, so the default suits scenes of any size.
        thickness_slope: f32 = 0.03, in 0.0..=10.0, unit "1", grid [0.0, 0.03], role Uniform;
        /// Slices of the hemisphere. Noise decreases with the square root, cost is proportional.
        slices: u32 = 1, in 1..=64, unit "1", grid [1, 2, 4], role Override;
        /// Steps on each side of a slice.
        steps: u32 = 12, in 1..=256, unit "1", grid [8, 12, 16, 32], role Override;
        /// Spacing of the steps: constant, or exponential with more steps near the receiver.
        spacing: Spacing = Spacing::Exponential, unit "",
        grid [Spacing::Constant, Spacing::Exponential], role Override;
        /// Whether steps start at random positions in their strides. Otherwise they start in the middle, which shows as
        /// banding.
        jitter: Switch = Switch::On, unit "", grid [Switch::Off, Switch::On], role Override;
        /// Sectors of a slice. Few sectors show as banding, many cost slightly more.
        sectors: Sectors = Sectors::S32, unit "", grid [Sectors::S32, Sectors::S128], role Plan;
        /// Environment light: from the normal, from the bent normal, or from directions through open sectors.
        ambient: Ambient = Ambient::Bitmask, unit "",
        grid [Ambient::Normal, Ambient::BentNormal, Ambient::Bitmask], role Override;
        /// Resolution of the gather. Half costs a quarter and blurs.
        resolution: Resolution = Resolution::Full, unit "", grid [Resolution::Full, Resolution::Half], role Plan;
        /// Passes of the spatial filter, each of 3x3 taps at twice the previous distance; 0 for none.
        denoise: u32 = 1, in 0..=4, unit "1", grid [0, 1, 2], role Plan;
        /// Largest albedo of previous-frame bounces, for multiple bounces; 0 for one bounce.
        feedback: f32 = 0.0, in 0.0..=0.95, unit "1", grid [0.0, 0.9], role Plan;
        /// Share a of the history in the filtered light; 0 is off. Half of an old image is gone after ln 2 / -ln a
        /// frames.
        temporal_a: f32 = 0.0, in 0.0..=0.999, unit "1", grid [0.0, 0.9], role Plan;
        /// Storage of light at full resolution. float16 has half the bytes and clamps at 65,504.
        storage: Storage = Storage::Float16, unit "", grid [Storage::Float16, Storage::Float32], role Plan;
    }
}

/// The technique. See the module.
pub const TECHNIQUE: Technique = Technique {
    name: Bitmask::TECHNIQUE,
    title: "Visibility bitmask",
    summary: "screen-space indirect light with a visibility bitmask (Therrien et al. 2023)",
    parameters: Bitmask::parameters,
    main: &["slices", "steps", "thickness", "resolution", "denoise"],
    complete: |settings| Ok(Bitmask::from_settings(settings)?.to_settings()),
    needs: |_| Ok(GBufferNeeds::NONE),
    sources: |settings| Ok(Bitmask::from_settings(settings)?.finds.sources()),
    plan,
};

fn plan(plan: &mut FramePlan, inputs: &Inputs, settings: &Settings) -> Result<Option<ResourceId>, SettingsError> {
    let parameters = Bitmask::from_settings(settings)?;
    let lit = parameters.finds == Finds::Light;
    let sectors = parameters.sectors.count();
    let feedback = PreviousFrameBounce::plan(plan, inputs, if lit { parameters.feedback } else { 0.0 });
    let slices = SliceGather {
        technique: Bitmask::TECHNIQUE,
        finds: parameters.finds,
        radius: parameters.radius,
        resolution: parameters.resolution,
        samples: 2 * parameters.slices * parameters.steps,
        sky_rays: 4 * parameters.slices,
        denoise: parameters.denoise,
        storage: parameters.storage,
    };
    let source = Inputs { direct: feedback.as_ref().map_or(inputs.direct, |feedback| feedback.source), ..*inputs };
    let light =
        slices.plan(plan, &source, |SliceInputs { surfels, planes, gathered, sky, packed, float16, scale, radius }| {
            Call::from(Gather {
                surfels,
                planes,
                gathered,
                ambient: sky.is_some(),
                light: lit,
                packed,
                float16,
                wide: sectors > 32,
                environment: sky.map(|sky| sky.environment),
                grid: sky.map(|sky| sky.voxels.grid),
                voxels: sky.map(|sky| sky.voxels.voxels),
                params: gather::Params {
                    scale,
                    radius,
                    thickness: parameters.thickness,
                    thickness_slope: parameters.thickness_slope,
                },
                constants: gather::Constants {
                    slices: parameters.slices,
                    steps: parameters.steps,
                    sectors,
                    spacing: parameters.spacing as u32,
                    jitter: parameters.jitter == Switch::On,
                    radiometric: parameters.estimator == Estimator::Radiometric,
                    over_frames: parameters.temporal_a > 0.0,
                    ambient: parameters.ambient as u32,
                },
            })
        });
    if !lit && parameters.temporal_a > 0.0 {
        plan.notes.push(
            "temporal_a of bitmask filters light: with finds = occlusion, ambient visibility is not filtered over frames; \
             raise slices or denoise instead"
                .into(),
        );
    }
    let light = temporal_filter(plan, inputs, light, parameters.temporal_a);
    if let (Some(feedback), Some(light)) = (feedback, light) {
        feedback.write_history(plan, inputs, light);
    }
    Ok(light)
}
