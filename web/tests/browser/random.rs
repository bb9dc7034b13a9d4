//! Two hundred random actions of a user, without one error of the device.

use serde_json::Value;

use crate::{alone, centre, chromium::Page, open, rect, settled, target};

/// Actions of the test.
const ACTIONS: u32 = 200;

/// Techniques that compile quickly.
const TECHNIQUES: [&str; 6] = ["none", "ssao", "ssdo", "gtao", "bitmask", "hierarchical"];

/// Views; some techniques lack some of them.
const VIEWS: [&str; 8] = ["final", "indirect", "ambient_occlusion", "depth", "error", "truth", "surfels_4", "gathered"];

/// Controls that do not leave the page.
const MARKS: [&str; 14] = [
    "compare",
    "play",
    "undo",
    "view",
    "size",
    "scene",
    "help",
    "metric",
    "a.technique",
    "b.technique",
    "a.more",
    "a.check",
    "a.times",
    "reference",
];

/// Pseudo-random numbers (a linear congruential generator).
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end
    }

    fn of<'a>(&mut self, list: &[&'a str]) -> &'a str {
        list[self.below(list.len())]
    }
}

/// Does something and says what.
fn act(page: &mut Page, report: &Value, numbers: &mut Numbers) -> String {
    let inside = |numbers: &mut Numbers| {
        let [x, y, w, h] = rect(report, "picture");
        [x + w * (numbers.below(90) + 5) as f64 / 100.0, y + h * (numbers.below(90) + 5) as f64 / 100.0]
    };
    match numbers.below(12) {
        // Another technique or view, also while times are measured.
        0..=2 => {
            let (a, b, view) = (numbers.of(&TECHNIQUES), numbers.of(&TECHNIQUES), numbers.of(&VIEWS));
            let compare = numbers.of(&["&compare=on", ""]);
            let link = format!("scene=cornell&size=96x54&a={a}&b={b}&view={view}{compare}");
            page.evaluate(&format!("halflight.go_to('{link}')"));
            link
        }
        3..=5 => {
            let mark = numbers.of(&MARKS);
            if report["marks"][mark].is_array() {
                page.click_quickly(centre(report, mark));
            }
            format!("click on {mark}")
        }
        6 => {
            let at = inside(numbers);
            page.click_quickly(at);
            format!("click at {at:?}")
        }
        7 => {
            let (from, to) = (inside(numbers), inside(numbers));
            page.drag_quickly(from, to);
            format!("drag from {from:?} to {to:?}")
        }
        8 => {
            let size = [[320, 240], [390, 700], [800, 500], [1180, 720]][numbers.below(4)];
            page.resize(size);
            format!("size {size:?}")
        }
        9 => {
            let (name, text) = [
                ("triangle.obj", "v -1 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
                ("broken.obj", "v 0 0 0\nf 1 2 9\n"),
                ("preset.toml", "technique = \"bitmask\"\n[settings]\nsteps = 4\n"),
                ("picture.png", ""),
            ][numbers.below(4)];
            page.drop_files(&[(name, text)]);
            format!("drop of {name}")
        }
        10 => {
            page.evaluate("document.getElementById('view').style.display = 'none'");
            page.evaluate("new Promise(done => setTimeout(done, 20))");
            page.evaluate("document.getElementById('view').style.display = ''");
            "hide and show the page".into()
        }
        _ => {
            let key = numbers.of(&["1", "2", "3", "f", "i", "?", "Home", "Escape"]);
            page.key_quickly(key);
            format!("key {key}")
        }
    }
}

/// Lets the page draw: a few frames, so that there is a picture.
fn frames(page: &mut Page) {
    for _ in 0..6 {
        page.frame();
    }
}

#[test]
fn random_actions_cause_no_error_of_the_device() {
    let _alone = alone();
    let mut page = open("scene=cornell&size=96x54&a=none&b=ssdo&compare=on");
    page.wait("the first picture", settled);
    let mut numbers = Numbers(7);
    let mut done = Vec::new();
    for _ in 0..ACTIONS {
        let report = page.report();
        let has_errors = report["device_errors"] != 0;
        assert!(report.is_object() && !has_errors, "after {:?}: {}", done.last(), report["messages"]);
        done.push(act(&mut page, &report, &mut numbers));
        // Actions that come too fast for a picture find other faults than those that replace one.
        if numbers.below(3) == 0 {
            frames(&mut page);
        }
    }
    page.resize([1180, 720]);
    page.evaluate("halflight.go_to('scene=cornell&size=96x54&truth=off&a=ssdo')");
    let report = page.wait("the last picture", |report| settled(report) && report["scene"] == "cornell");
    page.screenshot(&target(), "after-random-actions");
    assert_eq!(report["device_errors"], 0, "{}", report["messages"]);
    // The bar is as wide as before, also after the page was hidden.
    assert_eq!(report["screen"][0], 1180.0);
    let bad =
        |line: &&String| ["Destroyed", "alidation", "panicked", "unreachable"].iter().any(|word| line.contains(word));
    assert_eq!(page.console.iter().find(bad), None, "the last actions: {:?}", &done[done.len() - 9..]);
}

#[test]
fn a_view_that_a_technique_lacks_destroys_nothing_that_is_painted() {
    let _alone = alone();
    let mut page = open("scene=cornell&size=96x54&a=ssao&truth=off");
    page.wait("the first picture", settled);
    for (technique, view) in [
        ("ssao", "surfels_4"),
        ("none", "final"),
        ("none", "ambient_occlusion"),
        ("bitmask", "final"),
        ("none", "gathered"),
    ] {
        page.evaluate(&format!("halflight.go_to('scene=cornell&size=96x54&a={technique}&truth=off&view={view}')"));
        frames(&mut page);
        let report = page.report();
        assert_eq!(report["device_errors"], 0, "{technique}, {view}: {}", report["messages"]);
    }
}
