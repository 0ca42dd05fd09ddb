//! Patches divided where sampled light differs: a regression tree over the samples, and the parts it makes.
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
//! so flat patches stay whole, and more samples separate finer differences. Parts have the pieces of the patch they
//! were cut from; areas are shared out by samples.
//!
//! Not handled: borders that are not across an axis; they take several planes.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::patches::grid::NONE;
use crate::surfaces::SurfacePoint;

/// Samples of a part at least.
const LEAST_SAMPLES: usize = 12;
/// F beyond which a difference is no chance: the best of some hundred planes reaches 10 in one of twenty samples of
/// noise.
const SIGNIFICANT: f64 = 10.0;
/// Planes in a row at most.
const DEEPEST: u32 = 24;

/// The light that leaves a point, sampled by one ray.
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
    pub(crate) fn count(&self) -> usize {
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
pub(crate) fn grow(own: Vec<Sample>) -> Tree {
    let columns = Columns::new(own);
    let mut orders = columns.orders();
    columns.divided(orders.each_mut().map(|order| &mut order[..]), 0)
}

/// Axes that planes stand across: three of place, three of the normal.
const AXES: usize = 6;
/// Samples from which on the axes of a node, and its sides, are searched in parallel.
const MANY: usize = 4096;

/// Samples with what planes compare, axis by axis.
struct Columns {
    samples: Vec<Sample>,
    /// Coordinates of every sample along each axis.
    coordinates: [Vec<f32>; AXES],
}

/// A plane between two samples.
#[derive(Clone, Copy)]
struct Division {
    axis: usize,
    at: f32,
    /// Squared difference between the sides that it explains.
    between: f64,
}

impl Columns {
    fn new(samples: Vec<Sample>) -> Columns {
        let along = |axis| samples.iter().map(|s| coordinate(s.point.position, s.point.normal, axis)).collect();
        Columns { coordinates: std::array::from_fn(along), samples }
    }

    /// The samples in order of each axis. Those that agree there are in order of the axis before, so that neighbours in
    /// the last order, which that of the rays' starts follows, lie close together.
    fn orders(&self) -> [Vec<u32>; AXES] {
        let mut before: Vec<u32> = (0..self.samples.len() as u32).collect();
        std::array::from_fn(|axis| {
            let own = &self.coordinates[axis];
            let key = |(rank, &i): (usize, &u32)| u64::from(ordered_bits(own[i as usize])) << 32 | rank as u64;
            let mut keys: Vec<u64> = before.iter().enumerate().map(key).collect();
            keys.par_sort_unstable();
            before = keys.iter().map(|&key| before[key as u32 as usize]).collect();
            before.clone()
        })
    }

    /// The tree over some samples, given in order of each axis.
    fn divided(&self, mut orders: [&mut [u32]; AXES], depth: u32) -> Tree {
        let Some(Division { axis, at, .. }) = self.best(&orders).filter(|_| depth < DEEPEST) else {
            let [.., last] = &orders;
            return Tree::Leaf(last.iter().map(|&i| self.samples[i as usize]).collect());
        };
        let is_below = |i: u32| self.coordinates[axis][i as usize] < at;
        let many = orders[0].len() >= MANY;
        let count = if many {
            let counts: Vec<usize> = orders.par_iter_mut().map(|order| part(order, is_below)).collect();
            counts[axis]
        } else {
            orders.each_mut().map(|order| part(order, is_below))[axis]
        };
        let [mut below, mut beyond]: [[&mut [u32]; AXES]; 2] = Default::default();
        for ((order, below), beyond) in orders.into_iter().zip(&mut below).zip(&mut beyond) {
            (*below, *beyond) = order.split_at_mut(count);
        }
        let [below, beyond] = [below, beyond].map(|side| move || self.divided(side, depth + 1));
        let (below, beyond) = if many { rayon::join(below, beyond) } else { (below(), beyond()) };
        Tree::Plane { axis, at, sides: Box::new([below, beyond]) }
    }

    /// The plane that leaves least variance, if it leaves significantly less.
    fn best(&self, orders: &[&mut [u32]; AXES]) -> Option<Division> {
        let n = orders[0].len();
        if n < 2 * LEAST_SAMPLES {
            return None;
        }
        let light = |&i: &u32| self.samples[i as usize].light;
        let sum: DVec3 = orders[0].iter().map(light).sum();
        let squares: f64 = orders[0].iter().map(|i| light(i).length_squared()).sum();
        let whole = squares - sum.length_squared() / n as f64;
        let across = |axis: usize| self.best_across(axis, orders[axis], sum);
        let found: Vec<Option<Division>> =
            if n >= MANY { (0..AXES).into_par_iter().map(across).collect() } else { (0..AXES).map(across).collect() };
        let best = found.into_iter().flatten().reduce(|a, b| if b.between > a.between { b } else { a })?;
        let within = (whole - best.between).max(1e-12 * whole);
        ((n - 2) as f64 * best.between > SIGNIFICANT * within).then_some(best)
    }

    /// The plane across one axis that leaves least variance of samples in order of it, whose light adds up to `sum`.
    fn best_across(&self, axis: usize, order: &[u32], sum: DVec3) -> Option<Division> {
        let n = order.len();
        let own = &self.coordinates[axis];
        let mut below = DVec3::ZERO;
        let mut found: Option<Division> = None;
        for k in 1..=n - LEAST_SAMPLES {
            let (last, next) = (order[k - 1] as usize, order[k] as usize);
            below += self.samples[last].light;
            let (low, high) = (own[last], own[next]);
            // Places nearer to each other than coordinates are certain are one place.
            if k < LEAST_SAMPLES || high - low <= 4.0 * f32::EPSILON {
                continue;
            }
            let (a, b) = (k as f64, (n - k) as f64);
            let apart = below / a - (sum - below) / b;
            let between = a * b / n as f64 * apart.length_squared();
            if found.is_none_or(|f| between > f.between) {
                found = Some(Division { axis, at: 0.5 * (low + high), between });
            }
        }
        found
    }
}

/// Puts those that are below before the others, each in their order; returns how many there are.
fn part(order: &mut [u32], is_below: impl Fn(u32) -> bool) -> usize {
    let mut beyond = Vec::with_capacity(order.len());
    let mut count = 0;
    for k in 0..order.len() {
        let i = order[k];
        if is_below(i) {
            order[count] = i;
            count += 1;
        } else {
            beyond.push(i);
        }
    }
    order[count..].copy_from_slice(&beyond);
    count
}

/// Bits that are in order as their numbers are ([`f32::total_cmp`]).
fn ordered_bits(x: f32) -> u32 {
    let bits = x.to_bits();
    if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
}

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
    pub(crate) fn at(&self, patch: u32, position: Vec3, normal: Vec3) -> u32 {
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
    pub(crate) fn whole(&self, patch: usize) -> usize {
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
        let step = grow(floor(400, |x| if x < 0.3 { 0.0 } else { 2.0 }));
        let Tree::Plane { axis, at, .. } = &step else {
            panic!("a step of four times the noise is seen");
        };
        // Samples lie some 1/400 apart across the step.
        assert!(*axis == 0 && (at - 0.3).abs() < 0.02, "{axis} {at}");
        assert!(leaves(&step) <= 4);
        assert_eq!(leaves(&grow(floor(400, |_| 1.0))), 1);
        assert_eq!(leaves(&grow(Vec::new())), 1);
    }

    #[test]
    fn more_samples_tell_smaller_differences() {
        let tree = |count: usize| leaves(&grow(floor(count, f64::from)));
        assert!(tree(100_000) > 2 * tree(1000));
    }
}
