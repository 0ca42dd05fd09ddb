//! The part of what sends light that a point sees, exactly: shadows of convex polygons are cut out of it, and Lambert's
//! closed form sums over the rest.
//!
//! The shadow of a polygon is the part beyond its plane of the cone from the point over it. A piece is cut along
//! the plane and the cone's sides; outside it stays as bright as it was, inside it is dimmed by tau or dropped.
//! So light as emitted has no noise where few faces stand in its way: penumbrae are smooth.
//!
//! Not handled: a point in a polygon's plane sees it edge on, as nothing. Pieces that become too many: callers that set
//! a limit draw points instead.

use glam::DVec3;

use crate::form_factors::lambert::signed_edges;
use crate::form_factors::plane::{sees_front, towards};
use crate::scene::convex_polygon::cut;

/// Corners of a piece at most, where there is a limit: a quadrangle cut by the horizon and by a dozen cones.
const MOST_CORNERS: usize = 32;

/// Pieces at most, where there is a limit. Points drawn in place of exact pieces leave noise, for which camera rays are
/// added, and a bias where near points count most: with 12 corners and 64 pieces a picture of scraps below a luminaire
/// takes 2.4 s in place of 0.3 (`cargo bench --bench lamps -- scraps`).
const MOST_PIECES: usize = 512;

/// Heights below this lie in the plane: a few roundings of unit coordinates.
const FLAT: f64 = 1e-7;

/// A triangle that stops or dims light.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Caster {
    /// Unit coordinates.
    pub corners: [DVec3; 3],
    /// Unit normal.
    pub normal: DVec3,
    /// What it lets through.
    pub tau: f64,
    /// Whether its surface has holes, so that its shadow has another outline.
    pub masked: bool,
    /// The convex luminaire it is a face of, if of one.
    pub convex_luminaire: Option<u32>,
}

/// The shadow of a convex polygon, as seen from a point at the origin.
pub(crate) struct Shadow<'a, D: Fn(DVec3) -> f64> {
    /// How far beyond the polygon's plane a place lies.
    pub depth: D,
    /// Depths up to this are none.
    pub flat: f64,
    /// Normals of the cone's sides, looking inwards.
    pub sides: &'a [DVec3],
    /// What the polygon lets through.
    pub tau: f64,
    /// Where an edge is cut: the point of height 0 between two given with their heights.
    pub crossing: fn((DVec3, f64), (DVec3, f64)) -> DVec3,
}

/// A convex polygon relative to the point, and the share of its light that arrives.
#[derive(Clone, Default)]
struct Piece {
    corners: Vec<DVec3>,
    through: f64,
}

/// Pieces whose memory is used again.
#[derive(Default)]
struct Pool {
    pieces: Vec<Piece>,
    count: usize,
}

/// What a point sees, in pieces, and memory to use again from point to point.
#[derive(Default)]
pub(crate) struct Pieces {
    now: Pool,
    next: Pool,
    /// What is being cut.
    shaded: [Piece; 2],
}

impl Piece {
    fn begin(&mut self, through: f64) {
        self.corners.clear();
        self.through = through;
    }

    fn take(&mut self, other: &Piece) {
        self.begin(other.through);
        self.corners.extend_from_slice(&other.corners);
    }

    /// Cuts along a plane: the parts where `height` is positive and where it is negative.
    fn split(
        &self,
        height: impl Fn(DVec3) -> f64,
        crossing: impl Fn((DVec3, f64), (DVec3, f64)) -> DVec3,
        above: &mut Piece,
        below: &mut Piece,
    ) {
        above.begin(self.through);
        below.begin(self.through);
        cut(&self.corners, height, crossing, |p, sides| {
            if sides[0] {
                above.corners.push(p);
            }
            if sides[1] {
                below.corners.push(p);
            }
        });
    }
}

impl Pool {
    fn all(&self) -> &[Piece] {
        &self.pieces[..self.count]
    }

    /// One more piece, whatever it was before.
    fn more(&mut self) -> &mut Piece {
        if self.count == self.pieces.len() {
            self.pieces.push(Piece::default());
        }
        self.count += 1;
        &mut self.pieces[self.count - 1]
    }

    /// Drops the last piece if it has no area or no light.
    fn settle(&mut self) {
        let last = &self.pieces[self.count - 1];
        if last.corners.len() < 3 || last.through <= 0.0 {
            self.count -= 1;
        }
    }
}

impl Pieces {
    /// Adds a convex polygon, relative to the point, of which everything is above the horizon.
    pub(crate) fn add(&mut self, polygon: impl Iterator<Item = DVec3>) {
        let whole = self.now.more();
        whole.begin(1.0);
        whole.corners.extend(polygon);
    }

    /// Adds the part above the horizon of a convex polygon relative to the point.
    fn add_above(&mut self, n: DVec3, polygon: impl Iterator<Item = DVec3>) {
        let [whole, below] = &mut self.shaded;
        whole.begin(1.0);
        whole.corners.extend(polygon);
        whole.split(|p| p.dot(n), towards, self.now.more(), below);
        self.now.settle();
    }

    /// Whether nothing is seen.
    pub(crate) fn is_empty(&self) -> bool {
        self.now.count == 0
    }

    /// Whether the pieces and their corners are few enough to go on where there is a limit.
    fn is_simple(&self) -> bool {
        self.now.count <= MOST_PIECES && self.now.all().iter().all(|p| p.corners.len() <= MOST_CORNERS)
    }

    /// Form factor of all pieces from the point, whose unit normal is n.
    pub(crate) fn form(&self, n: DVec3) -> f64 {
        let form = |p: &Piece| p.through * signed_edges(n, &p.corners).abs();
        self.now.all().iter().map(form).sum::<f64>() / std::f64::consts::TAU
    }

    /// Cuts a shadow out of all pieces.
    pub(crate) fn darken<D: Fn(DVec3) -> f64>(&mut self, shadow: &Shadow<D>) {
        let Shadow { depth, sides, crossing, .. } = shadow;
        let touched = |piece: &Piece| {
            let own = &piece.corners;
            let reaches = |s: &DVec3| own.iter().any(|p| s.dot(*p) > 0.0);
            own.iter().any(|&p| depth(p) > shadow.flat) && sides.iter().all(reaches)
        };
        // Most shadows touch nothing.
        if !self.now.all().iter().any(touched) {
            return;
        }
        let Pieces { now, next, shaded: [own, part] } = self;
        next.count = 0;
        for piece in now.all() {
            if !touched(piece) {
                next.more().take(piece);
                continue;
            }
            own.take(piece);
            if own.corners.iter().any(|&p| depth(p) < 0.0) {
                own.split(depth, crossing, part, next.more());
                next.settle();
                std::mem::swap(own, part);
            }
            for side in *sides {
                if own.corners.iter().any(|p| side.dot(*p) < 0.0) {
                    own.split(|p| side.dot(p), crossing, part, next.more());
                    next.settle();
                    std::mem::swap(own, part);
                }
            }
            own.through *= shadow.tau;
            next.more().take(own);
            next.settle();
        }
        std::mem::swap(now, next);
    }
}

/// Form factor from the point x with unit normal n to the fronts of convex `polygons` behind `casters`; `None` where
/// the pieces become too many.
pub(crate) fn visible_form<'a>(
    x: DVec3,
    n: DVec3,
    polygons: impl Iterator<Item = &'a [DVec3]>,
    casters: impl Iterator<Item = Caster>,
    pieces: &mut Pieces,
) -> Option<f64> {
    pieces.now.count = 0;
    for corners in polygons {
        if sees_front(&[0, 1, 2].map(|k| corners[k] - x)) {
            pieces.add_above(n, corners.iter().map(|p| p - x));
        }
    }
    for caster in casters {
        if pieces.is_empty() {
            break;
        }
        let corners = caster.corners.map(|p| p - x);
        let plane = caster.normal.dot(corners[0]);
        if plane.abs() <= FLAT {
            continue;
        }
        // Heights beyond the plane as seen from the point, and the cone's sides looking inwards.
        let turn = plane.signum();
        let depth = |p: DVec3| turn * (caster.normal.dot(p) - plane);
        let sides = [0, 1, 2].map(|k| turn * corners[k].cross(corners[(k + 1) % 3]));
        pieces.darken(&Shadow { depth, flat: FLAT, sides: &sides, tau: caster.tau, crossing: towards });
        if !pieces.is_simple() {
            return None;
        }
    }
    Some(pieces.form(n))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::form_factors::lambert::point_to_polygon;

    fn caster(corners: [DVec3; 3], tau: f64) -> Caster {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize();
        Caster { corners, normal, tau, masked: false, convex_luminaire: None }
    }

    /// A large luminaire at height 2 that faces down.
    fn luminaire() -> [[DVec3; 3]; 2] {
        let p = |x: f64, y: f64| DVec3::new(x, y, 2.0);
        let [a, b, c, d] = [p(-9.0, -9.0), p(-9.0, 9.0), p(9.0, 9.0), p(9.0, -9.0)];
        [[a, b, c], [a, c, d]]
    }

    fn seen(x: DVec3, casters: &[Caster]) -> f64 {
        let memory = &mut Pieces::default();
        let casters = casters.iter().copied();
        let luminaire = luminaire();
        visible_form(x, DVec3::Z, luminaire.iter().map(|t| &t[..]), casters, memory).unwrap()
    }

    proptest! {
        #[test]
        fn a_shadow_is_the_form_factor_of_what_casts_it(
            p in prop::array::uniform3(prop::array::uniform3(-1.0..1.0f64)), tau in 0.0..1.0f64
        ) {
            let corners = p.map(|q| DVec3::from(q) * DVec3::new(1.0, 1.0, 0.45) + DVec3::Z);
            prop_assume!((corners[1] - corners[0]).cross(corners[2] - corners[0]).length() > 1e-3);
            let x = DVec3::new(0.1, 0.2, 0.0);
            let [a, b, c] = corners.map(|q| q - x);
            let own = point_to_polygon(DVec3::Z, &[a, b, c]) + point_to_polygon(DVec3::Z, &[a, c, b]);
            let found = seen(x, &[caster(corners, tau)]);
            let exact = seen(x, &[]) - (1.0 - tau) * own;
            // Roundings of a few dozen angles.
            prop_assert!((found - exact).abs() < 1e-11, "{found} {exact}");
        }

        #[test]
        fn two_triangles_of_one_square_cast_one_shadow(u in -0.5..0.5f64, v in -0.5..0.5f64) {
            let q = |s: f64, t: f64| DVec3::new(s, t, 1.0);
            let square = [q(-0.4, -0.3), q(0.5, -0.3), q(0.5, 0.6), q(-0.4, 0.6)];
            let [a, b, c, d] = square;
            let both = [caster([a, b, c], 0.0), caster([a, c, d], 0.0)];
            let other = [caster([b, c, d], 0.0), caster([b, d, a], 0.0)];
            let x = DVec3::new(u, v, 0.0);
            prop_assert!((seen(x, &both) - seen(x, &other)).abs() < 1e-11);
            // A sheet that lies there twice is no darker.
            let twice: Vec<Caster> = both.into_iter().chain(other).collect();
            prop_assert!((seen(x, &both) - seen(x, &twice)).abs() < 1e-11);
        }
    }

    #[test]
    fn what_lies_behind_the_luminaire_or_the_point_casts_nothing() {
        let x = DVec3::new(0.1, 0.2, 0.0);
        for z in [3.0, -1.0] {
            let q = |s: f64, t: f64| DVec3::new(s, t, z);
            let wall = caster([q(-9.0, -9.0), q(9.0, -9.0), q(0.0, 20.0)], 0.0);
            assert!((seen(x, &[wall]) - seen(x, &[])).abs() < 1e-12);
        }
    }
}
