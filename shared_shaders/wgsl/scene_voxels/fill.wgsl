// variants: alpha_tested, animated
// Sets the voxels that the scene's surfaces cross: every triangle is covered with points less than a voxel apart.
import package::common::division::Division;
import package::common::scene::Vertex;
@if(alpha_tested) import package::common::scene::Material;
@if(animated) import package::common::scene::Object;
@if(alpha_tested) import package::common::scene_textures::is_hole;
import package::scene_voxels::grid::{Grid, word_index, grid_position};

@group(1) @binding(0) var<uniform> division: Division;
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
// Corners of a triangle that is clipped by the six sides of the grid.
const MOST_CORNERS: u32 = 9u;

/// A corner, in voxels from the grid's corner.
struct Corner {
    position: vec3f,
    uv: vec2f,
}

fn corner(index: u32) -> Corner {
    var world = vec4f(vertices[index].position, 1.0);
    @if(animated) {
        world = objects[vertices[index].object].to_world * world;
    }
    return Corner(grid_position(grid, world.xyz), vertices[index].uv);
}

struct Polygon {
    corners: array<Corner, MOST_CORNERS>,
    count: u32,
}

/// The part of a convex polygon on the inner side of one side of the grid (Sutherland & Hodgman 1974).
fn clipped(polygon: Polygon, axis: u32, bound: f32, sign: f32) -> Polygon {
    var all = polygon.corners;
    var kept: Polygon;
    for (var i = 0u; i < polygon.count; i++) {
        let a = all[select(i, polygon.count, i == 0u) - 1u];
        let b = all[i];
        let inside_a = sign * (a.position[axis] - bound);
        let inside_b = sign * (b.position[axis] - bound);
        if (inside_a < 0.0) != (inside_b < 0.0) {
            let t = inside_a / (inside_a - inside_b);
            var cut = Corner(mix(a.position, b.position, t), mix(a.uv, b.uv, t));
            cut.position[axis] = bound;
            kept.corners[kept.count] = cut;
            kept.count += 1u;
        }
        if inside_b >= 0.0 {
            kept.corners[kept.count] = b;
            kept.count += 1u;
        }
    }
    return kept;
}

/// Sets the voxels of one triangle inside the grid. `row` is this invocation's first row of points.
fn cover(first: Corner, second: Corner, third: Corner, row: u32, hole_texture: u32) {
    let a = first.position;
    let ab = second.position - a;
    let ac = third.position - a;
    let sides = vec2f(length(ab), length(ac)) * POINTS_PER_VOXEL;
    let rows = u32(ceil(sides.x)) + 1u;
    for (var i = row; i <= rows; i += ROWS) {
        let b = f32(i) / f32(rows);
        // The row ends at the third side.
        let points = u32(ceil((1.0 - b) * sides.y)) + 1u;
        for (var j = 0u; j <= points; j++) {
            let c = (1.0 - b) * f32(j) / f32(points);
            @if(alpha_tested) {
                if is_hole(hole_texture, first.uv + b * (second.uv - first.uv) + c * (third.uv - first.uv)) {
                    continue;
                }
            }
            let voxel = clamp(vec3i(floor(a + b * ab + c * ac)), vec3i(0), vec3i(grid.size) - 1);
            let bit = 1u << (u32(voxel.x) & 31u);
            atomicOr(&voxels[word_index(grid, vec3u(voxel))], bit);
        }
    }
}

@compute @workgroup_size(256)
fn fill(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    let first = id.x * 3u;
    if first + 2u >= arrayLength(&indices) {
        return;
    }
    let at = vec3u(indices[first], indices[first + 1u], indices[first + 2u]);
    let a = corner(at.x);
    let b = corner(at.y);
    let c = corner(at.z);
    let low = min(a.position, min(b.position, c.position));
    let high = max(a.position, max(b.position, c.position));
    let end = vec3f(grid.size);
    // Also rejects NaN.
    if !(all(low <= end) && all(high >= vec3f(0.0))) {
        return;
    }
    var hole_texture = 0u;
    @if(alpha_tested) {
        hole_texture = materials[vertices[at.x].material].alpha_texture;
    }
    if all(low >= vec3f(0.0)) && all(high <= end) {
        cover(a, b, c, id.y, hole_texture);
        return;
    }
    var polygon: Polygon;
    polygon.corners[0] = a;
    polygon.corners[1] = b;
    polygon.corners[2] = c;
    polygon.count = 3u;
    for (var axis = 0u; axis < 3u; axis++) {
        polygon = clipped(polygon, axis, 0.0, 1.0);
        polygon = clipped(polygon, axis, end[axis], -1.0);
    }
    for (var i = 2u; i < polygon.count; i++) {
        cover(polygon.corners[0], polygon.corners[i - 1u], polygon.corners[i], id.y, hole_texture);
    }
}
