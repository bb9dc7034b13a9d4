//! The visibility bitmask beside the methods that it is compared with: what they cost, and what they show.
//!
//!     cargo run --release -p halflight-tests --example bitmask -- cost
//!     cargo run --release -p halflight-tests --example bitmask -- tables --scene scenes/atrium.toml --size 1920x1080
//!     cargo run --release -p halflight-tests --example bitmask -- occlusion --scene scenes/bars.toml
//!     cargo run --release -p halflight-tests --example bitmask -- light --scene scenes/cornell.toml
//!
//! What is compared alternates frame by frame within one run, and the least of some frames counts: other work on the
//! machine slows all alike.

use std::{path::PathBuf, process::ExitCode};

use clap::{Parser, Subcommand};
use halflight_evaluator::{
    Error,
    experiment::reference,
    experiment::session::{Frames, Session, open_scene},
};
use halflight_metrics::{LinearPair, Rgb, bias, mean, p95_abs, percentile, rmse};
use halflight_renderer::truth::{Request as TruthRequest, Stop};
use halflight_techniques::invocation::parse_size;
use halflight_tests::{device, request};

#[derive(Parser)]
struct Args {
    #[command(subcommand)]
    what: What,
    /// Scene file (.toml) or model (.obj).
    #[arg(long, global = true, default_value = "scenes/bars.toml")]
    scene: PathBuf,
    /// Image size, pixels.
    #[arg(long, global = true, default_value = "640x360", value_parser = parse_size, value_name = "WxH")]
    size: [u32; 2],
    /// Frames to time or to average.
    #[arg(long, global = true, default_value_t = 16)]
    frames: u32,
    /// Samples a pixel of the truth.
    #[arg(long, global = true, default_value_t = 128)]
    truth_samples: u32,
    /// Radius of the occlusion, scene units.
    #[arg(long, global = true, default_value_t = 1.0)]
    radius: f32,
}

#[derive(Subcommand, Clone, Copy, PartialEq)]
enum What {
    /// Milliseconds by samples, sectors and resolution, beside gtao.
    Cost,
    /// Tables 1 and 2 of the paper: ratios of the gather's cost beside the published ones.
    Tables,
    /// Converged ambient visibility against the traced one, over thickness.
    Occlusion,
    /// Converged light against the path-traced first bounce and its part on the screen; noise of single frames.
    Light,
    /// Several bounces by feedback against path-traced ones.
    Bounces,
}

fn main() -> ExitCode {
    let args = Args::parse();
    let result = open_scene(&args.scene).and_then(|scene| {
        let session = Session::new(device(), &scene);
        println!("{}, {}x{}, {}", scene.name, args.size[0], args.size[1], device().info.name);
        match args.what {
            What::Cost => cost(&args, &session),
            What::Tables => tables(&args, &session),
            What::Occlusion => occlusion(&args, &session),
            What::Light => light(&args, &session),
            What::Bounces => bounces(&args, &session),
        }
    });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

/// A configuration: name in the table, technique, settings.
type Row<'a> = (String, &'a str, Vec<(&'a str, &'a str)>);

/// A configuration's least milliseconds over some frames.
struct Times {
    gather: f64,
    median_gather: f64,
    all: f64,
    /// A core's work on all passes, and the part of it that the gather has of their times (median).
    work: f64,
    work_of_gather: f64,
}

/// Times configurations frame by frame in turns.
fn timed(args: &Args, session: &Session, configurations: &[Row]) -> Result<Vec<Times>, Error> {
    let cores = std::thread::available_parallelism().map_or(1.0, |n| n.get() as f64);
    let mut scene = session.scene_frames(&Default::default(), args.size)?;
    scene.run(0)?;
    let mut all: Vec<(Frames, Vec<[f64; 4]>)> = Vec::new();
    for (_, technique, settings) in configurations {
        let mut frames = session.technique_frames(&request(technique, settings, args.size), &scene)?;
        frames.run(0)?;
        all.push((frames, Vec::new()));
    }
    for frame in 0..args.frames {
        for (frames, times) in &mut all {
            let before = processor_ms();
            let passes = frames.run(frame)?.passes;
            let work = (processor_ms() - before) / cores;
            let gather: f64 = passes.iter().filter(|pass| pass.name == "gather").map(|pass| pass.milliseconds).sum();
            let whole: f64 = passes.iter().map(|pass| pass.milliseconds).sum();
            times.push([gather, whole, gather / whole, work]);
        }
    }
    let summary = |times: &[[f64; 4]]| {
        let least = |i: usize| times.iter().map(|time| time[i]).fold(f64::INFINITY, f64::min);
        let median = |i: usize| percentile(&mut times.iter().map(|time| time[i]).collect::<Vec<_>>(), 0.5);
        let work = least(3);
        Times { gather: least(0), median_gather: median(0), all: least(1), work, work_of_gather: work * median(2) }
    };
    Ok(all.iter().map(|(_, times)| summary(times)).collect())
}

/// Processor time of this program's threads so far, milliseconds, where Linux tells it: on a software adapter what the
/// shaders took, however long they waited for a core.
fn processor_ms() -> f64 {
    let threads = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    // The first field is the nanoseconds that the thread ran.
    let nanoseconds = threads.filter_map(|thread| {
        let text = std::fs::read_to_string(thread.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    });
    nanoseconds.sum::<f64>() * 1e-6
}

fn cost(args: &Args, session: &Session) -> Result<(), Error> {
    let radius = args.radius.to_string();
    let open = [("finds", "occlusion"), ("radius", radius.as_str()), ("denoise", "0")];
    let published = [&open[..], &[("estimator", "published")]].concat();
    let light = [("radius", radius.as_str()), ("denoise", "0")];
    let configurations: Vec<Row> = vec![
        ("gtao, 12 steps".into(), "gtao", [&open[1..], &[("steps", "12")]].concat()),
        ("gtao with falloff, 12 steps".into(), "gtao", [&open[1..], &[("falloff", "0.6")]].concat()),
        ("published, openness, 12 steps".into(), "bitmask", [&published[..], &[("steps", "12")]].concat()),
        ("radiometric, openness, 12 steps".into(), "bitmask", [&open[..], &[("steps", "12")]].concat()),
        ("radiometric, openness, 12, 64 sectors".into(), "bitmask", [&open[..], &[("sectors", "64")]].concat()),
        ("radiometric, openness, 12, 128 sectors".into(), "bitmask", [&open[..], &[("sectors", "128")]].concat()),
        ("horizon, light, 12 steps".into(), "horizon", light.to_vec()),
        ("ray-march, light, 2 rays of 12 steps".into(), "ray-march", [&light[..], &[("steps", "12")]].concat()),
        ("published, light, 12 steps".into(), "bitmask", [&light[..], &[("estimator", "published")]].concat()),
        ("radiometric, light, 6 steps".into(), "bitmask", [&light[..], &[("steps", "6")]].concat()),
        ("radiometric, light, 12 steps".into(), "bitmask", light.to_vec()),
        ("radiometric, light, 24 steps".into(), "bitmask", [&light[..], &[("steps", "24")]].concat()),
        ("radiometric, light, 48 steps".into(), "bitmask", [&light[..], &[("steps", "48")]].concat()),
        ("radiometric, light, 12, half".into(), "bitmask", [&light[..], &[("resolution", "half")]].concat()),
    ];
    let times = timed(args, session, &configurations)?;
    println!(
        "\n{:<42}{:>12}{:>12}{:>12}{:>14}{:>14}{:>14}",
        "", "gather, ms", "least, ms", "all, ms", "core: gather", "x first row", "core: all"
    );
    for ((name, ..), time) in configurations.iter().zip(&times) {
        println!(
            "{name:<42}{:>12.1}{:>12.1}{:>12.1}{:>14.1}{:>14.2}{:>14.1}",
            time.median_gather,
            time.gather,
            time.all,
            time.work_of_gather,
            time.work_of_gather / times[0].work_of_gather,
            time.work,
        );
    }
    println!(
        "(median gather; then the least of {} frames; core: processor time over the number of cores)",
        args.frames
    );
    let in_steps: Vec<_> = configurations
        .iter()
        .zip(&times)
        .filter_map(|((name, ..), time)| {
            let steps = name.strip_prefix("radiometric, light, ")?.strip_suffix(" steps")?.parse::<f64>().ok()?;
            Some((steps, time.gather))
        })
        .collect();
    let (fixed, per_step) = line(&in_steps);
    println!(
        "\ngather of radiometric light = {fixed:.1} + {per_step:.2} steps (least squares of the relative residual):"
    );
    for (steps, gather) in in_steps {
        let fit = fixed + per_step * steps;
        println!("{steps:>6} steps: {gather:.1} ms, {:+.1} % off the line", 100.0 * (gather / fit - 1.0));
    }
    Ok(())
}

/// Intercept and slope of the line through these points whose relative residuals have the least squares.
fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let sum = |of: fn(f64, f64) -> f64| points.iter().map(|&(x, y)| of(x, y)).sum::<f64>();
    // y is divided by itself: 1 = (a + b x) / y.
    let (aa, ab, bb) = (sum(|_, y| 1.0 / (y * y)), sum(|x, y| x / (y * y)), sum(|x, y| x * x / (y * y)));
    let (a1, b1) = (sum(|_, y| 1.0 / y), sum(|x, y| x / y));
    let determinant = aa * bb - ab * ab;
    ((a1 * bb - b1 * ab) / determinant, (aa * b1 - ab * a1) / determinant)
}

/// Radius, steps, and the published milliseconds of GTAO and bitmask.
const TABLE_1: [(&str, &str, f64, f64); 5] = [
    ("0.8", "8", 0.49, 0.51),
    ("1", "12", 0.75, 0.77),
    ("1", "16", 0.95, 0.97),
    ("2", "16", 1.12, 1.13),
    ("3", "16", 1.12, 1.13),
];

/// Name, steps, radius, spacing, resolution, published milliseconds of the sampling.
const TABLE_2: [(&str, &str, &str, &str, &str, f64); 6] = [
    ("a", "8", "1", "constant", "full", 0.9),
    ("b", "8", "4", "constant", "full", 1.7),
    ("c", "16", "4", "constant", "full", 2.3),
    ("d", "16", "4", "exponential", "full", 2.6),
    ("e", "32", "4", "exponential", "full", 4.0),
    ("f", "16", "4", "exponential", "half", 0.97),
];

fn tables(args: &Args, session: &Session) -> Result<(), Error> {
    let mut configurations: Vec<Row> = Vec::new();
    for (radius, steps, ..) in TABLE_1 {
        let common = [("radius", radius), ("steps", steps), ("spacing", "constant"), ("denoise", "0")];
        let falls = [&common[..], &[("falloff", "0.6")]].concat();
        let published = [&common[..], &[("finds", "occlusion"), ("estimator", "published")]].concat();
        let radiometric = [&common[..], &[("finds", "occlusion")]].concat();
        configurations.extend([
            (String::new(), "gtao", falls),
            (String::new(), "gtao", common.to_vec()),
            (String::new(), "bitmask", published),
            (String::new(), "bitmask", radiometric),
        ]);
    }
    for estimator in ["published", "radiometric"] {
        for (_, steps, radius, spacing, resolution, _) in TABLE_2 {
            let settings = vec![
                ("estimator", estimator),
                ("thickness", "0.2"),
                ("thickness_slope", "0"),
                ("denoise", "0"),
                ("steps", steps),
                ("radius", radius),
                ("spacing", spacing),
                ("resolution", resolution),
            ];
            configurations.push((String::new(), "bitmask", settings));
        }
    }
    let times = timed(args, session, &configurations)?;
    let work: Vec<f64> = times.iter().map(|time| time.work_of_gather).collect();
    println!(
        "\nTable 1: cost over that of gtao\n\n\
         | radius | steps | paper | published, falloff | radiometric | published, none | radiometric |"
    );
    println!("|---:|---:|---:|---:|---:|---:|---:|");
    for ((radius, steps, gtao, bitmask), own) in TABLE_1.iter().zip(work.chunks(4)) {
        println!(
            "| {radius} | {steps} | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} |",
            bitmask / gtao,
            own[2] / own[0],
            own[3] / own[0],
            own[2] / own[1],
            own[3] / own[1]
        );
    }
    println!(
        "\nTable 2: cost over that of a\n\n\
         | | steps | radius | spacing | resolution | paper | published | radiometric |"
    );
    println!("|---|---:|---:|---|---|---:|---:|---:|");
    let light = &work[4 * TABLE_1.len()..];
    for (i, (name, steps, radius, spacing, resolution, ms)) in TABLE_2.iter().enumerate() {
        let [paper, published, radiometric] =
            [ms / TABLE_2[0].5, light[i] / light[0], light[i + TABLE_2.len()] / light[TABLE_2.len()]];
        let set = [name, steps, radius, spacing, resolution].map(|word| *word).join(" | ");
        println!("| {set} | {paper:.2} | {published:.2} | {radiometric:.2} |");
    }
    Ok(())
}

fn occlusion(args: &Args, session: &Session) -> Result<(), Error> {
    let request_truth =
        TruthRequest { ambient_occlusion: Some(args.radius), ..TruthRequest::new(session.scene.camera, args.size) };
    let truth = reference::trace(device(), session.scene, &request_truth, Stop::at_samples(args.truth_samples))?.truth;
    let Some(open) = &truth.ambient_occlusion else { return Err(Error::Failed("the truth has no openness".into())) };
    let reference: Vec<Rgb> = open.mean.iter().map(|&v| [v; 3]).collect();
    let mask: Vec<bool> = truth.depth.iter().map(|&depth| depth > 0.0).collect();
    let radius = args.radius.to_string();
    let common = [("radius", radius.as_str()), ("steps", "16"), ("slices", "2"), ("denoise", "0")];
    println!("truth: mean {:.4}\n", mean(&reference, Some(&mask)));
    println!("{:<42}{:>10}{:>10}{:>10}{:>12}", "", "RMSE", "bias", "P95", "mean |e|");
    let mut rows: Vec<Row> = vec![
        ("gtao without falloff".into(), "gtao", vec![]),
        ("gtao with falloff 0.6".into(), "gtao", vec![("falloff", "0.6")]),
    ];
    for estimator in ["published", "radiometric"] {
        for thickness in ["1", "0.5", "0.25", "0.1", "0.02"] {
            let more = vec![
                ("estimator", estimator),
                ("thickness", thickness),
                ("thickness_slope", "0"),
                ("finds", "occlusion"),
            ];
            rows.push((format!("{estimator}, thickness {thickness}"), "bitmask", more));
        }
    }
    for (name, technique, more) in rows {
        let settings = [&common[..], &more].concat();
        let mut frames = session.frames(&request(technique, &settings, args.size))?;
        let image = frames.mean_over_frames("ambient_occlusion", args.frames)?.0;
        let image: Vec<Rgb> = image.iter().map(|v| [v[0]; 3]).collect();
        let pair = LinearPair::new(&image, &reference, Some(&mask));
        let sizes = image.iter().zip(&reference).zip(&mask).filter(|(_, m)| **m).map(|((a, b), _)| (a[0] - b[0]).abs());
        let size = f64::from(sizes.sum::<f32>()) / mask.iter().filter(|m| **m).count() as f64;
        println!("{name:<42}{:>10.4}{:>+10.4}{:>10.4}{size:>12.4}", rmse(&pair), bias(&pair), p95_abs(&pair));
    }
    Ok(())
}

fn light(args: &Args, session: &Session) -> Result<(), Error> {
    let request_truth =
        TruthRequest { bounce1: true, on_screen: true, ..TruthRequest::new(session.scene.camera, args.size) };
    let truth = reference::trace(device(), session.scene, &request_truth, Stop::at_samples(args.truth_samples))?.truth;
    let (Some(all), Some(seen)) = (&truth.bounce1, &truth.on_screen) else {
        return Err(Error::Failed("the truth has no first bounce".into()));
    };
    let mask: Vec<bool> = truth.depth.iter().map(|&depth| depth > 0.0).collect();
    let (whole, part) = (mean(&all.mean, Some(&mask)), mean(&seen.mean, Some(&mask)));
    println!("truth: mean {whole:.5}, of it from the screen {part:.5} ({:.1} %)\n", 100.0 * part / whole);
    println!(
        "{:<42}{:>12}{:>14}{:>14}{:>12}{:>16}",
        "", "mean", "of screen's", "RMSE/screen's", "noise/mean", "variance, x lower"
    );
    let thickness = |t: &'static str| {
        [("thickness", t), ("thickness_slope", "0"), ("steps", "16"), ("denoise", "0"), ("storage", "float32")]
    };
    let mut rows: Vec<Row> = Vec::new();
    for t in ["0.2", "0.02"] {
        rows.push((format!("ray-march, 2 rays, thickness {t}"), "ray-march", thickness(t).to_vec()));
        for estimator in ["published", "radiometric"] {
            rows.push((
                format!("{estimator}, 1 slice, thickness {t}"),
                "bitmask",
                [&thickness(t)[..], &[("estimator", estimator)]].concat(),
            ));
        }
    }
    rows.push(("horizon, 1 slice".into(), "horizon", thickness("0.2")[2..].to_vec()));
    let mut rays = f64::NAN;
    for (name, technique, settings) in rows {
        let request = halflight_evaluator::experiment::session::Request {
            direct: Some(&truth.direct),
            ..request(technique, &settings, args.size)
        };
        let (image, deviation) = session.frames(&request)?.mean_over_frames("indirect", args.frames)?;
        let found = mean(&image, Some(&mask));
        let pair = LinearPair::new(&image, &seen.mean, Some(&mask));
        let noise = deviation / found;
        if technique == "ray-march" {
            rays = noise;
        }
        println!(
            "{name:<42}{found:>12.5}{:>13.1}%{:>14.3}{noise:>12.3}{:>16.2}",
            100.0 * found / part,
            rmse(&pair) / part,
            (rays / noise).powi(2)
        );
    }
    println!(
        "(variance relative to the mean, of the rays above over that of the row; noise of {} frames is in RMSE, too)",
        args.frames
    );
    Ok(())
}

fn bounces(args: &Args, session: &Session) -> Result<(), Error> {
    println!("{:<42}{:>12}{:>14}", "", "mean", "of 1 bounce");
    let mut first = f64::NAN;
    for bounces in [1, 2, 3, 8] {
        let request_truth = TruthRequest { bounces, ..TruthRequest::new(session.scene.camera, args.size) };
        let truth =
            reference::trace(device(), session.scene, &request_truth, Stop::at_samples(args.truth_samples))?.truth;
        let mask: Vec<bool> = truth.depth.iter().map(|&depth| depth > 0.0).collect();
        let found = truth.indirect.map_or(f64::NAN, |light| mean(&light.mean, Some(&mask)));
        first = if bounces == 1 { found } else { first };
        println!("{:<42}{found:>12.5}{:>14.3}", format!("truth, {bounces} bounces"), found / first);
    }
    let mut own = f64::NAN;
    for feedback in ["0", "0.95"] {
        let settings = [("feedback", feedback), ("denoise", "0"), ("storage", "float32")];
        let mut frames = session.frames(&request("bitmask", &settings, args.size))?;
        for frame in 0..16 {
            frames.run(frame)?;
        }
        let mut sum = 0.0;
        for frame in 16..16 + args.frames {
            frames.run(frame)?;
            let light = frames.read_rgb("indirect")?.unwrap_or_default();
            let shown: Vec<bool> =
                frames.read("depth")?.unwrap_or_default().iter().map(|texel| texel[0] > 0.0).collect();
            sum += mean(&light, Some(&shown)) / f64::from(args.frames);
        }
        own = if feedback == "0" { sum } else { own };
        println!("{:<42}{sum:>12.5}{:>14.3}", format!("bitmask, feedback {feedback}"), sum / own);
    }
    Ok(())
}
