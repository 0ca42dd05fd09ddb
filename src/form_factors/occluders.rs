//! What lies between two facets: which occluders may, and the form factor from a point to what they leave visible.
//!
//! An occluder does not matter if all of it lies on or behind the plane of either facet, if both facets lie on one side
//! of its own plane, or if a plane separates it from the convex hull of the two ([`separated`]). What is not separated
//! within so many steps counts as between, which costs time and no accuracy.
//!
//! The form factor from a point is exact: shadows of convex occluders are cut out of the facet's tiles
//! ([`crate::form_factors::shadow`]). Planes are as flat as the scene's numbers are exact, and edges are cut
//! at the same bits from both sides, as ten digits need. The cost grows with the number of pieces.
//!
//! Not handled: occluders that hide something only together; a point in an occluder's plane sees it edge on, as
//! nothing.

use glam::DVec3;

use crate::form_factors::facet::Facet;
use crate::form_factors::hull::separated;
use crate::form_factors::plane::{Plane, crossing};
use crate::form_factors::shadow::{Pieces, Shadow};
use crate::scene::Bounds;

/// A convex polygon that stops or dims light.
#[derive(Clone, Debug)]
pub(crate) struct Occluder {
    pub plane: Plane,
    pub polygon: Vec<DVec3>,
    /// What it lets through where it is.
    pub tau: f64,
    /// Whether a mask says where that is.
    pub masked: bool,
}

/// Steps of the search for a separating plane.
const STEPS: usize = 100;

/// The occluders that may lie between the two facets, each of which lies in front of the other's plane.
pub(crate) fn between<'a>(a: &Facet, b: &Facet, all: &'a [Occluder]) -> Vec<&'a Occluder> {
    let hull: Vec<DVec3> = a.points().chain(b.points()).collect();
    let around = Bounds::of(hull.iter().copied());
    let matters = |o: &&Occluder| {
        let flat = o.plane.flat;
        Bounds::of(o.polygon.iter().copied()).meets(&Bounds { low: around.low + flat, high: around.high - flat })
            && rises(&a.plane, &o.polygon)
            && rises(&b.plane, &o.polygon)
            && straddles(&o.plane, &hull)
            && !separated(&hull, &o.polygon, -o.plane.flat, STEPS)
    };
    all.iter().filter(matters).collect()
}

/// Whether some of the points lie in front of the plane.
fn rises(plane: &Plane, points: &[DVec3]) -> bool {
    points.iter().any(|&p| plane.height(p) > 0.0)
}

/// Whether points lie on both sides of the plane.
fn straddles(plane: &Plane, points: &[DVec3]) -> bool {
    let mut sides = points.iter().map(|&p| plane.height(p));
    sides.clone().any(|h| h > 0.0) && sides.any(|h| h < 0.0)
}

/// Form factor from the point x with unit normal n to the front of a facet above its horizon, behind `occluders`.
pub(crate) fn visible_form(x: DVec3, n: DVec3, facet: &Facet, occluders: &[&Occluder]) -> f64 {
    let mut pieces = Pieces::default();
    facet.tiles.iter().for_each(|tile| pieces.add(tile.iter().map(|p| p - x)));
    for occluder in occluders {
        let plane = &occluder.plane;
        let side = plane.height(x);
        if side == 0.0 || pieces.is_empty() {
            continue;
        }
        let beyond = -side.signum();
        // The cone's sides look inwards; seen from behind its corners run the other way.
        let corners: Vec<DVec3> = occluder.polygon.iter().map(|&p| p - x).collect();
        let sides: Vec<DVec3> = (0..corners.len())
            .map(|k| beyond * corners[k].cross(corners[(k + 1) % corners.len()]))
            .map(DVec3::normalize_or_zero)
            .collect();
        let depth = |p: DVec3| match beyond * (plane.normal.dot(p) + side) {
            h if h.abs() <= plane.flat => 0.0,
            h => h,
        };
        pieces.darken(&Shadow { depth, flat: 0.0, sides: &sides, tau: occluder.tau, crossing });
    }
    pieces.form(n)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::facet::facets;
    use crate::form_factors::plane::plane_of;

    const FLAT: f64 = 1e-12;

    fn square(low: f64, high: f64, z: f64) -> [DVec3; 4] {
        let p = |x: f64, y: f64| DVec3::new(x, y, z);
        [p(low, low), p(low, high), p(high, high), p(high, low)]
    }

    fn occluder(polygon: &[DVec3], tau: f64) -> Occluder {
        Occluder { plane: plane_of(polygon, FLAT), polygon: polygon.to_vec(), tau, masked: false }
    }

    #[test]
    fn a_shadow_is_the_form_factor_of_what_casts_it() {
        let [a, b, c, d] = square(-4.0, 4.0, 2.0);
        let facet = &facets(&[[a, b, c], [a, c, d]], FLAT)[0];
        let (x, n) = (DVec3::new(0.1, 0.2, 0.0), DVec3::Z);
        let clear = visible_form(x, n, facet, &[]);
        let plate = square(-0.5, 0.7, 1.0);
        let mut turned = plate;
        turned.reverse();
        let own = facets(&[[plate[0], plate[1], plate[2]], [plate[0], plate[2], plate[3]]], FLAT);
        let blocked = visible_form(x, n, &own[0], &[]);
        for polygon in [plate, turned] {
            for tau in [0.0, 0.25] {
                let found = visible_form(x, n, facet, &[&occluder(&polygon, tau)]);
                let exact = clear - (1.0 - tau) * blocked;
                assert!((found - exact).abs() < 1e-14, "{found} {exact}");
            }
        }
        // Beyond the facet, or behind the point, it casts no shadow on it.
        for z in [3.0, -1.0] {
            let found = visible_form(x, n, facet, &[&occluder(&square(-9.0, 9.0, z), 0.0)]);
            assert!((found - clear).abs() < 1e-14);
        }
    }

    #[test]
    fn a_sheet_that_cuts_the_facet_hides_what_is_beyond_it() {
        let [a, b, c, d] = square(-1.0, 1.0, 1.0);
        let facet = &facets(&[[a, b, c], [a, c, d]], FLAT)[0];
        let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        // A wall in the plane x = 0 through the facet; the point stands at x = -0.5 and sees half of it.
        let wall = [p(0., -9., -9.), p(0., 9., -9.), p(0., 9., 9.), p(0., -9., 9.)];
        let x = p(-0.5, 0.0, 0.0);
        let found = visible_form(x, DVec3::Z, facet, &[&occluder(&wall, 0.0)]);
        let half = [p(-1., -1., 1.), p(-1., 1., 1.), p(0., 1., 1.), p(0., -1., 1.)];
        let half = &facets(&[[half[0], half[1], half[2]], [half[0], half[2], half[3]]], FLAT)[0];
        assert!((found - visible_form(x, DVec3::Z, half, &[])).abs() < 1e-14);
    }
}
