// variants: from_gbuffer, lit, lit_planes, dark_planes
// One level of the pyramid from the four children of each texel: surfels, or, with `from_gbuffer`, full-resolution
// pixels. Only with `lit` the surfels have radiance. With `lit_planes` or `dark_planes` it also writes planes, with or
// without their radiance. Depth and normal are those of one child, never an average.
import package::common::division::Division;
import package::common::surfel::{Surfel, pack_surfel, surfel_depth, surfel_normal, surfel_radiance, surfel_offset};
import package::common::view::{View, SKY_DEPTH, view_position};
@if(lit_planes) import package::common::plane::plane_of_surfel;
@if(dark_planes) import package::common::plane::dark_plane_of_surfel;
@if(lit || lit_planes) import package::hierarchical::same_surface::same_surface;
import package::hierarchical::same_surface::square_width;

struct Params {
    // Width of a child in full-resolution pixels.
    child_scale: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_storage_2d<rgba32uint, write>;
@if(!from_gbuffer) @group(0) @binding(3) var children: texture_2d<u32>;
@if(from_gbuffer) @group(0) @binding(3) var depth: texture_2d<f32>;
@if(from_gbuffer) @group(0) @binding(4) var normal: texture_2d<f32>;
@if(from_gbuffer && (lit || lit_planes)) @group(0) @binding(5) var direct: texture_2d<f32>;
@if(lit_planes) @group(0) @binding(6) var planes: texture_storage_2d<rgba32uint, write>;
@if(dark_planes && !lit_planes) @group(0) @binding(6) var planes: texture_storage_2d<rg32uint, write>;

// Keep the child with the most support (2010, Equation 5) instead of the nearest one (2009).
override VOTE: bool;

// Widths of the Gaussians of Equation 5; the paper leaves them open. g1 is 1 at the child itself and this value one
// pixel away.
const G1_NEIGHBOUR: f32 = 0.60653066;
// 1 - cosine between normals: half the weight at about 30 degrees.
const G2_WIDTH: f32 = 0.12;
// Distance of the neighbour from the child's tangent plane, in widths of a child at its depth. The paper takes the
// difference of depths. Then a slanted surface always loses to one that faces the eye, and the light of floors and side
// walls is lost (a sixth of all light in a closed box).
const G3_WIDTH: f32 = 1.0;

// Where two children have equal support, the one nearer to the middle of the screen wins, so that the result mirrors
// with the scene. Small against any difference in support.
const TIE: f32 = 0.01;

// Where two children are alike up to rounding, the first one wins. A symmetric view has such pairs in its middle at every
// level: rounding, which changes with the world's unit, must not choose between its two sides. Relative to the value, so
// that it scales; above the rounding of depths and scores (some 1e-7), below any difference between surfaces.
const ORDER: f32 = 3e-5;

@if(!from_gbuffer)
fn load(pixel: vec2i) -> Surfel {
    let words = textureLoad(children, pixel, 0);
    @if(lit || lit_planes) let radiance = surfel_radiance(words);
    @if(!lit && !lit_planes) let radiance = vec3f(0.0);
    return Surfel(surfel_depth(words), surfel_normal(words), radiance, surfel_offset(words));
}

@if(from_gbuffer)
fn load(pixel: vec2i) -> Surfel {
    @if(lit || lit_planes) let radiance = textureLoad(direct, pixel, 0).rgb;
    @if(!lit && !lit_planes) let radiance = vec3f(0.0);
    return Surfel(textureLoad(depth, pixel, 0).x, textureLoad(normal, pixel, 0).xyz, radiance, vec2u(0u));
}

@if(!from_gbuffer)
fn size() -> vec2i {
    return vec2i(textureDimensions(children));
}

@if(from_gbuffer)
fn size() -> vec2i {
    return vec2i(textureDimensions(depth));
}

fn inside(pixel: vec2i) -> bool {
    return all(pixel >= vec2i(0)) && all(pixel < size());
}

fn position(pixel: vec2i, surfel: Surfel) -> vec3f {
    let at = vec2f(pixel) * params.child_scale + vec2f(surfel.offset) + 0.5;
    return view_position(at / view.display_size, surfel.depth, view.tan_half_fov);
}

/// Width of a child on a surface that faces the eye at its depth, scene units.
fn child_width(child: Surfel) -> f32 {
    return square_width(params.child_scale, child.depth, view.tan_half_fov.y, view.display_size.y);
}

/// Equation 5: similarity of a child to its L1 neighbourhood.
fn score(pixel: vec2i, child: Surfel) -> f32 {
    let here = position(pixel, child);
    var sum = 1.0;
    for (var i = 0; i < 4; i++) {
        let neighbour = pixel + select(vec2i(0, 2 * i - 5), vec2i(2 * i - 1, 0), i < 2);
        if !inside(neighbour) {
            continue;
        }
        let other = load(neighbour);
        if other.depth > SKY_DEPTH {
            let bend = (1.0 - dot(other.normal, child.normal)) / G2_WIDTH;
            let jump = dot(child.normal, position(neighbour, other) - here) / (G3_WIDTH * child_width(child));
            sum += G1_NEIGHBOUR * exp(-0.5 * (bend * bend + jump * jump));
        }
    }
    return sum;
}

struct Child {
    // SKY_DEPTH if there is no surface or the child is off the screen.
    surfel: Surfel,
    child_offset: vec2u,
    position: vec3f,
    // The child with the largest value is kept. 0 without a surface.
    value: f32,
    on_screen: bool,
}

fn load_child(first: vec2i, child_offset: vec2u) -> Child {
    let pixel = first + vec2i(child_offset);
    let on_screen = inside(pixel);
    var surfel = load(min(pixel, size() - 1));
    surfel.depth = select(SKY_DEPTH, surfel.depth, on_screen);
    let at = position(pixel, surfel);
    // The distance decides, not the depth: a wall that faces the camera has constant depth, so rounding would decide.
    // Distances mirror with the scene.
    var value = inverseSqrt(dot(at, at));
    if VOTE {
        value = TIE * value * surfel.depth;
        // Without a surface there is nothing to score.
        if surfel.depth > SKY_DEPTH {
            value += score(pixel, surfel);
        }
    }
    value -= value * ORDER * f32(child_offset.x + 2u * child_offset.y);
    return Child(surfel, child_offset, at, select(0.0, value, surfel.depth > SKY_DEPTH), on_screen);
}

/// The child with the larger value. Selected field by field, because a branch costs more.
fn better(a: Child, b: Child) -> Child {
    let b_wins = b.value > a.value;
    return Child(
        Surfel(
            select(a.surfel.depth, b.surfel.depth, b_wins),
            select(a.surfel.normal, b.surfel.normal, b_wins),
            vec3f(0.0),
            select(a.surfel.offset, b.surfel.offset, b_wins),
        ),
        select(a.child_offset, b.child_offset, b_wins),
        select(a.position, b.position, b_wins),
        select(a.value, b.value, b_wins),
        true,
    );
}

/// Radiance and 1 if the child shows the same surface as the kept one, so that they may be averaged; otherwise 0.
@if(lit || lit_planes)
fn radiance_where_same(kept: Child, width: f32, child: Child) -> vec4f {
    let same = same_surface(kept.surfel.normal, kept.position, child.surfel.normal, child.position, width);
    return select(vec4f(0.0), vec4f(child.surfel.radiance, 1.0), same && child.surfel.depth > SKY_DEPTH);
}

/// Mean radiance of the children that show the kept surface, over the whole area of the texel.
@if(lit || lit_planes)
fn radiance_of_texel(kept: Child, child_00: Child, child_10: Child, child_01: Child, child_11: Child) -> vec3f {
    let width = 2.0 * child_width(kept.surfel);
    let same = radiance_where_same(kept, width, child_00)
        + radiance_where_same(kept, width, child_10)
        + radiance_where_same(kept, width, child_01)
        + radiance_where_same(kept, width, child_11);
    let on_screen = vec4f(vec4<bool>(child_00.on_screen, child_10.on_screen, child_01.on_screen, child_11.on_screen));
    let depths = vec4f(child_00.surfel.depth, child_10.surfel.depth, child_01.surfel.depth, child_11.surfel.depth);
    let solid = vec4f(depths > vec4f(SKY_DEPTH));
    // The kept child agrees with itself, so the count is at least one. The texel stands for its whole area, but the sky
    // in it sends nothing. Without this factor silhouettes would become brighter with every level. Children that show
    // another surface are assumed to be lit like the kept one.
    let share = dot(solid, vec4f(1.0)) / (same.w * dot(on_screen, vec4f(1.0)));
    return same.rgb * share;
}

@compute @workgroup_size(8, 8)
fn pyramid(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(surfels)) {
        return;
    }
    // The four children are variables instead of an array, so that they stay in registers.
    let first = vec2i(id) * 2;
    let child_00 = load_child(first, vec2u(0u, 0u));
    let child_10 = load_child(first, vec2u(1u, 0u));
    let child_01 = load_child(first, vec2u(0u, 1u));
    let child_11 = load_child(first, vec2u(1u, 1u));
    let kept = better(better(better(child_00, child_10), child_01), child_11);
    @if(!lit && !lit_planes) let radiance = vec3f(0.0);
    @if(lit || lit_planes) let radiance = radiance_of_texel(kept, child_00, child_10, child_01, child_11);
    let surfel = Surfel(
        kept.surfel.depth,
        kept.surfel.normal,
        radiance,
        kept.surfel.offset + kept.child_offset * u32(params.child_scale),
    );
    let words = select(vec4u(0u), pack_surfel(surfel), kept.value > 0.0);
    textureStore(surfels, id, words);
    @if(lit_planes) {
        let scale = 2.0 * params.child_scale;
        textureStore(planes, id, plane_of_surfel(words, id, scale, view.display_size, view.tan_half_fov));
    }
    @if(dark_planes && !lit_planes) {
        let scale = 2.0 * params.child_scale;
        let plane = dark_plane_of_surfel(words, id, scale, view.display_size, view.tan_half_fov);
        textureStore(planes, id, vec4u(plane, 0u, 0u));
    }
}
