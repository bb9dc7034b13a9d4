//! Parts that several scenes have: cloth, potted plants.

use std::f32::consts::TAU;

use glam::{Vec2, Vec3, vec2, vec3};

use super::build::{Builder, Chance, MaterialId, Pen, Profile};

/// A hanging curtain in the plane z of the current frame.
pub struct Curtain {
    /// From one side, where a tied curtain is gathered, to the other, metres.
    pub x: [f32; 2],
    /// Height of the upper hem, metres.
    pub top: f32,
    /// Length from the upper to the lower hem, metres.
    pub drop: f32,
    /// Mean position in z, metres.
    pub z: f32,
    /// Number of folds.
    pub folds: f32,
    /// Depth of the folds as a multiple of 3 cm above and 6.5 cm below.
    pub depth: f32,
    /// Whether it is tied back to its first side.
    pub tied: bool,
    /// Seed of its irregularities.
    pub seed: u32,
}

impl Curtain {
    /// Draws the curtain.
    pub fn draw(&self, pen: &mut Pen<'_>) {
        let Self { x, top, drop, z, folds, depth, tied, seed } = *self;
        let mut chance = Chance::new(seed);
        let (phase, sway) = (chance.between(0.0, TAU), chance.between(-0.05, 0.05));
        // A tied curtain narrows to the tie at 58 % of its drop, then falls open a little.
        let width = |t: f32| match tied {
            true if t < 0.58 => 1.0 - 0.74 * smooth(t / 0.58).powf(1.6),
            true => 0.26 + 0.14 * smooth((t - 0.58) / 0.3),
            false => 1.0 - 0.03 * (t * 3.0).sin(),
        };
        pen.sheet((folds * if tied { 10.0 } else { 7.0 }) as usize, 18, |s, t| {
            let gathered = width(t);
            let depth = depth * (0.030 + 0.035 * t) * (1.0 - 0.35 * (1.0 - gathered));
            let wave = TAU * folds * (s + 0.03 * (TAU * s * 1.3 + phase + 1.5 * t).sin()) + phase;
            let across = s * gathered + (if tied { 0.0 } else { sway * t });
            // The free part of a tied curtain hangs towards its tie.
            let sag = if tied { 0.10 * s * (1.0 - gathered) * (1.0 - t) } else { 0.015 * (wave * 0.5).sin() * t };
            let position = vec3(
                x[0] + (x[1] - x[0]) * across,
                top - drop * t - sag,
                z + depth * wave.sin() + 0.12 * sway * t * (3.0 * s).sin(),
            );
            (position, vec2(s, t))
        });
    }
}

/// A carpet that lies along x: a thin slab, so that it has an edge; `centre` and `size` in (x, z).
pub fn rug(pen: &mut Pen<'_>, centre: Vec2, size: Vec2) {
    let thickness = 0.022;
    let corner = |i: f32, j: f32, y: f32| vec3(centre.x + size.x * i, y, centre.y + size.y * j);
    let top = [
        corner(-0.5, 0.5, thickness),
        corner(0.5, 0.5, thickness),
        corner(0.5, -0.5, thickness),
        corner(-0.5, -0.5, thickness),
    ];
    // The texture's long axis is along x.
    let uvs = [vec2(0.0, 0.0), vec2(0.0, 1.0), vec2(1.0, 1.0), vec2(1.0, 0.0)];
    pen.quad_uv(top, uvs);
    for i in 0..4 {
        let j = (i + 1) % 4;
        let low = |p: Vec3| vec3(p.x, -0.01, p.z);
        pen.quad_uv([low(top[i]), low(top[j]), top[j], top[i]], [uvs[i], uvs[j], uvs[j], uvs[i]]);
    }
}

/// A vase for a plant, 0.82 m high at `scale` 1, filled with soil up to 0.74 m.
pub fn pot(b: &mut Builder, glaze: MaterialId, soil: MaterialId, foot: Vec3, scale: f32) {
    let profile = Profile::new(
        &[
            [0.20, -0.02],
            [0.23, 0.0],
            [0.24, 0.04],
            [0.21, 0.07],
            [0.13, 0.10],
            [0.105, 0.14],
            [0.125, 0.165],
            [0.125, 0.185],
            [0.16, 0.215],
            [0.24, 0.29],
            [0.30, 0.39],
            [0.32, 0.49],
            [0.305, 0.58],
            [0.265, 0.66],
            [0.25, 0.70],
            [0.265, 0.735],
            [0.32, 0.76],
            [0.345, 0.78],
            [0.345, 0.81],
            [0.32, 0.82],
            [0.285, 0.80],
            [0.27, 0.74],
            [0.26, 0.70],
        ]
        .map(|p| p.map(|x| x * scale)),
    );
    b.on(glaze).lathe(foot, &profile, 22);
    let filling = Profile::new(&[[0.30, 0.74], [0.0, 0.77]].map(|p| p.map(|x| x * scale)));
    b.on(soil).lathe(foot, &filling, 16);
}

/// A card of leaves from `base` towards `tip`, `width` wide, facing `facing`, bent by gravity.
pub fn card(pen: &mut Pen<'_>, base: Vec3, tip: Vec3, width: f32, facing: Vec3, bend: f32) {
    let along = tip - base;
    let across = along.cross(facing).normalize_or(Vec3::X) * (0.5 * width);
    pen.sheet(1, 2, |s, t| {
        let droop = Vec3::NEG_Y * (bend * t * t * along.length());
        (base + along * t + droop + across * (2.0 * s - 1.0), vec2(s, 1.0 - t))
    });
}

/// A round bush of sprigs.
pub fn shrub(pen: &mut Pen<'_>, foot: Vec3, size: f32, chance: &mut Chance) {
    for i in 0..34 {
        let turn = i as f32 * 2.399_963; // the golden angle spreads the sprigs evenly
        let lean = (i as f32 / 34.0).sqrt() * 1.25;
        let direction = vec3(lean.sin() * turn.cos(), lean.cos(), lean.sin() * turn.sin());
        let length = size * chance.between(0.8, 1.25);
        let facing = vec3(chance.between(-1.0, 1.0), 0.8, chance.between(-1.0, 1.0));
        card(pen, foot - direction * 0.05, foot + direction * length, length * 0.8, facing, chance.between(0.05, 0.3));
    }
}

/// A young feather palm.
pub fn palm(pen: &mut Pen<'_>, foot: Vec3, scale: f32, chance: &mut Chance) {
    for i in 0..13 {
        let turn = i as f32 * 2.399_963 + chance.between(-0.2, 0.2);
        let lean = 0.2 + 0.75 * i as f32 / 13.0;
        let out = vec3(turn.cos(), 0.0, turn.sin());
        let length = scale * chance.between(1.15, 1.5);
        let width = 0.34 * scale;
        pen.sheet(2, 8, |s, t| {
            let angle = lean + 1.1 * t * t;
            let spine = foot
                + (out * (lean.sin() * t + 0.35 * t * t) + Vec3::Y * (lean.cos() * t - 0.55 * lean * t * t * angle))
                    * length;
            let side = out.cross(Vec3::Y) * ((2.0 * s - 1.0) * width);
            let fold = Vec3::Y * (0.35 * width * (2.0 * s - 1.0).abs());
            (spine + side + fold, vec2(s, 1.0 - t))
        });
    }
}

fn smooth(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
