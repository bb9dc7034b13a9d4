//! A report over made-up measurements and painted pictures, to look at its layout without rendering anything:
//! `cargo run -p halflight-evaluator --example sample_report -- FOLDER`

use std::error::Error;

use halflight_evaluator::measurement::{Measurement, Timing};
use halflight_evaluator::report::{Pictures, Report};
use halflight_metrics::{DisplayPair, LinearPair, MetricId, Rgb, Values};
use halflight_native::images::{auto_exposure, tone_map_all};
use halflight_output::{OutputFolder, terminal};
use halflight_techniques::invocation::Invocation;
use serde_json::{Map, Value, json};

const WIDTH: u32 = 640;
const HEIGHT: u32 = 360;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("name a folder for the report")?;
    let folder = &OutputFolder::open(folder);
    let court = Court::paint();
    let mut measurements = Vec::new();
    for start_resolution in ["half", "quarter"] {
        for levels in [3, 4, 5] {
            for samples in [16, 64, 128, 256] {
                measurements.push(court.measure(folder, start_resolution, levels, samples)?);
            }
        }
    }
    measurements.extend(["hierarchical", "gtao", "none"].map(other_scene));
    Report {
        title: "Hierarchical SSIL over start resolution, levels and samples".into(),
        summary: "Made-up figures: this page shows the layout of a report, not a measurement.".into(),
        command: "cargo run -p halflight-evaluator --example sample_report -- FOLDER".into(),
        references: Vec::new(),
        warnings: vec!["thorn_mask.png is missing; the material \"leaf\" is drawn in grey.".into()],
        measurements,
    }
    .write(folder)?;
    terminal::print_line(folder.path().join("index.html").display())?;
    Ok(())
}

/// A painted court: columns under a sky, sun on the floor, coloured light from two curtains.
struct Court {
    surface: Vec<bool>,
    albedo: Vec<Rgb>,
    direct: Vec<Rgb>,
    indirect: Vec<Rgb>,
}

impl Court {
    fn paint() -> Self {
        let (mut surface, mut albedo, mut direct, mut indirect) = (vec![], vec![], vec![], vec![]);
        for index in 0..WIDTH * HEIGHT {
            let x = (index % WIDTH) as f32 / WIDTH as f32 * 2.0 - 1.0;
            let y = 1.0 - (index / WIDTH) as f32 / HEIGHT as f32 * 2.0;
            let sky = y > 0.55 && x.abs() < 0.45 * (y - 0.1);
            let near = (x.abs() - 0.25).max(0.0) / 0.75;
            let column = y > -0.45 - 0.4 * near && (near * 3.2).fract() < 0.28 && near > 0.05;
            let floor = y < -0.4 - 0.35 * near && !column;
            let curtain = !floor && !column && (0.12..0.2).contains(&(near * 3.2).fract().abs());
            let colour = match (floor, column, curtain, x < 0.0) {
                (true, ..) => [0.55, 0.5, 0.43].map(|value| {
                    value * (0.85 + 0.15 * ((x / (y - 0.2) * 9.0).floor() + (2.0 / (y - 0.2)).floor()).rem_euclid(2.0))
                }),
                (_, true, ..) => [0.68, 0.62, 0.52],
                (_, _, true, true) => [0.6, 0.1, 0.08],
                (_, _, true, false) => [0.1, 0.2, 0.55],
                _ => [0.5, 0.42, 0.34].map(|value| value * (0.9 + 0.1 * (y * 40.0).sin().signum())),
            };
            let sun = if floor && (x + 0.5 * y).abs() < 0.22 { 2.6 } else { 0.0 };
            let bounce = 0.16 * (-(y + 0.6).abs() * 1.3).exp() + 0.03;
            let red = 0.12 * (-(x + 0.5).abs() * 4.0).exp();
            let blue = 0.12 * (-(x - 0.5).abs() * 4.0).exp();
            surface.push(!sky);
            albedo.push(if sky { [0.0; 3] } else { colour });
            direct.push(if sky { [0.9, 1.3, 2.0] } else { colour.map(|value| value * (sun + 0.01)) });
            indirect.push(if sky { [0.0; 3] } else { [bounce + red, bounce + 0.02, bounce + blue] });
        }
        Self { surface, albedo, direct, indirect }
    }

    /// Coarse blocks, noise that falls with samples and darkness that falls with levels, timed by a formula.
    fn measure(
        &self,
        folder: &OutputFolder,
        start: &str,
        levels: u32,
        samples: u32,
    ) -> Result<Measurement, Box<dyn Error>> {
        let block = if start == "half" { 2 } else { 4 };
        let noise = 0.9 / (samples as f32).sqrt();
        let energy = 1.0 - 0.5 / (levels * levels) as f32 - 0.02 * block as f32;
        let reflected = |indirect: &dyn Fn(usize) -> Rgb| -> Vec<Rgb> {
            let product = |(index, albedo): (usize, &Rgb)| std::array::from_fn(|c| albedo[c] * indirect(index)[c]);
            self.albedo.iter().enumerate().map(product).collect()
        };
        let truth = reflected(&|index| self.indirect[index]);
        let image = reflected(&|index| {
            let (x, y) = (index as u32 % WIDTH / block, index as u32 / WIDTH / block);
            let hash = (x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77)).wrapping_mul(0xC2B2_AE3D) >> 8;
            let factor = energy * (1.0 + noise * (hash as f32 / (1 << 23) as f32 - 1.0));
            self.indirect[index].map(|value| value * factor)
        });
        let with_direct = |indirect: &[Rgb]| -> Vec<Rgb> {
            self.direct.iter().zip(indirect).map(|(d, i)| std::array::from_fn(|c| d[c] + i[c])).collect()
        };
        let (whole, true_whole) = (with_direct(&image), with_direct(&truth));
        let mask = Some(self.surface.as_slice());
        let exposure = auto_exposure(&true_whole, mask);
        let shown = [tone_map_all(&whole, exposure), tone_map_all(&true_whole, exposure)];
        let pair = DisplayPair { width: WIDTH, linear: [&whole, &true_whole], display: [&shown[0], &shown[1]], mask };
        let mut errors = Values::default();
        errors.measure_indirect(&LinearPair::new(&image, &truth, mask), WIDTH);
        errors.measure_final(&pair);
        errors.set(MetricId::TruthRelError, Some(0.02));

        let gather = 0.11 * f64::from(samples) * if start == "half" { 3.8 } else { 1.0 };
        let tail = |level: i32| gather * 0.25f64.powi(level);
        let mut pass_ms = Map::new();
        for level in 0..levels as i32 {
            pass_ms.insert(format!("gather_{level}"), json!(tail(level)));
        }
        pass_ms.insert("combine".into(), json!(if start == "half" { 7.1 } else { 5.7 }));
        pass_ms.insert("composite".into(), json!(1.1));
        let total: f64 = pass_ms.values().filter_map(Value::as_f64).sum();
        let time =
            Timing::of(&(0..12).map(|frame| total * (1.0 + 0.004 * f64::from(frame * 7 % 12))).collect::<Vec<_>>());

        let pictures = Pictures { folder, width: WIDTH, mask };
        let dim = auto_exposure(&truth, mask);
        let name = format!("{start}-{levels}-{samples}");
        let mut images = Map::new();
        images.insert("final".into(), pictures.radiance(&format!("{name}-final"), &whole, exposure)?);
        images.insert("indirect".into(), pictures.radiance(&format!("{name}-indirect"), &image, dim)?);
        images.insert("error".into(), pictures.error(&format!("{name}-error"), &image, &truth)?);
        images.insert("truth_final".into(), pictures.radiance("truth-final", &true_whole, exposure)?);
        images.insert("truth_indirect".into(), pictures.radiance("truth-indirect", &truth, dim)?);

        let mut row = Measurement {
            scene: "atrium".into(),
            camera: "nave".into(),
            width: WIDTH,
            height: HEIGHT,
            technique: "hierarchical".into(),
            parameters: object(json!({
                "hierarchical.start_resolution": start,
                "hierarchical.levels": levels,
                "hierarchical.samples": samples,
                "hierarchical.radius": 20,
                "hierarchical.form_factor": "disc",
            })),
            pass_ms,
            frame_ms_median: total + 8.4,
            memory_bytes: u64::from(WIDTH * HEIGHT) * (16 + 48 / u64::from(block) * u64::from(levels)),
            errors,
            preset: "soler2009_fig6".into(),
            command: Invocation::evaluator("render")
                .option("scene", "scenes/atrium.toml")
                .option("technique", "hierarchical")
                .option("set", format_args!("hierarchical.start_resolution={start}"))
                .option("set", format_args!("hierarchical.levels={levels}"))
                .option("set", format_args!("hierarchical.samples={samples}"))
                .size([WIDTH, HEIGHT])
                .option("out", format_args!("{name}.exr"))
                .to_string(),
            images,
            ..adapter()
        };
        row.set_time(&time.ok_or("twelve frames are timed")?);
        Ok(row)
    }
}

/// A row of a second scene, without truth and pictures.
fn other_scene(technique: &str) -> Measurement {
    let time = 3.0 + technique.len() as f64;
    Measurement {
        scene: "cornell".into(),
        width: 1280,
        height: 720,
        technique: technique.into(),
        parameters: object(json!({ format!("{technique}.radius"): 40 })),
        frames: 8,
        time_ms_median: time,
        time_ms_min: 0.98 * time,
        time_ms_p95: 1.7 * time,
        frame_ms_median: time + 5.0,
        memory_bytes: 3 << 22,
        ..adapter()
    }
}

fn adapter() -> Measurement {
    Measurement {
        adapter: "llvmpipe (LLVM 15.0.6, 256 bits)".into(),
        driver: "Mesa 22.3.6".into(),
        backend: "Vulkan".into(),
        software_adapter: true,
        commit: "0123456789ab".into(),
        ..Measurement::default()
    }
}

fn object(value: Value) -> Map<String, Value> {
    value.as_object().cloned().unwrap_or_default()
}
