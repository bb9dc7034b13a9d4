// Averages pictures of one view whose cameras are turned by parts of a pixel: antialiasing by samples. The number of the frame
// is the number of pictures before this one.
import package::common::tone::{srgb_decode, srgb_encode};
import package::common::view::View;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var picture: texture_2d<f32>;
// Display-linear means of the pictures before and of these.
@group(0) @binding(2) var mean_before: texture_2d<f32>;
@group(0) @binding(3) var mean: texture_storage_2d<rgba16float, write>;
@group(0) @binding(4) var display: texture_storage_2d<rgba8unorm, write>;

@compute @workgroup_size(8, 8)
fn average(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(display)) {
        return;
    }
    let colour = textureLoad(picture, id.xy, 0).rgb;
    let linear = srgb_decode(colour);
    if view.frame == 0u {
        textureStore(mean, id.xy, vec4f(linear, 1.0));
        textureStore(display, id.xy, vec4f(colour, 1.0));
        return;
    }
    let sum = mix(textureLoad(mean_before, id.xy, 0).rgb, linear, 1.0 / f32(view.frame + 1u));
    textureStore(mean, id.xy, vec4f(sum, 1.0));
    textureStore(display, id.xy, vec4f(srgb_encode(sum), 1.0));
}
