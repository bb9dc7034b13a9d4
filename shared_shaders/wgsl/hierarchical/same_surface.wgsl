// Tests which texels show the same surface.

/// Whether two points show the same surface, so that their values may be averaged: normals within 60 degrees, and the
/// second point closer to the first one's tangent plane than the width of the square there.
fn same_surface(normal: vec3f, position: vec3f, other_normal: vec3f, other_position: vec3f, width: f32) -> bool {
    return dot(normal, other_normal) > 0.5 && abs(dot(normal, other_position - position)) < width;
}

/// Width of a square of `scale` full-resolution pixels on a surface that faces the eye at this depth, scene units.
fn square_width(scale: f32, depth: f32, tan_half_fov_vertical: f32, display_height: f32) -> f32 {
    return 2.0 * scale * tan_half_fov_vertical / display_height * depth;
}
