//! A scene whose camera, lights, settings and size a test changes step by step.

use halflight_frame_graph::{Cause, Changed, CompiledGraph, Continuity, Externals};
use halflight_native::frames::read_texture;
use halflight_renderer::{
    parameters::Settings,
    plan_frame,
    scene::{LIGHTS, SceneBuffers, SceneFacts, SceneMotion, camera_view},
};
use halflight_scenes::{Camera, Light, Scene};

use crate::{device, known};

/// The size that a show begins with, pixels.
pub const SIZE: [u32; 2] = [64, 36];

/// A scene with one graph, which a test changes step by step.
pub struct Show {
    /// The scene as it is now.
    pub scene: Scene,
    /// What plans of it start from.
    pub facts: SceneFacts,
    /// Its plan on the device.
    pub graph: CompiledGraph,
    /// Settings of the next plan.
    pub settings: Settings,
    /// Size of the next plan, pixels.
    pub size: [u32; 2],
    buffers: SceneBuffers,
    technique: &'static str,
    reuses: bool,
    keep_all: bool,
    lights_changed: bool,
}

impl Show {
    /// A scene at [`SIZE`], which runs only passes that are due.
    ///
    /// # Panics
    /// Where the scene cannot be planned.
    pub fn new(scene: &Scene, technique: &'static str, settings: &Settings) -> Self {
        let facts = SceneFacts::of(scene);
        let buffers = SceneBuffers::new(&device().gpu, scene);
        let plan =
            plan_frame(&facts, known(technique), settings, SIZE, Default::default()).expect("the scene is planned");
        buffers.prepare(&device().gpu, scene, &plan).expect("the scene is prepared");
        let externals = Externals { scene: Some(&buffers), ..Default::default() };
        Self {
            graph: CompiledGraph::new(&device().gpu, plan, &externals),
            scene: scene.clone(),
            settings: settings.clone(),
            size: SIZE,
            facts,
            buffers,
            technique,
            reuses: true,
            keep_all: false,
            lights_changed: false,
        }
    }

    /// Whether it runs only passes that are due.
    pub fn reusing(self, reuses: bool) -> Self {
        Self { reuses, ..self }
    }

    /// Gives every texture and buffer memory of its own.
    pub fn keeping_all(mut self) -> Self {
        self.keep_all = true;
        self.graph.replan(
            &device().gpu,
            self.graph.plan().clone(),
            &Externals { scene: Some(&self.buffers), keep_all: true, ..Default::default() },
        );
        self
    }

    /// Plans anew after a change.
    ///
    /// # Panics
    /// Where the scene cannot be planned.
    pub fn replan(&mut self) {
        let plan = plan_frame(&self.facts, known(self.technique), &self.settings, self.size, Default::default());
        let plan = plan.expect("the scene is planned");
        if !self.graph.update(&device().gpu, &plan) {
            let externals = Externals { scene: Some(&self.buffers), keep_all: self.keep_all, ..Default::default() };
            self.graph.replan(&device().gpu, plan, &externals);
        }
    }

    /// Replaces the lights.
    pub fn relight(&mut self, lights: Vec<Light>) {
        self.buffers.relight(&device().gpu, &lights);
        self.scene.lights = lights;
        self.facts = SceneFacts::within(&self.scene, self.facts.extent);
        self.lights_changed = true;
        self.replan();
    }

    /// Runs a frame and returns the bytes of its outputs, in the order of their names.
    ///
    /// # Panics
    /// Where the device was lost.
    pub fn run(&mut self, camera: &Camera, frame: u32) -> Vec<Vec<u8>> {
        let gpu = &device().gpu;
        let mut view = camera_view(camera, self.size, self.facts.near);
        view.frame = frame;
        view.continuity = Continuity::Changing;
        let mut changed = Vec::new();
        if std::mem::take(&mut self.lights_changed) {
            changed.push(LIGHTS);
        }
        if let Some(motion) = SceneMotion::new(&self.scene, &self.buffers, &self.facts) {
            motion.place(&mut view);
            view.world_to_view = camera.view_matrix();
            changed.extend(motion.write(gpu, &self.graph, &view));
        }
        let changed = if self.reuses { Changed::Only(&changed) } else { Changed::Anything };
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        self.graph.record(gpu, &mut encoder, &view, changed);
        gpu.queue.submit([encoder.finish()]);
        let read = |output| read_texture(gpu, self.graph.output(output).expect("an output")).expect("it is read");
        self.graph.plan().outputs.keys().map(|output| read(output)).collect()
    }

    /// Names of the outputs whose bytes differ between two shows after the same frame.
    pub fn differing(&mut self, other: &mut Self, camera: &Camera, frame: u32) -> Vec<&'static str> {
        let [own, others] = [&mut *self, other].map(|show| show.run(camera, frame));
        let names = self.graph.plan().outputs.keys();
        names.zip(own.iter().zip(&others)).filter(|(_, (a, b))| a != b).map(|(name, _)| *name).collect()
    }

    /// The passes that ran in the last frame.
    pub fn ran(&self) -> Vec<(String, Cause)> {
        let names = self.graph.plan().passes.iter().map(|pass| pass.name.clone());
        names.zip(self.graph.causes()).filter_map(|(name, cause)| Some((name, cause?))).collect()
    }
}

/// The lights, of which the one of this index is turned, or moved if it has no direction.
pub fn turned(lights: &[Light], index: usize) -> Vec<Light> {
    let mut lights = lights.to_vec();
    match &mut lights[index] {
        Light::Directional { direction, .. } | Light::Spot { direction, .. } => direction[0] += 0.1,
        Light::Point { position, .. } => position[0] += 0.05,
    }
    lights
}
