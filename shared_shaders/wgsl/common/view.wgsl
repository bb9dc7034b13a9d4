// A view (a camera with a G-buffer), and the only two functions that change the resolution of coordinates.

struct View {
    world_to_view: mat4x4f,
    view_to_world: mat4x4f,
    // Tangents of half the field of view, (horizontal, vertical).
    tan_half_fov: vec2f,
    // Full-resolution pixels.
    display_size: vec2f,
    // Distance of the near plane, scene units.
    near: f32,
    // Frame number and the user's seed, for `random3`.
    frame: u32,
    seed: u32,
}

// `scale` is the width of a texel of the level in full-resolution pixels (start divisor times 2^k).

/// Texture coordinate, 0..1 over the display, of the centre of a texel.
fn uv_of_texel(texel: vec2u, scale: f32, display_size: vec2f) -> vec2f {
    return (vec2f(texel) + 0.5) * scale / display_size;
}

/// Position in texels of the level; texel i covers i..i+1.
fn texel_of_uv(uv: vec2f, scale: f32, display_size: vec2f) -> vec2f {
    return uv * display_size / scale;
}

/// View-space position of a point seen at `uv` with planar depth `depth`.
fn view_position(uv: vec2f, depth: f32, tan_half_fov: vec2f) -> vec3f {
    return vec3f((uv * 2.0 - 1.0) * vec2f(1.0, -1.0) * tan_half_fov, -1.0) * depth;
}

/// Screen position of a view-space point in front of the eye, in full-resolution pixels.
fn pixel_of(position: vec3f, tan_half_fov: vec2f, display_size: vec2f) -> vec2f {
    return (position.xy / (-position.z * tan_half_fov) * vec2f(0.5, -0.5) + 0.5) * display_size;
}

/// Stored depth of a pixel without a surface.
const SKY_DEPTH: f32 = 0.0;

/// Reversed-Z projection with an infinite far plane.
fn project(position: vec3f, tan_half_fov: vec2f, near: f32) -> vec4f {
    return vec4f(position.xy / tan_half_fov, near, -position.z);
}
