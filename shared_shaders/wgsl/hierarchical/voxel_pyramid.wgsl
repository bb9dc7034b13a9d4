// One level of the voxel grid from the finer one: four columns become one, slice by slice (2010, section 4).
import package::common::voxels::WORDS;

struct Params {
    // Texels of either level.
    child_grid: vec2f,
    grid: vec2f,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> children: array<u32>;
@group(0) @binding(2) var<storage, read_write> voxels: array<u32>;

// A slice is set where any child has it (OR), or where all have it (AND, as published).
override ANY_CHILD: bool = false;

@compute @workgroup_size(8, 8)
fn voxel_pyramid(@builtin(global_invocation_id) id: vec3u) {
    let size = vec2u(params.grid);
    if any(id.xy >= size) {
        return;
    }
    let child_size = vec2u(params.child_grid);
    let first = id.xy * 2u;
    // A child beyond the border repeats its neighbour.
    let last = min(first + 1u, child_size - 1u);
    let columns = vec4u(
        first.y * child_size.x + first.x,
        first.y * child_size.x + last.x,
        last.y * child_size.x + first.x,
        last.y * child_size.x + last.x,
    ) * u32(WORDS);
    for (var word = 0u; word < u32(WORDS); word++) {
        let a = vec2u(children[columns.x + word], children[columns.y + word]);
        let b = vec2u(children[columns.z + word], children[columns.w + word]);
        let both = select(a & b, a | b, ANY_CHILD);
        voxels[(id.y * size.x + id.x) * u32(WORDS) + word] = select(both.x & both.y, both.x | both.y, ANY_CHILD);
    }
}
