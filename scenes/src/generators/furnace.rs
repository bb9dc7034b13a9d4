//! A white furnace: a closed room in which every surface has the same albedo rho and emits the same radiance Le.
//!
//! The radiance L = Le + rho L = Le / (1 - rho) is the same at every point and in every direction. With both at 0.5 it is
//! exactly 1. A path tracer must reproduce this closed form, whatever stands in the room. All faces are flat, because
//! interpolated normals would break the closed form.

use std::f32::consts::{PI, TAU};

use glam::{Vec3, vec2, vec3};

use super::{Geometry, build::Builder};
use crate::Material;

/// Albedo, and emitted radiance in W sr^-1 m^-2, of everything.
const HALF: [f32; 3] = [0.5; 3];

/// Builds the room, 4 x 3 x 4 metres, with two blocks and two faceted balls that float in it.
pub fn build() -> Geometry {
    let mut b = Builder::default();
    let white = Material { name: "furnace".into(), albedo: HALF, emission: HALF, ..Material::default() };
    let white = b.add(white, 1.0);
    let mut pen = b.on(white);
    // Swapped corners turn a block inside out: the room faces inwards.
    pen.block(vec3(2.0, 3.0, 2.0), vec3(-2.0, 0.0, -2.0));
    pen.block(vec3(-1.3, 0.1, -1.2), vec3(-0.5, 1.5, -0.4));
    pen.block(vec3(0.2, 0.2, 0.3), vec3(1.0, 0.6, 1.2));
    for (centre, radius) in [(vec3(0.9, 1.6, -0.8), 0.55), (vec3(-0.7, 2.1, 0.8), 0.3)] {
        let point = |i: u32, j: u32| {
            let (sin, cos) = (PI * j as f32 / 8.0).sin_cos();
            // The last meridian equals the first, and the poles are single points, so that the ball is closed.
            let (east, south) = (TAU * (i % 16) as f32 / 16.0).sin_cos();
            let ring = if j.is_multiple_of(8) { 0.0 } else { sin };
            centre + radius * vec3(ring * south, cos, ring * east)
        };
        for (i, j) in (0..16).flat_map(|i| (0..8).map(move |j| (i, j))) {
            let corners = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
            let middle: Vec3 = corners.iter().sum::<Vec3>() / 4.0 - centre;
            let [a, b, c, d] = corners.map(|corner| pen.vertex(corner, middle, vec2(0.0, 0.0)));
            pen.triangle([a, b, c]);
            pen.triangle([a, c, d]);
        }
    }
    b.finish()
}
