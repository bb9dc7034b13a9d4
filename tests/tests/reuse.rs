//! Passes whose inputs are as before do not run again, and no picture differs for it.
#![allow(clippy::unwrap_used)]

use halflight_frame_graph::{
    Cause, Changed, CompiledGraph, Continuity, Dependency, Externals, FramePlan, Handle, Part, When,
};
use halflight_native::frames::read_texture;
use halflight_renderer::{
    parameters::Settings,
    plan_frame,
    scene::{LIGHTS, SceneBuffers, SceneFacts, SceneMotion, camera_view},
};
use halflight_scenes::{Camera, Light, Scene};
use halflight_techniques::TECHNIQUES;
use halflight_tests::{bundled, device, known, settings};

const SIZE: [u32; 2] = [64, 36];

/// A scene with one graph, which a test changes step by step.
struct Show {
    scene: Scene,
    facts: SceneFacts,
    buffers: SceneBuffers,
    graph: CompiledGraph,
    technique: &'static str,
    settings: Settings,
    size: [u32; 2],
    reuses: bool,
    lights_changed: bool,
}

impl Show {
    fn new(scene: &Scene, technique: &'static str, settings: &Settings, reuses: bool) -> Self {
        let (facts, buffers) = (SceneFacts::of(scene), SceneBuffers::new(&device().gpu, scene));
        let plan = plan_frame(&facts, known(technique), settings, SIZE, Default::default()).unwrap();
        buffers.prepare(&device().gpu, scene, &plan).unwrap();
        let externals = Externals { scene: Some(&buffers), ..Default::default() };
        let graph = CompiledGraph::new(&device().gpu, plan, &externals);
        let (scene, settings) = (scene.clone(), settings.clone());
        Self { scene, facts, buffers, graph, technique, settings, size: SIZE, reuses, lights_changed: false }
    }

    fn plan(&self) -> FramePlan {
        plan_frame(&self.facts, known(self.technique), &self.settings, self.size, Default::default()).unwrap()
    }

    fn replan(&mut self) {
        let plan = self.plan();
        if !self.graph.update(&device().gpu, &plan) {
            let externals = Externals { scene: Some(&self.buffers), ..Default::default() };
            self.graph.replan(&device().gpu, plan, &externals);
        }
    }

    fn relight(&mut self, lights: Vec<Light>) {
        self.buffers.relight(&device().gpu, &lights);
        self.scene.lights = lights;
        self.facts = SceneFacts::within(&self.scene, self.facts.extent);
        self.lights_changed = true;
        self.replan();
    }

    /// Runs a frame and returns its images.
    fn run(&mut self, camera: &Camera, frame: u32) -> Vec<Vec<u8>> {
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
        let outputs = self.graph.plan().outputs.keys();
        outputs.map(|output| read_texture(gpu, self.graph.output(output).unwrap()).unwrap()).collect()
    }

    /// The passes that ran in the last frame.
    fn ran(&self) -> Vec<(String, Cause)> {
        let names = self.graph.plan().passes.iter().map(|pass| pass.name.clone());
        names.zip(self.graph.causes()).filter_map(|(name, cause)| Some((name, cause?))).collect()
    }
}

/// The lights, of which the one of this index is turned, or moved if it has no direction.
fn turned(lights: &[Light], index: usize) -> Vec<Light> {
    let mut lights = lights.to_vec();
    match &mut lights[index] {
        Light::Directional { direction, .. } | Light::Spot { direction, .. } => direction[0] += 0.1,
        Light::Point { position, .. } => position[0] += 0.05,
    }
    lights
}

#[test]
fn pictures_are_equal_with_and_without_reuse() {
    let filter = |technique: &str| match technique {
        "hierarchical" => {
            settings("hierarchical", &[("temporal_weight", "0.9"), ("bounces", "2"), ("visibility", "auto")])
        }
        _ => settings("direct", &[("shadow_map_size", "256")]),
    };
    for (scene, techniques) in
        [("motion", vec!["hierarchical", "hybrid"]), ("lights", TECHNIQUES.iter().map(|t| t.name).collect())]
    {
        let scene = bundled(scene);
        for technique in techniques.into_iter().filter(|&name| name != "exhaustive") {
            let settings = filter(technique);
            let [mut reuses, mut anew] = [true, false].map(|reuses| Show::new(&scene, technique, &settings, reuses));
            let mut camera = scene.camera;
            let same = |reuses: &mut Show, anew: &mut Show, camera: &Camera, frame: u32, step: &str| {
                let [a, b] = [reuses.run(camera, frame), anew.run(camera, frame)];
                let names: Vec<_> = reuses.graph.plan().outputs.keys().collect();
                let differs = names.iter().zip(a.iter().zip(&b)).filter(|(_, (a, b))| a != b).map(|(name, _)| name);
                assert_eq!(
                    differs.collect::<Vec<_>>(),
                    Vec::<&&&str>::new(),
                    "{technique}: {step}; ran {:?}",
                    reuses.ran()
                );
            };
            same(&mut reuses, &mut anew, &camera, 0, "the first frame");
            same(&mut reuses, &mut anew, &camera, 0, "the same frame again");
            same(&mut reuses, &mut anew, &camera, 1, "the next frame");
            camera.eye[0] += 0.05;
            same(&mut reuses, &mut anew, &camera, 2, "a moved camera");
            for index in 0..scene.lights.len() {
                for show in [&mut reuses, &mut anew] {
                    show.relight(turned(&show.scene.lights, index));
                }
                same(&mut reuses, &mut anew, &camera, 3 + index as u32, "another light");
            }
            same(&mut reuses, &mut anew, &camera, 10, "a jump in time");
            same(&mut reuses, &mut anew, &camera, 11, "the frame after it");
            for show in [&mut reuses, &mut anew] {
                show.settings
                    .insert("direct.shadow_map_size".into(), halflight_renderer::parameters::Value::parse("128"));
                show.replan();
            }
            same(&mut reuses, &mut anew, &camera, 12, "another setting");
            for show in [&mut reuses, &mut anew] {
                show.size = [50, 41];
                show.replan();
            }
            same(&mut reuses, &mut anew, &camera, 13, "another size");
            same(&mut reuses, &mut anew, &camera, 13, "and again");
        }
    }
}

#[test]
fn a_static_scene_draws_no_surface_and_no_shadow_again() {
    let scene = bundled("lights");
    for technique in ["none", "rsm"] {
        let mut show = Show::new(&scene, technique, &settings("direct", &[("shadow_map_size", "128")]), true);
        show.run(&scene.camera, 0);
        assert!(show.ran().iter().all(|(_, cause)| *cause == Cause::First));
        assert_eq!(show.ran().len(), show.graph.plan().passes.len());
        show.run(&scene.camera, 0);
        assert_eq!(show.ran(), [], "{technique}: nothing has changed");
        show.run(&scene.camera, 1);
        let part = |name: &str| ["gbuffer", "direct", "shadow_"].iter().any(|scene| name.starts_with(scene));
        let again: Vec<_> = show.ran().into_iter().filter(|(name, _)| part(name)).collect();
        assert_eq!(again, [], "{technique}: only the frame number has changed");
    }
}

#[test]
fn a_turned_light_redraws_its_own_maps_alone() {
    let scene = bundled("lights");
    let facts = SceneFacts::of(&scene);
    let kinds = |of: fn(&Light) -> bool| scene.lights.iter().filter(|light| of(light)).count();
    assert!(
        kinds(|light| matches!(light, Light::Point { .. })) > 0
            && kinds(|light| matches!(light, Light::Spot { .. })) > 0
    );
    for index in 0..scene.lights.len() {
        let mut show = Show::new(&scene, "none", &settings("direct", &[("shadow_map_size", "128")]), true);
        show.run(&scene.camera, 0);
        show.relight(turned(&scene.lights, index));
        show.run(&scene.camera, 0);
        let layers = facts.shadow_layers.iter().enumerate().filter(|(_, layer)| layer.light == index as u32);
        let mut wanted: Vec<_> = layers.map(|(layer, _)| format!("shadow_{layer}")).collect();
        wanted.push("direct".into());
        let mut names: Vec<_> = show.ran().into_iter().map(|(name, _)| name).collect();
        names.sort_by_key(|name| name == "direct");
        assert_eq!(names, wanted, "light {index}: {:?}", show.ran());
        let cause = show.ran().into_iter().find(|(name, _)| *name == wanted[0]).unwrap().1;
        assert!(matches!(cause, Cause::Changed(Dependency::Handle(Handle { kind: "light_view", .. }))), "{cause:?}");
    }
}

#[test]
fn a_plan_says_when_each_pass_runs() {
    let when = |scene: &Scene, technique: &'static str, pass: &str| {
        let plan =
            plan_frame(&SceneFacts::of(scene), known(technique), &Settings::new(), SIZE, Default::default()).unwrap();
        let index = plan.passes.iter().position(|own| own.name == pass).unwrap();
        plan.schedule()[index].clone()
    };
    let atrium = bundled("atrium");
    let light_view = Dependency::Handle(Handle { kind: "light_view", index: 0 });
    assert_eq!(when(&atrium, "none", "gbuffer"), When::Changed(vec![Dependency::Camera]));
    assert_eq!(when(&atrium, "none", "shadow_0"), When::Changed(vec![light_view]));
    assert_eq!(when(&atrium, "hybrid", "scene_voxels"), When::Once);
    assert_eq!(when(&atrium, "hybrid", "gather"), When::EveryFrame(Dependency::Frame));
    let motion = bundled("motion");
    let shadow = when(&motion, "none", "shadow_0").to_string();
    assert_eq!(shadow, "when this changes: light_view 0, scene.objects");
}

#[test]
fn nothing_is_planned_where_no_light_is_taken() {
    let scene = bundled("bars_sky");
    let facts = SceneFacts::of(&scene);
    let plan = |technique, settings: &Settings| {
        plan_frame(&facts, known(technique), settings, SIZE, Default::default()).unwrap()
    };
    let of_technique = |plan: &FramePlan| plan.passes.iter().filter(|pass| pass.part == Part::Technique).count();
    let without_sky = settings("hierarchical", &[("sky_rays", "0")]);
    for technique in ["hierarchical", "ssdo", "rsm", "exhaustive"] {
        let dark = plan(technique, &without_sky);
        assert_eq!(of_technique(&dark), 0, "{technique}");
        assert_eq!(dark.outputs["final"], dark.outputs["direct"]);
    }
    let reason = "hierarchical plans no pass, because the scene has no light that it takes";
    assert!(plan("hierarchical", &without_sky).notes.iter().any(|note| note == reason));
    assert!(of_technique(&plan("hierarchical", &settings("hierarchical", &[("sky_rays", "1")]))) > 3);
    // Ambient visibility needs no light.
    for technique in ["gtao", "ssao"] {
        assert!(of_technique(&plan(technique, &Settings::new())) > 0, "{technique}");
    }
}
