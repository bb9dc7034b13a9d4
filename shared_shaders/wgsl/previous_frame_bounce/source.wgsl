// Multiple bounces by previous-frame bounces (Therrien et al. 2023, section 4.3): the source of indirect light is
// direct light plus what surfaces reflect of the previous frame's indirect light. The albedo of this reflection is
// bounded below 1, so that even a closed white room converges: to at most 1 / (1 - bound) times the first bounce.
import package::common::view::{View, SKY_DEPTH, uv_of_texel, view_position, pixel_of};
import package::temporal::history::{history_depth, history_direction, history_light};
import package::temporal::previous_view::PreviousView;

struct Params {
    // Largest albedo of the reflection, below 1.
    bound: f32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var<uniform> previous: PreviousView;
@group(0) @binding(3) var depth: texture_2d<f32>;
@group(0) @binding(4) var normal: texture_2d<f32>;
@group(0) @binding(5) var direct: texture_2d<f32>;
@group(0) @binding(6) var albedo: texture_2d<f32>;
@group(0) @binding(7) var light_before: texture_2d<u32>;
@group(0) @binding(8) var source: texture_storage_2d<rgba32float, write>;

/// The previous frame shows this surface if the depths agree to this relative tolerance...
const DEPTH_TOLERANCE: f32 = 0.02;
/// ... and normals within 25 degrees.
const NORMAL_TOLERANCE: f32 = 0.906;

@compute @workgroup_size(8, 8)
fn add_previous_frame(@builtin(global_invocation_id) id: vec3u) {
    if any(id.xy >= textureDimensions(source)) {
        return;
    }
    var radiance = textureLoad(direct, id.xy, 0).rgb;
    let d = textureLoad(depth, id.xy, 0).x;
    if d > SKY_DEPTH && previous.valid != 0u {
        let position = view_position(uv_of_texel(id.xy, 1.0, view.display_size), d, view.tan_half_fov);
        let before = (previous.view_to_previous * vec4f(position, 1.0)).xyz;
        let pixel = pixel_of(before, previous.tan_half_fov, view.display_size);
        if before.z < 0.0 && all(pixel >= vec2f(0.0)) && all(pixel < view.display_size) {
            let words = textureLoad(light_before, vec2u(pixel), 0);
            let own = (previous.view_to_previous * vec4f(textureLoad(normal, id.xy, 0).xyz, 0.0)).xyz;
            let direction = history_direction(words);
            let cosine = max(dot(own, direction), 0.0);
            let same = abs(history_depth(words) + before.z) <= DEPTH_TOLERANCE * d
                && cosine * cosine >= NORMAL_TOLERANCE * NORMAL_TOLERANCE * dot(direction, direction) * dot(own, own);
            if same {
                radiance += min(textureLoad(albedo, id.xy, 0).rgb, vec3f(params.bound)) * history_light(words);
            }
        }
    }
    textureStore(source, id.xy, vec4f(radiance, 1.0));
}
