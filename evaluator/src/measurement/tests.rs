#![allow(clippy::unwrap_used)]
use halflight_metrics::MetricId;
use serde_json::json;

use super::*;

fn object(value: Value) -> Map<String, Value> {
    value.as_object().cloned().unwrap()
}

fn row() -> Measurement {
    let mut errors = Values::default();
    errors.set(MetricId::IndirectRelMse, Some(0.25));
    errors.set(MetricId::FinalPsnrDb, Some(f64::INFINITY));
    errors.set(MetricId::IndirectBias, Some(f64::NAN));
    Measurement {
        scene: "atrium".into(),
        technique: "hierarchical".into(),
        parameters: object(json!({"hierarchical.start_resolution": "quarter", "hierarchical.levels": 4})),
        pass_ms: object(json!({"gather_0": 7.1, "combine": 5.7})),
        images: object(json!({"final": "images/1-final.png"})),
        errors,
        memory_bytes: 1 << 40,
        seed: u64::MAX,
        ..Measurement::default()
    }
}

#[test]
fn a_row_is_flat_and_returns_from_json() {
    let columns = row().columns();
    assert_eq!(columns["hierarchical.levels"], 4);
    assert_eq!(columns["pass_gather_0_ms"], 7.1);
    assert_eq!(columns["image_final"], "images/1-final.png");
    assert_eq!(columns["indirect_rel_mse"], 0.25);
    assert_eq!((&columns["final_psnr_db"], &columns["indirect_bias"]), (&json!("inf"), &json!("NaN")));
    assert!(columns["final_flip"].is_null());

    let back: Measurement = serde_json::from_value(Value::Object(columns)).unwrap();
    assert!(back.errors.get(MetricId::IndirectBias).unwrap().is_nan(), "NaN is a measurement, not a gap");
    let without_nan = |mut row: Measurement| {
        row.errors.set(MetricId::IndirectBias, None);
        row
    };
    assert_eq!(without_nan(back), without_nan(row()));
}

#[test]
fn columns_come_in_the_documented_order() {
    let columns: Vec<String> = row().columns().keys().cloned().collect();
    let expected = [
        "scene",
        "camera",
        "width",
        "height",
        "technique",
        "hierarchical.start_resolution",
        "hierarchical.levels",
        "left_out",
        "frames",
        "time_ms_median",
        "time_ms_min",
        "time_ms_p95",
        "time_ms_static",
        "first_frame_ms",
        "frame_ms_median",
        "frame_ms_static",
        "pass_gather_0_ms",
        "pass_combine_ms",
        "memory_bytes",
        "frame_bytes",
        "scene_bytes",
        "indirect_rel_mse",
        "indirect_block_rel_mse",
        "indirect_rmse",
        "indirect_bias",
        "indirect_p95_abs",
        "indirect_p999_abs",
        "indirect_best_factor",
        "indirect_scaled_rel_mse",
        "final_psnr_db",
        "final_ssim",
        "final_flip",
        "final_hdr_flip",
        "noise_std",
        "truth_rel_error",
        "adapter",
        "driver",
        "backend",
        "software_adapter",
        "machine",
        "processor",
        "commit",
        "preset",
        "seed",
        "command",
        "image_final",
    ];
    assert_eq!(columns, expected);
}

#[test]
fn csv_is_the_union_of_columns_with_kin_together() {
    let mut other = row();
    other.technique = "none".into();
    other.parameters = object(json!({"none.tint": "grey, \"warm\""}));
    other.pass_ms = object(json!({"gather_0": 1.0, "gather_1": 0.5, "combine": 2.0}));
    let path = std::env::temp_dir().join(format!("halflight-results-{}.csv", std::process::id()));
    write_csv(&path, &[row(), other]).unwrap();
    let mut table = csv::Reader::from_path(&path).unwrap();
    let head: Vec<String> = table.headers().unwrap().iter().map(str::to_owned).collect();
    let at = |name: &str| head.iter().position(|column| column == name).unwrap_or_else(|| panic!("no {name}"));
    assert!(at("technique") < at("none.tint") && at("none.tint") < at("frames"));
    assert_eq!(at("pass_gather_1_ms"), at("pass_gather_0_ms") + 1);
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    assert_eq!(&rows[0][at("none.tint")], "");
    assert_eq!(&rows[1][at("none.tint")], "grey, \"warm\"");
    assert_eq!(&rows[0][at("final_psnr_db")], "inf");
    std::fs::remove_file(path).unwrap();
}

#[test]
fn results_json_returns_and_errors_name_the_file() {
    let path = std::env::temp_dir().join(format!("halflight-results-{}.json", std::process::id()));
    let mut rows = vec![row(), row()];
    rows.iter_mut().for_each(|row| row.errors.set(MetricId::IndirectBias, None));
    write_json(&path, &rows).unwrap();
    assert_eq!(read_json(&path).unwrap(), rows);
    std::fs::write(&path, "[{\"scene\": 3}]").unwrap();
    let error = read_json(&path).unwrap_err();
    assert!(error.to_string().contains("halflight-results") && error.to_string().contains("line 1"), "{error}");
    assert_eq!(error.exit_code(), 2);
    std::fs::remove_file(path).unwrap();
}

#[test]
fn timing_takes_median_min_and_p95() {
    let timing = Timing::of(&[3.0, 1.0, 2.0, 10.0]).unwrap();
    assert_eq!((timing.median, timing.min, timing.max, timing.samples), (2.5, 1.0, 10.0, 4));
    // Rank 0.95 * 3 = 2.85: 3 + 0.85 * 7, up to round-off.
    assert!((timing.p95 - 8.95).abs() < 1e-12);
    assert_eq!(Timing::of(&[]), None);
}
