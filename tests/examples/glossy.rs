//! What importance is worth for glossy light, and how far it is from the path tracer's.
//!
//!     cargo run --release -p halflight-tests --example glossy
//!
//! On the court with a glossy floor. The first table holds the variance of one frame, over the pixels that show glossy
//! light, for as many samples; beside it stand the time of the glossy gathers and the gain for as much time. The second
//! holds the converged image against the truth.

use std::process::ExitCode;

use clap::Parser;
use halflight_evaluator::{
    Error,
    experiment::reference,
    experiment::session::{Request, Session},
};
use halflight_frame_graph::PassTime;
use halflight_metrics::{LinearPair, Rgb, mean, percentile, rel_mse, rmse};
use halflight_renderer::truth::{Request as TruthRequest, Stop};
use halflight_soundness::scenes::polished;
use halflight_techniques::invocation::parse_size;
use halflight_tests::{device, request};

#[derive(Parser)]
struct Args {
    /// Image size, pixels.
    #[arg(long, default_value = "640x360", value_parser = parse_size, value_name = "WxH")]
    size: [u32; 2],
    /// Frames whose variance is taken, and that a converged image averages.
    #[arg(long, default_value_t = 24)]
    frames: u32,
    /// Samples a pixel of the truth.
    #[arg(long, default_value_t = 256)]
    truth_samples: u32,
}

const EXPONENTS: [f32; 3] = [4.0, 32.0, 128.0];

fn main() -> ExitCode {
    let args = Args::parse();
    if let Err(error) = variances(&args).and_then(|()| errors(&args)) {
        eprintln!("error: {error}");
        return ExitCode::from(error.exit_code());
    }
    ExitCode::SUCCESS
}

/// One frame's glossy light, over the pixels that show any.
struct Sampled {
    mean: f64,
    variance: f64,
    milliseconds: f64,
}

fn sampled(session: &Session, request: &Request, count: u32) -> Result<Sampled, Error> {
    let mut frames = session.frames(request)?;
    let (mut sums, mut squares, mut times): (Vec<f64>, Vec<f64>, Vec<f64>) = Default::default();
    for frame in 0..count {
        let time = frames.run(frame)?;
        let glossy = |pass: &&PassTime| pass.name.starts_with("gather_") && pass.name.ends_with("_glossy");
        times.push(time.passes.iter().filter(glossy).map(|pass| pass.milliseconds).sum());
        let light = frames.read_rgb("glossy")?.unwrap_or_default();
        sums.resize(light.len(), 0.0);
        squares.resize(light.len(), 0.0);
        for ((sum, square), pixel) in sums.iter_mut().zip(&mut squares).zip(&light) {
            *sum += f64::from(pixel[1]);
            *square += f64::from(pixel[1]) * f64::from(pixel[1]);
        }
    }
    let n = f64::from(count);
    let lit = sums.iter().filter(|sum| **sum > 0.0).count() as f64;
    let variance =
        sums.iter().zip(&squares).map(|(sum, square)| (square - sum * sum / n) / (n - 1.0)).sum::<f64>() / lit;
    Ok(Sampled { mean: sums.iter().sum::<f64>() / n / lit, variance, milliseconds: percentile(&mut times, 0.5) })
}

fn settings_of(importance: &str, samples: &str) -> Request<'static> {
    let settings = [
        ("glossy", "on"),
        ("glossy_importance", importance),
        ("samples", samples),
        ("disc_area", "texel"),
        ("storage", "float32"),
    ];
    request("hierarchical", &settings, [1, 1])
}

fn variances(args: &Args) -> Result<(), Error> {
    println!(
        "| exponent | samples | importance | mean, of even | variance, times lower | gathers, ms | for equal time |"
    );
    println!("| ---: | ---: | :--- | ---: | ---: | ---: | ---: |");
    for exponent in EXPONENTS {
        let scene = polished(exponent);
        let session = Session::new(device(), &scene);
        for samples in ["4", "16", "64"] {
            let mut even: Option<Sampled> = None;
            for importance in ["off", "2010", "lobe"] {
                let request = Request { size: args.size, ..settings_of(importance, samples) };
                let now = sampled(&session, &request, args.frames)?;
                let first = even.as_ref().unwrap_or(&now);
                let gain = first.variance / now.variance;
                println!(
                    "| {exponent} | {samples} | {importance} | {:.3} | {gain:.1} | {:.1} | {:.1} |",
                    now.mean / first.mean,
                    now.milliseconds,
                    gain * first.milliseconds / now.milliseconds
                );
                even.get_or_insert(now);
            }
        }
    }
    Ok(())
}

fn errors(args: &Args) -> Result<(), Error> {
    println!("\n| exponent | visibility | mean, of the truth | relMSE | RMSE, of the mean | noise of the truth |");
    println!("| ---: | :--- | ---: | ---: | ---: | ---: |");
    for exponent in EXPONENTS {
        let scene = polished(exponent);
        let session = Session::new(device(), &scene);
        let request_of_truth = TruthRequest { glossy: true, ..TruthRequest::new(scene.camera, args.size) };
        let traced = reference::trace(device(), &scene, &request_of_truth, Stop::at_samples(args.truth_samples))?.truth;
        let glossy = traced.glossy.unwrap_or_default();
        let mask: Vec<bool> = glossy.mean.iter().map(|pixel| pixel[0] > 0.0).collect();
        let truth_mean = mean(&glossy.mean, Some(&mask));
        let noise = mean(&glossy.standard_error, Some(&mask)) / truth_mean;
        for visibility in ["off", "surface"] {
            let mut request = Request { size: args.size, ..settings_of("lobe", "64") };
            request.settings.extend(halflight_tests::settings("hierarchical", &[("visibility", visibility)]));
            let image = session.frames(&request)?.mean_over_frames("glossy", args.frames)?.0;
            let image: Vec<Rgb> = image.iter().map(|pixel| pixel.map(|v| 0.5 * v)).collect();
            let pair = LinearPair::new(&image, &glossy.mean, Some(&mask));
            println!(
                "| {exponent} | {visibility} | {:.3} | {:.3} | {:.3} | {noise:.3} |",
                mean(&image, Some(&mask)) / truth_mean,
                rel_mse(&pair),
                rmse(&pair) / truth_mean,
            );
        }
    }
    Ok(())
}
