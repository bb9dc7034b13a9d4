//! The search against the exhaustive sweep of the same candidates, with a known cost and error in place of a device.
#![allow(clippy::disallowed_macros, reason = "`cargo test` captures what a test prints")]
#![allow(clippy::unwrap_used)]

use halflight_recommend::{Advice, Cell, Family, Goal, Measured, NoAnswer, Outcome, Request, Search, metric};
use halflight_renderer::{
    parameters::{Settings, Value},
    scene::SceneFacts,
};
use halflight_scenes::bundled;
use halflight_techniques::technique;

const SIZE: [u32; 2] = [1280, 720];
const REDUCED: [u32; 2] = [320, 180];

fn facts() -> SceneFacts {
    SceneFacts::of(&bundled::scene("cornell").unwrap())
}

fn families() -> Vec<Family> {
    let family = |name: &str, axes: &[&str]| Family::of(technique(name).unwrap()).restricted(axes);
    vec![
        family(
            "hierarchical",
            &["start_resolution", "levels", "samples", "visibility", "disc_area", "samples_per_ray"],
        ),
        family("ray-march", &["rays", "steps", "resolution", "denoise"]),
        family("horizon", &["slices", "steps", "resolution", "denoise"]),
        family("rsm", &["samples", "start_resolution"]),
        family("ssao", &["samples"]),
    ]
}

fn number(settings: &Settings, key: &str, default: f64) -> f64 {
    match settings.get(key) {
        Some(Value::Int(v)) => *v as f64,
        Some(Value::Float(v)) => *v,
        _ => default,
    }
}

fn is(settings: &Settings, key: &str, value: &str) -> bool {
    settings.get(key) == Some(&Value::Text(value.into()))
}

/// What a device would measure. Passes take 1 ns for each invocation and sample, and a hundredth of a millisecond each;
/// errors are a bias and a noise that falls with the number of samples. Effects of settings neither add up nor multiply
/// exactly.
fn measure(families: &[Family], cell: &Cell, facts: &SceneFacts) -> Outcome {
    let name = cell.technique.name;
    if name == "none" {
        return Outcome::Measured(Measured {
            times: Vec::new(),
            passes: Vec::new(),
            errors: vec![0.8],
            reference_noise: 0.0,
        });
    }
    let own = |key: &str, default| number(&cell.settings, &format!("{name}.{key}"), default);
    let word = |key: &str, value: &str| is(&cell.settings, &format!("{name}.{key}"), value);
    let tested = word("visibility", "auto");
    let (samples, quality, bias) = match name {
        "hierarchical" => {
            let texel = word("disc_area", "texel");
            let bias = if tested { 0.05 } else { 0.2 } + if texel { 0.0 } else { 0.03 };
            (own("samples", 64.0), if texel { 4.0 } else { 1.0 }, bias)
        }
        "ray-march" => (own("rays", 2.0) * own("steps", 16.0) / 4.0, 1.5, 0.15 + 1.0 / own("steps", 16.0)),
        "horizon" => (own("slices", 1.0) * own("steps", 12.0), 1.0, 0.25 + 0.5 / own("steps", 12.0)),
        _ => (own("samples", 100.0), 3.0, 0.4),
    };
    let half = word("resolution", "half") || word("start_resolution", "half");
    let coarse = name == "hierarchical" && !half || word("start_resolution", "quarter");
    let bias = bias + if coarse { 0.08 } else { 0.02 } + 3.0 / f64::from(cell.size[1]);
    let denoised = 1.0 + own("denoise", if ["ray-march", "horizon"].contains(&name) { 1.0 } else { 0.0 });
    let error = bias + quality / samples / denoised;
    let family = families.iter().find(|family| family.technique.name == name).unwrap();
    let candidate: Vec<usize> = family
        .axes
        .iter()
        .map(|axis| {
            let value = cell.settings.get(&axis.key);
            value.map_or(0, |value| axis.values.iter().position(|known| known == value).unwrap())
        })
        .collect();
    let planned = family.plan(facts, &candidate, cell.size).unwrap();
    let passes: Vec<(String, f64)> = planned
        .passes
        .iter()
        .map(|pass| {
            let gathers = ["gather", "march", "slice", "horizon", "rsm"].iter().any(|kind| pass.name.contains(kind));
            let rays = if tested { 1.0 + 8.0 / own("samples_per_ray", 16.0) } else { 1.0 };
            let each = if gathers { samples * rays } else { 2.0 };
            (pass.name.clone(), 0.01 + pass.invocations * each * 1e-6)
        })
        .collect();
    let time: f64 = passes.iter().map(|(_, time)| time).sum();
    Outcome::Measured(Measured { times: vec![time; 5], passes, errors: vec![error], reference_noise: 0.0 })
}

/// As the command names it.
const ADVICE: Advice = Advice {
    other_techniques: "name another technique with --technique, or leave it out to search all",
    more_time: "raise --budget-ms or lower --size",
    larger_error: "raise --error-bound, or give the search more --minutes",
    other_metric: "another --metric",
};

fn search(goal: Goal, families: Vec<Family>) -> Result<Search, NoAnswer> {
    let metric = metric("block_rel_mse").unwrap();
    let request = Request { goal, metric, size: SIZE, reduced: REDUCED, most_cells: None, advice: &ADVICE };
    Search::new(request, facts(), families)
}

fn run(search: &mut Search) {
    let (families, facts) = (families(), facts());
    while let Some(cell) = search.next(0.0) {
        assert!(search.cells() < 400, "the search does not end");
        search.report(measure(&families, &cell, &facts));
    }
}

/// Time and error of every candidate at full size.
fn sweep(facts: &SceneFacts) -> Vec<[f64; 2]> {
    let families = families();
    let mut all = Vec::new();
    for family in families.iter().filter(|family| family.technique.name != "ssao") {
        for candidate in family.candidates() {
            let cell = Cell::full_size(family.technique, family.settings(&candidate), SIZE);
            if let Outcome::Measured(measured) = measure(&families, &cell, facts) {
                all.push([measured.times[0], measured.errors[0]]);
            }
        }
    }
    all
}

#[test]
fn answers_are_close_to_the_exhaustive_sweep() {
    let facts = facts();
    let all = sweep(&facts);
    for budget in [4.0, 10.0, 25.0, 60.0, 200.0] {
        let best =
            all.iter().filter(|[time, _]| *time <= budget).map(|[_, error]| *error).fold(f64::INFINITY, f64::min);
        let mut search = search(Goal::Budget(budget), families()).unwrap();
        run(&mut search);
        let answer = search.answer().unwrap();
        let regret = answer.point.error.value / best;
        println!(
            "{budget} ms: {} takes {:.2} ms, error {:.4}, best {best:.4}, {} of {} cells, predicted {:?}",
            answer.point.label(),
            answer.point.time_ms.value,
            answer.point.error.value,
            answer.cells,
            all.len(),
            answer.predicted
        );
        assert!(answer.point.verified && answer.point.time_ms.value <= budget, "{budget}");
        // What the tool promises (docs/recommend.md).
        assert!(regret <= 1.15, "{budget} ms: regret {regret}");
        assert!(answer.cells * 5 <= all.len(), "{} of {} cells", answer.cells, all.len());
        assert!(answer.better.is_none_or(|step| step.more_ms > 0.0 && step.error_change < 0.0));
        assert!(answer.faster.is_none_or(|step| step.more_ms < 0.0 && step.error_change > 0.0));
    }
}

#[test]
fn an_error_bound_is_kept_in_the_shortest_time() {
    let facts = facts();
    let all = sweep(&facts);
    for bound in [0.3, 0.2] {
        let best = all.iter().filter(|[_, error]| *error <= bound).map(|[time, _]| *time).fold(f64::INFINITY, f64::min);
        let mut search = search(Goal::ErrorBound(bound), families()).unwrap();
        run(&mut search);
        let answer = search.answer().unwrap();
        assert!(answer.point.error.value <= bound);
        // Times of neighbouring candidates lie this far apart.
        assert!(answer.point.time_ms.value <= 1.3 * best, "{bound}: {} against {best}", answer.point.time_ms.value);
    }
}

#[test]
fn without_an_answer_there_is_a_sentence() {
    let sentence = |mut search: Search, baseline: f64| {
        let (families, facts) = (families(), facts());
        while let Some(cell) = search.next(0.0) {
            let outcome = match measure(&families, &cell, &facts) {
                Outcome::Measured(measured) if cell.technique.name == "none" => {
                    Outcome::Measured(Measured { errors: vec![baseline], ..measured })
                }
                other => other,
            };
            search.report(outcome);
        }
        search.answer().unwrap_err().to_string()
    };
    let impossible = sentence(search(Goal::Budget(0.001), families()).unwrap(), 0.8);
    assert!(impossible.contains("nothing runs in 0.001") && impossible.contains("--budget-ms"), "{impossible}");
    let unreachable = sentence(search(Goal::ErrorBound(0.001), families()).unwrap(), 0.8);
    assert!(unreachable.contains("no configuration reaches"), "{unreachable}");
    let unlit = sentence(search(Goal::Budget(100.0), families()).unwrap(), 0.0);
    assert!(unlit.contains("no indirect light reaches"), "{unlit}");
    let sky = sentence(search(Goal::Budget(100.0), families()).unwrap(), f64::NAN);
    assert!(sky.contains("not defined for this view"), "{sky}");
    let worse = sentence(search(Goal::Budget(100.0), families()).unwrap(), 0.01);
    assert!(worse.contains("showing no indirect light") && worse.contains("beats everything"), "{worse}");
    let alone = vec![Family::of(technique("gtao").unwrap())];
    let nothing = search(Goal::Budget(1.0), alone).err().unwrap().to_string();
    assert!(nothing.contains("gtao finds no indirect light"), "{nothing}");
}

#[test]
fn the_best_so_far_is_there_when_time_is_up() {
    let mut search = search(Goal::Budget(25.0), families()).unwrap();
    let (families, facts) = (families(), facts());
    for _ in 0..4 {
        let cell = search.next(0.0).unwrap();
        search.report(measure(&families, &cell, &facts));
    }
    let before = search.cells();
    while let Some(cell) = search.next(1.0) {
        search.report(measure(&families, &cell, &facts));
    }
    // Only the one at full size.
    assert_eq!(search.cells(), before + 1);
    assert!(search.answer().unwrap().point.verified);
}
