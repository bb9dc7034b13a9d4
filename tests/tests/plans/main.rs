//! Frame plans as data: no device is opened here.
//!
//! A plan lists what a scene and a setting ask for and nothing else, and what it lists fits the
//! shaders that will run it.
#![allow(clippy::unwrap_used)]

mod every;

use glam::Vec3;
use halflight_frame_graph::{FramePlan, ResourceId, ResourceKind, bytes_in_words};
use halflight_renderer::{DirectSource, plan_frame, scene::SceneFacts};
use halflight_scenes::{CameraKeyframe, Environment, Keyframe, Light, Motion, Moves, Scene};
use halflight_soundness::scenes;
use halflight_tests::{bundled, known, settings};

fn plan(scene: &Scene, technique: &str, values: &[(&str, &str)], size: [u32; 2]) -> FramePlan {
    let settings = settings(technique, values);
    plan_frame(&SceneFacts::of(scene), known(technique), &settings, size, DirectSource::Rendered).unwrap()
}

fn passes(plan: &FramePlan) -> Vec<&str> {
    plan.passes.iter().map(|pass| pass.name.as_str()).collect()
}

/// Names of everything that is not a pass, in order.
fn resources(plan: &FramePlan) -> Vec<&str> {
    plan.resources.iter().map(|resource| resource.name.as_str()).collect()
}

/// What the second list has and the first has not.
fn added<'a>(before: &[&'a str], after: &[&'a str]) -> Vec<&'a str> {
    assert!(before.iter().all(|name| after.contains(name)), "{before:?} lost something in {after:?}");
    after.iter().copied().filter(|name| !before.contains(name)).collect()
}

const SIZE: [u32; 2] = [128, 72];

#[test]
fn a_plain_scene_has_no_pass_that_it_does_not_need() {
    let scene = scenes::court();
    let none = plan(&scene, "none", &[], SIZE);
    assert_eq!(passes(&none), ["gbuffer", "shadow_0", "direct"]);
    let given = ["scene.vertices", "scene.materials"];
    let own = ["depth", "normal", "albedo", "depth_test", "shadow_maps", "shadow_layers", "light_view_0", "direct"];
    assert_eq!(resources(&none), [&given[..], &own, &["scene.lights"]].concat());
    // Without indirect light the direct image is the final one: no copy of it is made.
    assert_eq!(none.outputs["final"], none.outputs["direct"]);

    let hierarchical = plan(&scene, "hierarchical", &[("levels", "4"), ("start_resolution", "quarter")], SIZE);
    let pyramid = ["pyramid_2", "pyramid_4", "pyramid_8", "pyramid_16", "pyramid_32"];
    let gather = ["gather_0", "gather_1", "gather_2", "gather_3"];
    let combine = ["combine_2", "combine_1", "combine_0", "upsample", "composite"];
    assert_eq!(added(&passes(&none), &passes(&hierarchical)), [&pyramid[..], &gather, &combine].concat());
    let surfels = ["surfels_2", "surfels_4", "surfels_8", "surfels_16", "surfels_32"];
    let gathered = ["gathered_0", "gathered_1", "gathered_2", "gathered_3"];
    let combined = ["combined_2", "combined_1", "combined_0", "indirect", "final"];
    assert_eq!(added(&resources(&none), &resources(&hierarchical)), [&surfels[..], &gathered, &combined].concat());
    // No variant that the scene did not ask for either.
    let shaders: Vec<&str> = hierarchical.passes[..3].iter().map(|pass| pass.shader.name).collect();
    assert_eq!(shaders, ["gbuffer/gbuffer", "shadow/shadow_map", "direct/direct_light+lit+float16"]);
}

#[test]
fn each_need_adds_exactly_its_own() {
    let plain = scenes::court();
    let before = plan(&plain, "hierarchical", &[], SIZE);
    let check = |changed: fn(&mut Scene), resources_added: &[&str], passes_added: &[&str], shaders: [&str; 3]| {
        let mut scene = plain.clone();
        changed(&mut scene);
        let after = plan(&scene, "hierarchical", &[], SIZE);
        assert_eq!(added(&resources(&before), &resources(&after)), resources_added);
        assert_eq!(added(&passes(&before), &passes(&after)), passes_added);
        let of = |name| after.find(name).unwrap().shader.name;
        assert_eq!([of("gbuffer"), of("shadow_0"), of("direct")], shaders);
    };
    let (shadow, direct) = ("shadow/shadow_map", "direct/direct_light+lit+float16");
    check(
        |scene| scene.materials[0].emission = [1.0; 3],
        &["material"],
        &[],
        ["gbuffer/gbuffer+material_id", shadow, "direct/direct_light+lit+emitters+float16"],
    );
    check(
        |scene| scene.materials[0].albedo_texture = Some(0),
        &["scene.texels"],
        &[],
        ["gbuffer/gbuffer+textured+mips", shadow, direct],
    );
    check(
        |scene| scene.materials[0].alpha_texture = Some(0),
        &["scene.texels"],
        &[],
        ["gbuffer/gbuffer+alpha_tested", "shadow/shadow_map+alpha_tested", direct],
    );
    // What no pass of this technique can show yet costs nothing: glossy materials.
    check(|scene| scene.materials[0].specular = [0.5; 3], &[], &[], ["gbuffer/gbuffer", shadow, direct]);
    check(
        |scene| scene.lights.push(scenes::sun()),
        &["light_view_1"],
        &["shadow_1"],
        ["gbuffer/gbuffer", shadow, direct],
    );
    // What only receives light is found by its material, and its light is taken out of the source.
    check(
        |scene| scene.materials[0].receive_only = true,
        &["material", "receive_only", "source"],
        &["source"],
        ["gbuffer/gbuffer+material_id", shadow, direct],
    );
    // What moves is drawn where it is; no channel says what it was, unless the temporal filter asks.
    check(move_first_mesh, &["scene.objects"], &[], ["gbuffer/gbuffer+animated", "shadow/shadow_map+animated", direct]);
    // The sky shows, and its light is gathered through voxels.
    check(
        |scene| scene.environment = Some(Environment::constant([1.0; 3])),
        &[
            "scene.environment",
            "scene_grid",
            "scene_cubes",
            "scene.indices",
            "gathered_from_sky",
            "denoised_0",
            "denoised_1",
            "with_sky",
        ],
        &["sky", "scene_voxels", "gather_sky", "denoise_0", "denoise_1", "add_sky"],
        ["gbuffer/gbuffer", shadow, direct],
    );
    // A light or a camera that moves changes numbers and no plan.
    check(
        |scene| scene.moves.lights.push((0, Motion { pivot: [0.0; 3], keyframes: vec![Keyframe::default()] })),
        &[],
        &[],
        ["gbuffer/gbuffer", shadow, direct],
    );
    check(move_camera, &[], &[], ["gbuffer/gbuffer", shadow, direct]);
    // A point light needs the six faces of a cube.
    check(
        |scene| scene.lights.push(Light::Point { position: [0.0, 2.0, 0.0], intensity: [1.0; 3] }),
        &["light_view_1", "light_view_2", "light_view_3", "light_view_4", "light_view_5", "light_view_6"],
        &["shadow_1", "shadow_2", "shadow_3", "shadow_4", "shadow_5", "shadow_6"],
        ["gbuffer/gbuffer", shadow, direct],
    );
}

fn move_first_mesh(scene: &mut Scene) {
    scene.meshes[0].object = Some(0);
    let keyframes = vec![Keyframe::default(), Keyframe { frame: 9, translate: [0.1, 0.0, 0.0], ..Keyframe::default() }];
    scene.moves.objects.push(Motion { pivot: [0.0; 3], keyframes });
}

fn move_camera(scene: &mut Scene) {
    let key = |frame, eye| CameraKeyframe { frame, eye, target: scene.camera.target, cut: false };
    scene.moves = Moves { camera: vec![key(0, scene.camera.eye), key(9, [0.1, 1.4, 4.0])], ..Moves::default() };
}

#[test]
fn the_temporal_filter_adds_exactly_its_own() {
    let filtered = |scene: &Scene| {
        let plans = ["0", "0.9"].map(|a| plan(scene, "hierarchical", &[("temporal_a", a)], SIZE));
        let resources: Vec<String> =
            added(&resources(&plans[0]), &resources(&plans[1])).into_iter().map(String::from).collect();
        let passes: Vec<String> = added(&passes(&plans[0]), &passes(&plans[1])).into_iter().map(String::from).collect();
        let bytes = plans[1].technique_bytes() - plans[0].technique_bytes();
        let shader = plans[1].find("temporal").unwrap().shader.name;
        (resources, passes, bytes, shader, plans[1].find("gbuffer").unwrap().shader.name)
    };
    let own = ["history", "history_before", "filtered"].map(String::from).to_vec();
    let pass = vec!["temporal".to_owned()];
    // Two textures of 16 bytes a pixel that change places, and the filtered light.
    let bytes = u64::from(SIZE[0] * SIZE[1]) * (2 * 16 + 8);
    let (still, gbuffer) = ("temporal/temporal+float16", "gbuffer/gbuffer");
    let scene = scenes::court();
    assert_eq!(filtered(&scene), (own.clone(), pass.clone(), bytes, still, gbuffer));
    // A camera that moves is followed through depth and matrices.
    let mut camera = scene.clone();
    move_camera(&mut camera);
    assert_eq!(filtered(&camera), (own.clone(), pass.clone(), bytes, still, gbuffer));
    // Only an object that moves needs to be known by its pixels.
    let mut moving = scene;
    move_first_mesh(&mut moving);
    let with_object = [vec!["object".to_owned()], own].concat();
    let shaders = ("temporal/temporal+animated+float16", "gbuffer/gbuffer+animated+object_id");
    assert_eq!(filtered(&moving), (with_object, pass, bytes, shaders.0, shaders.1));
    // A technique that keeps nothing has no use for it.
    assert!(!resources(&plan(&moving, "exhaustive", &[], SIZE)).contains(&"object"));
}

#[test]
fn without_lights_there_are_no_shadow_maps() {
    let mut scene = scenes::court();
    scene.lights.clear();
    let plan = plan(&scene, "none", &[], SIZE);
    assert_eq!(passes(&plan), ["gbuffer", "direct"]);
    assert_eq!(
        resources(&plan),
        ["scene.vertices", "scene.materials", "depth", "normal", "albedo", "depth_test", "direct"]
    );
    assert_eq!(plan.find("direct").unwrap().shader.name, "direct/direct_light+float16");
}

#[test]
fn direct_light_that_is_given_is_not_made() {
    let facts = SceneFacts::of(&scenes::court());
    let plan = plan_frame(&facts, known("none"), &settings("none", &[]), SIZE, DirectSource::Given).unwrap();
    assert_eq!(passes(&plan), ["gbuffer"]);
    assert!(matches!(plan.resources[plan.outputs["direct"].0].kind, ResourceKind::External { .. }));
}

#[test]
fn settings_of_the_gather_change_what_they_name() {
    let scene = scenes::court();
    let technique = |values: &[(&str, &str)]| {
        let plan = plan(&scene, "hierarchical", values, SIZE);
        plan.passes[3..].iter().map(|pass| pass.name.clone()).collect::<Vec<_>>()
    };
    // A full start packs the G-buffer as it is, and its last level is the image.
    assert_eq!(
        technique(&[("start_resolution", "full"), ("levels", "2")]),
        ["pyramid_1", "pyramid_2", "gather_0", "gather_1", "combine_0", "composite"]
    );
    assert_eq!(
        technique(&[("start_resolution", "half"), ("levels", "1")]),
        ["pyramid_2", "gather_0", "upsample", "composite"]
    );
    assert_eq!(technique(&[("start_resolution", "full"), ("levels", "1")]), ["pyramid_1", "gather_0", "composite"]);
    // A single level: nothing coarser than it is made, and nothing else is gathered.
    assert_eq!(
        technique(&[("start_resolution", "half"), ("levels", "4"), ("only_level", "1")]),
        ["pyramid_2", "pyramid_4", "gather_1", "combine_0", "upsample", "composite"]
    );
    assert_eq!(
        technique(&[("start_resolution", "half"), ("levels", "4"), ("only_level", "0")]),
        ["pyramid_2", "gather_0", "upsample", "composite"]
    );
}

#[test]
fn visibility_adds_voxels_and_nothing_else() {
    let mut scene = scenes::court();
    let values = [("levels", "2"), ("start_resolution", "half")];
    let plan = |scene: &Scene, visibility| {
        plan(scene, "hierarchical", &[&values[..], &[("visibility", visibility)]].concat(), SIZE)
    };
    let off = plan(&scene, "off");
    assert_eq!(off, self::plan(&scene, "hierarchical", &values, SIZE), "off is the default");
    let surface = plan(&scene, "surface");
    let grids = ["voxels_2", "voxels_4"];
    let raster = ["depth_range", "voxelize_surfaces"];
    assert_eq!(added(&passes(&off), &passes(&surface)), [&raster[..], &grids].concat());
    let resources_added = ["depth_range", "columns", "voxel_target"];
    assert_eq!(added(&resources(&off), &resources(&surface)), [&resources_added[..], &grids].concat());
    let shader = |plan: &FramePlan, name| plan.find(name).unwrap().shader.name;
    assert_eq!(shader(&off, "gather_0"), "hierarchical/gather");
    assert_eq!(shader(&surface, "gather_0"), "hierarchical/gather+visibility");
    assert_eq!(shader(&surface, "voxelize_surfaces"), "hierarchical/voxelize");
    // Each mesh as it is: no mesh of this scene is watertight, so no pass looks for solid ones.
    assert_eq!(passes(&plan(&scene, "auto")), passes(&surface));
    assert!(plan(&scene, "solid").find("voxelize_solid").is_some());
    assert!(plan(&scene, "solid").find("voxelize_surfaces").is_none());
    // Cut-outs are looked up where there are any.
    scene.materials[1].alpha_texture = Some(0);
    // ... and by their own triangles alone.
    for visibility in ["surface", "auto"] {
        let with = plan(&scene, visibility);
        assert_eq!(shader(&with, "voxelize_surfaces"), "hierarchical/voxelize");
        assert_eq!(shader(&with, "voxelize_cut_outs"), "hierarchical/voxelize+alpha_tested");
    }
    scene.materials[0].alpha_texture = Some(0);
    assert!(plan(&scene, "surface").find("voxelize_surfaces").is_none(), "no mesh is whole");
}

#[test]
fn bounces_share_the_pyramid_and_the_voxels() {
    let scene = scenes::court();
    let plan = |bounces, visibility_bounces| {
        let values = [
            ("bounces", bounces),
            ("visibility_bounces", visibility_bounces),
            ("levels", "2"),
            ("start_resolution", "half"),
            ("visibility", "surface"),
        ];
        plan(&scene, "hierarchical", &values, SIZE)
    };
    let one = plan("1", "all");
    assert!(plan("0", "all").outputs["final"] == plan("0", "all").outputs["direct"], "no bounce, no light");
    let three = plan("3", "all");
    let bounce = |n: u32| {
        ["relight_2", "relight_4", "gather_0", "gather_1", "combine_0", "sum"].map(|name| format!("{name}_bounce_{n}"))
    };
    let expected: Vec<String> = [vec!["albedo_of_surfels".into()], bounce(2).into(), bounce(3).into()].concat();
    assert_eq!(added(&passes(&one), &passes(&three)), expected);
    // Two sets of textures take turns, so memory does not grow with further bounces.
    let textures = |plan: &FramePlan| plan.resources.iter().map(|resource| resource.bytes()).sum::<u64>();
    assert_eq!(textures(&plan("8", "all")), textures(&three));
    assert_eq!(plan("8", "all").technique_bytes(), plan("6", "all").technique_bytes());
    // Each further bounce gathers once a level: eight cost less than eight frames of one.
    let gathers = |plan: &FramePlan| passes(plan).iter().filter(|name| name.starts_with("gather_")).count();
    assert_eq!(gathers(&plan("8", "all")), 8 * gathers(&one));
    assert!(plan("8", "all").passes.len() < 8 * one.passes.len());
    let shaders = |plan: &FramePlan| {
        ["gather_0", "gather_0_bounce_2"].map(|name| plan.find(name).unwrap().shader.name.ends_with("+visibility"))
    };
    assert_eq!(shaders(&three), [true, true]);
    assert_eq!(shaders(&plan("3", "first")), [true, false]);
}

#[test]
fn a_level_that_does_not_exist_is_refused() {
    let values = settings("hierarchical", &[("levels", "2"), ("only_level", "2")]);
    let facts = SceneFacts::of(&scenes::court());
    let error =
        plan_frame(&facts, known("hierarchical"), &values, SIZE, DirectSource::Rendered).unwrap_err().to_string();
    assert!(error.contains("only_level") && error.contains("2 levels"), "{error}");
}

#[test]
fn the_memory_of_the_technique_is_what_its_textures_hold() {
    // 128x72, quarter start, 2 levels, float32: surfels 64x36, 32x18 and 16x9, light gathered 32x18
    // and 16x9 and combined 32x18, indirect and final 128x72; 16 bytes each.
    let values = [("start_resolution", "quarter"), ("levels", "2"), ("storage", "float32")];
    let texels = 64 * 36 + 32 * 18 + 16 * 9 + (32 * 18 + 16 * 9) + 32 * 18 + 2 * 128 * 72;
    assert_eq!(plan(&scenes::court(), "hierarchical", &values, SIZE).technique_bytes(), 16 * texels);
}

/// A plan of the atrium at 1280x720.
fn atrium(technique: &str, values: &[(&str, &str)]) -> FramePlan {
    plan(&bundled("atrium"), technique, values, [1280, 720])
}

/// Pixels of an image of 1280x720.
const PIXELS: u64 = 1280 * 720;
/// Bytes of the voxel grid of the atrium: 288 x 140 x 96 bits.
const CUBES: u64 = 288 * 140 * 96 / 8;

#[test]
fn a_plain_frame_takes_what_its_formats_need() {
    let plan = atrium("none", &[]);
    // Depth, normal, albedo, depth test, direct; 16 bits of depth for the sun, whose map is fine enough; its two views.
    assert_eq!(plan.bytes(), PIXELS * (4 + 8 + 4 + 4 + 8) + 4096 * 4096 * 2 + 2 * 80);
    assert_eq!(plan.live_bytes(), plan.bytes(), "nothing could share");
    // With float32 and 32 bits of depth it took 100.29 MB.
    assert!(plan.bytes() * 100 <= 100_292_768 * 60, "{}", plan.bytes());
    let wide = atrium("none", &[("direct.storage", "float32")]);
    assert_eq!(wide.bytes() - plan.bytes(), PIXELS * 8);
}

#[test]
fn slices_take_what_their_formats_need() {
    // Planes with radiance, surfels without; gathered, filtered and final light as float16.
    let light = atrium("bitmask", &[]);
    assert_eq!(light.technique_bytes(), PIXELS * (16 + 8 + 3 * 8) + CUBES);
    assert!(light.technique_bytes() <= 45_000_000);
    let wide = atrium("bitmask", &[("storage", "float32")]);
    assert_eq!(wide.technique_bytes() - light.technique_bytes(), PIXELS * 3 * 8);
    // Ambient visibility: planes without radiance, and one float before and after the filter.
    let occlusion = PIXELS * (8 + 8 + 2 * 4);
    for (technique, values) in [("bitmask", &[("finds", "occlusion")][..]), ("ray-march", &[("finds", "occlusion")])] {
        // The environment's light and the final image.
        assert_eq!(atrium(technique, values).technique_bytes(), occlusion + PIXELS * 2 * 16 + CUBES, "{technique}");
    }
    assert_eq!(plan(&scenes::court(), "gtao", &[], [1280, 720]).technique_bytes(), occlusion);
    assert_eq!(plan(&scenes::court(), "ssao", &[], [1280, 720]).technique_bytes(), PIXELS * (8 + 4));
}

#[test]
fn passes_of_levels_and_bounces_share_memory() {
    let values = [("visibility", "auto"), ("bounces", "2")];
    let plan = atrium("hierarchical", &values);
    let memory = plan.memory();
    let name = |id: ResourceId| plan.resources[id.0].name.as_str();
    let shared: Vec<_> = (0..plan.resources.len())
        .map(ResourceId)
        .filter(|&id| memory.owner(id) != id)
        .map(|id| (name(id), name(memory.owner(id))))
        .collect();
    let expected = [
        ("gathered_from_sky", "gathered_0"),
        ("denoised_1", "gathered_0"),
        ("with_sky", "denoised_0"),
        ("gathered_0_of_even_bounces", "combined_0"),
        ("combined_0_of_even_bounces", "gathered_0"),
        ("sum_0", "combined_0"),
    ];
    assert_eq!(shared, expected);
    // Six images of a quarter of the width and height, of 16 bytes a pixel.
    let apart: u64 = plan.resources.iter().map(|resource| resource.bytes()).sum();
    assert_eq!(apart - plan.bytes(), 6 * PIXELS / 16 * 16);
    // More than half are the outputs `indirect` and `final`. Without sharing it took 33.09 MB.
    assert_eq!((plan.technique_bytes(), plan.live_technique_bytes()), (27_441_928, 21_825_288));
    assert!(plan.live_bytes() < plan.bytes());
    let text = plan.to_string();
    let (first, _) = text.split_once('\n').unwrap();
    let words =
        [plan.bytes(), plan.live_bytes(), plan.technique_bytes(), plan.live_technique_bytes()].map(bytes_in_words);
    let [all, alive, own, own_alive] = words;
    let expected = format!("{all} ({alive} live at once), of which the technique {own} ({own_alive} live at once)");
    assert!(first.ends_with(&expected), "{first}");
    assert!(text.contains("light of the sky; in the memory of gathered_0"), "{text}");
}

#[test]
fn indices_are_as_wide_as_their_number() {
    let format = |materials: usize| {
        let mut scene = scenes::court();
        scene.materials[0].emission = [1.0; 3];
        let last = scene.materials[0].clone();
        scene.materials.resize(materials, last);
        let plan = plan(&scene, "none", &[], SIZE);
        let material = plan.resources.iter().find(|resource| resource.name == "material").unwrap();
        material.format().unwrap()
    };
    use wgpu::TextureFormat as Format;
    assert_eq!(
        [256, 257, 65_536, 65_537].map(format),
        [Format::R8Uint, Format::R16Uint, Format::R16Uint, Format::R32Uint]
    );
}

#[test]
fn shadow_maps_have_16_bits_of_depth_where_these_are_fine_enough() {
    let format = |scene: &Scene, size: &str| {
        let plan = plan(scene, "none", &[("direct.shadow_map_size", size)], SIZE);
        let maps = plan.resources.iter().find(|resource| resource.name == "shadow_maps").unwrap();
        maps.format().unwrap()
    };
    let (narrow, wide) = (wgpu::TextureFormat::Depth16Unorm, wgpu::TextureFormat::Depth32Float);
    let mut scene = scenes::court();
    scene.lights = vec![scenes::sun()];
    assert_eq!(format(&scene, "2048"), narrow);
    // One step of depth along an eighth of a texel, at most: a long and narrow shaft has too few steps.
    let mut deep = scene.clone();
    deep.lights = vec![Light::Directional { direction: [0.0, -1.0, 0.0], irradiance: [1.0; 3] }];
    let (low, high) = (Vec3::new(0.0, -300.0, 0.0), Vec3::new(1.0, 0.0, 1.0));
    deep.meshes[0].positions[0] = low.to_array();
    deep.meshes[0].positions[1] = high.to_array();
    assert_eq!([format(&deep, "64"), format(&deep, "8192")], [narrow, wide]);
    // A light that moves may come from where they are too few.
    let mut moving = scene.clone();
    moving.moves.lights.push((0, Motion { pivot: [0.0; 3], keyframes: vec![Keyframe::default()] }));
    assert_eq!(format(&moving, "2048"), wide);
    // Depth of a perspective map is not linear.
    scene.lights.push(Light::Point { position: [0.0, 2.0, 0.0], intensity: [1.0; 3] });
    assert_eq!(format(&scene, "2048"), wide);
}

#[test]
fn an_environment_adds_exactly_its_own() {
    let dark = scenes::court();
    let lit = Scene { environment: Some(Environment::constant([1.0; 3])), ..dark.clone() };
    let sky = ["scene.environment", "scene_grid", "scene_cubes", "scene.indices"];
    for (technique, passes_added, resources_added, shader) in [
        ("bitmask", &["sky", "scene_voxels"][..], &sky[..], "bitmask/gather+light+ambient+float16"),
        ("horizon", &["sky", "scene_voxels"], &sky, "horizon/gather+ambient+float16"),
        ("ray-march", &["sky", "scene_voxels"], &sky, "ray-march/march+light+ambient+float16"),
        (
            "gtao",
            &["sky", "scene_voxels", "ambient", "composite"],
            &[&sky[..], &["indirect", "final"]].concat(),
            "gtao/gather",
        ),
    ] {
        let [before, after] = [&dark, &lit].map(|scene| plan(scene, technique, &[], SIZE));
        assert_eq!(added(&passes(&before), &passes(&after)), passes_added, "{technique}");
        assert_eq!(added(&resources(&before), &resources(&after)), resources_added, "{technique}");
        assert_eq!(after.find("gather").unwrap().shader.name, shader);
    }
}

#[test]
fn a_bitmask_has_the_passes_that_its_settings_ask_for() {
    let scene = scenes::court();
    let none = plan(&scene, "none", &[], SIZE);
    let own = |technique, values: &[(&str, &str)]| {
        let plan = plan(&scene, technique, values, SIZE);
        added(&passes(&none), &passes(&plan)).into_iter().map(String::from).collect::<Vec<_>>()
    };
    assert_eq!(own("bitmask", &[]), ["pyramid_1", "gather", "denoise_0", "composite"]);
    assert_eq!(own("bitmask", &[("denoise", "0")]), ["pyramid_1", "gather", "composite"]);
    assert_eq!(
        own("bitmask", &[("resolution", "half"), ("denoise", "2")]),
        ["pyramid_2", "gather", "denoise_0", "denoise_1", "upsample", "composite"]
    );
    assert_eq!(
        own("bitmask", &[("feedback", "0.9")]),
        ["feedback", "pyramid_1", "gather", "denoise_0", "remember", "composite"]
    );
    // Openness is no light: the direct image is the final one, and the plan says how far it looks.
    let open = plan(&scene, "gtao", &[("radius", "2"), ("resolution", "half")], SIZE);
    assert_eq!(
        added(&passes(&none), &passes(&open)),
        ["pyramid_2", "gather", "denoise_0", "upsample_ambient_occlusion"]
    );
    assert_eq!(open.outputs["final"], open.outputs["direct"]);
    assert!(open.outputs.contains_key("ambient_occlusion") && !open.outputs.contains_key("indirect"));
    assert_eq!(open.attributes.get("ambient_occlusion.radius"), Some(&2.0));
    assert_eq!(plan(&scene, "bitmask", &[], SIZE).attributes.get("ambient_occlusion.radius"), None);
    // Both estimators and gtao look at the same surfaces.
    let reads = |technique| plan(&scene, technique, &[], SIZE).find("gather").unwrap().reads_and_writes().0.len();
    assert_eq!(["bitmask", "gtao", "horizon", "ray-march"].map(reads), [2; 4]);
}
