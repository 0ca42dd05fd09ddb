//! A convex polygon cut apart along others in its plane.
//!
//! One cut at a time: of the polygons that cover something of a piece one near its middle is taken, what lies outside
//! its edges goes on, and what lies inside is dropped, or goes on with a mark. So few of many polygons that lie one
//! over the other are looked at. What is narrower than rounding is neither an overlap nor a
//! piece.
//!
//! Not handled: polygons that are not convex.

use glam::DVec2;
use smallvec::SmallVec;

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
    pub fn has(&self, covering: Covering) -> bool {
        match covering {
            Covering::Whole => false,
            Covering::Back => self.is_backed,
            Covering::Masked(face) => self.masked.contains(&face),
        }
    }
}

/// What is left of pieces of a polygon under covers, of which `next` tells one that covers something of a piece and is
/// not in its marks yet: the polygon itself where nothing of it has a mark.
pub(super) fn divided(polygon: &[DVec2], pieces: Vec<Piece>, next: impl Fn(&Piece) -> Option<Cover>) -> Vec<Piece> {
    let (mut work, mut done) = (pieces, Vec::new());
    work.reverse();
    while let Some(piece) = work.pop() {
        let Some(cover) = next(&piece) else {
            done.push(piece);
            continue;
        };
        let (polygon, marks) = piece;
        let (inside, outside) = parted(&polygon, &cover.polygon);
        work.extend(outside.into_iter().map(|part| (part, marks.clone())));
        work.extend(inside.and_then(|part| Some((part, marks.under(cover.covering)?))));
    }
    pieces_together(polygon, done)
}

/// The middle one of some covers that cover something of a piece and are not in its marks.
pub(super) fn middle<'a>(covers: &'a [Cover], (polygon, marks): &Piece) -> Option<&'a Cover> {
    let reaches = |cover: &&Cover| !marks.has(cover.covering) && overlap(polygon, &cover.polygon);
    let reaching: SmallVec<[&Cover; 8]> = covers.iter().filter(reaches).collect();
    reaching.get(reaching.len() / 2).copied()
}

/// Covers that do the same put together to larger ones, as far as they are convex.
pub(super) fn together(covers: &[Cover]) -> Vec<Cover> {
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
