//! Draws into a tile of a depth target.

use std::sync::PoisonError;

use crate::{Gpu, plan::Tile};

/// Covers the whole viewport at the far plane: depth is reversed.
const CLEAR: &str = "@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    return vec4f(vec2f(vec2u(index & 1u, index >> 1u)) * 4.0 - 1.0, 0.0, 1.0);
}";

/// Clears depth of this format inside the viewport. A render pass can only clear a whole layer.
pub(super) fn clear_pipeline(gpu: &Gpu, format: wgpu::TextureFormat) -> wgpu::RenderPipeline {
    let mut known = gpu.clear_pipelines.lock().unwrap_or_else(PoisonError::into_inner);
    known.entry(format).or_insert_with(|| make_clear_pipeline(gpu, format)).clone()
}

fn make_clear_pipeline(gpu: &Gpu, format: wgpu::TextureFormat) -> wgpu::RenderPipeline {
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("clear a tile"),
        source: wgpu::ShaderSource::Wgsl(CLEAR.into()),
    });
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("clear a tile"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: Default::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format,
            depth_write_enabled: Some(true),
            depth_compare: Some(wgpu::CompareFunction::Always),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: None,
        multiview_mask: None,
        cache: None,
    })
}

/// Limits a pass to a tile and clears it.
pub(super) fn begin_tile(
    pass: &mut wgpu::RenderPass,
    Tile { corner: [x, y], size }: Tile,
    clear: &wgpu::RenderPipeline,
) {
    pass.set_viewport(x as f32, y as f32, size as f32, size as f32, 0.0, 1.0);
    pass.set_scissor_rect(x, y, size, size);
    pass.set_pipeline(clear);
    pass.draw(0..3, 0..1);
}
