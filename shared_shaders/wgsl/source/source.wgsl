// variants: float16
// The source of indirect light in a scene with receive-only surfaces, whose radiance is 0.

@group(0) @binding(0) var direct: texture_2d<f32>;
@group(0) @binding(1) var material: texture_2d<u32>;
// One word per material: 1 if it receives light but sends none.
@group(0) @binding(2) var<storage, read> receive_only: array<u32>;
@if(!float16) @group(0) @binding(3) var source: texture_storage_2d<rgba32float, write>;
@if(float16) @group(0) @binding(3) var source: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(8, 8)
fn mask(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(source)) {
        return;
    }
    let radiance = textureLoad(direct, id.xy, 0);
    let silent = receive_only[textureLoad(material, id.xy, 0).x] != 0u;
    textureStore(source, id.xy, vec4f(select(radiance.rgb, vec3f(0.0), silent), 1.0));
}
