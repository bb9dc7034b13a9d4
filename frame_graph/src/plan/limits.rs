//! Whether a device can hold a plan, found before anything is made.

use std::fmt;

use halflight_shared_shaders::{BindingKind, EntryPoint};
use serde::Serialize;

use super::{FramePlan, Pass, ResourceId, ResourceKind, Work, bytes_in_words};

/// What a device allows.
#[derive(Clone, Debug, PartialEq)]
pub struct DeviceLimits {
    /// Limits of single textures, buffers and passes.
    pub limits: wgpu::Limits,
    /// Bytes that it holds in total; `None` where nobody knows.
    pub memory: Option<u64>,
}

impl DeviceLimits {
    /// What WebGPU guarantees in every browser. No browser tells its memory.
    pub fn browser() -> Self {
        Self { limits: wgpu::Limits::default(), memory: None }
    }
}

/// Size of a buffer or texture that the caller provides.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExternalSize {
    /// Bytes.
    pub bytes: u64,
    /// Bytes of one element, at least 1.
    pub element: u64,
    /// Its elements in words, for example `vertices`.
    pub elements: &'static str,
    /// Width and height, texels, and layers of a texture; `None` for a buffer. Only the number of layers grows with the
    /// scene.
    pub texture: Option<([u32; 2], u32)>,
}

impl ExternalSize {
    /// Elements in a layer of a texture.
    fn in_layer(&self) -> u64 {
        let layers = self.texture.map_or(1, |(_, layers)| layers.max(1));
        self.bytes / self.element.max(1) / u64::from(layers)
    }
}

/// A limit of devices.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Limit {
    /// Width or height of a texture, texels.
    TextureSide,
    /// Layers of a texture.
    TextureLayers,
    /// Bytes of a buffer that a pass binds as a storage buffer.
    StorageBinding,
    /// Bytes of a buffer that a pass binds as a uniform block.
    UniformBinding,
    /// Bytes of a buffer.
    Buffer,
    /// Workgroups of a pass along one axis.
    Workgroups,
    /// Textures that one stage of a pass reads.
    SampledTextures,
    /// Textures that one stage of a pass writes.
    StorageTextures,
    /// Storage buffers of one stage of a pass.
    StorageBuffers,
    /// Uniform blocks of one stage of a pass.
    UniformBlocks,
    /// Samplers of one stage of a pass.
    Samplers,
    /// Colour targets of a pass.
    ColorTargets,
    /// Bytes of all textures and buffers together.
    Memory,
}

/// All limits, in the order in which they are checked. A binding allows no more than a buffer, so it comes first: its
/// number is the one that fits.
const LIMITS: [Limit; 13] = [
    Limit::TextureSide,
    Limit::TextureLayers,
    Limit::StorageBinding,
    Limit::UniformBinding,
    Limit::Buffer,
    Limit::Workgroups,
    Limit::SampledTextures,
    Limit::StorageTextures,
    Limit::StorageBuffers,
    Limit::UniformBlocks,
    Limit::Samplers,
    Limit::ColorTargets,
    Limit::Memory,
];

impl Limit {
    fn is_bytes(self) -> bool {
        matches!(self, Self::Buffer | Self::StorageBinding | Self::UniformBinding | Self::Memory)
    }

    fn amount(self, value: u64) -> String {
        if self.is_bytes() { bytes_in_words(value) } else { value.to_string() }
    }

    /// What is limited, in words: "the buffer X NEEDS n".
    fn words(self) -> [&'static str; 2] {
        match self {
            Self::TextureSide => ["texture", "texels along a side"],
            Self::TextureLayers => ["texture", "layers"],
            Self::Buffer => ["buffer", ""],
            Self::StorageBinding => ["buffer", "in one storage binding"],
            Self::UniformBinding => ["buffer", "in one uniform binding"],
            Self::Workgroups => ["pass", "workgroups along an axis"],
            Self::SampledTextures => ["pass", "textures to read in one stage"],
            Self::StorageTextures => ["pass", "textures to write in one stage"],
            Self::StorageBuffers => ["pass", "storage buffers in one stage"],
            Self::UniformBlocks => ["pass", "uniform blocks in one stage"],
            Self::Samplers => ["pass", "samplers in one stage"],
            Self::ColorTargets => ["pass", "colour targets"],
            Self::Memory => ["frame", "in total"],
        }
    }
}

/// What a plan demands of one limit: the largest demand of any of its textures, buffers or passes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Demand {
    /// The limit.
    pub limit: Limit,
    /// Name of the texture, buffer or pass; of the largest resource for [`Limit::Memory`].
    pub of: String,
    /// What it needs, in the unit of the limit.
    pub needs: u64,
    /// What the device allows; `None` if nobody knows.
    pub allows: Option<u64>,
    /// The buffer or texture, if it is one of the caller.
    #[serde(skip)]
    pub external: Option<ExternalSize>,
}

impl Demand {
    /// Whether the device allows it.
    pub fn fits(&self) -> bool {
        self.allows.is_none_or(|allows| self.needs <= allows)
    }

    /// What is too large and by how much, without the fix: `the texture final needs 9000 texels along a side and this
    /// device allows 8192`.
    pub fn excess(&self) -> String {
        let [kind, unit] = self.limit.words();
        let of = if self.limit == Limit::Memory {
            format!("the frame, most of it {},", self.of)
        } else {
            format!("the {kind} {}", self.of)
        };
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        let allowed = self.allows.unwrap_or_default();
        let [mut needs, mut allows] = [self.needs, allowed].map(|value| self.limit.amount(value));
        if needs == allows {
            (needs, allows) = (format!("{} bytes", self.needs), allowed.to_string());
        }
        format!("{of} needs {needs}{unit} and this device allows {allows}")
    }

    /// How many elements fit, if the buffer or texture is one of the caller: `use at most 4.19 million vertices`.
    pub fn elements_that_fit(&self) -> Option<String> {
        let (size, allows) = (self.external?, self.allows?);
        let name = size.elements;
        let most = match self.limit {
            Limit::TextureLayers => allows.saturating_mul(size.in_layer()),
            _ => allows / size.element.max(1),
        };
        let most = if most < 1_000_000 {
            most.to_string()
        } else {
            // Rounded down, so that the number itself fits.
            format!("{:.2} million", (most / 10_000) as f64 / 100.0)
        };
        Some(format!("use at most {most} {name}"))
    }
}

/// One line: `33.55 MB of 134.22 MB  in one storage binding  scene.vertices`.
impl fmt::Display for Demand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [kind, unit] = self.limit.words();
        let allows = self.allows.map_or_else(|| "unknown".to_owned(), |allows| self.limit.amount(allows));
        let unit = if unit.is_empty() { kind } else { unit };
        write!(f, "{:>10} of {:<10}  {unit:<32}  {}", self.limit.amount(self.needs), allows, self.of)
    }
}

/// A plan that a device cannot hold: one sentence with the resource, what it needs, what the device allows and what
/// would fit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BeyondLimits {
    /// What is too large.
    pub demand: Box<Demand>,
    /// What would fit.
    pub fix: String,
}

impl fmt::Display for BeyondLimits {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.demand.excess(), self.fix)
    }
}

impl std::error::Error for BeyondLimits {}

/// The largest demand of each limit so far.
struct Largest<'a> {
    device: &'a DeviceLimits,
    found: Vec<Demand>,
}

impl Largest<'_> {
    fn add(&mut self, limit: Limit, of: &str, needs: u64) -> &mut Demand {
        let index = self.found.iter().position(|demand| demand.limit == limit).unwrap_or_else(|| {
            let allows = allowed(self.device, limit);
            self.found.push(Demand { limit, of: String::new(), needs: 0, allows, external: None });
            self.found.len() - 1
        });
        let largest = &mut self.found[index];
        if needs > largest.needs || largest.of.is_empty() {
            (largest.of, largest.needs, largest.external) = (of.to_owned(), needs, None);
        }
        largest
    }

    fn add_of(&mut self, limit: Limit, of: &str, needs: u64, external: Option<ExternalSize>) {
        let largest = self.add(limit, of, needs);
        if largest.of == of {
            largest.external = external;
        }
    }

    /// Adds a buffer or texture of the caller.
    fn add_external(&mut self, of: &str, size: ExternalSize) {
        match size.texture {
            None => self.add_of(Limit::Buffer, of, size.bytes, Some(size)),
            Some((side, layers)) => {
                self.add(Limit::TextureSide, of, side[0].max(side[1]).into());
                self.add_of(Limit::TextureLayers, of, layers.into(), Some(size));
            }
        }
    }
}

fn allowed(device: &DeviceLimits, limit: Limit) -> Option<u64> {
    let limits = &device.limits;
    Some(match limit {
        Limit::TextureSide => limits.max_texture_dimension_2d.into(),
        Limit::TextureLayers => limits.max_texture_array_layers.into(),
        Limit::Buffer => limits.max_buffer_size,
        Limit::StorageBinding => limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
        Limit::UniformBinding => limits.max_uniform_buffer_binding_size,
        Limit::Workgroups => limits.max_compute_workgroups_per_dimension.into(),
        Limit::SampledTextures => limits.max_sampled_textures_per_shader_stage.into(),
        Limit::StorageTextures => limits.max_storage_textures_per_shader_stage.into(),
        Limit::StorageBuffers => limits.max_storage_buffers_per_shader_stage.into(),
        Limit::UniformBlocks => limits.max_uniform_buffers_per_shader_stage.into(),
        Limit::Samplers => limits.max_samplers_per_shader_stage.into(),
        Limit::ColorTargets => limits.max_color_attachments.into(),
        Limit::Memory => return device.memory,
    })
}

/// A buffer or texture of the caller alone. A buffer is also compared with the limit of storage bindings.
///
/// # Errors
/// If the device cannot hold or bind it.
pub fn check_external(device: &DeviceLimits, name: &str, size: ExternalSize) -> Result<(), BeyondLimits> {
    let mut largest = Largest { device, found: Vec::new() };
    if size.texture.is_none() {
        largest.add_of(Limit::StorageBinding, name, size.bytes, Some(size));
    }
    largest.add_external(name, size);
    first_beyond(largest.found)
}

fn first_beyond(demands: Vec<Demand>) -> Result<(), BeyondLimits> {
    match demands.into_iter().find(|demand| !demand.fits()) {
        None => Ok(()),
        Some(demand) => {
            let fix = demand.elements_that_fit().unwrap_or_else(|| match demand.limit {
                Limit::TextureSide => {
                    let most = demand.allows.unwrap_or_default();
                    format!("use at most {most}x{most} texels")
                }
                _ => "use a smaller image, a smaller scene or fewer lights".to_owned(),
            });
            Err(BeyondLimits { demand: Box::new(demand), fix })
        }
    }
}

impl FramePlan {
    /// What the plan demands of each limit that it touches, in the order of [`Limit`]. `external` tells the sizes of
    /// buffers that the caller provides; `None` for one that it does not know.
    pub fn demands(&self, device: &DeviceLimits, external: &dyn Fn(&str) -> Option<ExternalSize>) -> Vec<Demand> {
        let mut largest = Largest { device, found: Vec::new() };
        let (memory, mut total, mut most) = (self.memory(), 0u64, (0, ""));
        for (index, resource) in self.resources.iter().enumerate() {
            let name = resource.name.as_str();
            let known = if matches!(resource.kind, ResourceKind::External { .. }) { external(name) } else { None };
            let bytes = bytes_of(&resource.kind, known);
            match resource.kind {
                ResourceKind::Texture { size, layers, .. } => {
                    largest.add(Limit::TextureSide, name, size[0].max(size[1]).into());
                    largest.add(Limit::TextureLayers, name, layers.into());
                }
                ResourceKind::Previous { size, .. } => {
                    largest.add(Limit::TextureSide, name, size[0].max(size[1]).into());
                }
                ResourceKind::Data { .. } | ResourceKind::Buffer { .. } => {
                    largest.add(Limit::Buffer, name, bytes);
                }
                ResourceKind::External { .. } => known.into_iter().for_each(|size| largest.add_external(name, size)),
            }
            if memory.owner(ResourceId(index)).0 == index {
                total = total.saturating_add(bytes);
            }
            if bytes > most.0 {
                most = (bytes, name);
            }
        }
        for pass in &self.passes {
            self.add_pass(pass, &mut largest, external);
        }
        largest.add(Limit::Memory, most.1, total);
        let mut demands = largest.found;
        demands.sort_by_key(|demand| LIMITS.iter().position(|limit| *limit == demand.limit));
        demands
    }

    fn add_pass(&self, pass: &Pass, largest: &mut Largest, external: &dyn Fn(&str) -> Option<ExternalSize>) {
        let bound = |name: &str| pass.bindings.iter().find(|(own, _)| *own == name).map(|&(_, id)| id);
        for binding in pass.shader.bindings() {
            let limit = match binding.kind {
                BindingKind::Storage { .. } => Limit::StorageBinding,
                BindingKind::Uniform { .. } => Limit::UniformBinding,
                _ => continue,
            };
            if let Some(ResourceId(index)) = bound(binding.name) {
                let resource = &self.resources[index];
                let known = if matches!(resource.kind, ResourceKind::External { .. }) {
                    external(&resource.name)
                } else {
                    None
                };
                let bytes = bytes_of(&resource.kind, known);
                largest.add_of(limit, &resource.name, bytes, known);
            }
        }
        for entry in pass.shader.entry_points {
            for (limit, count) in bindings_by_limit(entry) {
                largest.add(limit, &pass.name, count);
            }
        }
        match &pass.work {
            Work::Dispatch { entry, size } => {
                let entry = pass.shader.entry_points.iter().find(|own| own.name == *entry);
                let group = entry.map_or([1; 3], |entry| entry.workgroup_size);
                for axis in 0..2 {
                    let count = size[axis].div_ceil(group[axis].max(1));
                    largest.add(Limit::Workgroups, &pass.name, count.into());
                }
            }
            Work::Draw { targets, .. } => {
                largest.add(Limit::ColorTargets, &pass.name, targets.len() as u64);
            }
            Work::Voxelize { .. } => {}
        }
    }

    /// Checks the plan against a device. `external` as in [`FramePlan::demands`].
    ///
    /// # Errors
    /// The first limit, in the order of [`Limit`], that the plan exceeds.
    pub fn check(
        &self,
        device: &DeviceLimits,
        external: &dyn Fn(&str) -> Option<ExternalSize>,
    ) -> Result<(), BeyondLimits> {
        first_beyond(self.demands(device, external))
    }
}

/// Bytes of a resource; `known` is the size of one of the caller. Saturates instead of overflowing.
fn bytes_of(kind: &ResourceKind, known: Option<ExternalSize>) -> u64 {
    let texture = |size: [u32; 2], layers: u32, format: wgpu::TextureFormat| {
        let texel = format.block_copy_size(None).unwrap_or(4);
        [size[0], size[1], layers, texel].into_iter().fold(1u64, |product, v| product.saturating_mul(v.into()))
    };
    match kind {
        &ResourceKind::Texture { size, layers, format } => texture(size, layers, format),
        &ResourceKind::Previous { size, format, .. } => texture(size, 1, format),
        ResourceKind::Data { bytes, .. } => bytes.len() as u64,
        ResourceKind::Buffer { size } => *size,
        ResourceKind::External { .. } => known.map_or(0, |size| size.bytes),
    }
}

fn bindings_by_limit(entry: &EntryPoint) -> [(Limit, u64); 5] {
    let count = |wanted: fn(&BindingKind) -> bool| entry.bindings.iter().filter(|b| wanted(&b.kind)).count() as u64;
    [
        (Limit::SampledTextures, count(|kind| matches!(kind, BindingKind::Texture { .. }))),
        (Limit::StorageTextures, count(|kind| matches!(kind, BindingKind::StorageTexture { .. }))),
        (Limit::StorageBuffers, count(|kind| matches!(kind, BindingKind::Storage { .. }))),
        (Limit::UniformBlocks, count(|kind| matches!(kind, BindingKind::Uniform { .. }))),
        (Limit::Samplers, count(|kind| matches!(kind, BindingKind::Sampler { .. }))),
    ]
}

#[cfg(test)]
mod tests;
