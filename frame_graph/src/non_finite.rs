//! NaN/Inf check: counts, on the device, NaN, infinite, negative and clamped values in every texture and buffer of a
//! frame, and finds the largest magnitude. Only the counts are read back.

use halflight_shared_shaders::{
    Call,
    non_finite::{
        check_buffer::{self, CheckBuffer},
        check_texture::{self, CheckTexture},
    },
};
use wgpu::TextureFormat as Format;

use crate::{
    CompiledGraph, Gpu,
    plan::{FramePlan, ResourceId, ResourceKind},
};

/// Counts of a texture or buffer of a plan after a frame. Texels of whole numbers count by their first word, which is a
/// float: the depth of a surfel or of a history.
#[derive(Clone, Debug, PartialEq)]
pub struct ValueCounts {
    /// Name in the plan.
    pub name: String,
    /// Number of checked values.
    pub values: u64,
    /// Number of NaN values.
    pub nan: u32,
    /// Number of infinite values.
    pub infinite: u32,
    /// Number of finite values below zero. Radiance has none, normals do.
    pub negative: u32,
    /// Number of values at the largest number of the format: 65,504 for float16, otherwise 1e30.
    pub clamped: u32,
    /// Largest magnitude of the finite values.
    pub largest: f32,
}

impl ValueCounts {
    /// Number of NaN and infinite values.
    pub fn not_finite(&self) -> u64 {
        u64::from(self.nan) + u64::from(self.infinite)
    }
}

/// A recorded NaN/Inf check. Map [`NonFiniteCheck::readable`], then call [`NonFiniteCheck::counts`].
pub struct NonFiniteCheck {
    items: Vec<(String, u64)>,
    readable: wgpu::Buffer,
}

/// Bytes between two tallies: the largest storage buffer alignment that WebGPU allows.
const STRIDE: u64 = 256;
/// Bytes of a tally: five words.
const TALLY: u64 = 20;
/// Twins of LARGEST_FLOAT16 and LARGEST_RADIANCE in common/math.wgsl.
const LARGEST_FLOAT16: f32 = 65504.0;
const LARGEST_RADIANCE: f32 = 1e30;
/// Invocations in a row of the dispatch over a buffer. The dispatch is two-dimensional, because WebGPU guarantees only
/// 65,535 workgroups along one axis.
const ROW: u32 = 65536;

/// A resource to check.
enum Target<'a> {
    Layer { texture: &'a wgpu::Texture, layer: u32, how: How },
    Buffer(&'a wgpu::Buffer),
}

impl NonFiniteCheck {
    /// Records a check of everything that the graph's plan created, after all work that is submitted or recorded
    /// before. Textures of the caller and whole numbers (indices, bit sets) are left out.
    pub fn record(gpu: &Gpu, recording: &CompiledGraph, encoder: &mut wgpu::CommandEncoder) -> Self {
        let plan = recording.plan();
        let mut items = Vec::new();
        let mut targets: Vec<(usize, Target)> = Vec::new();
        for (index, resource) in plan.resources.iter().enumerate() {
            let id = ResourceId(index);
            match &resource.kind {
                ResourceKind::Texture { .. } | ResourceKind::Previous { .. } => {
                    let Some(texture) = recording.texture(id) else { continue };
                    let Some(how) = how(texture.format()) else { continue };
                    let layers = texture.depth_or_array_layers();
                    let values = u64::from(texture.width()) * u64::from(texture.height()) * u64::from(layers);
                    targets.extend((0..layers).map(|layer| (items.len(), Target::Layer { texture, layer, how })));
                    items.push((resource.name.clone(), values * u64::from(how.channels)));
                }
                ResourceKind::Buffer { size } if holds_floats(plan, id) => {
                    let Some(buffer) = recording.buffer(id) else { continue };
                    targets.push((items.len(), Target::Buffer(buffer)));
                    items.push((resource.name.clone(), size / 4));
                }
                _ => {}
            }
        }
        let buffer = |usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("scan"),
                size: STRIDE * items.len().max(1) as u64,
                usage,
                mapped_at_creation: false,
            })
        };
        let tallies = buffer(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
        let readable = buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
        {
            let mut pass = encoder
                .begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some("scan"), timestamp_writes: None });
            for (item, target) in &targets {
                record_target(gpu, &mut pass, target, &tallies, STRIDE * *item as u64);
            }
        }
        encoder.copy_buffer_to_buffer(&tallies, 0, &readable, 0, tallies.size());
        Self { items, readable }
    }

    /// The buffer to map when the device has finished.
    pub fn readable(&self) -> &wgpu::Buffer {
        &self.readable
    }

    /// The counts from the bytes of [`NonFiniteCheck::readable`], in the order of the plan.
    pub fn counts(&self, bytes: &[u8]) -> Vec<ValueCounts> {
        let tally = |(item, &(ref name, values)): (usize, &(String, u64))| {
            let word = |i: usize| {
                let at = item * STRIDE as usize + 4 * i;
                bytes.get(at..at + 4).map_or(0, bytemuck::pod_read_unaligned::<u32>)
            };
            ValueCounts {
                name: name.clone(),
                values,
                nan: word(0),
                infinite: word(1),
                negative: word(2),
                clamped: word(3),
                largest: f32::from_bits(word(4)),
            }
        };
        self.items.iter().enumerate().map(tally).collect()
    }
}

/// How to read a texture.
#[derive(Clone, Copy)]
struct How {
    /// Whether its texels are words of which the first one is a float.
    words: bool,
    /// Number of channels to check.
    channels: u32,
    /// Largest number that passes store in the format.
    limit: f32,
}

/// How to read a format; `None` for whole numbers, and for depth tests, which the rasterizer keeps between 0 and 1.
fn how(format: Format) -> Option<How> {
    let channels = u32::from(format.components());
    Some(match format {
        Format::Rgba32Uint | Format::Rg32Uint => How { words: true, channels: 1, limit: LARGEST_RADIANCE },
        Format::R16Float | Format::Rg16Float | Format::Rgba16Float => {
            How { words: false, channels, limit: LARGEST_FLOAT16 }
        }
        Format::R32Float | Format::Rg32Float | Format::Rgba32Float => {
            How { words: false, channels, limit: LARGEST_RADIANCE }
        }
        _ => return None,
    })
}

/// Whether a shader declares the buffer as floats. Whole numbers may have any bits.
fn holds_floats(plan: &FramePlan, id: ResourceId) -> bool {
    plan.passes.iter().any(|pass| {
        pass.bindings.iter().filter(|(_, bound)| *bound == id).any(|(variable, _)| {
            let declaration = format!("> {variable}: ");
            let rest = pass.shader.source.split_once(&declaration).map(|(_, rest)| rest);
            let kind = rest.and_then(|rest| rest.split(';').next()).unwrap_or_default();
            ["f32", "vec2f", "vec3f", "vec4f"].iter().any(|float| kind.contains(float))
        })
    })
}

/// The largest number that passes store in a texture of this format. Values at it were clamped.
pub fn largest_number(format: Format) -> f32 {
    how(format).map_or(LARGEST_RADIANCE, |how| how.limit)
}

fn record_target(gpu: &Gpu, pass: &mut wgpu::ComputePass, target: &Target, tallies: &wgpu::Buffer, offset: u64) {
    // Resources are bound by index below.
    let (values, tally) = ((), ());
    let (call, workgroups) = match *target {
        Target::Layer { texture, how: How { words, channels, limit }, .. } => {
            let constants = check_texture::Constants { limit, channels };
            let groups = [texture.width().div_ceil(16), texture.height().div_ceil(16)];
            (Call::from(CheckTexture { values, tally, words, constants }), groups)
        }
        Target::Buffer(buffer) => {
            let (words, row) = (buffer.size() / 4, u64::from(ROW));
            let constants = check_buffer::Constants { limit: LARGEST_RADIANCE, row: ROW };
            let groups = [words.min(row).div_ceil(256) as u32, words.div_ceil(row) as u32];
            (Call::from(CheckBuffer { values, tally, constants }), groups)
        }
    };
    let pipeline = gpu.compute_pipeline(call.shader, &call.shader.entry_points[0], &call.constants);
    let view = match *target {
        Target::Layer { texture, layer, .. } => Some(texture.create_view(&wgpu::TextureViewDescriptor {
            dimension: Some(wgpu::TextureViewDimension::D2),
            base_array_layer: layer,
            array_layer_count: Some(1),
            ..Default::default()
        })),
        Target::Buffer(_) => None,
    };
    let values = match (target, &view) {
        (Target::Buffer(buffer), _) => buffer.as_entire_binding(),
        (Target::Layer { .. }, Some(view)) => wgpu::BindingResource::TextureView(view),
        (Target::Layer { .. }, None) => return,
    };
    let tally = wgpu::BufferBinding { buffer: tallies, offset, size: std::num::NonZeroU64::new(TALLY) };
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("scan"),
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: values },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Buffer(tally) },
        ],
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &group, &[]);
    pass.dispatch_workgroups(workgroups[0], workgroups[1], 1);
}
