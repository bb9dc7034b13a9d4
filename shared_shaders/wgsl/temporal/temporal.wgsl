// variants: animated, float16, glossy
// Temporal filter (Soler & Hoel 2010, Equation 6) with the filtered image as history:
//
//     F_i = a W(F_{i-1}) + (1 - a) I_i
//
// W reprojects along the motion of the camera and, with `animated`, of each object. History counts only if depth and
// normal show the same surface. A pixel with a history of n frames uses at most a = 1 - 1 / (n + 1), so that a newly
// visible surface starts a new average and converges at once. (The paper prints I_{i-1} for the history, which would
// average two frames only.)
//
// With `glossy` the light is that of mirror lobes. If the eye, the surface or the mirrored surface moves, it changes
// faster the narrower the lobe is, so fewer frames are averaged (the paper's discussion, section 5.3).
import package::common::division::Division;
import package::common::view::{View, SKY_DEPTH, uv_of_texel, view_position, pixel_of};
@if(float16) import package::common::math::LARGEST_FLOAT16;
@if(glossy) import package::common::scene::Material;
@if(animated) import package::common::scene::{Object, transform_normal};
@if(!animated) import package::common::scene::transform_normal;
import package::temporal::history::{
    History, MOST_FRAMES, pack_history, history_depth, history_direction, history_frames, history_light, history_object,
};
import package::temporal::previous_view::PreviousView;

struct Params {
    // The parameter a: share of the history, 0..1.
    a: f32,
    // After this many static frames the weight of older light is negligible, and a static pixel may average without
    // limit.
    settle_frames: u32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var<uniform> previous: PreviousView;
@group(0) @binding(3) var depth: texture_2d<f32>;
@group(0) @binding(4) var normal: texture_2d<f32>;
@group(0) @binding(5) var indirect: texture_2d<f32>;
@group(0) @binding(6) var history_before: texture_2d<u32>;
@group(0) @binding(7) var history: texture_storage_2d<rgba32uint, write>;
@if(!float16) @group(0) @binding(8) var filtered: texture_storage_2d<rgba32float, write>;
@if(float16) @group(0) @binding(8) var filtered: texture_storage_2d<rgba16float, write>;
@if(animated) @group(0) @binding(9) var object: texture_2d<u32>;
@if(animated) @group(0) @binding(10) var<storage, read> objects: array<Object>;
@if(glossy) @group(0) @binding(11) var material: texture_2d<u32>;
@if(glossy) @group(0) @binding(12) var<storage, read> materials: array<Material>;

/// A tap shows another surface if it is farther than this from the tangent plane, in widths of a pixel. Shading normals
/// tilt planes: one pixel to the side, a plane that is off by 10 degrees and seen at 80 degrees is one pixel away.
const PLANE_TOLERANCE: f32 = 2.0;
/// ... or if the normals differ by more than 25 degrees.
const NORMAL_TOLERANCE: f32 = 0.906;
/// Light that moved by this share of the image's height is discarded. Screen-space light depends on the screen
/// position, and every reprojection blurs it.
const REACH: f32 = 0.1;
/// A smaller total weight of taps does not count.
const MIN_WEIGHT: f32 = 0.01;

/// The parameter a for a lobe of this width. The number of averaged frames is proportional to the width.
@if(glossy)
fn narrowed(a: f32, width: f32) -> f32 {
    let frames = max((1.0 + a) / (1.0 - a) * width, 1.0);
    return (frames - 1.0) / (frames + 1.0);
}

struct Reprojected {
    light: vec3f,
    frames: f32,
    weight: f32,
}

/// A surface in the previous frame.
struct Surface {
    position: vec3f,
    normal: vec3f,
    object: u32,
}

/// Whether the previous frame shows this surface at a pixel.
fn shows(words: vec4u, tap: vec2i, surface: Surface) -> bool {
    let depth = history_depth(words);
    let position = view_position(uv_of_texel(vec2u(tap), 1.0, view.display_size), depth, previous.tan_half_fov);
    let pixel_width = 2.0 * previous.tan_half_fov.y / view.display_size.y * depth;
    let distance = abs(dot(surface.normal, position - surface.position));
    // Squares instead of a square root, because the direction is not of unit length.
    let direction = history_direction(words);
    let cosine = max(dot(surface.normal, direction), 0.0);
    return depth > SKY_DEPTH && history_object(words) == (surface.object & 15u)
        && distance <= PLANE_TOLERANCE * pixel_width
        && cosine * cosine >= NORMAL_TOLERANCE * NORMAL_TOLERANCE * dot(direction, direction);
}

/// The previous frame's light of a surface that was at pixel `at`.
fn reproject(surface: Surface, at: vec2f) -> Reprojected {
    let corner = floor(at - 0.5);
    let f = at - 0.5 - corner;
    let size = vec2i(view.display_size);
    // If nothing moved, one texel has all the weight.
    let taps = select(4u, 1u, all(f == vec2f(0.0)));
    var sum = Reprojected(vec3f(0.0), 0.0, 0.0);
    for (var i = 0u; i < taps; i++) {
        let offset = vec2u(i & 1u, i >> 1u);
        let tap = vec2i(corner) + vec2i(offset);
        let share = select(1.0 - f, f, offset == vec2u(1u));
        if all(tap >= vec2i(0)) && all(tap < size) {
            let words = textureLoad(history_before, tap, 0);
            let weight = select(0.0, share.x * share.y, shows(words, tap, surface));
            sum.light += weight * history_light(words);
            sum.frames += weight * f32(history_frames(words));
            sum.weight += weight;
        }
    }
    return sum;
}

@compute @workgroup_size(8, 8)
fn temporal(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(filtered)) {
        return;
    }
    let d = textureLoad(depth, id, 0).x;
    if d <= SKY_DEPTH {
        textureStore(history, id, vec4u(0u));
        textureStore(filtered, id, vec4f(0.0, 0.0, 0.0, 1.0));
        return;
    }
    let n = textureLoad(normal, id, 0).xyz;
    let position = view_position(uv_of_texel(id, 1.0, view.display_size), d, view.tan_half_fov);
    var light = textureLoad(indirect, id, 0).rgb;
    var own_object = 0u;
    var to_previous = previous.view_to_previous;
    @if(animated) {
        own_object = textureLoad(object, id, 0).x;
        to_previous = objects[own_object].view_to_previous;
    }
    let position_before = (to_previous * vec4f(position, 1.0)).xyz;
    var cap = params.a;
    var reach = REACH;
    @if(glossy) {
        // Standard deviation of cos^s, radians.
        let width = inverseSqrt(max(materials[textureLoad(material, id, 0).x].phong_exponent, 0.0) + 1.0);
        cap = narrowed(cap, width);
        reach *= width;
    }
    var frames = 0u;
    if previous.valid != 0u && position_before.z < 0.0 {
        // The motion on the screen, added to the pixel's own centre. If nothing moved it is exactly zero, and the
        // average of a static image stays sharp.
        let way = pixel_of(position_before, previous.tan_half_fov, view.display_size)
            - pixel_of(position, view.tan_half_fov, view.display_size);
        let at = vec2f(id) + 0.5 + way;
        // A surface far off the screen may have coordinates that do not fit an integer.
        if all(abs(at - 0.5 * view.display_size) < view.display_size) {
            let surface = Surface(position_before, normalize(transform_normal(to_previous, n)), own_object);
            let before = reproject(surface, at);
            cap = min(cap, max(1.0 - length(way) / (reach * view.display_size.y), 0.0));
            if previous.static_frames >= params.settle_frames {
                cap = 1.0;
            }
            if before.weight > MIN_WEIGHT {
                frames = u32(before.frames / before.weight + 0.01);
                let a = min(cap, 1.0 - 1.0 / f32(frames + 1u));
                light = mix(light, before.light / before.weight, a);
            }
        }
    }
    // An average with weight a has the noise of a mean of (1 + a) / (1 - a) frames.
    let most = u32(min((1.0 + cap) / max(1.0 - cap, 1e-4), f32(MOST_FRAMES)));
    @if(float16) {
        light = min(light, vec3f(LARGEST_FLOAT16));
    }
    textureStore(history, id, pack_history(History(d, n, own_object, light, min(frames + 1u, most))));
    textureStore(filtered, id, vec4f(light, 1.0));
}
