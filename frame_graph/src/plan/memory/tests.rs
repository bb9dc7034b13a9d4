use halflight_shared_shaders::shadow::shadow_map::ShadowMap;
use wgpu::TextureFormat as Format;

use super::*;
use crate::plan::{Cause, Handle, Tile, test_passes};

const SIZE: [u32; 2] = [8, 4];
/// Bytes of a texture of this size and `Format::Rgba32Float`.
const BYTES: u64 = 8 * 4 * 16;

fn texture(plan: &mut FramePlan, name: &str) -> ResourceId {
    plan.texture(name, SIZE, Format::Rgba32Float, "test")
}

/// A pass that reads a texture and writes another.
fn pass(plan: &mut FramePlan, reads: ResourceId, writes: ResourceId) {
    let name = format!("pass_{}", plan.passes.len());
    test_passes::pass(plan, &name, reads, writes);
}

/// A draw into a layer or tile of a depth target that depends on a handle.
fn draw(plan: &mut FramePlan, handle: &'static str, target: ResourceId, layer: u32, tile: Option<Tile>) {
    let shadow_view = plan.changing_data(Handle::only(handle), handle, || vec![0; 80], "test");
    let vertices = plan.scene_buffer("scene.vertices", "test");
    let run = ShadowMap { shadow_view, vertices, alpha_tested: None, animated: None, triangles: None };
    let name = format!("draw_{}", plan.passes.len());
    let builder = plan.pass(Part::Direct, name, run);
    match tile {
        None => builder.draw([("all", None)], Vec::new(), (target, layer)),
        Some(tile) => builder.draw_tile([("all", None)], (target, layer), tile),
    }
}

/// A chain of textures from one that the caller gives to an output, each made from the one before.
fn chain<const N: usize>(names: [&str; N]) -> (FramePlan, [ResourceId; N]) {
    let mut plan = FramePlan::new(SIZE);
    let given = plan.external("given", "test");
    let ids = names.map(|name| texture(&mut plan, name));
    let mut before = given;
    for id in ids {
        pass(&mut plan, before, id);
        before = id;
    }
    plan.outputs.insert("final", before);
    (plan, ids)
}

#[test]
fn what_does_not_live_at_once_shares_memory() {
    let (plan, [a, b, c, d, e]) = chain(["a", "b", "c", "d", "e"]);
    let memory = plan.memory();
    // A pass reads one texture and writes the next, so two are alive in turn; the output has its own.
    assert_eq!([a, b, c, d, e].map(|id| memory.owner(id)), [a, b, a, b, e]);
    assert_eq!([a, b, c, d, e].map(|id| memory.outlives_frame(id)), [false, false, true, true, true]);
    assert_eq!((plan.bytes(), plan.live_bytes()), (3 * BYTES, 3 * BYTES));
    assert_eq!((plan.technique_bytes(), plan.live_technique_bytes()), (3 * BYTES, 3 * BYTES));
}

#[test]
fn other_sizes_formats_and_layers_do_not_share() {
    let mut plan = FramePlan::new(SIZE);
    let given = plan.external("given", "test");
    let a = texture(&mut plan, "a");
    let others = [
        plan.texture("size", [4, 8], Format::Rgba32Float, "test"),
        plan.texture("format", SIZE, Format::Rgba16Float, "test"),
        plan.texture_array("layers", SIZE, 2, Format::Rgba32Float, "test"),
    ];
    let end = texture(&mut plan, "end");
    pass(&mut plan, given, a);
    pass(&mut plan, a, end);
    others.into_iter().for_each(|id| pass(&mut plan, end, id));
    plan.outputs.insert("final", end);
    let memory = plan.memory();
    assert_eq!(others.map(|id| memory.owner(id)), others);
    // `a` is gone when the larger one of the others lives.
    assert_eq!(plan.bytes(), BYTES * (2 + 1 + 2) + BYTES / 2);
    assert_eq!(plan.live_bytes(), BYTES * (1 + 2));
}

#[test]
fn histories_and_outputs_keep_their_memory() {
    let (mut plan, [a, _, c, _]) = chain(["a", "b", "c", "d"]);
    assert_eq!(plan.memory().owner(c), a);
    plan.outputs.insert("a", a);
    assert_eq!(plan.memory().owner(c), c, "a is an output");
    plan.outputs.remove("a");
    plan.resources.push(crate::Resource {
        name: "a_before".into(),
        kind: ResourceKind::Previous { of: a, size: SIZE, format: Format::Rgba32Float },
        reason: "test".into(),
    });
    assert_eq!(plan.memory().owner(c), c, "a is a history");
}

#[test]
fn what_an_earlier_frame_left_keeps_its_memory() {
    let mut plan = FramePlan::new(SIZE);
    let [given, a, b, c, d] = ["given", "a", "b", "c", "d"].map(|name| texture(&mut plan, name));
    // Read before it is written.
    pass(&mut plan, a, b);
    pass(&mut plan, given, a);
    pass(&mut plan, b, c);
    pass(&mut plan, c, d);
    assert_eq!([a, c, d].map(|id| plan.memory().owner(id)), [a, c, b]);
}

#[test]
fn results_of_passes_that_run_less_often_keep_their_memory() {
    let mut plan = FramePlan::new(SIZE);
    let [map, scratch, other] =
        ["map", "scratch", "other"].map(|name| plan.texture(name, SIZE, crate::Gpu::DEPTH_FORMAT, "test"));
    let [a, b, c] = ["a", "b", "c"].map(|name| texture(&mut plan, name));
    let given = plan.external("given", "test");
    // The map changes with a light. Its reader also reads `a`, which changes with `given`: then the map must be there.
    draw(&mut plan, "light", map, 0, None);
    draw(&mut plan, "light", scratch, 0, None);
    draw(&mut plan, "camera", other, 0, None);
    pass(&mut plan, given, a);
    pass(&mut plan, map, b);
    plan.passes[4].bindings[1].1 = a;
    pass(&mut plan, b, c);
    plan.outputs.insert("final", c);
    let memory = plan.memory();
    assert_eq!([map, scratch, other].map(|id| memory.owner(id)), [map, scratch, scratch]);
    assert_eq!([a, b].map(|id| memory.owner(id)), [a, b]);
    let depends_on = |index: usize| Dependencies::of(&plan).causes()[index].len();
    assert_eq!([0, 1, 2, 3, 4].map(depends_on), [1, 1, 1, 1, 2], "sharing changes no schedule");
}

#[test]
fn a_reader_of_shared_memory_runs_with_its_writer() {
    let (plan, _) = chain(["a", "b", "c", "d", "e"]);
    let with = |dependencies: &Dependencies, first: usize| {
        let mut due = vec![None; plan.passes.len()];
        due[first] = Some(Cause::Numbers);
        dependencies.spread(&mut due, &mut vec![first]);
        due.iter().map(Option::is_some).collect::<Vec<_>>()
    };
    // New numbers of the last pass: its input was in memory that another texture took over in the frame before.
    assert_eq!(with(&Dependencies::without_sharing(&plan), 2), [false, false, true, true, true]);
    assert_eq!(with(&Dependencies::of(&plan), 2), [true; 5]);
    // The output has its own memory, and `d` lies in that of `b`.
    assert_eq!(with(&Dependencies::of(&plan), 4), [true; 5]);
}

#[test]
fn depth_that_is_drawn_in_parts_keeps_its_memory() {
    let plan = |tile: Option<Tile>, layers: u32| {
        let mut plan = FramePlan::new(SIZE);
        let ids = ["a", "b"].map(|name| plan.texture_array(name, SIZE, layers, crate::Gpu::DEPTH_FORMAT, "test"));
        ids.into_iter().for_each(|id| draw(&mut plan, "light", id, 0, tile));
        plan.memory().owner(ids[1]) == ids[0]
    };
    assert!(plan(None, 1));
    assert!(!plan(None, 2), "the other layer is as before");
    assert!(!plan(Some(Tile { corner: [0, 0], size: 2 }), 1), "the rest of the layer is as before");
}

#[test]
fn buffers_share_if_they_are_cleared() {
    let shares = |clears: [bool; 2], sizes: [u64; 2]| {
        let mut plan = FramePlan::new(SIZE);
        let out = texture(&mut plan, "out");
        let ids = [0, 1].map(|index| plan.buffer(format!("buffer_{index}"), sizes[index], "test"));
        for (id, clears) in ids.into_iter().zip(clears) {
            pass(&mut plan, out, out);
            if let Some(last) = plan.passes.last_mut() {
                last.cleared.extend(clears.then_some(id));
                last.continued.extend((!clears).then_some(id));
            }
        }
        plan.memory().owner(ids[1]) == ids[0]
    };
    assert!(shares([true, true], [64, 64]));
    assert!(!shares([true, false], [64, 64]));
    assert!(!shares([false, true], [64, 64]));
    assert!(!shares([true, true], [64, 128]));
}
