// Textures of the scene's materials, all in one buffer.
import package::common::scene::NO_TEXTURE;
import package::common::texture_pool::{texture_footprint, filter_footprint};

@group(0) @binding(22) var<storage, read> texels: array<u32>;

/// The filtered value of the texture whose header is at `start`.
fn sample_texture(start: u32, uv: vec2f) -> vec4f {
    let footprint = texture_footprint(start, vec2u(texels[start], texels[start + 1u]), uv);
    let i = footprint.indices;
    return filter_footprint(vec4u(texels[i.x], texels[i.y], texels[i.z], texels[i.w]), footprint.weights);
}

/// Whether an alpha texture masks out the surface here; false for NO_TEXTURE.
fn is_hole(alpha_texture: u32, uv: vec2f) -> bool {
    return alpha_texture != NO_TEXTURE && sample_texture(alpha_texture, uv).a < 0.5;
}
