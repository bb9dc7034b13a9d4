//! Translucent matter that is lit from behind: bodies of wax, which absorb light on its way through them, a curtain and a
//! lamp shade, which are thin.

use glam::{Affine3A, Vec3, vec3};

use super::{
    Geometry,
    build::{Builder, Profile},
    parts::Curtain,
};
use crate::Material;

/// Half the floor's width and depth, and the height of the wall behind, metres.
const STAGE: [f32; 3] = [2.2, 2.0, 2.2];
/// Thickness of floor and wall, metres.
const WALL: f32 = 0.1;

/// Builds the stage. Its bodies are watertight; the curtain is a sheet.
pub fn build() -> Geometry {
    let mut b = Builder::default();
    let stone = b.plain("stone", [0.62, 0.60, 0.57]);
    let iron = b.plain("iron", [0.10, 0.095, 0.09]);
    let mut translucent = |name: &str, albedo, translucency, absorption| {
        b.add(Material { name: name.into(), albedo, translucency, absorption, ..Material::default() }, 1.0)
    };
    let wax = translucent("wax", [0.40, 0.36, 0.28], [0.58, 0.52, 0.40], [2.0, 5.0, 14.0]);
    let jade = translucent("jade", [0.22, 0.36, 0.26], [0.35, 0.60, 0.42], [9.0, 3.0, 6.0]);
    let cloth = translucent("cloth", [0.48, 0.16, 0.10], [0.42, 0.14, 0.06], [0.0; 3]);
    let shade = translucent("shade", [0.50, 0.45, 0.36], [0.45, 0.38, 0.26], [0.0; 3]);
    let [w, d, h] = STAGE;
    let (xs, ys, zs) = ([-w, w], [-WALL, 0.0, h], [-d - WALL, -d, d]);
    b.on(stone).cells([&xs, &ys, &zs], |[_, j, k]| j == 0 || k == 0);
    let stand = 0.001;
    // Candles of different thickness, a ball and a block.
    for (x, z, radius, height) in [(-0.62, 0.28, 0.09, 0.62), (-0.38, 0.44, 0.06, 0.40), (-0.30, 0.14, 0.045, 0.78)] {
        b.on(wax).rod([vec3(x, stand, z), vec3(x, height, z)], [radius, 0.94 * radius], 32);
    }
    b.on(wax).ball(vec3(0.10, 0.191, 0.30), 0.19, 48);
    b.frame = Affine3A::from_translation(vec3(0.58, stand, 0.22)) * Affine3A::from_rotation_y(0.5);
    b.on(jade).rounded(vec3(-0.16, 0.0, -0.10), vec3(0.16, 0.46, 0.10), 0.05, vec3(0.02, 0.02, 0.02));
    b.frame = Affine3A::IDENTITY;
    let curtain =
        Curtain { x: [-1.75, -0.85], top: 1.78, drop: 1.74, z: -0.35, folds: 7.0, depth: 0.7, tied: false, seed: 3 };
    curtain.draw(&mut b.on(cloth));
    b.on(iron).rod([vec3(-1.85, 1.80, -0.35), vec3(-0.75, 1.80, -0.35)], [0.014; 2], 12);
    for x in [-1.80, -0.80] {
        b.on(iron).rod([vec3(x, stand, -0.35), vec3(x, 1.785, -0.35)], [0.014; 2], 12);
    }
    // A table lamp: light from inside leaves through the shade. Its wall is 2 mm thick.
    let foot = vec3(1.25, 0.0, -0.25);
    let stem = [[0.0, 0.001], [0.13, 0.001], [0.13, 0.02], [0.02, 0.04], [0.015, 0.70], [0.0, 0.70]];
    b.on(iron).lathe(foot, &Profile::new(&stem), 32);
    let wall = [[0.26, 0.72], [0.17, 1.12], [0.168, 1.12], [0.258, 0.72], [0.26, 0.72]];
    b.on(shade).lathe(foot + Vec3::Y * 0.05, &Profile::new(&wall), 64);
    b.finish()
}
