//! How much of a picture a camera shows of a scene.

use glam::{Vec2, Vec3};

use crate::{Camera, Scene};

/// Size of the picture, pixels.
const SIZE: [usize; 2] = [320, 180];

/// Share of the pixels whose centres lie on a surface.
pub(super) fn coverage(scene: &Scene, camera: &Camera) -> f32 {
    let view = camera.view_matrix();
    let tangents = camera.tan_half_fov(SIZE[0] as u32, SIZE[1] as u32);
    let mut seen = vec![false; SIZE[0] * SIZE[1]];
    // Small against the distance of what is looked at.
    let near = 1e-3 * Vec3::from(camera.eye).distance(camera.target.into());
    for mesh in &scene.meshes {
        let points: Vec<Vec3> = mesh.positions.iter().map(|&p| view.transform_point3(p.into())).collect();
        for triangle in mesh.indices.as_chunks::<3>().0 {
            fill(&mut seen, &clipped(triangle.map(|i| points[i as usize]), near), tangents);
        }
    }
    seen.iter().filter(|&&seen| seen).count() as f32 / seen.len() as f32
}

/// The part of a triangle in front of the plane at the distance `near`: a polygon of up to four corners.
fn clipped(triangle: [Vec3; 3], near: f32) -> Vec<Vec3> {
    let mut polygon = Vec::with_capacity(4);
    for i in 0..3 {
        let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
        let (ahead_a, ahead_b) = (-a.z - near, -b.z - near);
        if ahead_a >= 0.0 {
            polygon.push(a);
        }
        if (ahead_a >= 0.0) != (ahead_b >= 0.0) {
            polygon.push(a.lerp(b, ahead_a / (ahead_a - ahead_b)));
        }
    }
    polygon
}

/// Marks the pixels whose centres lie in a convex polygon.
fn fill(seen: &mut [bool], polygon: &[Vec3], tangents: [f32; 2]) {
    let pixel = |p: &Vec3| {
        let ndc = Vec2::new(p.x / (-p.z * tangents[0]), p.y / (-p.z * tangents[1]));
        Vec2::new(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * Vec2::new(SIZE[0] as f32, SIZE[1] as f32)
    };
    let corners: Vec<Vec2> = polygon.iter().map(pixel).collect();
    if corners.len() < 3 {
        return;
    }
    let (low, high) =
        corners.iter().fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), &p| (low.min(p), high.max(p)));
    // Casts from float to integer saturate.
    let rows = (low.y - 0.5).ceil().max(0.0) as usize..((high.y + 0.5).floor().max(0.0) as usize).min(SIZE[1]);
    for y in rows {
        // Where the line through the centres of the row enters and leaves the polygon.
        let line = y as f32 + 0.5;
        let (mut left, mut right) = (f32::INFINITY, f32::NEG_INFINITY);
        for i in 0..corners.len() {
            let (a, b) = (corners[i], corners[(i + 1) % corners.len()]);
            if (a.y <= line) != (b.y <= line) {
                let x = a.x + (line - a.y) / (b.y - a.y) * (b.x - a.x);
                (left, right) = (left.min(x), right.max(x));
            }
        }
        let columns = (left - 0.5).ceil().max(0.0) as usize..((right + 0.5).floor().max(0.0) as usize).min(SIZE[0]);
        if columns.start < columns.end {
            seen[y * SIZE[0] + columns.start..y * SIZE[0] + columns.end].fill(true);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Mesh;

    fn square(half: f32) -> Scene {
        let positions = vec![[-half, -half, 0.0], [half, -half, 0.0], [half, half, 0.0], [-half, half, 0.0]];
        Scene {
            meshes: vec![Mesh { positions, indices: vec![0, 1, 2, 0, 2, 3], ..Mesh::default() }],
            ..Scene::default()
        }
    }

    #[test]
    fn the_share_is_that_of_the_projected_area() {
        let camera = Camera { eye: [0.0, 0.0, 1.0], vertical_fov_degrees: 90.0, ..Camera::default() };
        // Half the height is 1, half the width is 16/9.
        for (half, share) in [(0.5, 0.25 * 9.0 / 16.0), (1.0, 9.0 / 16.0), (5.0, 1.0)] {
            let found = coverage(&square(half), &camera);
            // A pixel along each edge.
            assert!((found - share).abs() < 0.01, "{half}: {found}");
        }
        // Behind the camera, and a ground below it that reaches behind it.
        assert_eq!(coverage(&square(1.0), &Camera { target: [0.0, 0.0, 2.0], ..camera }), 0.0);
        let above = Camera { eye: [0.0, 0.0, 1.0], target: [0.0, 1.0, 1.0], up: [0.0, 0.0, 1.0], ..camera };
        let ground = coverage(&square(1e4), &above);
        assert!((ground - 0.5).abs() < 0.01, "{ground}");
        // Thinner than a pixel.
        assert_eq!(coverage(&square(1e-4), &camera), 0.0);
    }
}
