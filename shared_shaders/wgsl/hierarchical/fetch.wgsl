// Roofline of the gather: fetches the same texels as `gather.wgsl`, in the same order and from the same texture, and
// only adds them. For benchmarks; no frame uses it.
import package::common::math::GOLDEN_ROTATION;
import package::common::math::spread2;
import package::common::view::{View, SKY_DEPTH};
import package::common::surfel::surfel_depth;

struct Params {
    // As in `gather.wgsl`.
    scale: f32,
    inner_square: f32,
    outer_square: f32,
    level: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(3) var sums: texture_storage_2d<rgba32float, write>;

override SAMPLES: u32;

@compute @workgroup_size(8, 8)
fn fetch(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(surfels);
    if any(id.xy >= size) {
        return;
    }
    let own = textureLoad(surfels, id.xy, 0);
    if surfel_depth(own) <= SKY_DEPTH {
        textureStore(sums, id.xy, vec4f(0.0));
        return;
    }
    let random = spread2(id.xy, view.frame, params.level, view.seed, false);
    let centre = vec2f(id.xy) + 0.5;
    let half_extent = 0.5 * view.display_size / params.scale;
    let step = (params.outer_square - params.inner_square) / f32(SAMPLES);
    var square = params.inner_square + step * random.x;
    let angle = 6.283185307179586 * random.y;
    var direction = vec2f(cos(angle), sin(angle));
    // Every word counts, so that the compiler cannot remove part of a fetch.
    var sum = vec4u(0u);
    for (var i = 0u; i < SAMPLES; i++) {
        let point = centre + sqrt(square) * direction;
        square += step;
        direction = vec2f(
            direction.x * GOLDEN_ROTATION.x - direction.y * GOLDEN_ROTATION.y,
            direction.x * GOLDEN_ROTATION.y + direction.y * GOLDEN_ROTATION.x,
        );
        if all(abs(point - half_extent) < half_extent) {
            sum += textureLoad(surfels, vec2i(floor(point)), 0);
        }
    }
    textureStore(sums, id.xy, vec4f(sum));
}
