//! The picture of the browser compared with that of the native evaluator.

use std::path::Path;

use halflight_evaluator::experiment::session::{Request, Session, open_adapter};
use halflight_metrics::{flip_map, masked_mean};
use halflight_native::images::{auto_exposure, tone_map_all};
use halflight_scenes::{DiskFiles, load_scene};
use halflight_techniques::technique;

use crate::{alone, open, settled, target};

#[test]
fn the_browser_draws_what_the_evaluator_draws() {
    let _alone = alone();
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let native = open_adapter("software").unwrap();
    for (scene, [width, height]) in [("cornell", [640, 360]), ("atrium", [320, 180])] {
        let mut page = open(&format!("scene={scene}&size={width}x{height}&truth=off"));
        page.wait(scene, settled);
        // Base64 is about twenty times faster than JSON numbers.
        let text = page.evaluate(
            "halflight.read_output('indirect').then(values => { \
               const bytes = new Uint8Array(values.buffer, values.byteOffset, values.byteLength); \
               let text = ''; \
               for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768)); \
               return btoa(text); })",
        );
        let bytes = crate::chromium::base64(text.as_str().unwrap());
        let values: Vec<f32> = bytes.chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect();
        let browser: Vec<[f32; 3]> = values.chunks_exact(4).map(|texel| [texel[0], texel[1], texel[2]]).collect();

        let scene_data = load_scene(&DiskFiles, &scenes.join(format!("{scene}.toml"))).unwrap();
        let session = Session::new(&native, &scene_data);
        let with_seed = |seed: u32| {
            let request = Request {
                technique: technique("hierarchical").unwrap(),
                settings: Default::default(),
                size: [width, height],
                seed,
                direct: None,
            };
            let mut frames = session.frames(&request).unwrap();
            frames.run(0).unwrap();
            frames.read_rgb("indirect").unwrap().unwrap()
        };
        let [evaluator, other_seed] = [0, 1].map(with_seed);
        assert_eq!(browser.len(), evaluator.len());
        let exposure = auto_exposure(&evaluator, None);
        let shown = [&browser, &evaluator, &other_seed].map(|pixels| tone_map_all(pixels, exposure));
        let [flip, noise] = [0, 2].map(|other| masked_mean(&flip_map(&shown[other], &shown[1], width), None));
        println!(
            "FLIP of `indirect`, {scene} at {width}x{height}: browser against evaluator {flip:.5}, one seed against \
             another {noise:.5}"
        );
        for (name, pixels) in [("browser", &shown[0]), ("evaluator", &shown[1])] {
            let bytes = pixels.iter().flatten().map(|v| (v * 255.0).round() as u8).collect();
            let picture = image::RgbImage::from_raw(width, height, bytes).unwrap();
            picture.save(target().join(format!("indirect-{scene}-{name}.png"))).unwrap();
        }
        // The same shaders on two implementations. Large triangles differ by the rounding of single operations only. The
        // atrium has thousands of small triangles. SwiftShader snaps vertices to 1/16 pixel and lavapipe to 1/256 pixel,
        // so silhouettes differ, and samples near them hit other surfaces. This must be small compared with the
        // difference between two seeds.
        let bound = if scene == "cornell" { 0.02 } else { 0.5 * noise };
        assert!(flip < bound, "{scene}: {flip}, at most {bound}");
    }
}
