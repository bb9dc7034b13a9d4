// variants: float16
// Indirect light times ambient visibility (Lambru et al., Equation 1).
@group(0) @binding(0) var light: texture_2d<f32>;
@group(0) @binding(1) var ambient_visibility: texture_2d<f32>;
@if(!float16) @group(0) @binding(2) var attenuated: texture_storage_2d<rgba32float, write>;
@if(float16) @group(0) @binding(2) var attenuated: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn attenuate(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(attenuated)) {
        return;
    }
    let open = textureLoad(ambient_visibility, id.xy, 0).x;
    textureStore(attenuated, id.xy, vec4f(open * textureLoad(light, id.xy, 0).rgb, 1.0));
}
