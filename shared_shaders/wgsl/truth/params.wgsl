// Parameters of the path tracer.
//
// Radiance here is multiplied by params.radiance_scale, a power of two that scales the brightest source to about 1, so
// that its square neither overflows nor vanishes. The Rust twin is renderer/src/truth/.

struct Params {
    world_to_view: mat4x4f,
    view_to_world: mat4x4f,
    tan_half_fov: vec2f,
    width: u32,
    height: u32,
    // First 8 x 8 block of the dispatch and number of blocks, row by row.
    first_block: u32,
    block_count: u32,
    // First sample of the dispatch and number of samples.
    first_sample: u32,
    sample_count: u32,
    seed: u32,
    light_count: u32,
    // Half the diagonal of the scene's bounding box.
    scene_radius: f32,
    radiance_scale: f32,
    // Range of the ambient occlusion; FAR for unlimited.
    occlusion_radius: f32,
    // Number of emitting triangles.
    emitter_count: u32,
    // Density of drawn points over area, for an emission of 1: both in units of the scene's radius.
    emitter_density: f32,
}

@group(0) @binding(0) var<uniform> params: Params;
