//! Readback from the device without waiting: start a reading and ask for its result in later frames.

use std::sync::{
    Arc,
    atomic::{AtomicU8, Ordering},
};

use halflight_frame_graph::Gpu;
use halflight_renderer::texels::decoder;

/// Rows of a copied texture begin at multiples of this many bytes.
const ALIGNMENT: usize = wgpu::COPY_BYTES_PER_ROW_ALIGNMENT as usize;

const PENDING: u8 = 0;
const READY: u8 = 1;

/// A buffer that is being read.
pub struct Reading {
    buffer: wgpu::Buffer,
    state: Arc<AtomicU8>,
}

impl Reading {
    /// Reads a buffer with the usage `MAP_READ`, after everything submitted so far.
    pub fn of(buffer: &wgpu::Buffer) -> Self {
        Self::then(buffer, || {})
    }

    /// As [`Self::of`], and calls `done` when the bytes have arrived.
    fn then(buffer: &wgpu::Buffer, done: impl FnOnce() + Send + 'static) -> Self {
        let state = Arc::new(AtomicU8::new(PENDING));
        let arrived = state.clone();
        buffer.map_async(wgpu::MapMode::Read, .., move |result| {
            if result.is_ok() {
                arrived.store(READY, Ordering::Release);
            }
            done();
        });
        Self { buffer: buffer.clone(), state }
    }

    /// Whether the bytes have arrived.
    pub fn is_ready(&self) -> bool {
        self.state.load(Ordering::Acquire) == READY
    }

    /// The bytes, once they have arrived; the buffer can then be used again. They never arrive from a lost device.
    pub fn take(&self) -> Option<Vec<u8>> {
        if !self.is_ready() {
            return None;
        }
        let bytes = self.buffer.get_mapped_range(..).ok()?.to_vec();
        self.buffer.unmap();
        Some(bytes)
    }
}

/// A texture that is being read.
pub struct TextureReading {
    reading: Reading,
    size: [u32; 2],
    format: wgpu::TextureFormat,
}

impl TextureReading {
    /// Reads a texture, after everything submitted so far.
    pub fn new(gpu: &Gpu, texture: &wgpu::Texture) -> Self {
        Self::then(gpu, texture, || {})
    }

    /// As [`Self::new`], and calls `done` when the pixels have arrived.
    pub fn then(gpu: &Gpu, texture: &wgpu::Texture, done: impl FnOnce() + Send + 'static) -> Self {
        let texel = texture.format().block_copy_size(None).unwrap_or(4);
        let padded = (texture.width() * texel).next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
        let buffer = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("texture to read"),
            size: u64::from(padded) * u64::from(texture.height()),
            usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.copy_texture_to_buffer(
            texture.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded), rows_per_image: None },
            },
            wgpu::Extent3d { depth_or_array_layers: 1, ..texture.size() },
        );
        gpu.queue.submit([encoder.finish()]);
        let (size, format) = ([texture.width(), texture.height()], texture.format());
        Self { reading: Reading::then(&buffer, done), size, format }
    }

    /// Whether the pixels have arrived.
    pub fn is_ready(&self) -> bool {
        self.reading.is_ready()
    }

    /// The bytes of the pixels, once they have arrived: rows from top to bottom, without padding.
    pub fn take_bytes(&self) -> Option<Vec<u8>> {
        let (row, rows) = self.rows()?;
        Some(rows.chunks_exact(row.next_multiple_of(ALIGNMENT)).flat_map(|line| &line[..row]).copied().collect())
    }

    /// Bytes of a row, and the padded rows.
    fn rows(&self) -> Option<(usize, Vec<u8>)> {
        let bytes = self.reading.take()?;
        // Free the buffer now; a browser would keep it until its next garbage collection.
        self.reading.buffer.destroy();
        let texel = self.format.block_copy_size(None).unwrap_or(4) as usize;
        Some((self.size[0] as usize * texel, bytes))
    }

    /// The pixels, once they have arrived: four linear channels each, rows from top to bottom. Empty for formats without
    /// colour.
    pub fn take(&self) -> Option<Vec<[f32; 4]>> {
        let (row, bytes) = self.rows()?;
        let texel = self.format.block_copy_size(None).unwrap_or(4) as usize;
        let Some(decode) = decoder(self.format) else { return Some(Vec::new()) };
        let rows = bytes.chunks_exact(row.next_multiple_of(ALIGNMENT));
        Some(rows.flat_map(|line| line[..row].chunks_exact(texel).map(decode)).collect())
    }
}
