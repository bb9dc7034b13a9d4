//! Use of the page by pointer, keys and links.

use serde_json::Value;

use crate::{alone, centre, chromium::Page, cut, demo, difference, open, rect, settled, spread, target};

#[test]
fn a_slider_the_divider_and_a_link() {
    let _alone = alone();
    let mut page = open("scene=cornell&size=320x180&truth=off");
    let report = page.wait("Cornell", settled);
    let at = rect(&report, "picture");
    let cornell = cut(&page.screenshot(&target(), "cornell"), at);
    let (mean, deviation) = spread(&cornell);
    // A lit room: not black, not white, not uniform.
    assert!((20.0..200.0).contains(&mean) && deviation > 15.0, "Cornell: mean {mean}, deviation {deviation}");

    // Fewer samples by the slider change the state, the link and the picture.
    let [x, y, w, h] = rect(&report, "a.hierarchical.samples");
    page.drag([x + 0.6 * w * 0.5, y + h / 2.0], [x + 4.0, y + h / 2.0]);
    let report = page
        .wait("fewer samples", |r| settled(r) && r["address"].as_str().unwrap().contains("a.hierarchical.samples=1"));
    let fewer = cut(&page.screenshot(&target(), "cornell-few-samples"), at);
    assert!(difference(&cornell, &fewer) > 0.2, "the slider did not change the picture");
    let address = report["address"].as_str().unwrap().to_owned();
    let hash = page.evaluate("location.hash.slice(1)");
    assert_eq!(hash.as_str(), Some(address.as_str()));

    // A | B: A is left of the divider, B with its defaults is right of it.
    page.click(centre(&report, "compare"));
    let report = page.wait("both sides", |r| settled(r) && r["sides"].as_array().unwrap().len() == 2);
    let both = cut(&page.screenshot(&target(), "compare"), rect(&report, "picture"));
    let [dx, dy] = centre(&report, "divider");
    let [left, _, width, _] = rect(&report, "picture");
    page.drag([dx, dy + 60.0], [left + 0.25 * width, dy + 60.0]);
    let report = page.wait("the divider", |r| {
        let address = r["address"].as_str().unwrap();
        let part =
            address.split("divider=").nth(1).and_then(|v| v.split('&').next()).and_then(|v| v.parse::<f64>().ok());
        part.is_some_and(|part| (0.2..0.3).contains(&part)) && settled(r)
    });
    let moved = cut(&page.screenshot(&target(), "compare-moved"), rect(&report, "picture"));
    assert!(difference(&both, &moved) > 0.05, "the divider did not move");

    // The link opens the same state and the same picture in another browser.
    let address = report["address"].as_str().unwrap().to_owned();
    drop(page);
    let mut other = open(&address);
    let report = other.wait("the link's state", settled);
    assert_eq!(report["address"].as_str(), Some(address.as_str()));
    let again = cut(&other.screenshot(&target(), "compare-by-link"), rect(&report, "picture"));
    // Captions contain times, which differ; the picture is equal bit for bit.
    let body = |picture: &image::RgbImage| {
        cut(picture, [0.0, 0.0, f64::from(picture.width()), f64::from(picture.height()) - 60.0])
    };
    assert!(difference(&body(&moved), &body(&again)) < 0.05, "the picture of the link differs");

    // The page requests nothing from other hosts.
    let origin = demo();
    assert!(
        other.requests.iter().all(|url| url.starts_with(&origin)
            || url.starts_with("data:")
            || url.starts_with("about:")
            || url.starts_with("blob:")),
        "{:?}",
        other.requests
    );
}

#[test]
fn undo_and_keys() {
    let _alone = alone();
    let mut page = open("scene=cornell&size=320x180&truth=off");
    let report = page.wait("Cornell", settled);
    let before = report["address"].as_str().unwrap().to_owned();
    // An arrow key orbits when the picture has the focus.
    page.click(centre(&report, "picture"));
    for _ in 0..3 {
        page.key("ArrowLeft", 37);
    }
    let report = page.wait("a moved camera", |r| settled(r) && r["address"].as_str().unwrap().contains("eye="));
    page.click(centre(&report, "undo"));
    let mut now = page.wait("one step back", settled);
    // Each key press is one undo step.
    for _ in 0..5 {
        if now["address"].as_str() == Some(&before) {
            break;
        }
        page.click(centre(&now, "undo"));
        now = page.wait("a step back", settled);
    }
    assert_eq!(now["address"].as_str(), Some(before.as_str()));
    // Tab moves the focus from the picture to the controls.
    for _ in 0..6 {
        page.key("Tab", 9);
    }
    page.screenshot(&target(), "focus");
}

#[test]
fn playing_animates_the_scene() {
    let _alone = alone();
    let mut page = open("scene=motion&size=320x180&truth=off&exposure=0&a.hierarchical.temporal_a=0.9");
    let report = page.wait("the first frame", settled);
    let at = rect(&report, "picture");
    let rest = cut(&page.screenshot(&target(), "motion-rest"), at);
    page.click(centre(&report, "play"));
    let report = page.wait("a dozen frames", |r| r["frame"].as_u64().unwrap() >= 12);
    page.click(centre(&report, "play"));
    let report = page.wait("a stop", |r| settled(r) && r["address"].as_str().unwrap().contains("frame="));
    // The emissive block and its light have moved.
    let moved = cut(&page.screenshot(&target(), "motion-played"), at);
    assert!(difference(&rest, &moved) > 1.0, "the picture did not change: {}", report["address"]);
    // In a static scene the first light rotates instead.
    page.evaluate("halflight.go_to('scene=bars&size=320x180&truth=off')");
    let report = page.wait("bars", |r| settled(r) && r["scene"] == "bars");
    page.click(centre(&report, "play"));
    let report = page.wait("some frames", |r| r["frame"].as_u64().unwrap() >= 5);
    page.click(centre(&report, "play"));
    page.wait("the light's change in the link", |r| settled(r) && r["address"].as_str().unwrap().contains("light.0="));
}

#[test]
fn the_atrium_and_its_views() {
    let _alone = alone();
    let mut page = open("scene=atrium&size=640x360&truth=off");
    let report = page.wait("the atrium", settled);
    let atrium = cut(&page.screenshot(&target(), "atrium"), rect(&report, "picture"));
    assert!(spread(&atrium).1 > 20.0, "the atrium is blank");
    for view in ["indirect", "normal", "depth", "surfels_8", "gathered_0", "voxels_4"] {
        let visibility = if view == "voxels_4" { "&a.hierarchical.visibility=surface" } else { "" };
        page.evaluate(&format!("halflight.go_to('scene=atrium&size=640x360&truth=off&view={view}{visibility}')"));
        let report = page.wait(view, |r| settled(r) && r["address"].as_str().unwrap().contains(view));
        let shown = cut(&page.screenshot(&target(), &format!("atrium-{view}")), rect(&report, "picture"));
        assert!(spread(&shown).1 > 5.0, "{view} is blank");
        assert!(difference(&atrium, &shown) > 2.0, "{view} shows the final picture");
    }
}

#[test]
fn small_screens_and_zoom() {
    let _alone = alone();
    for (name, size, scale) in [
        ("phone", [390, 844], 2.0),
        ("zoom-125", [944, 576], 1.25),
        ("zoom-200", [590, 360], 2.0),
        ("tiny", [320, 240], 1.0),
    ] {
        let mut page = Page::open(size, scale);
        page.go(&format!("{}#scene=cornell&size=320x180&truth=off", demo()));
        let report = page.wait(name, settled);
        let [_, _, width, height] = rect(&report, "picture");
        assert!(width > 150.0 && height > 80.0, "{name}: the picture has {width}x{height}");
        let tiny = name == "tiny";
        let rest: &[&str] = if tiny { &[] } else { &["undo", "save", "link", "fullscreen"] };
        for mark in ["scene", "view", "compare", "play", "controls", "picture"].iter().chain(rest) {
            let [x, y, w, h] = rect(&report, mark);
            let inside = [x + w, y + h].iter().zip(size).all(|(end, size)| *end <= f64::from(size) + 0.5);
            assert!(x >= -0.5 && inside, "{name}: {mark} is cut off");
        }
        page.screenshot(&target(), name);
        // A tiny page shows the picture or the controls.
        assert_eq!(report["marks"]["a.technique"].is_null(), tiny, "{name}");
        page.click(centre(&report, "controls"));
        let report = page.wait("the other one", |report| report["marks"]["a.technique"].is_null() != tiny);
        page.screenshot(&target(), &format!("{name}-controls"));
        let [x, _, w, _] = rect(&report, if tiny { "a.technique" } else { "picture" });
        assert!(x >= -0.5 && x + w <= f64::from(size[0]) + 0.5, "{name}");
    }
}

#[test]
fn the_check_runs_when_its_panel_is_open() {
    let _alone = alone();
    // Tall enough for all controls.
    let mut page = Page::open([1180, 1500], 1.0);
    page.go(&format!("{}#scene=cornell&size=160x90&truth=off&a=ssdo", demo()));
    // The list of times grows once and moves the controls below it.
    let report = page.wait("times", |r| settled(r) && r["sides"][0]["technique_ms"].is_number());
    assert!(report["sides"][0]["check"].is_null(), "the check ran while its panel was closed");
    let at = settled_centre(&mut page, report, "a.check");
    page.click(at);
    let report = page.wait("the check", |r| r["sides"][0]["check"].is_array());
    page.screenshot(&target(), "check");
    let found = report["sides"][0]["check"].as_array().unwrap();
    let named = |name: &str| found.iter().find(|line| line["name"] == name).unwrap_or_else(|| panic!("no {name}"));
    assert!(named("indirect")["largest"].as_f64().unwrap() > 0.0 && named("depth")["values"] == 160 * 90);
    assert!(found.iter().all(|line| line["not_finite"] == 0 && line["clamped"] == 0), "{found:?}");
}

/// Centre of a control once it no longer moves. Panels above it open and lists grow while a slow page catches up.
fn settled_centre(page: &mut Page, mut report: Value, mark: &str) -> [f64; 2] {
    loop {
        // The page repaints before it takes a screenshot.
        page.screenshot(&target(), "still");
        let now = page.report();
        if centre(&now, mark) == centre(&report, mark) {
            return centre(&now, mark);
        }
        report = now;
    }
}
