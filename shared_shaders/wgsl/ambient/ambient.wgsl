// Environment light for techniques that find ambient visibility alone: the irradiance for the surface's normal times
// ambient visibility, but no more than the share of rays that no voxel of the scene stops: what is off the screen closes a
// room, too. The smaller one counts and not the product, because both see the occluders on the screen.
import package::common::division::Division;
import package::common::environment::{IRRADIANCE, irradiance_factor};
import package::common::hemisphere::cosine_direction;
import package::common::math::spread2;
import package::common::streams::SKY_STREAM;
import package::common::view::{View, uv_of_texel, view_position};
import package::scene_voxels::sees::{ray_end, sees_sky};

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var normal: texture_2d<f32>;
@group(0) @binding(2) var ambient_occlusion: texture_2d<f32>;
@group(0) @binding(3) var<storage, read> environment: array<vec4f>;
@group(0) @binding(4) var indirect: texture_storage_2d<rgba32float, write>;
@group(0) @binding(5) var depth: texture_2d<f32>;

/// Rays to the sky. The minimum takes their noise for occlusion: about 3 % of the light with 16 rays.
const RAYS: u32 = 16u;
const GOLDEN: f32 = 0.6180339887498949;

@compute @workgroup_size(8, 8)
fn light(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    if any(id >= textureDimensions(indirect)) {
        return;
    }
    let n = textureLoad(normal, id, 0).xyz;
    // The sky has no normal. It stays black, because its light is direct.
    let open = select(0.0, saturate(textureLoad(ambient_occlusion, id, 0).x), any(n != vec3f(0.0)));
    let world = (view.view_to_world * vec4f(n, 0.0)).xyz;
    var sum = vec3f(0.0);
    if open > 0.0 {
        let in_view = view_position(uv_of_texel(id, 1.0, view.display_size), textureLoad(depth, id, 0).x, view.tan_half_fov);
        let receiver = ray_end((view.view_to_world * vec4f(in_view, 1.0)).xyz, normalize(world));
        let random = spread2(id, view.frame, SKY_STREAM, view.seed, false);
        var seen = 0.0;
        for (var i = 0u; i < RAYS; i++) {
            let position = fract(random + vec2f((f32(i) + 0.5) / f32(RAYS), GOLDEN * f32(i)));
            seen += select(0.0, 1.0 / f32(RAYS), sees_sky(receiver, cosine_direction(receiver.normal, position)));
        }
        for (var i = 0u; i < 9u; i++) {
            sum += irradiance_factor(i, world) * environment[IRRADIANCE + i].rgb;
        }
        sum *= min(open, seen);
    }
    textureStore(indirect, id, vec4f(max(sum, vec3f(0.0)), 1.0));
}
