//! The nodes of the scene shown, each with its transform to the world, and the cameras and lights at them, which look
//! and shine along the node's -z, with +y up.
//!
//! The graph is walked with a list instead of recursion, and every node once: a node that has two parents, or is its
//! own ancestor, is an error, so neither depth nor circles matter. Transforms are multiplied in double precision.
//!
//! `yfov` is the vertical field of view; the aspect ratio is that of the picture requested. A mirrored node's camera is
//! not mirrored. Candela and lux are photometric: over 683 lm/W they are W/sr and W/m² of white light, times the
//! light's colour channel by channel. The soft edge of a spot, `((cos - cos outer) / (cos inner - cos outer))²` of its
//! intensity, becomes a hard one at the cone that carries the same power: `cos cutoff = (2 cos inner + cos outer) / 3`.
//!
//! Not handled: scenes other than the default one (the first where none is), animation, orthographic cameras, ranges of
//! lights, beyond which glTF lets a light end, lights of other types; warnings name them.
//!
//! Source of lights: Khronos Group, *KHR_lights_punctual*.

use std::collections::HashSet;
use std::f32::consts::FRAC_PI_2;

use glam::{DMat4, DQuat, DVec3, Vec3};

use crate::scene::error::{Place, SceneError};
use crate::scene::gltf::document::name;
use crate::scene::gltf::fault::{Fault, item};
use crate::scene::gltf::ignored::{Ignored, Kind};
use crate::scene::gltf::schema::{Index, Light, Node, Root, Spot};
use crate::scene::model::Camera;
use crate::scene::punctual::photometry::EFFICACY;
use crate::scene::punctual::{Beam, PunctualForm, PunctualLight, PunctualPlace};
use crate::scene::soup::SoupCamera;

/// The rotation that turns nothing.
const NO_TURN: [f32; 4] = [0.0, 0.0, 0.0, 1.0];

/// A node and where it is.
pub(super) struct Placed<'a> {
    /// Its number in the file.
    pub number: usize,
    pub node: &'a Node,
    pub to_world: DMat4,
}

/// The nodes of the default scene, parents before their children, children in the file's order.
pub(super) fn placed(root: &Root) -> Result<Vec<Placed<'_>>, Fault> {
    let mut met = vec![false; root.nodes.len()];
    let mut waiting: Vec<(Index, DMat4)> = Vec::new();
    let mut all = Vec::new();
    waiting.extend(roots(root)?.into_iter().rev().map(|start| (start, DMat4::IDENTITY)));
    while let Some((index, parent)) = waiting.pop() {
        let node = item(&root.nodes, index, "node")?;
        let Index(number) = index;
        if std::mem::replace(&mut met[number], true) {
            return Err(format!("node {number} is met twice; nodes form trees, each with one parent").into());
        }
        let to_world = parent * local(node).ok_or_else(|| format!("the transform of node {number} is not finite"))?;
        waiting.extend(node.children.iter().rev().map(|child| (*child, to_world)));
        all.push(Placed { number, node, to_world });
    }
    Ok(all)
}

/// The roots of the default scene, else of the first, else of the file where there is no scene.
fn roots(root: &Root) -> Result<Vec<Index>, Fault> {
    if root.scene.is_some() || !root.scenes.is_empty() {
        return Ok(item(&root.scenes, root.scene.unwrap_or(Index(0)), "scene")?.nodes.clone());
    }
    let below: HashSet<Index> = root.nodes.iter().flat_map(|node| node.children.iter().copied()).collect();
    Ok((0..root.nodes.len()).map(Index).filter(|index| !below.contains(index)).collect())
}

/// A node's own transform: its matrix, or translation times rotation times scale.
fn local(node: &Node) -> Option<DMat4> {
    let vector = |given: Option<[f32; 3]>, default| given.map_or(default, |v| DVec3::from_array(v.map(f64::from)));
    let transform = match node.matrix {
        Some(matrix) => DMat4::from_cols_array(&matrix.map(f64::from)),
        None => {
            let rotation = DQuat::from_array(node.rotation.unwrap_or(NO_TURN).map(f64::from)).normalize();
            let (scale, translation) = (vector(node.scale, DVec3::ONE), vector(node.translation, DVec3::ZERO));
            DMat4::from_scale_rotation_translation(scale, rotation, translation)
        }
    };
    transform.is_finite().then_some(transform)
}

/// The perspective cameras in the order of the nodes, by the names of their nodes.
pub(super) fn cameras(
    file: &str,
    root: &Root,
    nodes: &[Placed],
    ignored: &mut Ignored,
) -> Result<Vec<SoupCamera>, Fault> {
    let mut all = Vec::new();
    for placed in nodes {
        let Some(index) = placed.node.camera else { continue };
        let read = item(&root.cameras, index, "camera")?;
        let own = name(&read.name, "camera", index.0);
        let name = placed.node.name.as_ref().map_or(own, |_| name(&placed.node.name, "node", placed.number));
        let Some(perspective) = &read.perspective else {
            ignored.add(Kind::Orthographic, &name);
            continue;
        };
        let [_, up, back, position] = [0, 1, 2, 3].map(|column| placed.to_world.col(column).truncate());
        let view = Camera::look_at(DVec3::ZERO, -back, up, f64::from(perspective.yfov).to_degrees());
        let place = Place::item(file, "camera", index.0);
        let view = view.map_err(|source| SceneError::View { place, source })?;
        all.push(SoupCamera { name, position, view });
    }
    Ok(all)
}

/// The lights in the order of the nodes, in the file's units.
pub(super) fn lights(
    file: &str,
    root: &Root,
    nodes: &[Placed],
    ignored: &mut Ignored,
) -> Result<Vec<PunctualLight>, Fault> {
    let Some(listed) = &root.extensions.lights_punctual else { return Ok(Vec::new()) };
    let mut all = Vec::new();
    for placed in nodes {
        let Some(own) = &placed.node.extensions.light else { continue };
        let (light, number) = (item(&listed.lights, own.light, "light")?, own.light.0);
        let name = name(&light.name, "light", number);
        if !matches!(light.kind.as_str(), "point" | "spot" | "directional") {
            ignored.add(Kind::LightsOfOtherTypes, &name);
            continue;
        }
        if light.range.is_some() {
            ignored.add(Kind::Ranges, &name);
        }
        if light.kind == "spot" && light.spot.unwrap_or_default().is_soft() {
            ignored.add(Kind::SoftEdges, &name);
        }
        let place = || Place::item(file, "light", number);
        let wrong = |(key, value, needed): OutOfRange| SceneError::LightValue { place: place(), key, value, needed };
        all.push(read_light(light, placed).map_err(wrong)?);
    }
    Ok(all)
}

/// A number of a light that is out of its range: its key, its value, and what is needed.
type OutOfRange = (&'static str, String, &'static str);

fn read_light(light: &Light, placed: &Placed) -> Result<PunctualLight, OutOfRange> {
    let intensity = light.intensity / EFFICACY as f32 * Vec3::from_array(light.color);
    if !intensity.is_finite() || intensity.min_element() < 0.0 {
        let value = format!("{} times {:?}", light.intensity, light.color);
        return Err(("intensity", value, "finite and not negative"));
    }
    let [back, position] = [2, 3].map(|column| placed.to_world.col(column).truncate());
    let place = PunctualPlace::new(position, PunctualLight::PHYSICAL, 1.0);
    let direction = || {
        let unit = (-back / back.abs().max_element()).try_normalize();
        unit.ok_or_else(|| ("direction", back.to_string(), "a vector that is not zero"))
    };
    let form = match light.kind.as_str() {
        "directional" => PunctualForm::Directional { direction: direction()? },
        "spot" => {
            let cutoff = cutoff(&light.spot.unwrap_or_default())?;
            let beam = Beam::Spot { direction: direction()?, exponent: 0.0, cutoff };
            PunctualForm::Point { place, beam }
        }
        _ => PunctualForm::even(place),
    };
    let name = placed.node.name.clone().or_else(|| light.name.clone());
    Ok(PunctualLight { form, intensity, name })
}

/// Cosine of the cone that carries a spot's power at its full intensity.
fn cutoff(spot: &Spot) -> Result<f64, OutOfRange> {
    let (inner, outer) = (spot.inner_cone_angle, spot.outer_cone_angle);
    // A right angle in single precision is a little more than one.
    if !(outer > 0.0 && outer <= FRAC_PI_2) {
        return Err(("outerConeAngle", outer.to_string(), "above 0 and at most a right angle"));
    }
    if !(0.0..=outer).contains(&inner) {
        return Err(("innerConeAngle", inner.to_string(), "0 or more, and at most outerConeAngle"));
    }
    let [inner, outer] = [inner, outer].map(|angle| f64::from(angle).cos().max(0.0));
    Ok((2.0 * inner + outer) / 3.0)
}
