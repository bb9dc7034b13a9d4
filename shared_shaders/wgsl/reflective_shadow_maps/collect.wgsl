// Appends the surfaces of one map, in the camera's view space, to those of the previous maps, with the importance of
// each: its contribution to a few receivers spread over the screen.
import package::common::division::Division;
import package::common::math::random3;
import package::common::streams::IMPORTANCE_STREAM;
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position};
import package::common::view::View;
import package::common::view::SKY_DEPTH;
import package::reflective_shadow_maps::importance::{ANY_WAY, RECEIVERS};
import package::reflective_shadow_maps::light_surface::{LightSurface, unpack_light, pack_light};
import package::reflective_shadow_maps::transfer::{transfer, nearness};

struct Params {
    // Index of this map's first surface in the buffers.
    first: u32,
    // Width of a texel of `surfels` in full-resolution pixels.
    scale: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var rsm_position: texture_2d<f32>;
@group(0) @binding(3) var light: texture_2d<u32>;
@group(0) @binding(4) var<storage, read_write> positions: array<vec4f>;
@group(0) @binding(5) var<storage, read_write> lights: array<vec4u>;
@group(0) @binding(6) var surfels: texture_2d<u32>;
@group(0) @binding(7) var<storage, read_write> importances: array<f32>;

@compute @workgroup_size(8, 8)
fn collect(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    let size = textureDimensions(rsm_position);
    if any(id >= size) {
        return;
    }
    let index = params.first + id.y * size.x + id.x;
    var surface = unpack_light(textureLoad(rsm_position, id, 0).xyz, textureLoad(light, id, 0));
    surface.position = (view.world_to_view * vec4f(surface.position, 1.0)).xyz;
    surface.normal = (view.world_to_view * vec4f(surface.normal, 0.0)).xyz;
    let shown = surface.area > 0.0;
    positions[index] = vec4f(surface.position, 1.0);
    lights[index] = select(vec4u(0u), pack_light(surface.area, surface.normal, surface.radiance), shown);
    var sum = 0.0;
    if shown {
        let grid = vec2f(textureDimensions(surfels)) / f32(RECEIVERS);
        for (var i = 0u; i < RECEIVERS * RECEIVERS; i++) {
            // All surfaces use the same receivers, because their importances are compared.
            let jitter = random3(vec2u(i, 0u), view.frame, IMPORTANCE_STREAM, view.seed).xy;
            let texel = vec2u((vec2f(vec2u(i % RECEIVERS, i / RECEIVERS)) + jitter) * grid);
            let words = textureLoad(surfels, texel, 0);
            if surfel_depth(words) > SKY_DEPTH {
                let at = surfel_position(words, texel, params.scale, view.display_size, view.tan_half_fov);
                sum += transfer(at, surfel_normal(words), surface) + ANY_WAY * nearness(at, surface);
            }
        }
        sum *= max(surface.radiance.x, max(surface.radiance.y, surface.radiance.z));
    }
    importances[index] = sum;
}
