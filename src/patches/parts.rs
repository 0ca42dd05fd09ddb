//! The parts of divided patches: planes across an axis of place or of the normal, and what lies on either side.
//!
//! Not handled: where to divide; [`crate::patches::regression_tree`] tells.

use glam::Vec3;

use crate::patches::pieces::NONE;
use crate::patches::regression_tree::{Sample, Tree, coordinate};

/// Parts of patches.
#[derive(Clone, Debug, Default)]
pub(crate) struct Parts {
    /// The first plane of every patch that is divided, else NONE.
    pub roots: Vec<u32>,
    pub planes: Vec<Plane>,
    /// The patch that part `count + k` was cut from.
    pub whole: Vec<u32>,
    /// Patches before any was divided.
    pub count: usize,
    /// Areas of the patches before any was divided.
    pub areas: Vec<f64>,
}

/// A plane across an axis, and what lies on either side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plane {
    /// 0 to 2 for place, 3 to 5 for the normal.
    axis: usize,
    at: f32,
    sides: [Part; 2],
}

/// What lies on one side of a plane: more planes, or a patch.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Part {
    Divided(u32),
    Patch(u32),
}

impl Parts {
    /// The part of a patch that a point with a normal lies in.
    #[inline]
    pub fn at(&self, patch: u32, position: Vec3, normal: Vec3) -> u32 {
        let Some(&root) = self.roots.get(patch as usize) else {
            return patch;
        };
        if root == NONE {
            return patch;
        }
        let mut own = root;
        loop {
            let plane = &self.planes[own as usize];
            let beyond = coordinate(position, normal, plane.axis) >= plane.at;
            match plane.sides[usize::from(beyond)] {
                Part::Divided(next) => own = next,
                Part::Patch(patch) => return patch,
            }
        }
    }

    /// The patch whose pieces a part has.
    #[inline]
    pub fn whole(&self, patch: usize) -> usize {
        let part = patch.checked_sub(self.count).and_then(|k| self.whole.get(k));
        part.map_or(patch, |&w| w as usize)
    }
}

/// Numbers the planes and parts of a tree.
pub(crate) fn number(tree: Tree, planes: &mut Vec<Plane>, add: &mut impl FnMut(Vec<Sample>) -> u32) -> Part {
    match tree {
        Tree::Leaf(own) => Part::Patch(add(own)),
        Tree::Plane { axis, at, sides } => {
            let own = planes.len();
            planes.push(Plane { axis, at, sides: [Part::Patch(NONE); 2] });
            let sides = sides.map(|side| number(side, planes, add));
            planes[own].sides = sides;
            Part::Divided(own as u32)
        }
    }
}
