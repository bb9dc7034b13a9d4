//! Table, rug, lamp, plants and pictures.

use std::f32::consts::TAU;

use glam::{Affine3A, Vec3, vec2, vec3};

use super::{GAP, HALF, NORTH, Palette, WINDOW, north, shelf, stood};
use crate::generators::{
    build::{Builder, Chance, MaterialId, Profile},
    parts::{pot, rug, shrub},
};

/// Height of the rug's upper side, metres.
const RUG: f32 = 0.022;

/// Draws everything but the seats and the bookshelf.
pub fn draw(b: &mut Builder, palette: &Palette) {
    rug(&mut b.on(palette.rug), vec2(-0.15, -0.20), vec2(2.7, 1.75));
    b.frame = stood(vec3(0.05, RUG + GAP, -0.28), 4.0);
    table(b, palette);
    b.frame = Affine3A::IDENTITY;
    lamp(b, palette, vec3(-0.75, 0.0, -1.74));
    plants(b, palette);
    b.frame = north();
    let y = 1.55;
    for (x, [width, height], picture) in [(2.82, [0.46, 0.58], 0), (3.45, [0.58, 0.58], 1), (4.08, [0.46, 0.58], 2)] {
        framed(b, palette, palette.pictures[picture], vec3(x, y, 0.0), [width, height]);
    }
    b.frame = Affine3A::IDENTITY;
}

/// A low table 1.1 m long, with books and a bowl of oranges.
fn table(b: &mut Builder, palette: &Palette) {
    let xs = [-0.55, -0.53, -0.48, 0.48, 0.53, 0.55];
    let zs = [-0.30, -0.28, -0.23, 0.23, 0.28, 0.30];
    let ys = [0.0, 0.12, 0.14, 0.33, 0.375, 0.40];
    b.on(palette.walnut).cells([&xs, &ys, &zs], |[i, j, k]| {
        let inside = (1..4).contains(&i) && (1..4).contains(&k);
        let corner = i % 2 == 1 && k % 2 == 1 && inside;
        let apron = inside && (i % 2 == 1 || k % 2 == 1);
        match j {
            4 => true,
            3 => apron,
            // A lower board between the legs.
            1 => inside,
            _ => corner,
        }
    });
    let top = 0.40 + GAP;
    let table = b.frame;
    let mut y = top;
    for (cover, size, turn) in
        [(5, [0.034, 0.28, 0.21], 8.0), (2, [0.024, 0.25, 0.18], -5.0), (0, [0.028, 0.21, 0.15], 14.0)]
    {
        b.frame = table * stood(vec3(-0.30, y, -0.12), turn);
        shelf::lying(b, palette, palette.covers[cover], size);
        y += size[0] + GAP;
    }
    b.frame = table * stood(vec3(0.12, 0.14 + GAP, -0.1), -7.0);
    shelf::lying(b, palette, palette.covers[8], [0.03, 0.30, 0.22]);
    b.frame = table;
    let foot = vec3(0.24, top, 0.02);
    // A bowl with a wall 6 mm thick.
    let bowl = [
        [0.0, 0.0],
        [0.055, 0.0],
        [0.06, 0.012],
        [0.105, 0.035],
        [0.145, 0.085],
        [0.148, 0.09],
        [0.142, 0.09],
        [0.138, 0.086],
        [0.099, 0.041],
        [0.05, 0.02],
        [0.0, 0.018],
    ];
    b.on(palette.glaze).lathe(foot, &Profile::new(&bowl), 40);
    let mut oranges = b.on(palette.orange);
    for k in 0..4 {
        let (sin, cos) = (TAU * k as f32 / 4.0 + 0.4).sin_cos();
        oranges.ball(foot + vec3(0.055 * cos, 0.066, 0.055 * sin), 0.037, 20);
    }
    oranges.ball(foot + vec3(0.004, 0.117, -0.003), 0.036, 20);
}

/// A floor lamp whose bulb is hidden by a shade that is open above and below.
fn lamp(b: &mut Builder, palette: &Palette, foot: Vec3) {
    let socket = 1.40;
    let stand = Profile::new(&[
        [0.0, GAP],
        [0.14, GAP],
        [0.145, 0.006],
        [0.135, 0.018],
        [0.03, 0.028],
        [0.011, 0.045],
        [0.011, socket - 0.05],
        [0.017, socket - 0.045],
        [0.017, socket],
        [0.0, socket],
    ]);
    let mut brass = b.on(palette.brass);
    brass.lathe(foot, &stand, 24);
    // Three arms carry the shade.
    for k in 0..3 {
        let (sin, cos) = (TAU * k as f32 / 3.0).sin_cos();
        let out = vec3(cos, 0.0, sin);
        brass.rod(
            [foot + out * 0.018 + Vec3::Y * (socket - 0.02), foot + out * 0.183 + Vec3::Y * (socket - 0.02)],
            [0.003; 2],
            6,
        );
    }
    b.on(palette.bulb).ball(foot + Vec3::Y * (socket + 0.03), 0.02, 24);
    // The wall of the shade is 3 mm thick.
    let shade = Profile::new(&[[0.215, 1.30], [0.155, 1.60], [0.152, 1.60], [0.212, 1.30], [0.215, 1.30]]);
    b.on(palette.shade).lathe(foot, &shade, 48);
}

/// A small tree in a pot in the corner, and a plant on a window sill.
fn plants(b: &mut Builder, palette: &Palette) {
    let foot = vec3(-2.38, GAP + 0.012, 1.62);
    pot(b, palette.terracotta, palette.soil, foot, 0.52);
    let soil = foot + Vec3::Y * 0.40;
    let mut chance = Chance::new(7);
    for (lean, length) in
        [(vec3(0.10, 1.0, 0.02), 0.62), (vec3(-0.12, 1.0, -0.10), 0.46), (vec3(0.02, 1.0, -0.16), 0.78)]
    {
        let head = soil + lean.normalize() * length;
        b.on(palette.bark).tube(
            &[soil - Vec3::Y * 0.02, soil.lerp(head, 0.5) + vec3(0.01, 0.0, 0.012), head],
            0.011,
            7,
        );
        shrub(&mut b.on(palette.leaves), head - Vec3::Y * 0.05, 0.36, &mut chance);
    }
    let foot = vec3(NORTH[0] + 0.22, WINDOW[0] + 0.036 + GAP + 0.003, -HALF[1] - 0.07);
    pot(b, palette.glaze, palette.soil, foot, 0.17);
    shrub(&mut b.on(palette.leaves), foot + Vec3::Y * 0.125, 0.15, &mut chance);
}

/// A picture whose frame hangs on the wall, centred at `at`.
fn framed(b: &mut Builder, palette: &Palette, picture: MaterialId, at: Vec3, size: [f32; 2]) {
    let half = vec3(0.5 * size[0], 0.5 * size[1], 0.0);
    let (low, high) = (at - half, at + half);
    let bar = 0.022;
    let corner = |x: f32, y: f32| vec3(x, y, 0.012);
    b.on(picture).quad_uv(
        [corner(low.x, low.y), corner(high.x, low.y), corner(high.x, high.y), corner(low.x, high.y)],
        [vec2(0.0, 1.0), vec2(1.0, 1.0), vec2(1.0, 0.0), vec2(0.0, 0.0)],
    );
    let xs = [low.x - bar, low.x, high.x, high.x + bar];
    let ys = [low.y - bar, low.y, high.y, high.y + bar];
    b.on(palette.walnut).cells([&xs, &ys, &[0.004, 0.03]], |[i, j, _]| i != 1 || j != 1);
}
