//! The view of each shadow map layer.

use bytemuck::Zeroable;
use glam::{Mat4, Vec3, camera::rh::view::look_to_mat4};
use halflight_scenes::{Light, Scene};

use super::{
    bounds::{Bounds, diagonal},
    buffers::GpuLight,
    casters::depth_range,
    focus::Extent,
};
use crate::scene::buffers::{lights as on_device, shadow_faces};

/// One layer of the shadow maps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowLayer {
    /// World to reversed-Z clip space.
    pub world_to_clip: Mat4,
    /// Width of the whole map: scene units for a directional light, otherwise per unit of distance. The geometric mean
    /// of width and height, which differ for a directional light.
    pub width: f32,
    /// Depth range of the map of a directional light, scene units; `None` for others, whose depth is not linear.
    pub depth: Option<f32>,
    /// Index of the light.
    pub light: u32,
    /// The light.
    pub(crate) source: GpuLight,
}

/// Depth is extended by this share of a box's diagonal on both sides, and the map by as much. The margin keeps the
/// outermost walls inside the filter's footprint.
const MARGIN: f32 = 0.01;

/// The layers of these lights, in their order: one for a directional light or a narrow spot light, otherwise six. Those
/// of directional lights show what is looked at.
pub(crate) fn shadow_layers(lights: &[Light], extent: &Extent, scene: &Scene) -> Vec<ShadowLayer> {
    let near = extent.near();
    let looks_at = |light: &Light| match *light {
        Light::Directional { direction, .. } if extent.is_part() => {
            vec![directional_part(direction.into(), extent.focus, scene)]
        }
        Light::Directional { direction, .. } => vec![directional(direction.into(), extent.scene)],
        Light::Spot { position, direction, half_angle_degrees, .. } if shadow_faces(light) == 1 => {
            let axis = Vec3::from(direction).normalize_or(Vec3::NEG_Y);
            vec![perspective(position.into(), axis, half_angle_degrees.to_radians().tan(), near)]
        }
        Light::Spot { position, .. } | Light::Point { position, .. } => {
            // The order of faces is that of `cube_face` in direct_light.wgsl. Faces are slightly wider than a right
            // angle, so that the filter finds depth beyond the seams.
            [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z]
                .map(|axis| perspective(position.into(), axis, 1.01, near))
                .to_vec()
        }
    };
    numbered(lights, looks_at)
}

/// Coarser layers of directional lights around what is looked at, from fine to coarse for each light; empty if that is
/// the whole scene.
pub(crate) fn far_shadow_layers(lights: &[Light], extent: &Extent, scene: &Scene) -> Vec<ShadowLayer> {
    let boxes = extent.around();
    numbered(lights, |light| match *light {
        Light::Directional { direction, .. } => {
            boxes.iter().map(|&bounds| directional_part(direction.into(), bounds, scene)).collect()
        }
        Light::Spot { .. } | Light::Point { .. } => Vec::new(),
    })
}

fn numbered(lights: &[Light], layers: impl Fn(&Light) -> Vec<ShadowLayer>) -> Vec<ShadowLayer> {
    let numbered = |(index, (light, source)): (usize, (&Light, GpuLight))| {
        layers(light).into_iter().map(move |layer| ShadowLayer { light: index as u32, source, ..layer })
    };
    lights.iter().zip(on_device(lights)).enumerate().flat_map(numbered).collect()
}

/// Rotation into the light's view of a box: along the light's axis, and about it so that the box covers the smallest
/// rectangle. A side of the smallest rectangle is along an edge of the box. z increases towards the light.
fn towards(direction: Vec3, bounds: Bounds) -> Mat4 {
    let axis = direction.normalize_or(Vec3::NEG_Y);
    let area = |view: &Mat4| {
        let (low, high) = in_view(view, bounds);
        (high - low).x * (high - low).y
    };
    // An edge along the axis has no direction in the view.
    let edges = Vec3::AXES.into_iter().filter(|edge| edge.cross(axis).length() > 1e-3);
    let views = edges.map(|edge| look_to_mat4(Vec3::ZERO, axis, edge));
    views.min_by(|a, b| area(a).total_cmp(&area(b))).unwrap_or(Mat4::IDENTITY)
}

/// Bounding box, in the light's view, of a box.
fn in_view(view: &Mat4, (low, high): Bounds) -> Bounds {
    let corners = (0..8u32).map(|i| {
        let pick = |bit: u32, low: f32, high: f32| if i >> bit & 1 == 0 { low } else { high };
        view.transform_point3(Vec3::new(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z)))
    });
    corners.fold((Vec3::MAX, Vec3::MIN), |(a, b), p| (a.min(p), b.max(p)))
}

/// An orthographic map around the whole scene.
fn directional(direction: Vec3, scene: Bounds) -> ShadowLayer {
    let view = towards(direction, scene);
    let (low, high) = in_view(&view, scene);
    let margin = diagonal(scene).max(f32::MIN_POSITIVE) * MARGIN;
    orthographic(&view, low - margin, high + margin)
}

/// An orthographic map around a part of the scene. Its depth reaches from the lowest to the highest surface that is
/// inside the map, also outside of the box.
fn directional_part(direction: Vec3, bounds: Bounds, scene: &Scene) -> ShadowLayer {
    let view = towards(direction, bounds);
    let (low, high) = in_view(&view, bounds);
    let margin = diagonal(bounds).max(f32::MIN_POSITIVE) * MARGIN;
    let (low, high) = (low - margin, high + margin);
    let depths = depth_range(scene, &view, (low.truncate().as_dvec2(), high.truncate().as_dvec2()));
    let (back, front) = depths.map_or((low.z, high.z), |(back, front)| (back - margin, front + margin));
    orthographic(&view, low.with_z(back), high.with_z(front))
}

/// A map of this box of the light's view. Depth is 1 at the light's side.
fn orthographic(view: &Mat4, low: Vec3, high: Vec3) -> ShadowLayer {
    let size = (high - low).max(Vec3::splat(f32::MIN_POSITIVE));
    let centre = (low + high) / size;
    let clip = Mat4::from_cols_array_2d(&[
        [2.0 / size.x, 0.0, 0.0, 0.0],
        [0.0, 2.0 / size.y, 0.0, 0.0],
        [0.0, 0.0, 1.0 / size.z, 0.0],
        [-centre.x, -centre.y, -low.z / size.z, 1.0],
    ]);
    let width = (size.x * size.y).sqrt();
    ShadowLayer { world_to_clip: clip * *view, width, depth: Some(size.z), light: 0, source: GpuLight::zeroed() }
}

/// A square perspective map along an axis.
fn perspective(position: Vec3, axis: Vec3, tangent: f32, near: f32) -> ShadowLayer {
    let view = look_to_mat4(position, axis, axis.any_orthonormal_vector());
    let clip = Mat4::from_cols_array_2d(&[
        [1.0 / tangent, 0.0, 0.0, 0.0],
        [0.0, 1.0 / tangent, 0.0, 0.0],
        [0.0, 0.0, 0.0, -1.0],
        [0.0, 0.0, near, 0.0],
    ]);
    ShadowLayer { world_to_clip: clip * view, width: 2.0 * tangent, depth: None, light: 0, source: GpuLight::zeroed() }
}
