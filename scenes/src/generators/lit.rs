//! Tests of what the lights of the small scenes reach.
#![allow(clippy::unwrap_used)]

use glam::Vec3;

use super::rays::{bundled, hit, is_lit, towards, view};
use crate::{Light, SceneNeeds};

#[test]
fn each_of_the_five_lights_lights_its_own_part_of_the_image() {
    let scene = bundled("lights");
    let needs = SceneNeeds::of(&scene);
    let count = |of: fn(&Light) -> bool| scene.lights.iter().filter(|&light| of(light)).count();
    let kinds = [
        count(|light| matches!(light, Light::Directional { .. })),
        count(|light| matches!(light, Light::Spot { .. })),
        count(|light| matches!(light, Light::Point { .. })),
    ];
    assert_eq!((kinds, needs.lights), ([1, 2, 2], 5));
    assert!(needs.open_meshes == 0 && needs.watertight_meshes == 5, "{needs:?}");
    let seen: Vec<_> = view(&scene, &scene.camera).into_iter().flatten().collect();
    let lit: Vec<Vec<bool>> =
        scene.lights.iter().map(|light| seen.iter().map(|p| is_lit(&scene, light, p)).collect()).collect();
    let share =
        |wanted: &dyn Fn(usize) -> bool| (0..seen.len()).filter(|&p| wanted(p)).count() as f32 / seen.len() as f32;
    for (i, light) in scene.lights.iter().enumerate() {
        let all = share(&|p| lit[i][p]);
        assert!(all > 0.03, "{light:?} lights {all} of the image");
        // Something that another light reaches is in its shadow, so the lights can be told apart.
        let shadow = share(&|p| !lit[i][p] && (0..5).any(|k| k != i && lit[k][p]));
        assert!(shadow > 0.1, "{light:?} lights everything that others light, but for {shadow}");
    }
    // The two point lights are hidden from each other's surroundings: few surfaces receive both and nothing else.
    let [a, b] = [3, 4].map(|i| match scene.lights[i] {
        Light::Point { position, .. } => Vec3::from(position),
        _ => panic!("not a point light"),
    });
    let way = b - a;
    let blocked = scene.meshes.iter().any(|mesh| hit(mesh, a, way).is_some_and(|(at, _)| at < 1.0));
    assert!(blocked, "the point lights see each other");
}

#[test]
fn only_the_second_camera_sees_the_lit_wall() {
    let scene = bundled("cameras");
    assert_eq!((scene.lights.len(), scene.extra_cameras.len()), (1, 1));
    assert_eq!(SceneNeeds::of(&scene).open_meshes, 0);
    let light = &scene.lights[0];
    let lit = |camera| {
        let seen: Vec<_> = view(&scene, camera).into_iter().flatten().collect();
        let lit = seen.iter().filter(|p| is_lit(&scene, light, p)).count();
        (lit, seen)
    };
    let (none, seen) = lit(&scene.camera);
    assert_eq!(none, 0, "the display's camera sees directly lit surfaces");
    let (many, _) = lit(&scene.extra_cameras[0]);
    assert!(many > 64 * 36 / 20, "the second camera sees {many} lit pixels");
    // What the display's camera sees receives the reflected light: the middle of the panel's back is in its view.
    let source = Vec3::new(0.0, 0.7, -0.981);
    let receives = |p: &&super::rays::Seen| {
        let way = source - p.position;
        let start = p.position + 1e-4 * p.normal;
        let front = way.z > 0.0 && way.dot(p.normal) > 0.0;
        front && scene.meshes.iter().all(|mesh| hit(mesh, start, source - start).is_none_or(|(at, _)| at >= 1.0))
    };
    let receivers = seen.iter().filter(receives).count();
    assert!(receivers > seen.len() / 5, "{receivers} of {} pixels receive its light", seen.len());
}

#[test]
fn translucent_bodies_are_lit_from_behind() {
    let scene = bundled("translucent");
    let translucent = |mesh: usize| scene.materials[scene.meshes[mesh].material].translucency != [0.0; 3];
    let seen: Vec<_> = view(&scene, &scene.camera).into_iter().flatten().collect();
    for name in ["wax", "jade", "cloth", "shade"] {
        let index = scene.meshes.iter().position(|mesh| mesh.name == name).unwrap();
        let mesh = &scene.meshes[index];
        assert!(translucent(index), "{name}");
        assert_eq!(mesh.is_watertight(), name != "cloth", "{name}");
        let pixels: Vec<_> = seen.iter().filter(|p| p.mesh == index).collect();
        // Light from the far side of the surface that meets nothing else on its way.
        let shines = |p: &&&super::rays::Seen| {
            scene.lights.iter().any(|light| {
                let Some((way, distance)) = towards(light, p.position) else { return false };
                let others = scene.meshes.iter().enumerate().filter(|&(k, _)| k != index);
                let free = |(_, mesh)| hit(mesh, p.position, way).is_none_or(|(at, _)| at >= distance);
                way.dot(p.normal) < 0.0 && others.into_iter().all(free)
            })
        };
        let shining = pixels.iter().filter(shines).count();
        assert!(pixels.len() > 10 && shining * 2 > pixels.len(), "{name}: {shining} of {} pixels", pixels.len());
    }
    // A surface does not send on more than it receives.
    for material in &scene.materials {
        for channel in 0..3 {
            let sum = material.albedo[channel] + material.translucency[channel];
            assert!(sum <= 1.0, "{}: {sum}", material.name);
        }
    }
    // Absorbing bodies are solid; over 10 cm they keep between 20 % and 90 % of their clearest colour.
    for material in scene.materials.iter().filter(|m| m.absorption != [0.0; 3]) {
        let clearest = material.absorption.into_iter().fold(f32::MAX, f32::min);
        assert!((0.2..0.9).contains(&(-0.1 * clearest).exp()), "{}", material.name);
    }
}
