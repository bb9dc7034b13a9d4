//! Curtains in the arches, banners over the columns, flags, carpets, and sails across the sky.

use std::f32::consts::TAU;

use glam::{Vec3, vec2, vec3};

use super::{
    BAY, Palette, STEP, Side, UPPER, WALL,
    furniture::{ROD, pole},
};
use crate::generators::{
    build::{Builder, Chance, Pen},
    parts::{Curtain, rug},
};

/// The state of a curtain.
#[derive(Clone, Copy, PartialEq)]
enum Hang {
    /// Drawn across the whole arch.
    Full,
    /// In two halves, each tied back to its side.
    Parted,
    /// Tied back to the left (-1) or the right (1).
    Tied(f32),
}
use Hang::{Full, Parted, Tied};

const RED: usize = 0;
const BLUE: usize = 1;
const GREEN: usize = 2;
const SAFFRON: usize = 3;

/// Bay along world +x, dye and state of each curtain.
const SHADED_SIDE: &[(usize, usize, Hang)] = &[
    (0, BLUE, Tied(-1.0)),
    (1, GREEN, Full),
    (2, SAFFRON, Parted),
    (3, RED, Full),
    (4, BLUE, Parted),
    (6, GREEN, Full),
    (7, RED, Parted),
    (8, BLUE, Full),
];
const SUNLIT_SIDE: &[(usize, usize, Hang)] = &[
    (0, BLUE, Tied(1.0)),
    (1, GREEN, Parted),
    (2, RED, Full),
    (4, BLUE, Parted),
    (5, GREEN, Full),
    (6, SAFFRON, Parted),
    (8, RED, Full),
    (9, BLUE, Parted),
];
const FAR_END: &[(usize, usize, Hang)] = &[(0, GREEN, Parted), (1, RED, Parted), (2, BLUE, Parted)];

/// The cloth of one side.
pub fn side(b: &mut Builder, palette: &Palette, side: &Side) {
    // A side is identified by the position of its frame. Bays on the sunlit side are numbered against +x.
    let sunlit = side.long && side.frame.translation.z > 0.0;
    let far = !side.long && side.frame.translation.x > 0.0;
    let curtains = match (side.long, sunlit, far) {
        (true, false, _) => SHADED_SIDE,
        (true, true, _) => SUNLIT_SIDE,
        (_, _, true) => FAR_END,
        _ => &[],
    };
    for &(bay, dye, hang) in curtains {
        let bay = if sunlit { side.bays - 1 - bay } else { bay };
        let centre = (bay as f32 + 0.5) * BAY;
        let half = 0.5 * BAY - 0.26;
        let mut pen = b.on(palette.dyes[dye]);
        let seed = bay as u32 * 7 + sunlit as u32;
        match hang {
            Full => curtain([centre - half, centre + half], false, seed).draw(&mut pen),
            Tied(hand) => curtain([centre + hand * half, centre - hand * half], true, seed).draw(&mut pen),
            Parted => {
                curtain([centre - half, centre - 0.02], true, seed).draw(&mut pen);
                curtain([centre + half, centre + 0.02], true, seed + 1).draw(&mut pen);
            }
        }
    }
    for i in (1..side.bays).filter(|_| side.long) {
        let dye = [RED, GREEN, BLUE][(i / 2 + sunlit as usize) % 3];
        let x = i as f32 * BAY;
        if i % 2 == 0 {
            banner(b, palette, dye, x);
        } else {
            flag(&mut b.on(palette.dyes[[SAFFRON, RED, BLUE][(i / 2) % 3]]), x, i as u32);
        }
    }
}

/// A curtain from its rod to the gallery floor, from `x[0]`, where a tied one is gathered, to `x[1]`.
fn curtain(x: [f32; 2], tied: bool, seed: u32) -> Curtain {
    // About four folds a metre.
    let folds = ((x[1] - x[0]).abs() * 4.2).round();
    Curtain { x, top: ROD + 0.02, drop: ROD - STEP - 0.05, z: -0.5 * WALL, folds, depth: 1.0, tied, seed }
}

/// A banner on its own rod, in front of the spandrel above the column at `x`, with a pointed end.
fn banner(b: &mut Builder, palette: &Palette, dye: usize, x: f32) {
    let (top, z, half) = (UPPER + 0.72, 0.27, 0.46);
    b.on(palette.bronze).tube(&[vec3(x - half - 0.09, top, z), vec3(x + half + 0.09, top, z)], 0.016, 8);
    for hand in [-1.0, 1.0] {
        let at = x + hand * (half - 0.12);
        b.on(palette.iron).tube(&[vec3(at, top + 0.02, z), vec3(at, top + 0.02, -0.22)], 0.008, 5);
    }
    b.on(palette.dyes[dye]).sheet(14, 16, |s, t| {
        let u = 2.0 * s - 1.0;
        let length = 1.75 + 0.42 * (1.0 - u.abs());
        let wave = 0.035 * t * (5.0 * t + 2.2 * u + x).sin() + 0.018 * (7.0 * u + x).sin() * (0.3 + t);
        (vec3(x + half * u, top - length * t, z + 0.02 + wave), vec2(s, t))
    });
}

/// A flag that hangs from the leaning pole above the column at `x`.
fn flag(pen: &mut Pen<'_>, x: f32, seed: u32) {
    let [foot, head] = pole(x);
    let (low, high) = (foot.lerp(head, 0.42), foot.lerp(head, 0.97));
    let phase = Chance::new(seed).between(0.0, TAU);
    pen.sheet(14, 12, |s, t| {
        let hung = low.lerp(high, s);
        let wave = t * (0.09 * (TAU * (0.9 * s + 0.5 * t) + phase).sin() + 0.03 * (TAU * 2.3 * s + phase).sin());
        // Gravity narrows the lower end of the flag.
        let drawn = Vec3::Z * (0.16 * t * t * (0.5 - s));
        (hung + drawn + vec3(wave, -1.25 * t - 0.12 * t * (1.0 - s), 0.0), vec2(s, t))
    });
}

/// Carpets on the floor and sails overhead.
pub fn court(b: &mut Builder, palette: &Palette) {
    for (i, x) in [(0, -6.0), (1, -2.2), (2, 7.2)] {
        rug(&mut b.on(palette.carpets[i]), vec2(x, 2.05), vec2(3.0, 1.5));
    }
}
