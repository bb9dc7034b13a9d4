// variants: receive_only
// Albedo of the finest surfels: the mean over those pixels of a texel that show its surface. Sky counts as black, like
// its radiance in `pyramid.wgsl`. With `receive_only`, so do surfaces that send no light.
import package::common::view::{View, SKY_DEPTH, uv_of_texel, view_position};
import package::common::surfel::{surfel_depth, surfel_normal, surfel_position};
import package::hierarchical::same_surface::{same_surface, square_width};

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(3) var depth: texture_2d<f32>;
@group(0) @binding(4) var normal: texture_2d<f32>;
@group(0) @binding(5) var albedo: texture_2d<f32>;
@group(0) @binding(6) var surfel_albedo: texture_storage_2d<rgba16float, write>;
@if(receive_only) @group(0) @binding(7) var material: texture_2d<u32>;
// One word per material: 1 if it receives light but sends none.
@if(receive_only) @group(0) @binding(8) var<storage, read> receive_only: array<u32>;

@compute @workgroup_size(8, 8)
fn average_albedo(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(surfels)) {
        return;
    }
    let words = textureLoad(surfels, id.xy, 0);
    let own_depth = surfel_depth(words);
    let own_normal = surfel_normal(words);
    let own = surfel_position(words, id.xy, params.scale, view.display_size, view.tan_half_fov);
    let width = square_width(params.scale, own_depth, view.tan_half_fov.y, view.display_size.y);
    let children = u32(params.scale);
    var sum = vec3f(0.0);
    var agreeing = 0.0;
    var solid = 0.0;
    var seen = 0.0;
    for (var i = 0u; i < children * children; i++) {
        let pixel = id.xy * children + vec2u(i % children, i / children);
        if any(pixel >= textureDimensions(depth)) {
            continue;
        }
        seen += 1.0;
        let d = textureLoad(depth, pixel, 0).x;
        if d <= SKY_DEPTH {
            continue;
        }
        solid += 1.0;
        let n = textureLoad(normal, pixel, 0).xyz;
        let position = view_position(uv_of_texel(pixel, 1.0, view.display_size), d, view.tan_half_fov);
        // A texel of one pixel shows its own surface, whatever the rounding of its normal.
        if same_surface(own_normal, own, n, position, width) || children == 1u {
            @if(!receive_only) { sum += textureLoad(albedo, pixel, 0).rgb; }
            @if(receive_only) {
                let sends = receive_only[textureLoad(material, pixel, 0).x] == 0u;
                sum += select(vec3f(0.0), textureLoad(albedo, pixel, 0).rgb, sends);
            }
            agreeing += 1.0;
        }
    }
    textureStore(surfel_albedo, id.xy, vec4f(sum * (solid / max(agreeing * seen, 1.0)), 1.0));
}
