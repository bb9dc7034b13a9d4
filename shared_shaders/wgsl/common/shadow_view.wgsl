// The view of one shadow map layer. Twin of `ShadowView` in renderer/src/scene/shadow_views.rs.
struct ShadowView {
    world_to_clip: mat4x4f,
    // Width of the whole map: scene units (directional), otherwise per unit of distance along the map's axis. The
    // geometric mean of width and height.
    width: f32,
    // Index of the light, and of the layer.
    light: u32,
    index: u32,
}
