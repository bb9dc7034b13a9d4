// Environment light for techniques that find ambient visibility alone: the irradiance for the surface's normal times
// ambient visibility.
import package::common::environment::{IRRADIANCE, irradiance_factor};
import package::common::view::View;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var normal: texture_2d<f32>;
@group(0) @binding(2) var ambient_occlusion: texture_2d<f32>;
@group(0) @binding(3) var<storage, read> environment: array<vec4f>;
@group(0) @binding(4) var indirect: texture_storage_2d<rgba32float, write>;

@compute @workgroup_size(8, 8)
fn light(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(indirect)) {
        return;
    }
    let n = textureLoad(normal, id.xy, 0).xyz;
    // The sky has no normal. It stays black, because its light is direct.
    let open = select(0.0, saturate(textureLoad(ambient_occlusion, id.xy, 0).x), any(n != vec3f(0.0)));
    let world = (view.view_to_world * vec4f(n, 0.0)).xyz;
    var sum = vec3f(0.0);
    for (var i = 0u; i < 9u; i++) {
        sum += irradiance_factor(i, world) * environment[IRRADIANCE + i].rgb;
    }
    textureStore(indirect, id.xy, vec4f(max(sum, vec3f(0.0)) * open, 1.0));
}
