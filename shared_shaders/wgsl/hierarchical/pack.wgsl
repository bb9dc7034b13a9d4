// variants: lit, lit_planes, dark_planes
// Converts full-resolution textures to surfels, the finest level of the pyramid: with `lit` with their radiance,
// otherwise the first two words alone. It also writes planes: with `lit_planes` with their radiance, with `dark_planes`
// without.
import package::common::surfel::{Surfel, pack_surfel};
import package::common::view::SKY_DEPTH;
@if(lit_planes || dark_planes) import package::common::view::View;
@if(lit_planes) import package::common::plane::plane_of_surfel;
@if(dark_planes) import package::common::plane::dark_plane_of_surfel;

@group(0) @binding(0) var depth: texture_2d<f32>;
@group(0) @binding(1) var normal: texture_2d<f32>;
@if(lit || lit_planes) @group(0) @binding(2) var direct: texture_2d<f32>;
@if(lit) @group(0) @binding(3) var surfels: texture_storage_2d<rgba32uint, write>;
@if(!lit) @group(0) @binding(3) var surfels: texture_storage_2d<rg32uint, write>;
@if(lit_planes || dark_planes) @group(0) @binding(4) var<uniform> view: View;
@if(lit_planes) @group(0) @binding(5) var planes: texture_storage_2d<rgba32uint, write>;
@if(dark_planes && !lit_planes) @group(0) @binding(5) var planes: texture_storage_2d<rg32uint, write>;

@compute @workgroup_size(8, 8)
fn pack(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(surfels)) {
        return;
    }
    let d = textureLoad(depth, id.xy, 0).x;
    var words = vec4u(0u);
    if d > SKY_DEPTH {
        let n = textureLoad(normal, id.xy, 0).xyz;
        var radiance = vec3f(0.0);
        @if(lit || lit_planes) { radiance = textureLoad(direct, id.xy, 0).rgb; }
        words = pack_surfel(Surfel(d, normalize(n), radiance, vec2u(0u)));
    }
    textureStore(surfels, id.xy, words);
    @if(lit_planes) {
        let plane = plane_of_surfel(words, id.xy, 1.0, view.display_size, view.tan_half_fov);
        textureStore(planes, id.xy, plane);
    }
    @if(dark_planes && !lit_planes) {
        let plane = dark_plane_of_surfel(words, id.xy, 1.0, view.display_size, view.tan_half_fov);
        textureStore(planes, id.xy, vec4u(plane, 0u, 0u));
    }
}
