//! Passes whose inputs are as before do not run again, and no picture differs for it.
#![allow(clippy::unwrap_used)]

use halflight_frame_graph::{Cause, Dependency, FramePlan, Handle, Part, When};
use halflight_renderer::{parameters::Settings, plan_frame, scene::SceneFacts};
use halflight_scenes::{Camera, Light, Scene};
use halflight_techniques::TECHNIQUES;
use halflight_tests::{
    bundled, known, settings,
    show::{SIZE, Show, turned},
};

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
            let [mut reuses, mut anew] =
                [true, false].map(|reuses| Show::new(&scene, technique, &settings).reusing(reuses));
            let mut camera = scene.camera;
            let same = |reuses: &mut Show, anew: &mut Show, camera: &Camera, frame: u32, step: &str| {
                let differing = reuses.differing(anew, camera, frame);
                assert_eq!(differing, [""; 0], "{technique}: {step}; ran {:?}", reuses.ran());
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

/// A directional, a spot and a point light over the corner of `lights`, with one, one and six views.
fn three_lights() -> Scene {
    let mut scene = bundled("lights");
    let kept = [0, 1, 3].map(|index| scene.lights[index]);
    scene.lights = kept.to_vec();
    scene
}

/// Passes that draw a shadow map or a reflective shadow map.
fn maps(ran: &[(String, Cause)]) -> Vec<&str> {
    let draws = |name: &str| ["shadow_", "light_view_", "lit_surfaces_"].iter().any(|of_map| name.starts_with(of_map));
    ran.iter().map(|(name, _)| name.as_str()).filter(|name| draws(name)).collect()
}

/// Techniques with reflective shadow maps, and settings that use them in every way.
fn with_maps() -> [(&'static str, Settings); 5] {
    let small = ("direct.shadow_map_size", "128");
    let hybrid = |more: &[(&str, &str)]| settings("hybrid", &[&[small, ("voxel_resolution", "32")], more].concat());
    [
        ("rsm", settings("rsm", &[small])),
        ("hybrid", hybrid(&[])),
        ("hybrid", hybrid(&[("weighting", "pattern"), ("specular", "both"), ("ambient_occlusion", "both")])),
        ("hierarchical", settings("hierarchical", &[small, ("sources", "lights"), ("voxel_resolution", "32")])),
        ("hierarchical", settings("hierarchical", &[small, ("sources", "both"), ("light_visibility", "off")])),
    ]
}

#[test]
fn one_of_three_lights_draws_its_own_maps_alone() {
    let scene = three_lights();
    // Views of each light.
    let views: [std::ops::Range<u32>; 3] = [0..1, 1..2, 2..8];
    for (technique, settings) in with_maps() {
        let mut show = Show::new(&scene, technique, &settings);
        show.run(&scene.camera, 0);
        assert_eq!(maps(&show.ran()).len(), 3 * 8, "{technique}: all maps of the first frame");
        for frame in 1..3 {
            show.run(&scene.camera, frame);
            assert_eq!(maps(&show.ran()), [""; 0], "{technique} {settings:?}: only the frame number has changed");
        }
        for (index, views) in views.iter().enumerate() {
            show.relight(turned(&show.scene.lights, index));
            show.run(&scene.camera, 3 + index as u32);
            let shadows = views.clone().map(|view| format!("shadow_{view}"));
            let surfaces =
                views.clone().flat_map(|view| [format!("light_view_{view}"), format!("lit_surfaces_{view}")]);
            let expected: Vec<_> = shadows.chain(surfaces).collect();
            assert_eq!(maps(&show.ran()), expected, "{technique} {settings:?}: light {index}");
        }
        // Brightness does not change the shadow map. The views share the texture of visible triangles.
        let mut lights = show.scene.lights.clone();
        if let Light::Spot { intensity, .. } = &mut lights[1] {
            intensity[0] *= 0.5;
        }
        show.relight(lights);
        show.run(&scene.camera, 6);
        assert_eq!(maps(&show.ran()), ["light_view_1", "lit_surfaces_1"], "{technique} {settings:?}");
    }
}

#[test]
fn pictures_are_equal_if_single_lights_turn() {
    let scene = three_lights();
    for (technique, settings) in with_maps() {
        let [mut reuses, mut anew] =
            [true, false].map(|reuses| Show::new(&scene, technique, &settings).reusing(reuses));
        for frame in 0..5 {
            // The lights take turns, and one frame of four is static.
            if frame % 4 != 3 {
                for show in [&mut reuses, &mut anew] {
                    show.relight(turned(&show.scene.lights, frame % 4));
                }
            }
            let [a, b] = [&mut reuses, &mut anew].map(|show| show.run(&scene.camera, frame as u32));
            assert!(a == b, "{technique} {settings:?}: frame {frame}; ran {:?}", reuses.ran());
        }
    }
}

#[test]
fn maps_of_many_lights_share_their_textures() {
    let mut scene = three_lights();
    let point = scene.lights[2];
    let facts = |scene: &Scene| SceneFacts::of(scene);
    let plan = |scene: &Scene| {
        plan_frame(&facts(scene), known("rsm"), &settings("rsm", &[]), SIZE, Default::default()).unwrap()
    };
    let bytes = |plan: &FramePlan| -> u64 {
        let maps = plan.resources.iter().filter(|resource| resource.name.starts_with("light_view_"));
        maps.map(halflight_frame_graph::Resource::bytes).sum()
    };
    // 32 bytes a texel for each of eight views, and triangles and depth of one; 80 bytes a view for its matrix.
    assert_eq!(bytes(&plan(&scene)), 256 * 256 * (8 * 32 + 8) + 8 * 80);
    scene.lights = vec![point; 64];
    let many = plan(&scene);
    assert_eq!(bytes(&many), 256 * 256 * (32 + 8) + 384 * 80);
    let shared = many.resources.iter().find(|resource| resource.name == "light_view_light").unwrap();
    assert!(shared.reason.contains("all 384 views share it"), "{}", shared.reason);
}

#[test]
fn a_static_scene_draws_no_surface_and_no_shadow_again() {
    let scene = bundled("lights");
    for technique in ["none", "rsm"] {
        let mut show = Show::new(&scene, technique, &settings("direct", &[("shadow_map_size", "128")]));
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
        let mut show = Show::new(&scene, "none", &settings("direct", &[("shadow_map_size", "128")]));
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
