//! The nodes of the scene shown, each with its transform to the world.
//!
//! The graph is walked with a list instead of recursion, and every node once: a node that has two parents, or is its
//! own ancestor, is an error, so neither depth nor circles matter. Transforms are multiplied in double precision.
//!
//! Not handled: scenes other than the default one (the first where none is), animation.

use glam::{DMat4, DQuat, DVec3};
use gltf_json::{Index, Node, Root};

/// A node and where it is.
pub(super) struct Placed<'a> {
    /// Its number in the file.
    pub number: usize,
    pub node: &'a Node,
    pub to_world: DMat4,
}

/// The nodes of the default scene, parents before their children, children in the file's order.
pub(super) fn placed(root: &Root) -> Result<Vec<Placed<'_>>, String> {
    let mut met = vec![false; root.nodes.len()];
    let mut waiting: Vec<(usize, DMat4)> = Vec::new();
    let mut all = Vec::new();
    for start in roots(root).into_iter().rev() {
        waiting.push((start, DMat4::IDENTITY));
    }
    while let Some((number, parent)) = waiting.pop() {
        if std::mem::replace(&mut met[number], true) {
            return Err(format!("node {number} is met twice; nodes form trees, each with one parent"));
        }
        let node = &root.nodes[number];
        let to_world = parent * local(node).ok_or_else(|| format!("the transform of node {number} is not finite"))?;
        waiting.extend(children(node).iter().rev().map(|child| (child.value(), to_world)));
        all.push(Placed { number, node, to_world });
    }
    Ok(all)
}

fn children(node: &Node) -> &[Index<Node>] {
    node.children.as_deref().unwrap_or_default()
}

/// The roots of the default scene, else of the first, else of the file where there is no scene.
fn roots(root: &Root) -> Vec<usize> {
    let shown = root.scene.map_or(0, |scene| scene.value());
    if let Some(scene) = root.scenes.get(shown) {
        return scene.nodes.iter().map(|node| node.value()).collect();
    }
    let mut below = vec![false; root.nodes.len()];
    for child in root.nodes.iter().flat_map(children) {
        below[child.value()] = true;
    }
    (0..below.len()).filter(|&number| !below[number]).collect()
}

/// A node's own transform: its matrix, or translation times rotation times scale.
fn local(node: &Node) -> Option<DMat4> {
    let vector = |given: Option<[f32; 3]>, default| given.map_or(default, |v| DVec3::from_array(v.map(f64::from)));
    let transform = match node.matrix {
        Some(matrix) => DMat4::from_cols_array(&matrix.map(f64::from)),
        None => {
            let rotation = DQuat::from_array(node.rotation.unwrap_or_default().0.map(f64::from)).normalize();
            let (scale, translation) = (vector(node.scale, DVec3::ONE), vector(node.translation, DVec3::ZERO));
            DMat4::from_scale_rotation_translation(scale, rotation, translation)
        }
    };
    transform.is_finite().then_some(transform)
}
