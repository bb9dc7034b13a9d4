//! Animated nodes as motions of their meshes, cameras and lights.
//!
//! A motion holds a translation, a rotation and factors along the axes of the world, about a pivot. The animation of a
//! node and its ancestors is sampled at every frame, so curves of every kind are followed. Frames between which all
//! numbers are linear are left out again.

use std::collections::BTreeMap;

use ::gltf::animation::{Interpolation, Property};
use ::gltf::json::validation::Checked;
use glam::{DMat3, DMat4, DQuat, DVec3, EulerRot};

use super::super::camera::View;
use super::Source;
use super::tree::{LARGEST, Placed, Pose, in_range, local};
use crate::{Keyframe, Motion};

/// Frames per second of an animation.
const RATE: f32 = 30.0;

/// Last frame that is read: five minutes.
const LAST: u32 = 9000;

/// Most frames between two keyframes.
const LONGEST: usize = 300;

/// The values of one property over time.
struct Curve {
    property: Property,
    interpolation: Interpolation,
    /// Seconds, ascending.
    times: Vec<f32>,
    /// One for each time, or three for cubic splines: tangent in, value, tangent out.
    values: Vec<[f32; 4]>,
}

impl Curve {
    fn value(&self, key: usize) -> [f32; 4] {
        if self.interpolation == Interpolation::CubicSpline { self.values[3 * key + 1] } else { self.values[key] }
    }

    /// The value at a time; constant before the first and after the last key.
    fn at(&self, time: f32) -> [f32; 4] {
        let next = self.times.partition_point(|&t| t <= time);
        if next == 0 || next == self.times.len() {
            return self.value(next.saturating_sub(1));
        }
        let (a, b) = (next - 1, next);
        let length = self.times[b] - self.times[a];
        let t = if length > 0.0 { (time - self.times[a]) / length } else { 0.0 };
        let (from, to) = (self.value(a), self.value(b));
        match self.interpolation {
            Interpolation::Step => from,
            Interpolation::Linear if self.property == Property::Rotation => {
                let [from, to] = [from, to].map(|q| DQuat::from_array(q.map(f64::from)).normalize());
                from.slerp(to, f64::from(t)).to_array().map(|x| x as f32)
            }
            Interpolation::Linear => std::array::from_fn(|i| from[i] + t * (to[i] - from[i])),
            Interpolation::CubicSpline => {
                let (leaving, arriving) = (self.values[3 * a + 2], self.values[3 * b]);
                let (t2, t3) = (t * t, t * t * t);
                std::array::from_fn(|i| {
                    (2.0 * t3 - 3.0 * t2 + 1.0) * from[i]
                        + length * (t3 - 2.0 * t2 + t) * leaving[i]
                        + (3.0 * t2 - 2.0 * t3) * to[i]
                        + length * (t3 - t2) * arriving[i]
                })
            }
        }
    }
}

/// The animated nodes of a scene.
pub(super) struct Animation<'a> {
    nodes: &'a [Placed<'a>],
    curves: BTreeMap<usize, Vec<Curve>>,
    /// Whether each node moves: it or an ancestor has a curve.
    moves: Vec<bool>,
}

impl<'a> Animation<'a> {
    pub fn new(source: &mut Source, nodes: &'a [Placed<'a>]) -> Self {
        let curves = curves(source);
        let mut moves = vec![false; nodes.len()];
        // Parents come first.
        for (i, placed) in nodes.iter().enumerate() {
            moves[i] = curves.contains_key(&placed.node.index()) || placed.parent.is_some_and(|parent| moves[parent]);
        }
        Self { nodes, curves, moves }
    }

    /// The motion of the node at `index` about its own origin; `None` for a static node and, with a note, for a motion that
    /// cannot be represented.
    pub fn motion(&self, source: &mut Source, index: usize) -> Option<Motion> {
        if !self.moves[index] {
            return None;
        }
        let motion = self.sampled(index, in_range).and_then(|worlds| motion(self.nodes[index].to_world, &worlds));
        if motion.is_none() {
            source
                .notes
                .add("animations that mirror, flatten or shear something, or move it out of range, are not drawn; it stays in its rest pose");
        }
        motion
    }

    /// Eye and target of a camera at the node at `index`, at frames between which both are linear; empty for a static one.
    pub fn path(&self, index: usize) -> Vec<(u32, [DVec3; 2])> {
        if !self.moves[index] {
            return Vec::new();
        }
        let view = |world: DMat4| Some(View::of_node(in_range(world)?, 0.0)?.eye_and_target());
        let Some(views) = self.sampled(index, view) else { return Vec::new() };
        // Relative to the first eye, so that float32 is enough to compare them.
        let relative = |p: DVec3| (p - views[0][0]).as_vec3().to_array();
        let keys = views.iter().zip(0..).map(|(&[eye, target], frame)| Keyframe {
            frame,
            translate: relative(eye),
            rotate_degrees: relative(target),
            ..Keyframe::default()
        });
        without_linear(keys.collect()).into_iter().map(|key| (key.frame, views[key.frame as usize])).collect()
    }

    /// What `of` makes of the node's transform at every frame; `None` if it fails for one of them.
    fn sampled<T>(&self, index: usize, of: impl Fn(DMat4) -> Option<T>) -> Option<Vec<T>> {
        let mut chain = vec![index];
        while let Some(parent) = chain.last().and_then(|&i| self.nodes[i].parent) {
            chain.push(parent);
        }
        // What is above the roots does not move: the transform of the model.
        let root = &self.nodes[*chain.last()?];
        let above = root.to_world * local(&root.node).inverse();
        if !above.is_finite() {
            return None;
        }
        let at = |time: f32| {
            chain.iter().rev().fold(above, |matrix, &i| {
                let node = &self.nodes[i].node;
                let curves = self.curves.get(&node.index());
                matrix * curves.map_or_else(|| local(node), |curves| posed(node, curves, time))
            })
        };
        let all = chain.iter().filter_map(|&i| self.curves.get(&self.nodes[i].node.index())).flatten();
        let last = all.filter_map(|curve| curve.times.last()).fold(0.0_f32, |last, &time| last.max(time));
        let frames = ((last * RATE).ceil() as u32).min(LAST);
        (0..=frames).map(|frame| of(at(frame as f32 / RATE))).collect()
    }
}

/// The curves of the first animation, by node.
fn curves(source: &mut Source) -> BTreeMap<usize, Vec<Curve>> {
    let mut found: BTreeMap<usize, Vec<Curve>> = BTreeMap::new();
    if source.document.animations().len() > 1 {
        source.notes.add("only the first animation of the file is played");
    }
    for channel in source.document.animations().next().iter().flat_map(|animation| animation.channels()) {
        let (target, sampler) = (channel.target(), channel.sampler());
        // The crate takes a known property for granted.
        let json = &source.document.as_json().animations[channel.animation().index()].channels[channel.index()];
        let Checked::Valid(property) = json.target.path else {
            source.notes.add("an animation of something other than translation, rotation and scale is not played");
            continue;
        };
        let output = sampler.output();
        let values = match property {
            Property::Rotation => source.buffers.vectors::<4>(&output),
            Property::Translation | Property::Scale => source
                .buffers
                .vectors::<3>(&output)
                .map(|values| values.into_iter().map(|[x, y, z]| [x, y, z, 0.0]).collect()),
            Property::MorphTargetWeights => continue,
        };
        let times = source.buffers.vectors::<1>(&sampler.input());
        let (Ok(values), Ok(times)) = (values, times) else {
            source.notes.add("an animation lies beyond its buffer and is not played");
            continue;
        };
        let times: Vec<f32> = times.into_iter().map(|[t]| t).collect();
        let interpolation = sampler.interpolation();
        let per_key = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        let finite = values.as_flattened().iter().chain(&times).all(|x| x.is_finite());
        if times.is_empty() || values.len() < per_key * times.len() || !finite || !times.is_sorted() {
            source.notes.add("a damaged animation is not played");
            continue;
        }
        let curve = Curve { property, interpolation, times, values };
        found.entry(target.node().index()).or_default().push(curve);
    }
    found
}

/// The motion from the rest pose through these transforms, one per frame; `None` if it cannot be represented.
fn motion(rest: DMat4, worlds: &[DMat4]) -> Option<Motion> {
    let inverse = DMat3::from_mat4(rest).inverse();
    if !inverse.is_finite() {
        return None;
    }
    let mut keys: Vec<Keyframe> = Vec::with_capacity(worlds.len());
    for (world, frame) in worlds.iter().zip(0..) {
        let (rotation, scale) = rotation_and_scale(DMat3::from_mat4(*world) * inverse)?;
        let translate = (world.w_axis - rest.w_axis).truncate().as_vec3().to_array();
        let before = keys.last().map_or([0.0; 3], |key| key.rotate_degrees);
        let rotate_degrees = nearest_angles(rotation, before);
        keys.push(Keyframe { frame, translate, rotate_degrees, scale: scale.as_vec3().to_array() });
    }
    Some(Motion { pivot: [0.0; 3], keyframes: without_linear(keys) })
}

fn posed(node: &::gltf::Node, curves: &[Curve], time: f32) -> DMat4 {
    let (translation, rotation, scale) = node.transform().decomposed();
    let mut pose = Pose { translation, rotation, scale };
    for curve in curves {
        let [x, y, z, w] = curve.at(time);
        match curve.property {
            Property::Translation => pose.translation = [x, y, z],
            Property::Rotation => pose.rotation = [x, y, z, w],
            Property::Scale => pose.scale = [x, y, z],
            Property::MorphTargetWeights => {}
        }
    }
    pose.matrix()
}

/// A matrix as a rotation after factors along the axes, all above 0 and in range.
fn rotation_and_scale(linear: DMat3) -> Option<(DQuat, DVec3)> {
    let columns = [linear.x_axis, linear.y_axis, linear.z_axis];
    let scale = columns.map(DVec3::length);
    if linear.determinant() <= 0.0 || scale.iter().any(|s| !(1e-6..=LARGEST).contains(s)) {
        return None;
    }
    let [x, y, z] = [0, 1, 2].map(|i| columns[i] / scale[i]);
    // Columns of a rotation stand at right angles, within rounding.
    if [x.dot(y), y.dot(z), z.dot(x)].iter().any(|dot| dot.abs() > 1e-3) {
        return None;
    }
    Some((DQuat::from_mat3(&DMat3::from_cols(x, y, z)).normalize(), DVec3::from(scale)))
}

/// Rotations about x, then y, then z, degrees, near those of the frame before: angles are interpolated one by one.
fn nearest_angles(rotation: DQuat, before: [f32; 3]) -> [f32; 3] {
    let (z, y, x) = rotation.to_euler(EulerRot::ZYX);
    let near = |angles: [f64; 3]| -> [f32; 3] {
        std::array::from_fn(|i| {
            let turns = ((f64::from(before[i]) - angles[i]) / 360.0).round();
            (angles[i] + 360.0 * turns) as f32
        })
    };
    let [x, y, z] = [x, y, z].map(f64::to_degrees);
    let [one, other] = [near([x, y, z]), near([x + 180.0, 180.0 - y, z + 180.0])];
    let distance = |angles: [f32; 3]| (0..3).map(|i| (angles[i] - before[i]).abs()).fold(0.0, f32::max);
    if distance(one) <= distance(other) { one } else { other }
}

/// The keyframes without those that linear interpolation between their neighbours gives, too.
fn without_linear(keys: Vec<Keyframe>) -> Vec<Keyframe> {
    let numbers = |key: &Keyframe| [key.translate, key.rotate_degrees, key.scale];
    let linear = |start: usize, end: usize| {
        let (a, b) = (numbers(&keys[start]), numbers(&keys[end]));
        (start + 1..end).all(|i| {
            let t = (i - start) as f32 / (end - start) as f32;
            let own = numbers(&keys[i]);
            (0..9).all(|k| {
                let (a, b, own) = (a[k / 3][k % 3], b[k / 3][k % 3], own[k / 3][k % 3]);
                let size = a.abs().max(b.abs()).max(1e-3);
                (a + t * (b - a) - own).abs() <= 1e-5 * size
            })
        })
    };
    let mut kept: Vec<Keyframe> = Vec::new();
    let mut start = 0;
    while start < keys.len() {
        kept.push(keys[start]);
        // The farthest key to which all keys between are linear: steps grow until one is too far, then shrink. Trying one
        // key after another would take seconds for minutes of a motion.
        let last = (start + LONGEST).min(keys.len() - 1);
        let (mut end, mut step, mut grows) = (start + 1, 1, true);
        while step > 0 {
            if end + step <= last && linear(start, end + step) {
                end += step;
            } else {
                grows = false;
            }
            step = if grows { 2 * step } else { step / 2 };
        }
        start = end;
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curves_of_every_kind_are_followed() {
        let curve = |interpolation, values: &[f32]| Curve {
            property: Property::Translation,
            interpolation,
            times: vec![1.0, 3.0],
            values: values.iter().map(|&x| [x, 0.0, 0.0, 0.0]).collect(),
        };
        let linear = curve(Interpolation::Linear, &[2.0, 6.0]);
        assert_eq!([0.0, 1.0, 1.5, 3.0, 9.0].map(|t| linear.at(t)[0]), [2.0, 2.0, 3.0, 6.0, 6.0]);
        let step = curve(Interpolation::Step, &[2.0, 6.0]);
        assert_eq!([0.0, 2.9, 3.0].map(|t| step.at(t)[0]), [2.0, 2.0, 6.0]);
        // Tangents of slope 2 make it a line.
        let cubic = curve(Interpolation::CubicSpline, &[9.0, 2.0, 2.0, 2.0, 6.0, 9.0]);
        assert_eq!([0.0, 1.0, 2.0, 3.0].map(|t| cubic.at(t)[0]), [2.0, 2.0, 4.0, 6.0]);
    }

    #[test]
    fn linear_parts_need_two_keyframes() {
        let key = |frame: u32, x: f32| Keyframe { frame, translate: [x, 0.0, 0.0], ..Keyframe::default() };
        let bent: Vec<_> = (0..=20).map(|i| key(i, if i < 10 { i as f32 } else { 10.0 })).collect();
        assert_eq!(without_linear(bent), [key(0, 0.0), key(10, 10.0), key(20, 10.0)]);
        assert_eq!(without_linear(vec![key(0, 1.0)]), [key(0, 1.0)]);
    }

    #[test]
    fn angles_stay_near_those_before() {
        let mut before = [0.0; 3];
        for degrees in (0..720).step_by(10) {
            before = nearest_angles(DQuat::from_rotation_y(f64::from(degrees).to_radians()), before);
            assert!((before[1] - degrees as f32).abs() < 1e-3 && before[0].abs() < 1e-3, "{degrees}: {before:?}");
        }
    }

    #[test]
    fn shear_and_mirrors_are_refused() {
        assert!(rotation_and_scale(DMat3::from_diagonal(DVec3::new(1.0, 2.0, 3.0))).is_some());
        assert!(rotation_and_scale(DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0))).is_none());
        assert!(rotation_and_scale(DMat3::from_diagonal(DVec3::new(0.0, 1.0, 1.0))).is_none());
        assert!(rotation_and_scale(DMat3::from_cols(DVec3::X, DVec3::new(0.5, 1.0, 0.0), DVec3::Z)).is_none());
    }
}
