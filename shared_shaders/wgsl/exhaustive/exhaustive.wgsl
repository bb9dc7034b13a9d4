// Every pixel sums over every pixel (Equation 4 at full resolution, without hierarchy or sampling). A hierarchical
// gather converges to this if its estimator and its pyramid are exact.
import package::common::division::Division;
import package::common::view::{View, SKY_DEPTH, uv_of_texel, view_position};
import package::common::form_factor::{form_factor, pixel_area_factor};

struct Params {
    // Rows of sources that this pass sums over.
    first_row: u32,
    end_row: u32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var depth: texture_2d<f32>;
@group(0) @binding(3) var normal: texture_2d<f32>;
@group(0) @binding(4) var direct: texture_2d<f32>;
@group(0) @binding(5) var partial_sum: texture_2d<f32>;
@group(0) @binding(6) var indirect: texture_storage_2d<rgba32float, write>;

override POINT_TO_DISC: bool;

@compute @workgroup_size(8, 8)
fn exhaustive(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    let size = textureDimensions(depth);
    if any(id >= size) {
        return;
    }
    let own_depth = textureLoad(depth, id, 0).x;
    var sum = vec3f(0.0);
    if own_depth > SKY_DEPTH {
        if params.first_row > 0u {
            sum = textureLoad(partial_sum, id, 0).rgb;
        }
        let own_normal = textureLoad(normal, id, 0).xyz;
        // Lengths are in units of the receiver's depth, as `form_factor` expects.
        let position = view_position(uv_of_texel(id, 1.0, view.display_size), 1.0, view.tan_half_fov);
        let area = pixel_area_factor(view.tan_half_fov, view.display_size);
        for (var y = params.first_row; y < params.end_row; y++) {
            // A separate sum for each row keeps the float32 rounding error small.
            var row = vec3f(0.0);
            for (var x = 0u; x < size.x; x++) {
                let texel = vec2u(x, y);
                let d = textureLoad(depth, texel, 0).x;
                let radiance = textureLoad(direct, texel, 0).rgb;
                if d > SKY_DEPTH && any(radiance > vec3f(0.0)) {
                    let ray = view_position(uv_of_texel(texel, 1.0, view.display_size), 1.0, view.tan_half_fov);
                    let relative = d / own_depth;
                    let source_normal = textureLoad(normal, texel, 0).xyz;
                    row += radiance
                        * form_factor(
                            own_normal, ray * relative - position, ray, relative, source_normal, 1.0, area, POINT_TO_DISC,
                        );
                }
            }
            sum += row;
        }
    }
    textureStore(indirect, id, vec4f(sum, 1.0));
}
