//! Which textures and buffers of a plan share memory, because they do not live at once.
//!
//! A texture lives from the pass that writes it first to the last one that reads it. Only textures with contents of one
//! frame may share: the first pass writes all of it, and all its passes depend on the same things, so that no frame runs
//! a reader alone. [`Dependencies`] lets a reader of shared memory lead to its writers, for new numbers of a reader. Histories, outputs, and results of a
//! pass that runs less often than its readers keep their memory.

use std::{
    collections::{BTreeMap, BTreeSet},
    ops::RangeInclusive,
};

use super::{Dependencies, Dependency, FramePlan, Part, Pass, ResourceId, ResourceKind, Work};

/// Where the textures and buffers of a plan lie: see [`FramePlan::memory`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Memory {
    /// The first resource that lies in the memory of each resource.
    owners: Vec<ResourceId>,
    /// The last resource that lies in the memory of each resource.
    last: Vec<ResourceId>,
    /// First and last pass between which the contents of each resource live; `None` if they outlive the frame.
    lives: Vec<Option<RangeInclusive<usize>>>,
    /// Resources whose memory others use, too.
    shared: BTreeSet<ResourceId>,
}

impl Memory {
    /// The resource that provides the memory of this one: itself, or an earlier one of the same kind and size.
    pub fn owner(&self, id: ResourceId) -> ResourceId {
        self.owners[id.0]
    }

    /// Whether the contents of a resource are still there after a frame.
    pub fn outlives_frame(&self, id: ResourceId) -> bool {
        self.last[id.0] == id
    }

    /// Whether the contents of a resource live in one frame only, so that others may use its memory.
    pub fn is_of_one_frame(&self, id: ResourceId) -> bool {
        self.lives[id.0].is_some()
    }

    /// Resources whose memory others use, too.
    pub(super) fn shared(&self) -> &BTreeSet<ResourceId> {
        &self.shared
    }

    pub(super) fn of(plan: &FramePlan, dependencies: &Dependencies) -> Self {
        let touching = touching(plan);
        let causes = dependencies.causes();
        let mut kept: BTreeSet<ResourceId> = plan.outputs.values().copied().collect();
        kept.extend(plan.resources.iter().filter_map(|resource| match resource.kind {
            ResourceKind::Previous { of, .. } => Some(of),
            _ => None,
        }));
        let life = |id: ResourceId| if kept.contains(&id) { None } else { life(plan, id, &touching[id.0], &causes) };
        let lives: Vec<_> = (0..plan.resources.len()).map(ResourceId).map(life).collect();
        let mut order: Vec<usize> = (0..lives.len()).filter(|&index| lives[index].is_some()).collect();
        order.sort_by_key(|&index| lives[index].as_ref().map(|life| *life.start()));
        let own: Vec<_> = (0..lives.len()).map(ResourceId).collect();
        let (mut owners, mut last) = (own.clone(), own);
        // For each kind of memory, its places: the owner, the tenant so far, and the pass after which it is free.
        let mut places: BTreeMap<String, Vec<(usize, usize, usize)>> = BTreeMap::new();
        let mut shared = BTreeSet::new();
        for index in order {
            let (Some(class), Some(life)) = (class(&plan.resources[index].kind), &lives[index]) else { continue };
            let places = places.entry(class).or_default();
            // The place that became free last: what remains stays free for the longest time.
            let free =
                places.iter_mut().filter(|(_, _, until)| until < life.start()).max_by_key(|(_, _, until)| *until);
            match free {
                Some(place) => {
                    owners[index] = ResourceId(place.0);
                    shared.extend([place.1, index].map(ResourceId));
                    (place.1, place.2) = (index, *life.end());
                }
                None => places.push((index, index, *life.end())),
            }
        }
        for (owner, tenant, _) in places.into_values().flatten() {
            for (last, of) in last.iter_mut().zip(&owners) {
                if of.0 == owner {
                    *last = ResourceId(tenant);
                }
            }
        }
        Self { owners, last, lives, shared }
    }
}

/// The passes that read, write or clear each resource, in order.
fn touching(plan: &FramePlan) -> Vec<Vec<usize>> {
    let mut touching = vec![Vec::new(); plan.resources.len()];
    for (index, pass) in plan.passes.iter().enumerate() {
        let (read, written) = pass.reads_and_writes();
        for id in read.into_iter().chain(written).chain(pass.cleared.iter().copied()) {
            let passes: &mut Vec<usize> = &mut touching[id.0];
            if passes.last() != Some(&index) {
                passes.push(index);
            }
        }
    }
    touching
}

/// Between which passes a resource that is neither an output nor a history lives; `None` if a later frame may need its
/// contents.
fn life(
    plan: &FramePlan,
    id: ResourceId,
    passes: &[usize],
    causes: &[BTreeSet<Dependency>],
) -> Option<RangeInclusive<usize>> {
    let (&first, &last) = (passes.first()?, passes.last()?);
    let same_causes = passes.iter().all(|&pass| causes[pass] == causes[first]);
    let begins = begins(&plan.passes[first], id, &plan.resources[id.0].kind);
    (begins && same_causes).then_some(first..=last)
}

/// Whether nothing of the earlier contents of a resource is left after its first pass. A compute shader that writes a
/// texture writes all its texels: tests/tests/memory.rs checks this.
fn begins(pass: &Pass, id: ResourceId, kind: &ResourceKind) -> bool {
    let (read, written) = pass.reads_and_writes();
    match kind {
        ResourceKind::Buffer { .. } => pass.cleared.contains(&id),
        ResourceKind::Texture { layers, .. } => {
            let whole = match &pass.work {
                Work::Dispatch { .. } => true,
                // A draw clears one layer, or one tile of it.
                Work::Draw { tile, .. } => *layers == 1 && tile.is_none(),
                Work::Voxelize { .. } => *layers == 1,
            };
            whole && written.contains(&id) && !read.contains(&id)
        }
        _ => false,
    }
}

/// Resources of one class may lie in the same memory. The usage of a texture follows from its format.
fn class(kind: &ResourceKind) -> Option<String> {
    match kind {
        ResourceKind::Texture { size: [w, h], layers, format } => Some(format!("{format:?} {w} {h} {layers}")),
        ResourceKind::Buffer { size } => Some(format!("buffer {size}")),
        _ => None,
    }
}

impl FramePlan {
    /// Which textures and buffers share memory. [`crate::CompiledGraph::new`] allocates them so.
    pub fn memory(&self) -> Memory {
        Memory::of(self, &Dependencies::without_sharing(self))
    }

    /// Bytes that the plan allocates, without those of the caller.
    pub fn bytes(&self) -> u64 {
        let memory = self.memory();
        self.allocated(&memory, |_| true)
    }

    /// Bytes that the plan allocates for the technique: memory in which nothing but results of its passes lie.
    pub fn technique_bytes(&self) -> u64 {
        let (memory, own) = (self.memory(), self.written_by_technique());
        let mut only = own.clone();
        for (index, owner) in memory.owners.iter().enumerate() {
            only[owner.0] &= own[index];
        }
        self.allocated(&memory, |index| only[index])
    }

    /// The most bytes that live at once, without those of the caller: less than [`FramePlan::bytes`] if textures of
    /// different formats or sizes follow each other.
    pub fn live_bytes(&self) -> u64 {
        self.most_alive(|_| true)
    }

    /// As [`FramePlan::live_bytes`], of what passes of the technique write.
    pub fn live_technique_bytes(&self) -> u64 {
        let own = self.written_by_technique();
        self.most_alive(|index| own[index])
    }

    fn allocated(&self, memory: &Memory, counts: impl Fn(usize) -> bool) -> u64 {
        let owners = (0..self.resources.len()).filter(|&index| memory.owners[index].0 == index && counts(index));
        owners.map(|index| self.resources[index].bytes()).fold(0, u64::saturating_add)
    }

    fn most_alive(&self, counts: impl Fn(usize) -> bool) -> u64 {
        let memory = self.memory();
        let sum = |alive: &dyn Fn(usize) -> bool| {
            let alive = (0..self.resources.len()).filter(|&index| counts(index) && alive(index));
            alive.map(|index| self.resources[index].bytes()).fold(0, u64::saturating_add)
        };
        let always = sum(&|index| memory.lives[index].is_none());
        let during = |pass: usize| sum(&|index| memory.lives[index].as_ref().is_some_and(|life| life.contains(&pass)));
        always.saturating_add((0..self.passes.len()).map(during).max().unwrap_or(0))
    }

    /// Whether passes of the technique write each resource. Both textures of a history count.
    fn written_by_technique(&self) -> Vec<bool> {
        let mut written = vec![false; self.resources.len()];
        for pass in self.passes.iter().filter(|pass| pass.part == Part::Technique) {
            pass.reads_and_writes().1.into_iter().for_each(|id| written[id.0] = true);
        }
        for (index, resource) in self.resources.iter().enumerate() {
            if let ResourceKind::Previous { of, .. } = resource.kind {
                written[index] |= written[of.0];
            }
        }
        written
    }
}

#[cfg(test)]
mod tests;
