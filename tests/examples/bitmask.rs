//! The visibility bitmask beside the methods that it is compared with: what they cost, and what they show.
//!
//!     cargo run --release -p halflight-tests --example bitmask -- cost
//!     cargo run --release -p halflight-tests --example bitmask -- occlusion --scene scenes/bars.toml
//!     cargo run --release -p halflight-tests --example bitmask -- light --scene scenes/cornell.toml
//!
//! What is compared alternates frame by frame within one run, and ratios are taken between neighbours in time: other work
//! on the machine slows both alike.

use std::{path::PathBuf, process::ExitCode};

use clap::{Parser, Subcommand};
use halflight_evaluator::{
    Error,
    command::parse_size,
    metrics::{Rgb, linear_errors, mean},
    session::{Frames, Session, open_scene},
    statistics::percentile,
    truth,
};
use halflight_renderer::truth::{Request as TruthRequest, Stop};
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
    /// Converged openness against traced openness, over thickness.
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

/// A configuration that is timed: name, frames, milliseconds of the gather, of all passes, and of a core's work on them.
type Timed<'a> = (&'a str, Frames<'a>, Vec<f64>, Vec<f64>, Vec<f64>);

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
        ("radiometric, light, 12, half".into(), "bitmask", [&light[..], &[("resolution", "half")]].concat()),
    ];
    let mut scene = session.scene_frames(&Default::default(), args.size)?;
    scene.run(0)?;
    let mut all: Vec<Timed> = Vec::new();
    for (name, technique, settings) in &configurations {
        let mut frames = session.technique_frames(&request(technique, settings, args.size), &scene)?;
        frames.run(0)?;
        all.push((name, frames, Vec::new(), Vec::new(), Vec::new()));
    }
    for frame in 0..args.frames {
        for (_, frames, gather, whole, processor) in &mut all {
            let before = processor_ms();
            let passes = frames.run(frame)?.passes;
            processor.push(processor_ms() - before);
            gather.push(passes.iter().filter(|p| p.name == "gather").map(|p| p.milliseconds).sum());
            whole.push(passes.iter().map(|p| p.milliseconds).sum());
        }
    }
    let cores = std::thread::available_parallelism().map_or(1.0, |n| n.get() as f64);
    println!(
        "\n{:<42}{:>12}{:>12}{:>12}{:>12}{:>14}{:>16}{:>14}",
        "", "gather, ms", "least, ms", "all, ms", "least, ms", "x first row", "of a core, ms", "x first row"
    );
    let least = |values: &[f64]| values.iter().copied().fold(f64::INFINITY, f64::min);
    let first = [least(&all[0].2), least(&all[0].4)];
    for (name, _, gather, whole, processor) in &all {
        println!(
            "{name:<42}{:>12.1}{:>12.1}{:>12.1}{:>12.1}{:>14.2}{:>16.1}{:>14.2}",
            percentile(&mut gather.clone(), 0.5),
            least(gather),
            percentile(&mut whole.clone(), 0.5),
            least(whole),
            least(gather) / first[0],
            least(processor) / cores,
            least(processor) / first[1],
        );
    }
    println!("(ratios of the least; a core's work is all passes', shared out over {cores} cores)");
    Ok(())
}

fn occlusion(args: &Args, session: &Session) -> Result<(), Error> {
    let request_truth =
        TruthRequest { ambient_occlusion: Some(args.radius), ..TruthRequest::new(session.scene.camera, args.size) };
    let truth = truth::trace(device(), session.scene, &request_truth, Stop::at_samples(args.truth_samples))?.truth;
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
        let errors = linear_errors(&image, &reference, Some(&mask));
        let sizes = image.iter().zip(&reference).zip(&mask).filter(|(_, m)| **m).map(|((a, b), _)| (a[0] - b[0]).abs());
        let size = f64::from(sizes.sum::<f32>()) / mask.iter().filter(|m| **m).count() as f64;
        println!("{name:<42}{:>10.4}{:>+10.4}{:>10.4}{size:>12.4}", errors.rmse, errors.bias, errors.p95_abs);
    }
    Ok(())
}

fn light(args: &Args, session: &Session) -> Result<(), Error> {
    let request_truth =
        TruthRequest { bounce1: true, on_screen: true, ..TruthRequest::new(session.scene.camera, args.size) };
    let truth = truth::trace(device(), session.scene, &request_truth, Stop::at_samples(args.truth_samples))?.truth;
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
        let request = halflight_evaluator::session::Request {
            direct: Some(&truth.direct),
            ..request(technique, &settings, args.size)
        };
        let (image, deviation) = session.frames(&request)?.mean_over_frames("indirect", args.frames)?;
        let found = mean(&image, Some(&mask));
        let errors = linear_errors(&image, &seen.mean, Some(&mask));
        let noise = deviation / found;
        if technique == "ray-march" {
            rays = noise;
        }
        println!(
            "{name:<42}{found:>12.5}{:>13.1}%{:>14.3}{noise:>12.3}{:>16.2}",
            100.0 * found / part,
            errors.rmse / part,
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
        let truth = truth::trace(device(), session.scene, &request_truth, Stop::at_samples(args.truth_samples))?.truth;
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
