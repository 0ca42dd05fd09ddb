//! The parts that maps are made of: what of one material an object has, as triangles in the file's units, with their
//! second texture coordinates where there are some.
//!
//! Not handled: how a file gives them; that is [`crate::gltf_parts`] for glTF, and here for scenes of any other kind.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use halflight::Scene;

/// A triangle of a part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Triangle {
    /// Its corners, the file's units.
    pub corners: [DVec3; 3],
    /// Where they lie in the unit square of the part, where its file says so; v runs down, as in glTF.
    pub second: Option<[DVec2; 3]>,
}

impl Triangle {
    /// Twice the vector area.
    pub(crate) fn doubled(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a)
    }

    /// Area, the file's units squared.
    pub(crate) fn area(&self) -> f64 {
        0.5 * self.doubled().length()
    }

    /// Front unit normal; none of a triangle without area.
    pub(crate) fn normal(&self) -> DVec3 {
        self.doubled().normalize_or_zero()
    }
}

/// What of one material an object has.
#[derive(Clone, Debug)]
pub struct Part {
    /// The object's name.
    pub name: String,
    /// Its triangles, in the order in which they are written.
    pub triangles: Vec<Triangle>,
}

impl Part {
    /// Whether its file says where all of it lies in a square.
    pub(crate) fn has_charts(&self) -> bool {
        !self.triangles.is_empty() && self.triangles.iter().all(|triangle| triangle.second.is_some())
    }
}

/// The faces of a scene that are one part.
#[derive(Clone, Debug)]
pub(crate) struct SceneFaces {
    pub material: u32,
    pub faces: Vec<u32>,
}

/// The parts of a scene by object and material, and the faces of each.
pub(crate) fn of_scene(scene: &Scene) -> (Vec<Part>, Vec<SceneFaces>) {
    let mut known: BTreeMap<(u32, u32), Vec<u32>> = BTreeMap::new();
    for face in 0..scene.solid_faces() {
        let own = scene.faces[face as usize];
        known.entry((own.object, own.material)).or_default().push(face);
    }
    let triangle = |&face: &u32| {
        let corners = scene.exact_corners(face).map(|corner| scene.frame.to_file(corner));
        Triangle { corners, second: None }
    };
    let part = |((object, material), faces): ((u32, u32), Vec<u32>)| {
        let name = scene.objects.get(object as usize).filter(|name| !name.is_empty());
        let name = name.unwrap_or(&scene.materials[material as usize].name).clone();
        (Part { name, triangles: faces.iter().map(triangle).collect() }, SceneFaces { material, faces })
    };
    known.into_iter().map(part).unzip()
}
