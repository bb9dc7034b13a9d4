// The table of records. A record stands for the surfaces with similar normals in one cell of a grid in world space. The
// width of a cell is the unit of the grid times a power of two, so that eight cells of a level fill one of the next.
//
// The table is divided into buckets of eight slots. A cell belongs to one bucket, by a hash, or to a second one if the first
// one is full. A third hash is its fingerprint there: two cells of a bucket have the same fingerprint with a probability of
// 2^-32. Where both buckets are full, a cell has no record, and its light comes from a coarser level.
import package::common::math::pcg3d;
import package::common::view::View;

/// Eight slots. The fingerprints are next to each other, so that a search reads two vectors: see lookup.wgsl.
struct Bucket {
    // Fingerprints; 0 for an empty slot.
    fingerprints: array<atomic<u32>, BUCKET>,
    cells: array<Cell, BUCKET>,
}

struct Cell {
    // The square of pixels that stands for the cell in this frame, plus one, below 8 random bits; 0 where no pixel that
    // was looked at is inside.
    pixel: atomic<u32>,
    // The hit that stands for the cell in this frame: its random word; 0 where none is inside.
    hit: atomic<u32>,
    // Stamp of the last frame in which a pixel or a link referred to the cell.
    seen: atomic<u32>,
    // Stamp of the last frame in which a finer cell inside was seen.
    parent: atomic<u32>,
    // Rays of this frame: the first one in the lower 24 bits, their number in the upper 8 bits.
    rays: atomic<u32>,
    // Stamp of the last frame in which a pixel was inside, times the number of levels, plus the number of coarser levels
    // that were then looked for.
    mark: atomic<u32>,
}

/// Position of a cell: the grid's coordinates, and level and bin of normals.
struct Place {
    coordinates: vec3i,
    // Level plus LEVEL_BIAS in the upper bits, bin of normals in the lower 8 bits.
    level_and_bin: u32,
}

/// What is known about a cell.
struct Record {
    coordinates: vec3i,
    level_and_bin: u32,
    // A point of a surface inside, world space, and its normal, octahedral.
    position: vec3f,
    normal: u32,
    // Mean incident light of lamps that surfaces reflect: irradiance over pi.
    reflected: vec3f,
    // Rays in that mean.
    samples: f32,
    // Mean incident light of the sky and of emitters. It does not depend on lamps.
    own: vec3f,
    // Number of links so far. The newest ones are kept.
    links: u32,
}

/// Sizes of cells.
struct Grid {
    // Width of cells of level 0, scene units.
    unit: f32,
    // Width of a cell on the screen, full-resolution pixels.
    spacing: f32,
    // Rays of a record at which it counts as much as the coarser ones around it.
    trusted: f32,
    // Lowest level of the records that only hits refer to.
    level_of_hits: i32,
    // Lower corner of the scene, and the longest side of its box.
    low: vec3f,
    size: f32,
}

@group(0) @binding(9) var<uniform> grid: Grid;
@group(0) @binding(10) var<storage, read_write> buckets: array<Bucket>;
@group(0) @binding(11) var<storage, read_write> records: array<Record>;

const BUCKET: u32 = 8u;
const NO_SLOT: u32 = 0xffffffffu;
/// Coarser levels that collect the light of the records in the picture. The number of runs of collect.wgsl follows from it.
const COARSER_LEVELS: u32 = 3u;
/// Bit of bins for records that only hits refer to.
const HITS: u32 = 128u;
const LEVEL_BIAS: i32 = 128;
/// Frames after which a record that nothing refers to is removed.
const LIFETIME: u32 = 64u;

/// Bin of a normal: one of the 6 faces of a cube, divided into 3 x 3. Normals along the axes are at the centres of bins.
fn normal_bin(normal: vec3f) -> u32 {
    let a = abs(normal);
    var axis = 2u;
    var across = normal.xy;
    var along = normal.z;
    if a.x >= a.y && a.x >= a.z {
        axis = 0u;
        across = normal.yz;
        along = normal.x;
    } else if a.y >= a.z {
        axis = 1u;
        across = normal.zx;
        along = normal.y;
    }
    let part = vec2u(clamp(across / max(abs(along), 1e-6) * 1.5 + 1.5, vec2f(0.0), vec2f(2.0)));
    return (axis * 2u + select(0u, 1u, along < 0.0)) * 9u + part.x * 3u + part.y;
}

/// Level of the cells that are about `grid.spacing` pixels wide at this distance.
fn level_at(distance: f32, view: View) -> i32 {
    let width = grid.spacing * 2.0 * view.tan_half_fov.y * distance / view.display_size.y;
    return i32(clamp(round(log2(max(width, 1e-37) / grid.unit)), -100.0, 100.0));
}

/// Width of the cells of hits, relative to those of pixels at the same distance.
const COARSER: f32 = 4.0;

/// Level of the records that only hits refer to.
fn level_of_hits_at(distance: f32, view: View) -> i32 {
    return max(level_at(COARSER * distance, view), grid.level_of_hits);
}

fn cell_width(level: i32) -> f32 {
    return grid.unit * exp2(f32(level));
}

/// Shift of the grid, in units of it, so that planes through the origin lie inside of cells.
const SHIFT: vec3f = vec3f(0.371, 0.293, 0.437);

/// Thickness of a cell along the normal of its bin, relative to its width: parallel surfaces that are close to each other
/// have records of their own.
const FLATNESS: f32 = 2.0;

/// The normal at the centre of a bin, scaled so that its largest component is 1, times the sign of that component.
fn slope_of(bin: u32) -> vec3f {
    let part = (vec2f(vec2u(bin % 9u / 3u, bin % 3u)) - 1.0) * (2.0 / 3.0) * select(1.0, -1.0, bin % 18u >= 9u);
    let axis = bin / 18u;
    return select(select(vec3f(part, 1.0), vec3f(part.y, 1.0, part.x), axis == 1u), vec3f(1.0, part), axis == 0u);
}

/// The axis of a bin.
fn axis_of(bin: u32) -> vec3f {
    return select(vec3f(0.0), vec3f(1.0), vec3u(0u, 1u, 2u) == vec3u(bin / 18u));
}

/// The cell of a surface. The coordinate along the axis of its bin counts layers parallel to the bin's planes.
fn place_of(position: vec3f, normal: vec3f, level: i32) -> Place {
    let shifted = position + SHIFT * grid.unit;
    let bin = normal_bin(normal);
    let axis = axis_of(bin);
    let sheared = mix(shifted, vec3f(dot(shifted, slope_of(bin)) * FLATNESS), axis);
    let coordinates = clamp(floor(sheared / cell_width(level)), vec3f(-1e9), vec3f(1e9));
    return Place(vec3i(coordinates), (u32(level + LEVEL_BIAS) << 8u) | bin);
}

/// Centre of a cell.
fn centre_of(place: Place) -> vec3f {
    let sheared = (vec3f(place.coordinates) + 0.5) * cell_width(level_of(place.level_and_bin));
    var shifted = sheared;
    if (place.level_and_bin & HITS) == 0u {
        let axis = axis_of(place.level_and_bin & 255u);
        let across = sheared * (1.0 - axis);
        shifted = across + axis * (dot(sheared, axis) / FLATNESS - dot(across, slope_of(place.level_and_bin & 255u)));
    }
    return shifted - SHIFT * grid.unit;
}

/// The cell of a hit. Its record stands for all normals that point to one face of a cube, and traces its own rays: what the
/// camera sees of a cell is not what rays find there.
fn place_of_hit(position: vec3f, normal: vec3f, level: i32) -> Place {
    let shifted = position + SHIFT * grid.unit;
    let coordinates = clamp(floor(shifted / cell_width(level)), vec3f(-1e9), vec3f(1e9));
    return Place(vec3i(coordinates), (u32(level + LEVEL_BIAS) << 8u) | HITS | (normal_bin(normal) / 9u));
}

/// The cell of a record.
fn place_of_slot(slot: u32) -> Place {
    return Place(records[slot].coordinates, records[slot].level_and_bin);
}

fn level_of(level_and_bin: u32) -> i32 {
    return i32(level_and_bin >> 8u) - LEVEL_BIAS;
}

/// The cell of the next level that contains this one.
fn parent_of(place: Place) -> Place {
    return Place(place.coordinates >> vec3u(1u), place.level_and_bin + 256u);
}

/// Three random words of a cell. The first two are its position in the table.
fn hash_of(place: Place) -> vec3u {
    return pcg3d(pcg3d(bitcast<vec3u>(place.coordinates)) ^ vec3u(place.level_and_bin));
}

/// The two buckets of a cell in a table of `count` buckets.
fn buckets_of(hash: vec3u, count: u32) -> vec2u {
    return hash.xz % count;
}

fn fingerprint_of(hash: vec3u) -> u32 {
    return max(hash.y, 1u);
}

/// Number of slots.
fn slots() -> u32 {
    return arrayLength(&buckets) * BUCKET;
}

/// Whether a slot has a record.
fn is_taken(slot: u32) -> bool {
    return atomicLoad(&buckets[slot / BUCKET].fingerprints[slot % BUCKET]) != 0u;
}

/// The slot of a fingerprint in a bucket, which it gets if it has none yet and a slot is empty; otherwise NO_SLOT.
fn take_slot(bucket: u32, fingerprint: u32, place: Place) -> u32 {
    for (var i = 0u; i < BUCKET; i++) {
        let slot = bucket * BUCKET + i;
        var before = atomicLoad(&buckets[bucket].fingerprints[i]);
        // The exchange may fail without a cause.
        while before == 0u {
            let result = atomicCompareExchangeWeak(&buckets[bucket].fingerprints[i], 0u, fingerprint);
            if result.exchanged {
                var record = Record();
                record.coordinates = place.coordinates;
                record.level_and_bin = place.level_and_bin;
                records[slot] = record;
                return slot;
            }
            before = result.old_value;
        }
        if before == fingerprint {
            return slot;
        }
    }
    return NO_SLOT;
}

/// The slot of a cell, which it gets if it has none yet; NO_SLOT if both its buckets are full.
fn find_or_insert(place: Place) -> u32 {
    let hash = hash_of(place);
    let both = buckets_of(hash, arrayLength(&buckets));
    let fingerprint = fingerprint_of(hash);
    // A cell may be in its second bucket although a slot of the first one has become empty since.
    for (var i = 0u; i < 2u * BUCKET; i++) {
        let bucket = select(both.x, both.y, i >= BUCKET);
        if atomicLoad(&buckets[bucket].fingerprints[i % BUCKET]) == fingerprint {
            return bucket * BUCKET + i % BUCKET;
        }
    }
    // Slots are only taken in this pass. Once the first bucket is full, it stays so for all invocations.
    let slot = take_slot(both.x, fingerprint, place);
    if slot != NO_SLOT {
        return slot;
    }
    return take_slot(both.y, fingerprint, place);
}
