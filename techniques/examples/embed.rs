//! Indirect light inside another renderer: its device, its textures, its camera, its encoder.
//!
//!     cargo run -p halflight-techniques --example embed
//!
//! The host here is the smallest that serves: it "renders" a lit floor in front of a dark wall by
//! writing texels, and nothing else in it is Halflight's. Light can only reach the wall from the floor.
#![allow(clippy::disallowed_macros, reason = "an example for developers")]

use std::error::Error;

use halflight_frame_graph::{Changed, CompiledGraph, Externals, Gpu, View};
use halflight_renderer::parameters::{Settings, Value};
use halflight_renderer::plan_technique;
use halflight_techniques::technique;
use wgpu::{TextureFormat, TextureUsages, util::DeviceExt};

const SIZE: [u32; 2] = [256, 144];
/// Tangents of half the field of view.
const TAN: [f32; 2] = [16.0 / 9.0 * 0.6, 0.6];

fn main() -> Result<(), Box<dyn Error>> {
    // The host: a device, four textures, an encoder.
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let texture = |texel: &dyn Fn(bool, f32) -> [f32; 4]| {
        let texels: Vec<_> = pixels().map(|(floor, depth)| texel(floor, depth)).collect();
        let descriptor = wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: TextureFormat::Rgba32Float,
            usage: TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        };
        device.create_texture_with_data(&queue, &descriptor, Default::default(), bytemuck::cast_slice(&texels))
    };
    let depth = texture(&|_, depth| [depth, 0.0, 0.0, 0.0]);
    let normal = texture(&|floor, _| if floor { [0.0, 1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0, 0.0] });
    let direct = texture(&|floor, _| if floor { [1.0; 4] } else { [0.0; 4] });
    let albedo = texture(&|_, _| [0.8; 4]);
    let mut encoder = device.create_command_encoder(&Default::default());

    // Halflight: a plan for these settings and this size once, then a few passes every frame.
    let settings = Settings::from([("hierarchical.start_resolution".to_owned(), Value::parse("full"))]);
    let plan = plan_technique(technique("hierarchical")?, &settings, SIZE)?;
    let gpu = Gpu::new(device.clone(), queue.clone());
    let textures = [("depth", depth), ("normal", normal), ("direct", direct), ("albedo", albedo)].into();
    let recording = CompiledGraph::new(&gpu, plan, &Externals { textures, ..Default::default() });
    let world_to_view = glam::Mat4::IDENTITY;
    let continuity = Default::default();
    let view = View { world_to_view, tan_half_fov: TAN, display_size: SIZE, near: 0.1, frame: 0, seed: 0, continuity };
    // With `Changed::Only`, later frames run no pass whose inputs are as before.
    recording.record(&gpu, &mut encoder, &view, Changed::Anything);

    // The host again: it submits, and uses the result (`final` is direct + albedo * indirect).
    let indirect = recording.output("indirect").ok_or("the technique gives no indirect light")?;
    let bytes_per_row = Some(SIZE[0] * 16);
    let usage = wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ;
    let size = u64::from(SIZE[0] * SIZE[1] * 16);
    let buffer = device.create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false });
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
    let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
    encoder.copy_texture_to_buffer(indirect.as_image_copy(), target, indirect.size());
    queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |_| ());
    device.poll(wgpu::PollType::wait_indefinitely())?;
    let mapped = buffer.get_mapped_range(..)?;
    let texels: &[[f32; 4]] = bytemuck::cast_slice(&mapped);
    println!("mean indirect light: {:.4}", texels.iter().map(|texel| texel[0]).sum::<f32>() / texels.len() as f32);
    Ok(())
}

/// For each pixel whether it shows the floor (y = -1) or the wall (z = -4), and its planar depth.
fn pixels() -> impl Iterator<Item = (bool, f32)> {
    (0..SIZE[0] * SIZE[1]).map(|i| {
        let down = (2.0 * ((i / SIZE[0]) as f32 + 0.5) / SIZE[1] as f32 - 1.0) * TAN[1];
        let floor = 4.0 * down > 1.0;
        (floor, if floor { 1.0 / down } else { 4.0 })
    })
}
