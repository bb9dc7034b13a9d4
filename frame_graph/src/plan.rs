//! The plan of a frame: passes and resources as plain data, each with the reason why it is there.

use std::{collections::BTreeMap, fmt};

use glam::Mat4;
use halflight_shared_shaders::{BindingKind, Call, Shader, UniformValue};
use serde::Serialize;

mod display;

pub use display::bytes_in_words;

/// A texture or buffer of a plan, by its place in [`FramePlan::resources`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct ResourceId(pub usize);

/// Something that changes between frames, such as what a light looks at. The caller chooses the kinds and gives new
/// contents by handle: see [`crate::CompiledGraph::write_changed`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct Handle {
    /// What it is, by a name of the caller.
    pub kind: &'static str,
    /// Which one of its kind.
    pub index: u32,
}

/// What a resource is made of.
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
    /// A buffer filled with these bytes; once, or anew where what they depend on changes.
    Data {
        /// Contents.
        #[serde(skip)]
        bytes: Vec<u8>,
        /// What they depend on; `None` where they never change.
        handle: Option<Handle>,
    },
    /// A storage buffer that passes write.
    Buffer {
        /// Bytes.
        size: u64,
    },
    /// Given by the caller: a texture of another program, a buffer of the scene.
    External,
    /// What a texture of the plan held when the frame before ended. The two change places after every frame;
    /// nothing is copied.
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
    /// What it is made of.
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

    /// Bytes on the device; 0 for what the caller owns.
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
            ResourceKind::External => 0,
        }
    }
}

/// A texture that survives frames. Whether it says anything is known to the [`crate::CompiledGraph`]: after the first
/// frame, and until a cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct History {
    /// What the frame before wrote.
    pub before: ResourceId,
    /// What this frame writes, in full.
    pub now: ResourceId,
}

/// Which part of a frame a pass belongs to; a technique's time counts only its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Part {
    /// Depth, normals and materials of what the camera sees.
    GBuffer,
    /// Shadow maps and direct light.
    Direct,
    /// Everything that indirect light needs beyond those.
    Technique,
}

/// Triangles that a pass draws, and the shader that draws them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Draw {
    /// The pass's own shader, or a variant of it that binds no more than the pass does.
    #[serde(serialize_with = "name_of_shader")]
    pub shader: &'static Shader,
    /// Name under which the caller gives the triangles (see [`crate::Provider::triangles`]).
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
    /// Triangles that the caller gives (entry points `vertex` and, where the shader has one, `fragment`).
    Draw {
        /// Which triangles, in order.
        draws: Vec<Draw>,
        /// Colour targets, cleared to zero.
        targets: Vec<ResourceId>,
        /// Depth target and its layer, cleared to the far plane (0: depth is reversed).
        depth: (ResourceId, u32),
    },
    /// Triangles that the caller gives, hidden or not, over a target that stays as it is: the fragments write to buffers.
    Voxelize {
        /// Depth target that gives the size; nothing is written to it.
        target: ResourceId,
        /// Name under which the caller gives the triangles.
        triangles: &'static str,
    },
}

/// A view of the scene besides the display's: a camera with a G-buffer of its own, as large as the display.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlannedView {
    /// Names of its passes and textures begin with it.
    pub name: String,
    /// World to view space, in every frame.
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
    /// Buffers that are set to zero before it.
    pub cleared: Vec<ResourceId>,
    /// What runs.
    pub work: Work,
    /// Whether what it writes stays the same in every frame, so that it runs in the first one alone.
    pub once: bool,
    /// Part of the frame.
    pub part: Part,
    /// The view that it sees the scene from, by its place in [`FramePlan::views`]; `None` for the display's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view: Option<usize>,
    /// Why the plan has it.
    pub reason: String,
}

impl Pass {
    /// Resources that the pass reads, then those that it writes.
    pub fn reads_and_writes(&self) -> (Vec<ResourceId>, Vec<ResourceId>) {
        let shader = self.shader;
        let writes =
            |name: &str| {
                shader.entry_points.iter().flat_map(|entry| entry.bindings).filter(|b| b.name == name).any(|b| {
                    matches!(b.kind, BindingKind::StorageTexture { .. } | BindingKind::Storage { writable: true })
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
        (read.into_iter().map(|&(_, id)| id).collect(), written)
    }
}

/// Everything that a frame does, before any of it is recorded.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct FramePlan {
    /// Width and height of the display, pixels.
    pub display_size: [u32; 2],
    /// Textures and buffers.
    pub resources: Vec<Resource>,
    /// Passes in order.
    pub passes: Vec<Pass>,
    /// Views besides the display's.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub views: Vec<PlannedView>,
    /// The view that passes are planned for.
    #[serde(skip)]
    view: Option<usize>,
    /// Results by name: `depth`, `normal`, `albedo`, `direct`, `indirect`, `final`...
    pub outputs: BTreeMap<&'static str, ResourceId>,
    /// Numbers that belong to outputs, by a name that begins with the output's: `ambient_occlusion.radius`.
    pub attributes: BTreeMap<&'static str, f32>,
}

impl FramePlan {
    /// A plan without passes.
    pub fn new(display_size: [u32; 2]) -> Self {
        Self { display_size, ..Self::default() }
    }

    /// Adds a view, without passes so far.
    pub fn add_view(&mut self, name: impl Into<String>, world_to_view: Mat4, tan_half_fov: [f32; 2]) -> usize {
        self.views.push(PlannedView { name: name.into(), world_to_view, tan_half_fov });
        self.views.len() - 1
    }

    /// Plans passes that see the scene from a view. Their names and those of their textures begin with the view's, all are
    /// part of the technique, because nothing else needs the view, and the outputs stay those of the display.
    pub fn from_view<R>(&mut self, view: usize, plan: impl FnOnce(&mut Self) -> R) -> R {
        let outputs = self.outputs.clone();
        let before = self.view.replace(view);
        let result = plan(self);
        (self.view, self.outputs) = (before, outputs);
        result
    }

    /// A name in the view that is planned for; the scene's own buffers serve all views.
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

    /// The texture of this name, added where the plan has none yet: passes may write it anew once its readers are done.
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

    /// Adds a texture that survives frames: two textures that change places after every frame.
    pub fn history(&mut self, name: &str, size: [u32; 2], format: wgpu::TextureFormat, reason: &str) -> History {
        let now = self.texture(name, size, format, reason);
        let kind = ResourceKind::Previous { of: now, size, format };
        let before = self.resource(format!("{name}_before"), kind, format!("{reason}, of the frame before"));
        History { before, now }
    }

    /// Whether some texture survives frames.
    pub fn has_history(&self) -> bool {
        self.resources.iter().any(|resource| matches!(resource.kind, ResourceKind::Previous { .. }))
    }

    /// Adds a buffer with contents.
    pub fn data(&mut self, name: impl Into<String>, bytes: Vec<u8>, reason: impl Into<String>) -> ResourceId {
        self.resource(name, ResourceKind::Data { bytes, handle: None }, reason)
    }

    /// The buffer whose contents depend on this handle, added where the plan has none yet. All views share it.
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

    /// Adds a resource that the caller will give under this name.
    pub fn external(&mut self, name: impl Into<String>, reason: impl Into<String>) -> ResourceId {
        self.resource(name, ResourceKind::External, reason)
    }

    /// A buffer of the scene by its name, for example `scene.indices`; added to the plan where no pass has read it yet.
    pub fn scene_buffer(&mut self, name: &str, reason: &str) -> ResourceId {
        let known = self.resources.iter().position(|resource| resource.name == name);
        known.map_or_else(|| self.external(name, reason), ResourceId)
    }

    fn resource(&mut self, name: impl Into<String>, kind: ResourceKind, reason: impl Into<String>) -> ResourceId {
        let name = self.in_view(name.into());
        self.resources.push(Resource { name, kind, reason: reason.into() });
        ResourceId(self.resources.len() - 1)
    }

    /// Begins a pass of this name: one run of a shader. [`PassBuilder::over`], [`PassBuilder::draw`] or
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
                work,
                once: false,
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

    /// Bytes of all resources that passes of the technique write.
    pub fn technique_bytes(&self) -> u64 {
        let mut written: Vec<ResourceId> =
            self.passes.iter().filter(|p| p.part == Part::Technique).flat_map(|p| p.reads_and_writes().1).collect();
        written.sort();
        written.dedup();
        // What a history held before is as much of it as what it holds now.
        let before = self.resources.iter().filter(
            |resource| matches!(resource.kind, ResourceKind::Previous { of, .. } if written.binary_search(&of).is_ok()),
        );
        written.iter().map(|id| &self.resources[id.0]).chain(before).map(Resource::bytes).sum()
    }
}

/// A pass under construction.
pub struct PassBuilder<'a> {
    plan: &'a mut FramePlan,
    pass: Pass,
}

impl PassBuilder<'_> {
    /// Sets a buffer to zero before the pass.
    pub fn clear(mut self, buffer: ResourceId) -> Self {
        self.pass.cleared.push(buffer);
        self
    }

    /// Runs the pass in the first frame alone: nothing that it reads ever changes. Its time is that of this frame, and
    /// medians over frames leave it out.
    pub fn once(mut self, once: bool) -> Self {
        self.pass.once = once;
        self
    }

    /// Says why the pass is there.
    pub fn because(mut self, reason: impl Into<String>) -> Self {
        self.pass.reason = reason.into();
        self
    }

    /// Adds the pass: its compute shader over this many invocations.
    pub fn over(mut self, size: [u32; 2]) {
        let entry = self.pass.shader.entry_points[0].name;
        self.pass.work = Work::Dispatch { entry, size };
        self.plan.passes.push(self.pass);
    }

    /// Adds the pass: triangles into these targets, cleared before; each set of triangles by its own shader, `None` for
    /// the pass's.
    pub fn draw(
        mut self,
        triangles: impl IntoIterator<Item = (&'static str, Option<&'static Shader>)>,
        targets: Vec<ResourceId>,
        depth: (ResourceId, u32),
    ) {
        let own = self.pass.shader;
        let draw = |(triangles, shader): (_, Option<_>)| Draw { shader: shader.unwrap_or(own), triangles };
        let draws = triangles.into_iter().map(draw).collect();
        self.pass.work = Work::Draw { draws, targets, depth };
        self.plan.passes.push(self.pass);
    }

    /// Adds the pass: these triangles, hidden or not, at the size of this depth target.
    pub fn voxelize(mut self, target: ResourceId, triangles: &'static str) {
        self.pass.work = Work::Voxelize { target, triangles };
        self.plan.passes.push(self.pass);
    }
}
