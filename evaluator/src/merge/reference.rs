//! Parts of one reference, traced apart, and their exact sum.

use std::{
    fs,
    io::Write as _,
    path::{Path, PathBuf},
};

use halflight_native::{
    NativeGpu,
    cache::{Cache, Key, KeyInputs},
    files::write_whole,
    images::{Image, Precision, auto_exposure, write_png},
    scene_hash::scene_hash,
    truth::TruthSource,
};
use halflight_renderer::{
    gi::TextureFilter,
    truth::{Request, Sums, Truth, is_lit},
};
use halflight_scenes::{Camera, Scene};
use serde::{Deserialize, Serialize};

use crate::{
    Error,
    experiment::{COMMIT, reference},
};

/// Ending of the files of parts.
pub const ENDING: &str = "truth";

const MAGIC: &[u8] = b"Halflight part of a reference, version 1\n";

/// A part of a reference: sums over some of its samples, and what they are of.
pub struct ReferencePart {
    /// What all parts of the reference share, but for the command.
    pub about: About,
    /// The sums.
    pub sums: Sums,
}

/// What a reference or a part of it is of. It is the head of the file of a part, as JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// Command that traced it.
    pub command: String,
    /// Name of the scene.
    pub scene: String,
    /// Hash of the scene's content.
    pub scene_hash: String,
    /// Hash of scene, request and shader.
    pub inputs: String,
    /// Commit of the program.
    pub commit: String,
    /// Adapter, driver and backend.
    pub adapter: String,
    /// Samples per pixel of the whole reference.
    pub samples: u32,
    /// Whether the scene has any light.
    pub lit: bool,
    /// What the loader of the scene replaced.
    pub warnings: Vec<String>,
    /// Camera, vertical field of view and size.
    pub(crate) eye: [f32; 3],
    pub(crate) target: [f32; 3],
    pub(crate) up: [f32; 3],
    pub(crate) vertical_fov_degrees: f32,
    pub(crate) size: [u32; 2],
    /// The other fields of the request.
    pub(crate) bounces: u32,
    pub(crate) bounce1: bool,
    pub(crate) on_screen: bool,
    pub(crate) glossy: bool,
    pub(crate) ambient_occlusion: Option<f32>,
    pub(crate) seed: u32,
}

impl About {
    /// What `samples` samples of a request are of. `command` traces them.
    pub fn new(
        command: String,
        native: &NativeGpu,
        scene: &Scene,
        request: &Request,
        inputs: &Key,
        samples: u32,
    ) -> Self {
        // Destructured, so that a new field cannot be left out.
        // References of the evaluator are bilinear.
        let Request { camera, size, bounce1, bounces, on_screen, glossy, ambient_occlusion, texture_filter: _, seed } =
            *request;
        let Camera { eye, target, up, vertical_fov_degrees } = camera;
        let info = &native.info;
        Self {
            command,
            scene: scene.name.clone(),
            scene_hash: scene_hash(scene).to_string(),
            inputs: inputs.to_string(),
            commit: COMMIT.into(),
            adapter: format!("{} {} {} {:?}", info.name, info.driver, info.driver_info, info.backend),
            samples,
            lit: is_lit(scene),
            warnings: scene.warnings.clone(),
            eye,
            target,
            up,
            vertical_fov_degrees,
            size,
            bounces,
            bounce1,
            on_screen,
            glossy,
            ambient_occlusion,
            seed,
        }
    }

    fn request(&self) -> Request {
        let &Self { eye, target, up, vertical_fov_degrees, size, bounces, bounce1, .. } = self;
        let &Self { on_screen, glossy, ambient_occlusion, seed, .. } = self;
        let camera = Camera { eye, target, up, vertical_fov_degrees };
        let texture_filter = TextureFilter::Bilinear;
        Request { camera, size, bounce1, bounces, on_screen, glossy, ambient_occlusion, texture_filter, seed }
    }

    /// What must be the same in all parts, by key.
    fn keys(&self) -> [(&'static str, String); 5] {
        [
            ("commit", self.commit.clone()),
            ("scene", format!("{} with content {}", self.scene, self.scene_hash)),
            ("samples", self.samples.to_string()),
            // The scene's content is the same: what is left is the request and the shader.
            ("reference settings", format!("{:?} (inputs {})", self.request(), self.inputs)),
            ("adapter", self.adapter.clone()),
        ]
    }
}

impl ReferencePart {
    /// Writes the file of a part.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let head = serde_json::to_vec(&self.about).map_err(|error| Error::Failed(error.to_string()))?;
        let sums = self.sums.to_bytes();
        let written = write_whole(path, |file| {
            file.write_all(MAGIC)?;
            file.write_all(&(head.len() as u64).to_le_bytes())?;
            file.write_all(&head)?;
            file.write_all(&sums)?;
            file.write_all(check(&head, &sums).as_str().as_bytes())
        });
        written.map_err(|error: std::io::Error| Error::unwritable(path, error))
    }

    /// Reads the file of a part.
    ///
    /// # Errors
    /// If the file cannot be read, is cut off or damaged, or holds something else.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let bytes = fs::read(path).map_err(|error| Error::unreadable(path, error))?;
        let rest = bytes.strip_prefix(MAGIC).ok_or_else(|| {
            Error::unreadable(path, "it is no part of a reference; `evaluator truth --shard` writes them")
        })?;
        let parse = || {
            let (length, rest) = rest.split_first_chunk::<8>()?;
            let (head, rest) = rest.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
            let (sums, hash) = rest.split_at_checked(rest.len().checked_sub(32)?)?;
            (check(head, sums).as_str().as_bytes() == hash).then_some(())?;
            let about: About = serde_json::from_slice(head).ok()?;
            let sums = Sums::from_bytes(sums, &about.request()).ok()?;
            Some(Self { about, sums })
        };
        parse().ok_or_else(|| Error::unreadable(path, "it is cut off or damaged; trace this part again"))
    }
}

fn check(head: &[u8], sums: &[u8]) -> Key {
    let mut inputs = KeyInputs::default();
    inputs.add(head).add(sums);
    inputs.key()
}

/// Merges all parts of a reference: their sums are added exactly, so the result is that of one trace of all samples, bit
/// for bit. The sums go to the cache as well, where later runs find them. `command` is written to the image.
///
/// # Errors
/// Parts that do not belong together, a part that is missing or there twice: one sentence with the file and the key.
pub fn merge_references(files: &[PathBuf], out: &Path, cache: &Cache, command: &str) -> Result<Truth, Error> {
    let mut parts = Vec::new();
    for path in files {
        parts.push((path, ReferencePart::read(path)?));
    }
    parts.sort_by_key(|(_, part)| part.sums.first());
    let mut parts = parts.into_iter();
    let (first_path, ReferencePart { about, mut sums }) =
        parts.next().ok_or_else(|| Error::BadInput("no part of a reference: name at least one file".into()))?;
    let first_of = |samples: u32| format!("samples 0 to {} are missing", samples - 1);
    let cannot = |path: &Path, reason: String| {
        Error::BadInput(format!("{} cannot be merged with {}: {reason}", path.display(), first_path.display()))
    };
    if sums.first() > 0 {
        return Err(cannot(first_path, format!("{}; trace that part, and merge all", first_of(sums.first()))));
    }
    for (path, part) in parts {
        for (a, b) in about.keys().into_iter().zip(part.about.keys()) {
            if a != b {
                let (key, a, b) = (a.0, a.1, b.1);
                return Err(cannot(path, format!("`{key}` is {b} there and {a} here: trace one of them again")));
            }
        }
        sums.merge(part.sums).map_err(|error| cannot(path, format!("{error}; name each part once")))?;
    }
    if sums.samples() < about.samples {
        return Err(cannot(
            first_path,
            format!("samples {} to {} are missing; trace that part, and merge all", sums.samples(), about.samples - 1),
        ));
    }
    let request = about.request();
    let truth = sums.truth(&request);
    let rel_error = if about.lit { truth.rel_error(8) } else { Some(0.0) };
    let inputs = Key::parse(&about.inputs);
    write(&truth, rel_error, &About { command: command.to_owned(), ..about }, out)?;
    if let Some(warning) = TruthSource::keep(cache, &inputs, &request, &sums) {
        halflight_output::terminal::note(format_args!("warning: {warning}"));
    }
    Ok(truth)
}

/// Writes a reference and what it is of: all channels as .exr, the tone-mapped image as .png. `rel_error`: its relative error
/// over 8 x 8 pixels.
///
/// # Errors
/// If the file cannot be written.
pub fn write(truth: &Truth, rel_error: Option<f64>, about: &About, out: &Path) -> Result<(), Error> {
    let facts = [
        ("command", about.command.clone()),
        ("scene", about.scene.clone()),
        ("scene_hash", about.scene_hash.clone()),
        ("samples_per_pixel", truth.samples.to_string()),
        ("rel_error_8x8", rel_error.map_or("unknown".into(), |error| error.to_string())),
        ("bounces", about.bounces.to_string()),
        ("seed", about.seed.to_string()),
        ("inputs", about.inputs.clone()),
        ("commit", about.commit.clone()),
        ("warnings", about.warnings.join("; ")),
    ];
    let mut image: Image = reference::image(truth);
    image.metadata.extend(facts.map(|(key, value)| (key.to_owned(), value)));
    if out.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("exr")) {
        image.write_exr(out, Precision::Full)?;
    } else {
        let pixels = reference::final_radiance(truth);
        write_png(out, truth.size[0], &pixels, auto_exposure(&pixels, image.surface_mask().as_deref()))?;
    }
    Ok(())
}
