// Light of the sky through rays in the scene's voxel grid, so that what is off the screen closes a room.
import package::common::division::Division;
import package::common::environment::{latlong, small_map};
import package::common::hemisphere::cosine_direction;
import package::common::math::spread2;
import package::common::streams::SKY_STREAM;
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position};
import package::common::view::{View, SKY_DEPTH};
import package::scene_voxels::sees::{ray_end, sees_sky};

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(3) var gathered: texture_storage_2d<rgba32float, write>;
@group(0) @binding(4) var<storage, read> environment: array<vec4f>;

override RAYS: u32;
// Whether a temporal filter averages successive frames. The random numbers are then stratified over frames.
override OVER_FRAMES: bool;

const GOLDEN: f32 = 0.6180339887498949;

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(surfels)) {
        return;
    }
    let words = textureLoad(surfels, id, 0);
    var light = vec3f(0.0);
    if surfel_depth(words) > SKY_DEPTH {
        let in_view = surfel_position(words, id, params.scale, view.display_size, view.tan_half_fov);
        let position = (view.view_to_world * vec4f(in_view, 1.0)).xyz;
        let normal = normalize((view.view_to_world * vec4f(surfel_normal(words), 0.0)).xyz);
        let receiver = ray_end(position, normal);
        let first = small_map(environment[0]);
        let random = spread2(id, view.frame, SKY_STREAM, view.seed, OVER_FRAMES);
        for (var i = 0u; i < RAYS; i++) {
            // The rays of a pixel are stratified over the hemisphere.
            let position = fract(random + vec2f((f32(i) + 0.5) / f32(RAYS), GOLDEN * f32(i)));
            let direction = cosine_direction(normal, position);
            let sky = environment[first + latlong(direction, environment[0].zw)].rgb;
            if any(sky > vec3f(0.0)) && sees_sky(receiver, direction) {
                light += sky / f32(RAYS);
            }
        }
    }
    textureStore(gathered, id, vec4f(light, 1.0));
}
