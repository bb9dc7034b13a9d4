//! Extremes of geometry, image, light, material and parameters. Nothing that a frame writes may be NaN or infinite. Light
//! is never negative and never exceeds what the sources send.

use std::path::Path;

use glam::Vec3;
use halflight_evaluator::{
    Error,
    experiment::session::{Frames, Request, Session},
};
use halflight_frame_graph::non_finite::ValueCounts;
use halflight_renderer::{
    gi::Technique,
    parameters::{Settings, check_settings},
};
use halflight_renderer::{gi::rsm::has_reflective_shadow_maps, scene::traces_rays};
use halflight_scenes::{CameraKeyframe, Keyframe, Light, Material, MemoryFiles, Motion, Scene, load_scene};
use halflight_techniques::parameters_of;

use super::Suite;
use crate::{
    check::{Check, percentile_999},
    scenes::{self, bundled, everything, scaled},
    settings::{bounces, with_small_shadows, words},
    switches,
};

/// What a row expects of light.
#[derive(Clone, Copy, PartialEq)]
enum Expect {
    /// No more than the sources send.
    Light,
    /// None at all.
    Black,
}

/// A row: a scene at a size.
struct Extreme {
    group: &'static str,
    row: String,
    scene: Scene,
    size: [u32; 2],
    expect: Expect,
    /// Number of frames; each one is checked.
    frames: u32,
    /// Number of the first frame.
    first: u32,
    /// Depth of the nearest surface in view, scene units; not checked if 0.
    nearest: f32,
}

impl Extreme {
    fn new(group: &'static str, row: impl Into<String>, scene: Scene) -> Self {
        Self { group, row: row.into(), scene, size: [33, 17], expect: Expect::Light, frames: 1, first: 0, nearest: 0.0 }
    }

    fn sized(self, size: [u32; 2]) -> Self {
        Self { size, ..self }
    }

    fn black(self) -> Self {
        Self { expect: Expect::Black, ..self }
    }

    fn over(self, frames: u32) -> Self {
        Self { frames, ..self }
    }

    fn from(self, first: u32) -> Self {
        Self { first, ..self }
    }

    fn with_nearest(self, nearest: f32) -> Self {
        Self { nearest, ..self }
    }
}

pub(super) fn run(suite: &mut Suite) {
    if !suite.options.quick && suite.wants("geometry", "a whole building") {
        row(suite, &Extreme::new("geometry", "a whole building with textures", bundled("atrium")));
    }
    for make in [geometry, image, light_and_material, motion] {
        for extreme in make() {
            if suite.wants(extreme.group, &extreme.row) {
                row(suite, &extreme);
            }
        }
    }
    parameters(suite);
}

fn row(suite: &mut Suite, extreme: &Extreme) {
    let native = suite.native;
    let session = Session::new(native, &extreme.scene).keep_all();
    for (technique, all) in suite.pairs() {
        for settings in all {
            let check = Check::new(extreme.group, &extreme.row, technique.name, &settings);
            suite.guarded(check, |check| examine(&session, extreme, technique, &settings, check));
        }
    }
}

/// Outputs that are light.
const LIGHT: [&str; 4] = ["direct", "indirect", "glossy", "final"];
/// Outputs that are shares.
const SHARES: [&str; 2] = ["ambient_occlusion", "visibility"];

fn examine(
    session: &Session,
    extreme: &Extreme,
    technique: &'static Technique,
    settings: &Settings,
    check: &Check,
) -> Result<Vec<Check>, Error> {
    let request =
        Request { technique, settings: with_small_shadows(settings), size: extreme.size, seed: 0, direct: None };
    let mut frames = session.frames(&request)?;
    // The second frame reads the history of the first one.
    let count = if frames.plan().has_history() { extreme.frames.max(2) } else { extreme.frames };
    let mut found = Found::default();
    for frame in 0..count {
        frames.run(extreme.first.wrapping_add(frame))?;
        found.add(&frames)?;
    }
    let bad = check
        .clone()
        .bounded("values not finite, or light below zero", found.bad as f64, 0.0, "no such value is ever written")
        .detail(format!("{} at {}x{}", found.position, extreme.size[0], extreme.size[1]));
    let bad = Check { clamped: found.clamped, largest: f64::from(found.largest), percentile: found.percentile, ..bad };
    let light = match extreme.expect {
        Expect::Black => {
            check.clone().bounded("largest value of light", f64::from(found.largest), 0.0, "nothing sends light")
        }
        // Reflective shadow maps and rays may find brighter surfaces than the screen shows.
        Expect::Light if has_reflective_shadow_maps(frames.plan()) || traces_rays(frames.plan()) => {
            check.clone().reported(
                "mean of indirect light",
                mean_indirect(&frames)?,
                "sources off the screen may be brighter than those on it",
            )
        }
        Expect::Light => {
            let bound = f64::from(found.largest_direct) * series(&extreme.scene, bounces(technique, settings));
            let mean = mean_indirect(&frames)?;
            let ratio = if mean == 0.0 { 0.0 } else { mean / bound };
            check.clone().bounded(
                "mean of indirect light over the most that sources can send",
                ratio,
                1.0,
                "form factors of a point add up to 1 at most; each further bounce sends at most the largest albedo on",
            )
        }
    };
    let mut checks = vec![bad, light];
    if extreme.nearest > 0.0 {
        let depth = frames.read_rgb("depth")?.unwrap_or_default();
        let seen = depth.iter().map(|depth| depth[0]).filter(|&depth| depth > 0.0).fold(f32::INFINITY, f32::min);
        let off = f64::from(seen / extreme.nearest - 1.0).abs();
        let reason =
            "the near plane cuts nothing; the nearest surface faces the eye, so that rounding alone changes its depth";
        checks.push(check.clone().bounded("relative error of the nearest depth", off, 1e-4, reason));
    }
    Ok(checks)
}

/// What the checks of several frames found.
#[derive(Default)]
struct Found {
    bad: u64,
    position: String,
    clamped: u64,
    largest: f32,
    largest_direct: f32,
    percentile: f64,
}

impl Found {
    fn add(&mut self, frames: &Frames) -> Result<(), Error> {
        let plan = frames.plan();
        let is = |scanned: &ValueCounts, outputs: &[&str]| {
            outputs.iter().any(|o| plan.outputs.get(o).is_some_and(|id| plan.resources[id.0].name == scanned.name))
        };
        for scanned in frames.scan()? {
            let mut bad = scanned.not_finite();
            if is(&scanned, &LIGHT) {
                bad += u64::from(scanned.negative);
                self.clamped += u64::from(scanned.clamped);
            }
            if is(&scanned, &SHARES) && scanned.largest > 1.0 {
                bad += 1;
            }
            if bad > 0 {
                self.position = format!("{}: {} NaN, {} infinite", scanned.name, scanned.nan, scanned.infinite);
            }
            self.bad += bad;
        }
        let largest = |name: &str| -> Result<f32, Error> {
            let pixels = frames.read_rgb(name)?.unwrap_or_default();
            Ok(pixels.iter().flatten().copied().filter(|v| v.is_finite()).fold(0.0, f32::max))
        };
        if let Some(light) = frames.read_rgb("indirect")? {
            self.percentile = self.percentile.max(percentile_999(&light));
        }
        self.largest_direct = self.largest_direct.max(largest("direct")?);
        for name in LIGHT {
            self.largest = self.largest.max(largest(name)?);
        }
        Ok(())
    }
}

fn mean_indirect(frames: &Frames) -> Result<f64, Error> {
    let Some(pixels) = frames.read_rgb("indirect")? else { return Ok(0.0) };
    // The brightest channel, because each one has its own bound.
    let mean = |c: usize| pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / pixels.len().max(1) as f64;
    Ok(mean(0).max(mean(1)).max(mean(2)))
}

/// 1 + rho + rho^2 + ... for this many bounces, rho the largest albedo.
fn series(scene: &Scene, bounces: u32) -> f64 {
    let textured = scene.materials.iter().any(|material| material.albedo_texture.is_some());
    let largest = scene.materials.iter().flat_map(|m| m.albedo).fold(0.0f32, f32::max);
    let rho = if textured { 1.0 } else { f64::from(largest.clamp(0.0, 1.0)) };
    (0..bounces.max(1)).map(|bounce| rho.powi(bounce as i32)).sum()
}

fn geometry() -> Vec<Extreme> {
    let group = "geometry";
    let court = scenes::court;
    let with = |change: &dyn Fn(&mut Scene)| {
        let mut scene = court();
        change(&mut scene);
        scene
    };
    let eye = |eye: [f32; 3]| with(&|scene| scene.camera.eye = eye);
    let flat = |corners: usize| {
        let mut scene = scenes::triangle(scenes::grey(1.0));
        for i in 1..=corners {
            scene.meshes[0].positions[2 - i + 1] = scene.meshes[0].positions[2 - i];
        }
        scene
    };
    vec![
        Extreme::new(group, "coincident points: every mesh twice, normals turned", with(&coincide)),
        Extreme::new(
            group,
            "duplicated faces",
            with(&|scene| {
                scene.meshes.iter_mut().for_each(|mesh| mesh.indices.extend_from_within(..));
            }),
        ),
        Extreme::new(
            group,
            "grazing angles: the eye a thousandth above the floor",
            with(&|scene| {
                scene.camera.eye = [0.0, 1e-3, 1.5];
                scene.camera.target = [0.0, 1e-3, -2.0];
            }),
        ),
        Extreme::new(group, "a depth ratio of a million", depth_ratio()).with_nearest(1.1),
        Extreme::new(group, "a thing near the eye on a ground of 40 km", near_and_far()).with_nearest(0.625),
        Extreme::new(group, "coplanar faces of different colours", coplanar()),
        Extreme::new(
            group,
            "a surface on the near plane",
            with(&|scene| {
                let near = halflight_renderer::scene::SceneFacts::of(scene).near;
                scene.camera = scenes::camera([0.0, 0.5, -2.0 + near], [0.0, 0.5, -2.0], 60.0);
            }),
        ),
        Extreme::new(group, "an empty scene", Scene { name: "empty".into(), ..Scene::default() }).black(),
        Extreme::new(group, "lights and no meshes", Scene { lights: vec![scenes::sun()], ..Scene::default() }).black(),
        Extreme::new(group, "all sky", with(&|scene| scene.camera.target = [0.0, 10.0, 20.0])).black(),
        Extreme::new(group, "one triangle", scenes::triangle(scenes::grey(1.0))),
        Extreme::new(group, "one triangle that glows", scenes::triangle(scenes::emitter(1.0))),
        Extreme::new(group, "a triangle of no area: a line", flat(1)),
        Extreme::new(group, "a triangle of no area: a point", flat(2)),
        Extreme::new(group, "zero normals", with(&|scene| normals(scene, [0.0; 3]))),
        Extreme::new(group, "NaN and zero normals in the file", normals_from_file()),
        Extreme::new(group, "a thousandth of the scale", scaled(&court(), 1e-3)),
        Extreme::new(group, "a million times the scale", scaled(&court(), 1e6)),
        Extreme::new(group, "the eye on a surface", eye([0.0, 0.0, 1.0])),
        Extreme::new(group, "the eye inside a block", inside()),
        Extreme::new(group, "the eye a million units away", eye([0.0, 1.4, 1e6])),
        Extreme::new(group, "thin bars, alpha-masked leaves", bundled("bars")),
        Extreme::new(group, "a closed box", bundled("cornell")),
        Extreme::new(group, "a furnace: everything glows", bundled("furnace")),
    ]
}

fn coincide(scene: &mut Scene) {
    let mut copies = scene.meshes.clone();
    copies.iter_mut().flat_map(|mesh| &mut mesh.normals).flatten().for_each(|v| *v = -*v);
    scene.meshes.extend(copies);
}

fn normals(scene: &mut Scene, normal: [f32; 3]) {
    scene.meshes.iter_mut().for_each(|mesh| mesh.normals.fill(normal));
}

/// A glowing plate just behind the near plane, and a floor that is a million units long: a million times as far.
fn depth_ratio() -> Scene {
    let mut scene = scenes::court();
    let floor = scenes::quad(Vec3::new(-1e5, -20.0, 0.0), 2e5 * Vec3::X, -1e6 * Vec3::Z, 0);
    let plate = scenes::quad(Vec3::new(-0.2, -0.2, -5.0), 0.3 * Vec3::X, 0.3 * Vec3::Y, 2);
    scene.meshes = vec![floor, plate];
    scene.materials.push(scenes::emitter(1.0));
    scene.camera = scenes::camera([0.0, 0.0, -3.9], [0.0, 0.0, -5.0], 60.0);
    scene
}

/// A ground of 40 km with a mountain at its end, all in view, and a small block at arm's length before the eye. Its near
/// side is at a multiple of the step of float32 there, 1/512.
fn near_and_far() -> Scene {
    let mut scene = scenes::court();
    let eye = Vec3::new(0.0, 900.0, 19_000.0);
    scene.meshes = vec![
        scenes::quad(Vec3::new(-2e4, 0.0, 2e4), 4e4 * Vec3::X, -4e4 * Vec3::Z, 0),
        scenes::quad(Vec3::new(-2e4, 0.0, -2e4), 4e4 * Vec3::X, 8e3 * Vec3::Y, 1),
        scenes::block(eye + Vec3::new(-0.1, -0.1, -0.7), eye + Vec3::new(0.1, 0.1, -0.625), 1),
    ];
    scene.camera = scenes::camera(eye.to_array(), (eye - Vec3::Z).to_array(), 60.0);
    scene
}

/// The court with a second face in the plane of its floor and another one in that of its wall, which overlap them.
fn coplanar() -> Scene {
    let mut scene = scenes::court();
    scene.materials.push(Material { albedo: [0.1, 0.8, 0.2], ..Material::default() });
    scene.meshes.push(scenes::quad(Vec3::new(-1.3, 0.0, 1.7), 2.9 * Vec3::X, -3.1 * Vec3::Z, 2));
    scene.meshes.push(scenes::quad(Vec3::new(-1.1, 0.3, -2.0), 2.3 * Vec3::X, 2.1 * Vec3::Y, 2));
    scene
}

/// The eye inside a closed emissive block.
fn inside() -> Scene {
    let mut scene = scenes::lamp_court();
    let eye = Vec3::from(scene.camera.eye);
    scene.meshes.push(scenes::block(eye - 0.2, eye + 0.3, 2));
    scene
}

fn normals_from_file() -> Scene {
    let obj = "v -1 0 0\nv 1 0 0\nv 1 1 0\nv -1 1 0\nv -1 0 2\nv 1 0 2\nvn nan nan nan\nvn 0 0 0\nvn 0 1 0\n\
               f 1//1 2//1 3//2\nf 1//1 3//2 4//2\nf 5//3 6//3 2//2\nf 5//3 2//2 1//1\n";
    let toml = "[[model]]\npath = 'm.obj'\n[camera]\neye = [0.0, 1.0, 5.0]\ntarget = [0.0, 0.5, 0.0]\n";
    let files = MemoryFiles::from_iter([("s.toml", toml), ("m.obj", obj)]);
    load_scene(&files, Path::new("s.toml")).unwrap_or_default()
}

fn image() -> Vec<Extreme> {
    let group = "image";
    let court = scenes::court;
    let fov = |degrees: f32| {
        let mut scene = court();
        scene.camera.vertical_fov_degrees = degrees;
        scene
    };
    let size = |name: &str, size: [u32; 2]| Extreme::new(group, name, court()).sized(size);
    vec![
        size("1 pixel", [1, 1]),
        size("1 column", [1, 97]),
        size("1 row", [97, 1]),
        size("odd and prime", [31, 37]),
        size("smaller than the coarsest level", [2, 3]),
        size("4096 pixels wide", [4096, 2]),
        size("7680 pixels wide", [7680, 2]),
        size("aspect 10:1", [160, 16]),
        size("aspect 1000:1", [2000, 2]),
        size("aspect 1:1000", [2, 2000]),
        Extreme::new(group, "a field of view of 1 degree", fov(1.0)),
        Extreme::new(group, "a field of view of 170 degrees", fov(170.0)),
    ]
}

fn light_and_material() -> Vec<Extreme> {
    let group = "light and material";
    let court = scenes::court;
    let lit = |radiance: f32| {
        let mut scene = court();
        scene.lights = vec![Light::Directional { direction: [0.2, -1.0, -0.3], irradiance: [radiance; 3] }];
        scene.materials[1].emission = [radiance; 3];
        scene
    };
    let albedo = |albedo: f32| {
        let mut scene = court();
        scene.materials.iter_mut().for_each(|material| material.albedo = [albedo; 3]);
        scene
    };
    let glossy = |exponent: f32| {
        let mut scene = court();
        scene.materials.iter_mut().for_each(|material| {
            material.specular = [1.0, 0.5, 0.0];
            material.phong_exponent = exponent;
        });
        scene
    };
    let mut dark = court();
    dark.lights.clear();
    vec![
        Extreme::new(group, "radiance 0", lit(0.0)).black(),
        Extreme::new(group, "radiance 1e-30", lit(1e-30)),
        Extreme::new(group, "radiance 1e6", lit(1e6)),
        Extreme::new(group, "radiance 1e30", lit(1e30)),
        Extreme::new(group, "radiance of the largest float", lit(f32::MAX)),
        Extreme::new(group, "albedo 0", albedo(0.0)).black(),
        Extreme::new(group, "albedo 1", albedo(1.0)),
        Extreme::new(group, "albedo above 1 in the file", albedo_from_file()),
        Extreme::new(group, "Phong exponent 0", glossy(0.0)),
        Extreme::new(group, "Phong exponent 1e6", glossy(1e6)),
        Extreme::new(group, "no light", dark).black(),
        Extreme::new(group, "64 lights", many_lights()),
        Extreme::new(group, "only what glows", scenes::lamp_court()),
    ]
}

fn albedo_from_file() -> Scene {
    let obj = "mtllib m.mtl\nusemtl m\nv -1 0 0\nv 1 0 0\nv 1 1 0\nv -1 1 0\nv -1 0 2\nv 1 0 2\nf 1 2 3 4\nf 5 6 2 1\n";
    let toml = "[[model]]\npath = 'm.obj'\n[camera]\neye = [0.0, 1.0, 5.0]\ntarget = [0.0, 0.5, 0.0]\n\
                [[light]]\nkind = 'directional'\ndirection = [0.2, -1.0, -0.3]\nirradiance = [3.0, 3.0, 3.0]\n";
    let files = MemoryFiles::from_iter([("s.toml", toml), ("m.obj", obj), ("m.mtl", "newmtl m\nKd 7 1e30 nan\n")]);
    load_scene(&files, Path::new("s.toml")).unwrap_or_default()
}

fn many_lights() -> Scene {
    let mut scene = scenes::court();
    scene.lights = (0..64)
        .map(|i| {
            let at = i as f32;
            let position = [(0.7 * at).sin() * 1.8, 0.2 + 0.04 * at, (0.7 * at).cos() * 1.8];
            match i % 8 {
                // A point light has six shadow maps, and WebGPU guarantees 256 layers in a texture.
                0 => Light::Point { position, intensity: [0.1; 3] },
                1 | 2 => Light::Directional { direction: [(at).sin(), -1.0, (at).cos()], irradiance: [0.1; 3] },
                _ => Light::Spot {
                    position,
                    direction: [0.1, -1.0, 0.0],
                    intensity: [0.1; 3],
                    half_angle_degrees: 60.0,
                    full_intensity_half_angle_degrees: 10.0,
                },
            }
        })
        .collect();
    scene
}

fn motion() -> Vec<Extreme> {
    let group = "parameters";
    let key = |frame, x: f32, cut| CameraKeyframe { frame, eye: [x, 1.4, 4.0], target: [0.1 * x, 0.8, 0.0], cut };
    let mut cuts = scenes::court();
    cuts.moves.camera = vec![key(0, 0.0, false), key(2, 0.3, false), key(3, -1.5, true), key(5, -1.4, false)];
    let mut teleport = scenes::court();
    teleport.moves.camera = vec![key(0, 0.0, false), key(2, 0.0, false), key(3, 500.0, false), key(4, 0.0, false)];
    let mut tumble = scenes::court();
    let keyframes = vec![
        Keyframe::default(),
        Keyframe { frame: 4, translate: [3.0, 0.0, 6.0], rotate_degrees: [400.0, 0.0, 170.0], scale: [1e-3, 2.0, 1.0] },
    ];
    tumble.meshes[2].object = Some(0);
    tumble.moves.objects.push(Motion { pivot: [0.0; 3], keyframes });
    vec![
        Extreme::new(group, "camera cuts", cuts).over(6),
        Extreme::new(group, "camera teleports", teleport).over(5),
        Extreme::new(group, "an object that tumbles through the eye", tumble).over(6),
        Extreme::new(group, "a scene that moves", bundled("motion")).over(3),
        Extreme::new(group, "the largest frame numbers, and 0 after them", scenes::court()).from(u32::MAX - 1).over(4),
        Extreme::new(group, "a scene that moves, at the largest frame numbers", bundled("motion"))
            .from(u32::MAX - 1)
            .over(3),
    ]
}

/// Every choice and both ends of every range, and values outside of the ranges.
fn parameters(suite: &mut Suite) {
    let group = "parameters";
    let native = suite.native;
    let row_name = "every choice and both ends of every range, on a scene that has everything";
    if suite.wants(group, row_name) {
        let extreme = Extreme::new(group, row_name, everything()).over(2);
        let session = Session::new(native, &extreme.scene).keep_all();
        let quick = suite.options.quick;
        let all: Vec<(&'static Technique, Vec<Settings>)> = suite
            .switches
            .iter()
            .map(|s| (s.technique, if quick { s.each.clone() } else { [&s.each[..], &s.pairs].concat() }))
            .collect();
        for (technique, all) in all {
            for settings in all {
                let check = Check::new(group, row_name, technique.name, &settings);
                suite.guarded(check, |check| examine(&session, &extreme, technique, &settings, check));
            }
        }
    }
    let row_name = "values outside a range";
    if suite.wants(group, row_name) {
        let techniques: Vec<&'static Technique> = suite.switches.iter().map(|s| s.technique).collect();
        for technique in techniques {
            let mut accepted = Vec::new();
            let mut count = 0;
            for parameter in (technique.parameters)() {
                for value in switches::outside(&parameter) {
                    count += 1;
                    let settings = Settings::from([(parameter.key(), value)]);
                    let sentence = (technique.complete)(&settings).err().map(|e| e.to_string());
                    let refused =
                        sentence.is_some_and(|s| s.contains(&parameter.key()) && s.contains(&parameter.range()));
                    if !refused || check_settings(&settings, &parameters_of(technique)).is_ok() {
                        accepted.push(words(&settings));
                    }
                }
            }
            let check = Check::new(group, row_name, technique.name, &Settings::new());
            let reason = "each is refused by one sentence with the key and its range";
            let detail = format!("of {count} values {}", accepted.join(", "));
            suite.push(check.bounded("values that were accepted", accepted.len() as f64, 0.0, reason).detail(detail));
        }
    }
}
