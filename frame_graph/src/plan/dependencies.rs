//! What each pass of a plan depends on, and therefore when it runs.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt,
};

use halflight_shared_shaders::BindingKind;
use serde::Serialize;

use super::{FramePlan, Handle, Memory, Pass, ResourceId, ResourceKind, Work};

/// Something outside a plan that the results of its passes depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Dependency {
    /// Position, direction, field of view or near plane of the camera.
    Camera,
    /// The frame number or the seed of random numbers.
    Frame,
    /// The results of the previous frame.
    History,
    /// State of the caller.
    Handle(Handle),
}

impl fmt::Display for Dependency {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Camera => f.write_str("the camera"),
            Self::Frame => f.write_str("the frame number"),
            Self::History => f.write_str("the previous frame"),
            Self::Handle(handle) => handle.fmt(f),
        }
    }
}

/// Kind and index, for example `light_view 2`. The index of the only one of its kind is left out.
impl fmt::Display for Handle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.index {
            Handle::ONLY => f.write_str(self.kind),
            index => write!(f, "{} {index}", self.kind),
        }
    }
}

/// When a pass runs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum When {
    /// In the first frame: nothing that it depends on changes.
    Once,
    /// When one of these changes.
    Changed(Vec<Dependency>),
    /// In every frame, because this is different in every frame.
    EveryFrame(Dependency),
}

impl fmt::Display for When {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Once => f.write_str("once"),
            Self::EveryFrame(cause) => write!(f, "every frame: depends on {cause}"),
            Self::Changed(causes) => {
                f.write_str("when this changes: ")?;
                for (index, cause) in causes.iter().enumerate() {
                    write!(f, "{}{cause}", if index > 0 { ", " } else { "" })?;
                }
                Ok(())
            }
        }
    }
}

/// Why a pass ran in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// It had not run before.
    First,
    /// This has changed.
    Changed(Dependency),
    /// Its uniform block or a buffer of the plan has new numbers.
    Numbers,
    /// It was recorded for a measurement, outside of a frame.
    Repeated,
    /// The pass of this index ran, whose results it reads or continues.
    Pass(usize),
}

/// A layer of a depth target, and the corner of a tile in it. A layer is drawn either whole or in tiles. Or a part of a
/// buffer.
type Layer = (u32, Option<[u32; 2]>);

/// A resource, or a layer of it.
type Place = (ResourceId, Option<Layer>);

/// The dependencies between the passes of a plan.
#[derive(Clone, Debug, Default)]
pub(crate) struct Dependencies {
    /// What each pass reads that no pass writes.
    pub(crate) direct: Vec<BTreeSet<Dependency>>,
    /// The passes that must run in the same frame as each pass.
    pub(crate) leads_to: Vec<Vec<usize>>,
}

impl Dependencies {
    pub(crate) fn of(plan: &FramePlan) -> Self {
        // Contents in shared memory are gone in the next frame.
        Self::if_shared(plan, Memory::of(plan, &Self::without_sharing(plan)).shared())
    }

    /// The dependencies of a plan whose textures and buffers all have memory of their own.
    pub(super) fn without_sharing(plan: &FramePlan) -> Self {
        Self::if_shared(plan, &BTreeSet::new())
    }

    /// The dependencies of a plan in which the memory of these resources is shared.
    fn if_shared(plan: &FramePlan, shared: &BTreeSet<ResourceId>) -> Self {
        let writes: Vec<Vec<Place>> = plan.passes.iter().map(places_written).collect();
        let reads: Vec<Vec<ResourceId>> = plan.passes.iter().map(|pass| pass.reads_and_writes().0).collect();
        let mut leads_to = vec![BTreeSet::new(); plan.passes.len()];
        for resource in (0..plan.resources.len()).map(ResourceId) {
            link(resource, plan, shared.contains(&resource), (&writes, &reads), &mut leads_to);
        }
        let mut direct: Vec<_> = plan.passes.iter().map(|pass| direct(plan, pass)).collect();
        let mut first_writer = vec![None; plan.resources.len()];
        for (pass, written) in writes.iter().enumerate() {
            for (id, _) in written {
                first_writer[id.0].get_or_insert(pass);
            }
        }
        for (pass, read) in reads.iter().enumerate() {
            // Nothing has written it yet in this frame.
            if read.iter().any(|id| first_writer[id.0].is_some_and(|first| first >= pass)) {
                direct[pass].insert(Dependency::History);
            }
        }
        Self { direct, leads_to: leads_to.into_iter().map(|next| next.into_iter().collect()).collect() }
    }

    /// Whether some pass depends on results of the previous frame.
    pub(crate) fn have_history(&self) -> bool {
        self.direct.iter().any(|direct| direct.contains(&Dependency::History))
    }

    /// What each pass reads, itself or through other passes, that no pass writes: it runs when any of it changes.
    pub(super) fn causes(&self) -> Vec<BTreeSet<Dependency>> {
        let mut all = vec![BTreeSet::new(); self.direct.len()];
        // A plan has many passes and few things that they depend on.
        let mut passes_of: BTreeMap<Dependency, Vec<usize>> = BTreeMap::new();
        for (pass, direct) in self.direct.iter().enumerate() {
            direct.iter().for_each(|&cause| passes_of.entry(cause).or_default().push(pass));
        }
        for (cause, mut first) in passes_of {
            while let Some(pass) = first.pop() {
                if all[pass].insert(cause) {
                    first.extend(&self.leads_to[pass]);
                }
            }
        }
        all
    }

    /// Adds to `due`, which has the passes of `first`, all that must run with them.
    pub(crate) fn spread(&self, due: &mut [Option<Cause>], first: &mut Vec<usize>) {
        while let Some(pass) = first.pop() {
            for &next in &self.leads_to[pass] {
                if due[next].is_none() {
                    due[next] = Some(Cause::Pass(pass));
                    first.push(next);
                }
            }
        }
    }
}

/// Adds what one resource demands: a pass runs when a pass has run whose results it reads, and when its own inputs would
/// otherwise be lost.
fn link(
    resource: ResourceId,
    plan: &FramePlan,
    is_shared: bool,
    (writes, reads): (&[Vec<Place>], &[Vec<ResourceId>]),
    leads_to: &mut [BTreeSet<usize>],
) {
    let written = |pass: usize| writes[pass].iter().filter(move |(id, _)| *id == resource).map(|(_, part)| *part);
    let writers = (0..writes.len()).flat_map(|pass| written(pass).map(move |part| (part, pass)));
    let mut by_part: BTreeMap<Option<Layer>, Vec<usize>> = BTreeMap::new();
    for (part, pass) in writers {
        by_part.entry(part).or_default().push(pass);
    }
    if by_part.contains_key(&None) {
        // A pass that writes all of it has to do with every part.
        let mut all: Vec<usize> = std::mem::take(&mut by_part).into_values().flatten().collect();
        all.sort_unstable();
        by_part.insert(None, all);
    }
    let is_output = plan.outputs.values().any(|&id| id == resource);
    let readers: Vec<usize> = (0..reads.len()).filter(|&pass| reads[pass].contains(&resource)).collect();
    for writers in by_part.into_values() {
        let contents = Contents { is_shared, is_output, ..Contents::of(plan, resource, &writers) };
        link_part(&contents, &readers, leads_to);
    }
}

/// The passes that write one place, in order, each with the version of the contents that it leaves or continues.
struct Contents {
    writers: Vec<(usize, usize)>,
    /// Whether other contents lie in the same memory before or after.
    is_shared: bool,
    is_output: bool,
}

impl Contents {
    fn of(plan: &FramePlan, resource: ResourceId, writers: &[usize]) -> Self {
        let mut version = 0;
        let numbered = writers.iter().enumerate().map(|(index, &pass)| {
            version += usize::from(index > 0 && plan.passes[pass].starts_anew(resource));
            (pass, version)
        });
        Self { writers: numbered.collect(), is_shared: false, is_output: false }
    }
}

/// Links the passes of one place. Those of a version lead to each other in a ring, so that the number of links grows with
/// the number of passes only: whatever reaches one of them reaches all.
fn link_part(contents: &Contents, readers: &[usize], leads_to: &mut [BTreeSet<usize>]) {
    let writers = &contents.writers;
    let Some(&(last, newest)) = writers.last() else { return };
    let mut connect = |from: usize, to: usize| {
        if from != to {
            leads_to[from].insert(to);
        }
    };
    for version in writers.chunk_by(|(_, a), (_, b)| a == b) {
        // Passes of one version continue each other's work.
        let next = version.iter().cycle().skip(1);
        version.iter().zip(next).for_each(|(&(pass, _), &(next, _))| connect(pass, next));
        if contents.is_output {
            // Callers see the last version.
            connect(version[0].0, last);
        }
    }
    for &reader in readers {
        let before = writers.partition_point(|&(pass, _)| pass < reader);
        let Some(&(writer, _)) = before.checked_sub(1).map(|index| &writers[index]) else { continue };
        connect(writer, reader);
        // Other passes write the same place before or after, so the inputs may be gone in the next frame.
        if reader < last || newest > 0 || contents.is_shared {
            connect(reader, writer);
        }
    }
}

/// What a pass writes: of arrays the layer and of buffers the part, where it is known.
fn places_written(pass: &Pass) -> Vec<Place> {
    let (_, written) = pass.reads_and_writes();
    let layer = |id: ResourceId| match pass.work {
        Work::Draw { depth: (target, layer), tile, .. } if target == id => Some((layer, tile.map(|tile| tile.corner))),
        _ => pass.parts.iter().find(|(buffer, _)| *buffer == id).map(|&(_, part)| (part, None)),
    };
    let cleared = pass.cleared.iter().filter(|id| !written.contains(id)).copied().collect::<Vec<_>>();
    written.into_iter().chain(cleared).map(|id| (id, layer(id))).collect()
}

/// What a pass reads from outside the plan.
fn direct(plan: &FramePlan, pass: &Pass) -> BTreeSet<Dependency> {
    let mut found = BTreeSet::new();
    let shaders = match &pass.work {
        Work::Draw { draws, .. } => draws.iter().map(|draw| draw.shader).collect(),
        _ => vec![pass.shader],
    };
    for binding in shaders.iter().flat_map(|shader| shader.entry_points).flat_map(|entry| entry.bindings) {
        match (&binding.kind, binding.name) {
            (BindingKind::Uniform { members, .. }, "view") => {
                for member in members.iter().filter(|member| member.read) {
                    match member.name {
                        "frame" | "seed" => drop(found.insert(Dependency::Frame)),
                        _ => drop(found.insert(Dependency::Camera)),
                    }
                }
            }
            (BindingKind::Uniform { .. }, "previous") => drop(found.insert(Dependency::History)),
            _ => {}
        }
    }
    let has_history = |id: ResourceId| {
        plan.resources.iter().any(|other| matches!(other.kind, ResourceKind::Previous { of, .. } if of == id))
    };
    for &(_, id) in &pass.bindings {
        match &plan.resources[id.0].kind {
            ResourceKind::Previous { .. } => drop(found.insert(Dependency::History)),
            ResourceKind::External { handle } | ResourceKind::Data { handle, .. } => {
                found.extend(handle.map(Dependency::Handle));
            }
            // The two textures of a history swap roles after every frame.
            ResourceKind::Texture { .. } if has_history(id) => drop(found.insert(Dependency::History)),
            ResourceKind::Texture { .. } | ResourceKind::Buffer { .. } => {}
        }
    }
    found
}

impl FramePlan {
    /// When each pass runs.
    pub fn schedule(&self) -> Vec<When> {
        let when = |causes: BTreeSet<Dependency>| {
            let every = [Dependency::History, Dependency::Frame].into_iter().find(|cause| causes.contains(cause));
            match every {
                Some(cause) => When::EveryFrame(cause),
                None if causes.is_empty() => When::Once,
                None => When::Changed(causes.into_iter().collect()),
            }
        };
        Dependencies::of(self).causes().into_iter().map(when).collect()
    }
}

#[cfg(test)]
mod tests {
    use halflight_shared_shaders::{shadow::shadow_map::ShadowMap, sky::Sky};
    use wgpu::TextureFormat as Format;

    use super::*;
    use crate::plan::{Part, Tile, test_passes::pass};

    const SIZE: [u32; 2] = [4, 4];

    fn texture(plan: &mut FramePlan, name: &str) -> ResourceId {
        plan.texture(name, SIZE, Format::Rgba32Float, "test")
    }

    fn shadow_map(plan: &mut FramePlan) -> ShadowMap<ResourceId> {
        let [shadow_view, vertices] = ["scene.view", "scene.vertices"].map(|name| plan.scene_buffer(name, "test"));
        ShadowMap { shadow_view, vertices, alpha_tested: None, animated: None, triangles: None }
    }

    /// Names of the passes that run with this one.
    fn with(plan: &FramePlan, first: &str) -> Vec<String> {
        let index = plan.passes.iter().position(|pass| pass.name == first).expect("a pass");
        let mut due = vec![None; plan.passes.len()];
        due[index] = Some(Cause::First);
        Dependencies::of(plan).spread(&mut due, &mut vec![index]);
        plan.passes.iter().zip(due).filter(|(_, due)| due.is_some()).map(|(pass, _)| pass.name.clone()).collect()
    }

    #[test]
    fn readers_follow_writers_and_not_the_other_way() {
        let mut plan = FramePlan::new(SIZE);
        let [given, a, b] = ["given", "a", "b"].map(|name| texture(&mut plan, name));
        pass(&mut plan, "first", given, a);
        pass(&mut plan, "second", a, b);
        assert_eq!(with(&plan, "first"), ["first", "second"]);
        assert_eq!(with(&plan, "second"), ["second"], "its input is still there");
    }

    #[test]
    fn passes_that_write_into_the_same_contents_run_together() {
        let mut plan = FramePlan::new(SIZE);
        let [given, a, b] = ["given", "a", "b"].map(|name| texture(&mut plan, name));
        pass(&mut plan, "first", given, a);
        pass(&mut plan, "between", a, b);
        // Writes where there is no surface.
        let environment = plan.scene_buffer("scene.environment", "test");
        plan.pass(Part::Direct, "sky", Sky { depth: given, environment, direct: a, float16: false }).over(SIZE);
        let all = ["first", "between", "sky"];
        assert_eq!(with(&plan, "first"), all);
        assert_eq!(with(&plan, "between"), all, "the contents that it read have been written over");
        assert_eq!(with(&plan, "sky"), all);
    }

    #[test]
    fn contents_that_are_replaced_are_made_again_for_their_own_readers() {
        let mut plan = FramePlan::new(SIZE);
        let [scratch, depth, b, c] = ["scratch", "depth", "b", "c"].map(|name| texture(&mut plan, name));
        for (number, result) in [(0, b), (1, c)] {
            // A draw clears its targets.
            let run = shadow_map(&mut plan);
            plan.pass(Part::Direct, format!("draw_{number}"), run).draw([("all", None)], vec![scratch], (depth, 0));
            pass(&mut plan, &format!("use_{number}"), scratch, result);
        }
        assert_eq!(with(&plan, "draw_0"), ["draw_0", "use_0"]);
        assert_eq!(with(&plan, "use_0"), ["draw_0", "use_0"]);
        assert_eq!(with(&plan, "use_1"), ["draw_1", "use_1"], "the first pass may have run alone before");
        // A caller who reads the texture after a frame expects its last contents.
        plan.outputs.insert("image", scratch);
        assert_eq!(with(&plan, "draw_0"), ["draw_0", "use_0", "draw_1", "use_1"]);
    }

    #[test]
    fn layers_and_tiles_are_independent() {
        let mut plan = FramePlan::new(SIZE);
        let [maps, result] = ["maps", "result"].map(|name| texture(&mut plan, name));
        for layer in 0..2 {
            let run = shadow_map(&mut plan);
            plan.pass(Part::Direct, format!("layer_{layer}"), run).draw([("all", None)], Vec::new(), (maps, layer));
        }
        for corner in [[0, 0], [2, 0]] {
            let run = shadow_map(&mut plan);
            let tile = Tile { corner, size: 2 };
            plan.pass(Part::Direct, format!("tile_{}", corner[0]), run).draw_tile([("all", None)], (maps, 2), tile);
        }
        pass(&mut plan, "read", maps, result);
        for part in ["layer_0", "layer_1", "tile_0", "tile_2"] {
            assert_eq!(with(&plan, part), [part, "read"]);
        }
        assert_eq!(with(&plan, "read"), ["read"], "all of them are still there");
    }

    #[test]
    fn what_is_read_before_it_is_written_comes_from_the_previous_frame() {
        let mut plan = FramePlan::new(SIZE);
        let [given, a, b] = ["given", "a", "b"].map(|name| texture(&mut plan, name));
        pass(&mut plan, "reads", a, b);
        pass(&mut plan, "writes", given, a);
        assert_eq!(plan.schedule()[0], When::EveryFrame(Dependency::History));
        assert_eq!(plan.schedule()[1], When::Once);
    }
}
