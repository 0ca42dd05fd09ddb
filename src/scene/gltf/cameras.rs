//! Perspective cameras of a glTF scene, each at a node: it looks along the node's -z, with +y up.
//!
//! `yfov` is the vertical field of view; the aspect ratio is that of the picture asked for. A mirrored node's camera
//! is not mirrored.
//!
//! Not handled: orthographic cameras, which are ignored with a warning; near and far planes.

use glam::DVec3;
use gltf_json::Root;

use crate::scene::Camera;
use crate::scene::build::SoupCamera;
use crate::scene::error::{Place, SceneError};
use crate::scene::gltf::ignored::Ignored;
use crate::scene::gltf::materials::name;
use crate::scene::gltf::nodes::Placed;

/// The perspective cameras in the order of the nodes, by the names of their nodes.
pub(super) fn cameras(
    file: &str,
    root: &Root,
    nodes: &[Placed],
    ignored: &mut Ignored,
) -> Result<Vec<SoupCamera>, SceneError> {
    let mut all = Vec::new();
    for placed in nodes {
        let Some(index) = placed.node.camera else { continue };
        let read = &root.cameras[index.value()];
        let own = name(&read.name, "camera", index.value());
        let name = placed.node.name.as_ref().map_or(own, |_| name(&placed.node.name, "node", placed.number));
        let Some(perspective) = &read.perspective else {
            ignored.add("orthographic cameras", &name);
            continue;
        };
        let [_, up, back, position] = columns(placed);
        let view = Camera::look_at(DVec3::ZERO, -back, up, f64::from(perspective.yfov).to_degrees());
        let place = Place::item(file, "camera", index.value());
        let view = view.map_err(|source| SceneError::View { place, source })?;
        all.push(SoupCamera { name, position, view });
    }
    Ok(all)
}

fn columns(placed: &Placed) -> [DVec3; 4] {
    [0, 1, 2, 3].map(|column| placed.to_world.col(column).truncate())
}
