//! A convex polygon cut apart along others in its plane.
//!
//! One cut at a time: of the polygons that cover something of a piece the middle one is taken, what lies outside its
//! edges goes on with those that reach there, and what lies inside is dropped, or goes on with a mark. So n polygons
//! that lie side by side cost about n log n. What is narrower than [`NARROW`] is rounding: neither an overlap nor a
//! piece.
//!
//! Not handled: polygons that are not convex.

use glam::DVec2;

use crate::scene::coincident::polygons::{Polygon, joined, make_up, overlap, parted};

/// Masked faces over one piece at most; what lies under more is dropped.
const DEEPEST: usize = 16;

/// What becomes of a piece under a [`Cover`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Covering {
    /// It is not there.
    Whole,
    /// It is there where the masked face of this number is not.
    Masked(u32),
    /// Its back is behind another face's front.
    Back,
}

/// A polygon that covers what lies under it.
#[derive(Clone, Debug)]
pub(super) struct Cover {
    pub polygon: Polygon,
    pub covering: Covering,
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
    fn has(&self, covering: Covering) -> bool {
        match covering {
            Covering::Whole => false,
            Covering::Back => self.is_backed,
            Covering::Masked(face) => self.masked.contains(&face),
        }
    }
}

/// What is left of a polygon under covers: itself where nothing of it has a mark.
pub(super) fn divided(polygon: &[DVec2], covers: &[Cover]) -> Vec<Piece> {
    let covers = together(covers);
    let over = |polygon: &[DVec2], among: &[usize], marks: &Marks| -> Vec<usize> {
        let reaches = |&&k: &&usize| !marks.has(covers[k].covering) && overlap(polygon, &covers[k].polygon);
        among.iter().filter(reaches).copied().collect()
    };
    let (start, none) = (polygon.to_vec(), Marks::default());
    let first = over(&start, &(0..covers.len()).collect::<Vec<_>>(), &none);
    let (mut work, mut done) = (vec![((start, none), first)], Vec::new());
    while let Some(((piece, marks), mut rest)) = work.pop() {
        if rest.is_empty() {
            done.push((piece, marks));
            continue;
        }
        let cover = &covers[rest.remove(rest.len() / 2)];
        let (inside, outside) = parted(&piece, &cover.polygon);
        for part in outside {
            let reaching = over(&part, &rest, &marks);
            work.push(((part, marks.clone()), reaching));
        }
        if let (Some(part), Some(marks)) = (inside, marks.under(cover.covering)) {
            let reaching = over(&part, &rest, &marks);
            work.push(((part, marks), reaching));
        }
    }
    pieces_together(polygon, done)
}

/// Covers that do the same put together to larger ones, as far as they are convex.
fn together(covers: &[Cover]) -> Vec<Cover> {
    let of = |covering: Covering| {
        let own = covers.iter().filter(move |cover| cover.covering == covering);
        let polygons = joined(own.map(|cover| cover.polygon.clone()).collect());
        polygons.into_iter().map(move |polygon| Cover { polygon, covering })
    };
    let masked = covers.iter().filter(|cover| matches!(cover.covering, Covering::Masked(_))).cloned();
    of(Covering::Whole).chain(masked).chain(of(Covering::Back)).collect()
}

/// Pieces of equal marks put together to larger ones; the polygon itself where all have the same and cover it.
fn pieces_together(polygon: &[DVec2], mut pieces: Vec<Piece>) -> Vec<Piece> {
    pieces.reverse();
    let mut left: Vec<Piece> = Vec::new();
    while let Some((_, marks)) = pieces.first().cloned() {
        let (own, others): (Vec<_>, Vec<_>) = pieces.into_iter().partition(|piece| piece.1 == marks);
        pieces = others;
        let whole = left.is_empty() && pieces.is_empty() && make_up(own.iter().map(|piece| &piece.0), polygon);
        let parts: Vec<Polygon> = own.into_iter().map(|piece| piece.0).collect();
        let parts = if whole { vec![polygon.to_vec()] } else { joined(parts) };
        left.extend(parts.into_iter().map(|part| (part, marks.clone())));
    }
    left
}
