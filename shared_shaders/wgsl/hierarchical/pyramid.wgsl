// variants: from_gbuffer
// One level of the pyramid from the four children of each texel: surfels, or with `from_gbuffer`
// full-resolution pixels. Depth and normal are those of one child, never an average.
import package::common::surfel::{Surfel, pack_surfel, surfel_depth, surfel_normal, surfel_radiance, surfel_offset};
import package::common::view::{View, SKY_DEPTH, view_position};
import package::hierarchical::same_surface::{same_surface, square_width};

struct Params {
    // Width of a child in full-resolution pixels.
    child_scale: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_storage_2d<rgba32uint, write>;
@if(!from_gbuffer) @group(0) @binding(3) var children: texture_2d<u32>;
@if(from_gbuffer) @group(0) @binding(3) var depth: texture_2d<f32>;
@if(from_gbuffer) @group(0) @binding(4) var normal: texture_2d<f32>;
@if(from_gbuffer) @group(0) @binding(5) var direct: texture_2d<f32>;

// Keep the child with the most support (2010, Equation 5) instead of the one nearest to the eye (2009).
override VOTE: bool = false;

// Widths of Equation 5's gaussians; the paper leaves them open. g1 is 1 at the child itself and this
// value one pixel away.
const G1_NEIGHBOUR: f32 = 0.60653066;
// 1 - cosine between normals: half weight at about 30 degrees.
const G2_WIDTH: f32 = 0.12;
// Distance of the neighbour from the child's tangent plane, in widths of a child at its depth. The paper
// takes the difference of their depths: then a slanted surface always loses to one that faces the eye, and
// the light of floors and side walls with it (a sixth of all light in a box whose walls meet).
const G3_WIDTH: f32 = 1.0;

// Where neighbours support two children alike the one nearer to the middle of the screen wins: a choice
// that mirrors when the scene does. Small against any difference in support.
const TIE: f32 = 0.01;

@if(!from_gbuffer)
fn load(pixel: vec2i) -> Surfel {
    let words = textureLoad(children, pixel, 0);
    return Surfel(surfel_depth(words), surfel_normal(words), surfel_radiance(words), surfel_offset(words));
}

@if(from_gbuffer)
fn load(pixel: vec2i) -> Surfel {
    return Surfel(
        textureLoad(depth, pixel, 0).x,
        textureLoad(normal, pixel, 0).xyz,
        textureLoad(direct, pixel, 0).rgb,
        vec2u(0u),
    );
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

/// Width that a child covers of a surface facing the eye at its depth, scene units.
fn child_width(child: Surfel) -> f32 {
    return square_width(params.child_scale, child.depth, view.tan_half_fov.y, view.display_size.y);
}

/// Equation 5: how much the L1 neighbourhood of a child looks like it.
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

/// Whether two children show the same surface, so that their radiance may be averaged.
fn agree(kept: Surfel, kept_position: vec3f, other: Surfel, other_position: vec3f) -> bool {
    return same_surface(kept.normal, kept_position, other.normal, other_position, 2.0 * child_width(kept));
}

@compute @workgroup_size(8, 8)
fn pyramid(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(surfels)) {
        return;
    }
    let first = vec2i(id.xy) * 2;
    var child: array<Surfel, 4>;
    var kept = -1;
    var best = 0.0;
    // Children on the screen, and those of them that show a surface.
    var seen = 0.0;
    var solid = 0.0;
    for (var i = 0; i < 4; i++) {
        let pixel = first + vec2i(i & 1, i >> 1);
        child[i].depth = SKY_DEPTH;
        if !inside(pixel) {
            continue;
        }
        let candidate = load(pixel);
        child[i] = candidate;
        seen += 1.0;
        if candidate.depth <= SKY_DEPTH {
            continue;
        }
        solid += 1.0;
        // The distance and not the depth: all of a wall that faces the camera has the same depth, and
        // rounding would choose. Distances mirror when the scene does.
        let closeness = 1.0 / length(position(pixel, candidate));
        var value = closeness;
        if VOTE {
            value = score(pixel, candidate) + TIE * closeness * candidate.depth;
        }
        if value > best {
            best = value;
            kept = i;
        }
    }
    if kept < 0 {
        textureStore(surfels, id.xy, vec4u(0u));
        return;
    }
    var surfel = child[kept];
    let place = vec2i(kept & 1, kept >> 1);
    let here = position(first + place, surfel);
    var radiance = vec3f(0.0);
    var count = 0.0;
    for (var i = 0; i < 4; i++) {
        if child[i].depth > SKY_DEPTH && agree(surfel, here, child[i], position(first + vec2i(i & 1, i >> 1), child[i])) {
            radiance += child[i].radiance;
            count += 1.0;
        }
    }
    // The kept child agrees with itself, so the count is at least one. The texel stands for all of its
    // area, but the sky in it sends nothing: without that factor silhouettes would grow brighter with
    // every level. Children that disagree are left to the kept surface: they are lit like it on average.
    surfel.radiance = radiance * (solid / (count * seen));
    surfel.offset += vec2u(place) * u32(params.child_scale);
    textureStore(surfels, id.xy, pack_surfel(surfel));
}
