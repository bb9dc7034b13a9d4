//! State of a compiled graph that persists between frames: histories, and which passes are due.

use super::CompiledGraph;
use crate::{
    View,
    plan::{Cause, Dependencies, Dependency, FramePlan, Handle, Resource, ResourceId, ResourceKind},
};

/// What the caller has changed since the last frame. The graph itself sees changes of the view, of settings
/// ([`CompiledGraph::update`]) and of its own buffers ([`CompiledGraph::write_changed`]).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Changed<'a> {
    /// Perhaps everything. Every pass runs, except those of which no input ever changes. This is the cost that
    /// comparisons of techniques use.
    Anything,
    /// Nothing but the state behind these handles.
    Only(&'a [Handle]),
}

/// The state of a compiled graph between frames.
pub(super) struct FrameState {
    /// The view of the last frame; `None` before the first one.
    pub(super) last: Option<View>,
    /// Ping-pong index: which texture of each history the last frame wrote.
    pub(super) ping_pong: usize,
    /// Number of frames since anything changed.
    pub(super) static_frames: u32,
    /// Why each pass must run in the next frame, as far as that is known before it.
    stale: Vec<Option<Cause>>,
    /// Why each pass ran in the last frame.
    pub(super) ran: Vec<Option<Cause>>,
    /// Scratch memory of [`FrameState::find_due`].
    stack: Vec<usize>,
}

impl FrameState {
    /// The state before the first frame of this many passes.
    pub(super) fn new(passes: usize) -> Self {
        Self {
            last: None,
            ping_pong: 0,
            static_frames: 0,
            stale: vec![Some(Cause::First); passes],
            ran: vec![None; passes],
            stack: Vec::with_capacity(passes),
        }
    }

    /// The next frame runs this pass.
    pub(super) fn mark(&mut self, pass: usize, cause: Cause) {
        self.stale[pass].get_or_insert(cause);
    }

    /// Determines the passes of a frame with this view.
    pub(super) fn find_due(&mut self, dependencies: &Dependencies, view: &View, changed: Changed) {
        let camera = |view: &View| (view.world_to_view, view.tan_half_fov, view.near);
        let moved = self.last.is_none_or(|last| camera(&last) != camera(view));
        let advanced = self.last.is_none_or(|last| (last.frame, last.seed) != (view.frame, view.seed));
        let has_changed = |dependency: &Dependency| match (changed, dependency) {
            (Changed::Anything, _) | (_, Dependency::History) => true,
            (_, Dependency::Camera) => moved,
            (_, Dependency::Frame) => advanced,
            (Changed::Only(handles), Dependency::Handle(handle)) => handles.contains(handle),
        };
        for (pass, (stale, direct)) in self.stale.iter_mut().zip(&dependencies.direct).enumerate() {
            let cause = stale.take().or_else(|| direct.iter().copied().find(has_changed).map(Cause::Changed));
            self.ran[pass] = cause;
            self.stack.extend(cause.map(|_| pass));
        }
        dependencies.spread(&mut self.ran, &mut self.stack);
    }
}

/// The texture of `id` at this ping-pong index: at index 1 the two textures of a history are swapped.
pub(super) fn resolve_history(plan: &FramePlan, id: ResourceId, ping_pong: usize) -> ResourceId {
    if ping_pong == 0 {
        return id;
    }
    if let ResourceKind::Previous { of, .. } = plan.resources[id.0].kind {
        return of;
    }
    let before = |resource: &Resource| matches!(resource.kind, ResourceKind::Previous { of, .. } if of == id);
    plan.resources.iter().position(before).map_or(id, ResourceId)
}

/// Keeps the histories of another graph. Returns false and keeps none if a history of the plan has no match.
pub(super) fn adopt_histories(plan: &FramePlan, textures: &mut [Option<wgpu::Texture>], old: &CompiledGraph) -> bool {
    let pairs = |plan: &FramePlan| -> Vec<(usize, usize)> {
        let pair = |(index, resource): (usize, &Resource)| match resource.kind {
            ResourceKind::Previous { of, .. } => Some((of.0, index)),
            _ => None,
        };
        plan.resources.iter().enumerate().filter_map(pair).collect()
    };
    let old_pairs = pairs(&old.plan);
    let found: Option<Vec<_>> = pairs(plan)
        .into_iter()
        .map(|(now, before)| {
            let same = |&&(old_now, _): &&(usize, usize)| {
                let (own, other) = (&plan.resources[now], &old.plan.resources[old_now]);
                own.name == other.name && own.kind == other.kind
            };
            old_pairs.iter().find(same).map(|&(old_now, old_before)| [(now, old_now), (before, old_before)])
        })
        .collect();
    let found = found.unwrap_or_default();
    for (own, other) in found.iter().flatten() {
        textures[*own].clone_from(&old.textures[*other]);
    }
    !found.is_empty()
}
