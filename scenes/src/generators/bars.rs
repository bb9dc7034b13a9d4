//! Thin occluders: racks of bars from one millimetre to eight centimetres thick between lit, coloured panels and the
//! surfaces that the panels light. Screen-space methods often get the light past such bars wrong.

use std::f32::consts::{FRAC_PI_2, TAU};

use glam::{Vec3, vec3};

use super::{
    Geometry,
    build::{Builder, Pen},
};

/// Half the room's width, its height, and half its depth, metres. It is open towards +z.
const ROOM: [f32; 3] = [2.0, 2.4, 1.5];

/// Builds the room: four coloured panels, a rack of poles in front of each, finer rails in front of these, a ladder and a
/// cage.
pub fn build() -> Geometry {
    let mut b = Builder::default();
    let wall = b.plain("wall", [0.72, 0.70, 0.66]);
    let floor = b.plain("floor", [0.62, 0.60, 0.57]);
    let panels = [
        ("panel_red", [0.72, 0.08, 0.06]),
        ("panel_amber", [0.75, 0.46, 0.07]),
        ("panel_green", [0.10, 0.55, 0.16]),
        ("panel_blue", [0.08, 0.20, 0.70]),
    ];
    let panels = panels.map(|(name, albedo)| b.plain(name, albedo));
    let metal = b.plain("metal", [0.55, 0.55, 0.56]);
    let paint = b.plain("paint", [0.70, 0.66, 0.58]);
    let [w, h, d] = ROOM;
    b.on(floor).quad([vec3(-w, 0., d), vec3(w, 0., d), vec3(w, 0., -d), vec3(-w, 0., -d)]);
    let mut walls = b.on(wall);
    walls.quad([vec3(-w, h, -d), vec3(w, h, -d), vec3(w, h, d), vec3(-w, h, d)]);
    walls.quad([vec3(-w, 0., d), vec3(-w, 0., -d), vec3(-w, h, -d), vec3(-w, h, d)]);
    walls.quad([vec3(w, 0., -d), vec3(w, 0., d), vec3(w, h, d), vec3(w, h, -d)]);
    for (i, panel) in panels.into_iter().enumerate() {
        let x = [i as f32 - w, i as f32 + 1.0 - w];
        b.on(panel).quad([vec3(x[0], 0., -d), vec3(x[1], 0., -d), vec3(x[1], h, -d), vec3(x[0], h, -d)]);
        // Poles 1, 2, 4 and 8 cm thick, one thickness per panel.
        let radius = 0.005 * (1 << i) as f32;
        let mut pen = b.on(paint);
        for k in 0..6 {
            let x = x[0] + (k as f32 + 0.5) / 6.0;
            bar(&mut pen, vec3(x, -0.05, -1.1), vec3(x, 1.6, -1.1), radius);
        }
    }
    b.on(paint).block(vec3(-w - 0.05, 1.55, -1.16), vec3(w + 0.05, 1.65, -1.04));
    // Rails 8, 4, 2 and 1 mm thick, from the floor upwards, between posts.
    let mut pen = b.on(metal);
    for k in 0..12 {
        let y = 0.10 + 0.075 * k as f32;
        bar(&mut pen, vec3(-w - 0.05, y, -0.45), vec3(w + 0.05, y, -0.45), 0.004 / (1 << (k / 3)) as f32);
    }
    for i in 0..5 {
        let x = 0.98 * (i as f32 - 2.0);
        bar(&mut pen, vec3(x, -0.05, -0.45), vec3(x, 1.08, -0.45), 0.015);
        pen.block(vec3(x - 0.025, 1.06, -0.475), vec3(x + 0.025, 1.11, -0.425));
    }
    ladder(&mut b.on(paint), vec3(1.45, 0.0, 0.75), vec3(1.93, 2.0, 0.75));
    cage(&mut b.on(metal), vec3(-1.2, 0.75, 0.35));
    // Two blocks on the floor in front of the rails receive the shadows of the fine bars.
    let mut pen = b.on(wall);
    pen.block(vec3(-0.55, -0.05, -0.1), vec3(-0.2, 0.3, 0.25));
    pen.block(vec3(0.35, -0.05, 0.05), vec3(0.6, 0.55, 0.3));
    b.finish()
}

fn bar(pen: &mut Pen<'_>, from: Vec3, to: Vec3, radius: f32) {
    pen.tube(&[from, to], radius, 12);
}

/// A ladder that leans in the x-y plane from `foot` to `head`, the centres of its ends.
fn ladder(pen: &mut Pen<'_>, foot: Vec3, head: Vec3) {
    let half = Vec3::Z * 0.22;
    for hand in [-half, half] {
        bar(pen, foot + hand, head + hand, 0.02);
    }
    for k in 1..8 {
        let rung = foot.lerp(head, k as f32 / 8.0);
        bar(pen, rung - half, rung + half, 0.011);
    }
}

/// A bird cage of wire 3 mm thick on a cord from the ceiling; `foot` is the centre of its floor.
fn cage(pen: &mut Pen<'_>, foot: Vec3) {
    let (radius, wall) = (0.24, 0.34);
    let crown = foot + Vec3::Y * (wall + radius);
    for k in 0..20 {
        let (sin, cos) = (TAU * k as f32 / 20.0).sin_cos();
        let out = vec3(cos, 0.0, sin) * radius;
        let mut wire = vec![foot + out];
        wire.extend((0..8).map(|j| {
            let (up, across) = (FRAC_PI_2 * j as f32 / 8.2).sin_cos();
            foot + out * across + Vec3::Y * (wall + radius * up)
        }));
        pen.tube(&wire, 0.0015, 6);
    }
    for (height, thick) in [(0.0, 0.006), (wall, 0.003)] {
        let ring: Vec<Vec3> = (0..=32)
            .map(|k| {
                let (sin, cos) = (TAU * (k % 32) as f32 / 32.0).sin_cos();
                foot + vec3(cos * radius, height, sin * radius)
            })
            .collect();
        pen.tube(&ring, thick, 6);
    }
    pen.block(foot + vec3(-0.16, -0.005, -0.16), foot + vec3(0.16, 0.005, 0.16));
    bar(pen, crown - Vec3::Y * 0.02, vec3(foot.x, ROOM[1] + 0.05, foot.z), 0.003);
}
