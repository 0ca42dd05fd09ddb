//! Bisection of placed and directed objects, for trees of luminaires and pieces of large ones.
//!
//! Directions are split first where they differ much, else places, across the longest side of the box around them. Not
//! handled: costs of the two halves, as the cut is in the middle.

use glam::DVec3;

use crate::scene::Bounds;

/// Directions further apart than this cosine are split before places are.
const APART: f64 = 0.9;

/// An object with a place and a direction, and its number.
#[derive(Clone, Copy)]
pub(crate) struct Placed {
    pub place: DVec3,
    pub direction: DVec3,
    pub number: u32,
}

/// Sorts objects into two halves, neither empty where there are two: by direction where directions differ much, else by
/// place.
pub(crate) fn halve(things: &mut [Placed]) -> (&mut [Placed], &mut [Placed]) {
    let directions = Bounds::of(things.iter().map(|t| t.direction));
    let by_direction = 1.0 - 0.5 * directions.size().length_squared() < APART;
    let bounds = if by_direction { directions } else { Bounds::of(things.iter().map(|t| t.place)) };
    let axis = (0..3).max_by(|&a, &b| bounds.size()[a].total_cmp(&bounds.size()[b])).unwrap_or(0);
    let key = |t: &Placed| if by_direction { t.direction[axis] } else { t.place[axis] };
    things.sort_unstable_by(|a, b| key(a).total_cmp(&key(b)).then(a.number.cmp(&b.number)));
    let middle = bounds.middle()[axis];
    let cut = things.partition_point(|t| key(t) < middle);
    // Places are split at the median; directions at the middle of their range, unless all lie on one side of it.
    let by_range = by_direction && cut > 0 && cut < things.len();
    things.split_at_mut(if by_range { cut } else { things.len() / 2 })
}
