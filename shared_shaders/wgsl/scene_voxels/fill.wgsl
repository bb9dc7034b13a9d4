// variants: alpha_tested, animated
// Sets the voxels that the scene's surfaces cross: every triangle is covered with points less than a voxel apart.
import package::common::scene::Vertex;
@if(alpha_tested) import package::common::scene::Material;
@if(animated) import package::common::scene::Object;
@if(alpha_tested) import package::common::scene_textures::is_hole;
import package::scene_voxels::grid::{Grid, word_index, grid_position};

@group(0) @binding(0) var<storage, read> grid: Grid;
@group(0) @binding(1) var<storage, read> vertices: array<Vertex>;
@group(0) @binding(2) var<storage, read> indices: array<u32>;
@group(0) @binding(3) var<storage, read_write> voxels: array<atomic<u32>>;
@if(alpha_tested) @group(0) @binding(4) var<storage, read> materials: array<Material>;
@if(animated) @group(0) @binding(5) var<storage, read> objects: array<Object>;

// Points per voxel width along a side of a triangle. A voxel that a plane cuts by less than this spacing may be missed.
const POINTS_PER_VOXEL: f32 = 1.5;
// Invocations that share a triangle: invocation i modulo ROWS handles row i of its points. Small triangles have one or
// two rows, walls and floors hundreds. Fine voxels need more invocations (renderer/src/gi/scene_voxels.rs).
override ROWS: u32;
// Upper bound of the points along a side of a triangle inside the grid.
const MOST_POINTS: f32 = 8192.0;

fn corner(index: u32) -> vec3f {
    var world = vec4f(vertices[index].position, 1.0);
    @if(animated) {
        world = objects[vertices[index].object].to_world * world;
    }
    return grid_position(grid, world.xyz);
}

@compute @workgroup_size(256)
fn fill(@builtin(global_invocation_id) id: vec3u) {
    let first = id.x * 3u;
    if first + 2u >= arrayLength(&indices) {
        return;
    }
    let at = vec3u(indices[first], indices[first + 1u], indices[first + 2u]);
    let a = corner(at.x);
    let ab = corner(at.y) - a;
    let ac = corner(at.z) - a;
    let sides = vec2f(length(ab), length(ac)) * POINTS_PER_VOXEL;
    // Also rejects NaN.
    if !(max(sides.x, sides.y) < MOST_POINTS) {
        return;
    }
    let rows = u32(ceil(sides.x)) + 1u;
    @if(alpha_tested) let hole_texture = materials[vertices[at.x].material].alpha_texture;
    @if(alpha_tested) let uv = vertices[at.x].uv;
    @if(alpha_tested) let uv_ab = vertices[at.y].uv - uv;
    @if(alpha_tested) let uv_ac = vertices[at.z].uv - uv;
    for (var i = id.y; i <= rows; i += ROWS) {
        let b = f32(i) / f32(rows);
        // The row ends at the third side.
        let points = u32(ceil((1.0 - b) * sides.y)) + 1u;
        for (var j = 0u; j <= points; j++) {
            let c = (1.0 - b) * f32(j) / f32(points);
            @if(alpha_tested) {
                if is_hole(hole_texture, uv + b * uv_ab + c * uv_ac) {
                    continue;
                }
            }
            let voxel = clamp(vec3i(floor(a + b * ab + c * ac)), vec3i(0), vec3i(grid.size) - 1);
            let bit = 1u << (u32(voxel.x) & 31u);
            atomicOr(&voxels[word_index(grid, vec3u(voxel))], bit);
        }
    }
}
