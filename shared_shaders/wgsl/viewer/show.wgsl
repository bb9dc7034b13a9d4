// Shows a texture of a frame at any level: tone-mapped radiance, normals, depth or reflectance.
import package::common::tone::{marked, shown};

struct Params {
    // One of `CONTENT_...`.
    content: u32,
    // Width of a texel of the image in display pixels.
    divisor: u32,
    exposure: f32,
    // Depth that shows as middle grey, scene units.
    range: f32,
    // The largest number that passes store in the image's format.
    limit: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var image: texture_2d<f32>;
@group(0) @binding(2) var display: texture_storage_2d<rgba8unorm, write>;

@compute @workgroup_size(8, 8)
fn show(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < textureDimensions(display)) {
        let value = textureLoad(image, id.xy / params.divisor, 0).rgb;
        let colour = shown(params.content, value, params.exposure, params.range);
        textureStore(display, id.xy, vec4f(marked(colour, value, params.limit), 1.0));
    }
}
