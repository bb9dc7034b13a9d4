//! The plan of a frame: passes and resources as plain data, each with the reason for it.

use std::{collections::BTreeMap, fmt};

use glam::Mat4;
use halflight_shared_shaders::{BindingKind, Call, Shader, UniformValue};
use serde::Serialize;

mod dependencies;
mod display;
mod division;
mod limits;
mod memory;
mod pass_builder;
#[cfg(test)]
mod test_passes;

pub(crate) use dependencies::Dependencies;
pub use dependencies::{Cause, Dependency, When};
pub use display::bytes_in_words;
pub(crate) use division::{DIVISION, Part as DispatchPart};
pub use division::{WORK_ON_GPU, WORK_ON_PROCESSOR};
pub use limits::{BeyondLimits, Demand, DeviceLimits, ExternalSize, Limit, check_external};
pub use memory::Memory;
pub use pass_builder::{PassBuilder, Tile};

/// A texture or buffer of a plan, by its index in [`FramePlan::resources`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct ResourceId(pub usize);

/// Something that changes between frames, for example the matrix of a light. The caller chooses the kinds and provides
/// new contents by handle: see [`crate::CompiledGraph::write_changed`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct Handle {
    /// Kind, named by the caller.
    pub kind: &'static str,
    /// Index among its kind.
    pub index: u32,
}

impl Handle {
    /// Index of the only handle of its kind.
    pub const ONLY: u32 = u32::MAX;

    /// The only handle of this kind. Resources of the caller have one, with their name as its kind.
    pub const fn only(kind: &'static str) -> Self {
        Self { kind, index: Self::ONLY }
    }
}

/// Kind of a resource.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum ResourceKind {
    /// A 2D texture, or an array of them.
    Texture {
        /// Width and height, texels.
        size: [u32; 2],
        /// Array layers; 1 for a plain texture.
        layers: u32,
        /// Texel format.
        #[serde(serialize_with = "as_debug")]
        format: wgpu::TextureFormat,
    },
    /// A buffer with these contents. They are uploaded once, and again when the state behind the handle changes.
    Data {
        /// Contents.
        #[serde(skip)]
        bytes: Vec<u8>,
        /// What the contents depend on; `None` if they never change.
        handle: Option<Handle>,
    },
    /// A storage buffer that passes write.
    Buffer {
        /// Bytes.
        size: u64,
    },
    /// Provided by the caller: a texture of another program, or a buffer of the scene.
    External {
        /// What the contents depend on; `None` if they never change.
        handle: Option<Handle>,
    },
    /// The contents of a texture of the plan at the end of the previous frame. The two textures swap roles after every
    /// frame; nothing is copied.
    Previous {
        /// The texture that this frame writes.
        of: ResourceId,
        /// Width and height, texels.
        size: [u32; 2],
        /// Texel format.
        #[serde(serialize_with = "as_debug")]
        format: wgpu::TextureFormat,
    },
}

fn name_of_shader<S: serde::Serializer>(shader: &&'static Shader, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(shader.name)
}

fn as_debug<S: serde::Serializer>(value: &impl fmt::Debug, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&format_args!("{value:?}"))
}

/// A texture or buffer that passes read or write.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Resource {
    /// Unique name.
    pub name: String,
    /// Its kind.
    pub kind: ResourceKind,
    /// Why the plan has it.
    pub reason: String,
}

impl Resource {
    /// Format of a texture.
    pub fn format(&self) -> Option<wgpu::TextureFormat> {
        match self.kind {
            ResourceKind::Texture { format, .. } | ResourceKind::Previous { format, .. } => Some(format),
            _ => None,
        }
    }

    /// Bytes on the device; 0 for resources of the caller.
    pub fn bytes(&self) -> u64 {
        match &self.kind {
            ResourceKind::Texture { size: [w, h], layers, format } => {
                let texel = format.block_copy_size(None).unwrap_or(4);
                u64::from(*w) * u64::from(*h) * u64::from(*layers) * u64::from(texel)
            }
            ResourceKind::Previous { size: [w, h], format, .. } => {
                u64::from(*w) * u64::from(*h) * u64::from(format.block_copy_size(None).unwrap_or(4))
            }
            ResourceKind::Data { bytes, .. } => bytes.len() as u64,
            ResourceKind::Buffer { size } => *size,
            ResourceKind::External { .. } => 0,
        }
    }
}

/// A texture that persists between frames. The [`crate::CompiledGraph`] tracks whether its history is valid: it is not
/// in the first frame and after a cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct History {
    /// Written by the previous frame.
    pub before: ResourceId,
    /// Written by this frame, completely.
    pub now: ResourceId,
}

/// The part of a frame that a pass belongs to. A technique's time includes only its own part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// Depth, normals and materials of what the camera sees.
    GBuffer,
    /// Shadow maps and direct light.
    Direct,
    /// Everything else that indirect light needs.
    Technique,
}

/// Triangles that a pass draws, and the shader that draws them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Draw {
    /// The pass's own shader, or a variant of it with no additional bindings.
    #[serde(serialize_with = "name_of_shader")]
    pub shader: &'static Shader,
    /// Name of the triangles (see [`crate::Provider::triangles`]).
    pub triangles: &'static str,
}

/// What a pass runs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum Work {
    /// A compute shader over this many invocations.
    Dispatch {
        /// Entry point.
        entry: &'static str,
        /// Invocations along x and y.
        size: [u32; 2],
    },
    /// Triangles of the caller (entry points `vertex` and, if the shader has one, `fragment`).
    Draw {
        /// Which triangles, in order.
        draws: Vec<Draw>,
        /// Colour targets, cleared to zero.
        targets: Vec<ResourceId>,
        /// Depth target and its layer, cleared to the far plane (0: depth is reversed).
        depth: (ResourceId, u32),
        /// The part of the depth target's layer that is cleared and drawn; `None` for all of it.
        #[serde(skip_serializing_if = "Option::is_none")]
        tile: Option<Tile>,
    },
    /// Triangles of the caller, hidden ones included. The fragments write to buffers and the depth target stays
    /// unchanged.
    Voxelize {
        /// Depth target that defines the size. Nothing is written to it.
        target: ResourceId,
        /// Name of the triangles.
        triangles: &'static str,
    },
}

/// An additional view of the scene: a camera with its own G-buffer, of the display's size.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlannedView {
    /// Prefix of the names of its passes and textures.
    pub name: String,
    /// World to view space. It is the same in every frame.
    #[serde(serialize_with = "as_debug")]
    pub world_to_view: Mat4,
    /// Tangents of half the field of view, (horizontal, vertical).
    pub tan_half_fov: [f32; 2],
}

/// One pass: reads as "SHADER over WORK, with these bindings, because REASON".
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pass {
    /// Unique name; timings and tables use it.
    pub name: String,
    /// The shader.
    #[serde(serialize_with = "name_of_shader")]
    pub shader: &'static Shader,
    /// Values of pipeline-overridable constants that the shader has.
    pub constants: Vec<(&'static str, f64)>,
    /// Resources by the name of the WGSL variable.
    pub bindings: Vec<(&'static str, ResourceId)>,
    /// Fields of the uniform block `params`.
    pub params: Vec<(&'static str, UniformValue)>,
    /// Buffers that are cleared to zero before the pass.
    pub cleared: Vec<ResourceId>,
    /// Buffers of which the pass writes one part only, with the number of the part.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<(ResourceId, u32)>,
    /// Buffers that the pass reads although it also writes them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub continued: Vec<ResourceId>,
    /// What runs.
    pub work: Work,
    /// Work of one invocation of its compute shader: see [`PassBuilder::costs`].
    pub cost: u64,
    /// Part of the frame.
    pub part: Part,
    /// Index in [`FramePlan::views`] of the view that it renders; `None` for the display's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view: Option<usize>,
    /// Why the plan has it.
    pub reason: String,
}

impl Pass {
    /// Whether nothing of the earlier contents of a resource is left after the pass: a draw clears its targets.
    fn starts_anew(&self, id: ResourceId) -> bool {
        matches!(&self.work, Work::Draw { targets, depth, .. } if targets.contains(&id) || depth.0 == id)
    }

    /// Resources that the pass reads, then those that it writes.
    pub fn reads_and_writes(&self) -> (Vec<ResourceId>, Vec<ResourceId>) {
        let shader = self.shader;
        let writes = |name: &str| {
            shader.entry_points.iter().flat_map(|entry| entry.bindings).filter(|b| b.name == name).any(|b| {
                matches!(
                    b.kind,
                    BindingKind::StorageTexture { writable: true, .. } | BindingKind::Storage { writable: true }
                )
            })
        };
        let (written, read): (Vec<_>, Vec<_>) = self.bindings.iter().partition(|(name, _)| writes(name));
        let mut written: Vec<_> = written.into_iter().map(|&(_, id)| id).collect();
        if let Work::Draw { targets, depth, .. } = &self.work {
            written.extend(targets);
            written.push(depth.0);
        }
        if let Work::Voxelize { target, .. } = self.work {
            written.push(target);
        }
        let read = read.into_iter().map(|(_, id)| id).chain(&self.continued);
        (read.copied().collect(), written)
    }
}

/// Everything that a frame does, before it is recorded.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FramePlan {
    /// Width and height of the display, pixels.
    pub display_size: [u32; 2],
    /// Textures and buffers.
    pub resources: Vec<Resource>,
    /// Passes in order.
    pub passes: Vec<Pass>,
    /// Additional views.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub views: Vec<PlannedView>,
    /// The view that passes are currently added for.
    #[serde(skip)]
    view: Option<usize>,
    /// Results by name: `depth`, `normal`, `albedo`, `direct`, `indirect`, `final`...
    pub outputs: BTreeMap<&'static str, ResourceId>,
    /// Numbers that belong to outputs. Their names begin with the output's name: `ambient_occlusion.radius`.
    pub attributes: BTreeMap<&'static str, f32>,
    /// What a reader of the result must know, one sentence each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
}

impl FramePlan {
    /// A plan without passes.
    pub fn new(display_size: [u32; 2]) -> Self {
        Self { display_size, ..Self::default() }
    }

    /// Adds a view without passes.
    pub fn add_view(&mut self, name: impl Into<String>, world_to_view: Mat4, tan_half_fov: [f32; 2]) -> usize {
        self.views.push(PlannedView { name: name.into(), world_to_view, tan_half_fov });
        self.views.len() - 1
    }

    /// Plans passes of a view. The names of its passes and textures begin with the view's name. All belong to the
    /// technique, because nothing else needs the view. The outputs stay those of the display.
    pub fn from_view<R>(&mut self, view: usize, plan: impl FnOnce(&mut Self) -> R) -> R {
        let outputs = self.outputs.clone();
        let before = self.view.replace(view);
        let result = plan(self);
        (self.view, self.outputs) = (before, outputs);
        result
    }

    /// The name in the current view. The scene's own buffers serve all views.
    fn in_view(&self, name: String) -> String {
        match self.view {
            Some(view) if !name.starts_with("scene.") => format!("{}_{name}", self.views[view].name),
            _ => name,
        }
    }

    /// Adds a texture.
    pub fn texture(
        &mut self,
        name: impl Into<String>,
        size: [u32; 2],
        format: wgpu::TextureFormat,
        reason: impl Into<String>,
    ) -> ResourceId {
        self.texture_array(name, size, 1, format, reason)
    }

    /// The texture of this name, added if the plan has none yet. A pass may write it again after its readers.
    pub fn texture_again(
        &mut self,
        name: impl Into<String>,
        size: [u32; 2],
        format: wgpu::TextureFormat,
        reason: impl Into<String>,
    ) -> ResourceId {
        let name = name.into();
        let full = self.in_view(name.clone());
        let known = self.resources.iter().position(|resource| resource.name == full);
        known.map_or_else(|| self.texture(name, size, format, reason), ResourceId)
    }

    /// Adds an array of textures.
    pub fn texture_array(
        &mut self,
        name: impl Into<String>,
        size: [u32; 2],
        layers: u32,
        format: wgpu::TextureFormat,
        reason: impl Into<String>,
    ) -> ResourceId {
        self.resource(name, ResourceKind::Texture { size, layers, format }, reason)
    }

    /// Adds a texture that persists between frames: two textures that swap roles after every frame.
    pub fn history(&mut self, name: &str, size: [u32; 2], format: wgpu::TextureFormat, reason: &str) -> History {
        let now = self.texture(name, size, format, reason);
        let kind = ResourceKind::Previous { of: now, size, format };
        let before = self.resource(format!("{name}_before"), kind, format!("{reason}, of the frame before"));
        History { before, now }
    }

    /// Whether some texture persists between frames: pixels of the previous frame, which passes reproject.
    pub fn has_previous_images(&self) -> bool {
        self.resources.iter().any(|resource| matches!(resource.kind, ResourceKind::Previous { .. }))
    }

    /// Whether some pass depends on results of the previous frame.
    pub fn has_history(&self) -> bool {
        Dependencies::of(self).have_history()
    }

    /// Adds a buffer with contents.
    pub fn data(&mut self, name: impl Into<String>, bytes: Vec<u8>, reason: impl Into<String>) -> ResourceId {
        self.resource(name, ResourceKind::Data { bytes, handle: None }, reason)
    }

    /// The buffer whose contents depend on this handle, added if the plan has none yet. All views share it.
    pub fn changing_data(
        &mut self,
        handle: Handle,
        name: impl Into<String>,
        bytes: impl FnOnce() -> Vec<u8>,
        reason: impl Into<String>,
    ) -> ResourceId {
        let depends =
            |kind: &ResourceKind| matches!(kind, ResourceKind::Data { handle: Some(own), .. } if *own == handle);
        let known = self.resources.iter().position(|resource| depends(&resource.kind));
        known.map_or_else(
            || {
                let kind = ResourceKind::Data { bytes: bytes(), handle: Some(handle) };
                self.resources.push(Resource { name: name.into(), kind, reason: reason.into() });
                ResourceId(self.resources.len() - 1)
            },
            ResourceId,
        )
    }

    /// Adds a storage buffer of this many bytes.
    pub fn buffer(&mut self, name: impl Into<String>, size: u64, reason: impl Into<String>) -> ResourceId {
        self.resource(name, ResourceKind::Buffer { size }, reason)
    }

    /// Adds a resource that the caller provides under this name and may change between frames (see [`Handle::only`]).
    pub fn external(&mut self, name: &'static str, reason: impl Into<String>) -> ResourceId {
        self.resource(name, ResourceKind::External { handle: Some(Handle::only(name)) }, reason)
    }

    /// A buffer or texture of the scene that never changes, for example `scene.indices`, added if no pass has used it yet.
    pub fn scene_buffer(&mut self, name: &str, reason: &str) -> ResourceId {
        let known = self.resources.iter().position(|resource| resource.name == name);
        known.map_or_else(|| self.resource(name, ResourceKind::External { handle: None }, reason), ResourceId)
    }

    /// As [`FramePlan::scene_buffer`], for a buffer that may change between frames, for example `scene.lights`.
    pub fn changing_scene_buffer(&mut self, name: &'static str, reason: &str) -> ResourceId {
        let known = self.resources.iter().position(|resource| resource.name == name);
        known.map_or_else(|| self.external(name, reason), ResourceId)
    }

    fn resource(&mut self, name: impl Into<String>, kind: ResourceKind, reason: impl Into<String>) -> ResourceId {
        let name = self.in_view(name.into());
        self.resources.push(Resource { name, kind, reason: reason.into() });
        ResourceId(self.resources.len() - 1)
    }

    /// Begins a pass with this name: one run of a shader. [`PassBuilder::over`], [`PassBuilder::draw`] or
    /// [`PassBuilder::voxelize`] adds it.
    pub fn pass(&mut self, part: Part, name: impl Into<String>, call: impl Into<Call<ResourceId>>) -> PassBuilder<'_> {
        let (name, view) = (self.in_view(name.into()), self.view);
        let part = if view.is_some() { Part::Technique } else { part };
        let Call { shader, bindings, params, constants } = call.into();
        let work = Work::Dispatch { entry: shader.entry_points[0].name, size: [1, 1] };
        PassBuilder {
            plan: self,
            pass: Pass {
                name,
                shader,
                constants,
                bindings,
                params,
                cleared: Vec::new(),
                parts: Vec::new(),
                continued: Vec::new(),
                work,
                cost: 1,
                part,
                view,
                reason: String::new(),
            },
        }
    }

    /// The pass of this name.
    pub fn find(&self, name: &str) -> Option<&Pass> {
        self.passes.iter().find(|pass| pass.name == name)
    }
}
