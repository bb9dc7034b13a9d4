// Full-resolution textures to surfels: the finest level of the pyramid.
import package::common::surfel::{Surfel, pack_surfel};
import package::common::view::SKY_DEPTH;

@group(0) @binding(0) var depth: texture_2d<f32>;
@group(0) @binding(1) var normal: texture_2d<f32>;
@group(0) @binding(2) var direct: texture_2d<f32>;
@group(0) @binding(3) var surfels: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(8, 8)
fn pack(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(surfels)) {
        return;
    }
    let d = textureLoad(depth, id.xy, 0).x;
    var words = vec4u(0u);
    if d > SKY_DEPTH {
        let n = textureLoad(normal, id.xy, 0).xyz;
        words = pack_surfel(Surfel(d, normalize(n), textureLoad(direct, id.xy, 0).rgb, vec2u(0u)));
    }
    textureStore(surfels, id.xy, words);
}
