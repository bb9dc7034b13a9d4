// variants: to_display, float16, ambient_visibility
// Upsamples the indirect light of one level to the next finer one and adds the light gathered there; with `to_display`,
// upsamples it to full resolution. One invocation computes all children of a coarse texel, because they share its nine
// neighbours. With `ambient_visibility` the texture holds one number instead of light.
import package::common::division::Division;
import package::common::view::{View, SKY_DEPTH};
@if(to_display) import package::common::view::{uv_of_texel, view_position};
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position};
@if(float16) import package::common::math::LARGEST_FLOAT16;
import package::hierarchical::bilateral::{surface_weight, inverse_tolerance, kernel_weights, MIN_WEIGHT, NEARER};

struct Params {
    // Widths of a texel of each level in full-resolution pixels.
    fine_scale: f32,
    coarse_scale: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var coarse_surfels: texture_2d<u32>;
@group(0) @binding(3) var coarse_indirect: texture_2d<f32>;
@if(!float16 && !ambient_visibility) @group(0) @binding(4) var indirect: texture_storage_2d<rgba32float, write>;
@if(ambient_visibility) @group(0) @binding(4) var indirect: texture_storage_2d<r32float, write>;
@if(float16 && !ambient_visibility) @group(0) @binding(4) var indirect: texture_storage_2d<rgba16float, write>;
@if(!to_display) @group(0) @binding(5) var surfels: texture_2d<u32>;
@if(!to_display) @group(0) @binding(6) var gathered: texture_2d<f32>;
@if(to_display) @group(0) @binding(5) var depth: texture_2d<f32>;
@if(to_display) @group(0) @binding(6) var normal: texture_2d<f32>;

// Children of a coarse texel along one axis.
override CHILDREN: u32;
// 0 nearest, 1 linear, 2 spline (3x3).
override KERNEL: u32;
// Whether this level gathered anything. If only one level is wanted, the others do not.
override GATHERED: bool;

// The fine texel's surface. Its tangent plane is dot(normal, position) = offset.
struct Fine {
    depth: f32,
    normal: vec3f,
    offset: f32,
}

@if(!to_display)
fn load_fine(texel: vec2u) -> Fine {
    let words = textureLoad(surfels, texel, 0);
    let normal = surfel_normal(words);
    let position = surfel_position(words, texel, params.fine_scale, view.display_size, view.tan_half_fov);
    return Fine(surfel_depth(words), normal, dot(normal, position));
}

@if(to_display)
fn load_fine(texel: vec2u) -> Fine {
    let d = textureLoad(depth, texel, 0).x;
    let n = textureLoad(normal, texel, 0).xyz;
    return Fine(d, n, dot(n, view_position(uv_of_texel(texel, 1.0, view.display_size), d, view.tan_half_fov)));
}

// A coarse texel. Without a surface `normal` is 0, which makes every weight 0, and `depth` is FAR.
struct Parent {
    depth: f32,
    normal: vec3f,
    position: vec3f,
    indirect: vec3f,
}

fn load_parent(texel: vec2i) -> Parent {
    // Off the screen the words are zero, like the sky.
    let size = vec2i(textureDimensions(coarse_surfels));
    let on_screen = all(vec2u(texel) < vec2u(size));
    let words = select(vec4u(0u), textureLoad(coarse_surfels, texel, 0), on_screen);
    let depth = surfel_depth(words);
    return Parent(
        select(FAR, depth, depth > SKY_DEPTH),
        select(vec3f(0.0), surfel_normal(words), depth > SKY_DEPTH),
        surfel_position(words, vec2u(texel), params.coarse_scale, view.display_size, view.tan_half_fov),
        textureLoad(coarse_indirect, clamp(texel, vec2i(0), size - 1), 0).rgb,
    );
}

// Sums of weighted light and of weights, and the light of the parent nearest in depth with its distance.
struct Sum {
    weighted: vec4f,
    closest: vec4f,
}

fn add(sum: Sum, fine: Fine, inverse_tolerance: f32, parent: Parent, kernel: f32) -> Sum {
    let distance = (dot(fine.normal, parent.position) - fine.offset) * inverse_tolerance;
    let weight = kernel * surface_weight(distance, dot(fine.normal, parent.normal));
    let gap = abs(parent.depth - fine.depth);
    return Sum(
        sum.weighted + weight * vec4f(parent.indirect, 1.0),
        select(sum.closest, vec4f(parent.indirect, gap), gap + NEARER * fine.depth < sum.closest.w),
    );
}

// Farther than any surface.
const FAR: f32 = 3.4e38;

@compute @workgroup_size(8, 8)
fn upsample(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(coarse_surfels)) {
        return;
    }
    // The nine parents are variables instead of an array, so that they stay in registers.
    let at = vec2i(id);
    let parent_00 = load_parent(at + vec2i(-1, -1));
    let parent_10 = load_parent(at + vec2i(0, -1));
    let parent_20 = load_parent(at + vec2i(1, -1));
    let parent_01 = load_parent(at + vec2i(-1, 0));
    let parent_11 = load_parent(at);
    let parent_21 = load_parent(at + vec2i(1, 0));
    let parent_02 = load_parent(at + vec2i(-1, 1));
    let parent_12 = load_parent(at + vec2i(0, 1));
    let parent_22 = load_parent(at + vec2i(1, 1));
    let fine_size = textureDimensions(indirect);
    let tolerance = inverse_tolerance(1.0, params.coarse_scale, view.tan_half_fov.y, view.display_size.y);
    for (var child = 0u; child < CHILDREN * CHILDREN; child++) {
        let offset = vec2u(child % CHILDREN, child / CHILDREN);
        let texel = id * CHILDREN + offset;
        if any(texel >= fine_size) {
            continue;
        }
        let fine = load_fine(texel);
        // From the middle of the coarse texel, in widths of it.
        let f = (vec2f(offset) + 0.5) / f32(CHILDREN) - 0.5;
        let column = kernel_weights(KERNEL, f.x);
        let row = kernel_weights(KERNEL, f.y);
        let nearness = tolerance / max(fine.depth, SMALLEST_DEPTH);
        // Of parents that are equally near, the middle one is used.
        var sum = Sum(vec4f(0.0), vec4f(parent_11.indirect, abs(parent_11.depth - fine.depth)));
        sum = add(sum, fine, nearness, parent_00, column.x * row.x);
        sum = add(sum, fine, nearness, parent_10, column.y * row.x);
        sum = add(sum, fine, nearness, parent_20, column.z * row.x);
        sum = add(sum, fine, nearness, parent_01, column.x * row.y);
        sum = add(sum, fine, nearness, parent_11, column.y * row.y);
        sum = add(sum, fine, nearness, parent_21, column.z * row.y);
        sum = add(sum, fine, nearness, parent_02, column.x * row.z);
        sum = add(sum, fine, nearness, parent_12, column.y * row.z);
        sum = add(sum, fine, nearness, parent_22, column.z * row.z);
        // If no parent shows this surface, use the one nearest in depth.
        let weight = sum.weighted.w;
        var result = select(sum.closest.rgb, sum.weighted.rgb / max(weight, MIN_WEIGHT), weight > MIN_WEIGHT);
        @if(!to_display) {
            if GATHERED {
                result += textureLoad(gathered, texel, 0).rgb;
            }
        }
        result = select(vec3f(0.0), result, fine.depth > SKY_DEPTH);
        @if(float16) {
            result = min(result, vec3f(LARGEST_FLOAT16));
        }
        // Sum of the weights, for passes that recompute pixels where it is small. It is 1 for the sky.
        let known = select(1.0, min(weight, 1.0), fine.depth > SKY_DEPTH);
        textureStore(indirect, texel, vec4f(result, known));
    }
}

// The smallest normal float, because the sky has no depth to divide by.
const SMALLEST_DEPTH: f32 = 1.17549435e-38;
