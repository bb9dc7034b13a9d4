//! Recording of frames.

use std::sync::MutexGuard;

use halflight_shared_shaders::BindingKind;

use super::{Changed, CompiledGraph, ReadyPass, Triangles, frame_state::FrameState, tile::begin_tile, timer::Timer};
use crate::{Gpu, View, plan::Cause};

impl CompiledGraph {
    /// Records the passes of a frame that are due. `changed` is what the caller has changed since the last frame.
    pub fn record(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, view: &View, changed: Changed) {
        let state = self.begin_frame(gpu, view, changed);
        for (index, ran) in state.ran.iter().enumerate() {
            match (ran, &self.timer) {
                (Some(_), timer) => self.record_pass(encoder, index, state.ping_pong, timer.as_ref()),
                // An empty pass, for its timestamps.
                (None, Some(timer)) => drop(encoder.begin_compute_pass(&self.compute_descriptor(index, Some(timer)))),
                (None, None) => {}
            }
        }
        if let Some(timer) = &self.timer {
            encoder.resolve_query_set(&timer.queries, 0..2 * self.passes.len() as u32, &timer.resolved, 0);
            encoder.copy_buffer_to_buffer(&timer.resolved, 0, &timer.readable, 0, timer.resolved.size());
        }
    }

    /// As [`CompiledGraph::record`], with one command buffer per pass, to measure them by the CPU's clock if the device's
    /// timestamps are not reliable. `None` for passes that are not due.
    pub fn record_apart(&self, gpu: &Gpu, view: &View, changed: Changed) -> Vec<Option<wgpu::CommandBuffer>> {
        let state = self.begin_frame(gpu, view, changed);
        let apart = |(index, ran): (usize, &Option<Cause>)| {
            ran.map(|_| {
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                self.record_pass(&mut encoder, index, state.ping_pong, None);
                encoder.finish()
            })
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
            self.record_pass(encoder, pass, state.ping_pong, None);
        }
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

    fn record_pass(&self, encoder: &mut wgpu::CommandEncoder, index: usize, ping_pong: usize, timer: Option<&Timer>) {
        let label = Some(self.plan.passes[index].name.as_str());
        let query = 2 * index as u32;
        for buffer in self.plan.passes[index].cleared.iter().filter_map(|&id| self.buffer(id)) {
            encoder.clear_buffer(buffer, 0, None);
        }
        let timestamps = timer.map(|timer| wgpu::RenderPassTimestampWrites {
            query_set: &timer.queries,
            beginning_of_pass_write_index: Some(query),
            end_of_pass_write_index: Some(query + 1),
        });
        match &self.passes[index] {
            ReadyPass::Compute { pipeline, groups, workgroups } => {
                let mut pass = encoder.begin_compute_pass(&self.compute_descriptor(index, timer));
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

    fn compute_descriptor<'a>(&'a self, index: usize, timer: Option<&'a Timer>) -> wgpu::ComputePassDescriptor<'a> {
        let query = 2 * index as u32;
        wgpu::ComputePassDescriptor {
            label: Some(self.plan.passes[index].name.as_str()),
            timestamp_writes: timer.map(|timer| wgpu::ComputePassTimestampWrites {
                query_set: &timer.queries,
                beginning_of_pass_write_index: Some(query),
                end_of_pass_write_index: Some(query + 1),
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
