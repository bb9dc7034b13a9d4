//! What stands between a surface and its source: the voxel grid, and the rays through it.
#![allow(clippy::unwrap_used)]

use glam::Vec3;
use halflight_evaluator::experiment::session::Session;
use halflight_renderer::{plan_technique, scene::SceneFacts};
use halflight_scenes::Scene;
use halflight_soundness::{
    oracle::{
        pairs::{Level, answered, surfels_of},
        voxels::Grid,
    },
    scenes,
};
use halflight_techniques::TECHNIQUES;
use halflight_tests::{bundled, device, frames, known, mean_luminance, render, request, settings};

/// Rounding of places and slices: float32 knows a place among 320 texels to 3e-5 and a slice to 1e-5 of its range; the
/// march adds up to a hundred steps to that.
const ROUNDING: f64 = 2e-3;

#[test]
fn rays_answer_as_their_double_precision_twin() {
    let mut asked = 0;
    let mut ties = 0;
    for (name, kind, downsampling) in [("bars", "surface", "or"), ("atrium", "auto", "and"), ("bars", "solid", "or")] {
        let scene = bundled(name);
        let session = Session::new(device(), &scene).keep_all();
        let values = settings(
            "hierarchical",
            &[("visibility", kind), ("visibility_downsampling", downsampling), ("levels", "3")],
        );
        let (frames, levels) = answered(&session, &values, [640, 360], 1200).unwrap();
        let mut grid = Grid::read(&frames, 4);
        for (k, Level { surfels, pairs, seen }) in levels.iter().enumerate() {
            let mut wrong = 0;
            for (&pair, &seen) in pairs.iter().zip(seen) {
                let [receiver, source] = surfels_of(surfels, pair);
                let hides = |slack| grid.hides(surfels, &receiver, &source, slack);
                let tie = hides(ROUNDING) != hides(-ROUNDING);
                ties += usize::from(tie);
                wrong += usize::from(!tie && seen == hides(0.0));
            }
            let hidden = seen.iter().filter(|seen| !**seen).count();
            println!("{name} {kind} {downsampling} level {k}: {hidden} of {} hidden, {wrong} wrong", pairs.len());
            assert_eq!(wrong, 0, "{name} {kind} level {k}");
            asked += pairs.len();
            grid = grid.coarser(downsampling == "or");
        }
    }
    println!("{asked} pairs, {ties} ties");
    assert!(asked >= 10_000, "{asked} pairs");
    // A ray passes some thirty borders of columns and slices, each a tie with about the chance of the rounding above
    // where only one of the two voxels is set.
    assert!(ties < asked / 50, "{ties} ties");
}

/// A lit floor, a wall, and a thick block between that lets no light of the floor's far part through.
fn walled() -> Scene {
    let mut scene = scenes::court();
    scene.meshes.truncate(2);
    scene.meshes.push(scenes::block(Vec3::new(-1.5, 0.0, -0.5), Vec3::new(1.5, 1.0, 0.1), 0));
    scene
}

#[test]
fn solid_matter_is_filled_and_surfaces_are_shells() {
    let scene = walled();
    assert!(scene.meshes[2].is_watertight(), "the block is closed");
    let needs = SceneFacts::of(&scene).needs;
    assert_eq!((needs.watertight_meshes, needs.open_meshes), (1, 2));
    let session = Session::new(device(), &scene).keep_all();
    let filled = |kind| {
        let mut frames = frames(&session, &request("hierarchical", &[("visibility", kind)], [256, 144]));
        frames.run(0).unwrap();
        let grid = Grid::read(&frames, 4);
        // The column in the middle of the block's front, in octaves of depth: 0.6 units from about 3.9 on are 0.2.
        let column = grid.columns[(19 * grid.size[0] + grid.size[0] / 2) as usize];
        (grid.filled(), f64::from(column.count_ones()) / grid.per_octave)
    };
    let (auto, surface) = (filled("auto"), filled("surface"));
    println!("filled and depth of a column: auto {auto:.3?}, surfaces {surface:.3?}");
    assert!(auto.0 > surface.0, "matter inside counts");
    // The block alone is solid; floor and wall behind add their shells.
    assert!(auto.1 > 0.19, "the block is filled: {}", auto.1);
    assert!(surface.1 < 0.06, "shells are thin: {}", surface.1);
}

#[test]
fn light_stops_at_a_wall() {
    let scene = walled();
    let session = Session::new(device(), &scene).keep_all();
    let light = |values: &[(&str, &str)]| {
        let image = render(&session, &request("hierarchical", values, [256, 144]), "indirect");
        mean_luminance(&image)
    };
    let off = light(&[]);
    for kind in ["surface", "solid", "auto"] {
        let on = light(&[("visibility", kind)]);
        println!("{kind}: {:.3} of the light without visibility", on / off);
        assert!(on < off, "{kind} hides nothing");
    }
    // Without anything in between, nothing is hidden: floor and wall alone. Rays start and end clear of both.
    let mut open = scene.clone();
    open.meshes.truncate(2);
    let session = Session::new(device(), &open).keep_all();
    let light = |values: &[(&str, &str)]| {
        let mut frames = frames(&session, &request("hierarchical", values, [256, 144]));
        mean_luminance(&frames.mean_over_frames("indirect", 8).unwrap().0)
    };
    let (off, on) = (light(&[]), light(&[("visibility", "surface")]));
    println!("nothing in between: {:.4} of the light without visibility", on / off);
    assert!((on / off - 1.0).abs() < 0.01, "surfaces hide themselves: {on} of {off}");
}

#[test]
fn rays_that_serve_several_samples_keep_the_mean() {
    let scene = bundled("bars");
    let session = Session::new(device(), &scene).keep_all();
    let mean = |rays, count| {
        let values = [("visibility", "surface"), ("samples_per_ray", rays), ("samples", "16"), ("storage", "float32")];
        let mut frames = frames(&session, &request("hierarchical", &values, [160, 90]));
        mean_luminance(&frames.mean_over_frames("indirect", count).unwrap().0)
    };
    let all = mean("1", 64);
    for rays in ["4", "16"] {
        let ratio = mean(rays, 64) / all;
        println!("{rays} samples a ray: {ratio:.4}");
        // 64 frames of 14,400 pixels leave under 0.3 % of noise.
        assert!((ratio - 1.0).abs() < 0.01, "{rays}: {ratio}");
    }
}

#[test]
fn without_a_scene_visibility_is_refused() {
    for kind in ["solid", "surface", "auto"] {
        let values = settings("hierarchical", &[("visibility", kind)]);
        let error = plan_technique(known("hierarchical"), &values, [64, 36]).unwrap_err().to_string();
        assert!(error.contains("hierarchical.visibility") && error.contains("off"), "{error}");
    }
    for technique in TECHNIQUES {
        match plan_technique(technique, &Default::default(), [64, 36]) {
            // With their defaults some read the scene itself; these say what to do.
            Err(error) => assert!(error.to_string().contains("only textures were given"), "{error}"),
            Ok(plan) => assert!(
                !plan.passes.iter().any(|pass| pass
                    .bindings
                    .iter()
                    .any(|&(_, id)| { plan.resources[id.0].name.starts_with("scene.") })),
                "{} binds the scene's buffers",
                technique.name
            ),
        }
    }
}
