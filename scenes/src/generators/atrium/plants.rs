//! Alpha-masked plants: potted shrubs and palms, ivy that climbs columns and hangs from the gallery.

use std::f32::consts::TAU;

use glam::{Vec3, vec3};

use super::{BAY, Palette, SPRING, STEP, Side, UPPER, WALL, furniture::pots};
use crate::generators::{
    build::{Builder, Chance, Pen},
    parts::{card, palm, shrub},
};

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
