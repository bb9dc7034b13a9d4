//! A device with its compiled shaders and pipelines.

use std::{
    collections::HashMap,
    sync::{Mutex, PoisonError},
};

use halflight_shared_shaders::{EntryPoint, Shader};

use crate::plan::{DeviceLimits, WORK_ON_GPU, WORK_ON_PROCESSOR};

/// A device and its queue with a cache of compiled shaders. Pipelines are created on first use.
pub struct Gpu {
    /// The device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Nanoseconds of one timestamp tick, where the device writes timestamps.
    pub timestamp_period: Option<f32>,
    /// Bytes that plans may use in total; `None` where nobody knows, as in a browser.
    pub memory: Option<u64>,
    /// Work that one dispatch and one submission may do: [`WORK_ON_GPU`], or [`WORK_ON_PROCESSOR`] on a software adapter. A
    /// change counts for graphs that are compiled after it.
    pub work_at_once: u64,
    /// Clear a part of a depth target of each format.
    pub(crate) clear_pipelines: Mutex<HashMap<wgpu::TextureFormat, wgpu::RenderPipeline>>,
    modules: Mutex<HashMap<&'static str, wgpu::ShaderModule>>,
    /// Sources that replace those of the build.
    replaced: Mutex<HashMap<&'static str, String>>,
    compute: Mutex<HashMap<ComputeKey, wgpu::ComputePipeline>>,
    render: Mutex<HashMap<RenderKey, wgpu::RenderPipeline>>,
}

/// Key of a render pipeline: shader, constants (values as bits, because equality must be exact), formats of the colour
/// targets, that of the depth target, and whether hidden surfaces are drawn. Everything else is the same for all pipelines.
type RenderKey = (&'static str, Vec<(String, u64)>, Vec<wgpu::TextureFormat>, wgpu::TextureFormat, bool);

#[derive(Clone, PartialEq, Eq, Hash)]
struct ComputeKey {
    shader: &'static str,
    entry: &'static str,
    /// Constants by name. Values are bits, because equality must be exact.
    constants: Vec<(String, u64)>,
}

impl Gpu {
    /// Features to request if the adapter offers them: timestamps only.
    pub const WANTED_FEATURES: wgpu::Features = wgpu::Features::TIMESTAMP_QUERY;

    /// Format of depth targets. Maps of directional lights may have a narrower one.
    pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

    /// Wraps an existing device: of a window, a browser page or another renderer.
    pub fn new(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let timestamp_period =
            device.features().contains(wgpu::Features::TIMESTAMP_QUERY).then(|| queue.get_timestamp_period());
        let software = device.adapter_info().device_type == wgpu::DeviceType::Cpu;
        Self {
            work_at_once: if software { WORK_ON_PROCESSOR } else { WORK_ON_GPU },
            device,
            queue,
            timestamp_period,
            memory: None,
            clear_pipelines: Mutex::default(),
            modules: Mutex::default(),
            replaced: Mutex::default(),
            compute: Mutex::default(),
            render: Mutex::default(),
        }
    }

    /// What plans on this device are checked against.
    pub fn limits(&self) -> DeviceLimits {
        DeviceLimits { limits: self.device.limits(), memory: self.memory }
    }

    /// Limits to request from an adapter: the WebGPU baseline, with buffers, textures and dispatches as large as the
    /// adapter allows.
    pub fn wanted_limits(adapter: &wgpu::Limits) -> wgpu::Limits {
        wgpu::Limits {
            max_buffer_size: adapter.max_buffer_size,
            max_storage_buffer_binding_size: adapter.max_storage_buffer_binding_size,
            max_uniform_buffer_binding_size: adapter.max_uniform_buffer_binding_size,
            max_texture_dimension_2d: adapter.max_texture_dimension_2d,
            max_texture_array_layers: adapter.max_texture_array_layers,
            max_compute_workgroups_per_dimension: adapter.max_compute_workgroups_per_dimension,
            max_color_attachment_bytes_per_sample: adapter.max_color_attachment_bytes_per_sample.min(32),
            ..wgpu::Limits::default()
        }
    }

    /// A buffer with these contents. It is written through the queue instead of being mapped, because mapping panics if
    /// the device was lost in the meantime.
    pub fn filled_buffer(&self, label: &str, contents: &[u8], usage: wgpu::BufferUsages) -> wgpu::Buffer {
        let padded = contents.len().next_multiple_of(wgpu::COPY_BUFFER_ALIGNMENT as usize);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: padded as u64,
            usage: usage | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        if padded == contents.len() {
            self.queue.write_buffer(&buffer, 0, contents);
        } else {
            let mut whole = contents.to_vec();
            whole.resize(padded, 0);
            self.queue.write_buffer(&buffer, 0, &whole);
        }
        buffer
    }

    /// Replaces the WGSL of a shader in everything that is created afterwards. Entry points, constants and bindings
    /// must stay the same. For editing a shader without rebuilding, and for tests that must fail.
    pub fn replace_source(&self, shader: &'static Shader, wgsl: String) {
        let name = shader.name;
        self.replaced.lock().unwrap_or_else(PoisonError::into_inner).insert(name, wgsl);
        self.modules.lock().unwrap_or_else(PoisonError::into_inner).remove(name);
        self.compute.lock().unwrap_or_else(PoisonError::into_inner).retain(|key, _| key.shader != name);
        self.render.lock().unwrap_or_else(PoisonError::into_inner).retain(|key, _| key.0 != name);
    }

    /// The compiled module of this shader.
    pub fn module(&self, shader: &'static Shader) -> wgpu::ShaderModule {
        let replaced = self.replaced.lock().unwrap_or_else(PoisonError::into_inner);
        let source = replaced.get(shader.name).map_or(shader.source, String::as_str);
        let mut modules = self.modules.lock().unwrap_or_else(PoisonError::into_inner);
        modules
            .entry(shader.name)
            .or_insert_with(|| {
                self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
                    label: Some(shader.name),
                    source: wgpu::ShaderSource::Wgsl(source.into()),
                })
            })
            .clone()
    }

    /// The compute pipeline of an entry point with these override constants.
    pub fn compute_pipeline(
        &self,
        shader: &'static Shader,
        entry: &'static EntryPoint,
        constants: &[(&str, f64)],
    ) -> wgpu::ComputePipeline {
        let key = ComputeKey {
            shader: shader.name,
            entry: entry.name,
            constants: constants.iter().map(|(name, value)| (name.to_string(), value.to_bits())).collect(),
        };
        if let Some(pipeline) = self.compute.lock().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return pipeline.clone();
        }
        let pipeline = self.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(shader.name),
            layout: None,
            module: &self.module(shader),
            entry_point: Some(entry.name),
            compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
            cache: None,
        });
        self.compute.lock().unwrap_or_else(PoisonError::into_inner).insert(key, pipeline.clone());
        pipeline
    }

    /// The pipeline that draws the scene's triangles with entry points `vertex` and, if the shader has one, `fragment`:
    /// two-sided, reversed depth, into colour targets and a depth target of these formats. With `hidden`, hidden surfaces are drawn too and depth
    /// is not written.
    pub fn render_pipeline(
        &self,
        shader: &'static Shader,
        constants: &[(&str, f64)],
        (formats, depth): (&[wgpu::TextureFormat], wgpu::TextureFormat),
        hidden: bool,
    ) -> wgpu::RenderPipeline {
        let bits = constants.iter().map(|(name, value)| (name.to_string(), value.to_bits())).collect();
        let key = (shader.name, bits, formats.to_vec(), depth, hidden);
        if let Some(pipeline) = self.render.lock().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return pipeline.clone();
        }
        let module = self.module(shader);
        let targets: Vec<_> = formats.iter().map(|&format| Some(format.into())).collect();
        let pipeline = self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(shader.name),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: depth,
                depth_write_enabled: Some(!hidden),
                depth_compare: Some(if hidden {
                    wgpu::CompareFunction::Always
                } else {
                    wgpu::CompareFunction::Greater
                }),
                stencil: Default::default(),
                bias: Default::default(),
            }),
            multisample: Default::default(),
            fragment: shader.entry_point("fragment").map(|entry| wgpu::FragmentState {
                module: &module,
                entry_point: Some(entry.name),
                compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        });
        self.render.lock().unwrap_or_else(PoisonError::into_inner).insert(key, pipeline.clone());
        pipeline
    }
}
