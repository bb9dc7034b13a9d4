//! Pairs of surfels, and whether the gather's own function finds that one sees the other.

use halflight_evaluator::{
    Error,
    experiment::session::{Frames, Request, Session},
};
use halflight_native::{NativeGpu, frames::read_buffer};
use halflight_renderer::parameters::Settings;
use halflight_shared_shaders::{BindingKind, Member, UniformValue};
use halflight_techniques::hierarchical::{Hierarchical, TECHNIQUE, covering_radius, ring_radii};
use wgpu::util::DeviceExt;

use super::{GBuffer, Pixel, Random};

/// The shaders of this crate.
mod table {
    use halflight_shared_shaders::{Binding, BindingKind, EntryPoint, Member, Shader, Stage};

    include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
}

/// The texels of a receiver and of a source.
pub type Pair = [u32; 4];

/// Pairs of surfels of one level as the gather takes them: the source lies in the receiver's ring, and they face each
/// other.
pub fn ring_pairs(surfels: &GBuffer, k: u32, parameters: &Hierarchical, start: [u32; 2], count: usize) -> Vec<Pair> {
    let radius = match parameters.radius {
        0.0 => covering_radius(parameters.ring, parameters.levels, start),
        radius => radius,
    };
    let [inner, outer] = ring_radii(parameters.ring, radius, k).map(f64::from);
    let [width, height] = surfels.size;
    let mut random = Random(u64::from(k) + 1);
    let mut pairs = Vec::new();
    // Bounded, because a scene may have no such pair.
    for _ in 0..1000 * count {
        let at = [random.unit() * f64::from(width), random.unit() * f64::from(height)];
        let distance = (inner * inner + random.unit() * (outer * outer - inner * inner)).sqrt();
        let angle = std::f64::consts::TAU * random.unit();
        let other = [at[0] + distance * angle.cos(), at[1] + distance * angle.sin()];
        if other[0] < 0.0 || other[1] < 0.0 || other[0] >= f64::from(width) || other[1] >= f64::from(height) {
            continue;
        }
        let pair = [at, other].map(|p| p.map(|v| v as u32));
        let [receiver, source] = pair.map(|[x, y]| surfels.pixels[(y * width + x) as usize]);
        if receiver.depth > 0.0 && source.depth > 0.0 && surfels.form_factor(&receiver, &source, 1.0, true) > 0.0 {
            pairs.push([pair[0][0], pair[0][1], pair[1][0], pair[1][1]]);
            if pairs.len() == count {
                break;
            }
        }
    }
    pairs
}

/// The surfels of a pair.
pub fn surfels_of(surfels: &GBuffer, [x, y, i, j]: Pair) -> [Pixel; 2] {
    [[x, y], [i, j]].map(|[x, y]| surfels.pixels[(y * surfels.size[0] + x) as usize])
}

/// A level with pairs of its surfels.
#[derive(Clone, Debug)]
pub struct Level {
    /// Surfels.
    pub surfels: GBuffer,
    /// Pairs.
    pub pairs: Vec<Pair>,
    /// For each pair, whether the device finds that the receiver sees the source.
    pub seen: Vec<bool>,
}

/// Runs a frame with voxels; returns it with up to `count` pairs of every level and the device's answers for them.
///
/// # Errors
/// Where the settings are out of range or the device was lost.
pub fn answered<'a>(
    session: &Session<'a>,
    settings: &Settings,
    size: [u32; 2],
    count: usize,
) -> Result<(Frames<'a>, Vec<Level>), Error> {
    let parameters = Hierarchical::from_settings(settings).map_err(|e| Error::BadInput(e.to_string()))?;
    let settings = settings.clone();
    let mut frames = session.frames(&Request { technique: &TECHNIQUE, settings, size, seed: 0, direct: None })?;
    frames.run(0)?;
    let divisor = parameters.start_resolution.divisor();
    let start = size.map(|v| v.div_ceil(divisor));
    let level = |k| {
        let surfels = GBuffer::read_surfels(&frames, divisor << k);
        let pairs = ring_pairs(&surfels, k, &parameters, start, count);
        let seen = answers(session.native, &frames, k, &pairs)?;
        Ok(Level { surfels, pairs, seen })
    };
    let levels = (0..parameters.levels).map(level).collect::<Result<_, Error>>()?;
    Ok((frames, levels))
}

/// For each pair of a level, whether the receiver sees the source in the last frame.
fn answers(native: &NativeGpu, frames: &Frames, k: u32, pairs: &[Pair]) -> Result<Vec<bool>, Error> {
    if pairs.is_empty() {
        return Ok(Vec::new());
    }
    let shader = &table::SHADERS[0];
    let entry = &shader.entry_points[0];
    let name = format!("gather_{k}");
    let gather = frames.plan().find(&name).ok_or_else(|| Error::Failed(format!("no pass is called {name}")))?;
    let device = &native.gpu.device;
    let buffer = |contents: &[u8], usage| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some("pairs"), contents, usage })
    };
    let view = frames.view();
    let display_size = view.display_size.map(|v| v as f32);
    let of_view =
        [("tan_half_fov", UniformValue::Vec2(view.tan_half_fov)), ("display_size", UniformValue::Vec2(display_size))];
    let asked = buffer(bytemuck::cast_slice(pairs), wgpu::BufferUsages::STORAGE);
    let answers = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("answers"),
        size: 4 * pairs.len() as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    // Everything else is bound as the gather binds it.
    let of_gather = |variable: &str| {
        let bound = gather.bindings.iter().find(|(name, _)| *name == variable);
        bound.map(|(_, id)| frames.plan().resources[id.0].name.as_str())
    };
    let mut uniforms = Vec::new();
    for binding in entry.bindings {
        if let BindingKind::Uniform { size, members } = &binding.kind {
            let values = if binding.name == "view" { &of_view[..] } else { &gather.params[..] };
            let bytes = packed(*size, members, values);
            uniforms.push((binding.name, buffer(&bytes, wgpu::BufferUsages::UNIFORM)));
        }
    }
    let mut views = Vec::new();
    for binding in entry.bindings {
        if let BindingKind::Texture { arrayed } = &binding.kind {
            let texture = of_gather(binding.name).and_then(|name| frames.texture(name));
            let texture = texture.ok_or_else(|| Error::Failed(format!("{name} binds no texture {}", binding.name)))?;
            let dimension = if *arrayed { wgpu::TextureViewDimension::D2Array } else { wgpu::TextureViewDimension::D2 };
            let view = wgpu::TextureViewDescriptor { dimension: Some(dimension), ..Default::default() };
            views.push((binding.name, texture.create_view(&view)));
        }
    }
    let mut entries = Vec::new();
    for binding in entry.bindings {
        let named = |(name, _): &&(&str, wgpu::Buffer)| *name == binding.name;
        let resource = match binding.name {
            "pairs" => asked.as_entire_binding(),
            "answers" => answers.as_entire_binding(),
            other => match (uniforms.iter().find(named), views.iter().find(|(name, _)| *name == other)) {
                (Some((_, uniform)), _) => uniform.as_entire_binding(),
                (_, Some((_, view))) => wgpu::BindingResource::TextureView(view),
                (None, None) => {
                    let buffer = of_gather(other).and_then(|name| frames.buffer(name));
                    let missing = || Error::Failed(format!("{name} binds no buffer {other}"));
                    buffer.ok_or_else(missing)?.as_entire_binding()
                }
            },
        };
        entries.push(wgpu::BindGroupEntry { binding: binding.index, resource });
    }
    let pipeline = native.gpu.compute_pipeline(shader, entry, &[]);
    let layout = pipeline.get_bind_group_layout(0);
    let group =
        device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries });
    let mut encoder = device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups((pairs.len() as u32).div_ceil(entry.workgroup_size[0]), 1, 1);
    }
    native.gpu.queue.submit([encoder.finish()]);
    let bytes = read_buffer(&native.gpu, &answers).map_err(|e| Error::Failed(e.to_string()))?;
    Ok(bytemuck::cast_slice::<u8, u32>(&bytes).iter().map(|&seen| seen == 1).collect())
}

/// A uniform block of this size with the values that are given; the functions under test read no others.
fn packed(size: u32, members: &[Member], values: &[(&str, UniformValue)]) -> Vec<u8> {
    let mut bytes = vec![0; size as usize];
    for member in members {
        let value = values.iter().find(|(name, _)| *name == member.name).map(|(_, value)| value);
        let at = member.offset as usize;
        if let Some(value) = value.map(UniformValue::bytes) {
            bytes[at..at + value.len()].copy_from_slice(value);
        }
    }
    bytes
}
