// Writes the history for the next frame: this frame's indirect light, and the surfaces that received it.
import package::common::view::SKY_DEPTH;
import package::temporal::history::{History, pack_history};

@group(0) @binding(0) var depth: texture_2d<f32>;
@group(0) @binding(1) var normal: texture_2d<f32>;
@group(0) @binding(2) var indirect: texture_2d<f32>;
@group(0) @binding(3) var light: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(8, 8)
fn write_history(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(light)) {
        return;
    }
    let d = textureLoad(depth, id.xy, 0).x;
    var words = vec4u(0u);
    if d > SKY_DEPTH {
        let n = textureLoad(normal, id.xy, 0).xyz;
        words = pack_history(History(d, n, 0u, textureLoad(indirect, id.xy, 0).rgb, 1u));
    }
    textureStore(light, id.xy, words);
}
