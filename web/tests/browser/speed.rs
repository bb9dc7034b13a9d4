//! What the page reports of its speed: the time of the first picture, and the medians of the benchmark page. Times are
//! printed and never fail a test, because they depend on the load of the computer.

use crate::{alone, chromium::Page, demo, open, settled};

#[test]
fn the_first_picture_is_timed() {
    let _alone = alone();
    for (name, state) in [("Cornell at 320x180", "scene=cornell&size=320x180&truth=off"), ("opening page", "")] {
        let mut page = Page::open([1280, 720], 1.0);
        page.go(&format!("{}#{state}", demo()));
        page.wait_for("window.halflightFirstPicture > 0");
        let first = page.evaluate("window.halflightFirstPicture").as_f64().unwrap();
        let report = page.wait("a settled picture", settled);
        let ms: Vec<f64> = (0..3).map(|step| report["scene_ms"][step].as_f64().unwrap()).collect();
        println!("{name}: first picture {first:.0} ms after the page was opened");
        println!(
            "  scene read {:.0}, drawable {:.0}, with its BVH {:.0} ms after the viewer has started",
            ms[0], ms[1], ms[2]
        );
        let tasks = page.evaluate(
            "new Promise(done => { \
               new PerformanceObserver(list => \
                 done(list.getEntries().map(task => [task.startTime, task.duration])) \
               ).observe({ type: 'longtask', buffered: true }); \
               setTimeout(() => done([]), 1000); /* There may be none. */ })",
        );
        let tasks: Vec<[f64; 2]> = serde_json::from_value(tasks).unwrap();
        let longest = |after: bool| {
            tasks.iter().filter(|task| (task[0] > first) == after).map(|task| task[1]).fold(0.0, f64::max)
        };
        println!("  longest task before it {:.0} ms, after it {:.0} ms (0: below 50)", longest(false), longest(true));
        assert!(first > 0.0 && ms.iter().all(|&ms| ms > 0.0), "{name}: {first} {ms:?}");
    }
}

#[test]
fn the_benchmark_page_prints_medians() {
    let _alone = alone();
    let mut page = open("benchmark&scene=atrium&size=320x180");
    let report = page.wait("five rounds", |r| settled(r) && r["sides"][0]["rounds"].as_u64().unwrap() >= 5);
    let side = &report["sides"][0];
    println!("atrium at 320x180, hierarchical with its defaults, {}", report["adapter"]);
    println!("{}", side["method"].as_str().unwrap());
    for pass in side["passes"].as_array().unwrap() {
        println!(
            "{:<14} {:<12} {:>8.2} ms",
            pass["name"].as_str().unwrap(),
            pass["part"].as_str().unwrap(),
            pass["ms"].as_f64().unwrap()
        );
    }
    let whole = side["technique_ms"].as_f64().unwrap();
    println!("{:<27} {whole:>8.2} ms", "whole technique");
    page.screenshot(&crate::target(), "benchmark");
    assert!(whole > 0.0, "the page measured nothing");
}
