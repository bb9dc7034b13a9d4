//! Converts the bytes of texels to numbers, after read-back.

use halflight_metrics::tone::srgb_decode;
use wgpu::TextureFormat as Format;

/// Converts the bytes of a texel to four linear numbers.
pub type Decode = fn(&[u8]) -> [f32; 4];

/// The conversion from the bytes of a texel to four linear numbers; `None` for formats without colour.
pub fn decoder(format: Format) -> Option<Decode> {
    fn float(bytes: &[u8], i: usize) -> f32 {
        bytemuck::pod_read_unaligned(&bytes[4 * i..4 * i + 4])
    }
    fn half(bytes: &[u8], i: usize) -> f32 {
        bytemuck::pod_read_unaligned::<half::f16>(&bytes[2 * i..2 * i + 2]).to_f32()
    }
    Some(match format {
        Format::R32Float => |bytes| [float(bytes, 0), 0.0, 0.0, 1.0],
        Format::Rgba32Float => |bytes| std::array::from_fn(|i| float(bytes, i)),
        Format::Rgba16Float => |bytes| std::array::from_fn(|i| half(bytes, i)),
        Format::Rgba8UnormSrgb => |bytes| {
            std::array::from_fn(|i| {
                if i < 3 { srgb_decode(f32::from(bytes[i]) / 255.0) } else { f32::from(bytes[i]) / 255.0 }
            })
        },
        _ => return None,
    })
}
