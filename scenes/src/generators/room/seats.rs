//! Sofa, armchair cushions and the chair.

use glam::{Affine3A, Vec3, vec3};

use super::{GAP, HALF, Palette, stood};
use crate::generators::build::Builder;

/// Draws the sofa at the wall at -z and the chair by the window.
pub fn draw(b: &mut Builder, palette: &Palette) {
    b.frame = stood(vec3(0.50, 0.0, -HALF[1] + 0.06), 0.0);
    sofa(b, palette);
    b.frame = stood(vec3(-1.72, 0.0, 0.98), 118.0);
    chair(b, palette);
    b.frame = Affine3A::IDENTITY;
}

/// A sofa 2 m wide whose back is in the plane z = 0.
fn sofa(b: &mut Builder, palette: &Palette) {
    for x in [-0.90, 0.90] {
        for z in [0.10, 0.82] {
            b.on(palette.walnut).rod([vec3(x, GAP, z), vec3(x, 0.129, z)], [0.016, 0.026], 14);
        }
    }
    let mut pen = b.on(palette.velvet);
    let flat = Vec3::ZERO;
    for side in [-1.0, 1.0] {
        let (a, b) = (side * 0.805, side * 1.0);
        pen.rounded(vec3(f32::min(a, b), 0.13, 0.0), vec3(f32::max(a, b), 0.60, 0.92), 0.06, flat);
        // Seat and back cushions.
        let (a, b) = (side * 0.003, side * 0.797);
        let (low, high) = (f32::min(a, b), f32::max(a, b));
        pen.rounded(vec3(low, 0.305, 0.245), vec3(high, 0.45, 0.915), 0.05, vec3(0.0, 0.018, 0.012));
    }
    pen.rounded(vec3(-0.80, 0.13, 0.22), vec3(0.80, 0.30, 0.90), 0.03, flat);
    pen.rounded(vec3(-0.80, 0.131, 0.0), vec3(0.80, 0.80, 0.215), 0.06, flat);
    let seat = b.frame;
    for side in [-1.0, 1.0] {
        b.frame = seat * Affine3A::from_translation(vec3(side * 0.40, 0.478, 0.345)) * tilt(-9.0);
        b.on(palette.velvet).rounded(vec3(-0.39, 0.0, -0.075), vec3(0.39, 0.40, 0.075), 0.06, vec3(0.0, 0.02, 0.03));
    }
    for (x, material, turn, lean) in
        [(-0.60, palette.ochre, 22.0, -20.0), (0.60, palette.linen, -18.0, -18.0), (0.30, palette.glaze, -6.0, -24.0)]
    {
        b.frame = seat * stood(vec3(x, 0.484, 0.545), turn) * tilt(lean);
        b.on(material).rounded(vec3(-0.20, 0.0, -0.03), vec3(0.20, 0.38, 0.03), 0.028, vec3(0.0, 0.0, 0.05));
    }
    b.frame = seat;
}

/// Leans a part about x by an angle in degrees.
fn tilt(degrees: f32) -> Affine3A {
    Affine3A::from_rotation_x(degrees.to_radians())
}

/// A wooden chair that faces +z.
fn chair(b: &mut Builder, palette: &Palette) {
    let mut wood = b.on(palette.oak);
    for x in [-0.19, 0.19] {
        wood.rod([vec3(1.08 * x, GAP, 0.20), vec3(x, 0.434, 0.17)], [0.012, 0.019], 12);
        wood.rod([vec3(1.08 * x, GAP, -0.22), vec3(x, 0.434, -0.18)], [0.012, 0.019], 12);
        wood.rod([vec3(0.97 * x, 0.472, -0.185), vec3(1.02 * x, 0.86, -0.27)], [0.019, 0.013], 12);
    }
    wood.rounded(vec3(-0.22, 0.435, -0.215), vec3(0.22, 0.47, 0.215), 0.015, Vec3::ZERO);
    for z in [0.187, -0.20] {
        wood.rod([vec3(-0.183, 0.22, z), vec3(0.183, 0.22, z)], [0.009; 2], 10);
    }
    let frame = b.frame;
    for (y, z) in [(0.79, -0.255), (0.66, -0.227)] {
        b.frame = frame * Affine3A::from_translation(vec3(0.0, y, z)) * tilt(-12.0);
        b.on(palette.oak).rounded(vec3(-0.169, -0.032, -0.009), vec3(0.169, 0.032, 0.009), 0.008, Vec3::ZERO);
    }
    b.frame = frame;
    b.on(palette.linen).rounded(vec3(-0.195, 0.473, -0.155), vec3(0.195, 0.512, 0.19), 0.018, vec3(0.0, 0.012, 0.0));
}
