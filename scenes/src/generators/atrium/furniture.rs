//! Railings, rods, lanterns, vases and the fountain.

use std::f32::consts::TAU;

use glam::{Vec3, vec3};

use super::{BAY, DEPTH, HALF, Palette, SPRING, Side, UPPER, WALL};
use crate::generators::{
    build::{Builder, Pen, Profile},
    parts::pot,
};

/// Height of the curtain rods, metres.
pub const ROD: f32 = SPRING - 0.16;
/// Position of the upper gallery's railing in the local z of a side, metres.
pub const RAIL: f32 = -0.2;

/// The thin parts of one side: tie rods, railing, lamps and flag poles.
pub fn side(b: &mut Builder, palette: &Palette, side: &Side) {
    let mut iron = b.on(palette.iron);
    for i in 0..side.bays {
        let x = [i as f32 * BAY + 0.15, (i + 1) as f32 * BAY - 0.15];
        // The tie that holds each arch together, and the rod for its curtain.
        iron.tube(&x.map(|x| vec3(x, SPRING + 0.09, -0.5 * WALL)), 0.02, 6);
        iron.tube(&x.map(|x| vec3(x, ROD, -0.5 * WALL)), 0.014, 6);
        lamp(&mut iron, vec3((i as f32 + 0.5) * BAY, 2.75, -WALL - 0.5 * DEPTH));
    }
    railing(&mut iron, side);
    for i in (1..side.bays).filter(|i| side.long && i % 2 == 1) {
        flag_pole(b, palette, i as f32 * BAY);
    }
}

fn railing(pen: &mut Pen<'_>, side: &Side) {
    let bars = side.bays * 24;
    for (height, radius) in [(0.95, 0.022), (0.82, 0.012), (0.12, 0.014)] {
        pen.tube(&[-0.02, side.length() + 0.02].map(|x| vec3(x, UPPER + height, RAIL)), radius, 6);
    }
    for i in 0..bars {
        let x = (i as f32 + 0.5) * side.length() / bars as f32;
        pen.tube(&[0.12, 0.95].map(|y| vec3(x, UPPER + y, RAIL)), 0.008, 5);
        // A ring in every second gap of the frieze under the handrail.
        if i % 2 == 0 {
            let centre = vec3(x + 0.052, UPPER + 0.885, RAIL);
            let ring: Vec<Vec3> = (0..=8)
                .map(|k| {
                    let (sin, cos) = (TAU * (k % 8) as f32 / 8.0).sin_cos();
                    centre + vec3(cos, sin, 0.0) * 0.042
                })
                .collect();
            pen.tube(&ring, 0.006, 3);
        }
    }
}

/// A lantern on a chain from the crown of the vault; `foot` is its lowest point.
fn lamp(pen: &mut Pen<'_>, foot: Vec3) {
    pen.tube(&[foot + Vec3::Y * 0.42, vec3(foot.x, 4.82, foot.z)], 0.007, 4);
    let cap = Profile::new(&[[0.15, 0.31], [0.16, 0.33], [0.10, 0.38], [0.03, 0.42], [0.0, 0.46]]);
    pen.lathe(foot, &cap, 12);
    let base = Profile::new(&[[0.0, 0.0], [0.04, 0.01], [0.10, 0.06], [0.13, 0.07], [0.13, 0.09], [0.0, 0.09]]);
    pen.lathe(foot, &base, 12);
    for k in 0..6 {
        let (sin, cos) = (TAU * k as f32 / 6.0).sin_cos();
        pen.tube(
            &[vec3(cos * 0.115, 0.08, sin * 0.115), vec3(cos * 0.14, 0.32, sin * 0.14)].map(|p| foot + p),
            0.007,
            4,
        );
    }
}

/// Foot and head of the pole that leans out over the court above the column at `x`.
pub fn pole(x: f32) -> [Vec3; 2] {
    [vec3(x, UPPER - 0.75, -0.1), vec3(x, UPPER + 0.45, 1.75)]
}

fn flag_pole(b: &mut Builder, palette: &Palette, x: f32) {
    let [foot, head] = pole(x);
    b.on(palette.wood).tube(&[foot, head], 0.024, 8);
    let knob = Profile::new(&[
        [0.0, -0.05],
        [0.03, -0.045],
        [0.05, -0.02],
        [0.055, 0.0],
        [0.05, 0.02],
        [0.03, 0.05],
        [0.012, 0.09],
        [0.0, 0.14],
    ]);
    b.on(palette.bronze).lathe(head, &knob, 12);
    b.on(palette.iron).tube(&[vec3(x, UPPER - 0.34, -0.05), foot.lerp(head, 0.35)], 0.009, 5);
}

/// The furniture of the court itself.
pub fn court(b: &mut Builder, palette: &Palette) {
    fountain(b, palette, vec3(0.6, 0.0, 0.1));
    for (foot, scale, glazed) in pots() {
        let glaze = if glazed { palette.terracotta } else { palette.marble };
        pot(b, glaze, palette.soil, foot, scale);
    }
}

/// Positions of potted plants: foot, scale, and whether the pot is terracotta.
pub fn pots() -> Vec<(Vec3, f32, bool)> {
    let z = HALF[1] - 0.78;
    let mut pots = vec![];
    for i in 1..10 {
        let x = -HALF[0] + i as f32 * BAY;
        if i % 3 != 1 {
            pots.push((vec3(x, 0.0, -z), 1.0, i % 3 == 0));
        }
        pots.push((vec3(x, 0.0, z), if i % 3 == 2 { 0.85 } else { 1.0 }, i % 2 == 1));
    }
    for z in [-1.25, 1.25] {
        pots.push((vec3(HALF[0] - 0.85, 0.0, z), 1.25, true));
    }
    pots.push((vec3(-HALF[0] + 2.0 * BAY, 0.0, -z), 1.1, true));
    pots.push((vec3(-HALF[0] + 2.0 * BAY - 0.8, 0.0, z - 0.25), 0.7, true));
    pots
}

fn fountain(b: &mut Builder, palette: &Palette, foot: Vec3) {
    let basin = Profile::new(&[
        [1.50, -0.05],
        [1.50, 0.09],
        [1.42, 0.11],
        [1.37, 0.16],
        [1.34, 0.24],
        [1.34, 0.40],
        [1.38, 0.45],
        [1.44, 0.48],
        [1.46, 0.52],
        [1.46, 0.57],
        [1.43, 0.60],
        [1.22, 0.60],
        [1.19, 0.58],
        [1.18, 0.54],
        [1.18, 0.08],
        [0.2, 0.08],
    ]);
    let pedestal = Profile::new(&[
        [0.36, 0.07],
        [0.36, 0.26],
        [0.30, 0.30],
        [0.22, 0.36],
        [0.17, 0.46],
        [0.15, 0.60],
        [0.16, 0.74],
        [0.20, 0.84],
        [0.24, 0.87],
        [0.24, 0.91],
        [0.20, 0.94],
        [0.18, 0.98],
        [0.22, 1.03],
        [0.38, 1.08],
        [0.56, 1.15],
        [0.68, 1.24],
        [0.72, 1.32],
        [0.75, 1.33],
        [0.75, 1.37],
        [0.70, 1.38],
        [0.66, 1.35],
        [0.62, 1.28],
        [0.1, 1.22],
    ]);
    let finial = Profile::new(&[
        [0.12, 1.20],
        [0.12, 1.34],
        [0.08, 1.38],
        [0.06, 1.46],
        [0.08, 1.50],
        [0.15, 1.56],
        [0.18, 1.66],
        [0.16, 1.76],
        [0.10, 1.86],
        [0.04, 1.93],
        [0.0, 1.95],
    ]);
    let mut marble = b.on(palette.marble);
    marble.lathe(foot, &basin, 64);
    marble.lathe(foot, &pedestal, 40);
    marble.lathe(foot, &finial, 24);
    let mut water = b.on(palette.water);
    water.lathe(foot, &Profile::new(&[[1.2, 0.50], [0.1, 0.50]]), 64);
    water.lathe(foot, &Profile::new(&[[0.67, 1.345], [0.05, 1.345]]), 40);
}
