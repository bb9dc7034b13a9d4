// variants: float16
// Adds light to the light so far: one more bounce, or that of the sky.

@if(float16) import package::common::math::LARGEST_FLOAT16;

@group(0) @binding(0) var light: texture_2d<f32>;
@group(0) @binding(1) var so_far: texture_2d<f32>;
@if(!float16) @group(0) @binding(2) var sum: texture_storage_2d<rgba32float, write>;
@if(float16) @group(0) @binding(2) var sum: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn add(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(sum)) {
        return;
    }
    var both = textureLoad(so_far, id.xy, 0).rgb + textureLoad(light, id.xy, 0).rgb;
    @if(float16) { both = min(both, vec3f(LARGEST_FLOAT16)); }
    textureStore(sum, id.xy, vec4f(both, 1.0));
}
