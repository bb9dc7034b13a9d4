//! State of a compiled graph that persists between frames.

use super::CompiledGraph;
use crate::{
    View,
    plan::{FramePlan, Resource, ResourceId, ResourceKind},
};

/// The history state of a compiled graph.
#[derive(Clone, Copy, Default)]
pub(super) struct HistoryState {
    /// The view of the last frame; `None` before the first one.
    pub(super) last: Option<View>,
    /// Ping-pong index: which texture of each history the last frame wrote.
    pub(super) ping_pong: usize,
    /// Number of frames since anything changed.
    pub(super) static_frames: u32,
    /// Whether passes that run once have run.
    pub(super) prepared: bool,
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
