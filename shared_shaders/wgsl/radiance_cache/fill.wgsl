// variants: float16
// Light of the pixels whose surface no surfel of half resolution shows: that of their own records.
@if(float16) import package::common::math::LARGEST_FLOAT16;
import package::common::view::View;
import package::radiance_cache::cells::{level_at, parent_of, place_of};
import package::radiance_cache::counters::{counters, first_pixel, most_pixels, stride_of};
import package::radiance_cache::light::light_of;
import package::radiance_cache::pixels::surface_of_pixel;

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(2) var depth: texture_2d<f32>;
@group(0) @binding(3) var normal: texture_2d<f32>;
@if(!float16) @group(0) @binding(4) var indirect: texture_storage_2d<rgba32float, write>;
@if(float16) @group(0) @binding(4) var indirect: texture_storage_2d<rgba16float, write>;

@compute @workgroup_size(64)
fn fill(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let count = min(atomicLoad(&counters.pixels), most_pixels());
    let width = textureDimensions(depth).x;
    for (var i = id.x; i < count; i += stride_of(workgroups)) {
        let number = counters.lists[first_pixel() + i];
        let pixel = vec2u(number % width, number / width);
        let d = textureLoad(depth, pixel, 0).x;
        let surface = surface_of_pixel(pixel, d, textureLoad(normal, pixel, 0).xyz, view);
        let place = place_of(surface.position, surface.normal, level_at(d, view));
        var light = light_of(place, parent_of(place));
        if light.w > 0.0 {
            @if(float16) { light = min(light, vec4f(LARGEST_FLOAT16)); }
            textureStore(indirect, pixel, vec4f(light.rgb, 1.0));
        }
    }
}
