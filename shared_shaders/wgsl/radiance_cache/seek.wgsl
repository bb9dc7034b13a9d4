// Finds or makes the records of what the camera sees: one pixel of every square of 4 x 4 is looked at in each frame.
import package::common::math::random_words;
import package::common::streams::CACHE_SQUARE_STREAM;
import package::common::view::{View, SKY_DEPTH};
import package::radiance_cache::cells::{
    BUCKET, COARSER_LEVELS, NO_SLOT, buckets, find_or_insert, level_at, parent_of, place_of,
};
import package::radiance_cache::counters::stamp;
import package::radiance_cache::pixels::surface_of_pixel;
import package::radiance_cache::squares::{SQUARE, pixel_of_square, squares_across};

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(2) var depth: texture_2d<f32>;
@group(0) @binding(3) var normal: texture_2d<f32>;

@compute @workgroup_size(8, 8)
fn seek(@builtin(global_invocation_id) id: vec3u) {
    let size = textureDimensions(depth);
    if any(id.xy * SQUARE >= size) {
        return;
    }
    let pixel = pixel_of_square(id.xy, size, view);
    let d = textureLoad(depth, pixel, 0).x;
    if d <= SKY_DEPTH {
        return;
    }
    let surface = surface_of_pixel(pixel, d, textureLoad(normal, pixel, 0).xyz, view);
    var place = place_of(surface.position, surface.normal, level_at(d, view));
    var slot = find_or_insert(place);
    if slot != NO_SLOT {
        // One of the squares whose pixels are inside is chosen at random. The pixel follows from the square.
        let random = random_words(id.xy, view.frame, CACHE_SQUARE_STREAM, view.seed).z;
        let number = id.y * squares_across(size.x) + id.x + 1u;
        atomicMax(&buckets[slot / BUCKET].cells[slot % BUCKET].pixel, (random & 0xff000000u) | (number & 0xffffffu));
    }
    // Coarser levels collect the light of the finer ones.
    for (var i = 0u; i <= COARSER_LEVELS; i++) {
        if slot != NO_SLOT {
            // Another pixel may have come here before, from the same level or from a coarser one.
            let mark = stamp() * (COARSER_LEVELS + 1u) + COARSER_LEVELS - i;
            if atomicMax(&buckets[slot / BUCKET].cells[slot % BUCKET].mark, mark) >= mark {
                return;
            }
            atomicMax(&buckets[slot / BUCKET].cells[slot % BUCKET].seen, stamp());
        }
        if i < COARSER_LEVELS {
            place = parent_of(place);
            slot = find_or_insert(place);
            if slot != NO_SLOT {
                atomicStore(&buckets[slot / BUCKET].cells[slot % BUCKET].parent, stamp());
            }
        }
    }
}
