//! Error messages of the page, and recovery.

use crate::{SIZE, alone, chromium::Page, cut, demo, difference, open, rect, settled, spread, target};

const OBJ: &str = "mtllib room.mtl\nusemtl floor\nv -2 0 -2\nv 2 0 -2\nv 2 0 2\nv -2 0 2\nf 4 3 2 1\n\
                   usemtl wall\nv -2 2 -2\nv 2 2 -2\nf 1 2 6 5\n";
const MTL: &str = "newmtl floor\nKd 0.8 0.8 0.8\nnewmtl wall\nKd 0.8 0.2 0.1\n";

#[test]
fn a_model_can_be_dropped_and_a_broken_one_is_reported() {
    let _alone = alone();
    let mut page = open("scene=cornell&size=320x180&truth=off");
    page.wait("Cornell", settled);
    page.drop_files(&[("room.obj", OBJ), ("room.mtl", MTL)]);
    let report = page.wait("the dropped room", |r| settled(r) && r["scene"] == "room");
    assert_eq!(report["messages"], serde_json::json!([]));
    let room = cut(&page.screenshot(&target(), "dropped"), rect(&report, "picture"));
    assert!(spread(&room).1 > 5.0, "the dropped room is blank");

    page.drop_files(&[("broken.obj", "v 0 0 0\nv 1 0 0\nf 1 2 9\n")]);
    let report = page.wait("a message", |r| !r["messages"].as_array().unwrap().is_empty());
    let sentence = report["messages"][0].as_str().unwrap().to_owned();
    println!("broken.obj: {sentence}");
    assert!(sentence.starts_with("broken.obj:3"), "{sentence}");
    // The earlier scene is still shown.
    assert_eq!(report["scene"], "room");
    page.screenshot(&target(), "broken-model");

    page.drop_files(&[("holiday.png", "")]);
    page.wait("another message", |r| r["messages"].to_string().contains("no model (.obj, .gltf, .glb) and no .toml"));
}

#[test]
fn a_worker_that_cannot_start_is_reported() {
    let _alone = alone();
    let mut page = Page::open(SIZE, 1.0);
    // Its file is not on the server.
    let script = "window.Worker = class extends Worker { constructor(_, options) { super('none.js', options); } }";
    page.call("Page.addScriptToEvaluateOnNewDocument", serde_json::json!({ "source": script }));
    page.go(&format!("{}#scene=cornell&size=96x54&truth=off", demo()));
    page.wait("a message", |report| report["messages"].to_string().contains("while it read the scene"));
    page.wait_for("document.getElementById('message').hidden");
}

#[test]
fn a_lost_device_comes_back() {
    let _alone = alone();
    let mut page = open("scene=cornell&size=320x180&truth=off&a.hierarchical.samples=16");
    let report = page.wait("Cornell", settled);
    let before = cut(&page.screenshot(&target(), "before-loss"), rect(&report, "picture"));
    // The message is soon replaced by that of opening again, so it is recorded and not looked for.
    page.evaluate(
        "window.titles = [];
         new MutationObserver(() => titles.push(document.getElementById('title').textContent))
             .observe(document.getElementById('title'), { childList: true })",
    );
    page.crash_gpu_process();
    page.wait_for("titles.includes('The graphics device was lost')");
    page.wait_for("titles.includes('Drawing the first picture…') && document.getElementById('message').hidden");
    let report = page.wait("Cornell again", settled);
    assert!(report["address"].as_str().unwrap().contains("a.hierarchical.samples=16"), "{report}");
    let after = cut(&page.screenshot(&target(), "after-loss"), rect(&report, "picture"));
    let body = |picture: &image::RgbImage| {
        cut(picture, [0.0, 0.0, f64::from(picture.width()), f64::from(picture.height()) - 60.0])
    };
    assert!(difference(&body(&before), &body(&after)) < 0.05, "the picture differs after the loss");
}

#[test]
fn a_browser_without_webgpu_gets_instructions() {
    let _alone = alone();
    for (name, script, wanted) in [
        (
            "no-webgpu",
            "Object.defineProperty(Navigator.prototype, 'gpu', { get: () => undefined })",
            "does not offer WebGPU",
        ),
        ("no-adapter", "GPU.prototype.requestAdapter = async () => null", "No graphics device was found"),
        (
            "no-limits",
            "GPUAdapter.prototype.requestDevice = async () => { throw new Error('limits') }",
            "The viewer could not start",
        ),
    ] {
        let mut page = Page::open(SIZE, 1.0);
        page.call("Page.addScriptToEvaluateOnNewDocument", serde_json::json!({ "source": script }));
        page.go(&demo());
        page.wait_for(&format!("document.body?.innerText.includes('{wanted}') === true"));
        page.screenshot(&target(), name);
    }
}
