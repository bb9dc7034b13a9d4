//! A quick run of `cargo xtask stability`: every row with a few settings, random configurations, damaged files, and two
//! deliberate bugs that must turn rows red. docs/soundness.md has the table of the whole run.
#![allow(clippy::unwrap_used)]
#![allow(clippy::disallowed_macros, reason = "`cargo test` captures what a test prints")]

use halflight_evaluator::experiment::session::{Request, Session};
use halflight_native::{AdapterChoice, NativeGpu};
use halflight_renderer::parameters::{Settings, Value};
use halflight_soundness::{
    fuzz, mutations, random, scenes,
    suite::{Options, Suite},
};
use halflight_techniques::{TECHNIQUES, technique};

fn adapter() -> AdapterChoice {
    AdapterChoice::from(std::env::var("HALFLIGHT_ADAPTER").unwrap_or_default().as_str())
}

#[test]
fn every_row_of_a_quick_run_holds() {
    let table = Suite::run(&NativeGpu::open(&adapter()).unwrap(), &Options::default()).unwrap();
    println!("{table}");
    let open: Vec<String> = table
        .unexplained()
        .map(|c| format!("{}: {} {}: {} over {:?}", c.row, c.technique, c.settings, c.worst, c.bound))
        .collect();
    assert!(open.is_empty(), "{open:#?}");
    // Every listed technique took part.
    for technique in TECHNIQUES {
        assert!(table.checks.iter().any(|check| check.technique == technique.name), "{}", technique.name);
    }
}

#[test]
fn the_nan_check_counts_what_a_shader_writes() {
    // On a device of its own, the last pass writes five invalid pixels into the first row.
    let native = NativeGpu::open(&adapter()).unwrap();
    for name in ["composite/composite", "composite/composite+float16"] {
        let shader = halflight_shared_shaders::shader(name).unwrap();
        let store = "textureStore(final_image, pixel, vec4f(radiance, 1.0));";
        // The compiler does not know which pixels they are, so that no constant is NaN.
        let bad = "var bits = 0u;
            if pixel.y == 0u && pixel.x < 2u { bits = 0x7fc00000u + pixel.x; }
            if pixel.y == 0u && pixel.x == 2u { bits = 0x7f800000u + pixel.y; }
            if pixel.y == 0u && pixel.x == 3u { bits = 0xbf800000u + pixel.y; }
            if pixel.y == 0u && pixel.x == 4u { bits = 0x7149f2cau + pixel.y; }
            if bits != 0u { radiance = vec3f(bitcast<f32>(bits), 0.25, 0.5); }";
        let limit = if name.ends_with("float16") { "radiance = clamp(radiance, radiance, radiance);" } else { "" };
        assert!(shader.source.contains(store));
        native.gpu.replace_source(shader, shader.source.replace(store, &format!("{bad} {limit} {store}")));
    }
    let scene = scenes::lamp_court();
    let session = Session::new(&native, &scene).keep_all();
    for (storage, infinite, clamped) in [("float32", 1, 1), ("float16", 2, 0)] {
        let settings = Settings::from([("hierarchical.storage".to_owned(), Value::Text(storage.into()))]);
        let technique = technique("hierarchical").unwrap();
        let request = Request { technique, settings, size: [33, 17], seed: 0, direct: None };
        let mut frames = session.frames(&request).unwrap();
        frames.run(0).unwrap();
        let found = frames.scan().unwrap();
        let last = found.iter().find(|found| found.name == "final").unwrap();
        // 1e30 is the clamp of float32. In float16 it is infinite, or the largest number where the driver saturates.
        let large = (last.infinite - 1) + last.clamped;
        assert_eq!((last.nan, last.negative, large, last.values), (2, 1, 1, 4 * 33 * 17), "{storage}: {last:?}");
        println!("{storage}: {last:?}, expected {infinite} infinite and {clamped} clamped or the other way round");
        // The textures agree when they are read back.
        for (name, texels) in frames.read_all().unwrap() {
            let Some(scanned) = found.iter().find(|found| found.name == name) else { continue };
            let values = texels.as_flattened();
            assert_eq!(values.iter().filter(|v| v.is_nan()).count() as u32, scanned.nan, "{name}");
            assert_eq!(values.iter().filter(|v| v.is_infinite()).count() as u32, scanned.infinite, "{name}");
            if scanned.values == values.len() as u64 {
                let largest = values.iter().filter(|v| v.is_finite()).fold(0.0f32, |a, v| a.max(v.abs()));
                assert_eq!(largest, scanned.largest, "{name}");
                assert_eq!(values.iter().filter(|&&v| v < 0.0).count() as u32, scanned.negative, "{name}");
            }
        }
        // The message of `--check`.
        let error = halflight_evaluator::experiment::check_textures(&[&frames]).unwrap_err().to_string();
        assert!(error.starts_with("final holds 2 NaN and"), "{error}");
    }
}

#[test]
fn deliberate_bugs_turn_rows_red() {
    // Two that are cheap to catch; `cargo xtask stability --mutations` tries all of them.
    let wanted = ["the emitter's cosine is dropped", "history is not rejected"];
    let all = mutations::run(&adapter(), |mutation| wanted.contains(&mutation.name), true).unwrap();
    assert_eq!(all.len(), wanted.len());
    for caught in all {
        println!("{caught:?}");
        assert!(caught.by.is_some(), "{} is not caught", caught.name);
    }
}

#[test]
fn random_configurations_and_damaged_files_do_no_harm() {
    let outcome = random::run(&adapter(), 60, 0, None).unwrap();
    assert!(outcome.faults.is_empty(), "{:#?}", outcome.faults);
    assert!(outcome.lit > 0, "nothing was lit");
    let outcome = fuzz::run(20_000, 0, None).unwrap();
    assert!(outcome.faults.is_empty(), "{:#?}", outcome.faults);
    // Valid and invalid files both occur.
    assert!(outcome.accepted > 1000 && outcome.accepted < 19_000, "{}", outcome.accepted);
}
