//! Recording of frames.

use std::{ops::Range, sync::MutexGuard};

use halflight_shared_shaders::BindingKind;

use super::{
    Changed, CompiledGraph, ReadyPart, ReadyPass, Triangles, frame_state::FrameState, tile::begin_tile, timer::Timer,
};
use crate::{Gpu, View, plan::Cause};

impl CompiledGraph {
    /// Records the passes of a frame that are due. `changed` is what the caller has changed since the last frame.
    ///
    /// All of them are in one command buffer, which a watchdog may end if its work is long: see
    /// [`CompiledGraph::commands`].
    pub fn record(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, view: &View, changed: Changed) {
        let state = self.begin_frame(gpu, view, changed);
        for (index, ran) in state.ran.iter().enumerate() {
            match (ran, &self.timer) {
                (Some(_), timer) => {
                    self.record_pass(encoder, index, state.ping_pong, timer.as_ref(), self.all_parts(index))
                }
                // An empty pass, for its timestamps.
                (None, Some(timer)) => drop(encoder.begin_compute_pass(&self.compute_descriptor(index, Some(timer)))),
                (None, None) => {}
            }
        }
        if let Some(timer) = &self.timer {
            timer.resolve(encoder);
        }
    }

    /// As [`CompiledGraph::record`], as command buffers that the caller submits one by one, in order. Each does at most
    /// [`Gpu::work_at_once`], because the watchdogs of some systems count the time of a submission and not that of a
    /// dispatch. It is one if the work is short.
    pub fn commands(&self, gpu: &Gpu, view: &View, changed: Changed) -> Vec<wgpu::CommandBuffer> {
        let state = self.begin_frame(gpu, view, changed);
        let new = || gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("frame") });
        let (mut commands, mut encoder, mut work) = (Vec::new(), new(), 0u64);
        for (index, ran) in state.ran.iter().enumerate() {
            match (ran, &self.timer) {
                (Some(_), timer) => {
                    for (range, own) in self.dispatches(index) {
                        if work > 0 && work.saturating_add(own) > gpu.work_at_once {
                            commands.push(std::mem::replace(&mut encoder, new()).finish());
                            work = 0;
                        }
                        work = work.saturating_add(own);
                        self.record_pass(&mut encoder, index, state.ping_pong, timer.as_ref(), range);
                    }
                }
                (None, Some(timer)) => drop(encoder.begin_compute_pass(&self.compute_descriptor(index, Some(timer)))),
                (None, None) => {}
            }
        }
        if let Some(timer) = &self.timer {
            timer.resolve(&mut encoder);
        }
        commands.push(encoder.finish());
        commands
    }

    /// As [`CompiledGraph::record`], with one command buffer per dispatch or draw, to measure passes by the CPU's clock if
    /// the device's timestamps are not reliable. None for passes that are not due.
    pub fn record_apart(&self, gpu: &Gpu, view: &View, changed: Changed) -> Vec<Vec<wgpu::CommandBuffer>> {
        let state = self.begin_frame(gpu, view, changed);
        let apart = |(index, ran): (usize, &Option<Cause>)| {
            let of_pass = |(range, _)| {
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                self.record_pass(&mut encoder, index, state.ping_pong, None, range);
                encoder.finish()
            };
            if ran.is_some() { self.dispatches(index).map(of_pass).collect() } else { Vec::new() }
        };
        state.ran.iter().enumerate().map(apart).collect()
    }

    /// Records one pass several times without timestamps, to measure its cost if timestamps are missing or coarse. Uses
    /// the view of the last frame.
    pub fn record_repeated(&self, encoder: &mut wgpu::CommandEncoder, pass: usize, times: u32) {
        let mut state = self.frame_state();
        // A pass that adds to a buffer leaves other results after several runs.
        state.mark(pass, Cause::Repeated);
        for _ in 0..times {
            self.record_pass(encoder, pass, state.ping_pong, None, self.all_parts(pass));
        }
    }

    /// All dispatches of a pass; one draw counts as one.
    fn all_parts(&self, pass: usize) -> Range<usize> {
        match &self.passes[pass] {
            ReadyPass::Compute { parts, .. } => 0..parts.len(),
            ReadyPass::Draw { .. } | ReadyPass::Voxelize { .. } => 0..1,
        }
    }

    /// Each dispatch of a pass, and its work.
    fn dispatches(&self, pass: usize) -> impl Iterator<Item = (Range<usize>, u64)> {
        let work = move |index: usize| match &self.passes[pass] {
            ReadyPass::Compute { parts, .. } => parts[index].part.work,
            ReadyPass::Draw { .. } | ReadyPass::Voxelize { .. } => 0,
        };
        self.all_parts(pass).map(move |index| (index..index + 1, work(index)))
    }

    /// Writes the uniform blocks of the frame's view and of the previous frame, and determines which passes are due.
    fn begin_frame(&self, gpu: &Gpu, view: &View, changed: Changed) -> MutexGuard<'_, FrameState> {
        if let Some(BindingKind::Uniform { size, members }) = self.view_layout {
            gpu.queue.write_buffer(&self.views[0], 0, &view.pack(*size, members));
            for (other, buffer) in self.plan.views.iter().zip(&self.views[1..]) {
                gpu.queue.write_buffer(buffer, 0, &view.of_planned(other).pack(*size, members));
            }
        }
        let mut state = self.frame_state();
        state.find_due(&self.dependencies, view, changed);
        let before = state.last.filter(|before| view.continues(before));
        let still = before.is_some_and(|before| view.is_static_since(&before));
        state.static_frames = if still { state.static_frames.saturating_add(1) } else { 0 };
        if let Some((buffers, BindingKind::Uniform { size, members })) = &self.previous {
            let block = view.pack_previous(before.as_ref(), state.static_frames, *size, members);
            gpu.queue.write_buffer(&buffers[0], 0, &block);
            for (other, buffer) in self.plan.views.iter().zip(&buffers[1..]) {
                // Additional views are static. If there is a previous frame, it was seen from the same position.
                let own = view.of_planned(other);
                let block = own.pack_previous(before.map(|_| &own), state.static_frames, *size, members);
                gpu.queue.write_buffer(buffer, 0, &block);
            }
        }
        state.last = Some(*view);
        state.ping_pong = 1 - state.ping_pong;
        state
    }

    /// Records these dispatches of a pass. The first one writes the timestamp of its beginning, the last one that of its
    /// end.
    fn record_pass(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        index: usize,
        ping_pong: usize,
        timer: Option<&Timer>,
        range: Range<usize>,
    ) {
        let label = Some(self.plan.passes[index].name.as_str());
        if range.start == 0 {
            for buffer in self.plan.passes[index].cleared.iter().filter_map(|&id| self.buffers[id.0].as_ref()) {
                encoder.clear_buffer(buffer, 0, None);
            }
        }
        let timestamps = timer.map(|timer| {
            let (query_set, query) = timer.queries_of(index);
            wgpu::RenderPassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: Some(query),
                end_of_pass_write_index: Some(query + 1),
            }
        });
        match &self.passes[index] {
            ReadyPass::Compute { pipeline, groups, parts } => {
                let (first, last) = (range.start == 0, range.end == parts.len());
                let timed = timer.filter(|_| first || last);
                let mut descriptor = self.compute_descriptor(index, timed);
                if let Some(timestamps) = &mut descriptor.timestamp_writes {
                    timestamps.beginning_of_pass_write_index =
                        timestamps.beginning_of_pass_write_index.filter(|_| first);
                    timestamps.end_of_pass_write_index = timestamps.end_of_pass_write_index.filter(|_| last);
                }
                let mut pass = encoder.begin_compute_pass(&descriptor);
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, &groups[ping_pong], &[]);
                for ReadyPart { part, group } in &parts[range] {
                    if group.is_some() {
                        pass.set_bind_group(1, group, &[]);
                    }
                    pass.dispatch_workgroups(part.count[0], part.count[1], 1);
                }
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

    fn compute_descriptor<'a>(&'a self, index: usize, timer: Option<&'a Timer>) -> wgpu::ComputePassDescriptor<'a> {
        wgpu::ComputePassDescriptor {
            label: Some(self.plan.passes[index].name.as_str()),
            timestamp_writes: timer.map(|timer| {
                let (query_set, query) = timer.queries_of(index);
                wgpu::ComputePassTimestampWrites {
                    query_set,
                    beginning_of_pass_write_index: Some(query),
                    end_of_pass_write_index: Some(query + 1),
                }
            }),
        }
    }
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

fn draw(pass: &mut wgpu::RenderPass, triangles: Option<&Triangles>) {
    let Some(Triangles { indices, ranges }) = triangles else { return };
    pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
    for range in ranges {
        pass.draw_indexed(range.clone(), 0, 0..1);
    }
}
