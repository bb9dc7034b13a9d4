//! The view of each shadow map layer.

use glam::{Mat4, Vec3, camera::rh::view::look_to_mat4};
use halflight_scenes::{Light, Scene};

use crate::scene::buffers::shadow_faces;

/// One layer of the shadow maps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowLayer {
    /// World to reversed-Z clip space.
    pub world_to_clip: Mat4,
    /// Width of the whole map: scene units for a directional light, otherwise per unit of distance.
    pub width: f32,
    /// Index of the light.
    pub light: u32,
}

/// Bounding box of everything that may cast a shadow, over all frames: its corners.
pub(crate) fn shadow_bounds(scene: &Scene) -> (Vec3, Vec3) {
    scene.swept_bounds().unwrap_or((Vec3::NEG_ONE, Vec3::ONE))
}

/// The layers of these lights, in their order, around a scene with these bounds.
pub(crate) fn shadow_layers(lights: &[Light], (low, high): (Vec3, Vec3)) -> Vec<ShadowLayer> {
    let diagonal = (high - low).length().max(f32::MIN_POSITIVE);
    let looks_at = |light: &Light| match *light {
        Light::Directional { direction, .. } => vec![directional(direction.into(), low, high, diagonal)],
        Light::Spot { position, direction, half_angle_degrees, .. } if shadow_faces(light) == 1 => {
            let axis = Vec3::from(direction).normalize_or(Vec3::NEG_Y);
            vec![perspective(position.into(), axis, half_angle_degrees.to_radians().tan(), diagonal)]
        }
        Light::Spot { position, .. } | Light::Point { position, .. } => {
            // The order of faces is that of `cube_face` in direct_light.wgsl. Faces are slightly wider than a right
            // angle, so that the filter finds depth beyond the seams.
            [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z]
                .map(|axis| perspective(position.into(), axis, 1.01, diagonal))
                .to_vec()
        }
    };
    let numbered = |(index, light): (usize, &Light)| {
        looks_at(light).into_iter().map(move |layer| ShadowLayer { light: index as u32, ..layer })
    };
    lights.iter().enumerate().flat_map(numbered).collect()
}

/// An orthographic map around the whole scene.
fn directional(direction: Vec3, low: Vec3, high: Vec3, diagonal: f32) -> ShadowLayer {
    let axis = direction.normalize_or(Vec3::NEG_Y);
    let view = look_to_mat4(Vec3::ZERO, axis, axis.any_orthonormal_vector());
    let corners = (0..8u32).map(|i| {
        let pick = |bit: u32, low: f32, high: f32| if i >> bit & 1 == 0 { low } else { high };
        view.transform_point3(Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z)))
    });
    let (near, far) = corners.fold((Vec3::MAX, Vec3::MIN), |(a, b), p| (a.min(p), b.max(p)));
    // The map is square. The margin keeps the outermost walls inside the filter's footprint.
    let centre = (near + far) / 2.0;
    let half = ((far - near).x.max((far - near).y) / 2.0 + diagonal * 0.01).max(f32::MIN_POSITIVE);
    // z increases towards the light in this space. Depth is 1 at the light's side.
    let (back, front) = (near.z - diagonal * 0.01, far.z + diagonal * 0.01);
    let clip = Mat4::from_cols_array_2d(&[
        [1.0 / half, 0.0, 0.0, 0.0],
        [0.0, 1.0 / half, 0.0, 0.0],
        [0.0, 0.0, 1.0 / (front - back), 0.0],
        [-centre.x / half, -centre.y / half, -back / (front - back), 1.0],
    ]);
    ShadowLayer { world_to_clip: clip * view, width: 2.0 * half, light: 0 }
}

/// A square perspective map along an axis.
fn perspective(position: Vec3, axis: Vec3, tangent: f32, diagonal: f32) -> ShadowLayer {
    let view = look_to_mat4(position, axis, axis.any_orthonormal_vector());
    let near = diagonal * 1e-4;
    let clip = Mat4::from_cols_array_2d(&[
        [1.0 / tangent, 0.0, 0.0, 0.0],
        [0.0, 1.0 / tangent, 0.0, 0.0],
        [0.0, 0.0, 0.0, -1.0],
        [0.0, 0.0, near, 0.0],
    ]);
    ShadowLayer { world_to_clip: clip * view, width: 2.0 * tangent, light: 0 }
}
