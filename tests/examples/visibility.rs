//! What visibility by voxels is worth: converged images against truth, and rays against traced geometry.
//!
//!     cargo run --release -p halflight-tests --example visibility -- --scene scenes/bars.toml --scene scenes/atrium.toml
//!
//! The first table holds the mean of many frames against the path-traced first bounce, visibility off and on; relMSE is
//! that of `albedo * indirect`. The second takes pairs of surfels as the gather does and asks both the grid of each
//! level and the scene's triangles whether one sees the other.

use std::{path::PathBuf, process::ExitCode};

use clap::Parser;
use glam::{Mat4, Vec3, Vec3A};
use halflight_evaluator::{
    Error,
    experiment::{
        reference,
        session::{Request, Session, open_scene},
    },
};
use halflight_metrics::{LinearPair, Rgb, bias, mean, rel_mse, rmse};
use halflight_renderer::{
    parameters::{Settings, Value},
    truth::{Request as TruthRequest, Stop},
};
use halflight_scenes::{Material, Scene, Texture};
use halflight_soundness::oracle::{
    self,
    pairs::{Level, answered, surfels_of},
    voxels::Grid,
};
use halflight_techniques::invocation::parse_size;
use halflight_tests::{device, known};
use obvhs::{
    cwbvh::{CwBvh, bvh2_to_cwbvh::bvh2_to_cwbvh},
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
    ray::Ray,
    triangle::Triangle,
};

#[derive(Parser)]
struct Args {
    /// Scene file (.toml) or model (.obj); may be given many times.
    #[arg(long = "scene", default_values = ["scenes/bars.toml", "scenes/atrium.toml"])]
    scenes: Vec<PathBuf>,
    /// Image size, pixels.
    #[arg(long, default_value = "640x360", value_parser = parse_size, value_name = "WxH")]
    size: [u32; 2],
    /// A setting of the hierarchical technique; may be given many times.
    #[arg(long = "set", value_name = "NAME=VALUE")]
    settings: Vec<String>,
    /// Frames that a converged image averages.
    #[arg(long, default_value_t = 32)]
    frames: u32,
    /// Samples a pixel of the truth.
    #[arg(long, default_value_t = 64)]
    truth_samples: u32,
    /// Pairs for each level.
    #[arg(long, default_value_t = 10_000)]
    pairs: usize,
}

fn main() -> ExitCode {
    let args = Args::parse();
    for path in &args.scenes {
        let result = open_scene(path).and_then(|scene| {
            let session = Session::new(device(), &scene).keep_all();
            let needs = &session.facts.needs;
            println!("{}: {} watertight meshes, {} others", scene.name, needs.watertight_meshes, needs.open_meshes);
            errors(&args, &session)?;
            rays(&args, &session)
        });
        if let Err(error) = result {
            eprintln!("error: {error}");
            return ExitCode::from(error.exit_code());
        }
    }
    ExitCode::SUCCESS
}

fn settings(args: &Args, more: &[(&str, &str)]) -> Result<Settings, Error> {
    let mut settings = Settings::new();
    for text in &args.settings {
        let (name, value) = text
            .split_once('=')
            .ok_or_else(|| Error::BadInput(format!("--set {text} has no value: write --set {text}=VALUE")))?;
        settings.insert(format!("hierarchical.{name}"), Value::parse(value));
    }
    settings.extend(more.iter().map(|(name, value)| (format!("hierarchical.{name}"), Value::parse(value))));
    Ok(settings)
}

const KINDS: [(&str, &str); 5] =
    [("off", "or"), ("surface", "and"), ("surface", "or"), ("auto", "and"), ("auto", "or")];

/// Kinds that differ in this scene: without watertight meshes auto is surface.
fn kinds(session: &Session) -> impl Iterator<Item = (&'static str, &'static str)> {
    let solid = session.facts.needs.watertight_meshes > 0;
    KINDS.into_iter().filter(move |(kind, _)| solid || *kind != "auto")
}

fn errors(args: &Args, session: &Session) -> Result<(), Error> {
    let request = TruthRequest { bounces: 1, ..TruthRequest::new(session.scene.camera, args.size) };
    let truth = reference::trace(device(), session.scene, &request, Stop::at_samples(args.truth_samples))?.truth;
    let Some(bounce) = &truth.indirect else { return Err(Error::Failed("the truth has no first bounce".into())) };
    let lit = |light: &[Rgb]| -> Vec<Rgb> {
        truth.albedo.iter().zip(light).map(|(a, l)| std::array::from_fn(|c| a[c] * l[c])).collect()
    };
    let mask: Vec<bool> = truth.depth.iter().map(|&depth| depth > 0.0).collect();
    let reference = lit(&bounce.mean);
    let middle = mean(&reference, Some(&mask));
    // What the truth's own noise adds to relMSE.
    let deviation = lit(&bounce.standard_error);
    let noisy: Vec<Rgb> = reference.iter().zip(&deviation).map(|(t, e)| std::array::from_fn(|c| t[c] + e[c])).collect();
    let noise = rel_mse(&LinearPair::new(&noisy, &reference, Some(&mask)));
    println!(
        "\n{:<12}{:<8}{:>9}{:>13}{:>13}{:>12}{:>12}{:>12}",
        "visibility", "levels", "relMSE", "bias / mean", "RMSE / mean", "of it dark", "middle", "bright"
    );
    let show = |kind: &str, downsampling: &str, image: &[Rgb]| {
        let lit = lit(image);
        let pair = LinearPair::new(&lit, &reference, Some(&mask));
        // Which pixels the error stands on: truth under a tenth of its mean, up to the mean, above it.
        let share = |wanted: &dyn Fn(f64) -> bool| {
            let of = |(x, t): (&f32, &f32)| {
                let (x, t) = (f64::from(*x), f64::from(*t));
                if wanted(t / middle) { (x - t).powi(2) / (t * t + 0.01 * middle * middle) } else { 0.0 }
            };
            let shown = lit.iter().zip(&reference).zip(&mask).filter(|(_, shown)| **shown);
            let pixels = mask.iter().filter(|shown| **shown).count();
            shown.flat_map(|((x, t), _)| x.iter().zip(t)).map(of).sum::<f64>() / (3 * pixels) as f64
        };
        println!(
            "{kind:<12}{downsampling:<8}{:>9.3}{:>13.3}{:>13.3}{:>12.3}{:>12.3}{:>12.3}",
            rel_mse(&pair),
            bias(&pair) / middle,
            rmse(&pair) / middle,
            share(&|t| t < 0.1),
            share(&|t| (0.1..1.0).contains(&t)),
            share(&|t| t >= 1.0),
        );
    };
    show("no light", "", &vec![[0.0; 3]; reference.len()]);
    for (kind, downsampling) in kinds(session) {
        let settings = settings(args, &[("visibility", kind), ("visibility_downsampling", downsampling)])?;
        let request = Request {
            technique: known("hierarchical"),
            settings,
            size: args.size,
            seed: 0,
            direct: Some(&truth.direct),
        };
        let (image, _) = session.frames(&request)?.mean_over_frames("indirect", args.frames)?;
        show(kind, if kind == "off" { "" } else { downsampling }, &image);
    }
    println!("(truth: {} samples a pixel, whose noise adds about {noise:.4} to each relMSE)", truth.samples);
    Ok(())
}

fn rays(args: &Args, session: &Session) -> Result<(), Error> {
    let geometry = Geometry::of(session.scene);
    println!(
        "\n{:<12}{:<6}{:>6}{:>12}{:>14}{:>14}{:>14}{:>14}",
        "visibility", "levels", "level", "hidden, %", "light leaks, %", "falsely dark,%", "wrong, %", "voxels set, %"
    );
    for (kind, downsampling) in kinds(session).filter(|(kind, _)| *kind != "off") {
        let settings = settings(args, &[("visibility", kind), ("visibility_downsampling", downsampling)])?;
        let (frames, levels) = answered(session, &settings, args.size, args.pairs)?;
        let to_world = frames.view().world_to_view.inverse();
        let scale = args.size[0].div_ceil(levels[0].surfels.size[0]);
        let mut grid = Grid::read(&frames, scale);
        for (k, Level { surfels, pairs, seen }) in levels.iter().enumerate() {
            let (mut hidden, mut leaks, mut dark) = (0, 0, 0);
            for (&pair, &seen) in pairs.iter().zip(seen) {
                let open = geometry.sees(surfels_of(surfels, pair), to_world);
                hidden += usize::from(!open);
                leaks += usize::from(seen && !open);
                dark += usize::from(!seen && open);
            }
            let share = |count: usize| 100.0 * count as f64 / pairs.len().max(1) as f64;
            println!(
                "{kind:<12}{downsampling:<6}{k:>6}{:>12.1}{:>14.1}{:>14.1}{:>14.1}{:>14.2}",
                share(hidden),
                share(leaks),
                share(dark),
                share(leaks + dark),
                100.0 * grid.filled()
            );
            grid = grid.coarser(downsampling == "or");
        }
    }
    println!("(hidden: by triangles; without any test, that share would be wrong)\n");
    Ok(())
}

/// A cut-out texture and the places of a triangle's corners in it.
type Cutout<'a> = (&'a Texture, [[f32; 2]; 3]);

/// The triangles, with what makes holes in them.
struct Geometry<'a> {
    triangles: Vec<Triangle>,
    holes: Vec<Option<Cutout<'a>>>,
    bvh: CwBvh,
}

impl<'a> Geometry<'a> {
    fn of(scene: &'a Scene) -> Self {
        let (mut triangles, mut holes) = (Vec::new(), Vec::new());
        for mesh in &scene.meshes {
            let texture = scene.materials.get(mesh.material).and_then(|m: &Material| m.alpha_texture);
            for corners in mesh.indices.as_chunks::<3>().0 {
                let [v0, v1, v2] = corners.map(|i| Vec3A::from(mesh.positions[i as usize]));
                triangles.push(Triangle { v0, v1, v2 });
                holes.push(texture.map(|t| (&scene.textures[t], corners.map(|i| mesh.uvs[i as usize]))));
            }
        }
        let boxes: Vec<_> = triangles.iter().map(Triangle::aabb).collect();
        let indices = (0..triangles.len() as u32).collect();
        let binary = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Medium,
            &boxes,
            indices,
            SortPrecision::U64,
            1,
        );
        Self { triangles, holes, bvh: bvh2_to_cwbvh(&binary, 3, true, false) }
    }

    /// Whether no triangle stands between two surfels, ends left out.
    fn sees(&self, pair: [oracle::Pixel; 2], to_world: Mat4) -> bool {
        let [from, to] = pair.map(|pixel| to_world.transform_point3(pixel.position.as_vec3()));
        let way: Vec3 = to - from;
        let length = way.length();
        // Surfels lie on triangles to float32's precision of a depth; a thousandth of the way clears that.
        let ray = Ray::new(from.into(), (way / length).into(), 1e-3 * length, (1.0 - 1e-3) * length);
        self.bvh.ray_traverse_miss(ray, |ray, id| {
            let index = self.bvh.primitive_indices[id] as usize;
            let t = self.triangles[index].intersect(ray);
            if t < ray.tmax && self.is_hole(index, ray.origin + ray.direction * t) { f32::INFINITY } else { t }
        })
    }

    fn is_hole(&self, index: usize, point: Vec3A) -> bool {
        let Some((texture, uvs)) = &self.holes[index] else { return false };
        let Triangle { v0, v1, v2 } = self.triangles[index];
        let area = |a: Vec3A, b: Vec3A, c: Vec3A| (b - a).cross(c - a).length();
        let weights = [area(point, v1, v2), area(v0, point, v2), area(v0, v1, point)].map(|a| a / area(v0, v1, v2));
        let uv: [f32; 2] = std::array::from_fn(|axis| (0..3).map(|i| weights[i] * uvs[i][axis]).sum());
        let texel = |v: f32, size: u32| ((v - v.floor()) * size as f32) as u32 % size;
        let at = texel(uv[1], texture.height) * texture.width + texel(uv[0], texture.width);
        texture.rgba[4 * at as usize + 3] < 128
    }
}
