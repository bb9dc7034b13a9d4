//! The hash of a scene's content.

use halflight_scenes::{
    Camera, CameraKeyframe, Environment, Keyframe, Light, Material, Mesh, Motion, Moves, Scene, Texture,
};

use crate::cache::{Key, KeyInputs};

/// Hash of everything in a scene that a result depends on: name, geometry, materials, the texels of textures and of the
/// environment, lights, cameras and motion. Two scenes of one hash give the same results, wherever their files are.
///
/// Results that are kept on disk (cells of a grid, path-traced references) are found by this hash and not by the path
/// of the scene file, because a model, a texture or the scene file may change under the same path.
pub fn scene_hash(scene: &Scene) -> Key {
    let mut inputs = KeyInputs::default();
    // Everything is destructured, so that a new field cannot be left out. Names of parts, the origin of the
    // coordinates and warnings change no result.
    let Scene {
        name,
        meshes,
        materials,
        textures,
        lights,
        camera,
        extra_cameras,
        environment,
        moves,
        origin: _,
        warnings: _,
        models: _,
    } = scene;
    inputs.add_text(name);
    inputs.add(&[meshes.len(), materials.len(), textures.len(), lights.len(), extra_cameras.len()].map(|n| n as u64));
    for Mesh { name: _, positions, normals, uvs, indices, material, object, model: _ } in meshes {
        inputs.add(positions).add(normals).add(uvs).add(indices).add(&[*material as u64, index(*object)]);
    }
    for material in materials {
        let Material {
            name: _,
            albedo,
            albedo_texture,
            alpha_texture,
            emission,
            specular,
            phong_exponent,
            translucency,
            absorption,
            receive_only,
        } = material;
        inputs
            .add(&[*albedo, *emission, *specular, *translucency, *absorption])
            .add(&[*phong_exponent])
            .add(&[u32::from(*receive_only)])
            .add(&[index(*albedo_texture), index(*alpha_texture)]);
    }
    for Texture { name: _, width, height, rgba } in textures {
        inputs.add(&[*width, *height]).add(rgba);
    }
    for light in lights {
        match *light {
            Light::Directional { direction, irradiance } => {
                inputs.add_text("directional").add(&[direction, irradiance]);
            }
            Light::Point { position, intensity } => {
                inputs.add_text("point").add(&[position, intensity]);
            }
            Light::Spot { position, direction, intensity, half_angle_degrees, full_intensity_half_angle_degrees } => {
                inputs
                    .add_text("spot")
                    .add(&[position, direction, intensity])
                    .add(&[half_angle_degrees, full_intensity_half_angle_degrees]);
            }
        }
    }
    for camera in std::iter::once(camera).chain(extra_cameras) {
        let Camera { eye, target, up, vertical_fov_degrees } = camera;
        inputs.add(&[*eye, *target, *up]).add(&[*vertical_fov_degrees]);
    }
    if let Some(Environment { map: _, width, height, texels }) = environment {
        inputs.add_text("environment").add(&[*width, *height]).add(texels);
    }
    let Moves { objects, lights, camera } = moves;
    inputs.add(&[objects.len(), lights.len(), camera.len()].map(|n| n as u64));
    objects.iter().for_each(|motion| add_motion(&mut inputs, motion));
    for (light, motion) in lights {
        inputs.add(&[*light as u64]);
        add_motion(&mut inputs, motion);
    }
    for CameraKeyframe { frame, eye, target, cut } in camera {
        inputs.add(&[*frame, u32::from(*cut)]).add(&[*eye, *target]);
    }
    inputs.key()
}

fn add_motion(inputs: &mut KeyInputs, Motion { pivot, keyframes }: &Motion) {
    inputs.add(&[*pivot]).add(&[keyframes.len() as u64]);
    for Keyframe { frame, translate, rotate_degrees, scale } in keyframes {
        inputs.add(&[*frame]).add(&[*translate, *rotate_degrees, *scale]);
    }
}

/// An optional index as a number; no list is long enough to hold the one that stands for `None`.
fn index(index: Option<usize>) -> u64 {
    index.map_or(u64::MAX, |index| index as u64)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use halflight_scenes::{DiskFiles, load_scene};

    use super::*;

    /// A change of a scene.
    type Change = fn(&mut Scene);

    #[test]
    fn every_change_that_shows_changes_the_hash() {
        let cornell = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/cornell.toml");
        let scene = Scene {
            textures: vec![Texture { name: "t".into(), width: 1, height: 1, rgba: vec![1, 2, 3, 4] }],
            environment: Some(Environment::constant([0.1; 3])),
            moves: Moves {
                objects: vec![Motion { pivot: [0.0; 3], keyframes: vec![Keyframe::default()] }],
                lights: vec![(0, Motion::default())],
                camera: vec![CameraKeyframe { frame: 0, eye: [0.0; 3], target: [1.0; 3], cut: false }],
            },
            extra_cameras: vec![Camera::default()],
            ..load_scene(&DiskFiles, &cornell).expect("a bundled scene")
        };
        let changes: [(&str, Change); 20] = [
            ("the name", |s| s.name.push('x')),
            ("a vertex", |s| s.meshes[0].positions[0][1] += 0.5),
            ("a normal", |s| s.meshes[0].normals[0] = [0.6, 0.8, 0.0]),
            ("a texture coordinate", |s| s.meshes[0].uvs[0][0] += 0.25),
            ("a triangle", |s| s.meshes[0].indices.swap(0, 1)),
            ("the material of a mesh", |s| s.meshes[0].material += 1),
            ("what moves a mesh", |s| s.meshes[0].object = Some(0)),
            ("an albedo", |s| s.materials[0].albedo[0] *= 0.5),
            ("a texture's use", |s| s.materials[0].albedo_texture = Some(0)),
            ("a mask's use", |s| s.materials[0].alpha_texture = Some(0)),
            ("gloss", |s| s.materials[0].phong_exponent += 1.0),
            ("what receives only", |s| s.materials[0].receive_only ^= true),
            ("a texel", |s| s.textures[0].rgba[2] += 1),
            ("a texel of the sky", |s| s.environment = Some(Environment::constant([0.2; 3]))),
            ("no sky", |s| s.environment = None),
            ("a light", |s| s.lights.push(Light::Point { position: [0.0; 3], intensity: [1.0; 3] })),
            ("the camera", |s| s.camera.vertical_fov_degrees += 1.0),
            ("an extra camera", |s| s.extra_cameras[0].eye[0] += 1.0),
            ("a keyframe", |s| s.moves.objects[0].keyframes[0].translate[2] = 1.0),
            ("a cut", |s| s.moves.camera[0].cut = true),
        ];
        let hash = scene_hash(&scene);
        assert_eq!(scene_hash(&scene.clone()), hash);
        for (what, change) in changes {
            let mut changed = scene.clone();
            change(&mut changed);
            assert_ne!(scene_hash(&changed), hash, "{what}");
        }
        let warned = Scene { warnings: vec!["a texture was replaced".into()], ..scene };
        assert_eq!(scene_hash(&warned), hash);
    }
}
