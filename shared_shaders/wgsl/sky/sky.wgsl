// variants: float16
// Adds the environment where the camera sees no surface.
import package::common::environment::{MAP, latlong};
@if(float16) import package::common::math::LARGEST_FLOAT16;
import package::common::view::{View, SKY_DEPTH, uv_of_texel, view_position};

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var depth: texture_2d<f32>;
@group(0) @binding(2) var<storage, read> environment: array<vec4f>;
@if(!float16) @group(0) @binding(3) var direct: texture_storage_2d<rgba32float, write>;
@if(float16) @group(0) @binding(3) var direct: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn show_sky(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(direct)) {
        return;
    }
    if textureLoad(depth, id.xy, 0).x <= SKY_DEPTH {
        let ray = view_position(uv_of_texel(id.xy, 1.0, view.display_size), 1.0, view.tan_half_fov);
        let direction = (view.view_to_world * vec4f(ray, 0.0)).xyz;
        var radiance = environment[MAP + latlong(direction, environment[0].xy)].rgb;
        @if(float16) { radiance = min(radiance, vec3f(LARGEST_FLOAT16)); }
        textureStore(direct, id.xy, vec4f(radiance, 1.0));
    }
}
