// Slices of a receiver's hemisphere, for every technique that walks along screen lines (Bavoil et al. 2008, Jimenez et
// al. 2016, Therrien et al. 2023). A slice is the plane through the eye, the receiver and a direction around the view
// ray. It meets the screen in a line, and every surface seen on that line lies in the slice.
//
// Positions in a slice have two coordinates relative to the receiver: `x` towards the eye, `y` along the slice's
// tangent on the side that is walked. Lengths are in units of the receiver's depth, so that scene units cannot leave
// float32's range. Angles h are measured from the direction to the eye, 0..pi on either side.
import package::common::math::{PI, least, most, nearest_whole2};
import package::common::plane::{plane_gradient, plane_inverse_depth};
import package::common::surfel::{surfel_depth, surfel_normal, surfel_pixel};

/// Screen mapping, the same for all receivers.
struct Screen {
    // Full-resolution pixels.
    size: vec2f,
    // From the centre of a full-resolution pixel to its view ray, and back.
    ray_scale: vec2f,
    ray_bias: vec2f,
    inverse_ray_scale: vec2f,
    // Width of a texel in full-resolution pixels, and of a pixel in texels.
    scale: f32,
    inverse_scale: f32,
}

fn screen_of(display_size: vec2f, tan_half_fov: vec2f, scale: f32) -> Screen {
    let ray_scale = vec2f(2.0, -2.0) * tan_half_fov / display_size;
    return Screen(display_size, ray_scale, vec2f(-1.0, 1.0) * tan_half_fov, 1.0 / ray_scale, scale, 1.0 / scale);
}

/// View ray, z = -1, of a position in full-resolution pixels.
fn ray_at(screen: Screen, pixel: vec2f) -> vec2f {
    return pixel * screen.ray_scale + screen.ray_bias;
}

struct Receiver {
    // Centre of the pixel whose surface it keeps.
    pixel: vec2f,
    // View ray with z = -1. It is also the position in units of its own depth.
    ray: vec2f,
    ray_length: f32,
    // Unit vectors: normal, and the direction to the eye with two perpendicular directions.
    normal: vec3f,
    to_eye: vec3f,
    across: vec3f,
    up: vec3f,
    // In scene units.
    depth: f32,
}

fn receiver_of(words: vec4u, texel: vec2u, screen: Screen) -> Receiver {
    let pixel = surfel_pixel(words, texel, screen.scale);
    let ray = ray_at(screen, pixel);
    let square = dot(ray, ray) + 1.0;
    let inverse_length = inverseSqrt(square);
    let to_eye = vec3f(-ray, 1.0) * inverse_length;
    // to_eye.z is positive, so x is parallel to it only in the limit of a 180 degree field of view.
    let across = normalize(vec3f(to_eye.z, 0.0, -to_eye.x));
    return Receiver(
        pixel,
        ray,
        square * inverse_length,
        surfel_normal(words),
        to_eye,
        across,
        cross(to_eye, across),
        surfel_depth(words),
    );
}

/// A slice and its normal: the receiver's normal projected into the slice.
struct Slice {
    tangent: vec3f,
    // Length of the projected normal.
    weight: f32,
    // Its angle from the direction to the eye, towards the tangent; -pi/2..pi/2.
    angle: f32,
    cos_angle: f32,
    sin_angle: f32,
}

/// The slice at an azimuth of `half_turns` half turns, 0..1, around the direction to the eye. Uniform azimuths cover
/// the hemisphere uniformly.
fn slice_of(receiver: Receiver, half_turns: f32) -> Slice {
    // Sine and cosine as polynomials around the middle (minimax, error below 6e-8).
    let t = 2.0 * half_turns - 1.0;
    let w = t * t;
    let odd = (((1.5146412e-4 * w - 4.673777863e-3) * w + 0.0796897212) * w - 0.6459637266) * w + 1.5707963192;
    let cosine = -t * odd;
    let sine = (1.0 - w) * (((-8.567029e-4 * w + 0.0199512908) * w - 0.2336980269) * w + 0.9999999474);
    let tangent = cosine * receiver.across + sine * receiver.up;
    // A shading normal may face away from the eye. The nearest valid hemisphere is that of a grazing normal.
    let x = max(dot(receiver.normal, receiver.to_eye), 1e-4);
    let y = dot(receiver.normal, tangent);
    let square = x * x + y * y;
    let inverse = inverseSqrt(square);
    let angle = angle_of(vec2f(x, abs(y))).angle;
    return Slice(tangent, square * inverse, select(-angle, angle, y > 0.0), x * inverse, y * inverse);
}

/// Cosine-weighted solid angle of a slice from the direction to the eye to angle h on one side, for a projected normal
/// of length 1 (Jimenez et al. 2016, Equation 7). `sin_angle` is that of the normal, with its sign changed on the side
/// opposite to the tangent. Its mean over all azimuths, multiplied by `weight`, is the share of the hemisphere.
fn arc(h: Angle, cos_angle: f32, sin_angle: f32) -> f32 {
    return 0.25 * ((1.0 - h.cosine) * cos_angle + (2.0 * h.angle - h.sine) * sin_angle);
}

/// `arc` of a whole side, up to the plane of the surface.
fn arc_of_side(slice: Slice, sign: f32) -> f32 {
    return 0.5 * (slice.cos_angle + (slice.angle + sign * 0.5 * PI) * slice.sin_angle);
}

/// One of the two sides of a slice on the screen.
struct Side {
    // +1 on the side of the tangent, -1 on the other one.
    sign: f32,
    // The receiver's position in texels from the middle of the first texel, and texels per pixel of distance.
    start: vec2f,
    step: vec2f,
    // Change of the view ray per pixel of distance, in coordinates of the slice.
    towards_eye: f32,
    along: f32,
    // Distance to walk, pixels: to the screen edge or to the end of the radius.
    reach: f32,
}

/// `radius` is in units of the receiver's depth.
fn side_of(receiver: Receiver, slice: Slice, sign: f32, radius: f32, screen: Screen) -> Side {
    // Screen direction of p + t tangent as t grows. The sign is applied last, so that both sides share the rest.
    let heading = (slice.tangent.xy + receiver.ray * slice.tangent.z) * screen.inverse_ray_scale;
    let along = inverseSqrt(max(dot(heading, heading), 1e-30));
    let step = sign * (heading * along);
    let towards_eye = -sign * (along * slice.tangent.z * receiver.ray_length);
    // The distance at which the screen ends...
    let room = select(receiver.pixel, screen.size - receiver.pixel, step > vec2f(0.0)) / max(abs(step), vec2f(1e-6));
    // ... and the one at which the ray leaves a sphere of this radius around the receiver. The sphere is seen under the
    // angle whose sine is radius / distance. Without a tangent the sphere contains the eye, and no ray leaves it.
    let sine = radius / receiver.ray_length;
    let tangent_of = sine * inverseSqrt(max(1.0 - sine * sine, 1e-30));
    let slope = along + tangent_of * towards_eye;
    let ball = select(1e30, receiver.ray_length * tangent_of / slope, sine < 1.0 && slope > 0.0);
    let reach = max(min(min(room.x, room.y), ball), NEAREST);
    return Side(
        sign,
        receiver.pixel * screen.inverse_scale - 0.5,
        step * screen.inverse_scale,
        towards_eye,
        along,
        reach,
    );
}

/// View ray, z = -1, at a distance of `way` pixels from the receiver, in coordinates of the slice.
fn ray_of(receiver: Receiver, side: Side, way: f32) -> vec2f {
    return vec2f(way * side.towards_eye - receiver.ray_length, way * side.along);
}

const SPACING_CONSTANT: u32 = 0u;

/// Strides along a side: of equal length, or each longer than the last by a constant factor, beginning with one texel.
/// Ends and samples advance alike: `way * factor + addend`.
struct Strides {
    factor: f32,
    addend: f32,
    // End of the first stride, and the sample in it.
    end: f32,
    way: f32,
}

/// `steps` strides up to the end. Each sample is at `jitter`, 0..1, of its stride.
fn strides_of(steps: f32, jitter: f32, reach: f32, scale: f32, spacing: u32) -> Strides {
    if spacing == SPACING_CONSTANT {
        let stride = reach / steps;
        return Strides(1.0, stride, stride, max(stride * jitter, NEAREST));
    }
    let first = min(scale, reach);
    let octaves = log2(max(reach, 1e-3) / max(first, 1e-3)) / steps;
    let factor = exp2(octaves);
    return Strides(factor, 0.0, first * factor, first * exp2(octaves * jitter));
}

/// The surface of a texel, taken as a plane. Its points lie exactly in the slice wherever in the texel the pixel is, so
/// that a plane does not occlude itself. Its inverse depth is linear on the screen, so also along a side.
struct Plane {
    // Inverse depth relative to the receiver's depth: in the middle of the texel (0 for sky), at the sample, along the
    // receiver's ray, and per pixel of distance.
    own: f32,
    here: f32,
    first: f32,
    change: f32,
    // Whether its front faces the receiver, as it faces the eye. If so, the plane passes behind the receiver.
    faces: bool,
}

/// A receiver is on a plane if the plane's inverse depth on the receiver's ray differs by this share at most; above the
/// rounding of depths. Such a receiver is in the crease of a wall, which faces it: from behind it would be lit by nothing.
/// Rounding must not choose, because it changes with the world's unit.
const SAME_PLANE: f32 = 2e-5;

/// The texel at a distance of `way` pixels from the receiver, and the offset from its middle, in texels.
struct TexelPosition {
    texel: vec2i,
    offset: vec2f,
}

fn seen_at(side: Side, way: f32) -> TexelPosition {
    let at = side.start + way * side.step;
    let texel = nearest_whole2(at);
    return TexelPosition(texel, at - vec2f(texel));
}

/// The plane of the texel at this position.
fn plane_of(receiver: Receiver, side: Side, words: vec4u, offset: vec2f, way: f32) -> Plane {
    let own = plane_inverse_depth(words) * receiver.depth;
    let gradient = plane_gradient(words);
    let here = own + receiver.depth * dot(gradient, offset);
    let change = receiver.depth * dot(gradient, side.step);
    let first = here - way * change;
    return Plane(own, here, first, change, first < 1.0 + SAME_PLANE);
}

/// A position seen along `ray`: coordinates in the slice times the inverse depth, which is in z. Directions then need
/// no division.
fn position_at(receiver: Receiver, ray: vec2f, inverse: f32) -> vec3f {
    return vec3f(receiver.ray_length * inverse + ray.x, ray.y, inverse);
}

/// Position of the plane at a distance of `way` pixels from the receiver.
fn position_on(plane: Plane, receiver: Receiver, side: Side, way: f32) -> vec3f {
    // A plane is not extended to depths that differ much from its own.
    let inverse = least(most(plane.first + way * plane.change, 0.5 * plane.own), 2.0 * plane.own);
    return position_at(receiver, ray_of(receiver, side, way), inverse);
}

/// Whether a position is within a radius, in units of the receiver's depth. The sky, with inverse depth 0, never is.
fn is_within(position: vec3f, radius: f32) -> bool {
    let reach = radius * position.z;
    return dot(position.xy, position.xy) <= reach * reach;
}

/// The back of a position: farther from the eye by a thickness, in units of the receiver's depth, and by `slope` times
/// its depth. `away` is the unit vector away from the eye.
fn back_of(position: vec3f, away: vec2f, thickness: f32, slope: f32) -> vec2f {
    return position.xy + away * (thickness * position.z + slope);
}

/// The previous sample: its distance, and its inverse depth; BEHIND_ALL for the sky.
struct Before {
    way: f32,
    inverse: f32,
}

const BEHIND_ALL: f32 = -1e15;
/// Smallest distance to which a surface is extended, pixels. On the receiver's own ray a plane has no direction.
const NEAREST: f32 = 0.05;

/// Start of the stride of a sample that stands for the whole stride.
///
/// A surface that continues behind the previous sample's surface meets it on the way. The stride begins there, but not
/// before the previous sample. Otherwise strides with an edge in them would lose the part before the sample.
///
/// A surface that the receiver sees from behind ends between the two, because it does not occlude the receiver from the
/// eye. It is not extended backwards by more than half the distance, within which a sphere does not occlude itself.
fn begin_of(plane: Plane, begin: f32, way: f32, before: Before) -> f32 {
    let behind = plane.first + before.way * plane.change < before.inverse;
    return select(most(begin, 0.5 * way), select(begin, least(begin, before.way), behind), plane.faces);
}

/// An angle h from the direction to the eye, 0..pi, and the cosine and sine of 2 h.
struct Angle {
    angle: f32,
    cosine: f32,
    sine: f32,
}

/// The angle of a position other than the receiver's, y >= 0. The double angle takes one division and no square root. h
/// is a polynomial of it: h = pi/4 - c p(s) for h up to pi/2, c = cos 2h, s = sin 2h, p(s) = acos(s) / (2 sqrt(1 -
/// s^2)); minimax, error below 6e-5 radians, 1/2000 of one of 64 sectors.
fn angle_of(position: vec2f) -> Angle {
    let x = position.x * position.x;
    let y = position.y * position.y;
    let inverse = 1.0 / (x + y);
    let cosine = (x - y) * inverse;
    let sine = 2.0 * position.x * position.y * inverse;
    let s = abs(sine);
    // The factors of s^2 are kept apart, so that products do not wait for each other.
    let w = s * s;
    let p = (0.0652049125 * w + 0.3651058225) * w + 0.7853981634 - (0.2174832319 * w + 0.4978230016) * s;
    // Angle from pi/2 to either side.
    let from_middle = cosine * p + 0.25 * PI;
    return Angle(0.5 * PI - select(from_middle, -from_middle, position.x < 0.0), cosine, sine);
}

/// `arc` up to a position on one side, at most up to the plane of the surface.
fn arc_to(position: vec2f, slice: Slice, sign: f32) -> f32 {
    let sin_angle = sign * slice.sin_angle;
    let above = position.x * slice.cos_angle + position.y * sin_angle > 0.0;
    return arc(angle_of(select(vec2f(-sin_angle, slice.cos_angle), position, above)), slice.cos_angle, sin_angle);
}
