//! A scene on a device: frames, their images and their times.

use std::{
    cell::{OnceCell, RefCell},
    collections::HashMap,
    path::{Path, PathBuf},
};

use halflight_frame_graph::{
    Cause, Changed, CompiledGraph, Continuity, Externals, FramePlan, Gpu, Handle, ResourceId, View,
    non_finite::{NonFiniteCheck, ValueCounts},
};
use halflight_native::{
    AdapterChoice, NativeGpu, Refusal,
    frames::{FrameTime, Timing, map, read_buffer, read_texture, run_frame},
    images::{Image, Rgb},
};
use halflight_renderer::{
    DirectSource, PlanInputs, Planner, extra_views,
    gi::Technique,
    parameters::{Settings, Value},
    plan_frame, plan_scene, plan_technique_of_scene, plan_within,
    scene::{BvhError, SceneBuffers, SceneFacts, SceneMotion, camera_view},
    texels::decoder,
};
use halflight_scenes::{DiskFiles, FileSource, Scene, bundled, load_scene};
use halflight_techniques::needs_of_any;
use wgpu::TextureFormat as Format;

use crate::Error;

/// Opens the adapter that `--adapter` names.
///
/// # Errors
/// Where there is no such adapter.
pub fn open_adapter(choice: &str) -> Result<NativeGpu, Error> {
    NativeGpu::open(&AdapterChoice::from(choice)).map_err(|e| Error::BadInput(e.to_string()))
}

/// Reads a scene file or a bare model, or makes the bundled scene of this name. A file comes first.
///
/// # Errors
/// One sentence with the file, the line or key, and the fix.
pub fn open_scene(path: &Path) -> Result<Scene, Error> {
    load(&DiskFiles, path)
}

fn load(files: &dyn FileSource, path: &Path) -> Result<Scene, Error> {
    // A bare name is a bundled scene, unless there is such a file.
    let name =
        path.to_str().filter(|name| !path.is_file() && path.extension().is_none() && !name.contains(['/', '\\']));
    let scene = match name {
        Some(name) => bundled::scene(name),
        None => load_scene(files, path),
    };
    scene.map_err(|e| Error::BadInput(e.to_string()))
}

/// As [`open_scene`], for a command that then writes `out`: no file of the scene is overwritten.
///
/// # Errors
/// As [`open_scene`], and where `out` is a file of the scene, such as a texture.
pub fn open_scene_keeping(path: &Path, out: &Path) -> Result<Scene, Error> {
    let files = RecordedFiles::default();
    let scene = load(&files, path)?;
    let out_file = out.canonicalize();
    let is_out = |read: &PathBuf| out_file.as_ref().is_ok_and(|out| read.canonicalize().is_ok_and(|read| read == *out));
    if files.read.borrow().iter().any(is_out) {
        return Err(Error::BadInput(format!(
            "--out {} is a file of the scene {} and would be overwritten: choose another name",
            out.display(),
            path.display()
        )));
    }
    Ok(scene)
}

/// Files of the disk, with a record of those that were read.
#[derive(Default)]
struct RecordedFiles {
    read: RefCell<Vec<PathBuf>>,
}

impl FileSource for RecordedFiles {
    fn read(&self, path: &Path) -> std::io::Result<Vec<u8>> {
        self.read.borrow_mut().push(path.to_owned());
        DiskFiles.read(path)
    }
}

/// Four channels a pixel, linear, rows from the top.
pub type Texels = Vec<[f32; 4]>;

/// A scene on a device, seen by its camera. Frames of an animated scene show its pose at their number.
pub struct Session<'a> {
    /// The device.
    pub native: &'a NativeGpu,
    /// The scene.
    pub scene: &'a Scene,
    /// What its plans start from.
    pub facts: SceneFacts,
    /// Its buffers on the device, once a plan of it fits.
    buffers: OnceCell<SceneBuffers>,
    /// See [`Session::keep_all`].
    keep_all: bool,
}

/// What to render.
#[derive(Clone, Debug)]
pub struct Request<'a> {
    /// The technique.
    pub technique: &'static Technique,
    /// Settings; those that are missing take their defaults.
    pub settings: Settings,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Seed of every random number.
    pub seed: u32,
    /// Direct light to feed in, one value for each pixel, instead of the rendered one.
    pub direct: Option<&'a [Rgb]>,
}

/// A plan that is ready to run on a device.
pub struct Frames<'a> {
    gpu: &'a Gpu,
    timing: Timing,
    recording: CompiledGraph,
    view: View,
    motion: Option<SceneMotion<'a>>,
}

impl<'a> Session<'a> {
    /// A scene, which is uploaded when the first plan fits the device.
    pub fn new(native: &'a NativeGpu, scene: &'a Scene) -> Self {
        Self { native, scene, facts: SceneFacts::of(scene), buffers: OnceCell::new(), keep_all: false }
    }

    /// Gives every texture and buffer of its frames memory of its own, so that all contents can be read after a frame.
    pub fn keep_all(self) -> Self {
        Self { keep_all: true, ..self }
    }

    /// Bytes of the scene's buffers on the device; 0 before the first plan.
    pub fn scene_bytes(&self) -> u64 {
        self.buffers.get().map_or(0, SceneBuffers::bytes)
    }

    /// A whole frame, ready to run: G-buffer, direct light and the technique.
    ///
    /// # Errors
    /// A setting out of range, or what the device cannot hold: a scene, a size or a setting.
    pub fn frames(&self, request: &Request) -> Result<Frames<'a>, Error> {
        self.frames_of(&self.facts, request)
    }

    /// As [`Session::frames`], with a plan that starts from other facts about the same scene.
    ///
    /// # Errors
    /// As [`Session::frames`].
    pub fn frames_of(&self, facts: &SceneFacts, request: &Request) -> Result<Frames<'a>, Error> {
        let direct = if request.direct.is_some() { DirectSource::Given } else { DirectSource::Rendered };
        self.ready(
            Wanted::of(facts, request),
            &|settings, size| plan_frame(facts, request.technique, settings, size, direct),
            || self.given(request).collect(),
        )
    }

    /// G-buffer and direct light alone, ready to run; many techniques can share what it leaves.
    ///
    /// # Errors
    /// As [`Session::frames`].
    pub fn scene_frames(&self, settings: &Settings, size: [u32; 2]) -> Result<Frames<'a>, Error> {
        let plan = |settings: &Settings, size| {
            let needs = needs_of_any(settings)?;
            plan_scene(&self.facts, needs, settings, size, DirectSource::Rendered)
        };
        self.ready(Wanted { facts: &self.facts, technique: None, settings, size, seed: 0 }, &plan, HashMap::new)
    }

    /// The technique alone, ready to run on what [`Session::scene_frames`] left; a whole frame where surfaces only
    /// receive light, because then the source of indirect light is not the direct light that shows, and where extra
    /// cameras bring G-buffers of their own.
    ///
    /// # Errors
    /// As [`Session::frames`].
    pub fn technique_frames(&self, request: &Request, scene: &Frames) -> Result<Frames<'a>, Error> {
        let extra = extra_views(&self.facts, request.technique, &request.settings);
        if self.facts.needs.receive_only || extra.map_err(|e| Error::BadInput(e.to_string()))? {
            return self.frames(request);
        }
        let found = ["depth", "normal", "albedo", "direct", "material"].into_iter();
        let found = found.filter_map(|name| Some((name, scene.recording.output(name)?.clone())));
        self.ready(
            Wanted::of(&self.facts, request),
            &|settings, size| plan_technique_of_scene(&self.facts, request.technique, settings, size),
            || found.chain(self.given(request)).collect(),
        )
    }

    /// A plan that the caller made or added to, ready to run on this scene. The first frame sees with `seed`.
    ///
    /// # Errors
    /// As [`Session::frames`].
    pub fn frames_of_plan(&self, plan: FramePlan, seed: u32) -> Result<Frames<'a>, Error> {
        let (settings, size) = (Settings::new(), plan.display_size);
        let wanted = Wanted { facts: &self.facts, technique: None, settings: &settings, size, seed };
        self.ready(wanted, &|_, _| Ok(plan.clone()), HashMap::new)
    }

    /// The direct light of a request as a texture.
    fn given(&self, request: &Request) -> impl Iterator<Item = (&'static str, wgpu::Texture)> {
        let direct = request.direct.map(|direct| upload(&self.native.gpu, request.size, direct));
        direct.map(|texture| ("direct", texture)).into_iter()
    }

    fn ready(
        &self,
        wanted: Wanted,
        plan: &Planner,
        textures: impl FnOnce() -> HashMap<&'static str, wgpu::Texture>,
    ) -> Result<Frames<'a>, Error> {
        let Wanted { facts, technique, settings, size, seed } = wanted;
        // Direct light of images and measurements is not rounded, and their textures are read as those of references are,
        // unless that is what is measured.
        let mut settings = settings.clone();
        for (key, value) in [("direct.storage", "float32"), ("gbuffer.texture_filter", "bilinear")] {
            settings.entry(key.to_owned()).or_insert_with(|| Value::parse(value));
        }
        let settings = &settings;
        let gpu = &self.native.gpu;
        let parameters = technique.map(|technique| (technique.parameters)()).unwrap_or_default();
        let inputs = PlanInputs { parameters: &parameters, settings, size };
        let plan = plan_within(&gpu.limits(), facts, inputs, plan).map_err(|e| Error::BadInput(e.to_string()))?;
        let mut view = camera_view(&self.scene.camera, size, self.facts.near);
        view.seed = seed;
        // Between two frames nothing changes unless the scene says so.
        view.continuity = Continuity::Static;
        let make = || {
            let buffers = self.buffers.get_or_init(|| SceneBuffers::new(gpu, self.scene));
            buffers.prepare(gpu, self.scene, &plan)?;
            let externals = Externals { scene: Some(buffers), textures: textures(), keep_all: self.keep_all };
            let motion = SceneMotion::new(self.scene, buffers, &self.facts);
            Ok((CompiledGraph::new(gpu, plan, &externals), motion))
        };
        let made = self.native.refusals(make).map_err(|refusal| match refusal {
            Refusal::Lost => Error::Failed(refusal.to_string()),
            Refusal::Refused(_) => Error::BadInput(format!(
                "{refusal}: make the image smaller, use fewer lights, or lower direct.shadow_map_size"
            )),
        })?;
        let (recording, motion) = made.map_err(|error: BvhError| Error::BadInput(error.to_string()))?;
        // A frame of very many passes has no timestamps.
        let timing = if recording.timing_buffer().is_some() { Timing::of(self.native) } else { Timing::Clock };
        Ok(Frames { gpu, timing, recording, view, motion })
    }
}

/// What frames are made from, apart from the scene's buffers.
struct Wanted<'a> {
    facts: &'a SceneFacts,
    technique: Option<&'static Technique>,
    settings: &'a Settings,
    size: [u32; 2],
    seed: u32,
}

impl<'a> Wanted<'a> {
    fn of(facts: &'a SceneFacts, request: &'a Request) -> Self {
        let &Request { technique, ref settings, size, seed, .. } = request;
        Self { facts, technique: Some(technique), settings, size, seed }
    }
}

impl Frames<'_> {
    /// The plan that runs.
    pub fn plan(&self) -> &FramePlan {
        self.recording.plan()
    }

    /// The view that the last frame was seen from.
    pub fn view(&self) -> &View {
        &self.view
    }

    /// Runs the frame of this number with all passes, except those that run once. A temporal filter goes on from the frame
    /// before where that was the last to run.
    ///
    /// # Errors
    /// Where the device was lost.
    pub fn run(&mut self, frame: u32) -> Result<FrameTime, Error> {
        self.place(frame);
        self.run_after(Changed::Anything)
    }

    /// As [`Frames::run`], with only the passes whose inputs differ from those of the last frame.
    ///
    /// # Errors
    /// Where the device was lost.
    pub fn run_due(&mut self, frame: u32) -> Result<FrameTime, Error> {
        let changed = self.place(frame);
        self.run_after(Changed::Only(&changed))
    }

    /// Moves the scene to a frame; returns what has changed since the last one.
    fn place(&mut self, frame: u32) -> Vec<Handle> {
        self.view.frame = frame;
        let Some(motion) = &self.motion else { return Vec::new() };
        motion.place(&mut self.view);
        motion.write(self.gpu, &self.recording, &self.view)
    }

    fn run_after(&self, changed: Changed) -> Result<FrameTime, Error> {
        run_frame(self.gpu, &self.recording, &self.view, self.timing, changed).map_err(|e| Error::Failed(e.to_string()))
    }

    /// Why each pass ran in the last frame; `None` for passes that did not run.
    pub fn causes(&self) -> Vec<Option<Cause>> {
        self.recording.causes()
    }

    /// An output of the plan as it stands after the last frame: four channels a pixel, linear; `None`
    /// where the plan has no such output.
    ///
    /// # Errors
    /// Where the device was lost.
    pub fn read(&self, output: &str) -> Result<Option<Texels>, Error> {
        let Some(texture) = self.recording.output(output) else { return Ok(None) };
        read_rgba(self.gpu, texture).map(Some)
    }

    /// The first three channels of an output.
    ///
    /// # Errors
    /// Where the device was lost.
    pub fn read_rgb(&self, output: &str) -> Result<Option<Vec<Rgb>>, Error> {
        Ok(self.read(output)?.map(|texels| texels.iter().map(|&[r, g, b, _]| [r, g, b]).collect()))
    }

    /// Every texture of the plan by name, float formats only, to look for what should not be there. Textures whose memory
    /// others have taken over are left out: see [`Session::keep_all`].
    ///
    /// # Errors
    /// Where the device was lost.
    pub fn read_all(&self) -> Result<Vec<(String, Texels)>, Error> {
        let mut all = Vec::new();
        for (index, resource) in self.plan().resources.iter().enumerate() {
            let texture = self.recording.texture(ResourceId(index));
            if let Some(texture) = texture.filter(|t| decoder(t.format()).is_some()) {
                all.push((resource.name.clone(), read_rgba(self.gpu, texture)?));
            }
        }
        Ok(all)
    }

    /// Counts NaN, infinities and clamped values, on the device, in everything that the last frame wrote and that is still
    /// there: see [`Session::keep_all`].
    ///
    /// # Errors
    /// Where the device was lost.
    pub fn scan(&self) -> Result<Vec<ValueCounts>, Error> {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        let scan = NonFiniteCheck::record(self.gpu, &self.recording, &mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        let bytes = map(self.gpu, scan.readable()).map_err(|e| Error::Failed(e.to_string()))?;
        Ok(scan.counts(&bytes))
    }

    /// The plan's texture of this name; `None` where there is no such texture, or another one has taken over its memory.
    pub fn texture(&self, resource: &str) -> Option<&wgpu::Texture> {
        self.recording.texture(self.resource(resource)?)
    }

    /// The plan's buffer of this name; `None` where there is no such buffer, or another one has taken over its memory.
    pub fn buffer(&self, resource: &str) -> Option<&wgpu::Buffer> {
        self.recording.buffer(self.resource(resource)?)
    }

    fn resource(&self, name: &str) -> Option<ResourceId> {
        self.plan().resources.iter().position(|resource| resource.name == name).map(ResourceId)
    }

    /// The bytes of the plan's texture of this name, rows packed without padding; `None` where there
    /// is no such texture.
    ///
    /// # Errors
    /// Where the device was lost.
    pub fn read_bytes(&self, resource: &str) -> Result<Option<Vec<u8>>, Error> {
        let read = |texture| read_texture(self.gpu, texture).map_err(|e| Error::Failed(e.to_string()));
        self.texture(resource).map(read).transpose()
    }

    /// The bytes of the plan's buffer of this name; `None` where there is no such buffer.
    ///
    /// # Errors
    /// Where the device was lost.
    pub fn read_buffer(&self, resource: &str) -> Result<Option<Vec<u8>>, Error> {
        let read = |buffer| read_buffer(self.gpu, buffer).map_err(|e| Error::Failed(e.to_string()));
        self.buffer(resource).map(read).transpose()
    }

    /// Mean of an output over frames `0..count`, and its standard deviation over them, averaged over
    /// pixels and channels.
    ///
    /// # Errors
    /// Where the device was lost, or the plan has no such output.
    pub fn mean_over_frames(&mut self, output: &str, count: u32) -> Result<(Vec<Rgb>, f64), Error> {
        let mut sums: Vec<[f64; 3]> = Vec::new();
        let mut squares = 0.0;
        for frame in 0..count {
            self.run(frame)?;
            let pixels = self
                .read_rgb(output)?
                .ok_or_else(|| Error::Failed(format!("the plan has no output called {output}")))?;
            sums.resize(pixels.len(), [0.0; 3]);
            for (sum, pixel) in sums.iter_mut().zip(&pixels) {
                for (sum, &v) in sum.iter_mut().zip(pixel) {
                    *sum += f64::from(v);
                    squares += f64::from(v) * f64::from(v);
                }
            }
        }
        let n = f64::from(count.max(1));
        let square_of_means: f64 = sums.iter().flatten().map(|sum| (sum / n) * (sum / n)).sum();
        let values = (3 * sums.len()).max(1) as f64;
        let deviation = ((squares / n - square_of_means) / values).max(0.0).sqrt();
        Ok((sums.iter().map(|sum| sum.map(|v| (v / n) as f32)).collect(), deviation))
    }

    /// All outputs as one image with the channels of the interchange format: final radiance, depth,
    /// world normal and position, albedo, direct and indirect light, and transmitted light and ambient visibility where the plan has
    /// them.
    ///
    /// # Errors
    /// Where the device was lost.
    pub fn image(&self) -> Result<Image, Error> {
        let [width, height] = self.view.display_size;
        let mut image = Image::new(width, height);
        for (output, layer) in [("final", ""), ("albedo", "albedo"), ("direct", "direct"), ("indirect", "indirect")] {
            if let Some(pixels) = self.read_rgb(output)? {
                image.set_rgb(layer, &pixels);
            }
        }
        if let Some(passed) = self.read_rgb("transmitted")? {
            image.set_rgb("transmitted", &passed);
        }
        if let Some(open) = self.read("ambient_occlusion")? {
            image.set_channel("ambient_occlusion.Y", open.iter().map(|texel| texel[0]).collect());
        }
        let to_world = self.view.world_to_view.inverse();
        if let (Some(depth), Some(normal)) = (self.read_rgb("depth")?, self.read_rgb("normal")?) {
            let position = depth.iter().enumerate().map(|(i, &[d, ..])| {
                let i = i as u32;
                let uv = [(i % width) as f32 + 0.5, (i / width) as f32 + 0.5];
                let ndc = [2.0 * uv[0] / width as f32 - 1.0, 1.0 - 2.0 * uv[1] / height as f32];
                let [tx, ty] = self.view.tan_half_fov;
                let in_view = glam::Vec3::new(ndc[0] * tx * d, ndc[1] * ty * d, -d);
                if d > 0.0 { to_world.transform_point3(in_view).to_array() } else { [0.0; 3] }
            });
            image.set_vector("P", &position.collect::<Vec<_>>());
            let normal = normal.iter().map(|&n| to_world.transform_vector3(n.into()).to_array());
            image.set_vector("N", &normal.collect::<Vec<_>>());
            image.set_channel("Z", depth.iter().map(|d| d[0]).collect());
        }
        Ok(image)
    }
}

fn read_rgba(gpu: &Gpu, texture: &wgpu::Texture) -> Result<Texels, Error> {
    let format = texture.format();
    let decode =
        decoder(format).ok_or_else(|| Error::Failed(format!("textures of format {format:?} hold no colour")))?;
    let bytes = read_texture(gpu, texture).map_err(|e| Error::Failed(e.to_string()))?;
    let texel = format.block_copy_size(None).unwrap_or(4) as usize;
    Ok(bytes.chunks_exact(texel).map(decode).collect())
}

fn upload(gpu: &Gpu, [width, height]: [u32; 2], pixels: &[Rgb]) -> wgpu::Texture {
    use wgpu::util::DeviceExt;
    let texels: Vec<[f32; 4]> = pixels.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
    gpu.device.create_texture_with_data(
        &gpu.queue,
        &wgpu::TextureDescriptor {
            label: Some("direct"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: Format::Rgba32Float,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        },
        wgpu::util::TextureDataOrder::LayerMajor,
        bytemuck::cast_slice(&texels),
    )
}
