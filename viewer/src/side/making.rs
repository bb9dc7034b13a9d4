//! Making a side, and changing it to other settings.

use halflight_frame_graph::{CompiledGraph, Externals, FramePlan, Gpu};
use halflight_renderer::{
    PlanInputs,
    parameters::{ParameterType, SettingsError},
    plan_frame, plan_within,
    scene::traces_rays,
};
use web_time::Instant;

use super::Side;
use crate::{
    check::Check,
    error::Errors,
    seen::Seen,
    stage::Stage,
    state::Configuration,
    timing::{Method, Times},
};

/// What a side is made from.
#[derive(Clone, Copy)]
pub struct Inputs<'a> {
    /// The scene.
    pub stage: &'a Stage,
    /// The technique and its settings.
    pub configuration: &'a Configuration,
    /// Width and height of the picture, pixels.
    pub size: [u32; 2],
    /// Whether all textures can be shown and checked after a frame.
    pub keep_all: bool,
}

/// The plan of a configuration. The scene has what it needs.
///
/// # Errors
/// A setting out of range, something that the device cannot hold, or no BVH yet.
fn plan(gpu: &Gpu, inputs: Inputs) -> Result<FramePlan, NotMade> {
    let Inputs { stage, configuration, size, .. } = inputs;
    let technique = configuration.technique();
    let mut settings = configuration.settings.clone();
    settings.entry("gbuffer.texture_filter".to_owned()).or_insert_with(|| stage.texture_filter().to_value());
    let settings = &settings;
    let parameters = (technique.parameters)();
    let inputs = PlanInputs { parameters: &parameters, settings, size };
    let plan = plan_within(&gpu.limits(), &stage.facts, inputs, &|settings, size| {
        plan_frame(&stage.facts, technique, settings, size, Default::default())
    })?;
    match stage.has_bvh() {
        Ok(false) if traces_rays(&plan) => Err(NotMade::Waits),
        Err(error) if traces_rays(&plan) => Err(SettingsError(error.to_string()).into()),
        _ => Ok(plan),
    }
}

/// Why a side cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum NotMade {
    /// It traces rays, and the BVH of the scene is not there yet.
    #[error("Building the BVH…")]
    Waits,
    /// A setting is out of range, or the device or the scene cannot do it.
    #[error("{0}")]
    Refused(#[from] SettingsError),
}

impl Side {
    /// Plans a configuration and creates its resources.
    ///
    /// # Errors
    /// A setting out of range, something that the device cannot hold, or no BVH yet.
    pub fn new(gpu: &Gpu, inputs: Inputs) -> Result<Self, NotMade> {
        let Inputs { stage, configuration, keep_all, .. } = inputs;
        let begun = Instant::now();
        let plan = plan(gpu, inputs)?;
        let planned = begun.elapsed();
        let externals = Externals { scene: Some(&stage.buffers), keep_all, ..Default::default() };
        let graph = CompiledGraph::new(gpu, plan, &externals);
        let compiled = begun.elapsed();
        let made_in = [planned, compiled - planned].map(|time| time.as_secs_f64() * 1e3);
        let method = match gpu.timestamp_period {
            _ if stage.software => Method::Software,
            // A frame of very many passes has no timestamps.
            Some(_) if graph.timing_buffer().is_some() => Method::Timestamps,
            _ => Method::NoTimestamps,
        };
        Ok(Self {
            configuration: configuration.clone(),
            times: Times::new(&graph, method),
            graph,
            moment: None,
            lights: Vec::new(),
            shown: None,
            show: None,
            old: Vec::new(),
            texture: None,
            drawing: None,
            smoothing: None,
            samples: 0,
            timestamps: None,
            round: None,
            method,
            frames_left: 0,
            unfiltered: 0,
            drawn_frames: 0,
            drawn: false,
            indirect: None,
            light: None,
            errors: Errors::default(),
            seen: Seen::default(),
            compared_with: 0,
            frame_ms: None,
            check: Check::default(),
            made_in,
        })
    }

    /// Updates the side after a change of settings, size or lights; true if anything changed.
    ///
    /// # Errors
    /// As for [`Side::new`]. The side then stays as it was.
    fn update(&mut self, gpu: &Gpu, inputs: Inputs) -> Result<bool, NotMade> {
        let Inputs { stage, configuration, keep_all, .. } = inputs;
        let new = plan(gpu, inputs)?;
        self.configuration.clone_from(configuration);
        let shares = !keep_all;
        if new == *self.graph.plan() && shares == self.graph.shares_memory() {
            return Ok(false);
        }
        self.round = None;
        (self.moment, self.drawn) = (None, false);
        self.check = Check::default();
        if shares == self.graph.shares_memory() && self.graph.update(gpu, &new) {
            return Ok(true);
        }
        // A temporal filter keeps its history under the new settings.
        let scene = Externals { scene: Some(&stage.buffers), keep_all, ..Default::default() };
        self.graph.replan(gpu, new, &scene);
        self.times = Times::new(&self.graph, self.method);
        self.old.extend(self.show.take());
        (self.shown, self.timestamps) = (None, None);
        Ok(true)
    }

    /// Creates or updates the side in a slot; true if anything changed.
    ///
    /// # Errors
    /// As for [`Side::new`]. What was in the slot then stays.
    pub fn bring_up(slot: &mut Option<Self>, gpu: &Gpu, inputs: Inputs) -> Result<bool, NotMade> {
        match slot {
            Some(side) => side.update(gpu, inputs),
            None => {
                *slot = Some(Self::new(gpu, inputs)?);
                Ok(true)
            }
        }
    }

    /// Frees what earlier passes of the interface have painted. Call it before anything is painted in a pass: the picture
    /// that was painted in the last one is submitted after that pass, and must exist until then.
    pub fn free_old(&mut self) {
        self.old.drain(..).for_each(CompiledGraph::destroy);
    }

    /// Frees its resources on the device. As for [`Side::free_old`], nothing of it may be painted in the same pass.
    pub fn destroy(mut self) {
        self.free_old();
        self.graph.destroy();
        self.show.into_iter().for_each(CompiledGraph::destroy);
    }
}
