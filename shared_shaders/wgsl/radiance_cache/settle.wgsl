// Gives a position to the records that hits refer to: that of one of this frame's hits.
import package::common::math::octahedral_encode;
import package::radiance_cache::cells::{BUCKET, NO_SLOT, buckets, records};
import package::radiance_cache::counters::{counters, stride_of};
import package::radiance_cache::links::{normal_of, rays, source_of, unpack_position};

@compute @workgroup_size(64)
fn settle(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) workgroups: vec3u) {
    let count = min(atomicLoad(&counters.rays), arrayLength(&rays));
    for (var number = id.x; number < count; number += stride_of(workgroups)) {
        let source = source_of(rays[number].link);
        if source != NO_SLOT && atomicLoad(&buckets[source / BUCKET].cells[source % BUCKET].hit) == rays[number].random {
            records[source].position = unpack_position(rays[number].link.position);
            records[source].normal = pack2x16snorm(octahedral_encode(normal_of(rays[number].link.surface)));
        }
    }
}
