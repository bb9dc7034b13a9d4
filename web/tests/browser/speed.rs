//! What the page reports of its speed: the time of the first picture, and the medians of the benchmark page. Times are
//! printed and never fail a test, because they depend on the load of the computer.

use crate::{alone, open, settled};

#[test]
fn the_first_picture_is_timed() {
    let _alone = alone();
    let mut page = open("scene=cornell&size=320x180&truth=off");
    page.wait_for("window.halflightFirstPicture > 0");
    let ms = page.evaluate("window.halflightFirstPicture").as_f64().unwrap();
    println!("first picture of Cornell at 320x180: {ms:.0} ms after the page was opened");
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
