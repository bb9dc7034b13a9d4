// variants: packed
// The light of each surfel: that of a record near it, chosen at random within the width of a cell, so that the spatial
// filter that follows interpolates between cells. With `packed`, the result is the surfels with this light.
import package::common::hemisphere::tangents_of;
import package::common::math::{spread2, random3};
import package::common::streams::CACHE_RESOLVE_STREAM;
@if(packed) import package::common::surfel::with_radiance;
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position};
import package::common::view::{View, SKY_DEPTH};
import package::radiance_cache::cells::{cell_width, level_at, place_of};
import package::radiance_cache::light::light_of;

struct Params {
    // Width of a surfel in full-resolution pixels.
    scale: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(3) var surfels: texture_2d<u32>;
@if(!packed) @group(0) @binding(4) var gathered: texture_storage_2d<rgba32float, write>;
@if(packed) @group(0) @binding(4) var gathered: texture_storage_2d<rgba32uint, write>;

@compute @workgroup_size(8, 8)
fn resolve(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(surfels)) {
        return;
    }
    let words = textureLoad(surfels, id.xy, 0);
    let depth = surfel_depth(words);
    var light = vec4f(0.0);
    if depth > SKY_DEPTH {
        let in_view = surfel_position(words, id.xy, params.scale, view.display_size, view.tan_half_fov);
        let position = (view.view_to_world * vec4f(in_view, 1.0)).xyz;
        let normal = normalize((view.view_to_world * vec4f(surfel_normal(words), 0.0)).xyz);
        let level = level_at(depth, view);
        let tangents = tangents_of(normal);
        // The same numbers in every frame, so that a static picture does not flicker.
        let random = spread2(id.xy, 0u, CACHE_RESOLVE_STREAM, view.seed, false) - 0.5;
        let more = random3(id.xy, 0u, CACHE_RESOLVE_STREAM + 1u, view.seed).xy - 0.5;
        // In this order: the other one has a quarter more error on the atrium after 128 frames.
        let offset = tangents * random.yx;
        // Bins depend on the direction alone.
        let bent = normal + 0.4 * (tangents * more);
        let near = place_of(position + offset * cell_width(level), bent, level);
        light = light_of(near, place_of(position, normal, level));
    }
    @if(!packed) { textureStore(gathered, id.xy, vec4f(light.rgb, 1.0)); }
    @if(packed) { textureStore(gathered, id.xy, with_radiance(words, light.rgb)); }
}
