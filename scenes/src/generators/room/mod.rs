//! A furnished living room with two windows in adjacent walls and one lamp. Sky and sun enter through the windows only,
//! and the lamp's bulb is hidden in its shade, so most of what the camera sees is indirect light.
//!
//! The floor is at y = 0, the origin in the middle of the room. The windows are in the walls at -x and -z. Furniture
//! stands a millimetre apart from what carries it, so that solids do not touch.

mod furniture;
mod paintings;
mod seats;
mod shelf;
mod shell;
#[cfg(test)]
mod tests;

use glam::{Affine3A, Vec3, vec3};

use super::{
    Geometry,
    build::{Builder, MaterialId, placed},
    textures::{self, Painter},
};
use crate::Material;

/// Half the room's length (x) and depth (z), metres.
const HALF: [f32; 2] = [3.0, 2.25];
/// Height of the ceiling, metres.
const HEIGHT: f32 = 2.7;
/// Thickness of the walls, floor and ceiling, metres.
const WALL: f32 = 0.3;
/// Gap between parts that rest on each other, metres.
const GAP: f32 = 0.001;
/// Sill and head of the windows, metres above the floor.
const WINDOW: [f32; 2] = [0.62, 2.32];
/// The window at -x: its extent in z, metres.
const WEST: [f32; 2] = [-0.35, 1.15];
/// The window at -z: its extent in x, metres.
const NORTH: [f32; 2] = [-2.42, -1.42];
/// The door at -z: its extent in x, metres.
const DOOR: [f32; 2] = [1.9, 2.72];
/// Height of the door, metres.
const DOOR_HEIGHT: f32 = 2.05;
/// Radiance of the bulb, W sr^-1 m^-2.
const BULB: [f32; 3] = [450.0, 290.0, 140.0];

/// All materials of the room.
struct Palette {
    plaster: MaterialId,
    paint: MaterialId,
    planks: [MaterialId; 3],
    walnut: MaterialId,
    oak: MaterialId,
    brass: MaterialId,
    /// The saturated accent.
    velvet: MaterialId,
    linen: MaterialId,
    ochre: MaterialId,
    curtain: MaterialId,
    rug: MaterialId,
    shade: MaterialId,
    bulb: MaterialId,
    glaze: MaterialId,
    terracotta: MaterialId,
    soil: MaterialId,
    bark: MaterialId,
    leaves: MaterialId,
    orange: MaterialId,
    paper: MaterialId,
    /// Cloth of book covers.
    covers: [MaterialId; 9],
    pictures: [MaterialId; 3],
}

impl Palette {
    fn new(b: &mut Builder) -> Self {
        let painter = Painter::new();
        let plank = |name, tone| painter.timber(name, vec3(0.70, 0.555, 0.415) * tone, 30);
        let planks = [("planks", 1.0), ("planks_dark", 0.9), ("planks_light", 1.08)];
        let covers = [
            ("cover_crimson", [0.42, 0.04, 0.05]),
            ("cover_rust", [0.50, 0.17, 0.06]),
            ("cover_mustard", [0.58, 0.38, 0.07]),
            ("cover_bottle", [0.04, 0.20, 0.11]),
            ("cover_sage", [0.28, 0.38, 0.24]),
            ("cover_navy", [0.04, 0.08, 0.25]),
            ("cover_sky", [0.20, 0.38, 0.52]),
            ("cover_plum", [0.22, 0.07, 0.20]),
            ("cover_cream", [0.66, 0.60, 0.48]),
        ];
        Self {
            plaster: b.plain("plaster", [0.79, 0.765, 0.72]),
            paint: b.plain("paint", [0.74, 0.72, 0.68]),
            planks: planks.map(|(name, tone)| b.textured(plank(name, tone), 1.6)),
            walnut: b.textured(painter.timber("walnut", vec3(0.53, 0.36, 0.25), 40), 1.1),
            oak: b.textured(painter.timber("oak", vec3(0.74, 0.56, 0.38), 50), 1.1),
            brass: b.plain("brass", [0.48, 0.33, 0.13]),
            velvet: b.plain("velvet", [0.62, 0.09, 0.045]),
            linen: b.plain("linen", [0.66, 0.60, 0.50]),
            ochre: b.plain("ochre", [0.60, 0.36, 0.08]),
            curtain: b.plain("curtain", [0.74, 0.69, 0.60]),
            rug: b.textured(painter.carpet("rug", vec3(0.20, 0.30, 0.52), vec3(0.13, 0.17, 0.36)), 1.0),
            shade: b.plain("shade", [0.58, 0.43, 0.20]),
            bulb: b.add(Material { name: "bulb".into(), albedo: [0.7; 3], emission: BULB, ..Material::default() }, 1.0),
            glaze: b.plain("glaze", [0.16, 0.36, 0.42]),
            terracotta: b.plain("terracotta", [0.48, 0.22, 0.13]),
            soil: b.plain("soil", [0.10, 0.07, 0.05]),
            bark: b.plain("bark", [0.22, 0.16, 0.11]),
            leaves: b.textured(textures::sprig("leaves", vec3(0.30, 0.52, 0.20), None, 131), 1.0),
            orange: b.plain("orange", [0.72, 0.27, 0.03]),
            paper: b.plain("paper", [0.72, 0.68, 0.58]),
            covers: covers.map(|(name, albedo)| b.plain(name, albedo)),
            pictures: [paintings::hills(&painter), paintings::shapes(&painter), paintings::sea(&painter)]
                .map(|picture| b.textured(picture, 1.0)),
        }
    }
}

/// The frame of a wall: x along the wall from its left end as seen from inside, z = 0 is its face, +z into the room.
fn north() -> Affine3A {
    placed(0, vec3(-HALF[0], 0.0, -HALF[1]))
}

/// As [`north`], for the wall at -x.
fn west() -> Affine3A {
    placed(1, vec3(-HALF[0], 0.0, HALF[1]))
}

/// A frame that stands at `foot`, rotated about +y by an angle in degrees.
fn stood(foot: Vec3, degrees: f32) -> Affine3A {
    Affine3A::from_translation(foot) * Affine3A::from_rotation_y(degrees.to_radians())
}

/// Builds the room.
pub fn build() -> Geometry {
    let mut b = Builder::default();
    let palette = Palette::new(&mut b);
    shell::draw(&mut b, &palette);
    seats::draw(&mut b, &palette);
    shelf::draw(&mut b, &palette);
    b.frame = Affine3A::IDENTITY;
    furniture::draw(&mut b, &palette);
    b.finish()
}
