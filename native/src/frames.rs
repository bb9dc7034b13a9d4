//! Runs recorded frames and reads results back, waiting for the device.

use std::time::Instant;

use halflight_frame_graph::{Changed, CompiledGraph, Gpu, PassTime, View};

use crate::{DeviceError, NativeGpu};

/// Times of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameTime {
    /// Passes in order. Those that were not due took no time.
    pub passes: Vec<PassTime>,
    /// From submission until the device was done, by the computer's clock, milliseconds.
    pub wall_milliseconds: f64,
}

/// How passes are timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Timing {
    /// By timestamps that the device writes around each pass, all passes in one submission.
    Timestamps,
    /// By the computer's clock, each pass submitted and waited for on its own: software adapters
    /// write the timestamps of compute passes late, and some adapters write none.
    Clock,
}

impl Timing {
    /// The method that can be trusted on this device.
    pub fn of(native: &NativeGpu) -> Self {
        if native.is_software() || native.gpu.timestamp_period.is_none() { Self::Clock } else { Self::Timestamps }
    }
}

/// Runs one frame and waits for it. `changed` is what the caller has changed since the last frame.
///
/// # Errors
/// Where the device was lost.
pub fn run_frame(
    gpu: &Gpu,
    recording: &CompiledGraph,
    view: &View,
    timing: Timing,
    changed: Changed,
) -> Result<FrameTime, DeviceError> {
    match timing {
        Timing::Timestamps => run_whole(gpu, recording, view, changed),
        Timing::Clock => run_apart(gpu, recording, view, changed),
    }
}

fn run_whole(gpu: &Gpu, recording: &CompiledGraph, view: &View, changed: Changed) -> Result<FrameTime, DeviceError> {
    let commands = recording.commands(gpu, view, changed);
    let start = Instant::now();
    submit_each(gpu, commands);
    wait(gpu)?;
    let wall_milliseconds = start.elapsed().as_secs_f64() * 1e3;
    let passes = match recording.timing_buffer() {
        Some(buffer) => recording.pass_times(&map(gpu, buffer)?),
        None => Vec::new(),
    };
    Ok(FrameTime { passes, wall_milliseconds })
}

/// Each in a submission of its own, so that a watchdog sees short ones.
fn submit_each(gpu: &Gpu, commands: Vec<wgpu::CommandBuffer>) {
    for commands in commands {
        gpu.queue.submit([commands]);
    }
}

fn run_apart(gpu: &Gpu, recording: &CompiledGraph, view: &View, changed: Changed) -> Result<FrameTime, DeviceError> {
    let commands = recording.record_apart(gpu, view, changed);
    let start = Instant::now();
    let mut passes = Vec::with_capacity(commands.len());
    for (planned, commands) in recording.plan().passes.iter().zip(commands) {
        let begin = Instant::now();
        let milliseconds = if commands.is_empty() {
            0.0
        } else {
            submit_each(gpu, commands);
            wait(gpu)?;
            begin.elapsed().as_secs_f64() * 1e3
        };
        passes.push(PassTime { name: planned.name.clone(), part: planned.part, milliseconds });
    }
    Ok(FrameTime { passes, wall_milliseconds: start.elapsed().as_secs_f64() * 1e3 })
}

/// Largest buffer that a texture is read through, bytes. Larger textures are read in parts.
const READ_AT_ONCE: u32 = 64 << 20;

/// A texture's texels as bytes, rows packed without padding, one layer.
///
/// # Errors
/// Where the device was lost.
pub fn read_texture(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Vec<u8>, DeviceError> {
    let texel = texture.format().block_copy_size(None).unwrap_or(4);
    let row = texture.width() * texel;
    let padded = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let rows = (READ_AT_ONCE / padded).clamp(1, texture.height());
    let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("texture to read"),
        size: u64::from(padded) * u64::from(rows),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut packed = Vec::with_capacity(row as usize * texture.height() as usize);
    for first in (0..texture.height()).step_by(rows as usize) {
        let height = rows.min(texture.height() - first);
        let mut encoder =
            gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("read texture") });
        encoder.copy_texture_to_buffer(
            wgpu::TexelCopyTextureInfo { origin: wgpu::Origin3d { x: 0, y: first, z: 0 }, ..texture.as_image_copy() },
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None },
            },
            wgpu::Extent3d { width: texture.width(), height, depth_or_array_layers: 1 },
        );
        gpu.queue.submit([encoder.finish()]);
        let bytes = map(gpu, &buffer)?;
        let lines = bytes.chunks_exact(padded as usize).take(height as usize);
        lines.for_each(|line| packed.extend_from_slice(&line[..row as usize]));
    }
    Ok(packed)
}

/// A buffer's bytes, through a copy of it; it must have the usage `COPY_SRC`.
///
/// # Errors
/// Where the device was lost.
pub fn read_buffer(gpu: &Gpu, buffer: &wgpu::Buffer) -> Result<Vec<u8>, DeviceError> {
    let copy = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("buffer to read"),
        size: buffer.size(),
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("read buffer") });
    encoder.copy_buffer_to_buffer(buffer, 0, &copy, 0, buffer.size());
    gpu.queue.submit([encoder.finish()]);
    map(gpu, &copy)
}

/// A buffer's bytes; it must have the usage `MAP_READ`.
///
/// # Errors
/// Where the device was lost.
pub fn map(gpu: &Gpu, buffer: &wgpu::Buffer) -> Result<Vec<u8>, DeviceError> {
    let (sender, receiver) = std::sync::mpsc::channel();
    buffer.map_async(wgpu::MapMode::Read, .., move |result| drop(sender.send(result)));
    wait(gpu)?;
    let lost =
        || DeviceError::new("the device was lost while its results were read: run again, with --resume for a grid");
    receiver.recv().map_err(|_| lost())?.map_err(|_| lost())?;
    let bytes = buffer.get_mapped_range(..).map_err(|_| lost())?.to_vec();
    buffer.unmap();
    Ok(bytes)
}

fn wait(gpu: &Gpu) -> Result<(), DeviceError> {
    gpu.device.poll(wgpu::PollType::wait_indefinitely()).map(drop).map_err(|e| {
        DeviceError::new(format!("the device stopped answering ({e}): run again, with --resume for a grid"))
    })
}
