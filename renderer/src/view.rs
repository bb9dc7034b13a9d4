//! Views: a camera at one frame, as shaders see it.

use glam::Mat4;
use halflight_scenes::Camera;
use halflight_shared_shaders::Member;

use crate::uniform;

/// A camera, the size of its image and the number of the frame. Twin of `View` in `common/view.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// World to view space: right-handed, +y up, looking along -z.
    pub world_to_view: Mat4,
    /// Tangents of half the field of view, (horizontal, vertical).
    pub tan_half_fov: [f32; 2],
    /// Full-resolution pixels.
    pub display_size: [u32; 2],
    /// Distance of the near plane, scene units; only rasterising passes use it.
    pub near: f32,
    /// Number of the frame: it turns the random numbers.
    pub frame: u32,
    /// The user's seed.
    pub seed: u32,
}

impl View {
    /// The first frame of a camera. `near` is in scene units.
    pub fn new(camera: &Camera, display_size: [u32; 2], near: f32) -> Self {
        let [width, height] = display_size;
        Self {
            world_to_view: camera.view_matrix(),
            tan_half_fov: camera.tan_half_fov(width, height),
            display_size,
            near,
            frame: 0,
            seed: 0,
        }
    }

    /// The uniform block `view` in this layout.
    pub(crate) fn pack(&self, size: u32, members: &[Member]) -> Vec<u8> {
        let values = [
            ("world_to_view", self.world_to_view.into()),
            ("view_to_world", self.world_to_view.inverse().into()),
            ("tan_half_fov", self.tan_half_fov.into()),
            ("display_size", self.display_size.map(|v| v as f32).into()),
            ("near", self.near.into()),
            ("frame", self.frame.into()),
            ("seed", self.seed.into()),
        ];
        uniform::pack(size, members, &values, "view")
    }
}
