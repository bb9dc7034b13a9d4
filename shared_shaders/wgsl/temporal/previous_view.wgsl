// The previous frame, for passes that reproject it.

struct PreviousView {
    // View space of this frame to view space of the previous frame, for static points.
    view_to_previous: mat4x4f,
    tan_half_fov: vec2f,
    // Whether the previous frame may be used: 0 in the first frame and after a cut.
    valid: u32,
    // Number of frames since anything changed: camera, scene, light or settings.
    static_frames: u32,
}
