// variants: alpha_tested, animated
// The finest froxel grid, in one pass over the scene's triangles, hidden ones included (Soler & Hoel 2010, section 4).
// Surfaces set the slices that they cross. Boundaries of solid matter instead flip every slice nearer than themselves,
// so that slices between a front and a back face stay set, even if the near plane cuts the solid open.
import package::common::view::View;
import package::common::scene::Vertex;
@if(alpha_tested) import package::common::scene::Material;
@if(animated) import package::common::scene::Object;
import package::common::froxels::{WORDS, SLICES, slices_of_range, slice_of_depth, slice_mask, WORD_SHIFT};
@if(alpha_tested) import package::common::scene_textures::is_hole;

struct Params {
    // Size of the grid in texels, and width of a texel in full-resolution pixels.
    grid: vec2f,
    scale: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(3) var<storage, read> depth_range: array<u32>;
@group(0) @binding(4) var<storage, read_write> froxels: array<atomic<u32>>;
@if(alpha_tested) @group(0) @binding(5) var<storage, read> materials: array<Material>;
@if(animated) @group(0) @binding(6) var<storage, read> objects: array<Object>;

// Whether the meshes are boundaries of solid matter.
override SOLID: bool;

struct Varyings {
    @builtin(position) clip: vec4f,
    @location(0) depth: f32,
    @if(alpha_tested) @location(1) uv: vec2f,
    @if(alpha_tested) @location(2) @interpolate(flat, either) material: u32,
}

// A surface that crosses more depth than this in one texel, in widths of the texel there, is a silhouette. Its slope
// does not tell how far the surface continues.
const STEEPEST: f32 = 8.0;

@vertex
fn vertex(@builtin(vertex_index) index: u32) -> Varyings {
    let source = vertices[index];
    var world = vec4f(source.position, 1.0);
    @if(animated) {
        world = objects[source.object].to_world * world;
    }
    let position = (view.world_to_view * world).xyz;
    // The last texels of the grid may reach beyond the screen. Texel coordinates are those of every other pass.
    let ndc = position.xy / view.tan_half_fov;
    let stretch = view.display_size / (params.scale * params.grid);
    let w = -position.z;
    var out: Varyings;
    out.clip = vec4f(
        (ndc.x + w) * stretch.x - w,
        w - (w - ndc.y) * stretch.y,
        view.near,
        w,
    );
    out.depth = w;
    @if(alpha_tested) {
        out.uv = source.uv;
        out.material = source.material;
    }
    return out;
}

@fragment
fn fragment(in: Varyings, @builtin(front_facing) front: bool) {
    let width = 2.0 * params.scale * view.tan_half_fov.y / view.display_size.y * in.depth;
    // From the middle of the texel to its corners.
    let reach = 0.5 * min(abs(dpdx(in.depth)) + abs(dpdy(in.depth)), STEEPEST * width);
    @if(alpha_tested) {
        if is_hole(materials[in.material].alpha_texture, in.uv) {
            discard;
        }
    }
    let slices = slices_of_range(depth_range[0], depth_range[1]);
    let texel = vec2u(in.clip.xy);
    let first_word = (texel.y * u32(params.grid.x) + texel.x) * u32(WORDS);
    if SOLID {
        // The boundary's own slice belongs to the inside for either face, so that matter thinner than a slice is kept.
        let last = i32(floor(slice_of_depth(in.depth, slices))) - select(0, 1, front);
        for (var word = 0; word < WORDS; word++) {
            let mask = slice_mask(0, last, word);
            if mask != 0u {
                atomicXor(&froxels[first_word + u32(word)], mask);
            }
        }
    } else {
        let first = slice_of_depth(in.depth - reach, slices);
        let last = slice_of_depth(in.depth + reach, slices);
        if last >= 0.0 && first < SLICES {
            let lowest = max(i32(floor(first)), 0);
            let highest = min(i32(floor(last)), i32(SLICES) - 1);
            let word = lowest >> WORD_SHIFT;
            atomicOr(&froxels[first_word + u32(word)], slice_mask(lowest, highest, word));
            // Only long spans continue in other words.
            for (var next = word + 1; next <= (highest >> WORD_SHIFT); next++) {
                atomicOr(&froxels[first_word + u32(next)], slice_mask(lowest, highest, next));
            }
        }
    }
}
