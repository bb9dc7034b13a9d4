// Slices of a receiver's hemisphere, for every technique that walks along lines of the screen (Bavoil et al. 2008,
// Jimenez et al. 2016, Therrien et al. 2023). A slice is the plane through the eye, the receiver and a direction around
// the view ray; it meets the screen in a line, and all that is seen on that line lies in it.
//
// Inside a slice points have two coordinates, from the receiver: `x` towards the eye, `y` along the slice's tangent on
// the side that is walked. Lengths are in the receiver's depth, so world units cannot leave float32's range. Angles h
// are counted from the direction to the eye, 0..pi on either side.
import package::common::math::{PI, least, most, nearest_whole2};
import package::common::plane::{plane_gradient, plane_inverse_depth};
import package::common::surfel::{surfel_depth, surfel_normal, surfel_pixel};

/// Where things stand on the screen, the same for all receivers.
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
    let inverse_length = inverseSqrt(square);
    let to_eye = vec3f(-ray, 1.0) * inverse_length;
    // to_eye.z is positive, so x is never parallel to it but in the limit of a view of 180 degrees.
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

/// The slice at an azimuth of `half_turns`, 0..1, around the direction to the eye. Azimuths that are uniform there give
/// every direction of the hemisphere its share.
fn slice_of(receiver: Receiver, half_turns: f32) -> Slice {
    // Sine and cosine as polynomials around the middle (minimax, within 6e-8).
    let t = 2.0 * half_turns - 1.0;
    let w = t * t;
    let odd = (((1.5146412e-4 * w - 4.673777863e-3) * w + 0.0796897212) * w - 0.6459637266) * w + 1.5707963192;
    let cosine = -t * odd;
    let sine = (1.0 - w) * (((-8.567029e-4 * w + 0.0199512908) * w - 0.2336980269) * w + 0.9999999474);
    let tangent = cosine * receiver.across + sine * receiver.up;
    // A shading normal may turn away from the eye; the hemisphere of one that grazes is the nearest that there is.
    let x = max(dot(receiver.normal, receiver.to_eye), 1e-4);
    let y = dot(receiver.normal, tangent);
    let square = x * x + y * y;
    let inverse = inverseSqrt(square);
    let angle = angle_of(vec2f(x, abs(y))).angle;
    return Slice(tangent, square * inverse, select(-angle, angle, y > 0.0), x * inverse, y * inverse);
}

/// Cosine-weighted solid angle of a slice from the direction to the eye to angle h on one side, for a projected normal
/// of length 1 (Jimenez et al. 2016, Equation 7). `sin_angle` is that of the normal, its sign turned where the side is the
/// one away from the tangent. Multiplied by `weight`, its mean over all azimuths is the share of the hemisphere.
fn arc(h: Angle, cos_angle: f32, sin_angle: f32) -> f32 {
    return 0.25 * ((1.0 - h.cosine) * cos_angle + (2.0 * h.angle - h.sine) * sin_angle);
}

/// `arc` of a whole side, up to the plane of the surface.
fn arc_of_side(slice: Slice, sign: f32) -> f32 {
    return 0.5 * (slice.cos_angle + (slice.angle + sign * 0.5 * PI) * slice.sin_angle);
}

/// One of the two sides of a slice, as the screen shows it.
struct Side {
    // +1 on the side of the tangent, -1 on the other.
    sign: f32,
    // The receiver's place in texels from the middle of the first one, and texels for each pixel of way.
    start: vec2f,
    step: vec2f,
    // What a pixel of way adds to the view ray, in the slice's own coordinates.
    towards_eye: f32,
    along: f32,
    // Way to walk, pixels: to the edge of the screen or to where the radius ends.
    reach: f32,
}

/// `radius` is in the receiver's depth.
fn side_of(receiver: Receiver, slice: Slice, sign: f32, radius: f32, screen: Screen) -> Side {
    // Where p + t tangent is seen as t grows. The sign comes last, so that both sides share what comes before.
    let heading = (slice.tangent.xy + receiver.ray * slice.tangent.z) * screen.inverse_ray_scale;
    let along = inverseSqrt(max(dot(heading, heading), 1e-30));
    let step = sign * (heading * along);
    let towards_eye = -sign * (along * slice.tangent.z * receiver.ray_length);
    // The way on which the screen ends...
    let room = select(receiver.pixel, screen.size - receiver.pixel, step > vec2f(0.0)) / max(abs(step), vec2f(1e-6));
    // ... and the one on which the ray leaves a ball of the radius around the receiver: it is seen under the angle whose
    // sine is radius / distance. Without a tangent the ball holds the eye, and nothing leaves it.
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

/// View ray, z = -1, of what is seen `way` pixels from the receiver, in the slice.
fn ray_of(receiver: Receiver, side: Side, way: f32) -> vec2f {
    return vec2f(way * side.towards_eye - receiver.ray_length, way * side.along);
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
        return Strides(1.0, stride, stride, max(stride * jitter, NEAREST));
    }
    let first = min(scale, reach);
    let octaves = log2(max(reach, 1e-3) / max(first, 1e-3)) / steps;
    let factor = exp2(octaves);
    return Strides(factor, 0.0, first * factor, first * exp2(octaves * jitter));
}

/// The surface that a texel shows, taken for a plane: what stands on it lies in the slice exactly, wherever in the texel
/// its pixel is, so that a plane does not hide itself. One over its depth is linear on the screen, and so along a side.
struct Plane {
    // One over depth, in that of the receiver: in the middle of the texel (0 for sky), where the sample stands, along the
    // receiver's ray, and for each pixel of way.
    own: f32,
    here: f32,
    first: f32,
    change: f32,
    // Whether its front faces the receiver, as it faces the eye: it runs behind it.
    faces: bool,
}

/// What is seen `way` pixels from the receiver: texel, and the way to there from its middle, in texels.
struct TexelPosition {
    texel: vec2i,
    offset: vec2f,
}

fn seen_at(side: Side, way: f32) -> TexelPosition {
    let at = side.start + way * side.step;
    let texel = nearest_whole2(at);
    return TexelPosition(texel, at - vec2f(texel));
}

/// The plane of a texel that is seen there.
fn plane_of(receiver: Receiver, side: Side, words: vec4u, offset: vec2f, way: f32) -> Plane {
    let own = plane_inverse_depth(words) * receiver.depth;
    let gradient = plane_gradient(words);
    let here = own + receiver.depth * dot(gradient, offset);
    let change = receiver.depth * dot(gradient, side.step);
    let first = here - way * change;
    return Plane(own, here, first, change, first < 1.0);
}

/// A place that is seen along `ray`: coordinates in the slice times one over its depth, which stands in z. Directions need
/// no division so.
fn position_at(receiver: Receiver, ray: vec2f, inverse: f32) -> vec3f {
    return vec3f(receiver.ray_length * inverse + ray.x, ray.y, inverse);
}

/// Where the plane is seen `way` pixels from the receiver.
fn position_on(plane: Plane, receiver: Receiver, side: Side, way: f32) -> vec3f {
    // The plane of a texel is not followed to other depths than about its own.
    let inverse = least(most(plane.first + way * plane.change, 0.5 * plane.own), 2.0 * plane.own);
    return position_at(receiver, ray_of(receiver, side, way), inverse);
}

/// Whether a place is within a radius, in the receiver's depth. The sky, at an inverse depth of 0, never is.
fn is_within(position: vec3f, radius: f32) -> bool {
    let reach = radius * position.z;
    return dot(position.xy, position.xy) <= reach * reach;
}

/// The back of a place: farther from the eye by a thickness, in the receiver's depth, and by `slope` of its depth. `away`
/// is the unit vector away from the eye.
fn back_of(position: vec3f, away: vec2f, thickness: f32, slope: f32) -> vec2f {
    return position.xy + away * (thickness * position.z + slope);
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
    return select(most(begin, 0.5 * way), select(begin, least(begin, before.way), behind), plane.faces);
}

/// An angle h from the direction to the eye, 0..pi, and the cosine and sine of its double.
struct Angle {
    angle: f32,
    cosine: f32,
    sine: f32,
}

/// That of a place other than the receiver, y >= 0. Doubles of angles need one division and no square root, and h itself is a polynomial in them:
/// h = pi/4 - c p(s) for an h up to pi/2, c = cos 2h, s = sin 2h, p(s) = acos(s) / (2 sqrt(1 - s^2)); minimax, within 6e-5
/// radians, a two-thousandth of one of 64 sectors.
fn angle_of(position: vec2f) -> Angle {
    let x = position.x * position.x;
    let y = position.y * position.y;
    let inverse = 1.0 / (x + y);
    let cosine = (x - y) * inverse;
    let sine = 2.0 * position.x * position.y * inverse;
    let s = abs(sine);
    // Factors of s^2 apart, so that products do not wait for one another.
    let w = s * s;
    let p = (0.0652049125 * w + 0.3651058225) * w + 0.7853981634 - (0.2174832319 * w + 0.4978230016) * s;
    // From pi/2 to either side.
    let from_middle = cosine * p + 0.25 * PI;
    return Angle(0.5 * PI - select(from_middle, -from_middle, position.x < 0.0), cosine, sine);
}

/// `arc` up to a place on one side, at most to the plane of the surface.
fn arc_to(position: vec2f, slice: Slice, sign: f32) -> f32 {
    let sin_angle = sign * slice.sin_angle;
    let above = position.x * slice.cos_angle + position.y * sin_angle > 0.0;
    return arc(angle_of(select(vec2f(-sin_angle, slice.cos_angle), position, above)), slice.cos_angle, sin_angle);
}
