// The light of the records, in layers: one for each number of bounces, or a single one for all bounces. A frame computes the
// next light of its records from that of the last frame, and then replaces it.
import package::radiance_cache::counters::counters;

// Mean incident light of each record and, in w, the number of its rays: first the layers, then the next light of each layer.
@group(0) @binding(15) var<storage, read_write> totals: array<vec4f>;

/// Number of layers.
fn layers() -> u32 {
    return arrayLength(&totals) / (2u * counters.slots);
}

/// Entry of slot 0 in a layer.
fn layer_of(layer: u32) -> u32 {
    return layer * counters.slots;
}

/// Entry of slot 0 in the next light of a layer.
fn next_layer_of(layer: u32) -> u32 {
    return (layers() + layer) * counters.slots;
}

/// Entry of slot 0 in the layer that is shown.
fn shown() -> u32 {
    return layer_of(layers() - 1u);
}
