// The frame before, as a pass sees it that reuses what that frame left.

struct PreviousView {
    // View space of this frame to view space of the frame before, for points that stand still.
    view_to_previous: mat4x4f,
    tan_half_fov: vec2f,
    // Whether the frame before may be used at all: 0 in the first frame and after a cut.
    valid: u32,
    // Frames since anything changed: camera, scene, light or settings.
    static_frames: u32,
}
