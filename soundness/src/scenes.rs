//! Scenes made of a few quads, most with a closed form, and the bundled scenes.

use glam::Vec3;
use halflight_scenes::{Camera, Keyframe, Light, Material, Mesh, Motion, Scene};

/// A flat quad: corner and two edges; its normal is the cross product of the edges.
pub fn quad(corner: Vec3, u: Vec3, v: Vec3, material: usize) -> Mesh {
    let normal = u.cross(v).normalize().to_array();
    Mesh {
        positions: [corner, corner + u, corner + u + v, corner + v].map(|p| p.to_array()).to_vec(),
        normals: vec![normal; 4],
        uvs: vec![[0.0; 2]; 4],
        indices: vec![0, 1, 2, 0, 2, 3],
        material,
        ..Mesh::default()
    }
}

/// A grey surface of this albedo.
pub fn grey(albedo: f32) -> Material {
    Material { albedo: [albedo; 3], ..Material::default() }
}

/// A black surface that emits this radiance.
pub fn emitter(radiance: f32) -> Material {
    Material { albedo: [0.0; 3], emission: [radiance; 3], ..Material::default() }
}

/// A camera looking along -z from `distance`, half a field of view wide.
pub fn camera(eye: [f32; 3], target: [f32; 3], vertical_fov_degrees: f32) -> Camera {
    Camera { eye, target, vertical_fov_degrees, ..Camera::default() }
}

/// A sun travelling downwards and a little away from the camera.
pub fn sun() -> Light {
    Light::Directional { direction: [0.2, -1.0, -0.3], irradiance: [3.0, 2.5, 2.0] }
}

/// The court with a glossy floor, which shows the wall and the block: Ks 0.5 and this Phong exponent.
pub fn polished(exponent: f32) -> Scene {
    let mut scene = court();
    scene.materials[0].specular = [0.5; 3];
    scene.materials[0].phong_exponent = exponent;
    scene
}

/// Floor and back wall of a grey court, 4 x 4 x 3 units, and a box-like block on the floor.
pub fn court() -> Scene {
    let block = Vec3::new(-0.6, 0.0, -1.4);
    let (x, y, z) = (Vec3::X, Vec3::Y, Vec3::Z);
    Scene {
        name: "court".into(),
        meshes: vec![
            quad(Vec3::new(-2.0, 0.0, 2.0), 4.0 * x, -4.0 * z, 0),
            quad(Vec3::new(-2.0, 0.0, -2.0), 4.0 * x, 3.0 * y, 1),
            quad(block + 0.5 * z, 0.8 * x, 0.7 * y, 0),
            quad(block + 0.7 * y + 0.5 * z, 0.8 * x, -0.5 * z, 1),
        ],
        materials: vec![grey(0.7), Material { albedo: [0.8, 0.3, 0.2], ..Material::default() }],
        lights: vec![sun()],
        camera: camera([0.0, 1.4, 4.0], [0.0, 0.8, 0.0], 45.0),
        ..Scene::default()
    }
}

/// A closed box; its faces look outwards.
pub fn block(low: Vec3, high: Vec3, material: usize) -> Mesh {
    let (x, y, z) = (Vec3::X * (high - low), Vec3::Y * (high - low), Vec3::Z * (high - low));
    let faces = [(low, y, x), (low + z, x, y), (low, z, y), (low + x, y, z), (low, x, z), (low + y, z, x)];
    let mut all = Mesh { material, ..Mesh::default() };
    for (corner, u, v) in faces {
        let quad = quad(corner, u, v, material);
        let first = all.positions.len() as u32;
        all.positions.extend(quad.positions);
        all.normals.extend(quad.normals);
        all.uvs.extend(quad.uvs);
        all.indices.extend(quad.indices.iter().map(|i| first + i));
    }
    all
}

/// The court by the light of a glowing plate instead of the sun: no shadow map has a part in its light, so that the
/// light is the same bit for bit wherever the scene stands. The plate is large: no few pixels decide over all light.
pub fn lamp_court() -> Scene {
    let mut scene = court();
    scene.name = "court by lamplight".into();
    scene.lights.clear();
    scene.meshes.push(quad(Vec3::new(-1.7, 0.3, -1.9), 3.4 * Vec3::X, 1.5 * Vec3::Y, 2));
    scene.materials.push(Material { albedo: [0.5; 3], emission: [3.0, 2.5, 2.0], ..Material::default() });
    scene
}

/// A closed white room, 4 x 3 x 4 units, seen from inside; a plate under its ceiling glows.
pub fn white_room() -> Scene {
    let mut room = block(Vec3::new(-2.0, 0.0, -2.0), Vec3::new(2.0, 3.0, 2.0), 0);
    // Seen from inside, it faces inwards.
    room.indices.as_chunks_mut::<3>().0.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    room.normals.iter_mut().flatten().for_each(|v| *v = -*v);
    let lamp = quad(Vec3::new(-0.5, 2.5, -1.0), Vec3::X, Vec3::Z, 1);
    Scene {
        name: "white room".into(),
        meshes: vec![room, lamp],
        materials: vec![grey(1.0), emitter(2.0)],
        camera: camera([0.0, 1.5, 1.9], [0.0, 1.4, -1.0], 90.0),
        ..Scene::default()
    }
}

/// Everything glows with radiance 0.5, thin bars before a wall as well: no surface in view is without light.
pub fn glowing_bars() -> Scene {
    let mut scene = white_room();
    scene.name = "glowing bars".into();
    scene.materials = vec![Material { emission: [0.5; 3], ..grey(0.5) }; 2];
    for i in 0..9 {
        // From under a pixel to some pixels of a picture 96 wide.
        let (x, width) = (-1.6 + 0.4 * i as f32, 0.01 * (1 + i) as f32);
        scene.meshes.push(block(Vec3::new(x, 0.2, -0.6), Vec3::new(x + width, 2.4, -0.5), 0));
    }
    scene
}

/// One triangle of this material.
pub fn triangle(material: Material) -> Scene {
    let mut mesh = quad(Vec3::new(-0.5, -0.5, -1.0), Vec3::X, Vec3::Y, 0);
    mesh.indices.truncate(3);
    Scene {
        name: "triangle".into(),
        meshes: vec![mesh],
        materials: vec![material],
        lights: vec![sun()],
        ..Scene::default()
    }
}

/// A scene that is part of the program, by name.
///
/// # Panics
/// Where no such scene is part of the program.
pub fn bundled(name: &str) -> Scene {
    halflight_scenes::bundled::scene(name).expect("a bundled scene loads")
}

/// The scene with every length multiplied by this factor, and the same irradiance everywhere.
pub fn scaled(scene: &Scene, factor: f32) -> Scene {
    let mut scene = scene.clone();
    let scale = |v: &mut [f32; 3]| *v = v.map(|x| x * factor);
    scene.meshes.iter_mut().flat_map(|mesh| &mut mesh.positions).for_each(scale);
    for light in &mut scene.lights {
        match light {
            Light::Directional { .. } => {}
            // Irradiance falls with the squared distance.
            Light::Point { position, intensity } | Light::Spot { position, intensity, .. } => {
                scale(position);
                *intensity = intensity.map(|v| v * factor * factor);
            }
        }
    }
    scale(&mut scene.camera.eye);
    scale(&mut scene.camera.target);
    scene
}

/// A scene with everything that a setting may need: glossy and emissive materials, solid and open meshes, motion.
pub fn everything() -> Scene {
    let mut scene = court();
    scene.name = "everything".into();
    scene.meshes.push(block(Vec3::new(0.6, 0.0, -0.5), Vec3::new(1.2, 0.9, 0.1), 0));
    let glossy = Material { specular: [0.5; 3], phong_exponent: 30.0, ..grey(0.4) };
    scene.materials.push(glossy);
    scene.meshes[1].material = 2;
    scene.meshes[3].object = Some(0);
    let keyframes = vec![Keyframe::default(), Keyframe { frame: 3, translate: [0.2, 0.0, 0.1], ..Keyframe::default() }];
    scene.moves.objects.push(Motion { pivot: [0.0; 3], keyframes });
    scene.meshes.push(Mesh { material: 3, ..quad(Vec3::new(-1.8, 0.2, 0.0), 0.5 * Vec3::X, Vec3::Y, 3) });
    scene.materials.push(Material { emission: [1.0, 0.8, 0.6], ..grey(0.2) });
    scene
}
