// variants: float16, glossy, transmitted
// final = direct + albedo * indirect (Soler 2009, section 4). With `glossy`, + Ks * glossy (2010). With `transmitted`,
// + light that passes translucent surfaces.
import package::common::division::Division;
@if(float16) import package::common::math::LARGEST_FLOAT16;
@if(glossy) import package::common::scene::Material;

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var direct: texture_2d<f32>;
@group(0) @binding(1) var albedo: texture_2d<f32>;
@group(0) @binding(2) var indirect: texture_2d<f32>;
@if(!float16) @group(0) @binding(3) var final_image: texture_storage_2d<rgba32float, write>;
@if(float16) @group(0) @binding(3) var final_image: texture_storage_2d<rgba16float, write>;
@if(glossy) @group(0) @binding(4) var glossy: texture_2d<f32>;
@if(glossy) @group(0) @binding(5) var material: texture_2d<u32>;
@if(glossy) @group(0) @binding(6) var<storage, read> materials: array<Material>;
@if(transmitted) @group(0) @binding(7) var transmitted: texture_2d<f32>;

// One invocation computes four pixels, a workgroup's width apart. This reduces the cost of starting invocations, and
// neighbouring invocations still read neighbouring pixels.
const PIXELS: u32 = 4u;
const WIDTH: u32 = 8u;

@compute @workgroup_size(WIDTH, 8)
fn composite(@builtin(workgroup_id) workgroup: vec3u, @builtin(local_invocation_id) local: vec3u) {
    let group = workgroup.xy + division.workgroup;
    let size = textureDimensions(final_image);
    for (var i = 0u; i < PIXELS; i++) {
        let pixel = vec2u((group.x * PIXELS + i) * WIDTH, group.y * 8u) + local.xy;
        if all(pixel < size) {
            let incident = textureLoad(indirect, pixel, 0).rgb;
            var radiance = textureLoad(direct, pixel, 0).rgb + textureLoad(albedo, pixel, 0).rgb * incident;
            @if(glossy) {
                // Without a surface the material is the first one, and no light arrives.
                let specular = materials[textureLoad(material, pixel, 0).x].specular;
                radiance += specular * textureLoad(glossy, pixel, 0).rgb;
            }
            @if(transmitted) { radiance += textureLoad(transmitted, pixel, 0).rgb; }
            @if(float16) {
                radiance = min(radiance, vec3f(LARGEST_FLOAT16));
            }
            textureStore(final_image, pixel, vec4f(radiance, 1.0));
        }
    }
}
