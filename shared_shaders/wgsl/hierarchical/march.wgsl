// A ray through the voxel grid of one level, column by column (2010, section 4). The columns of a level are its
// texels; the slices between where the ray enters a column and where it leaves are one mask of bits.
import package::common::froxels::SLICES;

// Where a ray is. Its places run from 0 at the receiver to 1 at the source, along its image.
struct March {
    // Texel of the column, and what the next column along x and along y adds to it.
    column: vec2i,
    stride: vec2i,
    // Places where it crosses into the next column along x and along y, and between two such places.
    crossing: vec2f,
    spacing: vec2f,
    // Inverse of the depth at place 0 and its growth up to place 1: along the image of a line it is linear.
    inverse: vec2f,
    // Slice of depth 1, and slices in an octave.
    slice: vec2f,
    // Slice where it entered the column, place where it did, place where it ends.
    entry: i32,
    at: f32,
    end: f32,
}

/// Slice at a place of the ray; whole, and inside the grid.
fn slice_at(march: March, fraction: f32) -> i32 {
    let octave = log2(march.inverse.x + fraction * march.inverse.y);
    return i32(clamp(march.slice.x - octave * march.slice.y, 0.0, SLICES - 1.0));
}

/// A ray between two points of the image (texels of the level; depth is counted in the first one's, so it is 1 there
/// and `depth` at the other end), from place `at` to place `end`. `slice` is the slice of depth 1 and the number of slices in an octave.
fn begin_march(origin: vec2f, goal: vec2f, depth: f32, slice: vec2f, at: f32, end: f32) -> March {
    let way = goal - origin;
    // A ray that does not move along an axis never crosses a border of it.
    let spacing = 1.0 / max(abs(way), vec2f(1e-9));
    let start = origin + at * way;
    let column = floor(start);
    // From the origin to the first border ahead, along either axis.
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

/// What is tested of the segment between two surfaces begins this far from one end, as a fraction of the way in space:
/// the end is biased so that its own surface's voxels do not block. At 1 or above nothing is left to test.
///
/// A voxel that holds a point of the segment can hold a point of the end's plane only where the two are closer than the
/// voxel is wide along the plane's normal. Voxels are `column` wide and `slice` deep along the view ray, both for each
/// unit of depth; the two ends' rays (with z = -1) bound those between. `depth` is the end's, `other_depth` the other
/// one's, which lies `height` above the plane, in units of the normal's length.
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
    // Voxels grow along the way to a farther end; where they outgrow the ray's height it is never clear.
    let gain = height - width * (other_depth - depth);
    return select(2.0, width * depth / gain, gain > 0.0);
}

/// Place along the image of a segment, from a fraction of the way in space; depth is 1 where it begins and `depth`
/// where it ends.
fn screen_fraction(fraction: f32, depth: f32) -> f32 {
    return fraction * depth / (1.0 + fraction * (depth - 1.0));
}
