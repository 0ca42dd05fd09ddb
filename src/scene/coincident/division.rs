//! A convex polygon cut apart along others in its plane.
//!
//! One cut at a time: of the polygons that cover something of a piece one near its middle is taken, what lies outside
//! its edges goes on, and what lies inside is dropped, or goes on with a mark. So few of many polygons that lie one
//! over the other are looked at. What is narrower than rounding is neither an overlap nor a piece.
//!
//! Not handled: polygons that are not convex.

use glam::DVec2;

use crate::scene::coincident::polygons::{Polygon, make_up, parted};

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
/// not in its marks yet: the polygon itself where nothing of it is gone and all has the same marks.
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
    match done.first() {
        Some((_, marks))
            if done.iter().all(|piece| piece.1 == *marks) && make_up(done.iter().map(|piece| &piece.0), polygon) =>
        {
            vec![(polygon.to_vec(), marks.clone())]
        }
        _ => done,
    }
}
