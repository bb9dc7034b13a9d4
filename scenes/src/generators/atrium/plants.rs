//! Alpha-masked plants: potted shrubs and palms, ivy that climbs columns and hangs from the gallery.

use std::f32::consts::TAU;

use glam::{Vec3, vec2, vec3};

use super::{BAY, Palette, SPRING, STEP, Side, UPPER, WALL, furniture::pots};
use crate::generators::build::{Builder, Chance, Pen};

/// The plants of one side of the court.
pub fn side(b: &mut Builder, palette: &Palette, side: &Side) {
    let seed = (side.frame.translation.x * 8.0 + side.frame.translation.z) as i32 as u32;
    let mut chance = Chance::new(seed);
    for i in 0..side.bays {
        let x = (i as f32 + 0.5) * BAY;
        if chance.unit() < 0.75 {
            for _ in 0..chance.between(5.0, 11.0) as usize {
                let start = vec3(x + chance.between(-0.75, 0.75), UPPER + 0.05, 0.16);
                let length = chance.between(0.4, 1.5);
                hanging(&mut b.on(palette.ivy), start, length, &mut chance);
            }
        }
    }
    for i in (1..side.bays).filter(|i| side.long && i % 3 == 2) {
        climber(&mut b.on(palette.ivy), i as f32 * BAY, &mut chance);
    }
}

/// The potted plants of the court.
pub fn court(b: &mut Builder, palette: &Palette) {
    for (i, (foot, scale, terracotta)) in pots().into_iter().enumerate() {
        let mut chance = Chance::new(1000 + i as u32);
        let soil = foot + Vec3::Y * 0.74 * scale;
        if scale > 1.05 {
            palm(&mut b.on(palette.frond), soil, scale, &mut chance);
        } else if terracotta {
            shrub(&mut b.on(palette.blossom), soil, 0.52, &mut chance);
        } else {
            shrub(&mut b.on(palette.leaves), soil, 0.55, &mut chance);
        }
    }
}

/// A card of leaves from `base` towards `tip`, `width` wide, facing `facing`, bent by gravity.
fn card(pen: &mut Pen<'_>, base: Vec3, tip: Vec3, width: f32, facing: Vec3, bend: f32) {
    let along = tip - base;
    let across = along.cross(facing).normalize_or(Vec3::X) * (0.5 * width);
    pen.sheet(1, 2, |s, t| {
        let droop = Vec3::NEG_Y * (bend * t * t * along.length());
        (base + along * t + droop + across * (2.0 * s - 1.0), vec2(s, 1.0 - t))
    });
}

/// A round bush of sprigs.
fn shrub(pen: &mut Pen<'_>, foot: Vec3, size: f32, chance: &mut Chance) {
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
fn palm(pen: &mut Pen<'_>, foot: Vec3, scale: f32, chance: &mut Chance) {
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

/// A strand of ivy that falls from `start` in front of the wall.
fn hanging(pen: &mut Pen<'_>, start: Vec3, length: f32, chance: &mut Chance) {
    let count = (length / 0.11) as usize;
    for i in 0..count {
        let t = i as f32 / count as f32;
        let base = start + vec3(0.05 * (9.0 * t + start.x).sin(), 0.12 - length * t, 0.10 - 0.05 * t);
        let size = 0.30 - 0.10 * t;
        let tip = base + vec3(chance.between(-0.16, 0.16), -size, chance.between(-0.02, 0.10));
        let facing = vec3(chance.between(-0.7, 0.7), 0.3, 1.0);
        card(pen, base, tip, size * 0.95, facing, 0.0);
    }
}

/// Ivy that winds up the column at `x` and spreads over the spandrel above it.
fn climber(pen: &mut Pen<'_>, x: f32, chance: &mut Chance) {
    let axis = vec3(x, 0.0, -0.5 * WALL);
    for i in 0..150 {
        let t = i as f32 / 150.0;
        let turn = TAU * chance.unit();
        let out = vec3(turn.cos(), 0.0, turn.sin());
        let y = STEP + 0.3 + 2.6 * t * chance.between(0.6, 1.0);
        let base = axis + out * 0.27 + Vec3::Y * y;
        let size = chance.between(0.2, 0.32);
        let tip = base + out * 0.07 + out.cross(Vec3::Y) * chance.between(-0.15, 0.15) + Vec3::Y * size * 0.7;
        card(pen, base, tip, size, out, chance.between(0.1, 0.5));
    }
    for _ in 0..130 {
        let y = SPRING - 0.4 + 1.7 * chance.unit();
        let spread = 0.12 + 0.22 * ((y - SPRING).max(0.0)).powf(1.2);
        let base = vec3(
            x + spread * (chance.unit() + chance.unit() - 1.0) * 1.6,
            y,
            0.06 + if y < SPRING { 0.2 } else { 0.0 },
        );
        let size = chance.between(0.2, 0.3);
        let tip = base + vec3(chance.between(-0.2, 0.2), chance.between(-0.25, 0.1), 0.05);
        card(pen, base, tip, size, vec3(chance.between(-0.6, 0.6), 0.3, 1.0), 0.1);
    }
}
