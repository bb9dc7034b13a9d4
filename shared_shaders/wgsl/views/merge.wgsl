// variants: float16
// Merges the light of another view of the scene into this view: the larger of the two (Soler et al. 2009, section 6). A
// pixel uses the other view's light if depth and normal there show the same surface, as in the temporal filter.
import package::common::view::{View, SKY_DEPTH, texel_of_uv, uv_of_texel, view_position};

struct Params {
    world_to_other: mat4x4f,
    other_tan_half_fov: vec2f,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var depth: texture_2d<f32>;
@group(0) @binding(3) var normal: texture_2d<f32>;
@group(0) @binding(4) var light: texture_2d<f32>;
@group(0) @binding(5) var other_depth: texture_2d<f32>;
@group(0) @binding(6) var other_normal: texture_2d<f32>;
@group(0) @binding(7) var other_light: texture_2d<f32>;
@if(!float16) @group(0) @binding(8) var most: texture_storage_2d<rgba32float, write>;
@if(float16) @group(0) @binding(8) var most: texture_storage_2d<rgba16float, write>;

/// A tap shows another surface if it is farther than this from the tangent plane, in widths of the larger of the two
/// pixels, or if the normals differ by more than 25 degrees, as in `temporal/temporal.wgsl`.
const PLANE_TOLERANCE: f32 = 2.0;
const NORMAL_TOLERANCE: f32 = 0.906;
/// A smaller total weight of taps does not count.
const MIN_WEIGHT: f32 = 0.01;

/// The other view's light on the surface of this view's pixel; 0 if it does not see the surface.
fn found(pixel: vec2u) -> vec3f {
    let d = textureLoad(depth, pixel, 0).x;
    if d <= SKY_DEPTH {
        return vec3f(0.0);
    }
    let to_other = params.world_to_other * view.view_to_world;
    let here = view_position(uv_of_texel(pixel, 1.0, view.display_size), d, view.tan_half_fov);
    let position = (to_other * vec4f(here, 1.0)).xyz;
    // Rotations preserve lengths.
    let direction = (to_other * vec4f(textureLoad(normal, pixel, 0).xyz, 0.0)).xyz;
    if position.z >= 0.0 {
        return vec3f(0.0);
    }
    let screen = position.xy / (-position.z * params.other_tan_half_fov);
    if any(abs(screen) > vec2f(1.0)) {
        return vec3f(0.0);
    }
    let at = texel_of_uv(screen * vec2f(0.5, -0.5) + 0.5, 1.0, view.display_size) - 0.5;
    let corner = floor(at);
    let f = at - corner;
    let pixel_widths = 2.0 * vec2f(view.tan_half_fov.y, params.other_tan_half_fov.y) / view.display_size.y
        * vec2f(d, -position.z);
    let tolerance = PLANE_TOLERANCE * max(pixel_widths.x, pixel_widths.y);
    var sum = vec3f(0.0);
    var weights = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let offset = vec2u(i & 1u, i >> 1u);
        let tap = vec2i(corner) + vec2i(offset);
        if any(tap < vec2i(0)) || any(tap >= vec2i(view.display_size)) {
            continue;
        }
        let tap_depth = textureLoad(other_depth, tap, 0).x;
        let uv = uv_of_texel(vec2u(tap), 1.0, view.display_size);
        let distance = dot(direction, view_position(uv, tap_depth, params.other_tan_half_fov) - position);
        let cosine = dot(direction, textureLoad(other_normal, tap, 0).xyz);
        if tap_depth > SKY_DEPTH && abs(distance) <= tolerance && cosine >= NORMAL_TOLERANCE {
            let share = select(1.0 - f, f, offset == vec2u(1u));
            sum += share.x * share.y * textureLoad(other_light, tap, 0).rgb;
            weights += share.x * share.y;
        }
    }
    return select(vec3f(0.0), sum / max(weights, MIN_WEIGHT), weights > MIN_WEIGHT);
}

@compute @workgroup_size(8, 8)
fn merge(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(most)) {
        return;
    }
    textureStore(most, id.xy, vec4f(max(textureLoad(light, id.xy, 0).rgb, found(id.xy)), 1.0));
}
