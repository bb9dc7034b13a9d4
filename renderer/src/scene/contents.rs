//! What the buffers and textures of a scene hold, made without a device, and cut into pieces.
//!
//! A scene can thus be prepared on another thread, or in a browser's worker, and be uploaded a piece at a time between two
//! frames.

use bytemuck::Pod;
use halflight_frame_graph::Gpu;
use halflight_scenes::bulk;
use serde::{Deserialize, Serialize};

use super::texel_pool;

/// Bytes of a piece: a layer of the texel pool.
const PIECE: usize = 1 << 22;

/// Texels in a row of the BVH's textures: 2^`ROW_BITS` of `truth/traversal.wgsl`.
pub(super) const BVH_ROW: usize = 4096;

/// A buffer of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum BufferPart {
    Vertices,
    Indices,
    Materials,
    Lights,
    Objects,
    Environment,
}

/// A texture of a scene: rows of texels, filled from the first one on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum TexturePart {
    Texels,
    BvhNodes,
    BvhTriangles,
    BvhAttributes,
    BvhEmitters,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Part {
    Buffer(BufferPart),
    Texture(TexturePart),
}

/// Some of the contents of a buffer or a texture: at most 4 MiB.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Piece {
    pub(super) part: Part,
    /// Bytes of the part before this piece.
    offset: u64,
    #[serde(with = "bulk")]
    bytes: Vec<u8>,
}

impl BufferPart {
    /// A buffer of this many bytes.
    pub(super) fn reserve(self, gpu: &Gpu, bytes: u64) -> wgpu::Buffer {
        let none = wgpu::BufferUsages::empty();
        let (label, usage) = match self {
            Self::Vertices => ("scene.vertices", none),
            Self::Indices => ("scene.indices", wgpu::BufferUsages::INDEX),
            Self::Materials => ("scene.materials", none),
            Self::Lights => ("scene.lights", none),
            Self::Objects => ("scene.objects", none),
            Self::Environment => ("scene.environment", none),
        };
        let copied = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST;
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size: bytes,
            usage: wgpu::BufferUsages::STORAGE | copied | usage,
            mapped_at_creation: false,
        })
    }
}

/// How a texture lies on a device.
struct Rows {
    label: &'static str,
    /// Texels in a row.
    width: u32,
    format: wgpu::TextureFormat,
    /// Bytes of a texel.
    texel: u32,
    usage: wgpu::TextureUsages,
    /// Rows in a layer; `None` for a texture without layers.
    per_layer: Option<u32>,
}

impl TexturePart {
    fn layout(self) -> Rows {
        let bvh = |label| Rows {
            label,
            width: BVH_ROW as u32,
            format: wgpu::TextureFormat::Rgba32Uint,
            texel: 16,
            usage: wgpu::TextureUsages::STORAGE_BINDING,
            per_layer: None,
        };
        match self {
            Self::Texels => Rows {
                label: "scene.texels",
                width: texel_pool::POOL_WIDTH,
                format: wgpu::TextureFormat::R32Uint,
                texel: 4,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                per_layer: Some(texel_pool::POOL_ROWS),
            },
            Self::BvhNodes => bvh("scene.bvh_nodes"),
            Self::BvhTriangles => bvh("scene.bvh_triangles"),
            Self::BvhAttributes => bvh("scene.bvh_attributes"),
            Self::BvhEmitters => Rows {
                format: wgpu::TextureFormat::Rg32Uint,
                texel: 8,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                ..bvh("scene.bvh_emitters")
            },
        }
    }

    /// Rows of a texture for contents of this many bytes.
    pub(super) fn rows(self, bytes: u64) -> u64 {
        let Rows { width, texel, .. } = self.layout();
        bytes.div_ceil(u64::from(width * texel)).max(1)
    }

    /// A texture for contents of this many bytes.
    pub(super) fn reserve(self, gpu: &Gpu, bytes: u64) -> wgpu::Texture {
        let Rows { label, width, format, usage, per_layer, .. } = self.layout();
        let rows = self.rows(bytes) as u32;
        let height = per_layer.map_or(rows, |most| rows.min(most));
        gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: rows.div_ceil(height) },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: usage | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        })
    }
}

impl Piece {
    /// Writes this piece of a buffer.
    pub(super) fn write_to_buffer(&self, gpu: &Gpu, buffer: &wgpu::Buffer) {
        gpu.queue.write_buffer(buffer, self.offset, &self.bytes);
    }

    /// Writes this piece of a texture of this part.
    pub(super) fn write_to_texture(&self, gpu: &Gpu, part: TexturePart, texture: &wgpu::Texture) {
        let Rows { width, texel, .. } = part.layout();
        let row = width * texel;
        let first = (self.offset / u64::from(row)) as u32;
        let (whole, rest) = self.bytes.split_at(self.bytes.len() - self.bytes.len() % row as usize);
        let rows = whole.len() as u32 / row;
        let write = |bytes: &[u8], at: u32, [width, height]: [u32; 2]| {
            if bytes.is_empty() {
                return;
            }
            let origin = wgpu::Origin3d { x: 0, y: at % texture.height(), z: at / texture.height() };
            let target = wgpu::TexelCopyTextureInfo { texture, mip_level: 0, origin, aspect: wgpu::TextureAspect::All };
            let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
            gpu.queue.write_texture(target, bytes, layout, wgpu::Extent3d { width, height, depth_or_array_layers: 1 });
        };
        write(whole, first, [width, rows]);
        write(rest, first + rows, [rest.len() as u32 / texel, 1]);
    }
}

/// An array of plain numbers as bytes.
trait Bytes: Send {
    fn bytes(&self) -> &[u8];
}

impl<T: Pod + Send> Bytes for Vec<T> {
    fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(self)
    }
}

/// The contents of several parts.
#[derive(Default)]
pub struct Pieces(Vec<(Part, Box<dyn Bytes>)>);

impl Pieces {
    /// Adds a part; returns its size, bytes: that of one element at least, so that an empty scene binds like any other.
    pub(super) fn add<T: Pod + Send>(&mut self, part: Part, contents: Vec<T>) -> u64 {
        let bytes = contents.bytes().len().max(size_of::<T>()) as u64;
        self.0.push((part, Box::new(contents)));
        bytes
    }

    /// The pieces, part after part.
    pub fn iter(&self) -> impl Iterator<Item = Piece> {
        self.0.iter().flat_map(|(part, contents)| {
            let pieces = (0..).step_by(PIECE).zip(contents.bytes().chunks(PIECE));
            pieces.map(|(offset, bytes)| Piece { part: *part, offset, bytes: bytes.to_vec() })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_the_contents_in_their_order() {
        let mut pieces = Pieces::default();
        // Two whole pieces and three words; nothing at all; one word.
        let long: Vec<u32> = (0..(2 * PIECE / 4 + 3) as u32).collect();
        let texels = Part::Texture(TexturePart::Texels);
        assert_eq!(pieces.add(texels, long.clone()), 2 * PIECE as u64 + 12);
        assert_eq!(pieces.add(Part::Buffer(BufferPart::Lights), Vec::<[u32; 4]>::new()), 16);
        assert_eq!(pieces.add(Part::Buffer(BufferPart::Indices), vec![7u32]), 4);
        let all: Vec<Piece> = pieces.iter().collect();
        let offsets: Vec<u64> = all.iter().map(|piece| piece.offset).collect();
        assert_eq!(offsets, [0, PIECE as u64, 2 * PIECE as u64, 0]);
        let together: Vec<u8> = all.iter().filter(|piece| piece.part == texels).flat_map(|p| p.bytes.clone()).collect();
        assert_eq!(together, bytemuck::cast_slice::<u32, u8>(&long));
        assert_eq!(all[3].bytes, 7u32.to_ne_bytes());
    }

    #[test]
    fn a_piece_is_whole_rows_and_stays_in_its_layer() {
        for part in [
            TexturePart::Texels,
            TexturePart::BvhNodes,
            TexturePart::BvhTriangles,
            TexturePart::BvhAttributes,
            TexturePart::BvhEmitters,
        ] {
            let Rows { width, texel, per_layer, .. } = part.layout();
            let row = (width * texel) as usize;
            assert_eq!(PIECE % row, 0, "{part:?}");
            assert!(per_layer.is_none_or(|rows| rows as usize * row == PIECE), "{part:?}");
            assert_eq!([0, 1, row as u64, row as u64 + 1].map(|bytes| part.rows(bytes)), [1, 1, 1, 2], "{part:?}");
        }
    }
}
