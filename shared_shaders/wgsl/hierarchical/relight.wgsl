// variants: finest, interleaved
// The surfels of one level with the radiance that they reflect of the last bounce: bounce n gathers albedo * indirect
// of bounce n - 1 (2010, section 4). Depth and normal are unchanged. Coarser levels average the children that show the
// kept surface, like `pyramid.wgsl`. With `interleaved`, in frames of the first bounce, the surfels are left unchanged
// and send direct light.
import package::common::surfel::{pack_radiance, surfel_depth, surfel_normal, surfel_position, surfel_radiance};
import package::common::view::SKY_DEPTH;
@if(!finest || interleaved) import package::common::view::View;
@if(interleaved) import package::hierarchical::bounce_of_frame::bounce_of_frame;
@if(interleaved) import package::temporal::previous_view::PreviousView;
@if(!finest) import package::hierarchical::same_surface::{same_surface, square_width};

@if(!finest)
struct Params {
    // Width of a child in full-resolution pixels.
    child_scale: f32,
}

@group(0) @binding(0) var surfels: texture_2d<u32>;
@group(0) @binding(1) var relit: texture_storage_2d<rgba32uint, write>;
@if(finest) @group(0) @binding(2) var albedo: texture_2d<f32>;
@if(finest) @group(0) @binding(3) var light: texture_2d<f32>;
@if(!finest) @group(0) @binding(2) var children: texture_2d<u32>;
@if(!finest) @group(0) @binding(4) var<uniform> params: Params;
@if(!finest || interleaved) @group(0) @binding(5) var<uniform> view: View;
@if(interleaved) @group(0) @binding(6) var<uniform> previous: PreviousView;

@if(finest)
fn reflected(texel: vec2u, words: vec4u) -> vec3f {
    return textureLoad(albedo, texel, 0).rgb * textureLoad(light, texel, 0).rgb;
}

@if(!finest)
fn reflected(texel: vec2u, words: vec4u) -> vec3f {
    let own = surfel_position(words, texel, 2.0 * params.child_scale, view.display_size, view.tan_half_fov);
    let own_normal = surfel_normal(words);
    let width = square_width(2.0 * params.child_scale, surfel_depth(words), view.tan_half_fov.y, view.display_size.y);
    var sum = vec3f(0.0);
    var agreeing = 0.0;
    var solid = 0.0;
    var seen = 0.0;
    for (var i = 0u; i < 4u; i++) {
        let child = texel * 2u + vec2u(i & 1u, i >> 1u);
        if any(child >= textureDimensions(children)) {
            continue;
        }
        seen += 1.0;
        let other = textureLoad(children, child, 0);
        if surfel_depth(other) <= SKY_DEPTH {
            continue;
        }
        solid += 1.0;
        let position = surfel_position(other, child, params.child_scale, view.display_size, view.tan_half_fov);
        if same_surface(own_normal, own, surfel_normal(other), position, width) {
            sum += surfel_radiance(other);
            agreeing += 1.0;
        }
    }
    return sum * (solid / max(agreeing * seen, 1.0));
}

// Bits of the last word that hold radiance. The others hold the offset of the kept pixel.
const RADIANCE_BITS: u32 = 0xfffu;

@compute @workgroup_size(8, 8)
fn relight(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(surfels)) {
        return;
    }
    var words = textureLoad(surfels, id.xy, 0);
    var sends = surfel_depth(words) > SKY_DEPTH;
    @if(interleaved) { sends = sends && bounce_of_frame(view.frame, previous.valid) == 2u; }
    if sends {
        let radiance = pack_radiance(reflected(id.xy, words));
        words = vec4u(words.xy, radiance.x, radiance.y | (words.w & ~RADIANCE_BITS));
    }
    textureStore(relit, id.xy, words);
}
