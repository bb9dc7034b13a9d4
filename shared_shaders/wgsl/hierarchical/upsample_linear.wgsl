// variants: float16, ambient_visibility, packed, records
// Upsamples light from half resolution to the display with the linear kernel. One invocation computes the four pixels
// between four coarse texels, which are the parents of all of them. This takes fewer fetches than nine for the four
// pixels of a texel. With `ambient_visibility` the texture holds one number. With `packed` the coarse light is the
// radiance of surfels. With `records`, pixels whose surface no parent shows are listed for radiance_cache/fill.wgsl.
import package::common::division::Division;
import package::common::view::{View, SKY_DEPTH, uv_of_texel, view_position};
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position};
@if(packed && !ambient_visibility) import package::common::surfel::surfel_radiance;
@if(float16) import package::common::math::LARGEST_FLOAT16;
@if(records) import package::radiance_cache::counters::{counters, first_pixel, most_pixels};
import package::hierarchical::bilateral::{surface_weight, inverse_tolerance, MIN_WEIGHT, NEARER};

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var coarse_surfels: texture_2d<u32>;
@if(!packed || ambient_visibility) @group(0) @binding(2) var coarse_indirect: texture_2d<f32>;
@if(!float16 && !ambient_visibility) @group(0) @binding(3) var indirect: texture_storage_2d<rgba32float, write>;
@if(ambient_visibility) @group(0) @binding(3) var indirect: texture_storage_2d<r32float, write>;
@if(float16 && !ambient_visibility) @group(0) @binding(3) var indirect: texture_storage_2d<rgba16float, write>;
@group(0) @binding(4) var depth: texture_2d<f32>;
@group(0) @binding(5) var normal: texture_2d<f32>;

/// Weight of the parents below which a pixel is listed, to look for its own record: almost that of the nearest parent
/// alone.
@if(records)
const LEAST_WEIGHT: f32 = 0.5;

const COARSE_SCALE: f32 = 2.0;
/// Farther than any surface.
const FAR: f32 = 3.4e38;

/// A coarse texel. Without a surface `normal` is 0, which makes every weight 0, and `depth` is FAR.
struct Parent {
    depth: f32,
    normal: vec3f,
    position: vec3f,
    light: vec3f,
}

fn load_parent(texel: vec2i) -> Parent {
    // Off the screen the words are zero, like the sky.
    let size = vec2i(textureDimensions(coarse_surfels));
    let words = select(vec4u(0u), textureLoad(coarse_surfels, texel, 0), all(vec2u(texel) < vec2u(size)));
    let there = surfel_depth(words) > SKY_DEPTH;
    @if(packed && !ambient_visibility) let light = surfel_radiance(words);
    @if(!packed || ambient_visibility) let light = textureLoad(coarse_indirect, clamp(texel, vec2i(0), size - 1), 0).rgb;
    return Parent(
        select(FAR, surfel_depth(words), there),
        select(vec3f(0.0), surfel_normal(words), there),
        surfel_position(words, vec2u(texel), COARSE_SCALE, view.display_size, view.tan_half_fov),
        light,
    );
}

/// The pixel, its tangent plane (dot(normal, position) = offset), and the inverse of the tolerated distance to it.
struct Fine {
    depth: f32,
    normal: vec3f,
    offset: f32,
    nearness: f32,
}

/// Sums of weighted light and of weights, and the light of the parent nearest in depth with its distance.
struct Sum {
    weighted: vec4f,
    closest: vec4f,
}

fn add(sum: Sum, fine: Fine, parent: Parent, kernel: f32) -> Sum {
    let distance = (dot(fine.normal, parent.position) - fine.offset) * fine.nearness;
    let weight = kernel * surface_weight(distance, dot(fine.normal, parent.normal));
    let gap = abs(parent.depth - fine.depth);
    return Sum(
        sum.weighted + weight * vec4f(parent.light, 1.0),
        select(sum.closest, vec4f(parent.light, gap), gap + NEARER * fine.depth < sum.closest.w),
    );
}

/// The nearer parent has three quarters of the weight along each axis.
const NEAR: f32 = 0.75;

/// Writes the pixel whose nearest parent is `nearest`. `across` and `down` are next to it, `far` is diagonal.
fn write_pixel(texel: vec2i, tolerance: f32, nearest: Parent, across: Parent, down: Parent, far: Parent) {
    if any(vec2u(texel) >= textureDimensions(indirect)) {
        return;
    }
    let d = textureLoad(depth, texel, 0).x;
    let n = textureLoad(normal, texel, 0).xyz;
    let uv = uv_of_texel(vec2u(texel), 1.0, view.display_size);
    // The sky has no depth to divide by, and no light.
    let fine = Fine(d, n, dot(n, view_position(uv, d, view.tan_half_fov)), tolerance / max(d, 1e-30));
    var sum = Sum(vec4f(0.0), vec4f(0.0, 0.0, 0.0, FAR));
    sum = add(sum, fine, nearest, NEAR * NEAR);
    sum = add(sum, fine, across, NEAR * (1.0 - NEAR));
    sum = add(sum, fine, down, NEAR * (1.0 - NEAR));
    sum = add(sum, fine, far, (1.0 - NEAR) * (1.0 - NEAR));
    // If no parent shows this surface, use the one nearest in depth.
    let weight = sum.weighted.w;
    var result = select(sum.closest.rgb, sum.weighted.rgb / max(weight, MIN_WEIGHT), weight > MIN_WEIGHT);
    @if(records) {
        if weight < LEAST_WEIGHT && d > SKY_DEPTH {
            let number = u32(texel.y) * textureDimensions(indirect).x + u32(texel.x);
            let entry = atomicAdd(&counters.pixels, 1u);
            if entry < most_pixels() {
                counters.lists[first_pixel() + entry] = number;
            }
        }
    }
    result = select(vec3f(0.0), result, d > SKY_DEPTH);
    @if(float16) { result = min(result, vec3f(LARGEST_FLOAT16)); }
    textureStore(indirect, texel, vec4f(result, 1.0));
}

@compute @workgroup_size(8, 8)
fn upsample(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    // The texels at and before `at`: there is one row and one column more than texels.
    let at = vec2i(id);
    if any(id > textureDimensions(coarse_surfels)) {
        return;
    }
    let a = load_parent(at + vec2i(-1, -1));
    let b = load_parent(at + vec2i(0, -1));
    let c = load_parent(at + vec2i(-1, 0));
    let d = load_parent(at);
    let tolerance = inverse_tolerance(1.0, COARSE_SCALE, view.tan_half_fov.y, view.display_size.y);
    let first = 2 * at - 1;
    write_pixel(first, tolerance, a, b, c, d);
    write_pixel(first + vec2i(1, 0), tolerance, b, a, d, c);
    write_pixel(first + vec2i(0, 1), tolerance, c, d, a, b);
    write_pixel(first + vec2i(1, 1), tolerance, d, c, b, a);
}
