//! A plan on a device: textures, pipelines and bind groups, created once and recorded every frame.

use std::{
    collections::HashMap,
    ops::Range,
    sync::{Mutex, MutexGuard, PoisonError},
};

use halflight_shared_shaders::BindingKind;

use crate::{
    Gpu, View,
    plan::{FramePlan, Handle, Pass, Resource, ResourceId, ResourceKind, Tile},
    uniform,
};

mod history_state;
mod make;
mod tile;
mod timer;

pub use timer::PassTime;

use history_state::{HistoryState, adopt_histories, resolve_history};
use make::{Maker, make_buffer, make_texture};
use tile::begin_tile;
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
    history_state: Mutex<HistoryState>,
    timer: Option<Timer>,
}

enum ReadyPass {
    Compute {
        pipeline: wgpu::ComputePipeline,
        /// One for each ping-pong index. Both are the same if the pass binds no history.
        groups: [Option<wgpu::BindGroup>; 2],
        workgroups: [u32; 2],
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

/// Triangles that one pipeline draws.
struct ReadyDraw {
    pipeline: wgpu::RenderPipeline,
    group: Option<wgpu::BindGroup>,
    triangles: Option<Triangles>,
}

fn draw(pass: &mut wgpu::RenderPass, triangles: Option<&Triangles>) {
    let Some(Triangles { indices, ranges }) = triangles else { return };
    pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
    for range in ranges {
        pass.draw_indexed(range.clone(), 0, 0..1);
    }
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
        let mut textures: Vec<_> = plan
            .resources
            .iter()
            .map(|resource| match resource.kind {
                ResourceKind::Texture { size, layers, format } => {
                    Some(make_texture(gpu, &resource.name, size, layers, format))
                }
                ResourceKind::Previous { size, format, .. } => Some(make_texture(gpu, &resource.name, size, 1, format)),
                ResourceKind::External => externals.texture(&resource.name),
                ResourceKind::Data { .. } | ResourceKind::Buffer { .. } => None,
            })
            .collect();
        let mut history_state = HistoryState::default();
        if let Some(old) = old {
            let adopted = adopt_histories(&plan, &mut textures, old);
            // Either all histories are kept or none: with one missing, the previous frame is not what passes expect.
            if adopted {
                history_state = HistoryState { static_frames: 0, prepared: false, ..*old.history_state() };
            }
        }
        let data: Vec<_> = plan
            .resources
            .iter()
            .map(|resource| match &resource.kind {
                ResourceKind::Data { bytes, .. } => {
                    let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::UNIFORM;
                    Some(make_buffer(gpu, &resource.name, bytes, usage))
                }
                _ => None,
            })
            .collect();
        let buffers: Vec<_> = plan
            .resources
            .iter()
            .zip(&data)
            .map(|(resource, data)| match (&resource.kind, externals.scene) {
                (&ResourceKind::Buffer { size }, _) => Some(gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some(&resource.name),
                    size,
                    usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
                    mapped_at_creation: false,
                })),
                (ResourceKind::External, Some(scene)) => scene.buffer(gpu, &resource.name),
                _ => data.clone(),
            })
            .collect();
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
            history_state: Mutex::new(history_state),
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
        for ((old, new), buffer) in self.plan.passes.iter().zip(&plan.passes).zip(&self.params) {
            if let (true, Some(buffer), Some(block)) = (old.params != new.params, buffer, params_block(new)) {
                gpu.queue.write_buffer(buffer, 0, &block);
            }
        }
        for ((old, new), buffer) in self.plan.resources.iter().zip(&plan.resources).zip(&self.buffers) {
            if let (true, ResourceKind::Data { bytes, .. }, Some(buffer)) = (old.kind != new.kind, &new.kind, buffer) {
                gpu.queue.write_buffer(buffer, 0, bytes);
            }
        }
        if once_passes_change(&self.plan, plan) {
            self.history_state().prepared = false;
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

    /// A texture of the plan after the last frame. A history returns another texture after every frame.
    pub fn texture(&self, id: ResourceId) -> Option<&wgpu::Texture> {
        self.textures[resolve_history(&self.plan, id, self.history_state().ping_pong).0].as_ref()
    }

    /// The view of the last recorded frame.
    pub fn last_view(&self) -> Option<View> {
        self.history_state().last
    }

    /// Invalidates the history: the next frame starts as after a cut.
    pub fn reset_history(&self) {
        let mut history_state = self.history_state();
        (history_state.last, history_state.static_frames) = (None, 0);
    }

    /// Writes the buffers that depend on handles. `contents` returns the new bytes of a handle, as many as before.
    /// Every pass that reads such a buffer uses them in the next frame.
    pub fn write_changed(&self, gpu: &Gpu, mut contents: impl FnMut(Handle) -> Vec<u8>) {
        for (resource, buffer) in self.plan.resources.iter().zip(&self.buffers) {
            if let (ResourceKind::Data { handle: Some(handle), .. }, Some(buffer)) = (&resource.kind, buffer) {
                gpu.queue.write_buffer(buffer, 0, &contents(*handle));
            }
        }
    }

    fn history_state(&self) -> MutexGuard<'_, HistoryState> {
        self.history_state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A buffer of the plan.
    pub fn buffer(&self, id: ResourceId) -> Option<&wgpu::Buffer> {
        self.buffers[id.0].as_ref()
    }

    /// A result of the plan by name, for example `indirect`.
    pub fn output(&self, name: &str) -> Option<&wgpu::Texture> {
        self.plan.outputs.get(name).and_then(|&id| self.texture(id))
    }

    /// Records one frame. Nothing is allocated.
    pub fn record(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, view: &View) {
        let ping_pong = self.begin_frame(gpu, view);
        let prepared = std::mem::replace(&mut self.history_state().prepared, true);
        for index in 0..self.passes.len() {
            self.record_pass(encoder, index, ping_pong, self.timer.as_ref(), prepared);
        }
        if let Some(timer) = &self.timer {
            encoder.resolve_query_set(&timer.queries, 0..2 * self.passes.len() as u32, &timer.resolved, 0);
            encoder.copy_buffer_to_buffer(&timer.resolved, 0, &timer.readable, 0, timer.resolved.size());
        }
    }

    /// Records one command buffer per pass, to measure them by the CPU's clock if the device's timestamps are not
    /// reliable.
    pub fn record_apart(&self, gpu: &Gpu, view: &View) -> Vec<wgpu::CommandBuffer> {
        let ping_pong = self.begin_frame(gpu, view);
        let prepared = std::mem::replace(&mut self.history_state().prepared, true);
        (0..self.passes.len())
            .map(|index| {
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                self.record_pass(&mut encoder, index, ping_pong, None, prepared);
                encoder.finish()
            })
            .collect()
    }

    /// Records one pass several times without timestamps, to measure its cost if timestamps are missing or coarse. Uses
    /// the view of the last frame.
    pub fn record_repeated(&self, encoder: &mut wgpu::CommandEncoder, pass: usize, times: u32) {
        let ping_pong = self.history_state().ping_pong;
        for _ in 0..times {
            self.record_pass(encoder, pass, ping_pong, None, false);
        }
    }

    /// Writes the uniform blocks of the frame's view and of the previous frame. Returns the ping-pong index of the
    /// histories.
    fn begin_frame(&self, gpu: &Gpu, view: &View) -> usize {
        if let Some(BindingKind::Uniform { size, members }) = self.view_layout {
            gpu.queue.write_buffer(&self.views[0], 0, &view.pack(*size, members));
            for (other, buffer) in self.plan.views.iter().zip(&self.views[1..]) {
                gpu.queue.write_buffer(buffer, 0, &view.of_planned(other).pack(*size, members));
            }
        }
        let mut history_state = self.history_state();
        let before = history_state.last.filter(|before| view.continues(before));
        let still = before.is_some_and(|before| view.is_static_since(&before));
        history_state.static_frames = if still { history_state.static_frames.saturating_add(1) } else { 0 };
        if let Some((buffers, BindingKind::Uniform { size, members })) = &self.previous {
            let block = view.pack_previous(before.as_ref(), history_state.static_frames, *size, members);
            gpu.queue.write_buffer(&buffers[0], 0, &block);
            for (other, buffer) in self.plan.views.iter().zip(&buffers[1..]) {
                // Additional views are static. If there is a previous frame, it was seen from the same position.
                let own = view.of_planned(other);
                let block = own.pack_previous(before.map(|_| &own), history_state.static_frames, *size, members);
                gpu.queue.write_buffer(buffer, 0, &block);
            }
        }
        history_state.last = Some(*view);
        history_state.ping_pong = 1 - history_state.ping_pong;
        history_state.ping_pong
    }

    fn record_pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        index: usize,
        ping_pong: usize,
        timer: Option<&Timer>,
        prepared: bool,
    ) {
        // A pass that runs once leaves an empty pass, for its timestamps.
        let idle = prepared && self.plan.passes[index].once;
        let label = Some(self.plan.passes[index].name.as_str());
        let query = 2 * index as u32;
        for buffer in self.plan.passes[index].cleared.iter().filter_map(|&id| self.buffer(id)).filter(|_| !idle) {
            encoder.clear_buffer(buffer, 0, None);
        }
        let timestamps = timer.map(|timer| wgpu::RenderPassTimestampWrites {
            query_set: &timer.queries,
            beginning_of_pass_write_index: Some(query),
            end_of_pass_write_index: Some(query + 1),
        });
        let compute = wgpu::ComputePassDescriptor {
            label,
            timestamp_writes: timer.map(|timer| wgpu::ComputePassTimestampWrites {
                query_set: &timer.queries,
                beginning_of_pass_write_index: Some(query),
                end_of_pass_write_index: Some(query + 1),
            }),
        };
        if idle {
            drop(encoder.begin_compute_pass(&compute));
            return;
        }
        match &self.passes[index] {
            ReadyPass::Compute { pipeline, groups, workgroups } => {
                let mut pass = encoder.begin_compute_pass(&compute);
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &groups[ping_pong], &[]);
                pass.dispatch_workgroups(workgroups[0], workgroups[1], 1);
            }
            ReadyPass::Draw { draws, colors, depth, tile } => {
                let attachments: Vec<_> = colors
                    .iter()
                    .map(|view| {
                        Some(wgpu::RenderPassColorAttachment {
                            view,
                            depth_slice: None,
                            resolve_target: None,
                            ops: wgpu::Operations {
                                load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                                store: wgpu::StoreOp::Store,
                            },
                        })
                    })
                    .collect();
                // The other tiles of the layer stay as they are.
                let load = if tile.is_some() { wgpu::LoadOp::Load } else { wgpu::LoadOp::Clear(0.0) };
                let mut pass =
                    render_pass(encoder, label, &attachments, (depth, load, wgpu::StoreOp::Store), timestamps);
                if let Some((tile, clear)) = tile {
                    begin_tile(&mut pass, *tile, clear);
                }
                for ready in draws {
                    pass.set_pipeline(&ready.pipeline);
                    pass.set_bind_group(0, &ready.group, &[]);
                    draw(&mut pass, ready.triangles.as_ref());
                }
            }
            ReadyPass::Voxelize { pipeline, group, target, triangles } => {
                let target = (target, wgpu::LoadOp::Clear(0.0), wgpu::StoreOp::Discard);
                let mut pass = render_pass(encoder, label, &[], target, timestamps);
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, group, &[]);
                draw(&mut pass, triangles.as_ref());
            }
        }
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

/// Begins a render pass with cleared colour targets. `load` and `store` are those of its depth.
fn render_pass<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    label: Option<&str>,
    color_attachments: &[Option<wgpu::RenderPassColorAttachment>],
    (depth, load, store): (&wgpu::TextureView, wgpu::LoadOp<f32>, wgpu::StoreOp),
    timestamp_writes: Option<wgpu::RenderPassTimestampWrites>,
) -> wgpu::RenderPass<'a> {
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label,
        color_attachments,
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: depth,
            depth_ops: Some(wgpu::Operations { load, store }),
            stencil_ops: None,
        }),
        timestamp_writes,
        occlusion_query_set: None,
        multiview_mask: None,
    })
}

/// Whether numbers differ that a pass reads which runs once.
fn once_passes_change(old: &FramePlan, new: &FramePlan) -> bool {
    let changed = |id: &ResourceId| old.resources[id.0].kind != new.resources[id.0].kind;
    let mut passes = old.passes.iter().zip(&new.passes).filter(|(old, _)| old.once);
    passes.any(|(old, new)| old.params != new.params || new.bindings.iter().any(|(_, id)| changed(id)))
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
        (&old.name, old.shader, &old.constants, &old.bindings, &old.cleared, &old.work)
            == (&new.name, new.shader, &new.constants, &new.bindings, &new.cleared, &new.work)
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
