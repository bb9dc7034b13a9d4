//! Walls, floor, ceiling, windows, door, skirting boards and curtains.

use glam::{Affine3A, Vec3, vec3};

use super::{DOOR, DOOR_HEIGHT, GAP, HALF, HEIGHT, NORTH, Palette, WALL, WEST, WINDOW, north, west};
use crate::generators::{
    build::{Builder, Chance},
    parts::Curtain,
};

/// Thickness of the floor boards, metres. Their upper side is at y = 0.
const BOARD: f32 = 0.02;
/// Depth of the door's recess, metres.
const RECESS: f32 = 0.10;

/// Draws the room without its furniture.
pub fn draw(b: &mut Builder, palette: &Palette) {
    walls(b, palette);
    floor(b, palette);
    b.frame = west();
    // Local x of this wall runs against z.
    window(b, palette, [HALF[1] - WEST[1], HALF[1] - WEST[0]], 1);
    b.frame = north();
    window(b, palette, NORTH.map(|x| x + HALF[0]), 5);
    door(b, palette);
    b.frame = Affine3A::IDENTITY;
    skirting(b, palette);
    cornice(b, palette);
}

/// One body: a box around the room, with the openings of the windows and the recess of the door.
fn walls(b: &mut Builder, palette: &Palette) {
    let [x, z] = HALF;
    let xs = [-x - WALL, -x, NORTH[0], NORTH[1], DOOR[0], DOOR[1], x, x + WALL];
    let ys = [-BOARD - WALL, -BOARD - GAP, WINDOW[0], DOOR_HEIGHT, WINDOW[1], HEIGHT, HEIGHT + WALL];
    let zs = [-z - WALL, -z - RECESS, -z, WEST[0], WEST[1], z, z + WALL];
    b.on(palette.plaster).cells([&xs, &ys, &zs], |[i, j, k]| {
        let room = (1..6).contains(&i) && (1..5).contains(&j) && (2..5).contains(&k);
        let in_window = (2..4).contains(&j);
        let west = i == 0 && in_window && k == 3;
        let north = i == 2 && in_window && k < 2;
        let door = i == 4 && (1..3).contains(&j) && k == 1;
        !(room || west || north || door)
    });
}

/// Boards along x with a gap between them, each with its own part of the texture.
fn floor(b: &mut Builder, palette: &Palette) {
    let mut chance = Chance::new(71);
    let rows = 32;
    let width = 2.0 * (HALF[1] - GAP) / rows as f32;
    for row in 0..rows {
        let z = -HALF[1] + GAP + row as f32 * width;
        let mut x = -HALF[0] + GAP;
        let mut length = chance.between(0.5, 1.9);
        while x < HALF[0] - 2.0 * GAP {
            let rest = HALF[0] - GAP - x;
            // No piece is shorter than 30 cm.
            let end = if rest - length < 0.3 { HALF[0] - GAP } else { x + length };
            let material = palette.planks[(chance.unit() * 3.0) as usize];
            let shift = vec3(chance.between(0.0, 9.0), 0.0, chance.between(0.0, 9.0));
            b.frame = Affine3A::from_translation(-shift);
            let gap = 0.0004;
            b.on(material).block(vec3(x + gap, -BOARD, z + gap) + shift, vec3(end - gap, 0.0, z + width - gap) + shift);
            x = end;
            length = chance.between(1.3, 2.0);
        }
    }
    b.frame = Affine3A::IDENTITY;
}

/// Frame with a mullion and a transom, sill and curtains of the opening between two local x.
fn window(b: &mut Builder, palette: &Palette, x: [f32; 2], seed: u32) {
    let bar = 0.032;
    let centre = 0.5 * (x[0] + x[1]);
    let transom = WINDOW[0] + 0.68 * (WINDOW[1] - WINDOW[0]);
    let low = WINDOW[0] + 0.036;
    let edge = 0.055;
    let xs = [x[0] + GAP, x[0] + edge, centre - bar, centre + bar, x[1] - edge, x[1] - GAP];
    let ys = [low + GAP, low + edge, transom - bar, transom + bar, WINDOW[1] - edge, WINDOW[1] - GAP];
    b.on(palette.paint).cells([&xs, &ys, &[-0.22, -0.16]], |[i, j, _]| i % 2 == 0 || j % 2 == 0);
    // The sill lies in the opening and projects a little in front of the wall.
    let ends = [x[0] - 0.05, x[0] + GAP, x[1] - GAP, x[1] + 0.05];
    b.on(palette.paint)
        .cells([&ends, &[WINDOW[0] + GAP, low], &[-WALL + 0.01, GAP, 0.045]], |[i, _, k]| k == 1 || i == 1);
    let rod = WINDOW[1] + 0.14;
    let reach = [x[0] - 0.34, x[1] + 0.34];
    let mut brass = b.on(palette.brass);
    brass.rod(reach.map(|x| vec3(x, rod, 0.09)), [0.011; 2], 12);
    for (end, hand) in [(reach[0], -1.0), (reach[1], 1.0)] {
        brass.ball(vec3(end + hand * 0.024, rod, 0.09), 0.022, 14);
        brass.rod([vec3(end - hand * 0.05, rod, GAP), vec3(end - hand * 0.05, rod, 0.078)], [0.008; 2], 8);
    }
    for (i, ends) in [[reach[0] + 0.03, x[0] + 0.07], [reach[1] - 0.03, x[1] - 0.07]].into_iter().enumerate() {
        let (top, seed) = (rod + 0.035, seed + i as u32);
        let curtain = Curtain { x: ends, top, drop: top - 0.03, z: 0.09, folds: 5.0, depth: 0.5, tied: false, seed };
        curtain.draw(&mut b.on(palette.curtain));
    }
}

/// A panelled door in its recess, with an architrave. It is shut.
fn door(b: &mut Builder, palette: &Palette) {
    let x = DOOR.map(|x| x + HALF[0]);
    let low = 0.006;
    let centre = 0.5 * (x[0] + x[1]);
    let (stile, rail) = (0.10, 0.06);
    let xs = [x[0] + 0.003, x[0] + stile, centre - 0.5 * stile, centre + 0.5 * stile, x[1] - stile, x[1] - 0.003];
    let ys = [low, low + 0.2, 0.95 - rail, 0.95 + rail, DOOR_HEIGHT - 0.12, DOOR_HEIGHT - 0.003];
    let zs = [-RECESS + 0.01, -0.055, -0.04];
    b.on(palette.paint).cells([&xs, &ys, &zs], |[i, j, k]| k == 0 || i % 2 == 0 || j % 2 == 0);
    let width = 0.075;
    let xs = [x[0] - width, x[0] - 0.004, x[1] + 0.004, x[1] + width];
    let ys = [GAP, DOOR_HEIGHT + 0.004, DOOR_HEIGHT + width];
    b.on(palette.paint).cells([&xs, &ys, &[GAP, 0.022]], |[i, j, _]| i != 1 || j == 1);
    let at = vec3(x[0] + 0.05, 1.02, 0.0);
    let mut brass = b.on(palette.brass);
    brass.rod([at + Vec3::Z * -0.039, at + Vec3::Z * -0.035], [0.024; 2], 16);
    brass.rod([at + Vec3::Z * -0.034, at + Vec3::Z * 0.012], [0.009; 2], 10);
    brass.rod([at + vec3(-0.012, 0.0, 0.022), at + vec3(0.105, 0.0, 0.022)], [0.009, 0.008], 10);
}

/// Skirting boards along all walls, interrupted by the door.
fn skirting(b: &mut Builder, palette: &Palette) {
    let [x, z] = HALF;
    let (height, thick) = (0.095, 0.016);
    let mut pen = b.on(palette.paint);
    let mut board = |low: [f32; 2], high: [f32; 2]| {
        pen.block(vec3(low[0], GAP, low[1]), vec3(high[0], height, high[1]));
    };
    for ends in [[-x + GAP, DOOR[0] - 0.077], [DOOR[1] + 0.077, x - GAP]] {
        board([ends[0], -z + GAP], [ends[1], -z + thick]);
    }
    board([-x + GAP, z - thick], [x - GAP, z - GAP]);
    board([-x + GAP, -z + thick + GAP], [-x + thick, z - thick - GAP]);
    board([x - thick, -z + thick + GAP], [x - GAP, z - thick - GAP]);
}

/// A stepped cornice along the ceiling.
fn cornice(b: &mut Builder, palette: &Palette) {
    let [x, z] = HALF;
    let steps = |half: f32| [GAP - half, 0.02 - half, 0.07 - half, half - 0.07, half - 0.02, half - GAP];
    let ys = [HEIGHT - 0.08, HEIGHT - 0.025, HEIGHT - GAP];
    // The upper step is wider than the lower one.
    b.on(palette.paint).cells([&steps(x), &ys, &steps(z)], |[i, j, k]| {
        let border = |i: usize, width: usize| i < width || i >= 5 - width;
        border(i, 1 + j) || border(k, 1 + j)
    });
}
