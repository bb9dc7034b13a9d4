//! The browser's picture against that of the native evaluator.

use std::path::Path;

use halflight_evaluator::{
    metrics::{flip_map, masked_mean},
    session::{Request, Session, open_adapter},
};
use halflight_native::images::{auto_exposure, tone_map_all};
use halflight_renderer::techniques::technique;
use halflight_scenes::{DiskFiles, load_scene};

use crate::{alone, open, settled, target};

#[test]
fn the_browser_draws_what_the_evaluator_draws() {
    let _alone = alone();
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let native = open_adapter("software").unwrap();
    // Not the atrium: two rasterisers disagree on the edges of its thousands of small triangles, and the random samples
    // that fall beside them on fetch other surfaces, which is noise and no difference in what is computed.
    for (scene, [width, height]) in [("cornell", [640, 360])] {
        let mut page = open(&format!("scene={scene}&size={width}x{height}&truth=off"));
        page.wait(scene, settled);
        // Numbers travel as bytes in base64: as JSON they would take twenty times as long.
        let text = page.evaluate(
            "halflight.read_output('indirect').then(values => { \
               const bytes = new Uint8Array(values.buffer, values.byteOffset, values.byteLength); \
               let text = ''; \
               for (let i = 0; i < bytes.length; i += 32768) text += String.fromCharCode(...bytes.subarray(i, i + 32768)); \
               return btoa(text); })",
        );
        let bytes = crate::chromium::decode_base64(text.as_str().unwrap());
        let values: Vec<f32> = bytes.chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().unwrap())).collect();
        let browser: Vec<[f32; 3]> = values.chunks_exact(4).map(|texel| [texel[0], texel[1], texel[2]]).collect();

        let scene_data = load_scene(&DiskFiles, &scenes.join(format!("{scene}.toml"))).unwrap();
        let session = Session::new(&native, &scene_data);
        let request = Request {
            technique: technique("hierarchical").unwrap(),
            settings: Default::default(),
            size: [width, height],
            seed: 0,
            direct: None,
        };
        let mut frames = session.frames(&request).unwrap();
        frames.run(0).unwrap();
        let evaluator = frames.read_rgb("indirect").unwrap().unwrap();
        assert_eq!(browser.len(), evaluator.len());
        let exposure = auto_exposure(&evaluator, None);
        let shown = [&browser, &evaluator].map(|pixels| tone_map_all(pixels, exposure));
        let flip = masked_mean(&flip_map(&shown[0], &shown[1], width), None);
        println!("FLIP of `indirect`, browser against evaluator, {scene} at {width}x{height}: {flip:.5}");
        for (name, pixels) in [("browser", &shown[0]), ("evaluator", &shown[1])] {
            let bytes = pixels.iter().flatten().map(|v| (v * 255.0).round() as u8).collect();
            let picture = image::RgbImage::from_raw(width, height, bytes).unwrap();
            picture.save(target().join(format!("indirect-{scene}-{name}.png"))).unwrap();
        }
        // The same shaders on two implementations: they differ by the rounding of single operations.
        assert!(flip < 0.02, "{scene}: {flip}");
    }
}
