// Screen-space ambient occlusion (Mittring 2007) over the hemisphere. The result is ambient visibility: the share of
// points that are in front of the visible surface at their projection.
import package::common::division::Division;
import package::common::hemisphere::hemisphere_point;
import package::common::math::spread2;
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position};
import package::common::view::{View, SKY_DEPTH, pixel_of};
import package::common::streams::SSAO_STREAM;

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Scene units.
    radius: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(3) var gathered: texture_storage_2d<r32float, write>;

override SAMPLES: u32;

// Points this close to the surface, in radii, count as in front of it, because depth is rounded.
const BIAS: f32 = 0.01;

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(surfels)) {
        return;
    }
    let own = textureLoad(surfels, id, 0);
    var open = 1.0;
    if surfel_depth(own) > SKY_DEPTH {
        let normal = surfel_normal(own);
        let position = surfel_position(own, id, params.scale, view.display_size, view.tan_half_fov)
            + BIAS * params.radius * normal;
        let random = spread2(id, view.frame, SSAO_STREAM, view.seed, false);
        var hidden = 0.0;
        for (var i = 0u; i < SAMPLES; i++) {
            let point = position + params.radius * hemisphere_point(normal, i, SAMPLES, random);
            let pixel = pixel_of(point, view.tan_half_fov, view.display_size);
            let on_screen = point.z < 0.0 && all(pixel >= vec2f(0.0)) && all(pixel < view.display_size);
            let texel = select(vec2i(0), vec2i(floor(pixel / params.scale)), on_screen);
            let depth = surfel_depth(textureLoad(surfels, texel, 0));
            // An occluder more than the radius in front of a point is the silhouette of another object and does not
            // count.
            let near = -point.z - depth < 2.0 * params.radius;
            hidden += select(0.0, 1.0, on_screen && depth > SKY_DEPTH && depth < -point.z && near);
        }
        open = 1.0 - hidden / f32(SAMPLES);
    }
    textureStore(gathered, id, vec4f(open, 0.0, 0.0, 1.0));
}
