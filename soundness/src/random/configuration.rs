//! A random scene, camera, size, technique and settings.

use glam::Vec3;
use halflight_renderer::{
    gi::Technique,
    parameters::{Kind, Parameter, Role, Settings, Value},
};
use halflight_scenes::{CameraKeyframe, Keyframe, Light, Material, Mesh, Motion, Scene};
use halflight_techniques::TECHNIQUES;
use proptest::prelude::*;

use crate::{scenes, switches};

/// A configuration as plain numbers.
#[derive(Clone, Debug)]
pub struct Configuration {
    pub(super) size: [u32; 2],
    pub(super) frames: u32,
    pub(super) seed: u32,
    eye: [f32; 3],
    target: [f32; 3],
    /// The camera looks at this part instead of its target.
    aim: Option<prop::sample::Index>,
    vertical_fov_degrees: f32,
    camera_steps: bool,
    /// Scene that the parts are added to: 0 none, 1 a sunlit court, 2 a court lit by an emitter, 3 a white room.
    base: u8,
    /// Whether the camera is the base's own.
    base_camera: bool,
    parts: Vec<Part>,
    lights: Vec<Lamp>,
    technique: prop::sample::Index,
    /// For each parameter of the technique, its position in its range from 0 to 1; `None` for the default.
    settings: Vec<Option<f64>>,
}

/// A piece of the scene.
#[derive(Clone, Debug)]
struct Part {
    /// 0 a quad, 1 a closed box, 2 a triangle.
    shape: u8,
    corner: [f32; 3],
    edges: [[f32; 3]; 2],
    /// Replaces the first vertex normal.
    normal: Option<[f32; 3]>,
    albedo: f32,
    emission: f32,
    specular: f32,
    phong_exponent: f32,
    receive_only: bool,
    moves: bool,
}

#[derive(Clone, Debug)]
struct Lamp {
    /// 0 directional, 1 point, 2 spot.
    kind: u8,
    position: [f32; 3],
    direction: [f32; 3],
    power: f32,
    half_angle_degrees: f32,
}

/// Mostly near the origin, sometimes on it, sometimes very large or small.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        6 => -3.0f32..3.0,
        2 => Just(0.0f32),
        1 => (-6.0f32..6.0, any::<bool>()).prop_map(|(e, minus)| 10f32.powf(e) * if minus { -1.0 } else { 1.0 }),
    ]
}

fn vector() -> impl Strategy<Value = [f32; 3]> {
    [coordinate(), coordinate(), coordinate()]
}

/// None, moderate, or anything up to the largest float.
fn power() -> impl Strategy<Value = f32> {
    prop_oneof![
        2 => Just(0.0f32),
        5 => 0.0f32..5.0,
        2 => (-40.0f32..38.0).prop_map(|e| 10f32.powf(e)),
        1 => Just(f32::MAX),
    ]
}

fn part() -> impl Strategy<Value = Part> {
    (
        (0u8..3, vector(), [vector(), vector()], prop::option::weighted(0.2, vector())),
        (
            prop_oneof![Just(0.0f32), Just(1.0), 0.0f32..1.0],
            prop_oneof![4 => Just(0.0f32), 1 => power()],
            prop_oneof![3 => Just(0.0f32), 1 => 0.0f32..1.0],
            prop_oneof![Just(0.0f32), Just(1e6), 0.0f32..200.0],
        ),
        (prop::bool::weighted(0.1), prop::bool::weighted(0.2)),
    )
        .prop_map(|(shape, material, flags)| Part {
            shape: shape.0,
            corner: shape.1,
            edges: shape.2,
            normal: shape.3,
            albedo: material.0,
            emission: material.1,
            specular: material.2,
            phong_exponent: material.3,
            receive_only: flags.0,
            moves: flags.1,
        })
}

fn lamp() -> impl Strategy<Value = Lamp> {
    (0u8..3, vector(), vector(), power(), 0.1f32..89.0).prop_map(
        |(kind, position, direction, power, half_angle_degrees)| Lamp {
            kind,
            position,
            direction,
            power,
            half_angle_degrees,
        },
    )
}

/// Random configurations.
pub(super) fn configuration() -> impl Strategy<Value = Configuration> {
    let most = TECHNIQUES.iter().map(|technique| (technique.parameters)().len()).max().unwrap_or(0);
    let side = |most: u32| prop_oneof![1 => 1u32..4, 4 => 1..=most];
    (
        ([side(64), side(48)], 1u32..4, any::<u32>()),
        (
            vector(),
            vector(),
            prop::option::weighted(0.7, any::<prop::sample::Index>()),
            prop_oneof![2 => Just(60.0f32), 1 => Just(1.0), 1 => Just(170.0), 2 => 1.0f32..170.0],
            prop::bool::weighted(0.2),
        ),
        (0u8..4, prop::bool::weighted(0.7), prop::collection::vec(part(), 0..7), prop::collection::vec(lamp(), 0..4)),
        (any::<prop::sample::Index>(), prop::collection::vec(prop::option::of(0.0f64..1.0), most)),
    )
        .prop_map(|(image, camera, content, technique)| Configuration {
            size: image.0,
            frames: image.1,
            seed: image.2,
            eye: camera.0,
            target: camera.1,
            aim: camera.2,
            vertical_fov_degrees: camera.3,
            camera_steps: camera.4,
            base: content.0,
            base_camera: content.1,
            parts: content.2,
            lights: content.3,
            technique: technique.0,
            settings: technique.1,
        })
}

/// The number at a position from 0 to 1 in a range. In a range over several orders of magnitude, as those of lengths, each
/// order has the same share.
fn within(low: f64, high: f64, position: f64) -> f64 {
    let least = low.max(1e-3);
    let number = if low >= 0.0 && high > 1e3 * least {
        least * (high / least).powf(position)
    } else {
        low + position * (high - low)
    };
    number.clamp(low, high)
}

impl Configuration {
    /// The technique that runs.
    pub fn technique(&self) -> &'static Technique {
        self.technique.get(TECHNIQUES)
    }

    /// Its settings. Override constants take one of a few values, so that pipelines are reused; other numbers take any.
    pub fn settings(&self) -> Settings {
        let value = |(parameter, position): (Parameter, &Option<f64>)| {
            let position = (*position)?;
            let few = || {
                let mut values = switches::values(&parameter);
                values.extend(parameter.grid.iter().cloned());
                values[((position * values.len() as f64) as usize).min(values.len() - 1)].clone()
            };
            let value = match (parameter.kind, parameter.role) {
                (Kind::Float(low, high), Role::Uniform | Role::Plan) => Value::Float(within(low, high, position)),
                _ => few(),
            };
            Some((parameter.key(), value))
        };
        (self.technique().parameters)().into_iter().zip(&self.settings).filter_map(value).collect()
    }

    /// The scene that is shown.
    pub fn scene(&self) -> Scene {
        let mut scene = match self.base {
            1 => scenes::court(),
            2 => scenes::lamp_court(),
            3 => scenes::white_room(),
            _ => Scene::default(),
        };
        scene.name = "random".into();
        // Distinct names, because the files of a scene refer to materials by name.
        scene.materials.iter_mut().enumerate().for_each(|(i, material)| material.name = format!("base_{i}"));
        for (number, part) in self.parts.iter().enumerate() {
            let index = scene.materials.len();
            let (corner, [u, v]) = (Vec3::from(part.corner), part.edges.map(Vec3::from));
            let mut mesh = match part.shape {
                1 => scenes::block(corner, corner + u.abs(), index),
                _ => {
                    let normal = u.cross(v).try_normalize().unwrap_or(Vec3::Y).to_array();
                    Mesh {
                        positions: [corner, corner + u, corner + u + v, corner + v].map(|p| p.to_array()).to_vec(),
                        normals: vec![normal; 4],
                        uvs: vec![[0.0; 2]; 4],
                        indices: if part.shape == 0 { vec![0, 1, 2, 0, 2, 3] } else { vec![0, 1, 2] },
                        material: index,
                        ..Mesh::default()
                    }
                }
            };
            // As the reader of a file does.
            mesh.normals.iter_mut().for_each(|n| *n = Vec3::from(*n).try_normalize().unwrap_or(Vec3::Y).to_array());
            if let Some(normal) = part.normal {
                mesh.normals[0] = Vec3::from(normal).try_normalize().unwrap_or(Vec3::Y).to_array();
            }
            mesh.name = format!("part_{number}");
            if part.moves {
                mesh.object = Some(scene.moves.objects.len());
                let there = Keyframe {
                    frame: 3,
                    translate: part.edges[1],
                    rotate_degrees: [40.0, 0.0, 90.0],
                    ..Keyframe::default()
                };
                let motion = Motion { pivot: part.corner, keyframes: vec![Keyframe::default(), there] };
                scene.moves.objects.push(motion);
            }
            scene.meshes.push(mesh);
            scene.materials.push(Material {
                name: format!("material_{number}"),
                albedo: [part.albedo, part.albedo * 0.5, part.albedo],
                emission: [part.emission; 3],
                specular: [part.specular; 3],
                phong_exponent: part.phong_exponent,
                receive_only: part.receive_only,
                ..Material::default()
            });
        }
        let direction = |v: [f32; 3]| if v == [0.0; 3] { [0.0, -1.0, 0.0] } else { v };
        for lamp in &self.lights {
            scene.lights.push(match lamp.kind {
                0 => Light::Directional { direction: direction(lamp.direction), irradiance: [lamp.power; 3] },
                1 => Light::Point { position: lamp.position, intensity: [lamp.power; 3] },
                _ => Light::Spot {
                    position: lamp.position,
                    direction: direction(lamp.direction),
                    intensity: [lamp.power; 3],
                    half_angle_degrees: lamp.half_angle_degrees,
                    full_intensity_half_angle_degrees: 0.5 * lamp.half_angle_degrees,
                },
            });
        }
        let part = self.aim.filter(|_| !self.parts.is_empty()).map(|aim| aim.get(&self.parts));
        // On the part, near its middle.
        let middle = |part: &Part| {
            let [u, v] = part.edges.map(Vec3::from);
            (Vec3::from(part.corner) + 0.45 * (u + v)).to_array()
        };
        let target = part.map_or(self.target, middle);
        if self.base == 0 || !self.base_camera {
            scene.camera = scenes::camera(self.eye, target, self.vertical_fov_degrees);
        }
        let (eye, target) = (scene.camera.eye, scene.camera.target);
        if self.camera_steps {
            let key = |frame, eye, cut| CameraKeyframe { frame, eye, target, cut };
            let aside = eye.map(|v| v * 1.01 + 0.01);
            scene.moves.camera = vec![key(0, eye, false), key(1, aside, false), key(2, eye, true)];
        }
        scene
    }
}
