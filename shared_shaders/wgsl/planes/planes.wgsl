// Surfels as planes, for techniques that walk along lines of the screen.
import package::common::plane::pack_plane;
import package::common::surfel::{surfel_depth, surfel_normal, surfel_pixel, surfel_radiance};
import package::common::view::{View, SKY_DEPTH};

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(3) var planes: texture_storage_2d<rgba32uint, write>;

/// A surface seen more edge-on than this (cosine) counts as tilted by it: the normals of a silhouette are off by more.
const MIN_SLOPE: f32 = -0.02;

@compute @workgroup_size(8, 8)
fn to_planes(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(planes)) {
        return;
    }
    let words = textureLoad(surfels, id.xy, 0);
    let depth = surfel_depth(words);
    var plane = vec4u(0u);
    if depth > SKY_DEPTH {
        let ray_scale = vec2f(2.0, -2.0) * view.tan_half_fov / view.display_size;
        let pixel = surfel_pixel(words, id.xy, params.scale);
        let ray = pixel * ray_scale + vec2f(-1.0, 1.0) * view.tan_half_fov;
        let normal = surfel_normal(words);
        // Of all points x on the plane dot(n, x) = dot(n, p), and x = ray depth.
        let slope = min(dot(normal.xy, ray) - normal.z, MIN_SLOPE);
        let inverse = 1.0 / depth;
        let gradient = normal.xy * ray_scale * (params.scale * inverse / slope);
        let to_middle = vec2f(id.xy) + 0.5 - pixel / params.scale;
        let there = clamp(inverse + dot(gradient, to_middle), 0.5 * inverse, 2.0 * inverse);
        plane = pack_plane(there, gradient, surfel_radiance(words));
    }
    textureStore(planes, id.xy, plane);
}
