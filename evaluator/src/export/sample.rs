//! Inputs and results of an exported plan, with which the author of a player checks it.

use std::collections::BTreeMap;

use halflight_frame_graph::{Changed, CompiledGraph, Continuity, Externals, FramePlan, View};
use halflight_native::{
    NativeGpu,
    frames::{Timing, read_texture, run_frame},
};
use halflight_output::OutputFolder;
use halflight_renderer::parameters::Settings;
use halflight_scenes::Scene;
use serde::Serialize;

use super::{INPUTS, format_name};
use crate::{Error, experiment::session::Session};

/// What sample.json says.
#[derive(Clone, Debug, Serialize)]
pub struct Sample {
    /// Name of the scene.
    pub scene: String,
    /// Adapter that computed the results.
    pub adapter: String,
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Seed of random numbers.
    pub seed: u32,
    /// Formats of the inputs and results, by name. Files hold texels row by row without padding.
    pub formats: BTreeMap<String, String>,
    /// Frames in order.
    pub frames: Vec<Frame>,
}

/// One frame of a sample.
#[derive(Clone, Debug, Serialize)]
pub struct Frame {
    /// Its number.
    pub number: u32,
    /// The camera.
    pub camera: Camera,
    /// Files of the inputs. An input that is as before has the same file.
    pub inputs: BTreeMap<String, String>,
    /// Files of the results.
    pub outputs: BTreeMap<String, String>,
}

/// The camera of a frame.
#[derive(Clone, Debug, Serialize)]
pub struct Camera {
    /// World to view space, column by column.
    pub world_to_view: [f32; 16],
    /// Tangents of half the field of view, horizontal and vertical.
    pub tan_half_fov: [f32; 2],
    /// Distance of the near plane, scene units.
    pub near: f32,
    /// Whether no history may be used.
    pub cut: bool,
    /// Whether scene and light are as in the frame before.
    pub unchanged: bool,
}

impl Camera {
    fn of(view: &View) -> Self {
        Self {
            world_to_view: view.world_to_view.to_cols_array(),
            tan_half_fov: view.tan_half_fov,
            near: view.near,
            cut: view.continuity == Continuity::Cut,
            unchanged: view.continuity == Continuity::Static,
        }
    }
}

/// Renders the first frames of a scene, plays the plan on its G-buffer and writes both: `sample.json` and raw texels.
///
/// # Errors
/// What the device cannot hold, and files that cannot be written.
pub fn write_sample(
    native: &NativeGpu,
    scene: &Scene,
    plan: &FramePlan,
    count: u32,
    folder: &OutputFolder,
) -> Result<Sample, Error> {
    let lost = |error: halflight_native::DeviceError| Error::Failed(error.to_string());
    let session = Session::new(native, scene);
    let mut rendered = session.scene_frames(&Settings::new(), plan.display_size)?;
    let mut graph = None;
    let mut formats = BTreeMap::new();
    let mut last: BTreeMap<String, (String, Vec<u8>)> = BTreeMap::new();
    let mut frames = Vec::new();
    for number in 0..count {
        rendered.run(number)?;
        let textures: Vec<(&'static str, wgpu::Texture)> = INPUTS
            .into_iter()
            .filter_map(|(name, ..)| {
                let id = rendered.plan().outputs.get(name)?;
                Some((name, rendered.texture(&rendered.plan().resources[id.0].name)?.clone()))
            })
            .collect();
        let mut write = |name: &str, texture: &wgpu::Texture| {
            formats.insert(name.to_owned(), format_name(texture.format()));
            let bytes = read_texture(&native.gpu, texture).map_err(lost)?;
            if let Some((file, _)) = last.get(name).filter(|(_, before)| *before == bytes) {
                return Ok(file.clone());
            }
            let file = format!("sample_{number}_{name}.bin");
            let path = folder.claim(&file)?;
            std::fs::write(&path, &bytes).map_err(|error| Error::unwritable(&path, error))?;
            last.insert(name.to_owned(), (file.clone(), bytes));
            Ok::<_, Error>(file)
        };
        let inputs = textures.iter().map(|(name, texture)| Ok(((*name).to_owned(), write(name, texture)?)));
        let inputs = inputs.collect::<Result<_, Error>>()?;
        let graph = graph.get_or_insert_with(|| {
            let externals = Externals { textures: textures.iter().cloned().collect(), ..Default::default() };
            CompiledGraph::new(&native.gpu, plan.clone(), &externals)
        });
        run_frame(&native.gpu, graph, rendered.view(), Timing::Clock, Changed::Anything).map_err(lost)?;
        let outputs =
            super::outputs(plan).into_iter().filter_map(|output| Some((output.name, graph.output(output.name)?)));
        let outputs = outputs.map(|(name, texture)| Ok((name.to_owned(), write(name, texture)?)));
        let outputs = outputs.collect::<Result<_, Error>>()?;
        frames.push(Frame { number, camera: Camera::of(rendered.view()), inputs, outputs });
    }
    let sample = Sample {
        scene: scene.name.clone(),
        adapter: native.info.name.clone(),
        size: plan.display_size,
        seed: 0,
        formats,
        frames,
    };
    let path = folder.claim("sample.json")?;
    let text = serde_json::to_string_pretty(&sample).map_err(|error| Error::Failed(error.to_string()))?;
    std::fs::write(&path, text + "\n").map_err(|error| Error::unwritable(&path, error))?;
    Ok(sample)
}
