// Whether one texel of a level sees another, by the functions of the gather that ships.
import package::common::surfel::surfel_depth;
import package::common::froxels::slices_of_range;
import package::hierarchical::gather::{end_at, sees};

// The gather's module binds the view (0), its parameters (1) and the froxels (5).
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(4) var<storage, read> depth_range: array<u32>;
// Texels of receiver and source.
@group(0) @binding(6) var<storage, read> pairs: array<vec4u>;
// 1 where the receiver sees the source.
@group(0) @binding(7) var<storage, read_write> answers: array<u32>;

@compute @workgroup_size(64)
fn answer_pairs(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= arrayLength(&pairs) {
        return;
    }
    let pair = pairs[id.x];
    let receiver = textureLoad(surfels, pair.xy, 0);
    let source = textureLoad(surfels, pair.zw, 0);
    let unit = 1.0 / surfel_depth(receiver);
    let slices = slices_of_range(depth_range[0], depth_range[1]);
    let seen = sees(end_at(receiver, vec2f(pair.xy), unit), end_at(source, vec2f(pair.zw), unit), slices, unit);
    answers[id.x] = u32(seen);
}
