//! Changes of resolution, for any technique: surfels of coarser squares, and joint bilateral upsampling back.

use wgpu::TextureFormat as Format;

use crate::{
    gi::{Inputs, Storage, UpsamplingKernel},
    parameters::ParameterType,
};
use halflight_frame_graph::{FramePlan, Part, PassBuilder, ResourceId, variant};

/// Surfaces in squares of some pixels.
pub struct Level {
    pub size: [u32; 2],
    /// Width of a texel in full-resolution pixels.
    pub scale: u32,
    pub surfels: ResourceId,
}

/// Plans surfels of squares `divisor` pixels wide and of `last` coarser levels, each of twice the width, finest first.
/// `constants` may choose which child a square keeps (`VOTE`).
pub fn pyramid(
    plan: &mut FramePlan,
    inputs: &Inputs,
    constants: &[(&'static str, f64)],
    divisor: u32,
    last: u32,
) -> Vec<Level> {
    pyramid_and_planes(plan, inputs, constants, divisor, last, None)
}

/// Plans surfels of squares `divisor` pixels wide (1 or 2) and the same surfaces as planes (`common/plane.wgsl`).
pub fn surfels_and_planes(plan: &mut FramePlan, inputs: &Inputs, divisor: u32) -> (Level, ResourceId) {
    let size = plan.display_size.map(|v| v.div_ceil(divisor));
    let planes = plan.texture("planes", size, Format::Rgba32Uint, "surfaces as planes, one fetch a sample");
    (pyramid_and_planes(plan, inputs, &[("VOTE", 0.0)], divisor, 0, Some(planes)).remove(0), planes)
}

/// As [`pyramid`]; the first pass, at most half resolution, writes `planes`, too.
fn pyramid_and_planes(
    plan: &mut FramePlan,
    inputs: &Inputs,
    constants: &[(&'static str, f64)],
    divisor: u32,
    last: u32,
    planes: Option<ResourceId>,
) -> Vec<Level> {
    let mut levels: Vec<Level> = Vec::new();
    // The finest step reads the G-buffer; every further one halves the one before. A start below half
    // resolution passes through intermediate steps that are not levels of the gather.
    let finest = divisor.min(2);
    let coarsest = divisor << last;
    let mut scale = finest;
    while scale <= coarsest {
        let size = plan.display_size.map(|v| v.div_ceil(scale));
        let surfels = plan.texture(
            format!("surfels_{scale}"),
            size,
            Format::Rgba32Uint,
            format!("surfaces in squares of {scale} pixels"),
        );
        let name = format!("pyramid_{scale}");
        let pass = match levels.last() {
            None if scale == 1 => plan
                .pass(Part::Technique, name, variant("hierarchical/pack", &[("planes", planes.is_some())]))
                .bind("depth", inputs.depth)
                .bind("normal", inputs.normal)
                .bind("direct", inputs.direct),
            None => plan
                .pass(
                    Part::Technique,
                    name,
                    variant("hierarchical/pyramid+from_gbuffer", &[("planes", planes.is_some())]),
                )
                .param("child_scale", 1.0)
                .bind("depth", inputs.depth)
                .bind("normal", inputs.normal)
                .bind("direct", inputs.direct),
            Some(finer) => plan
                .pass(Part::Technique, name, "hierarchical/pyramid")
                .param("child_scale", finer.scale as f32)
                .bind("children", finer.surfels),
        };
        let pass = match planes {
            Some(planes) if levels.is_empty() => pass.bind("planes", planes),
            _ => pass,
        };
        pass.constants(constants)
            .bind("surfels", surfels)
            .because(if scale < divisor { "leads to the start resolution" } else { "a level of the gather" })
            .over(size);
        levels.push(Level { size, scale, surfels });
        scale *= 2;
    }
    levels.retain(|level| level.scale >= divisor);
    levels
}

/// How coarse light is brought to finer texels.
#[derive(Clone, Copy)]
pub struct Upsampling {
    pub kernel: UpsamplingKernel,
    /// Of what arrives at the display.
    pub storage: Storage,
}

impl Upsampling {
    /// Begins a pass that brings light of the coarse level to texels of `fine_scale`.
    pub fn pass<'a>(
        self,
        plan: &'a mut FramePlan,
        name: String,
        shader: &str,
        coarse: &Level,
        fine_scale: u32,
    ) -> PassBuilder<'a> {
        plan.pass(Part::Technique, name, shader)
            .constants(&[("KERNEL", self.kernel.to_constant()), ("CHILDREN", f64::from(coarse.scale / fine_scale))])
            .param("fine_scale", fine_scale as f32)
            .param("coarse_scale", coarse.scale as f32)
            .bind("coarse_surfels", coarse.surfels)
    }
}

/// Brings light of a level to the display, as a texture of this name; where the level is the display's, it is there
/// already. One number a texel (R32Float) stays one; surfels with the light as radiance (Rgba32Uint) are read as such, with
/// the linear kernel from half resolution.
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
    let openness = plan.resources[light.0].format() == Some(Format::R32Float);
    // Surfels with the light as radiance.
    let packed = plan.resources[light.0].format() == Some(Format::Rgba32Uint);
    let half = upsampling.storage == Storage::Float16 && !openness;
    let format = match (openness, half) {
        (true, _) => Format::R32Float,
        (false, true) => Format::Rgba16Float,
        (false, false) => Format::Rgba32Float,
    };
    let what = if openness { name.replace('_', " ") } else { format!("{name} light") };
    let display = plan.texture(name, size, format, format!("{what} at full resolution"));
    let pass = if name == "indirect" { "upsample".into() } else { format!("upsample_{name}") };
    if level.scale == 2 && upsampling.kernel == UpsamplingKernel::Linear {
        let features = [("float16", half), ("openness", openness), ("packed", packed)];
        let pass = plan
            .pass(Part::Technique, pass, variant("hierarchical/upsample_linear", &features))
            .bind("coarse_surfels", if packed { light } else { level.surfels })
            .bind("depth", inputs.depth)
            .bind("normal", inputs.normal)
            .bind("indirect", display)
            .because("the gather starts at half resolution");
        let pass = if packed { pass } else { pass.bind("coarse_indirect", light) };
        pass.over(level.size.map(|v| v + 1));
        return display;
    }
    let features = [("to_display", true), ("float16", half), ("openness", openness)];
    upsampling
        .pass(plan, pass, &variant("hierarchical/upsample", &features), level, 1)
        .bind("coarse_indirect", light)
        .bind("depth", inputs.depth)
        .bind("normal", inputs.normal)
        .bind("indirect", display)
        .because("the gather starts below full resolution")
        .over(level.size);
    display
}
