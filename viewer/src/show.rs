//! The last step of a picture: a texture of the frame, turned into colours for the screen.

use std::collections::HashMap;

use halflight_frame_graph::{CompiledGraph, Externals, FramePlan, Gpu, Part, ResourceKind, scan::largest_number};
use wgpu::TextureFormat as Format;

use crate::state::View;

/// What a texture holds: twin of `CONTENT_...` in `common/tone.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Content {
    Radiance = 0,
    Normal = 1,
    Depth = 2,
    Reflectance = 3,
}

/// Colours of the error map, evenly spaced, sRGB: dark to light, readable in grey and with common colour blindness.
pub const ERROR_COLOURS: [[f32; 3]; 6] = [
    [0.0, 0.0, 0.02],
    [0.25, 0.06, 0.44],
    [0.56, 0.16, 0.5],
    [0.87, 0.3, 0.38],
    [0.99, 0.62, 0.42],
    [0.99, 0.98, 0.75],
];

/// Relative error that takes the last of the colours.
pub const ERROR_FULL_SCALE: f32 = 1.0;

/// The truth as textures on the device.
pub struct TruthTextures {
    /// `albedo * indirect`; the fourth channel is 1 where there is a surface.
    pub reflected: wgpu::Texture,
    /// The final picture.
    pub picture: wgpu::Texture,
    /// The `0.01 m^2` of relMSE.
    pub relative_floor: f32,
}

/// How to show it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Factor of radiance.
    pub exposure: f32,
    /// Depth that shows as middle grey, scene units.
    pub range: f32,
}

/// Names of the plan's textures that can be shown besides its outputs.
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

/// The shader for a texture of this name and format; none for formats that hold no colour.
fn shader(name: &str, format: Format) -> Option<&'static str> {
    match format {
        Format::Rgba32Uint if name.starts_with("surfels") => Some("viewer/show_surfels"),
        Format::R32Uint if name.starts_with("voxels") => Some("viewer/show_voxels"),
        Format::R32Float | Format::Rgba32Float | Format::Rgba16Float | Format::Rgba8UnormSrgb | Format::Rgba8Unorm => {
            Some("viewer/show")
        }
        _ => None,
    }
}

/// A recording that fills an [`Format::Rgba8Unorm`] texture (`display`) with the view; none where the frame lacks what
/// the view shows.
pub fn show(
    gpu: &Gpu,
    frame: &CompiledGraph,
    view: &View,
    look: Look,
    truth: Option<&TruthTextures>,
) -> Option<CompiledGraph> {
    let size = frame.plan().display_size;
    let mut plan = FramePlan::new(size);
    let mut textures = HashMap::new();
    let display = plan.texture("display", size, Format::Rgba8Unorm, "what the screen shows");
    plan.outputs.insert("display", display);
    let image = plan.external("image", "the texture to show");
    if *view == View::Error {
        let truth = truth?;
        textures.insert("truth", truth.reflected.clone());
        textures.insert("albedo", frame.output("albedo")?.clone());
        let indirect = frame.output("indirect");
        textures.insert("image", indirect.or_else(|| frame.output("albedo"))?.clone());
        let reference = plan.external("truth", "what the image should be");
        let albedo = plan.external("albedo", "reflects indirect light");
        let words: Vec<f32> = ERROR_COLOURS.iter().flat_map(|&[r, g, b]| [r, g, b, 1.0]).collect();
        let colours = plan.data("colours", bytemuck::cast_slice(&words).to_vec(), "the scale");
        plan.pass(Part::Technique, "show", "viewer/show_error")
            .constants(&[("INDIRECT", f64::from(u8::from(indirect.is_some())))])
            .param("relative_floor", truth.relative_floor)
            .param("full_scale", ERROR_FULL_SCALE)
            .bind("image", image)
            .bind("truth", reference)
            .bind("albedo", albedo)
            .bind("colours", colours)
            .bind("display", display)
            .over(size);
        return Some(CompiledGraph::new(gpu, plan, &Externals { scene: None, textures }));
    }
    let (name, texture) = match view {
        View::Output(name) => (*name, frame.output(name)?),
        View::Truth => ("truth", &truth?.picture),
        View::Error => return None,
        View::Texture(name) => {
            let id = frame.plan().resources.iter().position(|resource| resource.name == *name)?;
            (name.as_str(), frame.texture(halflight_frame_graph::ResourceId(id))?)
        }
    };
    let content = match name {
        "normal" => Content::Normal,
        "depth" => Content::Depth,
        _ if matches!(texture.format(), Format::Rgba8UnormSrgb | Format::Rgba8Unorm) => Content::Reflectance,
        // A single float channel that is no depth is a visibility or an openness.
        _ if texture.format() == Format::R32Float => Content::Reflectance,
        _ => Content::Radiance,
    };
    let divisor = size[0].div_ceil(texture.width()).max(1);
    textures.insert("image", texture.clone());
    let shader = shader(name, texture.format())?;
    let mut pass = plan
        .pass(Part::Technique, "show", shader)
        .param("content", content as u32)
        .param("divisor", divisor)
        .param("exposure", look.exposure)
        .param("range", look.range);
    if shader == "viewer/show" {
        pass = pass.param("limit", largest_number(texture.format()));
    }
    pass.bind("image", image).bind("display", display).over(size);
    Some(CompiledGraph::new(gpu, plan, &Externals { scene: None, textures }))
}
