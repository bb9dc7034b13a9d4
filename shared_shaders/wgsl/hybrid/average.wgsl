// Ambient visibility: the weighted mean over all views; 1 (open) if the weights are 0.
@group(0) @binding(0) var views: texture_2d<f32>;
@group(0) @binding(1) var ambient_visibility: texture_storage_2d<r32float, write>;

@compute @workgroup_size(8, 8)
fn average(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(ambient_visibility)) {
        return;
    }
    let sum = textureLoad(views, id.xy, 0).xy;
    let open = select(1.0, saturate(sum.x / max(sum.y, 1e-30)), sum.y > 1e-6);
    textureStore(ambient_visibility, id.xy, vec4f(open, 0.0, 0.0, 1.0));
}
