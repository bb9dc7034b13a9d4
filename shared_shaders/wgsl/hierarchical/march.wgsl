// A ray through the froxel grid of one level, column by column (2010, section 4). The columns of a level are its
// texels. The slices between the entry into a column and the exit form one mask of bits.
import package::common::froxels::SLICES;

// State of a ray. Fractions run from 0 at the receiver to 1 at the source, along the ray's image.
struct March {
    // Texel of the column, and the step to the next column along x and along y.
    column: vec2i,
    stride: vec2i,
    // Fractions at which it crosses into the next column along x and along y, and the distance between two such
    // crossings.
    crossing: vec2f,
    spacing: vec2f,
    // Inverse depth at fraction 0 and its change up to fraction 1. It is linear along the image of a line.
    inverse: vec2f,
    // Slice of depth 1, and slices per octave.
    slice: vec2f,
    // Slice and fraction at the entry into the column, and fraction of the end.
    entry: i32,
    at: f32,
    end: f32,
}

/// Slice at a fraction of the ray: a whole number inside the grid.
fn slice_at(march: March, fraction: f32) -> i32 {
    let octave = log2(march.inverse.x + fraction * march.inverse.y);
    return i32(clamp(march.slice.x - octave * march.slice.y, 0.0, SLICES - 1.0));
}

/// A ray between two points of the image (texels of the level), from fraction `at` to fraction `end`. Depth is in units
/// of the first point's depth: it is 1 there and `depth` at the other end. `slice` holds the slice of depth 1 and the
/// number of slices per octave.
fn begin_march(origin: vec2f, goal: vec2f, depth: f32, slice: vec2f, at: f32, end: f32) -> March {
    let way = goal - origin;
    // A ray that is constant along an axis never crosses a column boundary of it.
    let spacing = 1.0 / max(abs(way), vec2f(1e-9));
    let start = origin + at * way;
    let column = floor(start);
    // From the origin to the first boundary ahead, along either axis.
    let ahead = select(origin - column, column + 1.0 - origin, way >= vec2f(0.0));
    var march: March;
    march.column = vec2i(column);
    march.stride = select(vec2i(-1), vec2i(1), way >= vec2f(0.0));
    march.crossing = ahead * spacing;
    march.spacing = spacing;
    march.inverse = vec2f(1.0, 1.0 / depth - 1.0);
    march.slice = slice;
    march.at = at;
    march.end = end;
    march.entry = slice_at(march, at);
    return march;
}

/// Fraction of the segment, in space, at which the test begins, seen from one end. This bias keeps the froxels of the
/// end's own surface from blocking. At 1 or above nothing is left to test.
///
/// A froxel that contains a point of the segment can contain a point of the end's plane only if the two are closer than
/// the froxel's width along the plane's normal. Froxels are `column` wide and `slice` deep along the view ray, both per
/// unit of depth. The rays of the two ends (with z = -1) bound those in between. `depth` is that of the end and
/// `other_depth` that of the other one, which lies `height` above the plane, in units of the normal's length.
fn clear_of_plane(
    normal: vec3f,
    ray: vec3f,
    other_ray: vec3f,
    depth: f32,
    other_depth: f32,
    height: f32,
    column: vec2f,
    slice: f32,
) -> f32 {
    let width = dot(abs(normal.xy), column) + slice * max(abs(dot(normal, ray)), abs(dot(normal, other_ray)));
    // Froxels grow along the way to a farther end. If they outgrow the ray's height, the ray never clears the surface.
    let gain = height - width * (other_depth - depth);
    return select(2.0, width * depth / gain, gain > 0.0);
}

/// Fraction along the image of a segment, from a fraction in space. Depth is 1 at the start and `depth` at the end.
fn screen_fraction(fraction: f32, depth: f32) -> f32 {
    return fraction * depth / (1.0 + fraction * (depth - 1.0));
}
