//! A plan on a device: textures, pipelines and bind groups, created once and recorded every frame.

use std::{
    collections::HashMap,
    ops::Range,
    sync::{Mutex, MutexGuard, PoisonError},
};

use halflight_shared_shaders::BindingKind;

use crate::{
    Gpu, View,
    plan::{
        Cause, Dependencies, Dependency, DispatchPart, FramePlan, Handle, Memory, Pass, Resource, ResourceId,
        ResourceKind, Tile,
    },
    uniform,
};

mod frame_state;
mod make;
mod record;
mod tile;
mod timer;

pub use frame_state::Changed;
pub use timer::PassTime;

use frame_state::{FrameState, adopt_histories, resolve_history};
use make::{Maker, make_buffer, make_texture};
use timer::Timer;

/// Triangles that a pass draws.
#[derive(Clone, Debug)]
pub struct Triangles {
    /// Index buffer of `u32`, three per triangle.
    pub indices: wgpu::Buffer,
    /// Ranges of indices to draw, in order.
    pub ranges: Vec<Range<u32>>,
}

/// Buffers and triangles owned by the caller, for example those of a scene, by the names that a plan uses.
pub trait Provider {
    /// The buffer of this name; `None` if there is none.
    fn buffer(&self, gpu: &Gpu, name: &str) -> Option<wgpu::Buffer>;

    /// The texture of this name; `None` if there is none.
    fn texture(&self, name: &str) -> Option<wgpu::Texture>;

    /// The triangles of this name; `None` if there are none.
    fn triangles(&self, gpu: &Gpu, name: &str) -> Option<Triangles>;
}

/// External resources of a graph, by the names that the plan declared.
#[derive(Default)]
pub struct Externals<'a> {
    /// Buffers and triangles for passes that draw or read a scene.
    pub scene: Option<&'a dyn Provider>,
    /// Textures by name.
    pub textures: HashMap<&'static str, wgpu::Texture>,
    /// Whether every texture and buffer has memory of its own, so that all contents can be read after a frame. For checks
    /// and pictures of single steps; results are the same.
    pub keep_all: bool,
}

impl Externals<'_> {
    fn texture(&self, name: &str) -> Option<wgpu::Texture> {
        self.textures.get(name).cloned().or_else(|| self.scene?.texture(name))
    }
}

/// A plan with everything it needs on a device.
pub struct CompiledGraph {
    plan: FramePlan,
    textures: Vec<Option<wgpu::Texture>>,
    /// Buffers of the plan and of the scene, by resource.
    buffers: Vec<Option<wgpu::Buffer>>,
    passes: Vec<ReadyPass>,
    /// The uniform block `params` of each pass that has one.
    params: Vec<Option<wgpu::Buffer>>,
    /// The uniform block `view` of the display and of each additional view.
    views: Vec<wgpu::Buffer>,
    view_layout: Option<&'static BindingKind>,
    /// The uniform block `previous`, one per view, and its layout; `None` if no pass reads the previous frame.
    previous: Option<(Vec<wgpu::Buffer>, &'static BindingKind)>,
    dependencies: Dependencies,
    /// Where textures and buffers lie; `None` if each has memory of its own.
    memory: Option<Memory>,
    frame_state: Mutex<FrameState>,
    /// The contents of the buffers that depend on handles, as last written.
    written: Mutex<Vec<Option<Vec<u8>>>>,
    timer: Option<Timer>,
}

enum ReadyPass {
    Compute {
        pipeline: wgpu::ComputePipeline,
        /// One for each ping-pong index. Both are the same if the pass binds no history.
        groups: [Option<wgpu::BindGroup>; 2],
        /// Its dispatches, one after another.
        parts: Vec<ReadyPart>,
    },
    Draw {
        draws: Vec<ReadyDraw>,
        colors: Vec<wgpu::TextureView>,
        depth: wgpu::TextureView,
        /// The part of the depth target, and the pipeline that clears it.
        tile: Option<(Tile, wgpu::RenderPipeline)>,
    },
    Voxelize {
        pipeline: wgpu::RenderPipeline,
        group: Option<wgpu::BindGroup>,
        target: wgpu::TextureView,
        triangles: Option<Triangles>,
    },
}

/// One dispatch of a pass.
struct ReadyPart {
    part: DispatchPart,
    /// The uniform block `division`, if the shader has it.
    group: Option<wgpu::BindGroup>,
}

/// Triangles that one pipeline draws.
struct ReadyDraw {
    pipeline: wgpu::RenderPipeline,
    group: Option<wgpu::BindGroup>,
    triangles: Option<Triangles>,
}

impl CompiledGraph {
    /// Creates textures, pipelines and bind groups. Pipelines are shared with all other graphs on the same [`Gpu`].
    ///
    /// # Panics
    /// If an external resource of the plan is missing, or a pass does not bind a variable of its shader. These are
    /// mistakes of the calling program, not of its user.
    pub fn new(gpu: &Gpu, plan: FramePlan, externals: &Externals) -> Self {
        Self::with_histories(gpu, plan, externals, None)
    }

    /// Switches to another plan of the same scene, for example after a change of settings. Like [`CompiledGraph::new`],
    /// but histories of the same name, size and format are kept, and the old image fades into the new one as if the
    /// scene had changed. If a history of the plan has no match, none is kept.
    ///
    /// # Panics
    /// As [`CompiledGraph::new`].
    pub fn replan(&mut self, gpu: &Gpu, plan: FramePlan, externals: &Externals) {
        let new = Self::with_histories(gpu, plan, externals, Some(self));
        std::mem::replace(self, new).destroy_except(&self.textures);
    }

    fn with_histories(gpu: &Gpu, plan: FramePlan, externals: &Externals, old: Option<&CompiledGraph>) -> Self {
        let memory = (!externals.keep_all).then(|| plan.memory());
        // The owner of memory is made first, and all that lie in it are the same object.
        let owner = |index: usize| memory.as_ref().map_or(index, |memory| memory.owner(ResourceId(index)).0);
        let mut order: Vec<usize> = (0..plan.resources.len()).collect();
        order.sort_by_key(|&index| owner(index) != index);
        let mut textures: Vec<Option<wgpu::Texture>> = vec![None; plan.resources.len()];
        for &index in &order {
            let Resource { name, kind, .. } = &plan.resources[index];
            textures[index] = match *kind {
                _ if owner(index) != index => textures[owner(index)].clone(),
                ResourceKind::Texture { size, layers, format } => Some(make_texture(gpu, name, size, layers, format)),
                ResourceKind::Previous { size, format, .. } => Some(make_texture(gpu, name, size, 1, format)),
                ResourceKind::External { .. } => externals.texture(name),
                ResourceKind::Data { .. } | ResourceKind::Buffer { .. } => None,
            };
        }
        let mut frame_state = FrameState::new(plan.passes.len());
        if let Some(old) = old {
            let adopted = adopt_histories(&plan, &mut textures, old);
            // Either all histories are kept or none: with one missing, the previous frame is not what passes expect.
            if adopted {
                let old = old.frame_state();
                (frame_state.last, frame_state.ping_pong) = (old.last, old.ping_pong);
            }
        }
        let mut buffers: Vec<Option<wgpu::Buffer>> = vec![None; plan.resources.len()];
        for &index in &order {
            use wgpu::BufferUsages as Usage;
            let Resource { name, kind, .. } = &plan.resources[index];
            buffers[index] = match (kind, externals.scene) {
                _ if owner(index) != index => buffers[owner(index)].clone(),
                (ResourceKind::Data { bytes, .. }, _) => {
                    Some(make_buffer(gpu, name, bytes, Usage::STORAGE | Usage::UNIFORM))
                }
                (&ResourceKind::Buffer { size }, _) => Some(gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some(name),
                    size,
                    usage: Usage::STORAGE | Usage::COPY_SRC | Usage::COPY_DST,
                    mapped_at_creation: false,
                })),
                (ResourceKind::External { .. }, Some(scene)) => scene.buffer(gpu, name),
                _ => None,
            };
        }
        let block =
            |name| plan.passes.iter().flat_map(|pass| pass.shader.bindings()).find(|b| b.name == name).map(|b| &b.kind);
        let uniform = |label, size| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let view_layout = block("view");
        let for_views = |label| (0..=plan.views.len()).map(|_| uniform(label, 256)).collect::<Vec<_>>();
        let views = for_views("view");
        let previous = block("previous").map(|layout| (for_views("previous"), layout));
        let params: Vec<_> = plan.passes.iter().map(|pass| params_of(gpu, pass)).collect();
        let maker = Maker {
            gpu,
            plan: &plan,
            textures: &textures,
            buffers: &buffers,
            views: &views,
            previous: previous.as_ref().map(|(buffers, _)| buffers.as_slice()),
            scene: externals.scene,
        };
        let passes = plan.passes.iter().zip(&params).map(|(pass, params)| maker.ready(pass, params.as_ref())).collect();
        Self {
            passes,
            params,
            view_layout,
            previous,
            dependencies: Dependencies::of(&plan),
            memory,
            frame_state: Mutex::new(frame_state),
            written: Mutex::new(plan.resources.iter().map(|resource| handle_contents(&resource.kind)).collect()),
            timer: Timer::new(gpu, plan.passes.len()),
            plan,
            textures,
            buffers,
            views,
        }
    }

    /// Updates to a plan that differs only in numbers: uniform values and the contents of buffers, for example after a
    /// light moved. Returns false and changes nothing if other things differ.
    pub fn update(&mut self, gpu: &Gpu, plan: &FramePlan) -> bool {
        if !same_but_for_numbers(&self.plan, plan) {
            return false;
        }
        let mut state = self.frame_state.lock().unwrap_or_else(PoisonError::into_inner);
        for (index, (old, new)) in self.plan.passes.iter().zip(&plan.passes).enumerate() {
            if let (true, Some(buffer), Some(block)) =
                (old.params != new.params, &self.params[index], params_block(new))
            {
                gpu.queue.write_buffer(buffer, 0, &block);
                state.mark(index, Cause::Numbers);
            }
        }
        drop(state);
        for (index, (old, new)) in self.plan.resources.iter().zip(&plan.resources).enumerate() {
            if let (true, ResourceKind::Data { bytes, .. }) = (old.kind != new.kind, &new.kind) {
                self.write_data(gpu, ResourceId(index), bytes);
            }
        }
        self.plan.clone_from(plan);
        true
    }

    /// Frees the textures that the plan created. A browser otherwise keeps them until garbage collection.
    pub fn destroy(self) {
        self.destroy_except(&[]);
    }

    fn destroy_except(self, kept: &[Option<wgpu::Texture>]) {
        for (resource, texture) in self.plan.resources.iter().zip(&self.textures) {
            if let (ResourceKind::Texture { .. } | ResourceKind::Previous { .. }, Some(own)) = (&resource.kind, texture)
                && !kept.contains(texture)
            {
                own.destroy();
            }
        }
    }

    /// The compiled plan.
    pub fn plan(&self) -> &FramePlan {
        &self.plan
    }

    /// Whether some pass depends on results of the previous frame: see [`FramePlan::has_history`].
    pub fn has_history(&self) -> bool {
        self.dependencies.have_history()
    }

    /// A texture of the plan after the last frame; `None` if another one has taken over its memory (see
    /// [`Externals::keep_all`]). A history returns another texture after every frame.
    pub fn texture(&self, id: ResourceId) -> Option<&wgpu::Texture> {
        if !self.outlives_frame(id) {
            return None;
        }
        self.textures[resolve_history(&self.plan, id, self.frame_state().ping_pong).0].as_ref()
    }

    /// The view of the last recorded frame.
    pub fn last_view(&self) -> Option<View> {
        self.frame_state().last
    }

    /// Invalidates the history: the next frame starts as after a cut.
    pub fn reset_history(&self) {
        let mut state = self.frame_state();
        (state.last, state.static_frames) = (None, 0);
    }

    /// Writes the buffers that depend on handles. `contents` returns the new bytes of a handle, as many as before.
    /// Every pass that reads such a buffer uses them in the next frame.
    pub fn write_changed(&self, gpu: &Gpu, mut contents: impl FnMut(Handle) -> Vec<u8>) {
        for (index, resource) in self.plan.resources.iter().enumerate() {
            if let ResourceKind::Data { handle: Some(handle), .. } = resource.kind {
                self.write_data(gpu, ResourceId(index), &contents(handle));
            }
        }
    }

    /// Writes a buffer of the plan, unless it has these contents. The passes that read it run in the next frame.
    fn write_data(&self, gpu: &Gpu, id: ResourceId, bytes: &[u8]) {
        let Some(buffer) = &self.buffers[id.0] else { return };
        let mut written = self.written.lock().unwrap_or_else(PoisonError::into_inner);
        let known = &mut written[id.0];
        if known.as_deref() == Some(bytes) {
            return;
        }
        *known = Some(bytes.to_vec());
        gpu.queue.write_buffer(buffer, 0, bytes);
        let mut state = self.frame_state();
        for (index, pass) in self.plan.passes.iter().enumerate() {
            if let Some(cause) = reads_data(&self.plan, pass, id) {
                state.mark(index, cause);
            }
        }
    }

    fn frame_state(&self) -> MutexGuard<'_, FrameState> {
        self.frame_state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Why each pass ran in the last frame; `None` for passes that did not run.
    pub fn causes(&self) -> Vec<Option<Cause>> {
        self.frame_state().ran.clone()
    }

    /// A buffer of the plan after the last frame; `None` if another one has taken over its memory.
    pub fn buffer(&self, id: ResourceId) -> Option<&wgpu::Buffer> {
        self.buffers[id.0].as_ref().filter(|_| self.outlives_frame(id))
    }

    fn outlives_frame(&self, id: ResourceId) -> bool {
        self.memory.as_ref().is_none_or(|memory| memory.outlives_frame(id))
    }

    /// Whether textures and buffers that do not live at once share memory.
    pub fn shares_memory(&self) -> bool {
        self.memory.is_some()
    }

    /// A result of the plan by name, for example `indirect`.
    pub fn output(&self, name: &str) -> Option<&wgpu::Texture> {
        self.plan.outputs.get(name).and_then(|&id| self.texture(id))
    }

    /// The buffer to map after a frame to read its times; `None` if the device has no timestamps.
    pub fn timing_buffer(&self) -> Option<&wgpu::Buffer> {
        self.timer.as_ref().map(|timer| &timer.readable)
    }

    /// Times from the bytes of [`CompiledGraph::timing_buffer`].
    pub fn pass_times(&self, bytes: &[u8]) -> Vec<PassTime> {
        self.timer.as_ref().map(|timer| timer.pass_times(&self.plan, bytes)).unwrap_or_default()
    }
}

/// The contents of a pass's uniform block `params`; `None` if its shader has none.
fn params_block(pass: &Pass) -> Option<Vec<u8>> {
    let Some(BindingKind::Uniform { size, members }) = params_layout(pass) else { return None };
    Some(uniform::pack(*size, members, &pass.params, &pass.name))
}

/// The contents of a buffer that depends on a handle.
fn handle_contents(kind: &ResourceKind) -> Option<Vec<u8>> {
    match kind {
        ResourceKind::Data { bytes, handle: Some(_) } => Some(bytes.clone()),
        _ => None,
    }
}

/// Why a pass runs after a buffer of the plan has changed; `None` if it does not read the buffer.
fn reads_data(plan: &FramePlan, pass: &Pass, id: ResourceId) -> Option<Cause> {
    let handle = match plan.resources[id.0].kind {
        ResourceKind::Data { handle, .. } => handle,
        _ => None,
    };
    let cause = handle.map_or(Cause::Numbers, |handle| Cause::Changed(Dependency::Handle(handle)));
    pass.bindings.iter().any(|&(_, bound)| bound == id).then_some(cause)
}

fn same_but_for_numbers(old: &FramePlan, new: &FramePlan) -> bool {
    let same_resource = |(old, new): (&Resource, &Resource)| {
        old.name == new.name
            && match (&old.kind, &new.kind) {
                (ResourceKind::Data { bytes: old, handle: a }, ResourceKind::Data { bytes: new, handle: b }) => {
                    (old.len(), a) == (new.len(), b)
                }
                (old, new) => old == new,
            }
    };
    let same_pass = |(old, new): (&Pass, &Pass)| {
        (&old.name, old.shader, &old.constants, &old.bindings, &old.cleared, &old.parts, &old.work, old.cost)
            == (&new.name, new.shader, &new.constants, &new.bindings, &new.cleared, &new.parts, &new.work, new.cost)
    };
    old.display_size == new.display_size
        && old.views == new.views
        && old.outputs == new.outputs
        && old.resources.len() == new.resources.len()
        && old.passes.len() == new.passes.len()
        && old.resources.iter().zip(&new.resources).all(same_resource)
        && old.passes.iter().zip(&new.passes).all(same_pass)
}

/// Layout of the uniform block that holds a pass's own values.
fn params_layout(pass: &Pass) -> Option<&'static BindingKind> {
    pass.shader.bindings().find(|binding| binding.name == "params").map(|binding| &binding.kind)
}

fn params_of(gpu: &Gpu, pass: &Pass) -> Option<wgpu::Buffer> {
    let usage = wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST;
    params_block(pass).map(|block| make_buffer(gpu, &pass.name, &block, usage))
}
