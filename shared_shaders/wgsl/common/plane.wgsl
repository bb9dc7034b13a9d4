// The surface of a texel as a plane, in 128 bits with radiance and in 64 bits without. Techniques that walk along screen lines (common/slice.wgsl) read one
// for each sample. The inverse depth of a plane is linear on the screen.
//
//   word 0  inverse planar depth at the middle of the texel, float32; 0 without a surface
//   word 1  its change per texel to the right, float32 without the last 6 bits | radiance 6 bits
//   word 2  its change per texel downwards, likewise | radiance 6 bits
//   word 3  radiance, 32 bits: the words of common/surfel.wgsl
import package::common::surfel::{
    pack_radiance, surfel_depth, surfel_normal, surfel_pixel, surfel_radiance, unpack_radiance,
};
import package::common::math::LARGEST_FLOAT16;
import package::common::view::SKY_DEPTH;

const LOW_BITS: u32 = 63u;

fn pack_plane(inverse_depth: f32, gradient: vec2f, radiance: vec3f) -> vec4u {
    let words = pack_radiance(radiance);
    return vec4u(
        bitcast<u32>(inverse_depth),
        (bitcast<u32>(gradient.x) & ~LOW_BITS) | (words.y & LOW_BITS),
        (bitcast<u32>(gradient.y) & ~LOW_BITS) | ((words.y >> 6u) & LOW_BITS),
        words.x,
    );
}

/// A plane without radiance in 64 bits, for techniques that find ambient visibility alone:
///
///   word 0  inverse planar depth at the middle of the texel, float32; 0 without a surface
///   word 1  its change per texel to the right and downwards, relative to word 0, 2 x float16
fn pack_dark_plane(inverse_depth: f32, gradient: vec2f) -> vec2u {
    let relative = clamp(gradient / inverse_depth, vec2f(-LARGEST_FLOAT16), vec2f(LARGEST_FLOAT16));
    return vec2u(bitcast<u32>(inverse_depth), pack2x16float(relative));
}

/// The words of `pack_plane` for those of `pack_dark_plane`.
fn black_plane(words: vec4u) -> vec4u {
    let gradient = unpack2x16float(words.y) * bitcast<f32>(words.x);
    return vec4u(words.x, bitcast<vec2u>(gradient), 0u);
}

/// Lower bound of the cosine between view ray and normal. At silhouettes the error of the normals is larger.
const MIN_SLOPE: f32 = -0.02;

/// Inverse depth at the middle of a surfel's texel, which is `scale` full-resolution pixels wide, and its change per
/// texel.
fn inverse_depths(words: vec4u, texel: vec2u, scale: f32, display_size: vec2f, tan_half_fov: vec2f) -> vec3f {
    let depth = surfel_depth(words);
    let ray_scale = vec2f(2.0, -2.0) * tan_half_fov / display_size;
    let pixel = surfel_pixel(words, texel, scale);
    let ray = pixel * ray_scale + vec2f(-1.0, 1.0) * tan_half_fov;
    let normal = surfel_normal(words);
    // Every point x of the plane has dot(n, x) = dot(n, p), and x = ray depth.
    let slope = min(dot(normal.xy, ray) - normal.z, MIN_SLOPE);
    let inverse = 1.0 / depth;
    let gradient = normal.xy * ray_scale * (scale * inverse / slope);
    let to_middle = vec2f(texel) + 0.5 - pixel / scale;
    return vec3f(clamp(inverse + dot(gradient, to_middle), 0.5 * inverse, 2.0 * inverse), gradient);
}

/// The plane of a surfel with its radiance.
fn plane_of_surfel(words: vec4u, texel: vec2u, scale: f32, display_size: vec2f, tan_half_fov: vec2f) -> vec4u {
    let plane = inverse_depths(words, texel, scale, display_size, tan_half_fov);
    return select(vec4u(0u), pack_plane(plane.x, plane.yz, surfel_radiance(words)), surfel_depth(words) > SKY_DEPTH);
}

/// The plane of a surfel without its radiance.
fn dark_plane_of_surfel(words: vec4u, texel: vec2u, scale: f32, display_size: vec2f, tan_half_fov: vec2f) -> vec2u {
    let plane = inverse_depths(words, texel, scale, display_size, tan_half_fov);
    return select(vec2u(0u), pack_dark_plane(plane.x, plane.yz), surfel_depth(words) > SKY_DEPTH);
}

fn plane_inverse_depth(words: vec4u) -> f32 {
    return bitcast<f32>(words.x);
}

fn plane_gradient(words: vec4u) -> vec2f {
    // The bits of the radiance are masked out, so that radiance does not move surfaces.
    return bitcast<vec2f>(words.yz & vec2u(~LOW_BITS));
}

fn plane_radiance(words: vec4u) -> vec3f {
    return unpack_radiance(words.w, (words.y & LOW_BITS) | ((words.z & LOW_BITS) << 6u));
}
