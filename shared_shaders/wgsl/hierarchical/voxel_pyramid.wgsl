// variants: finest
// One level of the froxel grid from the finer one: four columns become one, slice by slice (2010, section 4). With
// `finest`, copies the buffer of `voxelize.wgsl` to a texture, which rays read faster than a buffer.
import package::common::froxels::WORDS;

@if(finest) @group(0) @binding(0) var<storage, read> finer_froxels: array<u32>;
@if(!finest) @group(0) @binding(0) var children: texture_2d_array<u32>;
// One layer per word.
@group(0) @binding(1) var froxels: texture_storage_2d_array<r32uint, write>;

// A slice is set if any child has it (OR), or if all children have it (AND, as published).
@if(!finest) override ANY_CHILD: bool;

@if(finest)
fn word_at(texel: vec2u, size: vec2u, word: u32) -> u32 {
    return finer_froxels[(texel.y * size.x + texel.x) * u32(WORDS) + word];
}

@if(!finest)
fn word_at(texel: vec2u, size: vec2u, word: u32) -> u32 {
    let first = texel * 2u;
    // A child beyond the edge repeats its neighbour.
    let last = min(first + 1u, textureDimensions(children) - 1u);
    let upper = vec2u(
        textureLoad(children, first, word, 0).x,
        textureLoad(children, vec2u(last.x, first.y), word, 0).x,
    );
    let lower = vec2u(
        textureLoad(children, vec2u(first.x, last.y), word, 0).x,
        textureLoad(children, last, word, 0).x,
    );
    let both = select(upper & lower, upper | lower, ANY_CHILD);
    return select(both.x & both.y, both.x | both.y, ANY_CHILD);
}

@compute @workgroup_size(8, 8)
fn voxel_pyramid(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(froxels);
    if any(id.xy >= size) {
        return;
    }
    for (var word = 0u; word < u32(WORDS); word++) {
        textureStore(froxels, id.xy, word, vec4u(word_at(id.xy, size, word)));
    }
}
