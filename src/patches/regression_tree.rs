//! Where light differs, as samples of it tell: a regression tree.
//!
//! A patch is one value of light, but what it stands for may be lit here and dark there: on both sides of a partition,
//! inside a cupboard, across a shadow's edge. Samples at points of the patch are divided by planes across an axis of
//! place or of the normal, each time the one that leaves least variance (regression trees: L. Breiman et al. 1984), as
//! long as the difference between both sides is more than chance:
//!
//! ```text
//! F = (n - 2) * between / within > SIGNIFICANT,     between = n_a n_b / n |mean_a - mean_b|²
//! ```
//!
//! so flat patches stay whole, and more samples tell finer differences apart.
//!
//! Not handled: borders that are not across an axis; they take several planes.

use glam::{DVec3, Vec3};

use crate::surfaces::SurfacePoint;

/// Samples of a part at least.
const LEAST: usize = 12;
/// F beyond which a difference is no chance: the best of some hundred planes reaches 10 in one of twenty samples of
/// noise.
const SIGNIFICANT: f64 = 10.0;
/// Planes in a row at most.
const DEEPEST: u32 = 24;

/// The light that leaves a point, as far as one ray tells.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Where.
    pub point: SurfacePoint,
    /// W/(m² sr).
    pub light: DVec3,
}

/// A tree that is not numbered yet: planes with their sides, or the samples of a part.
pub(crate) enum Tree {
    Plane { axis: usize, at: f32, sides: Box<[Tree; 2]> },
    Leaf(Vec<Sample>),
}

impl Tree {
    /// Number of samples.
    pub fn count(&self) -> usize {
        match self {
            Tree::Plane { sides, .. } => sides.iter().map(Tree::count).sum(),
            Tree::Leaf(own) => own.len(),
        }
    }
}

#[inline]
pub(crate) fn coordinate(position: Vec3, normal: Vec3, axis: usize) -> f32 {
    match axis {
        0..3 => position[axis],
        _ => normal[axis - 3],
    }
}

/// Divides samples as long as their light differs by more than chance.
pub(crate) fn grow(mut own: Vec<Sample>, depth: u32) -> Tree {
    let Some((axis, at)) = best(&mut own).filter(|_| depth < DEEPEST) else {
        return Tree::Leaf(own);
    };
    let (below, beyond): (Vec<Sample>, Vec<Sample>) =
        own.into_iter().partition(|s| coordinate(s.point.position, s.point.normal, axis) < at);
    Tree::Plane { axis, at, sides: Box::new([below, beyond].map(|side| grow(side, depth + 1))) }
}

/// The plane that leaves least variance, if it leaves significantly less.
fn best(own: &mut [Sample]) -> Option<(usize, f32)> {
    let n = own.len();
    if n < 2 * LEAST {
        return None;
    }
    let sum: DVec3 = own.iter().map(|s| s.light).sum();
    let squares: f64 = own.iter().map(|s| s.light.length_squared()).sum();
    let whole = squares - sum.length_squared() / n as f64;
    let mut found: Option<(f64, usize, f32)> = None;
    for axis in 0..6 {
        let key = |s: &Sample| coordinate(s.point.position, s.point.normal, axis);
        own.sort_by(|a, b| key(a).total_cmp(&key(b)));
        let mut below = DVec3::ZERO;
        for k in 1..=n - LEAST {
            below += own[k - 1].light;
            let (low, high) = (key(&own[k - 1]), key(&own[k]));
            // Places nearer to each other than coordinates are certain are one place.
            if k < LEAST || high - low <= 4.0 * f32::EPSILON {
                continue;
            }
            let (a, b) = (k as f64, (n - k) as f64);
            let apart = below / a - (sum - below) / b;
            let between = a * b / n as f64 * apart.length_squared();
            if found.is_none_or(|f| between > f.0) {
                found = Some((between, axis, 0.5 * (low + high)));
            }
        }
    }
    let (between, axis, at) = found?;
    let within = (whole - between).max(1e-12 * whole);
    ((n - 2) as f64 * between > SIGNIFICANT * within).then_some((axis, at))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::sobol::Stream;

    /// Samples on a floor of side 1, with the light given for each place and some noise.
    fn floor(count: usize, light: impl Fn(f32) -> f64) -> Vec<Sample> {
        let mut random = Stream::new(11);
        let mut one = || {
            let position = Vec3::new(random.uniform(), random.uniform(), 0.0);
            let noise = f64::from(random.uniform()) - 0.5;
            let point = SurfacePoint { position, normal: Vec3::Z, face: 0 };
            Sample { point, light: DVec3::splat(light(position.x) + noise) }
        };
        (0..count).map(|_| one()).collect()
    }

    fn leaves(tree: &Tree) -> usize {
        match tree {
            Tree::Plane { sides, .. } => sides.iter().map(leaves).sum(),
            Tree::Leaf(_) => 1,
        }
    }

    #[test]
    fn a_step_is_found_where_it_is_and_noise_is_left_whole() {
        let step = grow(floor(400, |x| if x < 0.3 { 0.0 } else { 2.0 }), 0);
        let Tree::Plane { axis, at, .. } = &step else {
            panic!("a step of four times the noise is seen");
        };
        // Samples lie some 1/400 apart across the step.
        assert!(*axis == 0 && (at - 0.3).abs() < 0.02, "{axis} {at}");
        assert!(leaves(&step) <= 4);
        assert_eq!(leaves(&grow(floor(400, |_| 1.0), 0)), 1);
        assert_eq!(leaves(&grow(Vec::new(), 0)), 1);
    }

    #[test]
    fn more_samples_tell_smaller_differences() {
        let tree = |count: usize| leaves(&grow(floor(count, f64::from), 0));
        assert!(tree(100_000) > 2 * tree(1000));
    }
}
