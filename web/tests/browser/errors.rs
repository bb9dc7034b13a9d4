//! Errors that are shown while the reference is refined.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::{alone, chromium::Page, demo, target};

/// Largest factor between an error that is shown and the converged one.
const FACTOR: f64 = 1.25;

/// The errors of a report by side and metric.
fn errors(report: &Value) -> BTreeMap<String, f64> {
    let sides = report["sides"].as_array().into_iter().flatten().enumerate();
    let all = sides.flat_map(|(side, report)| {
        let errors = report["errors"].as_object().into_iter().flatten();
        errors.map(move |(metric, error)| (format!("{side}.{metric}"), error.as_f64().unwrap()))
    });
    all.collect()
}

#[test]
fn errors_are_right_from_the_first_one_shown() {
    let _alone = alone();
    for (scene, samples) in [("cornell", 512), ("room", 256)] {
        // A small page, because painting it takes longer than tracing.
        let mut page = Page::open([360, 300], 1.0);
        page.go(&format!("{}#scene={scene}&size=64x36&a=none&b=hierarchical&compare=on", demo()));
        let mut shown: BTreeMap<String, Vec<(u64, f64)>> = BTreeMap::new();
        let mut now = 0;
        while now < samples {
            let report = page
                .wait("another reading of the reference", |report| report["reference_samples"].as_u64().unwrap() > now);
            now = report["reference_samples"].as_u64().unwrap();
            // The errors of a reading may take another frame.
            let report = page.wait("its errors", |_| true);
            for (name, error) in errors(&report) {
                shown.entry(name).or_default().push((now, error));
            }
        }
        page.screenshot(&target(), &format!("errors-{scene}"));
        println!("{scene}: {shown:?}");
        assert!(shown.contains_key("0.blocks") && shown.contains_key("1.blocks"), "{scene}: {shown:?}");
        for (name, values) in &shown {
            let (_, converged) = values[values.len() - 1];
            for (samples, error) in values {
                let ratio = error / converged;
                assert!(
                    (1.0 / FACTOR..=FACTOR).contains(&ratio),
                    "{scene}, {name}: {error:.4} was shown after {samples} samples, but it is {converged:.4}"
                );
            }
        }
    }
}
