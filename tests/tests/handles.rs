//! Data of animated lights is updated for every pass that reads it, whatever the name of the pass.
#![allow(clippy::unwrap_used)]

use halflight_evaluator::experiment::session::Session;
use halflight_frame_graph::{Gpu, Part};
use halflight_renderer::{
    DirectSource, plan_frame,
    scene::{shadow_view, triangles},
};
use halflight_scenes::{Keyframe, Motion, Scene};
use halflight_shared_shaders::shadow::shadow_map::ShadowMap;
use halflight_tests::{bundled, device, known};

const SIZE: [u32; 2] = [48, 27];
const MAP: u32 = 64;

/// The depth map of the first light in this frame, drawn by a pass that no other code knows.
fn seen_by_the_light(scene: &Scene, frame: u32) -> Vec<u8> {
    let session = Session::new(device(), scene).keep_all();
    let facts = &session.facts;
    let mut plan = plan_frame(facts, known("none"), &Default::default(), SIZE, DirectSource::Rendered).unwrap();
    let map = plan.texture("map_of_the_test", [MAP; 2], Gpu::DEPTH_FORMAT, "what the light sees");
    let run = ShadowMap {
        shadow_view: shadow_view(&mut plan, 0, &facts.shadow_layers[0]),
        vertices: plan.scene_buffer("scene.vertices", "the scene's geometry"),
        alpha_tested: None,
        animated: facts.animated().then(|| plan.changing_scene_buffer("scene.objects", "objects move")),
        triangles: None,
    };
    plan.pass(Part::Technique, "unheard_of", run).because("a new technique reads a light").draw(
        [(triangles::ALL, None)],
        Vec::new(),
        (map, 0),
    );
    let mut frames = session.frames_of_plan(plan, 0).unwrap();
    (0..=frame).for_each(|frame| drop(frames.run(frame).unwrap()));
    frames.read_bytes("map_of_the_test").unwrap().unwrap()
}

#[test]
fn a_pass_of_any_name_follows_a_light_that_moves() {
    const FRAME: u32 = 5;
    let mut scene = bundled("cornell");
    let moved = Keyframe { frame: FRAME, translate: [0.3, -0.2, 0.1], ..Keyframe::default() };
    let motion = Motion { pivot: [0.0; 3], keyframes: vec![Keyframe::default(), moved] };
    scene.moves.lights.push((0, motion));
    let [first, last] = [0, FRAME].map(|frame| seen_by_the_light(&scene, frame));
    assert_ne!(first, last, "the light moved");
    // The static scene with the pose of that frame.
    assert!(last == seen_by_the_light(&scene.posed(FRAME), 0), "the pass saw the light somewhere else");
}
