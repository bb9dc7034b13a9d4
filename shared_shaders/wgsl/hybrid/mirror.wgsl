// The visible surface that the mirror direction of each glossy pixel hits (Sousa et al. 2011): the intersection map of
// Lambru et al., section 4.2, made once for all lights.
import package::common::division::Division;
import package::common::form_factor::MIN_COS_BETA;
import package::common::scene::Material;
import package::common::view::{View, SKY_DEPTH, uv_of_texel, view_position, pixel_of};
import package::hybrid::mirror_map::{NOTHING, pack_pixel};
import package::hybrid::reflected::reflected;

struct Params {
    // Largest distance between two steps, pixels.
    stride: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var depth: texture_2d<f32>;
@group(0) @binding(3) var normal: texture_2d<f32>;
@group(0) @binding(4) var material: texture_2d<u32>;
@group(0) @binding(5) var<storage, read> materials: array<Material>;
@group(0) @binding(6) var mirror_map: texture_storage_2d<r32uint, write>;

// Whether directions are sampled from the lobe instead of taking its axis.
override LOBE: bool;
// Whether a temporal filter averages successive frames. The directions are then stratified over frames.
override OVER_FRAMES: bool;

/// Bisection steps that refine a crossing: a stride of 64 pixels becomes one.
const HALVINGS: u32 = 6u;
/// A crossing counts if the ray ends this near to the surface, in widths of a pixel. Farther behind, the ray passed
/// behind the occluder.
const TOLERANCE: f32 = 2.0;
/// A ray starts this far from its surface, in widths of a pixel.
const START: f32 = 0.5;
/// Length of a ray, in depths of its start: by then it has reached its vanishing point.
const FARTHEST: f32 = 1e4;

/// Depth of the surface at a screen position, along the ray through that position: its tangent plane within the pixel.
/// Negative without a surface.
fn depth_at(pixel: vec2f, texel: vec2i) -> f32 {
    let d = textureLoad(depth, texel, 0).x;
    let n = textureLoad(normal, texel, 0).xyz;
    let centre = view_position(uv_of_texel(vec2u(texel), 1.0, view.display_size), 1.0, view.tan_half_fov);
    let ray = view_position(pixel / view.display_size, 1.0, view.tan_half_fov);
    let slant = min(dot(n, ray), -MIN_COS_BETA * length(ray));
    return select(-1.0, d * clamp(dot(n, centre) / slant, 0.5, 2.0), d > SKY_DEPTH);
}

/// Distance of a ray behind the visible surface; a large negative number without a surface.
fn behind(pixel: vec2f, ray_depth: f32) -> f32 {
    let last = vec2i(textureDimensions(depth)) - 1;
    let surface = depth_at(pixel, clamp(vec2i(floor(pixel)), vec2i(0), last));
    return select(-ray_depth, ray_depth - surface, surface > SKY_DEPTH);
}

fn march(position: vec3f, mirror: vec3f) -> u32 {
    let pixel_width = 2.0 * view.tan_half_fov.y / view.display_size.y;
    // A ray towards the eye ends before it, a ray away from it at its vanishing point.
    let farthest = FARTHEST * -position.z;
    let before_eye = 0.999 * -position.z / max(mirror.z, 1e-6);
    let goal = position + mirror * min(farthest, select(farthest, before_eye, mirror.z > 0.0));
    let origin = pixel_of(position, view.tan_half_fov, view.display_size);
    let way = pixel_of(goal, view.tan_half_fov, view.display_size) - origin;
    // Up to the screen edge.
    let screen_edge = select(vec2f(0.0), view.display_size, way > vec2f(0.0));
    let exits = select(vec2f(1e30), (screen_edge - origin) / way, abs(way) > vec2f(1e-6));
    let exit = clamp(min(exits.x, exits.y), 0.0, 1.0);
    let steps = u32(clamp(ceil(exit * length(way) / params.stride), 1.0, MOST_STEPS));
    // Inverse depth is linear along the ray on the screen.
    let inverse = vec2f(-1.0 / position.z, -1.0 / goal.z);
    var before = 0.0;
    var was_before = true;
    for (var i = 1u; i <= steps; i++) {
        let after = exit * f32(i) / f32(steps);
        let is_behind = behind(origin + after * way, 1.0 / mix(inverse.x, inverse.y, after)) > 0.0;
        if is_behind && was_before {
            var low = before;
            var high = after;
            for (var k = 0u; k < HALVINGS; k++) {
                let middle = 0.5 * (low + high);
                let in_front = behind(origin + middle * way, 1.0 / mix(inverse.x, inverse.y, middle)) <= 0.0;
                low = select(low, middle, in_front);
                high = select(middle, high, in_front);
            }
            let pixel = origin + high * way;
            let texel = clamp(vec2i(floor(pixel)), vec2i(0), vec2i(textureDimensions(depth)) - 1);
            let ray_depth = 1.0 / mix(inverse.x, inverse.y, high);
            let faces = dot(textureLoad(normal, texel, 0).xyz, mirror) < 0.0;
            if faces && behind(pixel, ray_depth) < TOLERANCE * pixel_width * ray_depth {
                return pack_pixel(vec2u(texel));
            }
        }
        was_before = !is_behind;
        before = after;
    }
    return NOTHING;
}

/// More steps than any image is wide, at a stride of one.
const MOST_STEPS: f32 = 23170.0;

@compute @workgroup_size(8, 8)
fn trace(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(mirror_map)) {
        return;
    }
    let d = textureLoad(depth, id, 0).x;
    var found = NOTHING;
    // Without a surface the material is the first one.
    if d > SKY_DEPTH && any(materials[textureLoad(material, id, 0).x].specular > vec3f(0.0)) {
        let n = normalize(textureLoad(normal, id, 0).xyz);
        let position = view_position(uv_of_texel(id, 1.0, view.display_size), d, view.tan_half_fov);
        let pixel_width = 2.0 * view.tan_half_fov.y / view.display_size.y * d;
        let exponent = materials[textureLoad(material, id, 0).x].phong_exponent;
        let mirror = reflected(position, n, exponent, LOBE, id, view.frame, view.seed, OVER_FRAMES);
        if dot(mirror, n) > 0.0 {
            found = march(position + START * pixel_width * n, mirror);
        }
    }
    textureStore(mirror_map, id, vec4u(found));
}
