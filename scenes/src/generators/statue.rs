//! A winged statue in a corner of coloured walls, similar to Figures 1 and 6 of Lambru et al.: a wall outside the image
//! tints surfaces inside it. The floor is glossy.

use std::f32::consts::{PI, TAU};

use glam::{vec2, vec3};

use super::{
    Geometry,
    build::{Builder, Pen, Profile},
};
use crate::Material;

/// Half the room's width and depth, and its height, metres. It is open towards +z, -x and above.
const ROOM: [f32; 2] = [1.5, 2.6];

/// Builds floor, back wall, the wall on the right and the statue on its block.
pub fn build() -> Geometry {
    let mut b = Builder::default();
    let floor = Material {
        name: "floor".into(),
        albedo: [0.12, 0.16, 0.36],
        specular: [0.6; 3],
        phong_exponent: 400.0,
        ..Material::default()
    };
    let floor = b.add(floor, 1.0);
    let back = b.plain("back", [0.66, 0.63, 0.58]);
    let right = b.plain("right", [0.10, 0.62, 0.12]);
    let stone = b.plain("stone", [0.74, 0.73, 0.70]);
    let [w, h] = ROOM;
    b.on(floor).quad([vec3(-w, 0., w), vec3(w, 0., w), vec3(w, 0., -w), vec3(-w, 0., -w)]);
    b.on(back).quad([vec3(-w, 0., -w), vec3(w, 0., -w), vec3(w, h, -w), vec3(-w, h, -w)]);
    b.on(right).quad([vec3(w, 0., w), vec3(w, h, w), vec3(w, h, -w), vec3(w, 0., -w)]);
    let mut pen = b.on(stone);
    pen.block(vec3(-0.3, 0.0, -0.3), vec3(0.3, 0.22, 0.3));
    gown(&mut pen, 0.22);
    // Neck and head.
    let head: Vec<[f32; 2]> = (0..=12)
        .map(|i| {
            let (sin, cos) = (0.12 * PI + 0.88 * PI * i as f32 / 12.0).sin_cos();
            [if i == 12 { 0.0 } else { 0.095 * sin }, -0.115 * cos]
        })
        .collect();
    pen.lathe(vec3(0.0, 1.56, 0.02), &Profile::new(&head), 24);
    pen.lathe(vec3(0.0, 1.36, 0.02), &Profile::new(&[[0.075, 0.0], [0.05, 0.06], [0.05, 0.12]]), 16);
    // Folded hands.
    let hands: Vec<[f32; 2]> = (0..=10)
        .map(|i| {
            let (sin, cos) = (PI * i as f32 / 10.0).sin_cos();
            [if i % 10 == 0 { 0.0 } else { 0.065 * sin }, -0.065 * cos]
        })
        .collect();
    pen.lathe(vec3(0.0, 1.02, 0.245), &Profile::new(&hands), 20);
    for side in [-1.0, 1.0] {
        wing(&mut pen, side);
        let shoulder = vec3(0.15 * side, 1.30, 0.02);
        let elbow = vec3(0.24 * side, 1.08, 0.10);
        pen.tube(&[shoulder, elbow, vec3(0.03 * side, 1.02, 0.25)], 0.04, 12);
    }
    b.finish()
}

/// Body and gown, from the foot up to the shoulders. The folds are deep at the hem and vanish at the waist.
fn gown(pen: &mut Pen<'_>, foot: f32) {
    // Radius by height, both in metres.
    let outline = [
        [0.27, 0.0],
        [0.25, 0.12],
        [0.21, 0.35],
        [0.175, 0.58],
        [0.135, 0.76],
        [0.15, 0.90],
        [0.175, 1.02],
        [0.15, 1.10],
        [0.05, 1.19],
    ];
    let radius = |y: f32| {
        let pair = outline.windows(2).find(|pair| y <= pair[1][1]).unwrap_or(&outline[7..]);
        let [[r0, y0], [r1, y1]] = [pair[0], pair[1]];
        let t = ((y - y0) / (y1 - y0)).clamp(0.0, 1.0);
        r0 + (r1 - r0) * t * t * (3.0 - 2.0 * t)
    };
    pen.sheet(72, 36, |s, t| {
        let turn = if s == 1.0 { 0.0 } else { s * TAU };
        let y = 1.19 * t;
        let folds = 0.09 * (1.0 - t / 0.62).max(0.0) * (11.0 * turn + 2.0 * t).cos();
        // The shoulders are wider than deep.
        let (sin, cos) = turn.sin_cos();
        let r = radius(y) * (1.0 + folds);
        (vec3(r * cos, foot + y, -0.8 * r * sin), vec2(turn * 0.2, y))
    });
}

/// A wing from the back outwards and upwards, its edge scalloped by feathers.
fn wing(pen: &mut Pen<'_>, side: f32) {
    let point = move |s: f32, t: f32| {
        let spread = 0.08 + 0.50 * s;
        let top = 1.28 + 0.46 * s.powf(0.6) - 0.22 * s.powi(4);
        let feathers = 0.04 * (9.0 * PI * s).sin().abs();
        // Rounded at its tip.
        let length = 0.75 * (1.0 - 0.45 * s) * (1.0 - 0.97 * s.powi(3)).sqrt() + feathers;
        let bow = 0.10 * (PI * t).sin() * (1.0 - s);
        vec3(side * spread, top - length * t, -0.16 - 0.22 * s * s - bow)
    };
    // Faces the viewer on both sides.
    pen.sheet(36, 16, |s, t| {
        let s = if side > 0.0 { s } else { 1.0 - s };
        (point(s, 1.0 - t), vec2(s, t))
    });
}
