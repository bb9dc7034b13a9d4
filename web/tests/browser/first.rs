//! What somebody sees who opens the page for the first time, and looking closely.

use serde_json::json;

use crate::{alone, centre, chromium::Page, cut, demo, difference, open, rect, settled, spread, target};

#[test]
fn the_page_says_what_it_is_before_the_program_runs() {
    let _alone = alone();
    let mut page = Page::open([390, 844], 1.0);
    // The program never arrives.
    page.call("Network.setBlockedURLs", json!({ "urls": ["*.wasm"] }));
    page.go(&demo());
    page.wait_for("document.getElementById('opening')?.complete === true");
    page.wait_for("document.getElementById('opening').naturalWidth > 300");
    let text = page.evaluate("document.querySelector('header').innerText");
    assert!(text.as_str().unwrap().contains("compare techniques by time and by error"), "{text}");
    // Nothing is wider than the screen.
    assert_eq!(page.evaluate("document.documentElement.scrollWidth <= 390"), true);
    for (what, wanted) in [("og:title", "Halflight"), ("og:image", "opening.jpg"), ("og:description", "indirect light")]
    {
        let content = page.evaluate(&format!("document.querySelector('meta[property=\"{what}\"]').content"));
        assert!(content.as_str().unwrap().contains(wanted), "{what}: {content}");
    }
    page.screenshot(&target(), "loading");
    // From disk nothing can be loaded, and the page says so.
    page.go(&format!("file://{}", target().join("dist/index.html").canonicalize().unwrap().display()));
    page.wait_for("document.getElementById('title')?.textContent === 'This page needs a server'");
    page.screenshot(&target(), "from-disk");
}

#[test]
fn a_view_without_a_picture_does_not_keep_the_page_waiting() {
    let _alone = alone();
    let mut page = open("scene=cornell&size=96x54&truth=off&a=none&b=gtao&compare=on&view=ambient_occlusion");
    page.wait("a picture of B alone", |report| {
        report["sides"][1]["drawn"] == true && report["sides"][0]["drawn"] == false
    });
    page.wait_for("document.getElementById('message').hidden");
    let report = page.wait("the interface", |report| report["marks"]["view"].is_array());
    assert_eq!(report["messages"], json!([]));
}

#[test]
fn edges_are_smooth_when_everything_is_still() {
    let _alone = alone();
    let mut page = Page::open(crate::SIZE, 1.0);
    let mut picture = |antialiasing: &str, samples: u64| {
        page.go(&format!("{}#scene=cornell&size=96x54&truth=off&a=none&antialiasing={antialiasing}", demo()));
        let of = |report: &serde_json::Value| report["sides"][0]["samples"].as_u64();
        let report = page.wait("all samples", |report| settled(report) && of(report) == Some(samples));
        cut(&page.screenshot(&target(), &format!("antialiasing-{antialiasing}")), rect(&report, "picture"))
    };
    let (sharp, smooth) = (picture("off", 1), picture("on", 8));
    // Only edges differ, and by less than the steps across them. Nothing gets brighter.
    let (before, after) = (spread(&sharp), spread(&smooth));
    assert!(difference(&sharp, &smooth) > 0.2, "{before:?} {after:?}");
    assert!((before.0 - after.0).abs() < 1.0 && after.1 < before.1, "{before:?} {after:?}");
}

#[test]
fn pictures_are_saved() {
    let _alone = alone();
    let mut page = open("scene=cornell&size=96x54&truth=off&a=none&b=none&view=albedo&compare=on");
    let report = page.wait("Cornell", settled);
    page.evaluate(
        "window.halflightSave = (name, bytes) => { \
           let text = ''; \
           for (const byte of new Uint8Array(bytes)) text += String.fromCharCode(byte); \
           window.saved = [name, btoa(text)]; }; true",
    );
    let mut save = |mark: &str| {
        page.click(centre(&report, "save"));
        let menu = page.wait("the menu", |report| report["marks"][mark].is_array());
        page.evaluate("delete window.saved");
        page.click(centre(&menu, mark));
        page.wait_for("Array.isArray(window.saved)");
        let saved = page.evaluate("window.saved");
        (saved[0].as_str().unwrap().to_owned(), crate::chromium::base64(saved[1].as_str().unwrap()))
    };
    let (name, bytes) = save("save.png");
    assert_eq!(name, "halflight-cornell-albedo-none-none.png");
    let picture = image::load_from_memory(&bytes).unwrap().to_rgb8();
    assert_eq!(picture.dimensions(), (96, 54));
    // The left wall is red.
    let [r, g, _] = picture.get_pixel(29, 27).0;
    assert!(r > 2 * g, "{r} {g}");
    let (name, bytes) = save("save.exr.1");
    assert_eq!(name, "halflight-cornell-albedo-none.exr");
    assert!(bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]), "no OpenEXR file: {:?}", &bytes[..8]);
}

#[test]
fn keys_help_set_ups_and_the_inspector() {
    let _alone = alone();
    let mut page = open("scene=cornell&size=96x54&a=none&b=ssdo&compare=on");
    let report = page.wait("Cornell", settled);
    let home = report["address"].as_str().unwrap().to_owned();
    // A, then both again. The divider is gone while one side is alone.
    page.click(centre(&report, "picture"));
    page.key_quickly("1");
    page.wait("A alone", |report| report["marks"]["divider"].is_null());
    page.key_quickly("1");
    page.wait("both sides", |report| report["marks"]["divider"].is_array());
    page.key_quickly("?");
    page.wait("the help", |report| report["marks"]["help.window"].is_array());
    page.screenshot(&target(), "help");
    page.key_quickly("Escape");
    page.wait("no help", |report| report["marks"]["help.window"].is_null());
    // F looks at what is under the pointer, Home goes back.
    let [x, y, w, h] = rect(&report, "picture");
    page.point([x + 0.3 * w, y + 0.7 * h]);
    page.key_quickly("f");
    page.wait("another target", |report| report["address"].as_str().unwrap().contains("target="));
    // K keeps the view, Home goes back, 4 goes to the kept view.
    page.key_quickly("k");
    let kept = page.wait("a bookmark", |report| report["address"].as_str().unwrap().contains("bookmark.4="));
    let kept = kept["address"].as_str().unwrap().to_owned();
    page.key_quickly("Home");
    let report = page.wait("the first view", |report| !report["address"].as_str().unwrap().contains("&target="));
    assert!(report["address"].as_str().unwrap().starts_with(&home[..20]), "{}", report["address"]);
    page.key_quickly("4");
    page.wait("the kept view", |report| report["address"].as_str() == Some(&kept));
    page.key_quickly("p");
    page.wait("no controls", |report| report["marks"]["a.technique"].is_null());
    page.key_quickly("p");
    page.wait("the controls", |report| report["marks"]["a.technique"].is_array());
    page.key_quickly("i");
    page.point([x + 0.7 * w, y + 0.6 * h]);
    page.wait("the inspector and a reference", |report| {
        report["marks"]["inspector"].is_array() && report["reference_samples"].as_u64().unwrap() > 3
    });
    page.screenshot(&target(), "inspector");
    // The button says that the link was copied. Every set-up is a link without an error.
    page.evaluate("document.getElementById('setups-open').click()");
    page.screenshot(&target(), "set-ups");
    let links =
        page.evaluate("[...document.querySelectorAll('#setups a')].map(link => link.getAttribute('href').slice(1))");
    assert_eq!(links.as_array().unwrap().len(), 4);
    page.evaluate("document.querySelector('#setups a[href*=\"scene=cornell\"]').click()");
    // The note about the bookmark goes after some seconds. The set-up adds no other message.
    page.wait("a set-up without a message", |report| {
        report["address"].as_str().unwrap().contains("visibility=auto") && report["messages"] == json!([])
    });
    assert_eq!(page.evaluate("document.getElementById('setups').open"), json!(false));
}
