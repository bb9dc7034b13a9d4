//! A plan on a device: textures, pipelines and bind groups made once, then recorded every frame.

use std::collections::HashMap;

use halflight_shared_shaders::{Binding, BindingKind, Stage};
use serde::Serialize;
use wgpu::util::DeviceExt;

use crate::{
    Gpu, SceneBuffers, View,
    gpu::known_shader,
    plan::{FramePlan, Part, Pass, Resource, ResourceId, ResourceKind, Work},
    uniform,
};

/// What the caller gives to a recording: the scene's buffers, and textures by the names that the plan
/// declared as external.
#[derive(Default)]
pub struct Externals<'a> {
    /// Buffers for passes that draw or read the scene.
    pub scene: Option<&'a SceneBuffers>,
    /// Textures by name.
    pub textures: HashMap<&'static str, wgpu::Texture>,
}

/// A plan with everything it needs on a device.
pub struct Recording {
    plan: FramePlan,
    textures: Vec<Option<wgpu::Texture>>,
    buffers: Vec<Option<wgpu::Buffer>>,
    passes: Vec<ReadyPass>,
    /// Uniform block `params` of each pass that has one.
    params: Vec<Option<wgpu::Buffer>>,
    view: wgpu::Buffer,
    view_layout: Option<&'static BindingKind>,
    indices: Option<(wgpu::Buffer, u32)>,
    timer: Option<Timer>,
}

enum ReadyPass {
    Compute {
        pipeline: wgpu::ComputePipeline,
        group: Option<wgpu::BindGroup>,
        workgroups: [u32; 2],
    },
    Draw {
        pipeline: wgpu::RenderPipeline,
        group: Option<wgpu::BindGroup>,
        colors: Vec<wgpu::TextureView>,
        depth: wgpu::TextureView,
    },
}

struct Timer {
    queries: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    readable: wgpu::Buffer,
    nanoseconds: f32,
}

/// Time of one pass in one frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PassTime {
    /// Name of the pass.
    pub name: String,
    /// Part of the frame.
    pub part: Part,
    /// Milliseconds on the device.
    pub milliseconds: f64,
}

impl Recording {
    /// Makes textures, pipelines and bind groups. Pipelines are shared with every other recording on
    /// the same [`Gpu`].
    ///
    /// # Panics
    /// Where an external of the plan is not given, or a pass does not bind a variable of its shader:
    /// mistakes of the program that calls, not of its user.
    pub fn new(gpu: &Gpu, plan: FramePlan, externals: &Externals) -> Self {
        let textures: Vec<_> = plan
            .resources
            .iter()
            .map(|resource| match resource.kind {
                ResourceKind::Texture { size, layers, format } => {
                    Some(make_texture(gpu, &resource.name, size, layers, format))
                }
                ResourceKind::External => externals.textures.get(resource.name.as_str()).cloned(),
                ResourceKind::Data { .. } => None,
            })
            .collect();
        let buffers: Vec<_> = plan
            .resources
            .iter()
            .map(|resource| match (&resource.kind, externals.scene) {
                (ResourceKind::Data { bytes }, _) => Some(make_buffer(
                    gpu,
                    &resource.name,
                    bytes,
                    wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
                )),
                (ResourceKind::External, Some(scene)) => scene.by_name(&resource.name).cloned(),
                _ => None,
            })
            .collect();
        let view_layout =
            plan.passes.iter().flat_map(|pass| bindings(pass)).find(|b| b.name == "view").map(|b| &b.kind);
        let view = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("view"),
            size: 256,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let params: Vec<_> = plan
            .passes
            .iter()
            .map(|pass| {
                let block = params_block(pass)?;
                Some(make_buffer(gpu, &pass.name, &block, wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST))
            })
            .collect();
        let maker = Maker { gpu, plan: &plan, textures: &textures, buffers: &buffers, view: &view };
        let passes = plan.passes.iter().zip(&params).map(|(pass, params)| maker.ready(pass, params.as_ref())).collect();
        Self {
            passes,
            params,
            view_layout,
            indices: externals.scene.map(|scene| (scene.indices.clone(), scene.index_count)),
            timer: Timer::new(gpu, plan.passes.len()),
            plan,
            textures,
            buffers,
            view,
        }
    }

    /// Takes over a plan that differs from the recorded one only in numbers: uniform values and the contents of
    /// buffers, as where a light moved. Returns false, and changes nothing, where more than that differs.
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
            if let (true, ResourceKind::Data { bytes }, Some(buffer)) = (old.kind != new.kind, &new.kind, buffer) {
                gpu.queue.write_buffer(buffer, 0, bytes);
            }
        }
        self.plan.clone_from(plan);
        true
    }

    /// Frees the textures that the plan made. A browser otherwise keeps them until it collects garbage.
    pub fn destroy(self) {
        for (resource, texture) in self.plan.resources.iter().zip(&self.textures) {
            if let (ResourceKind::Texture { .. }, Some(texture)) = (&resource.kind, texture) {
                texture.destroy();
            }
        }
    }

    /// The plan that was recorded.
    pub fn plan(&self) -> &FramePlan {
        &self.plan
    }

    /// A texture of the plan.
    pub fn texture(&self, id: ResourceId) -> Option<&wgpu::Texture> {
        self.textures[id.0].as_ref()
    }

    /// A result of the plan by name, for example `indirect`.
    pub fn output(&self, name: &str) -> Option<&wgpu::Texture> {
        self.plan.outputs.get(name).and_then(|&id| self.texture(id))
    }

    /// Adds one frame to an encoder. Nothing is allocated.
    pub fn record(&self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder, view: &View) {
        self.set_view(gpu, view);
        for index in 0..self.passes.len() {
            self.record_pass(encoder, index, self.timer.as_ref());
        }
        if let Some(timer) = &self.timer {
            encoder.resolve_query_set(&timer.queries, 0..2 * self.passes.len() as u32, &timer.resolved, 0);
            encoder.copy_buffer_to_buffer(&timer.resolved, 0, &timer.readable, 0, timer.resolved.size());
        }
    }

    /// One command buffer for each pass, to time them apart by the computer's clock where the
    /// device's timestamps cannot be trusted.
    pub fn record_apart(&self, gpu: &Gpu, view: &View) -> Vec<wgpu::CommandBuffer> {
        self.set_view(gpu, view);
        (0..self.passes.len())
            .map(|index| {
                let mut encoder = gpu.device.create_command_encoder(&Default::default());
                self.record_pass(&mut encoder, index, None);
                encoder.finish()
            })
            .collect()
    }

    /// Adds one pass to an encoder, this many times over and without timestamps: the way to learn what it costs where
    /// timestamps are missing or coarse. Uses the view of the last frame.
    pub fn record_repeated(&self, encoder: &mut wgpu::CommandEncoder, pass: usize, times: u32) {
        for _ in 0..times {
            self.record_pass(encoder, pass, None);
        }
    }

    fn set_view(&self, gpu: &Gpu, view: &View) {
        if let Some(BindingKind::Uniform { size, members }) = self.view_layout {
            gpu.queue.write_buffer(&self.view, 0, &view.pack(*size, members));
        }
    }

    fn record_pass(&self, encoder: &mut wgpu::CommandEncoder, index: usize, timer: Option<&Timer>) {
        let label = Some(self.plan.passes[index].name.as_str());
        let query = 2 * index as u32;
        match &self.passes[index] {
            ReadyPass::Compute { pipeline, group, workgroups } => {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                    label,
                    timestamp_writes: timer.map(|timer| wgpu::ComputePassTimestampWrites {
                        query_set: &timer.queries,
                        beginning_of_pass_write_index: Some(query),
                        end_of_pass_write_index: Some(query + 1),
                    }),
                });
                pass.set_pipeline(pipeline);
                pass.set_bind_group(0, group, &[]);
                pass.dispatch_workgroups(workgroups[0], workgroups[1], 1);
            }
            ReadyPass::Draw { pipeline, group, colors, depth } => {
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
                let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                    label,
                    color_attachments: &attachments,
                    depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                        view: depth,
                        depth_ops: Some(wgpu::Operations {
                            load: wgpu::LoadOp::Clear(0.0),
                            store: wgpu::StoreOp::Store,
                        }),
                        stencil_ops: None,
                    }),
                    timestamp_writes: timer.map(|timer| wgpu::RenderPassTimestampWrites {
                        query_set: &timer.queries,
                        beginning_of_pass_write_index: Some(query),
                        end_of_pass_write_index: Some(query + 1),
                    }),
                    occlusion_query_set: None,
                    multiview_mask: None,
                });
                if let Some((indices, count)) = &self.indices {
                    pass.set_pipeline(pipeline);
                    pass.set_bind_group(0, group, &[]);
                    pass.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint32);
                    pass.draw_indexed(0..*count, 0, 0..1);
                }
            }
        }
    }

    /// The buffer to map after a frame to learn its times; `None` where the device has no timestamps.
    pub fn timing_buffer(&self) -> Option<&wgpu::Buffer> {
        self.timer.as_ref().map(|timer| &timer.readable)
    }

    /// Times from the bytes of [`Recording::timing_buffer`].
    pub fn pass_times(&self, bytes: &[u8]) -> Vec<PassTime> {
        let nanoseconds = self.timer.as_ref().map_or(0.0, |timer| f64::from(timer.nanoseconds));
        let ticks: &[[u64; 2]] = bytemuck::cast_slice(bytes);
        self.plan
            .passes
            .iter()
            .zip(ticks)
            .map(|(pass, [begin, end])| PassTime {
                name: pass.name.clone(),
                part: pass.part,
                // A clock that was reset between the two would otherwise give a huge number.
                milliseconds: end.saturating_sub(*begin) as f64 * nanoseconds * 1e-6,
            })
            .collect()
    }
}

impl Timer {
    fn new(gpu: &Gpu, passes: usize) -> Option<Self> {
        let nanoseconds = gpu.timestamp_period?;
        let count = 2 * u32::try_from(passes).ok().filter(|&n| n > 0 && 2 * n <= wgpu::QUERY_SET_MAX_QUERIES)?;
        let buffer = |label, usage| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: u64::from(count) * 8,
                usage,
                mapped_at_creation: false,
            })
        };
        Some(Self {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("pass times"),
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            resolved: buffer("timestamps", wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            readable: buffer("timestamps to read", wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST),
            nanoseconds,
        })
    }
}

/// The contents of a pass's uniform block `params`; `None` where its shader has none.
fn params_block(pass: &Pass) -> Option<Vec<u8>> {
    bindings(pass).into_iter().find_map(|binding| match &binding.kind {
        BindingKind::Uniform { size, members } if binding.name != "view" => {
            Some(uniform::pack(*size, members, &pass.params, &pass.name))
        }
        _ => None,
    })
}

fn same_but_for_numbers(old: &FramePlan, new: &FramePlan) -> bool {
    let same_resource = |(old, new): (&Resource, &Resource)| {
        old.name == new.name
            && match (&old.kind, &new.kind) {
                (ResourceKind::Data { bytes: old }, ResourceKind::Data { bytes: new }) => old.len() == new.len(),
                (old, new) => old == new,
            }
    };
    let same_pass = |(old, new): (&Pass, &Pass)| {
        (&old.name, &old.shader, &old.constants, &old.bindings, &old.work)
            == (&new.name, &new.shader, &new.constants, &new.bindings, &new.work)
    };
    old.display_size == new.display_size
        && old.outputs == new.outputs
        && old.resources.len() == new.resources.len()
        && old.passes.len() == new.passes.len()
        && old.resources.iter().zip(&new.resources).all(same_resource)
        && old.passes.iter().zip(&new.passes).all(same_pass)
}

/// Distinct resource variables of a pass's shader.
fn bindings(pass: &Pass) -> Vec<&'static Binding> {
    let shader = known_shader(&pass.shader);
    let mut all: Vec<&Binding> = Vec::new();
    for binding in shader.entry_points.iter().flat_map(|entry| entry.bindings) {
        if !all.iter().any(|other| other.name == binding.name) {
            all.push(binding);
        }
    }
    all
}

struct Maker<'a> {
    gpu: &'a Gpu,
    plan: &'a FramePlan,
    textures: &'a [Option<wgpu::Texture>],
    buffers: &'a [Option<wgpu::Buffer>],
    view: &'a wgpu::Buffer,
}

impl Maker<'_> {
    fn ready(&self, pass: &Pass, params: Option<&wgpu::Buffer>) -> ReadyPass {
        let shader = known_shader(&pass.shader);
        match &pass.work {
            Work::Dispatch { entry, size } => {
                let entry = shader.entry_points.iter().find(|e| e.name == *entry).unwrap_or(&shader.entry_points[0]);
                debug_assert_eq!(entry.stage, Stage::Compute);
                let pipeline = self.gpu.compute_pipeline(shader, entry, &pass.constants);
                let group = self.group(pass, params, |index| pipeline.get_bind_group_layout(index));
                let workgroups = [size[0].div_ceil(entry.workgroup_size[0]), size[1].div_ceil(entry.workgroup_size[1])];
                ReadyPass::Compute { pipeline, group, workgroups }
            }
            Work::Draw { targets, depth } => {
                let formats: Vec<_> = targets.iter().map(|&id| self.texture(pass, id).format()).collect();
                let pipeline = self.gpu.render_pipeline(shader, &formats);
                let group = self.group(pass, params, |index| pipeline.get_bind_group_layout(index));
                let colors =
                    targets.iter().map(|&id| self.texture(pass, id).create_view(&Default::default())).collect();
                let depth = self.texture(pass, depth.0).create_view(&wgpu::TextureViewDescriptor {
                    dimension: Some(wgpu::TextureViewDimension::D2),
                    base_array_layer: depth.1,
                    array_layer_count: Some(1),
                    ..Default::default()
                });
                ReadyPass::Draw { pipeline, group, colors, depth }
            }
        }
    }

    fn texture(&self, pass: &Pass, id: ResourceId) -> &wgpu::Texture {
        self.textures[id.0]
            .as_ref()
            .unwrap_or_else(|| panic!("{}: no texture {}", pass.name, self.plan.resources[id.0].name))
    }

    fn group(
        &self,
        pass: &Pass,
        params: Option<&wgpu::Buffer>,
        layout: impl Fn(u32) -> wgpu::BindGroupLayout,
    ) -> Option<wgpu::BindGroup> {
        enum Held {
            View(wgpu::TextureView),
            Buffer(wgpu::Buffer),
            Sampler(wgpu::Sampler),
        }
        let held: Vec<(u32, Held)> = bindings(pass)
            .into_iter()
            .map(|binding| {
                let id = || {
                    pass.bindings.iter().find(|(name, _)| *name == binding.name).map(|&(_, id)| id).unwrap_or_else(
                        || panic!("pass {} binds nothing to {} of {}", pass.name, binding.name, pass.shader),
                    )
                };
                let held = match &binding.kind {
                    BindingKind::Uniform { .. } if binding.name == "view" => Held::Buffer(self.view.clone()),
                    BindingKind::Uniform { .. } => Held::Buffer(
                        params.cloned().unwrap_or_else(|| panic!("{} binds nothing to {}", pass.name, binding.name)),
                    ),
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
                            // Depth is reversed: lit where the receiver is at least as near as the map says.
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

fn make_texture(
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

fn make_buffer(gpu: &Gpu, name: &str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(name), contents, usage })
}
