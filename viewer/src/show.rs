//! The last step of a picture: converts a texture of the frame to display colours.

use std::collections::HashMap;

use halflight_frame_graph::{
    CompiledGraph, Externals, FramePlan, Gpu, Part, ResourceId, ResourceKind, non_finite::largest_number,
};
use halflight_shared_shaders::{
    Call,
    viewer::{
        average::Average,
        show::{self, Show},
        show_error::{self, ShowError},
        show_surfels::{self, ShowSurfels},
        show_voxels::{self, ShowVoxels},
    },
};
use wgpu::TextureFormat as Format;

use crate::state::View;

/// What a texture holds; the same numbers as `CONTENT_...` in `common/tone.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Content {
    Radiance = 0,
    Normal = 1,
    Depth = 2,
    Reflectance = 3,
}

/// Colours of the error map, evenly spaced, sRGB. Lightness increases with the error, so the map is readable in grey and
/// with common forms of colour blindness.
pub const ERROR_COLOURS: [[f32; 3]; 6] = [
    [0.0, 0.0, 0.02],
    [0.25, 0.06, 0.44],
    [0.56, 0.16, 0.5],
    [0.87, 0.3, 0.38],
    [0.99, 0.62, 0.42],
    [0.99, 0.98, 0.75],
];

/// Relative error that is shown in the last colour.
pub const ERROR_FULL_SCALE: f32 = 1.0;

/// The reference as textures on the device.
pub struct ReferenceTextures {
    /// `albedo * indirect`; the fourth channel is 1 on surfaces.
    pub reflected: wgpu::Texture,
    /// The final picture.
    pub picture: wgpu::Texture,
    /// The `0.01 m^2` of relMSE.
    pub relative_floor: f32,
}

/// Parameters of the conversion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Factor of radiance.
    pub exposure: f32,
    /// Depth that is shown as middle grey, scene units.
    pub range: f32,
    /// Whether pictures are averaged, see [`show()`].
    pub averaged: bool,
}

/// Names of the plan's textures, apart from its outputs, that can be shown.
pub fn showable(plan: &FramePlan) -> Vec<&str> {
    let outputs: Vec<usize> = plan.outputs.values().map(|id| id.0).collect();
    let colour = |index: usize| {
        let resource = &plan.resources[index];
        match resource.kind {
            ResourceKind::Texture { layers, format, .. } => {
                (layers == 1 || format == Format::R32Uint)
                    && !outputs.contains(&index)
                    && shader(&resource.name, format).is_some()
            }
            _ => false,
        }
    };
    (0..plan.resources.len()).filter(|&index| colour(index)).map(|index| plan.resources[index].name.as_str()).collect()
}

/// The shader for a texture.
#[derive(Clone, Copy)]
enum Shown {
    Colours,
    Surfels,
    Voxels,
}

/// The shader for a texture of this name and format; `None` for formats without colour.
fn shader(name: &str, format: Format) -> Option<Shown> {
    match format {
        Format::Rgba32Uint if name.starts_with("surfels") => Some(Shown::Surfels),
        Format::R32Uint if name.starts_with("voxels") => Some(Shown::Voxels),
        Format::R32Float | Format::Rgba32Float | Format::Rgba16Float | Format::Rgba8UnormSrgb | Format::Rgba8Unorm => {
            Some(Shown::Colours)
        }
        _ => None,
    }
}

/// A compiled graph that fills an [`Format::Rgba8Unorm`] texture (`display`) with the view; `None` if the frame lacks the
/// texture of the view. With `look.averaged`, it is the mean of the pictures that it is recorded with, from frame 0 on.
pub fn show(
    gpu: &Gpu,
    frame: &CompiledGraph,
    view: &View,
    look: Look,
    reference: Option<&ReferenceTextures>,
) -> Option<CompiledGraph> {
    let size = frame.plan().display_size;
    let mut plan = FramePlan::new(size);
    let mut textures = HashMap::new();
    let display = plan.texture("display", size, Format::Rgba8Unorm, "the display colours of the view");
    plan.outputs.insert("display", display);
    let image = plan.external("image", "the texture to show");
    if *view == View::Error {
        let reference = reference?;
        textures.insert("truth", reference.reflected.clone());
        textures.insert("albedo", frame.output("albedo")?.clone());
        let indirect = frame.output("indirect");
        textures.insert("image", indirect.or_else(|| frame.output("albedo"))?.clone());
        let reflected = plan.external("truth", "the reference of the image");
        let albedo = plan.external("albedo", "factor of the indirect light");
        let words: Vec<f32> = ERROR_COLOURS.iter().flat_map(|&[r, g, b]| [r, g, b, 1.0]).collect();
        let colours = plan.data("colours", bytemuck::cast_slice(&words).to_vec(), "the colours of the error map");
        let run = ShowError {
            image,
            truth: reflected,
            albedo,
            display,
            colours,
            params: show_error::Params { relative_floor: reference.relative_floor, full_scale: ERROR_FULL_SCALE },
            constants: show_error::Constants { indirect: u32::from(indirect.is_some()) },
        };
        plan.pass(Part::Technique, "show", run).over(size);
        return Some(CompiledGraph::new(gpu, plan, &Externals { textures, ..Default::default() }));
    }
    let (name, texture) = match view {
        View::Output(name) => (*name, frame.output(name)?),
        View::Reference => ("truth", &reference?.picture),
        View::Error => return None,
        View::Texture(name) => {
            let id = frame.plan().resources.iter().position(|resource| resource.name == *name)?;
            (name.as_str(), frame.texture(ResourceId(id))?)
        }
    };
    let content = match name {
        "normal" => Content::Normal,
        "depth" => Content::Depth,
        _ if matches!(texture.format(), Format::Rgba8UnormSrgb | Format::Rgba8Unorm) => Content::Reflectance,
        // A single float channel other than depth is a visibility.
        _ if texture.format() == Format::R32Float => Content::Reflectance,
        _ => Content::Radiance,
    };
    let divisor = size[0].div_ceil(texture.width()).max(1);
    textures.insert("image", texture.clone());
    let (content, exposure, range) = (content as u32, look.exposure, look.range);
    let target = if look.averaged { plan.texture("picture", size, Format::Rgba8Unorm, "one picture") } else { display };
    let call = match shader(name, texture.format())? {
        Shown::Colours => {
            let limit = largest_number(texture.format());
            let params = show::Params { content, divisor, exposure, range, limit };
            Call::from(Show { image, display: target, params })
        }
        Shown::Surfels => {
            let params = show_surfels::Params { content, divisor, exposure, range };
            ShowSurfels { image, display: target, params }.into()
        }
        Shown::Voxels => {
            let params = show_voxels::Params { content, divisor, exposure, range };
            ShowVoxels { image, display: target, params }.into()
        }
    };
    plan.pass(Part::Technique, "show", call).over(size);
    if look.averaged {
        let history = plan.history("mean", size, Format::Rgba16Float, "the mean of the pictures of this view");
        let run = Average { picture: target, mean_before: history.before, mean: history.now, display };
        plan.pass(Part::Technique, "average", run).over(size);
    }
    Some(CompiledGraph::new(gpu, plan, &Externals { textures, ..Default::default() }))
}
