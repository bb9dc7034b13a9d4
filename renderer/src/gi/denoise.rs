//! The spatial filter of light that was gathered with few samples.

use wgpu::TextureFormat as Format;

use crate::gi::resolution::Level;
use halflight_frame_graph::{FramePlan, Part, ResourceId};
use halflight_shared_shaders::denoise::{self, Denoise};

/// Fetches of a texel: 3x3 taps.
const TAPS: u64 = 9;

/// Plans the spatial filter: `count` passes. The distance of the taps doubles with each pass.
pub fn denoised(plan: &mut FramePlan, level: &Level, noisy: ResourceId, count: u32) -> ResourceId {
    let format = plan.resources[noisy.0].format().unwrap_or(Format::Rgba32Float);
    let ambient_visibility = format == Format::R32Float;
    let packed = format == Format::Rgba32Uint;
    (0..count).fold(noisy, |noisy, turn| {
        let spacing = 1u32 << turn;
        let smoothed = plan.texture(format!("denoised_{turn}"), level.size, format, "light after the spatial filter");
        let run = Denoise {
            surfels: if packed { noisy } else { level.surfels },
            smoothed,
            ambient_visibility,
            packed,
            float16: format == Format::Rgba16Float,
            noisy: (!packed).then_some(noisy),
            params: denoise::Params { scale: level.scale as f32, spacing },
        };
        plan.pass(Part::Technique, format!("denoise_{turn}"), run)
            .because(format!("few samples leave noise: taps {spacing} texels apart"))
            .costs(TAPS)
            .over(level.size);
        smoothed
    })
}
