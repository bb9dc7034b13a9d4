//! The texel pool: all textures of a scene in one array of words, in the layout of `common/texture_pool.wgsl`. A texture
//! is a header (width, height) and one word per texel, rows from the top.
//!
//! On a device the words are the texels of an array of textures, because many devices bind only 128 MiB of a buffer.

use halflight_frame_graph::{ExternalSize, Gpu};
use halflight_scenes::Texture;

/// Words of a texture's header: width and height.
pub(crate) const HEADER: u32 = 2;

/// Index of each texture's header in the pool.
pub(crate) fn headers(textures: &[Texture]) -> impl Iterator<Item = u32> {
    textures.iter().scan(0, |end, texture| {
        let start = *end;
        *end += HEADER + texture.width * texture.height;
        Some(start)
    })
}

/// Words in a row of the pool's texture. Twin of `texel_word` in `common/scene_textures.wgsl`.
const POOL_WIDTH: u32 = 1 << 12;
/// Rows in a layer: few, because the last layer may be almost empty, and enough for 2^28 words in 256 layers.
const POOL_ROWS: u32 = 1 << 8;

/// Rows and layers of the texture for this many words.
fn rows_and_layers(words: u64) -> (u32, u32) {
    let rows = words.max(1).div_ceil(POOL_WIDTH.into());
    let layers = rows.div_ceil(POOL_ROWS.into());
    (rows.min(POOL_ROWS.into()) as u32, u32::try_from(layers).unwrap_or(u32::MAX))
}

/// The pool as a texture of a device.
pub(super) fn upload(gpu: &Gpu, mut words: Vec<u32>) -> wgpu::Texture {
    use wgpu::util::DeviceExt;
    let (rows, layers) = rows_and_layers(words.len() as u64);
    words.resize(POOL_WIDTH as usize * rows as usize * layers as usize, 0);
    let descriptor = wgpu::TextureDescriptor {
        label: Some("scene.texels"),
        size: wgpu::Extent3d { width: POOL_WIDTH, height: rows, depth_or_array_layers: layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R32Uint,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    };
    let order = wgpu::util::TextureDataOrder::LayerMajor;
    gpu.device.create_texture_with_data(&gpu.queue, &descriptor, order, bytemuck::cast_slice(&words))
}

/// Size of the pool on a device.
pub(super) fn size(textures: &[Texture]) -> ExternalSize {
    let (rows, layers) = rows_and_layers(words(textures));
    ExternalSize {
        bytes: 4 * u64::from(POOL_WIDTH) * u64::from(rows) * u64::from(layers),
        element: 4,
        elements: "texels in all textures",
        texture: Some(([POOL_WIDTH, rows], layers)),
    }
}

/// Words of the pool.
pub(crate) fn words(textures: &[Texture]) -> u64 {
    textures.iter().map(|texture| u64::from(HEADER) + u64::from(texture.width) * u64::from(texture.height)).sum()
}

/// All textures in one array of words. Returns the start of each texture.
pub(crate) fn texel_pool(textures: &[Texture]) -> (Vec<u32>, Vec<u32>) {
    // Square root of the linear value, in 10 bits, for each sRGB code.
    let root: [u32; 256] = std::array::from_fn(|code| {
        let v = code as f32 / 255.0;
        let linear = if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
        (linear.sqrt() * 1023.0).round() as u32
    });
    let root = &root;
    let words = textures.iter().flat_map(|texture| {
        let texels = texture.rgba.as_chunks::<4>().0.iter().map(move |&[r, g, b, a]| {
            let alpha = if a >= 128 { 3 } else { 0 };
            root[r as usize] | root[g as usize] << 10 | root[b as usize] << 20 | alpha << 30
        });
        [texture.width, texture.height].into_iter().chain(texels)
    });
    (headers(textures).collect(), words.collect())
}
