// Indirect light that each texel of one level receives from a ring around it (Soler 2009, section 3.2).
import package::common::math::spread2;
import package::common::view::{View, SKY_DEPTH};
import package::common::surfel::{
    SNORM_16, surfel_depth, surfel_direction, surfel_normal, surfel_offset, surfel_position, surfel_radiance,
};
import package::common::form_factor::{form_factor, pixel_area_factor};

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Squares of the ring's inner and outer radius, in texels; the inner one is 0 at level 0.
    inner_square: f32,
    outer_square: f32,
    // Screen area that the disc of one sample covers, in full-resolution pixels...
    disc_area: f32,
    // ...and how many such discs one sample stands for.
    discs: f32,
    // Stream of random numbers: the level.
    level: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(3) var gathered: texture_storage_2d<rgba32float, write>;

override SAMPLES: u32 = 64u;
// Equation 4 (true) or Equation 3 (false).
override POINT_TO_DISC: bool = true;
// Whether a filter averages successive frames, which then share out the directions between them.
override OVER_FRAMES: bool = false;

// cos and sin of the golden angle: successive samples turn by it, which spreads any number of them
// evenly over the circle (Vogel 1979).
const TURN: vec2f = vec2f(-0.7373688780783197, 0.6754902942615238);
@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(surfels);
    if any(id.xy >= size) {
        return;
    }
    let own = textureLoad(surfels, id.xy, 0);
    if surfel_depth(own) <= SKY_DEPTH {
        textureStore(gathered, id.xy, vec4f(0.0));
        return;
    }
    let normal = surfel_normal(own);
    // Lengths are counted in the receiver's depth, so world units cannot leave float32's range.
    let unit = 1.0 / surfel_depth(own);
    let position = surfel_position(own, id.xy, params.scale, view.display_size, view.tan_half_fov) * unit;
    let random = spread2(id.xy, view.frame, params.level, view.seed, OVER_FRAMES);
    let centre = vec2f(id.xy) + 0.5;
    // Half the screen, in texels.
    let half_extent = 0.5 * view.display_size / params.scale;
    // From the centre of a full-resolution pixel to its view ray.
    let ray_scale = vec2f(2.0, -2.0) * view.tan_half_fov / view.display_size;
    let ray_bias = vec2f(-1.0, 1.0) * view.tan_half_fov + 0.5 * ray_scale;
    let area = pixel_area_factor(view.tan_half_fov, view.display_size) * params.disc_area;
    // Samples are stratified over the ring's area: equal steps of the squared radius.
    let step = (params.outer_square - params.inner_square) / f32(SAMPLES);
    var square = params.inner_square + step * random.x;
    let angle = 6.283185307179586 * random.y;
    var direction = vec2f(cos(angle), sin(angle));
    var sum = vec3f(0.0);
    for (var i = 0u; i < SAMPLES; i++) {
        let point = centre + sqrt(square) * direction;
        square += step;
        direction = vec2f(
            direction.x * TURN.x - direction.y * TURN.y,
            direction.x * TURN.y + direction.y * TURN.x,
        );
        // Off the screen there is nothing to gather. The last texels of a row or column may reach beyond
        // it, so the point decides and not its texel: otherwise their light would count too often.
        // Black texels and sky carry zero radiance and need no test: a mask around the arithmetic costs
        // more than it saves.
        let on_screen = all(abs(point - half_extent) < half_extent);
        let texel = floor(point);
        let words = textureLoad(surfels, vec2i(texel), 0);
        let depth = surfel_depth(words) * unit;
        let pixel = texel * params.scale + vec2f(surfel_offset(words));
        let ray = vec3f(pixel * ray_scale + ray_bias, -1.0);
        let factor = form_factor(
            normal, ray * depth - position, ray, depth, surfel_direction(words), SNORM_16, area, POINT_TO_DISC,
        );
        // Outside, a load may give any texel, whose factor is finite all the same.
        sum += surfel_radiance(words) * select(0.0, factor, on_screen);
    }
    textureStore(gathered, id.xy, vec4f(sum * params.discs, 1.0));
}
