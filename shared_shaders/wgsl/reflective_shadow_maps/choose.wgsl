// Chooses virtual point lights among all lit surfaces in proportion to their importance: equidistant samples of the
// running sum of importances (systematic sampling). One workgroup. The light of a chosen surface is divided by its
// expected number of samples.
import package::common::math::random3;
import package::common::streams::CHOICE_STREAM;
import package::common::view::View;
import package::reflective_shadow_maps::light_surface::{LightSurface, unpack_light};

struct Params {
    // Number of surfaces of all maps, and number to choose.
    surfaces: u32,
    chosen: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var<storage, read> importances: array<f32>;
@group(0) @binding(3) var<storage, read> positions: array<vec4f>;
@group(0) @binding(4) var<storage, read> lights: array<vec4u>;
// Unpacked, because every receiver reads them.
@group(0) @binding(5) var<storage, read_write> virtual_point_lights: array<LightSurface>;

const THREADS: u32 = 256u;
var<workgroup> sums: array<f32, THREADS>;

/// The surface of this index, standing for `factor` surfaces.
fn standing_for(index: u32, factor: f32) -> LightSurface {
    var surface = unpack_light(positions[index].xyz, lights[index]);
    surface.factor = factor;
    return surface;
}

@compute @workgroup_size(THREADS)
fn choose(@builtin(local_invocation_index) thread: u32) {
    let share = (params.surfaces + THREADS - 1u) / THREADS;
    let first = min(thread * share, params.surfaces);
    let end = min(first + share, params.surfaces);
    var own = 0.0;
    for (var i = first; i < end; i++) {
        own += importances[i];
    }
    sums[thread] = own;
    workgroupBarrier();
    var before = 0.0;
    var total = 0.0;
    for (var i = 0u; i < THREADS; i++) {
        before += select(0.0, sums[i], i < thread);
        total += sums[i];
    }
    let stride = total / f32(params.chosen);
    let start = random3(vec2u(0u), view.frame, CHOICE_STREAM, view.seed).x;
    if !(stride > 0.0) {
        // Nothing is lit.
        for (var k = thread; k < params.chosen; k += THREADS) {
            virtual_point_lights[k] = standing_for(0u, 0.0);
        }
        return;
    }
    // Sample k is at (k + start) strides. A thread handles the samples in its part of the sum. Rounding can neither
    // skip a sample nor write one twice, because neighbouring parts share the same boundary values.
    var k = u32(max(ceil(before / stride - start), 0.0));
    var sum = before;
    let own_end = select(u32(max(ceil((before + own) / stride - start), 0.0)), params.chosen, thread == THREADS - 1u);
    var last = first;
    for (var i = first; i < end; i++) {
        let importance = importances[i];
        sum += importance;
        if importance > 0.0 {
            last = i;
        }
        while k < min(own_end, params.chosen) && (f32(k) + start) * stride < sum && importance > 0.0 {
            virtual_point_lights[k] = standing_for(i, stride / importance);
            k++;
        }
    }
    // Samples that rounding left over take the last lit surface of this part.
    while k < min(own_end, params.chosen) {
        virtual_point_lights[k] = standing_for(last, select(0.0, stride / importances[last], own > 0.0));
        k++;
    }
}
