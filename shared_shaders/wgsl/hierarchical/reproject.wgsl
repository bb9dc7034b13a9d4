// variants: animated
// Reprojects the bounce of the previous frame to this frame's surfaces, like the temporal filter, at the resolution of
// level 0. The last channel is the number of the bounce, or 0 if the previous frame did not see the surface.
@if(animated) import package::common::scene::{Object, transform_normal};
@if(!animated) import package::common::scene::transform_normal;
import package::common::surfel::{surfel_depth, surfel_normal, surfel_pixel, surfel_position};
import package::common::view::{View, SKY_DEPTH, uv_of_texel, view_position, pixel_of};
import package::hierarchical::same_surface::{same_surface, square_width};
import package::temporal::history::{history_depth, history_direction, history_frames, history_light, history_object};
import package::temporal::previous_view::PreviousView;

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var<uniform> previous: PreviousView;
@group(0) @binding(3) var surfels: texture_2d<u32>;
@group(0) @binding(4) var bounce_before: texture_2d<u32>;
@group(0) @binding(5) var reprojected: texture_storage_2d<rgba32float, write>;
@if(animated) @group(0) @binding(6) var object: texture_2d<u32>;
@if(animated) @group(0) @binding(7) var<storage, read> objects: array<Object>;

/// Taps of less weight in total do not count.
const MIN_WEIGHT: f32 = 0.01;

@compute @workgroup_size(8, 8)
fn reproject(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(surfels);
    if any(id.xy >= size) {
        return;
    }
    textureStore(reprojected, id.xy, vec4f(0.0));
    let words = textureLoad(surfels, id.xy, 0);
    if previous.valid == 0u || surfel_depth(words) <= SKY_DEPTH {
        return;
    }
    let position = surfel_position(words, id.xy, params.scale, view.display_size, view.tan_half_fov);
    var own_object = 0u;
    var to_previous = previous.view_to_previous;
    @if(animated) {
        own_object = textureLoad(object, vec2u(surfel_pixel(words, id.xy, params.scale)), 0).x;
        to_previous = objects[own_object].view_to_previous;
    }
    let before = (to_previous * vec4f(position, 1.0)).xyz;
    if before.z >= 0.0 {
        return;
    }
    let normal_before = normalize(transform_normal(to_previous, surfel_normal(words)));
    let way = pixel_of(before, previous.tan_half_fov, view.display_size)
        - pixel_of(position, view.tan_half_fov, view.display_size);
    // A surface far off the screen may have coordinates that do not fit an integer.
    if any(abs(way) > view.display_size) {
        return;
    }
    let at = vec2f(id.xy) + way / params.scale;
    let corner = floor(at);
    let f = at - corner;
    // If nothing moved, one texel has all the weight.
    let taps = select(4u, 1u, all(f == vec2f(0.0)));
    let width = square_width(params.scale, -before.z, previous.tan_half_fov.y, view.display_size.y);
    var sum = vec3f(0.0);
    var weights = 0.0;
    var bounce = 0u;
    for (var i = 0u; i < taps; i++) {
        let offset = vec2u(i & 1u, i >> 1u);
        let tap = vec2i(corner) + vec2i(offset);
        if any(tap < vec2i(0)) || any(tap >= vec2i(size)) {
            continue;
        }
        let other = textureLoad(bounce_before, tap, 0);
        let depth = history_depth(other);
        let uv = uv_of_texel(vec2u(tap), params.scale, view.display_size);
        let position_before = view_position(uv, depth, previous.tan_half_fov);
        let direction = normalize(history_direction(other));
        // The position inside the texel is unknown and its centre is assumed: one width more.
        if depth > SKY_DEPTH && history_object(other) == (own_object & 15u)
            && (taps == 1u || same_surface(normal_before, before, direction, position_before, 2.0 * width)) {
            let share = select(1.0 - f, f, offset == vec2u(1u));
            sum += share.x * share.y * history_light(other);
            weights += share.x * share.y;
            bounce = history_frames(other);
        }
    }
    if weights > MIN_WEIGHT {
        textureStore(reprojected, id.xy, vec4f(sum / weights, f32(bounce)));
    }
}
