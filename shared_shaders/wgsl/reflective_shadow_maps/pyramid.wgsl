// One level of the pyramid over the reflective shadow maps. One child stands for all four. It is chosen in proportion
// to its power, and its light is divided by its probability. The mean over frames is then the light of all children,
// from their positions and with their normals. Nothing is averaged across an edge.
import package::common::math::{largest, random3};
import package::common::view::View;
import package::common::streams::LIGHT_PYRAMID_STREAM;
import package::reflective_shadow_maps::light_pyramid::{level_start, unpack_texel};
import package::reflective_shadow_maps::light_surface::pack_light;

struct Params {
    // Width of a map at the finest level, texels; number of maps; this level.
    size: u32,
    views: u32,
    level: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var<storage, read_write> light_pyramid: array<vec4u>;

@compute @workgroup_size(8, 8)
fn reduce(@builtin(global_invocation_id) id: vec3u) {
    let width = params.size >> params.level;
    // The maps are stacked vertically.
    if id.x >= width || id.y >= width * params.views {
        return;
    }
    let finer = level_start(params.level - 1u, params.size, params.views);
    let own_start = level_start(params.level, params.size, params.views);
    let random = random3(id.xy, view.frame, LIGHT_PYRAMID_STREAM + params.level, view.seed).x;
    // Sums of area and power of the four children, and the chosen child.
    var area = 0.0;
    var power = 0.0;
    var drawn = 0u;
    var drawn_power = 0.0;
    var choice = random;
    for (var i = 0u; i < 4u; i++) {
        let child = finer + (id.y * 2u + (i >> 1u)) * width * 2u + id.x * 2u + (i & 1u);
        let surface = unpack_texel(light_pyramid[2u * child], light_pyramid[2u * child + 1u]);
        // Bounded, so that the sum of four stays inside float32.
        let own = min(surface.area * largest(surface.radiance), 1e37);
        if own > 0.0 {
            area += surface.area;
            power += own;
            // One random number serves all choices: its remainder after each choice is uniform again.
            let threshold = choice * power;
            let pick = threshold < own;
            choice = select((threshold - own) / max(power - own, 1e-36), threshold / own, pick);
            choice = min(choice, 0.99999994);
            drawn = select(drawn, child, pick);
            drawn_power = select(drawn_power, own, pick);
        }
    }
    let index = 2u * (own_start + id.y * width + id.x);
    if !(drawn_power > 0.0) {
        light_pyramid[index] = vec4u(0u);
        light_pyramid[index + 1u] = vec4u(0u);
        return;
    }
    let position = light_pyramid[2u * drawn];
    let surface = unpack_texel(position, light_pyramid[2u * drawn + 1u]);
    // Its own power, divided by its probability and by the total area.
    let radiance = surface.radiance * ((surface.area / area) * (power / drawn_power));
    light_pyramid[index] = position;
    light_pyramid[index + 1u] = pack_light(area, surface.normal, radiance);
}
