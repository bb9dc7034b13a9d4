//! Creates what a pass needs: pipelines, bind groups, textures and buffers.

use halflight_shared_shaders::{BindingKind, Shader, Stage};

use super::{Provider, ReadyDraw, ReadyPart, ReadyPass, resolve_history, tile::clear_pipeline};
use crate::{
    Gpu,
    plan::{DIVISION, Draw, FramePlan, Pass, ResourceId, Work},
};

pub(super) struct Maker<'a> {
    pub(super) gpu: &'a Gpu,
    pub(super) plan: &'a FramePlan,
    pub(super) textures: &'a [Option<wgpu::Texture>],
    pub(super) buffers: &'a [Option<wgpu::Buffer>],
    /// Of the display, then of each additional view.
    pub(super) views: &'a [wgpu::Buffer],
    pub(super) previous: Option<&'a [wgpu::Buffer]>,
    pub(super) scene: Option<&'a dyn Provider>,
}

impl Maker<'_> {
    pub(super) fn ready(&self, pass: &Pass, params: Option<&wgpu::Buffer>) -> ReadyPass {
        let shader = pass.shader;
        match &pass.work {
            Work::Dispatch { entry, .. } => {
                let entry = shader.entry_points.iter().find(|e| e.name == *entry).unwrap_or(&shader.entry_points[0]);
                debug_assert_eq!(entry.stage, Stage::Compute);
                let pipeline = self.gpu.compute_pipeline(shader, entry, &pass.constants);
                let group = |ping_pong| {
                    self.group(pass, shader, params, ping_pong, |index| pipeline.get_bind_group_layout(index))
                };
                let first = group(0);
                let alternates = pass.bindings.iter().any(|&(_, id)| resolve_history(self.plan, id, 1) != id);
                let groups = [first.clone(), if alternates { group(1) } else { first }];
                let parts = self.parts(pass, entry.workgroup_size, &pipeline);
                ReadyPass::Compute { pipeline, groups, parts }
            }
            Work::Draw { draws, targets, depth, tile } => {
                let formats: Vec<_> = targets.iter().map(|&id| self.texture(pass, id).format()).collect();
                let depth_format = self.texture(pass, depth.0).format();
                let formats = (formats.as_slice(), depth_format);
                let draws = draws.iter().map(|draw| self.draw(pass, draw, params, formats)).collect();
                let colors =
                    targets.iter().map(|&id| self.texture(pass, id).create_view(&Default::default())).collect();
                let depth = self.texture(pass, depth.0).create_view(&wgpu::TextureViewDescriptor {
                    dimension: Some(wgpu::TextureViewDimension::D2),
                    base_array_layer: depth.1,
                    array_layer_count: Some(1),
                    ..Default::default()
                });
                let tile = tile.map(|tile| (tile, clear_pipeline(self.gpu, depth_format)));
                ReadyPass::Draw { draws, colors, depth, tile }
            }
            Work::Voxelize { target, triangles } => {
                let target = self.texture(pass, *target);
                let pipeline = self.gpu.render_pipeline(shader, &pass.constants, (&[], target.format()), true);
                let group = self.group(pass, shader, params, 0, |index| pipeline.get_bind_group_layout(index));
                let target = target.create_view(&Default::default());
                let triangles = self.scene.and_then(|scene| scene.triangles(self.gpu, triangles));
                ReadyPass::Voxelize { pipeline, group, target, triangles }
            }
        }
    }

    /// The dispatches of a pass. Each binds its own part of one buffer.
    fn parts(&self, pass: &Pass, workgroup_size: [u32; 3], pipeline: &wgpu::ComputePipeline) -> Vec<ReadyPart> {
        /// Bytes between uniform blocks: the alignment that every device allows.
        const STRIDE: usize = 256;
        let parts = pass.parts(self.gpu.work_at_once);
        if !pass.shader.bindings().any(|binding| binding.name == DIVISION) {
            return parts.into_iter().map(|part| ReadyPart { part, group: None }).collect();
        }
        let mut blocks = vec![0; STRIDE * parts.len()];
        for (block, part) in blocks.chunks_mut(STRIDE).zip(&parts) {
            block[..16].copy_from_slice(bytemuck::bytes_of(&part.block(workgroup_size)));
        }
        let buffer = make_buffer(self.gpu, "divisions", &blocks, wgpu::BufferUsages::UNIFORM);
        let layout = pipeline.get_bind_group_layout(1);
        let ready = |(index, part)| {
            let binding = wgpu::BufferBinding {
                buffer: &buffer,
                offset: (index * STRIDE) as u64,
                size: wgpu::BufferSize::new(16),
            };
            let entry = wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::Buffer(binding) };
            let group = self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("division"),
                layout: &layout,
                entries: &[entry],
            });
            ReadyPart { part, group: Some(group) }
        };
        parts.into_iter().enumerate().map(ready).collect()
    }

    fn draw(
        &self,
        pass: &Pass,
        draw: &Draw,
        params: Option<&wgpu::Buffer>,
        formats: (&[wgpu::TextureFormat], wgpu::TextureFormat),
    ) -> ReadyDraw {
        let shader = draw.shader;
        let pipeline = self.gpu.render_pipeline(shader, &pass.constants, formats, false);
        let group = self.group(pass, shader, params, 0, |index| pipeline.get_bind_group_layout(index));
        let triangles = self.scene.and_then(|scene| scene.triangles(self.gpu, draw.triangles));
        ReadyDraw { pipeline, group, triangles }
    }

    fn texture(&self, pass: &Pass, id: ResourceId) -> &wgpu::Texture {
        self.textures[id.0]
            .as_ref()
            .unwrap_or_else(|| panic!("{}: no texture {}", pass.name, self.plan.resources[id.0].name))
    }

    fn group(
        &self,
        pass: &Pass,
        shader: &'static Shader,
        params: Option<&wgpu::Buffer>,
        ping_pong: usize,
        layout: impl Fn(u32) -> wgpu::BindGroupLayout,
    ) -> Option<wgpu::BindGroup> {
        enum Held {
            View(wgpu::TextureView),
            Buffer(wgpu::Buffer),
            Sampler(wgpu::Sampler),
        }
        let held: Vec<(u32, Held)> = shader
            .bindings()
            .filter(|binding| binding.name != DIVISION)
            .map(|binding| {
                let id = || {
                    let bound = pass.bindings.iter().find(|(name, _)| *name == binding.name);
                    let id = bound.map(|&(_, id)| resolve_history(self.plan, id, ping_pong));
                    id.unwrap_or_else(|| {
                        panic!("pass {} binds nothing to {} of {}", pass.name, binding.name, shader.name)
                    })
                };
                let held = match &binding.kind {
                    BindingKind::Uniform { .. } => {
                        let own = pass.view.map_or(0, |view| view + 1);
                        let buffer = match binding.name {
                            "view" => Some(&self.views[own]),
                            "previous" => self.previous.map(|buffers| &buffers[own]),
                            "params" => params,
                            _ => self.buffers[id().0].as_ref(),
                        };
                        let missing = || panic!("pass {} has no values for {}", pass.name, binding.name);
                        Held::Buffer(buffer.cloned().unwrap_or_else(missing))
                    }
                    BindingKind::Storage { .. } => Held::Buffer(
                        self.buffers[id().0]
                            .clone()
                            .unwrap_or_else(|| panic!("{}: no buffer {}", pass.name, self.plan.resources[id().0].name)),
                    ),
                    BindingKind::Texture { arrayed } => {
                        let dimension =
                            if *arrayed { wgpu::TextureViewDimension::D2Array } else { wgpu::TextureViewDimension::D2 };
                        Held::View(self.texture(pass, id()).create_view(&wgpu::TextureViewDescriptor {
                            dimension: Some(dimension),
                            ..Default::default()
                        }))
                    }
                    BindingKind::StorageTexture { .. } => {
                        Held::View(self.texture(pass, id()).create_view(&Default::default()))
                    }
                    BindingKind::Sampler { comparison } => {
                        Held::Sampler(self.gpu.device.create_sampler(&wgpu::SamplerDescriptor {
                            mag_filter: wgpu::FilterMode::Linear,
                            min_filter: wgpu::FilterMode::Linear,
                            // Depth is reversed: lit if the receiver is at least as near as the map.
                            compare: comparison.then_some(wgpu::CompareFunction::GreaterEqual),
                            ..Default::default()
                        }))
                    }
                };
                (binding.index, held)
            })
            .collect();
        let entries: Vec<_> = held
            .iter()
            .map(|(binding, held)| wgpu::BindGroupEntry {
                binding: *binding,
                resource: match held {
                    Held::View(view) => wgpu::BindingResource::TextureView(view),
                    Held::Buffer(buffer) => buffer.as_entire_binding(),
                    Held::Sampler(sampler) => wgpu::BindingResource::Sampler(sampler),
                },
            })
            .collect();
        (!entries.is_empty()).then(|| {
            self.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(&pass.name),
                layout: &layout(0),
                entries: &entries,
            })
        })
    }
}

pub(super) fn make_texture(
    gpu: &Gpu,
    name: &str,
    [width, height]: [u32; 2],
    layers: u32,
    format: wgpu::TextureFormat,
) -> wgpu::Texture {
    use wgpu::TextureUsages as Usage;
    let guaranteed = format.guaranteed_format_features(gpu.device.features()).allowed_usages;
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(name),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: guaranteed
            & (Usage::TEXTURE_BINDING
                | Usage::STORAGE_BINDING
                | Usage::RENDER_ATTACHMENT
                | Usage::COPY_SRC
                | Usage::COPY_DST),
        view_formats: &[],
    })
}

pub(super) fn make_buffer(gpu: &Gpu, name: &str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.filled_buffer(name, contents, usage)
}
