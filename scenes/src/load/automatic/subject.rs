//! What a camera should show: a scene without strays and without the ground around it.

use std::borrow::Cow;

use glam::Vec3;

use crate::{Mesh, Scene};

/// Bounds of a triangle, and its area.
#[derive(Clone, Copy)]
struct Item {
    low: Vec3,
    high: Vec3,
    area: f64,
}

/// A group that is farther from the rest than this many times the size of the rest is a stray, if it is small.
const STRAY: f32 = 4.0;

/// Largest share of the area of a stray.
const SMALL: f64 = 0.1;

/// The scene without triangles that lie far away from everything else, and without a ground that is more than twenty
/// times as large as what stands on it. The scene itself if it has neither.
pub(super) fn of(scene: &Scene) -> Cow<'_, Scene> {
    let items: Vec<Item> = scene.meshes.iter().flat_map(items).collect();
    let mut kept: Vec<usize> = (0..items.len()).collect();
    // Each round drops one group; a scene has few of them.
    for _ in 0..16 {
        let Some(rest) = without_stray(&items, &kept) else { break };
        kept = rest;
    }
    if let Some(rest) = without_ground(&items, &kept) {
        kept = rest;
    }
    if kept.len() == items.len() {
        return Cow::Borrowed(scene);
    }
    let mut keep = vec![false; items.len()];
    kept.into_iter().for_each(|i| keep[i] = true);
    let mut number = 0;
    let meshes = scene.meshes.iter().map(|mesh| {
        let mut part = Mesh { indices: Vec::new(), ..mesh.clone() };
        for triangle in mesh.indices.as_chunks::<3>().0 {
            if keep[number] {
                part.indices.extend(triangle);
            }
            number += 1;
        }
        // Bounds are those of all positions.
        let positions = part.indices.iter().map(|&i| mesh.positions[i as usize]).collect();
        let normals = part.indices.iter().map(|&i| mesh.normals[i as usize]).collect();
        let indices = (0..part.indices.len() as u32).collect();
        Mesh { positions, normals, indices, ..part }
    });
    Cow::Owned(Scene { meshes: meshes.collect(), ..Scene::default() })
}

fn items(mesh: &Mesh) -> impl Iterator<Item = Item> {
    mesh.indices.as_chunks::<3>().0.iter().map(|triangle| {
        let [a, b, c] = triangle.map(|i| Vec3::from(mesh.positions[i as usize]));
        let area = (b - a).as_dvec3().cross((c - a).as_dvec3()).length();
        Item { low: a.min(b).min(c), high: a.max(b).max(c), area }
    })
}

fn size(items: &[Item], which: &[usize]) -> f32 {
    let (low, high) = which
        .iter()
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), &i| (low.min(items[i].low), high.max(items[i].high)));
    (high - low).max_element()
}

fn area(items: &[Item], which: &[usize]) -> f64 {
    which.iter().map(|&i| items[i].area).sum()
}

/// The triangles on one side of the widest gap along an axis, if those on the other side are few and far away.
fn without_stray(items: &[Item], kept: &[usize]) -> Option<Vec<usize>> {
    for axis in 0..3 {
        let mut order = kept.to_vec();
        order.sort_by(|&a, &b| items[a].low[axis].total_cmp(&items[b].low[axis]));
        let mut reach = f32::NEG_INFINITY;
        let mut widest = (0.0, 0);
        for (at, &i) in order.iter().enumerate() {
            let gap = items[i].low[axis] - reach;
            if at > 0 && gap > widest.0 {
                widest = (gap, at);
            }
            reach = reach.max(items[i].high[axis]);
        }
        let (gap, at) = widest;
        if at == 0 {
            continue;
        }
        let (before, after) = order.split_at(at);
        let (few, many) = if area(items, before) < area(items, after) { (before, after) } else { (after, before) };
        if area(items, few) <= SMALL * area(items, kept) && gap > STRAY * size(items, many) {
            return Some(many.to_vec());
        }
    }
    None
}

/// The triangles around the middle eight tenths of all triangles, if those are much smaller than the whole.
fn without_ground(items: &[Item], kept: &[usize]) -> Option<Vec<usize>> {
    let mut range = [[0.0_f32; 2]; 3];
    for (axis, range) in range.iter_mut().enumerate() {
        let mut centres: Vec<f32> = kept.iter().map(|&i| 0.5 * (items[i].low[axis] + items[i].high[axis])).collect();
        centres.sort_by(f32::total_cmp);
        let at = |share: usize| centres.get(centres.len() * share / 10).copied();
        *range = [at(1)?, at(9)?];
    }
    let [low, high] = [0, 1].map(|end| Vec3::from_array(range.map(|range| range[end])));
    let detail = (high - low).max_element();
    if !(detail > 0.0 && 20.0 * detail < size(items, kept)) {
        return None;
    }
    let (low, high) = (low - detail, high + detail);
    let near = |&i: &usize| items[i].low.cmpge(low).all() && items[i].high.cmple(high).all();
    let near: Vec<usize> = kept.iter().copied().filter(near).collect();
    // Half of the triangles must be detail: otherwise the scene has a dense part and a sparse one. What is left must be
    // flat: a hall around a detailed statue is no ground.
    let far = kept.iter().filter(|&&i| !(items[i].low.cmpge(low).all() && items[i].high.cmple(high).all()));
    let (bottom, top) = far.fold((f32::INFINITY, f32::NEG_INFINITY), |(bottom, top), &i| {
        (bottom.min(items[i].low.y), top.max(items[i].high.y))
    });
    (2 * near.len() > kept.len() && top - bottom <= 2.0 * detail).then_some(near)
}
