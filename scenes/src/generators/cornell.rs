//! The Cornell box: two metres wide, open towards the viewer at +z, with two rotated blocks.

use glam::{Vec2, Vec3, vec2, vec3};

use super::{Geometry, build::Builder};

/// Builds the box. The room is x -1..1, y 0..2, z -1..1. The blocks stand on the floor and have no bottom face.
pub fn build() -> Geometry {
    let mut b = Builder::default();
    let white = b.plain("white", [0.725, 0.71, 0.68]);
    let red = b.plain("red", [0.63, 0.065, 0.05]);
    let green = b.plain("green", [0.14, 0.45, 0.091]);
    let corner = |x: f32, y: f32, z: f32| vec3(x, y, z);
    let mut walls = b.on(white);
    walls.quad([corner(-1., 0., 1.), corner(1., 0., 1.), corner(1., 0., -1.), corner(-1., 0., -1.)]);
    walls.quad([corner(-1., 2., 1.), corner(-1., 2., -1.), corner(1., 2., -1.), corner(1., 2., 1.)]);
    walls.quad([corner(-1., 0., -1.), corner(1., 0., -1.), corner(1., 2., -1.), corner(-1., 2., -1.)]);
    for (centre, degrees, height) in [(vec2(0.33, 0.37), -17.0, 0.6), (vec2(-0.35, -0.3), 17.0, 1.2)] {
        block(&mut walls, centre, degrees, height);
    }
    b.on(red).quad([corner(-1., 0., 1.), corner(-1., 0., -1.), corner(-1., 2., -1.), corner(-1., 2., 1.)]);
    b.on(green).quad([corner(1., 0., 1.), corner(1., 2., 1.), corner(1., 2., -1.), corner(1., 0., -1.)]);
    b.finish()
}

/// A block on the floor, 0.6 m square, `centre` in (x, z), rotated about +y.
fn block(pen: &mut super::build::Pen<'_>, centre: Vec2, degrees: f32, height: f32) {
    let (sin, cos) = f32::to_radians(degrees).sin_cos();
    let foot = [(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)]
        .map(|(x, z)| vec3(centre.x + x * cos + z * sin, 0.0, centre.y - x * sin + z * cos));
    let top = foot.map(|p| p + Vec3::Y * height);
    pen.quad([top[3], top[2], top[1], top[0]]);
    for i in 0..4 {
        let j = (i + 1) % 4;
        pen.quad([foot[i], top[i], top[j], foot[j]]);
    }
}
