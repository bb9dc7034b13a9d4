// Shows a level of the pyramid: radiance, normal or depth of its surfels.
import package::common::surfel::{surfel_depth, surfel_normal, surfel_radiance};
import package::common::tone::{CONTENT_DEPTH, CONTENT_NORMAL, shown};
import package::common::view::SKY_DEPTH;

struct Params {
    content: u32,
    divisor: u32,
    exposure: f32,
    range: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var image: texture_2d<u32>;
@group(0) @binding(2) var display: texture_storage_2d<rgba8unorm, write>;

@compute @workgroup_size(8, 8)
fn show(@builtin(global_invocation_id) id: vec3u) {
    if all(id.xy < textureDimensions(display)) {
        let words = textureLoad(image, id.xy / params.divisor, 0);
        var value = surfel_radiance(words);
        if params.content == CONTENT_NORMAL {
            value = surfel_normal(words);
        } else if params.content == CONTENT_DEPTH {
            value = vec3f(surfel_depth(words));
        }
        if surfel_depth(words) == SKY_DEPTH {
            value = vec3f(0.0);
        }
        textureStore(display, id.xy, vec4f(shown(params.content, value, params.exposure, params.range), 1.0));
    }
}
