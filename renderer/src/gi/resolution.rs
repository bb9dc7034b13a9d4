//! Changes of resolution: downsampling to surfels, and joint bilateral upsampling.

use wgpu::TextureFormat as Format;

use crate::gi::{Inputs, Storage, UpsamplingKernel};
use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_shared_shaders::{
    Call,
    hierarchical::{
        pack::Pack,
        pyramid::{self, Pyramid},
        upsample::{self, Upsample},
        upsample_linear::UpsampleLinear,
    },
};

/// The surfaces of one level.
pub struct Level {
    /// Width and height, texels.
    pub size: [u32; 2],
    /// Width of a texel in full-resolution pixels.
    pub scale: u32,
    /// Surfels, one per texel.
    pub surfels: ResourceId,
}

/// Fetches of a texel: depth, normal and radiance of four children.
const CHILDREN: u64 = 12;
/// The same without radiance.
const DARK_CHILDREN: u64 = 8;

/// Plans surfels `divisor` pixels wide, and `last` coarser levels, each of twice the width, finest first. With `vote` a
/// texel keeps the child that most of its neighbours support, otherwise the nearest one.
pub fn pyramid(plan: &mut FramePlan, inputs: &Inputs, vote: bool, divisor: u32, last: u32) -> Vec<Level> {
    pyramid_and_planes(plan, inputs, vote, divisor, last, Finest { lit: true, planes: None })
}

/// Plans surfels `divisor` pixels wide, for passes that do not read their radiance. No direct light is read, and at full
/// resolution they take half the bytes.
pub fn dark_surfels(plan: &mut FramePlan, inputs: &Inputs, divisor: u32) -> Level {
    pyramid_and_planes(plan, inputs, false, divisor, 0, Finest { lit: false, planes: None }).remove(0)
}

/// Plans surfels `divisor` pixels wide (1 or 2) and the same surfaces as planes (`common/plane.wgsl`). Only with `lit` the
/// planes have radiance; the surfels are [`dark_surfels`].
pub fn surfels_and_planes(plan: &mut FramePlan, inputs: &Inputs, divisor: u32, lit: bool) -> (Level, ResourceId) {
    let size = plan.display_size.map(|v| v.div_ceil(divisor));
    let format = if lit { Format::Rgba32Uint } else { Format::Rg32Uint };
    let planes = plan.texture("planes", size, format, "surfaces as planes, one fetch a sample");
    let finest = Finest { lit: false, planes: Some((planes, lit)) };
    (pyramid_and_planes(plan, inputs, false, divisor, 0, finest).remove(0), planes)
}

/// What the first pass of a pyramid writes.
#[derive(Clone, Copy)]
struct Finest {
    /// Whether surfels have radiance.
    lit: bool,
    /// Planes, and whether they have radiance.
    planes: Option<(ResourceId, bool)>,
}

/// As [`pyramid()`]. The first pass, at half resolution or finer, writes `first`.
fn pyramid_and_planes(
    plan: &mut FramePlan,
    inputs: &Inputs,
    vote: bool,
    divisor: u32,
    last: u32,
    first: Finest,
) -> Vec<Level> {
    let mut levels: Vec<Level> = Vec::new();
    // The finest step reads the G-buffer, and every other one halves the previous step. A start below half resolution
    // has intermediate steps that are not levels of the gather.
    let finest = divisor.min(2);
    let coarsest = divisor << last;
    let mut scale = finest;
    while scale <= coarsest {
        let size = plan.display_size.map(|v| v.div_ceil(scale));
        let Finest { lit, planes } = Finest { planes: first.planes.filter(|_| levels.is_empty()), ..first };
        let format = if scale == 1 && !lit { Format::Rg32Uint } else { Format::Rgba32Uint };
        let surfels =
            plan.texture(format!("surfels_{scale}"), size, format, format!("surfaces in squares of {scale} pixels"));
        let name = format!("pyramid_{scale}");
        let &Inputs { depth, normal, direct, .. } = inputs;
        let (planes, lit_planes) = (planes.map(|(planes, _)| planes), planes.is_some_and(|(_, lit)| lit));
        let dark_planes = planes.is_some() && !lit_planes;
        let constants = pyramid::Constants { vote };
        let call = match levels.last() {
            None if scale == 1 => {
                let direct = (lit || lit_planes).then_some(direct);
                Pack { depth, normal, direct, surfels, planes, lit, lit_planes, dark_planes }.into()
            }
            None => Call::from(Pyramid {
                surfels,
                from_gbuffer: Some(pyramid::FromGbuffer { depth, normal }),
                direct: (lit || lit_planes).then_some(direct),
                lit,
                planes,
                lit_planes,
                dark_planes,
                children: None,
                params: pyramid::Params { child_scale: 1.0 },
                constants,
            }),
            Some(finer) => Call::from(Pyramid {
                surfels,
                from_gbuffer: None,
                direct: None,
                lit,
                planes: None,
                lit_planes: false,
                dark_planes: false,
                children: Some(finer.surfels),
                params: pyramid::Params { child_scale: finer.scale as f32 },
                constants,
            }),
        };
        plan.pass(Part::Technique, name, call)
            .because(if scale < divisor { "intermediate step to the start resolution" } else { "level of the gather" })
            .costs(if lit || lit_planes { CHILDREN } else { DARK_CHILDREN })
            .over(size);
        levels.push(Level { size, scale, surfels });
        scale *= 2;
    }
    levels.retain(|level| level.scale >= divisor);
    levels
}

/// Upsampling of coarse light.
#[derive(Clone, Copy)]
pub struct Upsampling {
    /// Kernel of the filter.
    pub kernel: UpsamplingKernel,
    /// Storage of the result at the display's resolution.
    pub storage: Storage,
}

impl Upsampling {
    /// Upsamples light of the coarse level to the next finer one, `fine`, and adds the light that was `gathered` there.
    pub fn combine(
        self,
        coarse: &Level,
        coarse_indirect: ResourceId,
        fine: &Level,
        gathered: Option<ResourceId>,
        indirect: ResourceId,
    ) -> Upsample<ResourceId> {
        Upsample {
            coarse_surfels: coarse.surfels,
            coarse_indirect,
            indirect,
            float16: false,
            ambient_visibility: false,
            to_display: None,
            surfels: Some(fine.surfels),
            // A level without gathered light binds any texture of the right kind. It is not read.
            gathered: Some(gathered.unwrap_or(coarse_indirect)),
            params: upsample::Params { fine_scale: fine.scale as f32, coarse_scale: coarse.scale as f32 },
            constants: self.constants(coarse, fine.scale, gathered.is_some()),
        }
    }

    fn constants(self, coarse: &Level, fine_scale: u32, gathered: bool) -> upsample::Constants {
        upsample::Constants { children: coarse.scale / fine_scale, kernel: self.kernel as u32, gathered }
    }
}

/// Fetches of an invocation of upsample_linear.wgsl: surfel and light of four parents, depth and normal of four pixels
/// with the weights of four parents each.
pub const LINEAR_COST: u64 = 4 * 2 + 4 * (2 + 4);

/// Fetches of an invocation of upsample.wgsl, which computes all texels below one of this many across: surfel and light of
/// nine parents, two or three fetches of a texel with the weights of nine parents each.
pub fn upsample_cost(children: u32) -> u64 {
    9 * 2 + u64::from(children).pow(2) * (3 + 9)
}

/// Upsamples light of a level to the display, as a texture of this name. Returns the light itself if the level has the
/// display's resolution. R32Float textures hold one number per texel. Rgba32Uint textures are surfels whose radiance is
/// the light; from half resolution, with the linear kernel.
pub fn to_display(
    plan: &mut FramePlan,
    inputs: &Inputs,
    upsampling: &Upsampling,
    level: &Level,
    light: ResourceId,
    name: &str,
) -> ResourceId {
    if level.scale == 1 {
        return light;
    }
    let size = plan.display_size;
    let ambient_visibility = plan.resources[light.0].format() == Some(Format::R32Float);
    // Surfels whose radiance is the light.
    let packed = plan.resources[light.0].format() == Some(Format::Rgba32Uint);
    let half = upsampling.storage == Storage::Float16 && !ambient_visibility;
    let format = match (ambient_visibility, half) {
        (true, _) => Format::R32Float,
        (false, true) => Format::Rgba16Float,
        (false, false) => Format::Rgba32Float,
    };
    let what = if ambient_visibility { name.replace('_', " ") } else { format!("{name} light") };
    let display = plan.texture(name, size, format, format!("{what} at full resolution"));
    let pass = if name == "indirect" { "upsample".into() } else { format!("upsample_{name}") };
    let &Inputs { depth, normal, .. } = inputs;
    if level.scale == 2 && upsampling.kernel == UpsamplingKernel::Linear {
        let run = UpsampleLinear {
            coarse_surfels: if packed { light } else { level.surfels },
            indirect: display,
            depth,
            normal,
            float16: half,
            ambient_visibility,
            packed,
            records: None,
            coarse_indirect: (!packed).then_some(light),
        };
        plan.pass(Part::Technique, pass, run)
            .because("the gather starts at half resolution")
            .costs(LINEAR_COST)
            .over(level.size.map(|v| v + 1));
        return display;
    }
    let run = Upsample {
        coarse_surfels: level.surfels,
        coarse_indirect: light,
        indirect: display,
        float16: half,
        ambient_visibility,
        to_display: Some(upsample::ToDisplay { depth, normal }),
        surfels: None,
        gathered: None,
        params: upsample::Params { fine_scale: 1.0, coarse_scale: level.scale as f32 },
        constants: upsampling.constants(level, 1, false),
    };
    plan.pass(Part::Technique, pass, run)
        .because("the gather starts below full resolution")
        .costs(upsample_cost(level.scale))
        .over(level.size);
    display
}
