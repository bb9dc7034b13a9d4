//! A camera at one frame, as shaders read it.

use glam::{DMat4, Mat4, Vec3};
use halflight_shared_shaders::Member;

use crate::{plan::PlannedView, uniform};

/// A camera, the size of its image and the number of the frame. Twin of `View` in `common/view.wgsl`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// World to view space: right-handed, +y up, looking along -z.
    pub world_to_view: Mat4,
    /// Tangents of half the field of view, (horizontal, vertical).
    pub tan_half_fov: [f32; 2],
    /// Full-resolution pixels.
    pub display_size: [u32; 2],
    /// Distance of the near plane, scene units. Raster passes use it, and it scales the test for teleports.
    pub near: f32,
    /// Frame number. It seeds the random numbers. History is valid only if the previous frame has the preceding number.
    pub frame: u32,
    /// The user's seed of random numbers.
    pub seed: u32,
    /// Which history this frame may use.
    pub continuity: Continuity,
}

/// Which history a frame may use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Continuity {
    /// None: another scene, or a cut to another camera.
    Cut,
    /// History may be reprojected: objects, camera or light may have changed.
    #[default]
    Changing,
    /// Scene and light are unchanged. If the camera is static too, pixels may average without limit.
    Static,
}

/// Largest motion of the camera in one frame, in near-plane distances. The near plane is at 1e-6 of the diagonal of
/// what is looked at. A camera that moves more than a twentieth of the diagonal per frame crosses that in a third of a
/// second, which nobody could follow.
const TELEPORT_NEAR_PLANES: f32 = 5e4;

impl View {
    /// The first frame of this camera. `near` is in scene units.
    pub fn new(world_to_view: Mat4, tan_half_fov: [f32; 2], display_size: [u32; 2], near: f32) -> Self {
        Self { world_to_view, tan_half_fov, display_size, near, frame: 0, seed: 0, continuity: Continuity::Changing }
    }

    /// The view of a static camera of the plan in the same frame.
    pub(crate) fn of_planned(&self, view: &PlannedView) -> Self {
        Self { world_to_view: view.world_to_view, tan_half_fov: view.tan_half_fov, ..*self }
    }

    /// Whether this view may use the history of a frame seen from `before`: it is the next frame of the same image, and
    /// neither a cut nor a teleport (a motion of more than a twentieth of what is looked at, or a rotation of more than
    /// half the field of view).
    pub fn continues(&self, before: &View) -> bool {
        let place = |view: &View| {
            let to_world = view.world_to_view.inverse();
            (to_world.transform_point3(Vec3::ZERO), to_world.transform_vector3(Vec3::NEG_Z))
        };
        let ((eye, axis), (eye_before, axis_before)) = (place(self), place(before));
        let half_fov = self.tan_half_fov[0].max(self.tan_half_fov[1]).atan();
        self.continuity != Continuity::Cut
            && self.frame == before.frame.wrapping_add(1)
            && (self.seed, self.display_size) == (before.seed, before.display_size)
            && eye.distance(eye_before) <= TELEPORT_NEAR_PLANES * self.near
            && axis.dot(axis_before) >= half_fov.cos()
    }

    /// Whether nothing changed since a frame seen from `before`.
    pub(crate) fn is_static_since(&self, before: &View) -> bool {
        self.continuity == Continuity::Static
            && self.world_to_view == before.world_to_view
            && self.tan_half_fov == before.tan_half_fov
    }

    /// View space of this frame to view space of the frame seen from `before`, for points of an object with the matrix
    /// `now` and the previous matrix `then`. Exactly the identity if nothing moved.
    pub fn way_back(&self, before: &View, now: &Mat4, then: &Mat4) -> Mat4 {
        if self.world_to_view == before.world_to_view && now == then {
            return Mat4::IDENTITY;
        }
        // In double precision, because far from the origin two large translations cancel here.
        let [view, view_before, now, then] = [self.world_to_view, before.world_to_view, *now, *then].map(double);
        (view_before * then * (view * now).inverse()).as_mat4()
    }

    /// The uniform block `previous` in this layout, for a frame after `before`; `None` if there is no valid previous
    /// frame.
    pub(crate) fn pack_previous(
        &self,
        before: Option<&View>,
        static_frames: u32,
        size: u32,
        members: &[Member],
    ) -> Vec<u8> {
        let from = before.unwrap_or(self);
        let values = [
            ("view_to_previous", self.way_back(from, &Mat4::IDENTITY, &Mat4::IDENTITY).to_cols_array_2d().into()),
            ("tan_half_fov", from.tan_half_fov.into()),
            ("valid", u32::from(before.is_some()).into()),
            ("static_frames", static_frames.into()),
        ];
        uniform::pack(size, members, &values, "previous")
    }

    /// The uniform block `view` in this layout.
    pub(crate) fn pack(&self, size: u32, members: &[Member]) -> Vec<u8> {
        let values = [
            ("world_to_view", self.world_to_view.to_cols_array_2d().into()),
            ("view_to_world", self.world_to_view.inverse().to_cols_array_2d().into()),
            ("tan_half_fov", self.tan_half_fov.into()),
            ("display_size", self.display_size.map(|v| v as f32).into()),
            ("near", self.near.into()),
            ("frame", self.frame.into()),
            ("seed", self.seed.into()),
        ];
        uniform::pack(size, members, &values, "view")
    }
}

fn double(matrix: Mat4) -> DMat4 {
    matrix.as_dmat4()
}
