// Slices of a receiver's hemisphere, for every technique that walks along lines of the screen (Bavoil et al. 2008,
// Jimenez et al. 2016, Therrien et al. 2023). A slice is the plane through the eye, the receiver and a direction around
// the view ray; it meets the screen in a line, and all that is seen on that line lies in it.
//
// Inside a slice points have two coordinates, from the receiver: `x` towards the eye, `y` along the slice's tangent on
// the side that is walked. Lengths are in the receiver's depth, so world units cannot leave float32's range. Angles h
// are counted from the direction to the eye, 0..pi on either side.
import package::common::math::PI;
import package::common::plane::{plane_gradient, plane_inverse_depth};
import package::common::surfel::{surfel_depth, surfel_normal, surfel_pixel};

/// Where things stand on the screen, the same for all receivers.
struct Screen {
    // Full-resolution pixels.
    size: vec2f,
    // From the centre of a full-resolution pixel to its view ray.
    ray_scale: vec2f,
    ray_bias: vec2f,
    // Width of a texel in full-resolution pixels.
    scale: f32,
}

fn screen_of(display_size: vec2f, tan_half_fov: vec2f, scale: f32) -> Screen {
    let ray_scale = vec2f(2.0, -2.0) * tan_half_fov / display_size;
    return Screen(display_size, ray_scale, vec2f(-1.0, 1.0) * tan_half_fov, scale);
}

/// View ray, z = -1, of a place in full-resolution pixels.
fn ray_at(screen: Screen, pixel: vec2f) -> vec2f {
    return pixel * screen.ray_scale + screen.ray_bias;
}

struct Receiver {
    // Centre of the pixel that it shows.
    pixel: vec2f,
    // View ray with z = -1: its position, in its own depth.
    ray: vec2f,
    ray_length: f32,
    // Unit vectors: normal, and the direction to the eye with two that are perpendicular to it.
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
    let to_eye = vec3f(-ray, 1.0) * inverseSqrt(square);
    // to_eye.z is positive, so x is never parallel to it but in the limit of a view of 180 degrees.
    let across = normalize(vec3f(to_eye.z, 0.0, -to_eye.x));
    return Receiver(
        pixel,
        ray,
        sqrt(square),
        surfel_normal(words),
        to_eye,
        across,
        cross(to_eye, across),
        surfel_depth(words),
    );
}

/// A slice and its normal: that of the receiver, projected into the slice.
struct Slice {
    tangent: vec3f,
    // Length of the projected normal.
    weight: f32,
    // Its angle from the direction to the eye, towards the tangent; -pi/2..pi/2.
    angle: f32,
    cos_angle: f32,
    sin_angle: f32,
}

/// The slice at this azimuth around the direction to the eye. Azimuths that are uniform in 0..pi give every direction of
/// the hemisphere its share.
fn slice_of(receiver: Receiver, azimuth: f32) -> Slice {
    let tangent = cos(azimuth) * receiver.across + sin(azimuth) * receiver.up;
    // A shading normal may turn away from the eye; the hemisphere of one that grazes is the nearest that there is.
    let x = max(dot(receiver.normal, receiver.to_eye), 1e-4);
    let y = dot(receiver.normal, tangent);
    let weight = sqrt(x * x + y * y);
    return Slice(tangent, weight, atan2(y, x), x / weight, y / weight);
}

/// Cosine-weighted solid angle of a slice from the direction to the eye to angle h on one side, for a projected normal
/// of length 1 (Jimenez et al. 2016, Equation 7). `cos_h`, `sin_h` are those of h; `sin_angle` is that of the normal, its
/// sign turned where the side is the one away from the tangent. Multiplied by `weight`, its mean over all azimuths is
/// the share of the hemisphere.
fn arc(h: f32, cos_h: f32, sin_h: f32, cos_angle: f32, sin_angle: f32) -> f32 {
    return 0.5 * (sin_h * sin_h * cos_angle + (h - sin_h * cos_h) * sin_angle);
}

/// `arc` of a whole side, up to the plane of the surface.
fn arc_of_side(slice: Slice, sign: f32) -> f32 {
    return 0.5 * (slice.cos_angle + (slice.angle + sign * 0.5 * PI) * slice.sin_angle);
}

/// One of the two sides of a slice, as the screen shows it.
struct Side {
    // +1 on the side of the tangent, -1 on the other.
    sign: f32,
    // On the screen: pixels for each pixel of way.
    step: vec2f,
    // The view ray's change for each pixel, with z = 0, and the same in the slice's own coordinates.
    ray_step: vec2f,
    towards_eye: f32,
    along: f32,
    // Way to walk, pixels: to the edge of the screen or to where the radius ends.
    reach: f32,
}

/// `radius` is in the receiver's depth.
fn side_of(receiver: Receiver, slice: Slice, sign: f32, radius: f32, screen: Screen) -> Side {
    let tangent = sign * slice.tangent;
    // Where p + t tangent is seen as t grows.
    let heading = (tangent.xy + receiver.ray * tangent.z) / screen.ray_scale;
    let along = inverseSqrt(max(dot(heading, heading), 1e-30));
    let step = heading * along;
    let towards_eye = -along * tangent.z * receiver.ray_length;
    // The way on which the screen ends...
    let room = select(receiver.pixel, screen.size - receiver.pixel, step > vec2f(0.0)) / max(abs(step), vec2f(1e-6));
    var reach = min(room.x, room.y);
    // ... and the one on which the ray leaves a ball of the radius around the receiver: it is seen under the angle whose
    // sine is radius / distance.
    let sine = radius / receiver.ray_length;
    if sine < 1.0 {
        let tangent_of = sine * inverseSqrt(1.0 - sine * sine);
        let slope = along + tangent_of * towards_eye;
        if slope > 0.0 {
            reach = min(reach, receiver.ray_length * tangent_of / slope);
        }
    }
    return Side(sign, step, step * screen.ray_scale, towards_eye, along, reach);
}

/// Unit vector away from the eye of what is seen there, in the slice.
fn away(receiver: Receiver, side: Side, way: f32) -> vec2f {
    let ray = vec2f(way * side.towards_eye - receiver.ray_length, way * side.along);
    return ray * inverseSqrt(dot(ray, ray));
}

const SPACING_CONSTANT: u32 = 0u;

/// Strides along a side: all of the same length, or each longer than the last by the same factor, from a texel on. Ends
/// and samples go on alike, `way * factor + addend`.
struct Strides {
    factor: f32,
    addend: f32,
    // End of the first stride, and the sample in it.
    end: f32,
    way: f32,
}

/// `steps` strides that reach to the end; samples stand at `jitter`, 0..1, of theirs.
fn strides_of(steps: f32, jitter: f32, reach: f32, scale: f32, spacing: u32) -> Strides {
    if spacing == SPACING_CONSTANT {
        let stride = reach / steps;
        return Strides(1.0, stride, stride, stride * jitter);
    }
    let first = min(scale, reach);
    let octaves = log2(max(reach, 1e-3) / max(first, 1e-3)) / steps;
    let factor = exp2(octaves);
    return Strides(factor, 0.0, first * factor, first * exp2(octaves * jitter));
}

/// The surface that a texel shows, taken for a plane: what stands on it lies in the slice exactly, wherever in the texel
/// its pixel is, so that a plane does not hide itself. One over its depth is linear on the screen, and so along a side.
struct Plane {
    // One over depth, in that of the receiver: in the middle of the texel (0 for sky), along the receiver's ray, and for
    // each pixel of way.
    own: f32,
    first: f32,
    change: f32,
    // Whether its front faces the receiver, as it faces the eye: it runs behind it.
    faces: bool,
}

fn plane_of(receiver: Receiver, side: Side, words: vec4u, texel: vec2i, screen: Screen) -> Plane {
    let own = plane_inverse_depth(words) * receiver.depth;
    let gradient = plane_gradient(words) * receiver.depth;
    let first = own + dot(gradient, receiver.pixel - (vec2f(texel) + 0.5) * screen.scale);
    return Plane(own, first, dot(gradient, side.step), first < 1.0);
}

/// Where the plane is seen `way` pixels from the receiver: coordinates in the slice times one over its depth, which stands
/// in z. Directions need no division so.
fn place_on(plane: Plane, receiver: Receiver, side: Side, way: f32) -> vec3f {
    // The plane of a texel is not followed to other depths than about its own.
    let inverse = clamp(plane.first + way * plane.change, 0.5 * plane.own, 2.0 * plane.own);
    return vec3f(receiver.ray_length * (inverse - 1.0) + way * side.towards_eye, way * side.along, inverse);
}

/// Whether a place on a plane is within a radius, in the receiver's depth.
fn is_within(place: vec3f, radius: f32) -> bool {
    let reach = radius * place.z;
    return dot(place.xy, place.xy) <= reach * reach && place.z > 0.0;
}

/// The back of a place: farther from the eye by a thickness, in the receiver's depth, and by `slope` of its depth. `away`
/// is the unit vector away from the eye.
fn back_of(place: vec3f, away: vec2f, thickness: f32, slope: f32) -> vec2f {
    return place.xy + away * (thickness * place.z + slope);
}

/// What the sample before showed: where it stood, and one over its depth; BEHIND_ALL for the sky.
struct Before {
    way: f32,
    inverse: f32,
}

const BEHIND_ALL: f32 = -1e15;
/// Nearest way to which a surface is extended, pixels: on the receiver's own ray a plane has no direction.
const NEAREST: f32 = 0.05;

/// Where a stride begins for a sample that stands for all of it.
///
/// A surface that runs on behind what the sample before showed meets it on the way: it begins there, at the sample before
/// at the earliest, or strides with an edge in them would lose the part that is before the sample.
///
/// A surface that the receiver sees from behind ends on the way to it, because it does not hide it from the eye: it is not
/// followed back farther than half the way, within which a ball hides nothing of itself.
fn begin_of(plane: Plane, begin: f32, way: f32, before: Before) -> f32 {
    let behind = plane.first + before.way * plane.change < before.inverse;
    let first = select(begin, min(begin, before.way), behind);
    return max(select(max(begin, 0.5 * way), first, plane.faces), NEAREST);
}

/// Cosine and sine of the angle of a place from the direction to the eye.
fn direction_of(place: vec2f) -> vec2f {
    return place * inverseSqrt(max(dot(place, place), 1e-30));
}

/// The one of two places that stands at the smaller angle from the direction to the eye.
fn nearer_to_eye(a: vec3f, b: vec3f) -> vec3f {
    return select(b, a, a.x * b.y >= a.y * b.x);
}

/// acos within 7e-5 radians (Abramowitz & Stegun 1964, 4.4.45), a seven-hundredth of one of 64 sectors.
fn angle_of(cosine: f32) -> f32 {
    let x = min(abs(cosine), 1.0);
    let angle = sqrt(1.0 - x) * (((-0.0187293 * x + 0.0742610) * x - 0.2121144) * x + 1.5707288);
    return select(angle, PI - angle, cosine < 0.0);
}

/// `arc` up to a direction (cosine, sine) on one side, at most to the plane of the surface.
fn arc_to(direction: vec2f, slice: Slice, sign: f32) -> f32 {
    let sin_angle = sign * slice.sin_angle;
    let above = direction.x > -sin_angle;
    let cosine = select(-sin_angle, direction.x, above);
    return arc(angle_of(cosine), cosine, select(slice.cos_angle, direction.y, above), slice.cos_angle, sin_angle);
}
