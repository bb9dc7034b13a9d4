//! Small images of every technique against those in `tests/snapshots`.
//!
//! The images there are lavapipe's. With the same Mesa and LLVM a new one agrees bit for bit; another version, another
//! processor or another adapter rounds differently, which the tolerance of [`snapshot`] allows.
//! `cargo xtask snapshots` runs this test alone, and with `--accept` takes the new images over.

use halflight_evaluator::experiment::session::Session;
use halflight_native::images::{Rgb, tone_map_all};
use halflight_techniques::TECHNIQUES;
use halflight_tests::{
    bundled, device, request,
    snapshot::{self, Picture},
};

const SIZE: [u32; 2] = [96, 54];

/// A snapshot: scene, exposure (1 over the radiance that shows as white), technique, settings, number of the frame.
struct Shot {
    scene: &'static str,
    exposure: f32,
    technique: &'static str,
    settings: &'static [(&'static str, &'static str)],
    frame: u32,
}

const fn shot(
    scene: &'static str,
    exposure: f32,
    technique: &'static str,
    settings: &'static [(&'static str, &'static str)],
    frame: u32,
) -> Shot {
    Shot { scene, exposure, technique, settings, frame }
}

const SHOTS: &[Shot] = &[
    shot("atrium", 0.8, "radiance-cache", &[], 16),
    shot("cornell", 6.0, "radiance-cache", &[("start_resolution", "full")], 16),
    shot("atrium", 0.8, "hierarchical", &[], 0),
    shot("bars", 1.5, "hierarchical", &[("visibility", "auto"), ("bounces", "2")], 0),
    shot("motion", 3.0, "hierarchical", &[("glossy", "on"), ("temporal_a", "0.9")], 12),
    shot("cornell", 6.0, "hierarchical", &[("sources", "both")], 0),
    shot("bars", 1.5, "bitmask", &[], 0),
    shot("motion", 3.0, "bitmask", &[("temporal_a", "0.9")], 12),
    shot("cornell", 6.0, "hybrid", &[], 0),
    shot("bars", 1.5, "hybrid", &[("specular", "both"), ("ambient_occlusion", "both")], 0),
    shot("atrium", 0.8, "gtao", &[], 0),
    shot("bars", 1.5, "horizon", &[], 0),
    shot("cornell", 6.0, "ray-march", &[], 0),
    shot("cornell", 6.0, "rsm", &[], 0),
    shot("bars", 1.5, "ssdo", &[], 0),
    shot("atrium", 0.8, "ssao", &[], 0),
    shot("cornell", 6.0, "exhaustive", &[], 0),
    shot("atrium", 0.8, "none", &[], 0),
];

impl Shot {
    fn name(&self) -> String {
        let words = self.settings.iter().map(|(key, value)| format!("-{key}-{value}"));
        let frame = if self.frame > 0 { format!("-frame-{}", self.frame) } else { String::new() };
        format!("{}-{}{}{frame}", self.technique, self.scene, words.collect::<String>())
    }

    /// Fraction of pixels that may differ.
    fn outliers(&self) -> f64 {
        let voxels = self.settings.contains(&("visibility", "auto"));
        if voxels { snapshot::OUTLIERS_OF_VOXELS } else { snapshot::OUTLIERS }
    }

    /// The final image, and beside it what the technique adds to it: indirect light, or ambient visibility.
    fn render(&self) -> Picture {
        let scene = bundled(self.scene);
        let session = Session::new(device(), &scene);
        let mut frames = session.frames(&request(self.technique, self.settings, SIZE)).expect("the technique plans");
        // A history needs the frames before.
        let first = if frames.plan().has_history() { 0 } else { self.frame };
        (first..=self.frame).for_each(|frame| drop(frames.run(frame).expect("the frame runs")));
        let read = |output| frames.read_rgb(output).expect("the output is read");
        let image = |pixels: &[Rgb], exposure| {
            let code = |pixel: Rgb| pixel.map(|value| (value * 255.0).round() as u8);
            Picture { width: SIZE[0], pixels: tone_map_all(pixels, exposure).into_iter().map(code).collect() }
        };
        let last = image(&read("final").expect("every plan has a final image"), self.exposure);
        match (read("indirect"), read("ambient_occlusion")) {
            (Some(light), _) => Picture::beside(&[&last, &image(&light, self.exposure)]),
            (None, Some(visibility)) => Picture::beside(&[&last, &image(&visibility, 1.0)]),
            (None, None) => last,
        }
    }
}

#[test]
fn images_are_as_they_were() {
    let different: Vec<String> = SHOTS
        .iter()
        .filter_map(|shot| {
            let (name, image) = (shot.name(), shot.render());
            assert!(image.pixels.iter().any(|pixel| *pixel != [0; 3]), "{name} is black");
            snapshot::compare(&name, &image, shot.outliers()).err()
        })
        .collect();
    assert!(different.is_empty(), "{}", different.join("\n"));
}

#[test]
fn every_technique_has_a_snapshot() {
    for technique in TECHNIQUES {
        assert!(SHOTS.iter().any(|shot| shot.technique == technique.name), "{} has no snapshot", technique.name);
    }
    // No image is left of a snapshot that is gone.
    let names: Vec<String> = SHOTS.iter().map(Shot::name).collect();
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("snapshots");
    for file in std::fs::read_dir(folder).expect("the folder of snapshots") {
        let path = file.expect("an entry of the folder").path();
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        assert!(names.contains(&name), "{} belongs to no snapshot: remove it", path.display());
    }
}
