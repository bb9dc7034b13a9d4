// variants: visibility, glossy, near
// Indirect light that each texel of one level receives from a ring around it (Soler 2009, section 3.2). With `glossy`,
// the light that it sends in its mirror direction to the eye, per unit of Ks (2010, section 4). With `visibility`, the
// froxel grid occludes (2010). With `near`, only sources within the near-field distance; the rest comes from the
// reflective shadow maps.
import package::common::division::Division;
import package::common::math::GOLDEN_ROTATION;
@if(visibility) import package::common::math::largest;
import package::common::math::spread2;
import package::common::view::{View, SKY_DEPTH};
import package::common::surfel::{
    SNORM_16, surfel_depth, surfel_direction, surfel_normal, surfel_offset, surfel_position, surfel_radiance,
};
@if(glossy) import package::common::surfel::surfel_pixel;
@if(glossy) import package::common::scene::Material;
@if(glossy) import package::hierarchical::lobe::{
    LobeOnScreen, phong_lobe, screen_direction, draw_angle, inverse_density, lobe_on_screen, draw_heading, draw_square,
};
import package::common::form_factor::{form_factor, pixel_area_factor};
@if(visibility) import package::common::froxels::{
    Slices, slices_of_range, slice_of_depth, slice_thickness, slice_mask, WORD_SHIFT,
};
@if(visibility) import package::common::streams::HIERARCHICAL_VISIBILITY_STREAM;
@if(visibility) import package::hierarchical::march::{
    March, begin_march, slice_at, clear_of_plane, screen_fraction,
};

struct Params {
    // Width of a texel in full-resolution pixels.
    scale: f32,
    // Squares of the ring's inner and outer radius, in texels; the inner one is 0 at level 0.
    inner_square: f32,
    outer_square: f32,
    // Screen area that the disc of one sample covers, in full-resolution pixels...
    disc_area: f32,
    // ...and number of such discs that one sample stands for.
    discs: f32,
    // Random-number stream: level and bounce.
    level: u32,
    // Near-field distance: the screen provides light from nearer sources, the reflective shadow maps from farther ones;
    // scene units.
    @if(near) near_field_distance: f32,
}

@group(1) @binding(0) var<uniform> division: Division;
@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var surfels: texture_2d<u32>;
@group(0) @binding(3) var gathered: texture_storage_2d<rgba32float, write>;
@if(visibility) @group(0) @binding(4) var<storage, read> depth_range: array<u32>;
@if(visibility) @group(0) @binding(5) var froxels: texture_2d_array<u32>;
@if(glossy) @group(0) @binding(8) var material: texture_2d<u32>;
@if(glossy) @group(0) @binding(9) var<storage, read> materials: array<Material>;

override SAMPLES: u32;
// Equation 4 (true) or Equation 3 (false).
override POINT_TO_DISC: bool;
// Sampling density: 0 uniform, 1 the paper's screen directions, 2 the directions and reach of the mirror lobe.
@if(glossy) override IMPORTANCE: u32;
// Number of successive samples that share one ray through the grid.
@if(visibility) override SAMPLES_PER_RAY: u32;
// Whether a temporal filter averages successive frames. The directions are then stratified over frames.
override OVER_FRAMES: bool;

// The largest float below 1. A random number clamped to it stays below the total.
@if(visibility) const BELOW_ONE: f32 = 0.99999994;
// Light below this counts as none.
@if(visibility) const SMALLEST_LIGHT: f32 = 1e-36;

// One end of a ray. Lengths are in units of the receiver's depth.
@if(visibility)
struct End {
    // Position in texels of the level, view ray with z = -1, depth, and a normal of any length.
    texel: vec2f,
    ray: vec3f,
    depth: f32,
    normal: vec3f,
}

@if(visibility)
fn end_at(words: vec4u, texel: vec2f, unit: f32) -> End {
    let pixel = texel * params.scale + vec2f(surfel_offset(words)) + 0.5;
    let ray = vec3f((pixel / view.display_size * 2.0 - 1.0) * vec2f(1.0, -1.0) * view.tan_half_fov, -1.0);
    return End(pixel / params.scale, ray, surfel_depth(words) * unit, surfel_direction(words));
}

/// Whether no occluder in the grid of this level lies between `receiver` and `source`. `unit` is the inverse of the
/// receiver's depth in scene units.
@if(visibility)
fn sees(receiver: End, source: End, slices: Slices, unit: f32) -> bool {
    let toward = source.ray * source.depth - receiver.ray;
    // Width and depth of a froxel, per unit of depth.
    let column = 2.0 * params.scale * view.tan_half_fov / view.display_size;
    let slice = slice_thickness(slices);
    let near = clear_of_plane(
        receiver.normal,
        receiver.ray,
        source.ray,
        1.0,
        source.depth,
        dot(receiver.normal, toward),
        column,
        slice,
    );
    let far = 1.0 - clear_of_plane(
        source.normal,
        source.ray,
        receiver.ray,
        source.depth,
        1.0,
        -dot(source.normal, toward),
        column,
        slice,
    );
    if near >= far {
        return true;
    }
    var march = begin_march(
        receiver.texel,
        source.texel,
        source.depth,
        vec2f(slice_of_depth(1.0 / unit, slices), slices.per_octave),
        screen_fraction(near, source.depth),
        screen_fraction(far, source.depth),
    );
    var blockers = 0u;
    while march.at < march.end && blockers == 0u {
        march.at = min(march.end, min(march.crossing.x, march.crossing.y));
        let slice = slice_at(march, march.at);
        let first = min(march.entry, slice);
        let last = max(march.entry, slice);
        let word = first >> WORD_SHIFT;
        blockers = textureLoad(froxels, march.column, word, 0).x & slice_mask(first, last, word);
        // Only long spans continue in other words.
        if word != (last >> WORD_SHIFT) {
            for (var next = word + 1; next <= (last >> WORD_SHIFT); next++) {
                blockers |= textureLoad(froxels, march.column, next, 0).x & slice_mask(first, last, next);
            }
        }
        march.entry = slice;
        let along_x = march.crossing.x < march.crossing.y;
        march.column += select(vec2i(0, march.stride.y), vec2i(march.stride.x, 0), along_x);
        march.crossing += select(vec2f(0.0, march.spacing.y), vec2f(march.spacing.x, 0.0), along_x);
    }
    return blockers == 0u;
}

// Values that all samples of a receiver share. Lengths are in units of the receiver's depth, so that scene units cannot
// leave float32's range.
struct Receiver {
    normal: vec3f,
    position: vec3f,
    // Inverse of its depth in scene units.
    unit: f32,
    // K dP of Equation 2 for the disc of one sample.
    area: f32,
    // Half the screen, in texels.
    half_extent: vec2f,
    // From the centre of a full-resolution pixel to its view ray.
    ray_scale: vec2f,
    ray_bias: vec2f,
    // Mirror direction, unit length, and Phong exponent.
    @if(glossy) mirror: vec3f,
    @if(glossy) exponent: f32,
}

/// Form factor of the surfel in the texel that contains `point`.
fn sample_factor(receiver: Receiver, point: vec2f, words: vec4u) -> f32 {
    // There is nothing to gather off the screen. The last texels of a row or column may reach beyond it, so the point
    // decides, not its texel. Otherwise their light would count too often. Black texels and sky have zero radiance and
    // need no test, because masking the arithmetic costs more than it saves.
    let on_screen = all(abs(point - receiver.half_extent) < receiver.half_extent);
    let depth = surfel_depth(words) * receiver.unit;
    let pixel = floor(point) * params.scale + vec2f(surfel_offset(words));
    let ray = vec3f(pixel * receiver.ray_scale + receiver.ray_bias, -1.0);
    let toward = ray * depth - receiver.position;
    @if(glossy) let lobe = phong_lobe(
        dot(receiver.mirror, toward) * inverseSqrt(max(dot(toward, toward), 1e-30)),
        receiver.exponent,
    );
    let factor = form_factor(
        receiver.normal,
        toward,
        ray,
        depth,
        surfel_direction(words),
        SNORM_16,
        receiver.area,
        POINT_TO_DISC,
    );
    // Outside the texture a load may return any texel. Its factor is still finite.
    @if(near) let near_field_distance = params.near_field_distance * receiver.unit;
    @if(near && !glossy) { return select(0.0, factor, on_screen && dot(toward, toward) < near_field_distance * near_field_distance); }
    @if(!near && !glossy) { return select(0.0, factor, on_screen); }
    @if(glossy) { return select(0.0, factor * lobe, on_screen); }
}

/// The direction of the next sample.
fn rotated(direction: vec2f) -> vec2f {
    return vec2f(
        direction.x * GOLDEN_ROTATION.x - direction.y * GOLDEN_ROTATION.y,
        direction.x * GOLDEN_ROTATION.y + direction.y * GOLDEN_ROTATION.x,
    );
}

// Sampling state of a receiver.
@if(glossy)
struct Draw {
    // Centre of the texel, in texels.
    centre: vec2f,
    random: vec2f,
    // Screen angle of the mirror direction, for the paper's density.
    middle: f32,
    exponent: f32,
    lobe: LobeOnScreen,
    // Square of the lobe's reach, texels.
    reach: f32,
    half_extent: vec2f,
}

/// Squared distance, texels, within which samples of the lobe are uniform. Nearer samples fall into the receiver's own
/// texel.
@if(glossy) const NEAREST_SQUARE: f32 = 1.0;
@if(glossy) const IMPORTANCE_OF_2010: u32 = 1u;
@if(glossy) const IMPORTANCE_OF_LOBE: u32 = 2u;

@if(glossy)
fn begin_draw(receiver: Receiver, centre: vec2f, random: vec2f) -> Draw {
    let heading = screen_direction(receiver.mirror, receiver.position);
    var draw: Draw;
    draw.centre = centre;
    draw.random = random;
    draw.exponent = receiver.exponent;
    draw.half_extent = receiver.half_extent;
    // A mirror direction along the view ray has no screen direction. Any direction is valid.
    draw.middle = select(0.0, atan2(heading.y, heading.x), dot(heading, heading) > 0.0);
    if IMPORTANCE == IMPORTANCE_OF_LOBE {
        draw.lobe = lobe_on_screen(receiver.mirror, receiver.position, receiver.exponent);
        // Pixels are nearly square, so the vertical scale serves both axes.
        let texels = receiver.half_extent.y / view.tan_half_fov.y;
        draw.reach = draw.lobe.reach_square * texels * texels;
    }
    return draw;
}

/// Offset of sample `i` from the centre, in texels, and the weight of its light: the inverse of the relative sampling
/// density.
@if(glossy)
fn draw_sample(draw: Draw, i: u32) -> vec3f {
    // Steps of the golden ratio fill the circle evenly, like those of the golden angle for diffuse light.
    let number = fract(draw.random.y + f32(i) * 0.6180339887498949);
    let stratum = (f32(i) + draw.random.x) / f32(SAMPLES);
    let even = sqrt(mix(params.inner_square, params.outer_square, stratum));
    if IMPORTANCE == IMPORTANCE_OF_LOBE {
        let direction = draw_heading(number, draw.lobe);
        // There is nothing to gather off the screen: the distance to its edge limits the ring.
        let ways = (draw.half_extent + sign(direction.xy) * (draw.half_extent - draw.centre))
            / max(abs(direction.xy), vec2f(1e-9));
        let edge = min(ways.x, ways.y);
        let outer = min(params.outer_square, edge * edge);
        if outer <= params.inner_square {
            return vec3f(direction.xy * even, 0.0);
        }
        let square =
            draw_square(stratum, params.inner_square, outer, params.outer_square, draw.reach, NEAREST_SQUARE);
        return vec3f(direction.xy * sqrt(square.x), direction.z * square.y);
    }
    if IMPORTANCE == IMPORTANCE_OF_2010 {
        let away = draw_angle(number, draw.exponent);
        let angle = draw.middle + away;
        return vec3f(cos(angle) * even, sin(angle) * even, inverse_density(away, draw.exponent));
    }
    let angle = 6.283185307179586 * number;
    return vec3f(cos(angle) * even, sin(angle) * even, 1.0);
}

@compute @workgroup_size(8, 8)
fn gather(@builtin(global_invocation_id) invocation: vec3u) {
    let id = invocation.xy + division.invocation;
    let size = textureDimensions(surfels);
    if any(id >= size) {
        return;
    }
    let own = textureLoad(surfels, id, 0);
    if surfel_depth(own) <= SKY_DEPTH {
        textureStore(gathered, id, vec4f(0.0));
        return;
    }
    @if(glossy) let surface = materials[textureLoad(material, vec2u(surfel_pixel(own, id, params.scale)), 0).x];
    @if(glossy) {
        if !any(surface.specular > vec3f(0.0)) {
            textureStore(gathered, id, vec4f(0.0));
            return;
        }
    }
    let unit = 1.0 / surfel_depth(own);
    let ray_scale = vec2f(2.0, -2.0) * view.tan_half_fov / view.display_size;
    // Lengths are in units of the receiver's depth, so this is its view ray, too.
    let position = surfel_position(own, id, params.scale, view.display_size, view.tan_half_fov) * unit;
    @if(glossy) let mirror = reflect(normalize(position), surfel_normal(own));
    var receiver: Receiver;
    receiver.normal = surfel_normal(own);
    receiver.position = position;
    receiver.unit = unit;
    receiver.area = pixel_area_factor(view.tan_half_fov, view.display_size) * params.disc_area;
    receiver.half_extent = 0.5 * view.display_size / params.scale;
    receiver.ray_scale = ray_scale;
    receiver.ray_bias = vec2f(-1.0, 1.0) * view.tan_half_fov + 0.5 * ray_scale;
    @if(glossy) {
        receiver.mirror = mirror;
        receiver.exponent = surface.phong_exponent;
    }
    let random = spread2(id, view.frame, params.level, view.seed, OVER_FRAMES);
    let centre = vec2f(id) + 0.5;
    // Samples are stratified over the area of the ring: equal steps of the squared radius.
    @if(!glossy) let step = (params.outer_square - params.inner_square) / f32(SAMPLES);
    @if(!glossy) var square = params.inner_square + step * random.x;
    @if(!glossy) let angle = 6.283185307179586 * random.y;
    @if(!glossy) var direction = vec2f(cos(angle), sin(angle));
    @if(glossy) let draw = begin_draw(receiver, centre, random);
    var sum = vec3f(0.0);
    @if(!visibility) {
        for (var i = 0u; i < SAMPLES; i++) {
            @if(glossy) let drawn = draw_sample(draw, i);
            @if(glossy) let point = centre + drawn.xy;
            @if(!glossy) let point = centre + sqrt(square) * direction;
            @if(!glossy) { square += step; direction = rotated(direction); }
            let words = textureLoad(surfels, vec2i(floor(point)), 0);
            @if(!glossy) { sum += surfel_radiance(words) * sample_factor(receiver, point, words); }
            @if(glossy) { sum += surfel_radiance(words) * (sample_factor(receiver, point, words) * drawn.z); }
        }
    }
    @if(visibility) {
        let here = end_at(own, vec2f(id), unit);
        let slices = slices_of_range(depth_range[0], depth_range[1]);
        var choice = spread2(id, view.frame, params.level + HIERARCHICAL_VISIBILITY_STREAM, view.seed, OVER_FRAMES).x;
        for (var first = 0u; first < SAMPLES; first += SAMPLES_PER_RAY) {
            // Resampled importance sampling (Talbot et al. 2005): one of these samples is chosen in proportion to its
            // contribution. It stands for all of them if it is visible. The mean is unchanged, and fewer rays are
            // needed.
            var strength_of_all = 0.0;
            var picked_strength = 0.0;
            var picked = vec2f(0.0);
            for (var i = 0u; i < SAMPLES_PER_RAY; i++) {
                @if(glossy) let drawn = draw_sample(draw, first + i);
                @if(glossy) let point = centre + drawn.xy;
                @if(!glossy) let point = centre + sqrt(square) * direction;
                @if(!glossy) { square += step; direction = rotated(direction); }
                let words = textureLoad(surfels, vec2i(floor(point)), 0);
                var light = largest(surfel_radiance(words)) * sample_factor(receiver, point, words);
                @if(glossy) { light *= drawn.z; }
                // The last ray may have fewer samples.
                let strength = select(0.0, light, first + i < SAMPLES);
                let before = strength_of_all;
                strength_of_all += strength;
                // One random number serves all choices: its remainder after each choice is uniform again.
                let threshold = choice * strength_of_all;
                let pick = threshold < strength;
                let left = select(threshold - strength, threshold, pick) / max(select(before, strength, pick), SMALLEST_LIGHT);
                choice = select(choice, min(left, BELOW_ONE), strength > 0.0);
                picked = select(picked, point, pick);
                picked_strength = select(picked_strength, strength, pick);
            }
            if picked_strength > 0.0 {
                let texel = floor(picked);
                let words = textureLoad(surfels, vec2i(texel), 0);
                if sees(here, end_at(words, texel, unit), slices, unit) {
                    let radiance = surfel_radiance(words);
                    sum += radiance * (strength_of_all / largest(radiance));
                }
            }
            // The next choice takes another number: steps of the golden ratio fill the interval evenly.
            choice = fract(choice + 0.6180339887498949);
        }
    }
    textureStore(gathered, id, vec4f(sum * params.discs, 1.0));
}
