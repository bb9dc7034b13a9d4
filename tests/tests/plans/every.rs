//! What holds of every plan: shaders, constants, reads and writes, and each shader used by one.

use std::collections::BTreeSet;

use halflight_frame_graph::{FramePlan, Pass, Resource, ResourceId, ResourceKind, Work};
use halflight_scenes::{Environment, Light, Scene};
use halflight_shared_shaders::{Binding, BindingKind, SHADERS, Shader};
use halflight_soundness::scenes;

use super::*;

/// Scenes that ask for every combination of G-buffer and direct light variants.
fn needs() -> Vec<Scene> {
    let mut all = Vec::new();
    for bits in 0..128 {
        let mut scene = scenes::court();
        let on = |bit: u32| bits >> bit & 1 == 1;
        scene.materials[0].emission = [f32::from(u8::from(on(0))); 3];
        scene.materials[0].albedo_texture = on(1).then_some(0);
        scene.materials[1].alpha_texture = on(2).then_some(0);
        if on(3) {
            scene.lights.push(Light::Point { position: [0.0; 3], intensity: [1.0; 3] });
        }
        if on(4) {
            scene.lights.remove(0);
        }
        if on(5) {
            move_first_mesh(&mut scene);
        }
        scene.materials[0].receive_only = on(6);
        all.push(scene);
    }
    all.push(Scene::default());
    all
}

/// Every combination of the values that change a plan.
fn technique_plans() -> Vec<FramePlan> {
    let scene = scenes::court();
    let mut all = Vec::new();
    for size in [[1, 1], [3, 1], [1, 9], [64, 36], [1279, 717]] {
        all.push(plan(&scene, "exhaustive", &[], size));
        all.extend(slice_plans(&scene, size));
        all.extend(slice_plans(&Scene { environment: Some(Environment::constant([1.0; 3])), ..scene.clone() }, size));
        for start_resolution in ["full", "half", "quarter"] {
            for levels in ["1", "2", "4", "8"] {
                for storage in ["float16", "float32"] {
                    for only_level in ["all", "0", "1", "3", "7"] {
                        if only_level.parse().is_ok_and(|level: u32| level >= levels.parse().unwrap()) {
                            continue;
                        }
                        let values = [
                            ("start_resolution", start_resolution),
                            ("levels", levels),
                            ("storage", storage),
                            ("only_level", only_level),
                        ];
                        for extra in [
                            ("temporal_a", "0"),
                            ("temporal_a", "0.999"),
                            ("visibility", "solid"),
                            ("visibility", "surface"),
                            ("visibility", "auto"),
                            ("bounces", "0"),
                            ("bounces", "2"),
                            ("bounces", "8"),
                        ] {
                            let values = [&values[..], &[extra]].concat();
                            all.push(plan(&scene, "hierarchical", &values, size));
                        }
                    }
                }
            }
        }
    }
    all
}

/// Plans of the techniques that walk along slices.
fn slice_plans(scene: &Scene, size: [u32; 2]) -> Vec<FramePlan> {
    let mut all = Vec::new();
    for resolution in ["full", "half"] {
        for denoise in ["0", "2"] {
            let common = [("resolution", resolution), ("denoise", denoise)];
            all.push(plan(scene, "gtao", &common, size));
            for storage in ["float16", "float32"] {
                all.push(plan(scene, "horizon", &[&common[..], &[("storage", storage)]].concat(), size));
            }
            for finds in ["light", "occlusion"] {
                let common = [&common[..], &[("finds", finds)]].concat();
                all.push(plan(scene, "ray-march", &common, size));
                for more in [("sectors", "32"), ("sectors", "128"), ("feedback", "0.9"), ("temporal_a", "0.9")] {
                    all.push(plan(scene, "bitmask", &[&common[..], &[more]].concat(), size));
                }
            }
        }
    }
    all
}

/// Plans of the techniques that see the scene as its lights do, and of what these are compared with.
fn light_space_plans(scene: &Scene) -> Vec<FramePlan> {
    let hybrid = [
        &[][..],
        &[("sources", "screen")],
        &[("sources", "lights"), ("storage", "float32")],
        &[("visibility", "off"), ("start_resolution", "full"), ("temporal_a", "0.9")],
        &[("sources", "lights"), ("visibility", "off")],
        &[("recompute_below", "0.1")],
        &[("recompute_below", "0.1"), ("sources", "screen"), ("storage", "float32")],
        &[("weighting", "pattern"), ("ambient_occlusion", "both")],
        &[("weighting", "pattern"), ("visibility", "off")],
        &[("weighting", "published"), ("sources", "lights"), ("storage", "float32"), ("ambient_occlusion", "screen")],
        &[("weighting", "published"), ("sources", "screen"), ("specular", "both"), ("ambient_occlusion", "both")],
        &[("weighting", "pattern"), ("sources", "lights"), ("specular", "screen"), ("temporal_a", "0.9")],
    ];
    let mut all: Vec<_> = hybrid.into_iter().map(|values| plan(scene, "hybrid", values, SIZE)).collect();
    let hierarchical = [
        &[("sources", "lights")][..],
        &[("sources", "both"), ("temporal_a", "0.9")],
        &[("sources", "lights"), ("light_visibility", "off"), ("visibility", "auto")],
        &[("sources", "both"), ("light_visibility", "off"), ("visibility", "auto"), ("only_level", "1")],
        &[("sources", "lights"), ("bounces", "2"), ("visibility", "auto"), ("visibility_bounces", "first")],
    ];
    all.extend(hierarchical.map(|values| plan(scene, "hierarchical", values, SIZE)));
    all.extend(["rsm", "ssdo", "ssao"].map(|technique| plan(scene, technique, &[], SIZE)));
    // In an unlit scene the lights' views bring nothing; what frames prepare for techniques is there all the same.
    all.retain(|plan| plan.outputs.contains_key("indirect") || plan.outputs.contains_key("ambient_occlusion"));
    all
}

/// Plans of the radiance cache: with and without lights, sky and animation.
fn cache_plans(scene: &Scene) -> Vec<FramePlan> {
    let open = Scene { environment: Some(Environment::constant([1.0; 3])), ..scene.clone() };
    let mut all = Vec::new();
    for start_resolution in ["full", "half", "quarter"] {
        for storage in ["float16", "float32"] {
            let values = [("start_resolution", start_resolution), ("storage", storage)];
            all.push(plan(&open, "radiance-cache", &values, SIZE));
            all.push(plan(scene, "radiance-cache", &[&values[..], &[("bounces", "1")]].concat(), SIZE));
        }
    }
    all.retain(|plan| plan.outputs.contains_key("indirect"));
    all
}

fn every_plan() -> Vec<FramePlan> {
    let scenes = needs();
    let plans = |extra: &'static [(&'static str, &'static str)]| {
        let plan = move |scene| plan(scene, "hierarchical", extra, SIZE);
        scenes.iter().map(plan)
    };
    let mut polished = scenes::court();
    polished.materials[0].specular = [0.5; 3];
    let glossy = ["float16", "float32"].into_iter().flat_map(|storage| {
        ["off", "auto"].map(|visibility| {
            let values = [("glossy", "on"), ("storage", storage), ("visibility", visibility), ("bounces", "2")];
            plan(&polished, "hierarchical", &values, SIZE)
        })
    });
    let mut glossy: Vec<_> = glossy.collect();
    // With one, two and no lights.
    for lights in [1, 2, 0] {
        polished.lights = vec![scenes::sun(); lights];
        glossy.extend(["screen", "both"].into_iter().flat_map(|specular| {
            let values = [("specular", specular), ("ambient_occlusion", "both"), ("temporal_a", "0.9")];
            ["radiometric", "pattern", "published"]
                .map(|weighting| plan(&polished, "hybrid", &[&values[..], &[("weighting", weighting)]].concat(), SIZE))
        }));
    }
    let open = Scene { environment: Some(Environment::constant([1.0; 3])), ..scenes::court() };
    for bounces in ["1", "2"] {
        glossy.push(plan(&open, "hierarchical", &[("bounces", bounces)], SIZE));
    }
    // One voxel grid serves the lights and the sky.
    glossy.push(plan(&open, "hierarchical", &[("sources", "both")], SIZE));
    for weighting in ["radiometric", "pattern"] {
        glossy.push(plan(&open, "hybrid", &[("weighting", weighting)], SIZE));
    }
    polished.lights = vec![scenes::sun()];
    polished.extra_cameras = vec![polished.camera; 2];
    polished.materials[1].receive_only = true;
    glossy.extend(["float16", "float32"].map(|storage| {
        let values = [("storage", storage), ("visibility", "auto"), ("bounces", "2"), ("temporal_a", "0.9")];
        plan(&polished, "hierarchical", &values, SIZE)
    }));
    let mut wax = scenes::court();
    wax.materials[0].translucency = [0.5; 3];
    wax.lights.push(scenes::sun());
    let translucent = ["float16", "float32"].map(|storage| plan(&wax, "hybrid", &[("storage", storage)], SIZE));
    plans(&[("temporal_a", "0")])
        .chain(plans(&[("temporal_a", "0.9")]))
        .chain(plans(&[("visibility", "auto")]))
        .chain(plans(&[("bounces", "2"), ("bounce_interleaving", "on")]))
        .chain(technique_plans())
        .chain(scenes.iter().flat_map(light_space_plans))
        .chain(scenes.iter().flat_map(cache_plans))
        .chain(glossy)
        .chain(translucent)
        .collect()
}

#[test]
fn every_plan_fits_its_shaders() {
    for plan in every_plan() {
        for pass in &plan.passes {
            let what = format!("{} of {:?}", pass.name, plan.display_size);
            let shader = pass.shader;
            let bindings: Vec<_> = shader.entry_points.iter().flat_map(|entry| entry.bindings).collect();
            let sorted = |names: Vec<&'static str>| names.into_iter().collect::<BTreeSet<_>>();
            let constants = pass.constants.iter().map(|&(name, _)| name).collect();
            assert_eq!(sorted(constants), sorted(shader.overrides.to_vec()), "{what}: constants");
            // The graph makes the views, the block of the pass's own numbers and samplers; the plan gives the rest.
            let made = |binding: &Binding| match binding.kind {
                BindingKind::Sampler { .. } => true,
                BindingKind::Uniform { .. } => ["view", "previous", "params", "division"].contains(&binding.name),
                _ => false,
            };
            let wanted = bindings.iter().filter(|binding| !made(binding)).map(|binding| binding.name).collect();
            let bound = pass.bindings.iter().map(|&(name, _)| name).collect();
            assert_eq!(sorted(bound), sorted(wanted), "{what}: bindings");
            let mut fields = Vec::new();
            for binding in &bindings {
                match (&binding.kind, binding.name) {
                    (_, "view" | "previous" | "division") => {}
                    (BindingKind::Uniform { members, .. }, "params") => {
                        fields.extend(members.iter().map(|member| member.name))
                    }
                    (BindingKind::StorageTexture { format, writable: true }, name) => {
                        let id = pass.bindings.iter().find(|(bound, _)| *bound == name).unwrap().1;
                        let ResourceKind::Texture { format: planned, .. } = &plan.resources[id.0].kind else {
                            panic!("{what}: {name} is no texture");
                        };
                        assert_eq!(format!("{planned:?}"), *format, "{what}: {name}");
                    }
                    _ => {}
                }
            }
            let set: BTreeSet<_> = pass.params.iter().map(|&(name, _)| name).collect();
            assert!(fields.iter().all(|field| set.contains(field)), "{what}: uniform fields {fields:?} of {set:?}");
            if let Work::Dispatch { entry, .. } = pass.work {
                assert!(shader.entry_point(entry).is_some(), "{what}: no entry point {entry}");
            }
            if let Work::Draw { draws, .. } = &pass.work {
                draws.iter().for_each(|draw| fits_instead(pass, draw.shader));
            }
        }
    }
}

/// A variant that draws some of the triangles is given what the pass's own shader is given.
fn fits_instead(pass: &Pass, variant: &Shader) {
    let block = |shader: &Shader| shader.bindings().find(|binding| binding.name == "params").map(|block| &block.kind);
    assert_eq!(block(variant), block(pass.shader), "{}", pass.name);
    assert_eq!(variant.overrides, pass.shader.overrides, "{}", pass.name);
    let with: BTreeSet<_> = pass.shader.bindings().map(|binding| binding.name).collect();
    for binding in variant.bindings() {
        assert!(with.contains(binding.name), "{}: {}", pass.name, binding.name);
    }
}

#[test]
fn every_plan_reads_only_what_was_written_and_wastes_nothing() {
    for plan in every_plan() {
        let name = |id: &ResourceId| plan.resources[id.0].name.as_str();
        let distinct = |names: Vec<&str>| names.iter().collect::<BTreeSet<_>>().len() == names.len();
        assert!(distinct(passes(&plan)), "two passes share a name: {:?}", passes(&plan));
        assert!(distinct(resources(&plan)), "two resources share a name: {:?}", resources(&plan));
        let made = |id: &ResourceId| {
            matches!(plan.resources[id.0].kind, ResourceKind::Texture { .. } | ResourceKind::Buffer { .. })
        };
        let mut written = BTreeSet::new();
        let mut read = BTreeSet::new();
        // Buffers that several passes write: each goes on from what another one left.
        let mut shared: BTreeSet<ResourceId> = BTreeSet::new();
        for pass in &plan.passes {
            assert!(!pass.reason.is_empty(), "{} has no reason", pass.name);
            let (reads, writes) = pass.reads_and_writes();
            for id in reads.iter().filter(|id| made(id)) {
                let continues = pass.continued.contains(id);
                assert!(continues || !writes.contains(id), "{} reads and writes {}", pass.name, name(id));
                // The first part of an exhaustive sum binds the other texture and does not read it.
                let unread = pass.name == "exhaustive_0" && name(id) == "sum_1";
                assert!(unread || written.contains(id), "{} reads {} before it is written", pass.name, name(id));
            }
            read.extend(reads);
            shared.extend(writes.iter().copied().filter(|id| written.contains(id)));
            written.extend(writes);
        }
        for (index, resource) in plan.resources.iter().enumerate() {
            let id = ResourceId(index);
            assert!(!resource.reason.is_empty(), "{} has no reason", resource.name);
            // A history is written for the next frame to read.
            let kept = |(index, other): (usize, &Resource)| {
                matches!(other.kind, ResourceKind::Previous { of, .. } if of == id) && read.contains(&ResourceId(index))
            };
            if plan.resources.iter().enumerate().any(kept) {
                continue;
            }
            // The links of a radiance cache are read by the pass that writes them, in later frames.
            // A depth test is read by the pass that writes it, a target of voxels gives the size; the second sum of a
            // short exhaustive one is only bound.
            let result = plan.outputs.values().any(|&output| output == id);
            let target = ["depth_test", "voxel_target", "links"].iter().any(|target| resource.name.ends_with(target));
            assert!(result || target || read.contains(&id) || shared.contains(&id), "nobody reads {}", resource.name);
        }
    }
}

#[test]
fn every_shader_file_belongs_to_a_pass_that_some_plan_has() {
    let planned: BTreeSet<&str> =
        every_plan().into_iter().flat_map(|plan| plan.passes).map(|pass| pass.shader.file()).collect();
    // The path tracer, the viewer's display, the scan and the benchmark of fetches dispatch their own shaders; they are
    // no part of a frame.
    let own = |name: &str| ["truth/", "viewer/", "non_finite/"].iter().any(|folder| name.starts_with(folder));
    let elsewhere = |name: &str| own(name) || name == "hierarchical/fetch";
    let all: BTreeSet<&str> = SHADERS.iter().map(Shader::file).filter(|name| !elsewhere(name)).collect();
    assert_eq!(planned, all);
}

#[test]
fn a_plan_prints_its_passes_and_their_reasons() {
    let text = plan(&scenes::court(), "hierarchical", &[], SIZE).to_string();
    for expected in ["gather_3", "pyramid_32", "hierarchical/gather", "surfels_4", "the image to show", "128x72"] {
        assert!(text.contains(expected), "no {expected} in\n{text}");
    }
}
