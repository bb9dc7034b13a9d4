//! A court with a panel whose back is lit. The light that falls from it on everything else comes from surfaces that the
//! display's camera does not see; a second camera behind the panel does.

use glam::{Affine3A, Vec3, vec3};

use super::{Geometry, build::Builder};

/// Half the court's width and depth, and the height of its walls, metres. It is open towards +z and above.
const COURT: [f32; 3] = [2.0, 2.0, 2.2];
/// Thickness of floor and walls, metres.
const WALL: f32 = 0.1;

/// Builds the court, the panel, and objects at its sides. Every mesh is watertight.
pub fn build() -> Geometry {
    let mut b = Builder::default();
    let stone = b.plain("stone", [0.72, 0.70, 0.67]);
    let panel = b.plain("panel", [0.45, 0.45, 0.45]);
    let back = b.plain("panel_back", [0.76, 0.20, 0.07]);
    let white = b.plain("white", [0.76, 0.75, 0.73]);
    let [w, d, h] = COURT;
    let (xs, ys, zs) = ([-w - WALL, -w, w, w + WALL], [-WALL, 0.0, h], [-d - WALL, -d, d]);
    b.on(stone).cells([&xs, &ys, &zs], |[i, j, k]| i != 1 || j == 0 || k == 0);
    // The coloured back of the panel is a board of its own behind it.
    b.on(panel).block(vec3(-0.8, 0.001, -0.95), vec3(0.8, 1.35, -0.90));
    b.on(back).block(vec3(-0.8, 0.001, -0.98), vec3(0.8, 1.35, -0.951));
    b.on(white).ball(vec3(1.3, 0.321, -1.25), 0.32, 40);
    b.frame = Affine3A::from_translation(vec3(-1.3, 0.001, -1.3)) * Affine3A::from_rotation_y(0.6);
    b.on(white).rounded(vec3(-0.25, 0.0, -0.25), vec3(0.25, 0.8, 0.25), 0.02, Vec3::ZERO);
    b.finish()
}
