// A few of all lit surfaces, each as often as it is important: stands of equal width along the running sum of
// importances (systematic sampling). One workgroup; what a chosen surface sends is divided by how often it is chosen.
import package::common::math::random3;
import package::common::view::View;
import package::light_views::light_surface::with_factor;

struct Params {
    // Surfaces of all light views, and how many to choose.
    surfaces: u32,
    chosen: u32,
}

@group(0) @binding(0) var<uniform> view: View;
@group(0) @binding(1) var<uniform> params: Params;
@group(0) @binding(2) var<storage, read> importances: array<f32>;
@group(0) @binding(3) var<storage, read> places: array<vec4f>;
@group(0) @binding(4) var<storage, read> lights: array<vec4u>;
@group(0) @binding(5) var<storage, read_write> virtual_places: array<vec4f>;
// `pack_light`, with how much more of it there is than one surface.
@group(0) @binding(6) var<storage, read_write> virtual_lights: array<vec4u>;

const THREADS: u32 = 256u;
var<workgroup> sums: array<f32, THREADS>;

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
    let start = random3(vec2u(0u), view.frame, 2049u, view.seed).x;
    if !(stride > 0.0) {
        // Nothing is lit.
        for (var k = thread; k < params.chosen; k += THREADS) {
            virtual_places[k] = vec4f(0.0);
            virtual_lights[k] = vec4u(0u);
        }
        return;
    }
    // The stand k lies at (k + start) strides; those in this thread's part of the sum are its own. Rounding can neither
    // skip one nor write one twice: the parts' borders are the same numbers for both neighbours.
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
            virtual_places[k] = places[i];
            virtual_lights[k] = with_factor(lights[i], stride / importance);
            k++;
        }
    }
    // What rounding left over goes to the last lit surface of this part.
    while k < min(own_end, params.chosen) {
        virtual_places[k] = select(vec4f(0.0), places[last], own > 0.0);
        virtual_lights[k] = with_factor(lights[last], select(0.0, stride / importances[last], own > 0.0));
        k++;
    }
}
