//! Scenes on their way from files to the device.
//!
//! Another thread, in a browser a worker, reads a [`Source`] and prepares all that needs no device: what the buffers hold, and
//! the BVH. It sends that in small parts. The viewer takes parts between two frames, as long as there is time, and uploads
//! them.

mod prepare;
mod source;

use std::{
    any::Any,
    rc::Rc,
    sync::mpsc::{self, Receiver, Sender, TryRecvError},
};

use eframe::egui;
use halflight_frame_graph::Gpu;
use halflight_renderer::scene::{BvhError, SceneBuffers, SceneBvh, SceneSize, Sight};
use halflight_scenes::{Scene, SceneNeeds};
use serde::de::DeserializeOwned;
use web_time::{Duration, Instant};

pub use prepare::{Found, Part, prepare};
pub use source::{File, Source};

use prepare::Prepared;

/// Time between two frames in which parts are taken.
const SLICE: Duration = Duration::from_millis(25);

/// Brings the parts of a scene to the viewer.
#[derive(Clone)]
pub struct Delivery {
    sender: Sender<Part>,
    ctx: egui::Context,
}

impl Delivery {
    fn new(ctx: egui::Context) -> (Self, Receiver<Part>) {
        let (sender, receiver) = mpsc::channel();
        (Self { sender, ctx }, receiver)
    }

    /// Delivers a part; false if the scene is not wanted any more.
    pub fn part(&self, part: Part) -> bool {
        // Nothing is seen of the others.
        let shows = !matches!(part, Part::Mesh(_) | Part::Texture(_) | Part::Piece(_));
        let wanted = self.sender.send(part).is_ok();
        if shows {
            self.ctx.request_repaint();
        }
        wanted
    }

    /// Delivers a part as the bytes that [`pack`] wrote; false if the scene is not wanted any more.
    pub fn packed(&self, bytes: &[u8]) -> bool {
        self.part(unpack(bytes).unwrap_or_else(Part::Failed))
    }

    /// Says why there will be no scene.
    pub fn failed(&self, sentence: String) {
        self.part(Part::Failed(sentence));
    }
}

/// A part as bytes, for [`Delivery::packed`].
pub fn pack(part: &Part) -> Vec<u8> {
    // Only types without a fixed length or a serializer of their own can fail, and a part has neither.
    postcard::to_allocvec(part).unwrap_or_default()
}

/// A source as bytes, for [`unpack_source`].
pub fn pack_source(source: &Source) -> Vec<u8> {
    postcard::to_allocvec(source).unwrap_or_default()
}

/// The source that [`pack_source`] has written.
///
/// # Errors
/// If the bytes are others.
pub fn unpack_source(bytes: &[u8]) -> Result<Source, String> {
    unpack(bytes)
}

fn unpack<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    postcard::from_bytes(bytes).map_err(|error| format!("Halflight hit an internal error ({error}): reload the page"))
}

/// What a step of a [`Loading`] brought.
pub enum Event {
    /// The source was read.
    Read {
        /// Whether it has a scene, which will be drawable soon.
        has_scene: bool,
        /// What else it has.
        found: Found,
    },
    /// The scene can be drawn.
    Drawable(Box<Loaded>),
    /// The BVH of the scene, or why there is none.
    Bvh(Result<Box<SceneBvh>, BvhError>),
    /// The source could not be read.
    Failed(String),
}

/// A scene on the device.
pub struct Loaded {
    /// The scene.
    pub scene: Scene,
    /// What it needs.
    pub needs: SceneNeeds,
    /// Its triangles for rays of cameras.
    pub sight: Sight,
    /// Its buffers.
    pub buffers: SceneBuffers,
}

/// A scene that is read, prepared and uploaded.
pub struct Loading {
    /// Where it comes from.
    pub source: Rc<Source>,
    received: Receiver<Part>,
    scene: Scene,
    /// What the scene needs, and its buffers, until all of their contents are there.
    uploading: Option<(SceneNeeds, SceneBuffers)>,
    bvh: Option<Box<SceneBvh>>,
    /// What it is doing.
    pub step: &'static str,
    ended: bool,
    /// What works on it: it is stopped when this is dropped.
    _job: Box<dyn Any>,
}

impl Loading {
    /// Starts. `work` gives the source to another thread, and stops that when its result is dropped.
    pub fn start(
        source: Rc<Source>,
        ctx: &egui::Context,
        work: impl FnOnce(&Source, Delivery) -> Box<dyn Any>,
    ) -> Self {
        let (delivery, received) = Delivery::new(ctx.clone());
        let job = work(&source, delivery);
        let step = "Reading the scene…";
        Self { source, received, scene: Scene::default(), uploading: None, bvh: None, step, ended: false, _job: job }
    }

    /// Whether nothing follows.
    pub fn has_ended(&self) -> bool {
        self.ended
    }

    /// Takes parts for a few milliseconds, and uploads them. Returns what can be used now; `None` if there is nothing yet.
    pub fn advance(&mut self, gpu: &Gpu, ctx: &egui::Context) -> Option<Event> {
        let begun = Instant::now();
        while !self.ended {
            if begun.elapsed() > SLICE {
                ctx.request_repaint();
                return None;
            }
            let part = match self.received.try_recv() {
                Ok(part) => part,
                Err(TryRecvError::Empty) => return None,
                Err(TryRecvError::Disconnected) => {
                    Part::Failed("Halflight hit an internal error while it read the scene: open it again".into())
                }
            };
            if let Some(event) = self.take(gpu, part) {
                ctx.request_repaint();
                return Some(event);
            }
        }
        None
    }

    fn take(&mut self, gpu: &Gpu, part: Part) -> Option<Event> {
        match part {
            Part::Read(scene, found) => {
                let has_scene = scene.is_some();
                self.scene = scene.map_or_else(Scene::default, |scene| *scene);
                self.step = "Preparing the scene…";
                return Some(Event::Read { has_scene, found });
            }
            Part::Mesh(mesh) => self.scene.meshes.push(mesh),
            Part::Texture(texture) => self.scene.textures.push(texture),
            Part::Prepared(prepared) => {
                if let Err(error) = SceneSize::of(&self.scene).check(&gpu.limits()) {
                    self.ended = true;
                    return Some(Event::Failed(error.to_string()));
                }
                let Prepared { needs, contents } = *prepared;
                self.uploading = Some((needs, SceneBuffers::reserve(gpu, contents)));
                self.step = "Uploading the scene…";
            }
            Part::Piece(piece) => match (&self.uploading, &self.bvh) {
                (Some((_, buffers)), _) => buffers.write(gpu, &piece),
                (None, Some(bvh)) => bvh.write(gpu, &piece),
                (None, None) => {}
            },
            Part::Drawable(sight) => {
                self.step = "Building the BVH…";
                let (needs, buffers) = self.uploading.take()?;
                let scene = std::mem::take(&mut self.scene);
                return Some(Event::Drawable(Box::new(Loaded { scene, needs, sight: *sight, buffers })));
            }
            Part::Bvh(bvh) => match bvh.and_then(|contents| SceneBvh::reserve(gpu, contents)) {
                Ok(bvh) => self.bvh = Some(Box::new(bvh)),
                Err(error) => {
                    self.ended = true;
                    return Some(Event::Bvh(Err(error)));
                }
            },
            Part::End => {
                self.ended = true;
                return self.bvh.take().map(|bvh| Event::Bvh(Ok(bvh)));
            }
            Part::Failed(sentence) => {
                self.ended = true;
                return Some(Event::Failed(sentence));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use halflight_scenes::bundled;

    use super::*;

    /// The parts of a source after they were packed and unpacked.
    fn sent(source: Source) -> Vec<Part> {
        let source = unpack_source(&pack_source(&source)).expect("what was packed");
        let mut parts = Vec::new();
        prepare(source, |part| {
            parts.push(unpack(&pack(&part)).expect("what was packed"));
            true
        });
        parts
    }

    /// The scene in these parts.
    fn scene_of(parts: Vec<Part>) -> Scene {
        let mut scene = Scene::default();
        for part in parts {
            match part {
                Part::Read(Some(read), _) => scene = *read,
                Part::Mesh(mesh) => scene.meshes.push(mesh),
                Part::Texture(texture) => scene.textures.push(texture),
                Part::Failed(sentence) => panic!("{sentence}"),
                _ => {}
            }
        }
        scene
    }

    #[test]
    fn scenes_arrive_unchanged() {
        for name in bundled::NAMES {
            let parts = sent(Source::Bundled((*name).to_owned()));
            assert!(matches!(parts.last(), Some(Part::End)), "{name}");
            let scene = bundled::scene(name).expect("a bundled scene");
            for part in &parts {
                match part {
                    Part::Drawable(sight) => {
                        let here = Sight::new(&scene).extent(&[scene.camera]);
                        assert_eq!(sight.extent(&[scene.camera]), here, "{name}");
                    }
                    Part::Prepared(prepared) => {
                        let Prepared { needs, contents } = &**prepared;
                        assert_eq!(needs, &SceneNeeds::of(&scene), "{name}");
                        assert_eq!(*contents, halflight_renderer::scene::SceneContents::of(&scene).0, "{name}");
                    }
                    _ => {}
                }
            }
            assert_eq!(scene_of(parts), scene, "{name}");
        }
    }

    #[test]
    fn an_animated_scene_arrives_as_it_is_in_a_frame() {
        let scene = bundled::scene("motion").expect("a bundled scene");
        let source = Source::Posed(Box::new(Source::Bundled("motion".into())), 7);
        assert_eq!(scene_of(sent(source)), scene.posed(7));
    }

    #[test]
    fn files_light_the_scene_that_is_shown() {
        let map = |radiance: f32| {
            let mut bytes = Vec::new();
            let image = exr::prelude::Image::from_channels(
                (2, 1),
                exr::prelude::SpecificChannels::rgb(|_| (radiance, radiance, radiance)),
            );
            exr::prelude::WritableImage::write(&image)
                .to_buffered(std::io::Cursor::new(&mut bytes))
                .expect("memory takes it");
            vec![File { name: "sky.exr".into(), bytes }]
        };
        let cornell = Source::Bundled("cornell".into());
        let parts = sent(Source::Files(map(2.0), Some(Box::new(cornell))));
        assert!(parts.iter().any(|part| matches!(part, Part::Read(Some(_), found) if found.is_lit)));
        let sky = scene_of(parts).environment.expect("a sky");
        assert_eq!((sky.width, sky.height, sky.texels[0]), (2, 1, [2.0; 3]));
    }

    #[test]
    fn what_cannot_be_read_says_why() {
        let file = File { name: "a.toml".into(), bytes: b"[[model]]\ngenerator = \"x\"\n".to_vec() };
        let parts = sent(Source::Files(vec![file], None));
        assert!(matches!(parts.as_slice(), [Part::Failed(sentence)] if sentence.contains("a.toml")));
        // Nothing follows where nobody wants it.
        let mut count = 0;
        prepare(Source::Bundled("cornell".into()), |_| {
            count += 1;
            false
        });
        assert_eq!(count, 1);
    }
}
