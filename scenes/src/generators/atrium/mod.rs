//! The atrium: a colonnaded court of two storeys with vaulted lower and timbered upper galleries, dyed cloths and plants.
//! The sun reaches only the floor and one side.
//!
//! The court extends along x with its floor at y = 0. Parts that repeat on its four sides are drawn in the local frame of
//! a [`Side`]: x is along the side from one corner of the court to the other, z = 0 is the face of the wall, and +z
//! points into the court.

mod cloth;
mod furniture;
mod masonry;
mod plants;

use glam::{Affine3A, vec3};

use super::{
    Geometry,
    build::{Builder, MaterialId, placed},
    textures::{self, Painter},
};

/// Distance between the columns of the lower arcade, metres.
const BAY: f32 = 2.5;
/// Half the court's length and width, metres: ten bays by three.
const HALF: [f32; 2] = [5.0 * BAY, 1.5 * BAY];
/// Thickness of the lower arcade's wall, metres.
const WALL: f32 = 0.55;
/// Depth of the galleries behind that wall, metres; a bay of their vault is square.
const DEPTH: f32 = BAY;
/// Gallery floor, one step above the court, metres.
const STEP: f32 = 0.15;
/// Height at which the lower arches begin, metres.
const SPRING: f32 = 3.5;
/// Radius of the lower arches, metres.
const ARCH: f32 = 0.95;
/// Floor of the upper gallery, metres.
const UPPER: f32 = 5.2;
/// Underside of the roof, metres.
const EAVE: f32 = 9.1;

/// One of the court's four sides.
struct Side {
    frame: Affine3A,
    /// Number of bays.
    bays: usize,
    /// Whether it is one of the two long sides, which contain the corners of the building.
    long: bool,
}

impl Side {
    fn length(&self) -> f32 {
        self.bays as f32 * BAY
    }
}

/// The sides at -z (shaded), +z (sunlit), +x (far end) and -x (near end).
fn sides() -> [Side; 4] {
    let [x, z] = HALF;
    [(0, -x, -z), (2, x, z), (3, x, -z), (1, -x, z)].map(|(turns, x, z)| {
        let long = turns % 2 == 0;
        Side { frame: placed(turns, vec3(x, 0.0, z)), bays: if long { 10 } else { 3 }, long }
    })
}

/// All materials of the court.
struct Palette {
    ashlar: MaterialId,
    brick: MaterialId,
    plaster: MaterialId,
    marble: MaterialId,
    voussoirs: MaterialId,
    court_tiles: MaterialId,
    gallery_tiles: MaterialId,
    roof_tiles: MaterialId,
    wood: MaterialId,
    iron: MaterialId,
    bronze: MaterialId,
    terracotta: MaterialId,
    soil: MaterialId,
    water: MaterialId,
    /// Cloth: red, blue, green, saffron.
    dyes: [MaterialId; 4],
    /// Carpets: red, blue, green.
    carpets: [MaterialId; 3],
    leaves: MaterialId,
    ivy: MaterialId,
    blossom: MaterialId,
    frond: MaterialId,
}

impl Palette {
    fn new(b: &mut Builder) -> Self {
        let painter = Painter::new();
        let dyes = painter.fabrics([
            ("cloth_red", vec3(0.80, 0.10, 0.08), textures::GOLD),
            ("cloth_blue", vec3(0.10, 0.24, 0.72), textures::GOLD),
            ("cloth_green", vec3(0.10, 0.52, 0.20), textures::GOLD),
            ("cloth_saffron", vec3(0.92, 0.56, 0.10), vec3(0.62, 0.16, 0.12)),
        ]);
        let carpets = [
            ("carpet_red", vec3(0.74, 0.10, 0.09), vec3(0.14, 0.17, 0.42)),
            ("carpet_blue", vec3(0.12, 0.27, 0.62), vec3(0.62, 0.12, 0.10)),
            ("carpet_green", vec3(0.13, 0.47, 0.26), vec3(0.70, 0.36, 0.12)),
        ];
        Self {
            ashlar: b.textured(painter.ashlar(), 2.4),
            brick: b.textured(painter.brick(), 1.5),
            plaster: b.textured(painter.plaster(), 2.5),
            marble: b.textured(painter.marble(), 1.5),
            voussoirs: b.textured(painter.voussoirs(), 1.0),
            court_tiles: b.textured(painter.court_tiles(), 2.5),
            gallery_tiles: b.textured(painter.gallery_tiles(), 1.5),
            roof_tiles: b.textured(painter.roof_tiles(), 2.0),
            wood: b.textured(painter.wood(), 1.0),
            iron: b.plain("iron", [0.10, 0.095, 0.09]),
            bronze: b.plain("bronze", [0.42, 0.28, 0.12]),
            terracotta: b.plain("terracotta", [0.48, 0.22, 0.13]),
            soil: b.plain("soil", [0.10, 0.07, 0.05]),
            water: b.plain("water", [0.12, 0.30, 0.33]),
            dyes: dyes.map(|cloth| b.textured(cloth, 1.0)),
            carpets: carpets.map(|(name, field, border)| b.textured(painter.carpet(name, field, border), 1.0)),
            leaves: b.textured(textures::sprig("leaves", vec3(0.36, 0.56, 0.20), None, 121), 1.0),
            ivy: b.textured(textures::sprig("ivy", vec3(0.28, 0.49, 0.18), None, 122), 1.0),
            blossom: b
                .textured(textures::sprig("blossom", vec3(0.28, 0.46, 0.16), Some(vec3(0.86, 0.20, 0.48)), 123), 1.0),
            frond: b.textured(textures::frond("frond", vec3(0.40, 0.60, 0.24)), 1.0),
        }
    }
}

/// Builds the court.
pub fn build() -> Geometry {
    let mut b = Builder::default();
    let palette = Palette::new(&mut b);
    for side in &sides() {
        b.frame = side.frame;
        masonry::side(&mut b, &palette, side);
        furniture::side(&mut b, &palette, side);
        cloth::side(&mut b, &palette, side);
        plants::side(&mut b, &palette, side);
    }
    b.frame = Affine3A::IDENTITY;
    masonry::floor(&mut b, &palette);
    masonry::tower(&mut b, &palette);
    furniture::court(&mut b, &palette);
    cloth::court(&mut b, &palette);
    plants::court(&mut b, &palette);
    b.finish()
}
