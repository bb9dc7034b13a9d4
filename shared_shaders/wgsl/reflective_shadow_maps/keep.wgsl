// Copies one reflective shadow map to the finest level of the pyramid over all maps.

struct Params {
    // Index of the map's first texel.
    first: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var rsm_position: texture_2d<f32>;
@group(0) @binding(2) var light: texture_2d<u32>;
@group(0) @binding(3) var<storage, read_write> light_pyramid: array<vec4u>;

@compute @workgroup_size(8, 8)
fn keep(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(rsm_position);
    if any(id.xy >= size) {
        return;
    }
    let index = 2u * (params.first + id.y * size.x + id.x);
    light_pyramid[index] = bitcast<vec4u>(textureLoad(rsm_position, id.xy, 0));
    light_pyramid[index + 1u] = textureLoad(light, id.xy, 0);
}
