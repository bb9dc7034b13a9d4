// What a light looks at: one layer of its shadow map. Twin of `ShadowView` in renderer/src/scene/light_views.rs.
struct ShadowView {
    world_to_clip: mat4x4f,
    // Width that the whole map covers: scene units (directional), or for each unit of distance along the map's axis.
    width: f32,
    // Index of the light.
    light: u32,
}
