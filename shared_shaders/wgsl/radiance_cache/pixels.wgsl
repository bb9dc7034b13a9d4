// Surfaces that pixels show, in world space.
import package::common::view::{View, uv_of_texel, view_position};

struct PixelSurface {
    position: vec3f,
    // Unit normal.
    normal: vec3f,
}

/// The surface of a pixel with this depth and this normal in view space.
fn surface_of_pixel(pixel: vec2u, depth: f32, normal: vec3f, view: View) -> PixelSurface {
    let in_view = view_position(uv_of_texel(pixel, 1.0, view.display_size), depth, view.tan_half_fov);
    return PixelSurface(
        (view.view_to_world * vec4f(in_view, 1.0)).xyz,
        normalize((view.view_to_world * vec4f(normal, 0.0)).xyz),
    );
}
