//! `evaluator recommend` on a small scene, against the exhaustive sweep of the same candidates, by error.
#![allow(clippy::disallowed_macros, reason = "`cargo test` captures what a test prints")]
#![allow(clippy::unwrap_used)]

use std::process::Command;

use halflight_evaluator::{
    experiment::session::{open_adapter, open_scene},
    recommend::{ADVICE, Measurer, Measuring},
};
use halflight_recommend::{Cell, Family, Goal, Outcome, Request, Search, metric};
use halflight_renderer::scene::SceneFacts;
use halflight_techniques::technique;

const SIZE: [u32; 2] = [64, 64];

/// Time plays no part: the budget allows everything, so the search must find the lowest error of all.
#[test]
fn the_lowest_error_is_found_with_few_cells() {
    let native = open_adapter(&std::env::var("HALFLIGHT_ADAPTER").unwrap_or("any".into())).unwrap();
    let scene = open_scene("cornell".as_ref()).unwrap();
    let facts = SceneFacts::of(&scene);
    let families: Vec<Family> = [
        ("hierarchical", &["start_resolution", "samples", "disc_area"][..]),
        ("bitmask", &["resolution", "steps", "slices"]),
        ("horizon", &["steps", "slices"]),
    ]
    .map(|(name, axes)| Family::of(technique(name).unwrap()).restricted(axes))
    .into();
    let metric = metric("block_rel_mse").unwrap();
    let mut measurer = Measurer::new(&native, &scene, metric, Measuring { moving: true, bounces: 1, seed: 0 });
    let mut error = |cell: &Cell| match measurer.measure(cell, 10.0).unwrap() {
        Outcome::Measured(measured) => measured,
        other => panic!("{} {:?}: {other:?}", cell.technique.name, cell.settings),
    };
    let mut best = f64::INFINITY;
    let mut count = 0;
    for family in &families {
        for candidate in family.candidates() {
            let cell = Cell::full_size(family.technique, family.settings(&candidate), SIZE);
            let errors = error(&cell).errors;
            best = best.min(errors.iter().sum::<f64>() / errors.len() as f64);
            count += 1;
        }
    }
    let goal = Goal::Budget(1e9);
    let request = Request { goal, metric, size: SIZE, reduced: SIZE, most_cells: Some(count / 2), advice: &ADVICE };
    let mut search = Search::new(request, facts, families).unwrap();
    while let Some(cell) = search.next(0.0) {
        let measured = error(&cell);
        search.report(Outcome::Measured(measured));
    }
    let answer = search.answer().unwrap();
    println!("{}: {:?}, best {best}, {} of {count} cells", answer.point.label(), answer.point.error, answer.cells);
    assert!(answer.point.verified && answer.cells <= count / 2);
    // The images are the same as those of the sweep, so only the choice differs. 1.15 is what the tool promises.
    assert!(answer.point.error.value <= 1.15 * best, "{} against {best}", answer.point.error.value);
}

fn evaluator(arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_evaluator")).args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn the_answer_comes_with_a_preset_and_a_command() {
    let folder = std::env::temp_dir().join(format!("halflight-recommend-{}", std::process::id()));
    let out = folder.to_str().unwrap();
    let common =
        ["recommend", "--scene", "cornell", "--size", "48x48", "--technique", "ssdo", "--technique", "horizon"];
    let search = [&common[..], &["--budget-ms", "100000", "--out", out, "--json"]].concat();
    let (code, json, errors) = evaluator(&search);
    assert_eq!(code, Some(0), "{errors}");
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["metric"], "indirect_block_rel_mse");
    let answer = &json["answer"];
    assert!(answer["error"]["value"].as_f64().unwrap() < answer["baseline_error"].as_f64().unwrap(), "{answer}");
    for name in ["index.html", "recommend.json", "preset.toml", "plots/frontier.svg", "images/answer.png"] {
        assert!(folder.join(name).is_file(), "{name}");
    }
    // The preset is read by other commands, and the link names the scene.
    let preset = folder.join("preset.toml");
    let (code, _, errors) =
        evaluator(&["plan", "--scene", "cornell", "--size", "48x48", "--preset", preset.to_str().unwrap()]);
    assert_eq!(code, Some(0), "{errors}");
    assert!(json["link"].as_str().unwrap().contains("#scene=cornell&size=48x48&a="), "{}", json["link"]);
    // What was measured is not measured again.
    let cells = |json: &serde_json::Value| json["answer"]["cells"].as_u64().unwrap();
    let (code, again, errors) = evaluator(&[&search[..], &["--resume"]].concat());
    assert_eq!(code, Some(0), "{errors}");
    assert_eq!(cells(&serde_json::from_str(&again).unwrap()), cells(&json));
    std::fs::remove_dir_all(folder).unwrap();
}

#[test]
fn questions_without_an_answer_end_with_a_sentence() {
    let folder = std::env::temp_dir().join(format!("halflight-unlit-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("floor.obj"), "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nf 1 4 3 2\n").unwrap();
    // A floor alone has no indirect light, and the third camera sees only sky.
    let scene = |name: &str, target: f32, irradiance: f32| {
        let path = folder.join(name);
        let camera = format!("[camera]\neye = [0.0, 2.0, 2.0]\ntarget = [0.0, {target:.1}, 0.0]\n");
        let light =
            format!("kind = 'directional'\ndirection = [0.0, -1.0, 0.0]\nirradiance = [{irradiance:.1}, 0.0, 0.0]\n");
        std::fs::write(&path, format!("[[model]]\npath = 'floor.obj'\n{camera}[[light]]\n{light}")).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let scenes = [scene("unlit.toml", 0.0, 0.0), scene("floor.toml", 0.0, 1.0), scene("sky.toml", 5.0, 1.0)];
    let [unlit, floor, sky] = scenes.each_ref().map(String::as_str);
    let size = ["--size", "32x32"];
    for (arguments, wanted) in [
        (vec!["--scene", unlit, "--budget-ms", "4"], "has no light"),
        (vec!["--scene", floor, "--budget-ms", "4"], "no indirect light reaches what the camera sees"),
        (vec!["--scene", sky, "--budget-ms", "4"], "point the camera at a surface"),
        (vec!["--scene", "cornell", "--budget-ms", "4", "--technique", "none"], "nothing to choose"),
        (vec!["--scene", "cornell", "--budget-ms", "0.000001", "--technique", "ssdo"], "--budget-ms"),
        (vec!["--scene", "cornell", "--budget-ms", "0"], "above 0"),
        (vec!["--scene", "cornell", "--budget-ms", "4", "--metric", "psnr"], "no metric that can decide"),
        (vec!["--scene", "cornell"], "--budget-ms"),
    ] {
        let (code, _, errors) = evaluator(&[&["recommend"], &arguments[..], &size].concat());
        assert_eq!(code, Some(2), "{arguments:?}: {errors}");
        assert!(errors.contains(wanted), "{arguments:?}: {errors}");
    }
    std::fs::remove_dir_all(folder).unwrap();
}
