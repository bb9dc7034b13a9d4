//! The bookshelf and its books.

use glam::{Affine3A, Mat3A, Vec3, vec3};

use super::{GAP, HALF, Palette, west};
use crate::generators::build::{Builder, Chance, MaterialId, Profile};

/// Width, height and depth of the bookshelf, metres.
const SHELF: [f32; 3] = [1.36, 2.06, 0.29];
/// Thickness of its boards, metres.
const BOARD: f32 = 0.022;
/// Number of compartments, one above the other.
const ROWS: usize = 6;

/// Draws the bookshelf at the wall at -x, in the corner at -z.
pub fn draw(b: &mut Builder, palette: &Palette) {
    b.frame = west() * Affine3A::from_translation(vec3(2.0 * HALF[1] - SHELF[0] - 0.18, 0.0, 0.019));
    let [width, height, depth] = SHELF;
    let middle = 0.5 * width;
    let xs = [GAP, BOARD, middle - 0.5 * BOARD, middle + 0.5 * BOARD, width - BOARD, width];
    let step = (height - 0.06 - BOARD) / ROWS as f32;
    let floors = (0..ROWS).map(|i| 0.06 + step * i as f32);
    let ys: Vec<f32> = [GAP].into_iter().chain(floors.flat_map(|y| [y + BOARD, y + step])).chain([height]).collect();
    b.on(palette.walnut).cells([&xs, &ys, &[0.0, 0.012, depth]], |[i, j, k]| k == 0 || i % 2 == 0 || j % 2 == 0);
    let mut chance = Chance::new(17);
    for row in 0..ROWS {
        for x in [[BOARD, middle - 0.5 * BOARD], [middle + 0.5 * BOARD, width - BOARD]] {
            let floor = 0.06 + BOARD + step * row as f32 + GAP;
            fill(b, palette, [x[0] + 0.004, x[1] - 0.004], floor, step - BOARD - 0.012, &mut chance);
        }
    }
}

/// Fills a compartment: upright books, then a pile, a vase or an empty place.
fn fill(b: &mut Builder, palette: &Palette, x: [f32; 2], floor: f32, height: f32, chance: &mut Chance) {
    let shelf = b.frame;
    let end = x[1] - if chance.unit() < 0.6 { chance.between(0.16, 0.30) } else { 0.0 };
    let mut at = x[0];
    let mut series: Option<(u32, MaterialId, [f32; 3])> = None;
    loop {
        // Some books belong to a series of equal volumes.
        let (cover, size) = match series {
            Some((left, cover, size)) => {
                series = (left > 1).then_some((left - 1, cover, size));
                (cover, size)
            }
            None => {
                let cover = palette.covers[(chance.unit() * palette.covers.len() as f32) as usize];
                let size =
                    [chance.between(0.016, 0.042), height * chance.between(0.66, 0.97), chance.between(0.15, 0.20)];
                if chance.unit() < 0.12 {
                    series = Some((chance.between(2.0, 5.0) as u32, cover, size));
                }
                (cover, size)
            }
        };
        if at + size[0] > end {
            break;
        }
        let front = SHELF[2] - 0.012 - chance.between(0.0, 0.008);
        b.frame = shelf * Affine3A::from_translation(vec3(at, floor, front - size[2]));
        book(b, palette, cover, size);
        at += size[0] + 0.0006;
    }
    let (centre, rest) = (0.5 * (at + x[1]), x[1] - at);
    b.frame = shelf;
    if rest > 0.15 && chance.unit() < 0.45 {
        let radius = 0.3 * rest;
        let tall = height * chance.between(0.5, 0.9);
        let vase =
            [[0.0, 0.0], [0.55, 0.0], [0.85, 0.25], [0.9, 0.45], [0.6, 0.75], [0.45, 0.9], [0.55, 1.0], [0.0, 0.94]];
        let profile = Profile::new(&vase.map(|[r, y]| [r * radius.min(0.07), y * tall]));
        let glaze = [palette.glaze, palette.terracotta, palette.linen][(chance.unit() * 3.0) as usize];
        b.on(glaze).lathe(vec3(centre, floor, 0.15), &profile, 24);
    } else if rest > 0.15 {
        let mut y = floor;
        for _ in 0..chance.between(2.0, 5.0) as u32 {
            let thick = chance.between(0.018, 0.036);
            let size = [thick, rest * chance.between(0.6, 0.8), 0.17];
            let cover = palette.covers[(chance.unit() * palette.covers.len() as f32) as usize];
            b.frame = shelf * Affine3A::from_translation(vec3(centre, y, 0.09));
            lying(b, palette, cover, size);
            y += thick + GAP;
        }
    }
    b.frame = shelf;
}

/// A book that stands with its spine towards +z: `size` is its thickness, height and depth, metres.
fn book(b: &mut Builder, palette: &Palette, cover: MaterialId, size: [f32; 3]) {
    let [width, height, depth] = size;
    let board = 0.0028;
    b.on(cover)
        .cells([&[0.0, board, width - board, width], &[0.0, height], &[0.0, depth - board, depth]], |[i, _, k]| {
            i != 1 || k == 1
        });
    let inset = board + 0.0004;
    b.on(palette.paper).block(vec3(inset, 0.004, 0.004), vec3(width - inset, height - 0.004, depth - inset));
}

/// A book that lies on its side on the current frame's origin, its spine towards +z, centred in x. Sizes as for
/// [`book`].
pub fn lying(b: &mut Builder, palette: &Palette, cover: MaterialId, size: [f32; 3]) {
    let frame = b.frame;
    // A quarter turn about z: the thickness points up.
    let turned = Mat3A::from_cols(Vec3::Y.into(), Vec3::NEG_X.into(), Vec3::Z.into());
    b.frame = frame * Affine3A { matrix3: turned, translation: vec3(0.5 * size[1], 0.0, 0.0).into() };
    book(b, palette, cover, size);
    b.frame = frame;
}
