//! Where the mesh of a node is: by the node's transform, once for each of its instances, and with a skin by its joints.
//!
//! ```text
//! an instance:   x = N T R S p        with N the node's transform to the world (EXT_mesh_gpu_instancing)
//! a skin:        x = sum of w J B p   with J a joint's transform to the world, B its inverse bind matrix
//! ```
//!
//! The node's own transform does not count with a skin (glTF 2.0, 3.7.3.3); what instances it has come after J. In the
//! bind pose J B is one matrix for all joints, mostly the identity. Weights are divided by their sum; without any the
//! first joint has all. A mesh without joints, or whose joints are not in the scene shown, is where its points are.
//!
//! Not handled: colours and other attributes of instances, which are an application's.
//!
//! Source: Khronos Group, *EXT_mesh_gpu_instancing*.

use glam::{DMat4, DQuat, DVec3};

use crate::scene::gltf::accessors::{MAT4, Shape, VEC3, VEC4};
use crate::scene::gltf::buffers::Data;
use crate::scene::gltf::fault::{Fault, item};
use crate::scene::gltf::nodes::Placed;
use crate::scene::gltf::schema::{Index, Primitive};

/// Where the mesh of a node is.
pub(super) struct Placements {
    /// To the world, one for each instance, behind the skin.
    pub to_world: Vec<DMat4>,
    /// `J B` of each joint, where there is a skin; none where its joints are not in the scene.
    pub joints: Option<Vec<DMat4>>,
}

/// Where the mesh of a node is. `known` has where the nodes of the scene are, by their numbers.
pub(super) fn placements(data: &Data, placed: &Placed, known: &[Option<DMat4>]) -> Result<Placements, Fault> {
    let joints = match placed.node.skin {
        Some(skin) => joints(data, skin, known).map_err(|fault| fault.within(&format!("skin {}", skin.0)))?,
        None => None,
    };
    let own = if placed.node.skin.is_some() { DMat4::IDENTITY } else { placed.to_world };
    let instances = instances(data, placed)?;
    Ok(Placements { to_world: instances.into_iter().map(|instance| own * instance).collect(), joints })
}

/// How many instances of its mesh a node has.
pub(super) fn count(data: &Data, placed: &Placed) -> Result<u64, Fault> {
    let mut found = None;
    for (key, _) in PARTS {
        let Some(index) = attribute(placed, key) else { continue };
        let count = item(&data.root.accessors, index, "accessor")?.count.0;
        let (first, of) = *found.get_or_insert((key, count));
        if of != count {
            return Err(format!("of its instances {first} has {of} and {key} {count}: all have as many").into());
        }
    }
    Ok(found.map_or(1, |(_, count)| count))
}

/// What an instance is made of.
const PARTS: [(&str, Shape); 3] = [("TRANSLATION", VEC3), ("ROTATION", VEC4), ("SCALE", VEC3)];

fn attribute(placed: &Placed, key: &str) -> Option<Index> {
    placed.node.extensions.instancing.as_ref()?.attributes.get(key).copied()
}

/// The transforms of a node's instances, one of nothing where it has none.
fn instances(data: &Data, placed: &Placed) -> Result<Vec<DMat4>, Fault> {
    let count = count(data, placed)? as usize;
    let numbers = |(key, shape): (&str, Shape)| match attribute(placed, key) {
        Some(index) => data.numbers(index, shape).map(Some),
        None => Ok(None),
    };
    let [translations, rotations, scales] = [numbers(PARTS[0])?, numbers(PARTS[1])?, numbers(PARTS[2])?];
    let vector = |list: &Option<Vec<f64>>, i: usize, default| {
        list.as_ref().map_or(default, |numbers| DVec3::from_slice(&numbers[3 * i..]))
    };
    let one = |i: usize| {
        let turn = |numbers: &Vec<f64>| DQuat::from_slice(&numbers[4 * i..]).normalize();
        let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, turn);
        let (scale, translation) = (vector(&scales, i, DVec3::ONE), vector(&translations, i, DVec3::ZERO));
        let all = DMat4::from_scale_rotation_translation(scale, rotation, translation);
        all.is_finite().then_some(all).ok_or_else(|| format!("the transform of instance {i} is not finite").into())
    };
    (0..count).map(one).collect()
}

/// `J B` of the joints of a skin; none where one is not in the scene.
fn joints(data: &Data, skin: Index, known: &[Option<DMat4>]) -> Result<Option<Vec<DMat4>>, Fault> {
    let skin = item(&data.root.skins, skin, "skin")?;
    let bound = match skin.inverse_bind_matrices {
        Some(index) => data.numbers(index, MAT4)?,
        None => DMat4::IDENTITY.to_cols_array().repeat(skin.joints.len()),
    };
    if bound.len() < 16 * skin.joints.len() {
        return Err(format!("it has {} joints and {} matrices for them", skin.joints.len(), bound.len() / 16).into());
    }
    let mut all = Vec::new();
    for (joint, inverse) in skin.joints.iter().zip(bound.chunks_exact(16)) {
        let Some(to_world) = item(known, *joint, "node")? else { return Ok(None) };
        all.push(*to_world * DMat4::from_cols_slice(inverse));
    }
    Ok(Some(all))
}

/// Whether the vertices of a part of a mesh go by joints.
pub(super) fn is_posed(primitive: &Primitive) -> bool {
    influences(primitive, 0).is_some()
}

/// The accessors of joints and weights of a set.
fn influences(primitive: &Primitive, set: usize) -> Option<[Index; 2]> {
    let [joints, weights] = ["JOINTS", "WEIGHTS"].map(|kind| primitive.attributes.get(&format!("{kind}_{set}")));
    Some([*joints?, *weights?])
}

/// Moves the points of a part of a mesh as its joints are. Returns whether that mirrors them.
pub(super) fn pose(data: &Data, primitive: &Primitive, joints: &[DMat4], points: &mut [DVec3]) -> Result<bool, Fault> {
    let mut sets = Vec::new();
    for (set, [of, by]) in (0..).map_while(|set| Some((set, influences(primitive, set)?))) {
        let read = [data.numbers(of, VEC4)?, data.numbers(by, VEC4)?];
        if read.iter().any(|numbers| numbers.len() < 4 * points.len()) {
            return Err(format!("JOINTS_{set} or WEIGHTS_{set} has fewer elements than there are vertices").into());
        }
        sets.push(read);
    }
    let mut mirrored = false;
    for (i, point) in points.iter_mut().enumerate() {
        let own = sets.iter().flat_map(|[joints, weights]| (4 * i..4 * i + 4).map(|k| (joints[k], weights[k])));
        let missing = || format!("vertex {i} goes by a joint beyond the {} of its skin", joints.len());
        let all = blend(own, joints).ok_or_else(missing)?;
        mirrored |= i == 0 && all.determinant() < 0.0;
        *point = all.transform_point3(*point);
    }
    Ok(mirrored)
}

/// The mean of matrices by pairs of their number and weight; none where one does not exist.
fn blend(influences: impl Iterator<Item = (f64, f64)> + Clone, joints: &[DMat4]) -> Option<DMat4> {
    let of = |joint: f64| joints.get(joint as usize).copied();
    let sum: f64 = influences.clone().map(|(_, weight)| weight).sum();
    if sum == 0.0 {
        return influences.clone().next().map_or(Some(DMat4::IDENTITY), |(first, _)| of(first));
    }
    let used = influences.filter(|(_, weight)| *weight != 0.0);
    used.map(|(joint, weight)| Some(of(joint)? * (weight / sum))).sum()
}
