//! The tree of nodes and their transforms.

use ::gltf::Node;
use glam::{DMat4, DQuat, Vec3};

use super::Source;

/// A node with its ancestors.
pub(super) struct Placed<'a> {
    pub node: Node<'a>,
    /// Index of its parent in the list.
    pub parent: Option<usize>,
    /// Its coordinates to those of the scene, in the rest pose.
    pub to_world: DMat4,
}

/// Deepest nesting of nodes. Deeper files are damaged or made to harm.
const DEEPEST: usize = 1000;

/// Largest number in a transform, scene units or factors. Products of larger ones leave the range of float32.
pub(super) const LARGEST: f64 = 1e30;

/// The transform, if its numbers are finite and in range.
pub(super) fn in_range(matrix: DMat4) -> Option<DMat4> {
    matrix.to_cols_array().iter().all(|x| x.abs() <= LARGEST).then_some(matrix)
}

/// A node's transform in parts.
#[derive(Clone, Copy)]
pub(super) struct Pose {
    pub translation: [f32; 3],
    /// Quaternion, x y z w.
    pub rotation: [f32; 4],
    pub scale: [f32; 3],
}

impl Pose {
    pub fn matrix(&self) -> DMat4 {
        let rotation = DQuat::from_array(self.rotation.map(f64::from));
        let rotation = if rotation.length_squared() > 1e-12 { rotation.normalize() } else { DQuat::IDENTITY };
        let [scale, translation] = [self.scale, self.translation].map(|v| Vec3::from(v).as_dvec3());
        DMat4::from_scale_rotation_translation(scale, rotation, translation)
    }
}

/// All nodes below the roots, parents first. A node that is reached twice counts once.
pub(super) fn placed<'a>(
    source: &mut Source,
    roots: Vec<Node<'a>>,
    to_world: DMat4,
) -> Result<Vec<Placed<'a>>, String> {
    let mut seen = vec![false; source.document.nodes().len()];
    let mut list: Vec<Placed> = Vec::new();
    // Nodes to be added, the next one last, with their parents and depths.
    let mut waiting: Vec<_> = roots.into_iter().rev().map(|node| (node, None, 0)).collect();
    while let Some((node, parent, depth)) = waiting.pop() {
        if depth > DEEPEST {
            return Err(format!("has nodes nested more than {DEEPEST} deep; export the model again"));
        }
        if std::mem::replace(&mut seen[node.index()], true) {
            source.notes.add("a node has several parents and is drawn for the first one only");
            continue;
        }
        let before = parent.map_or(to_world, |parent: usize| list[parent].to_world);
        let to_world = in_range(before * local(&node)).ok_or_else(|| {
            format!("has a transform that is too large or not finite at node {}; export the model again", node.index())
        })?;
        let index = list.len();
        let children: Vec<_> = node.children().collect();
        waiting.extend(children.into_iter().rev().map(|child| (child, Some(index), depth + 1)));
        list.push(Placed { node, parent, to_world });
    }
    Ok(list)
}

/// The node's own transform.
pub(super) fn local(node: &Node) -> DMat4 {
    match node.transform() {
        ::gltf::scene::Transform::Matrix { matrix } => {
            DMat4::from_cols_array_2d(&matrix.map(|column| column.map(f64::from)))
        }
        ::gltf::scene::Transform::Decomposed { translation, rotation, scale } => {
            Pose { translation, rotation, scale }.matrix()
        }
    }
}
