// variants: animated
// Light of two bounces, one gathered in this frame and one in the previous frame, and the history for the next frame.
import package::common::surfel::{surfel_depth, surfel_normal};
@if(animated) import package::common::surfel::surfel_pixel;
import package::common::view::{View, SKY_DEPTH};
import package::hierarchical::bounce_of_frame::bounce_of_frame;
import package::temporal::history::{History, pack_history};
import package::temporal::previous_view::PreviousView;

@if(animated)
struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@if(animated) @group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var<uniform> previous: PreviousView;
@group(0) @binding(3) var surfels: texture_2d<u32>;
@group(0) @binding(4) var light: texture_2d<f32>;
@group(0) @binding(5) var reprojected: texture_2d<f32>;
@group(0) @binding(6) var bounce: texture_storage_2d<rgba32uint, write>;
@group(0) @binding(7) var both: texture_storage_2d<rgba32float, write>;
@if(animated) @group(0) @binding(8) var object: texture_2d<u32>;

@compute @workgroup_size(8, 8)
fn interleave(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(surfels)) {
        return;
    }
    let words = textureLoad(surfels, id.xy, 0);
    if surfel_depth(words) <= SKY_DEPTH {
        textureStore(bounce, id.xy, vec4u(0u));
        textureStore(both, id.xy, vec4f(0.0));
        return;
    }
    let now = textureLoad(light, id.xy, 0).rgb;
    let before = textureLoad(reprojected, id.xy, 0);
    let turn = bounce_of_frame(view.frame, previous.valid);
    var own_object = 0u;
    @if(animated) { own_object = textureLoad(object, vec2u(surfel_pixel(words, id.xy, params.scale)), 0).x; }
    let history = History(surfel_depth(words), surfel_normal(words), own_object, now, turn);
    textureStore(bounce, id.xy, pack_history(history));
    // Two successive frames with the same bounce, after a cut, have nothing to add to each other.
    let other = select(vec3f(0.0), before.rgb, before.a > 0.0 && before.a != f32(turn));
    textureStore(both, id.xy, vec4f(now + other, 1.0));
}
