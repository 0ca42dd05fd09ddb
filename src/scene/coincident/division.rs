//! Convex polygons in one plane: whether two overlap, and one cut apart along others.
//!
//! One cut at a time: of the polygons that cover something of a piece one near its middle is taken, what lies outside
//! its edges goes on, and what lies inside is dropped, or goes on with a mark. So few of many polygons that lie one
//! over the other are looked at. What is narrower than [`NARROW`] is rounding: neither an overlap nor a piece.
//!
//! Not handled: polygons that are not convex.

use glam::DVec2;

use crate::scene::bounds::Bounds;
use crate::scene::coincident::planes::TOLERANCE;
use crate::scene::convex_polygon::{area, edges, parted};

/// The least width of an overlap and of a part, unit coordinates: along a plane as much counts as one place as across.
const NARROW: f64 = TOLERANCE;

/// A corner this close to the line of a cut lies on it: far above the rounding of double precision and far below
/// [`NARROW`].
const SAME: f64 = 1e-9;

/// Masked faces over one piece at most; what lies under more is dropped.
const DEEPEST: usize = 16;

/// Corners of a convex polygon, counter-clockwise.
pub(super) type Polygon = Vec<DVec2>;

/// Whether two overlap by more than rounding: no edge of either has the other on its outside.
#[inline]
pub(super) fn overlap(a: &[DVec2], b: &[DVec2]) -> bool {
    let around = |polygon: &[DVec2]| Bounds::of(polygon.iter().copied());
    around(a).meets(&around(b)) && !are_apart(a, b) && !are_apart(b, a)
}

/// Whether an edge of the first has the second on its outside, but for rounding.
#[inline]
fn are_apart(a: &[DVec2], b: &[DVec2]) -> bool {
    let mut from = a[a.len() - 1];
    for &to in a {
        let inwards = (to - from).perp();
        let far = b.iter().fold(f64::NEG_INFINITY, |far, &p| inwards.dot(p - from).max(far));
        if far <= 0.0 || far * far <= NARROW * NARROW * inwards.length_squared() {
            return true;
        }
        from = to;
    }
    false
}

/// How far a polygon reaches inwards of an edge.
fn reach((from, to): (DVec2, DVec2), polygon: &[DVec2]) -> f64 {
    let inwards = (to - from).perp();
    let far = polygon.iter().map(|&p| inwards.dot(p - from)).fold(f64::NEG_INFINITY, f64::max);
    far / inwards.length()
}

/// Whether a polygon is wider than rounding.
fn is_wide(polygon: &[DVec2]) -> bool {
    polygon.len() > 2 && edges(polygon).all(|edge| reach(edge, polygon) > NARROW)
}

/// The part of a polygon within another, and convex ones around that.
fn within(polygon: &[DVec2], other: &[DVec2]) -> (Option<Polygon>, Vec<Polygon>) {
    let heights = edges(other).map(|(from, to)| {
        let inwards = (to - from).perp().normalize_or_zero();
        move |p: DVec2| {
            let height = inwards.dot(p - from);
            if height.abs() <= SAME { 0.0 } else { height }
        }
    });
    parted(polygon, heights, |part| !is_wide(part))
}

/// Whether parts of a polygon that do not overlap make up all of it.
fn make_up<'a>(parts: impl Iterator<Item = &'a Polygon>, polygon: &[DVec2]) -> bool {
    let lacking = area(polygon) - parts.map(|part| area(part)).sum::<f64>();
    let around: f64 = edges(polygon).map(|(a, b)| a.distance(b)).sum();
    lacking <= NARROW * around
}

/// What becomes of a piece under a polygon that covers it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Covering {
    /// It is not there.
    Whole,
    /// It is there where the masked face of this number is not.
    Masked(u32),
    /// Its back is behind another face's front.
    Back,
}

/// What is known of a piece by its covers.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub(super) struct Marks {
    /// The masked faces over it, in order.
    pub masked: Vec<u32>,
    /// Whether its back is behind another face's front.
    pub is_backed: bool,
}

/// A convex piece of a polygon.
pub(super) type Piece = (Polygon, Marks);

impl Marks {
    /// Those of a part under one more cover; none where it is not there.
    fn under(&self, covering: Covering) -> Option<Marks> {
        let mut marks = self.clone();
        match covering {
            Covering::Whole => return None,
            Covering::Back => marks.is_backed = true,
            Covering::Masked(face) => {
                let at = marks.masked.partition_point(|&other| other < face);
                marks.masked.insert(at, face);
            }
        }
        (marks.masked.len() <= DEEPEST).then_some(marks)
    }

    /// Whether one more cover would change nothing.
    pub(super) fn has(&self, covering: Covering) -> bool {
        match covering {
            Covering::Whole => false,
            Covering::Back => self.is_backed,
            Covering::Masked(face) => self.masked.contains(&face),
        }
    }
}

/// What remains of pieces of a polygon under covers, of which `next` finds one that covers something of a piece and is
/// not in its marks yet: the polygon itself where nothing of it is gone and all has the same marks.
pub(super) fn divided(
    polygon: &[DVec2],
    pieces: Vec<Piece>,
    next: impl Fn(&Piece) -> Option<([DVec2; 3], Covering)>,
) -> Vec<Piece> {
    let (mut work, mut done) = (pieces, Vec::new());
    work.reverse();
    while let Some(piece) = work.pop() {
        let Some((cover, covering)) = next(&piece) else {
            done.push(piece);
            continue;
        };
        let (polygon, marks) = piece;
        let (inside, outside) = within(&polygon, &cover);
        work.extend(outside.into_iter().map(|part| (part, marks.clone())));
        work.extend(inside.and_then(|part| Some((part, marks.under(covering)?))));
    }
    match done.first() {
        Some((_, marks))
            if done.iter().all(|piece| piece.1 == *marks) && make_up(done.iter().map(|piece| &piece.0), polygon) =>
        {
            vec![(polygon.to_vec(), marks.clone())]
        }
        _ => done,
    }
}
