#![allow(clippy::unwrap_used)]

use std::f32::consts::TAU;

use glam::{Vec2, Vec3, vec2, vec3};

use super::*;
use crate::{
    Mesh,
    generators::{build::Chance, rays},
};

/// The eye of scenes/room.toml.
const EYE: Vec3 = vec3(2.62, 1.42, 1.9);

fn mesh<'a>(room: &'a Geometry, name: &str) -> &'a Mesh {
    room.meshes.iter().find(|mesh| mesh.name == name).unwrap()
}

fn points(mesh: &Mesh) -> impl Iterator<Item = Vec3> {
    mesh.positions.iter().map(|&p| Vec3::from(p))
}

/// Distance along a ray to the nearest triangle of a mesh.
fn hit(mesh: &Mesh, origin: Vec3, direction: Vec3) -> Option<f32> {
    rays::hit(mesh, origin, direction).map(|(distance, _)| distance)
}

/// Uniform on the sphere.
fn direction(chance: &mut Chance) -> Vec3 {
    let (y, turn) = (chance.between(-1.0, 1.0), TAU * chance.unit());
    let across = (1.0 - y * y).sqrt();
    vec3(across * turn.cos(), y, across * turn.sin())
}

fn within(x: f32, range: [f32; 2]) -> bool {
    (range[0]..=range[1]).contains(&x)
}

/// Whether a ray from inside leaves through the opening of a window: where it crosses the inner face of the wall.
fn through_a_window(origin: Vec3, direction: Vec3) -> [bool; 2] {
    let west = origin + direction * ((-HALF[0] - origin.x) / direction.x);
    let north = origin + direction * ((-HALF[1] - origin.z) / direction.z);
    [
        direction.x < 0.0 && within(west.y, WINDOW) && within(west.z, WEST),
        direction.z < 0.0 && within(north.y, WINDOW) && within(north.x, NORTH),
    ]
}

#[test]
fn the_walls_are_closed_but_for_the_windows() {
    let room = build();
    let walls = mesh(&room, "plaster");
    let mut chance = Chance::new(3);
    let (mut inside, mut outside) = (0, [0; 2]);
    for _ in 0..60_000 {
        let at = |half: f32, chance: &mut Chance| chance.between(-half + 0.05, half - 0.05);
        let origin = vec3(at(HALF[0], &mut chance), chance.between(0.05, HEIGHT - 0.05), at(HALF[1], &mut chance));
        let direction = direction(&mut chance);
        let windows = through_a_window(origin, direction);
        match hit(walls, origin, direction) {
            Some(_) => inside += 1,
            None => {
                assert!(windows != [false; 2], "a ray from {origin} along {direction} leaves through a wall");
                (0..2).for_each(|i| outside[i] += windows[i] as usize);
            }
        }
    }
    // The windows take 4 % of the inner surface. Rays that enter an opening may end at its reveal.
    assert!(inside > 50_000 && outside.iter().all(|&n| n > 300), "{inside} inside, {outside:?} through the windows");
}

#[test]
fn solid_parts_are_watertight() {
    let room = build();
    let mut solid = vec!["plaster", "paint", "planks", "planks_dark", "planks_light", "walnut", "oak", "brass"];
    solid.extend(["velvet", "linen", "ochre", "shade", "bulb", "orange", "paper"]);
    solid.extend(room.meshes.iter().map(|mesh| mesh.name.as_str()).filter(|name| name.starts_with("cover_")));
    assert_eq!(solid.len(), 24, "{solid:?}");
    for name in solid {
        assert!(mesh(&room, name).is_watertight(), "{name}");
    }
}

#[test]
fn everything_is_inside_the_walls() {
    let room = build();
    let [x, z] = HALF;
    let (mut low, mut high) = (Vec3::MAX, Vec3::MIN);
    for mesh in &room.meshes {
        for p in points(mesh) {
            (low, high) = (low.min(p), high.max(p));
            let inside = p.abs().x <= x && (-0.02..=HEIGHT).contains(&p.y) && p.abs().z <= z;
            let west = p.x < -x && within(p.z, WEST) && within(p.y, WINDOW);
            let north = p.z < -z && within(p.x, NORTH) && within(p.y, WINDOW);
            let door = p.z < -z && within(p.x, DOOR) && p.y <= DOOR_HEIGHT;
            assert!(
                mesh.name == "plaster" || inside || west || north || door,
                "{} reaches into a wall at {p}",
                mesh.name
            );
        }
    }
    let outer = vec3(x + WALL, 0.0, z + WALL);
    // The structure under the boards is the lowest part.
    assert_eq!((low.with_y(0.0), high.with_y(0.0)), (-outer, outer));
    assert_eq!(high.y, HEIGHT + WALL);
    assert!((low.y + 0.02 + WALL).abs() < 1e-6, "{low}");
}

#[test]
fn the_scene_file_loads_with_its_sky() {
    let scene = rays::bundled("room");
    assert_eq!(scene.warnings, Vec::<String>::new());
    assert_eq!((scene.lights.len(), scene.camera.eye), (0, EYE.to_array()));
    let sky = scene.environment.unwrap();
    assert_eq!((sky.width, sky.height), (256, 128));
    // The sun is 21 degrees high and about four degrees wide: the sky within five degrees of it gives more light than
    // all the rest of the upper half together, on a surface that faces the sun.
    let sun = vec3(-0.90, 0.36, 0.29).normalize();
    let (mut near, mut far, mut largest) = (0.0, 0.0, 0.0_f32);
    for (i, texel) in sky.texels.iter().enumerate() {
        let longitude = ((i as u32 % sky.width) as f32 + 0.5) / sky.width as f32 * TAU - 0.5 * TAU;
        let latitude = ((i as u32 / sky.width) as f32 + 0.5) / sky.height as f32 * 0.5 * TAU;
        let direction = vec3(latitude.sin() * longitude.sin(), latitude.cos(), -latitude.sin() * longitude.cos());
        let solid_angle = TAU / sky.width as f32 * 0.5 * TAU / sky.height as f32 * latitude.sin();
        let green = texel[1] * solid_angle * direction.dot(sun).max(0.0);
        largest = largest.max(texel[0]);
        match direction.angle_between(sun) < 5_f32.to_radians() {
            true => near += green,
            false if direction.y > 0.0 => far += green,
            false => {}
        }
    }
    assert!(near > far && near < 10.0 * far, "{near} and {far} W m^-2");
    assert!(within(largest, [1000.0, 1600.0]), "{largest}");
}

#[test]
fn only_the_bulb_emits_and_its_shade_is_open_above_and_below() {
    let room = build();
    let emitters: Vec<_> = room.materials.iter().filter(|m| m.emission != [0.0; 3]).map(|m| &m.name).collect();
    assert_eq!(emitters, ["bulb"]);
    let (low, high) = points(mesh(&room, "bulb")).fold((Vec3::MAX, Vec3::MIN), |(l, h), p| (l.min(p), h.max(p)));
    let (centre, size) = (0.5 * (low + high), high - low);
    assert!((size - 0.04).abs().max_element() < 1e-5, "{size}");
    let shade = mesh(&room, "shade");
    assert_eq!(hit(shade, centre, Vec3::Y), None);
    assert_eq!(hit(shade, centre, Vec3::NEG_Y), None);
    for offset in [Vec3::ZERO, 0.5 * size.x * Vec3::Y, -0.5 * size.x * Vec3::Y] {
        let towards = EYE - (centre + offset);
        let blocked = hit(shade, centre + offset, towards.normalize());
        assert!(blocked.is_some_and(|distance| distance < 0.25), "the camera sees the bulb");
    }
}

#[test]
fn albedos_are_plausible() {
    let room = build();
    let linear = |c: u8| (c as f32 / 255.0).powf(2.2);
    let mean = |name: &str| {
        let material = room.materials.iter().find(|m| m.name == name).unwrap();
        let Some(index) = material.albedo_texture else { return Vec3::from(material.albedo) };
        let texels = room.textures[index].rgba.chunks_exact(4);
        let count = texels.len() as f32;
        texels.map(|t| vec3(linear(t[0]), linear(t[1]), linear(t[2]))).sum::<Vec3>() / count
    };
    for (name, range) in [
        ("plaster", [0.7, 0.8]),
        ("paint", [0.65, 0.8]),
        ("planks", [0.2, 0.5]),
        ("oak", [0.2, 0.5]),
        ("walnut", [0.1, 0.3]),
    ] {
        let luminance = mean(name).dot(vec3(0.2126, 0.7152, 0.0722));
        assert!(within(luminance, range), "{name}: {luminance}");
    }
    // The accent is saturated: it reflects at least five times as much red as blue.
    let velvet = mean("velvet");
    assert!(velvet.x > 5.0 * velvet.z, "{velvet}");
}

#[test]
fn books_stand_inside_the_shelf() {
    let room = build();
    // Footprint of the shelf in (x, z), and the pile on the table.
    let shelf = [vec2(-HALF[0], -HALF[1]), vec2(-HALF[0] + 0.019 + 0.29, -HALF[1] + 0.18 + 1.36)];
    let table = [vec2(-0.6, -0.7), vec2(0.7, 0.15)];
    let inside = |p: Vec2, [low, high]: [Vec2; 2]| p.cmpge(low).all() && p.cmple(high).all();
    let covers = || room.meshes.iter().filter(|mesh| mesh.name.starts_with("cover_"));
    for p in covers().flat_map(points) {
        let flat = vec2(p.x, p.z);
        assert!((inside(flat, shelf) && p.y < 2.06) || (inside(flat, table) && p.y < 0.55), "{p}");
    }
    // A cover is five cells with 22 outer faces.
    let triangles: usize = covers().map(|mesh| mesh.indices.len() / 3).sum();
    assert!(triangles.is_multiple_of(44) && triangles / 44 > 100, "{} books", triangles as f32 / 44.0);
}
