//! A corner with a few objects for several lights: blocks and a ball, a pillar, an alcove and a canopy that hide lights
//! from each other.

use glam::{Affine3A, Vec3, vec3};

use super::{Geometry, build::Builder};

/// Half the floor's width and depth, and the height of the walls, metres. The corner is open towards +z, +x and above.
const CORNER: [f32; 3] = [2.5, 2.0, 2.4];
/// Thickness of floor and walls, metres.
const WALL: f32 = 0.1;

/// Builds the corner and its objects. Every mesh is watertight.
pub fn build() -> Geometry {
    let mut b = Builder::default();
    let stone = b.plain("stone", [0.68, 0.66, 0.62]);
    let white = b.plain("white", [0.76, 0.75, 0.72]);
    let red = b.plain("red", [0.64, 0.10, 0.06]);
    let blue = b.plain("blue", [0.10, 0.22, 0.58]);
    let yellow = b.plain("yellow", [0.72, 0.52, 0.09]);
    let [w, d, h] = CORNER;
    // Floor, wall at -x and wall at -z are one body.
    let (xs, ys, zs) = ([-w - WALL, -w, w], [-WALL, 0.0, h], [-d - WALL, -d, d]);
    b.on(stone).cells([&xs, &ys, &zs], |[i, j, k]| i == 0 || j == 0 || k == 0);
    let stand = 0.001;
    // A ball on a plinth.
    b.on(white).block(vec3(-0.30, stand, -0.95), vec3(0.30, 0.45, -0.35));
    b.on(red).ball(vec3(0.0, 0.731, -0.65), 0.28, 48);
    // A turned block and a flat one before it.
    b.frame = Affine3A::from_translation(vec3(-1.45, stand, -0.15)) * Affine3A::from_rotation_y(0.5);
    b.on(blue).rounded(vec3(-0.30, 0.0, -0.30), vec3(0.30, 1.15, 0.30), 0.03, Vec3::ZERO);
    b.frame = Affine3A::from_translation(vec3(-0.75, stand, 0.75)) * Affine3A::from_rotation_y(-0.3);
    b.on(white).rounded(vec3(-0.35, 0.0, -0.25), vec3(0.35, 0.22, 0.25), 0.02, Vec3::ZERO);
    b.frame = Affine3A::IDENTITY;
    // A canopy on two pillars.
    for z in [-1.62, -0.48] {
        b.on(yellow).rod([vec3(1.75, stand, z), vec3(1.75, 1.399, z)], [0.07, 0.06], 24);
    }
    b.on(white).rounded(vec3(0.95, 1.40, -1.80), vec3(1.95, 1.48, -0.30), 0.02, Vec3::ZERO);
    b.on(yellow).rounded(vec3(1.05, stand, -1.5), vec3(1.5, 0.38, -1.05), 0.05, Vec3::ZERO);
    b.finish()
}
