//! Form factor from a point to the visible part of a facet, exactly: the shadows of convex occluders are cut out of its
//! tiles ([`crate::form_factors::geometry::shadow`]).
//!
//! Planes are as flat as the scene's numbers are exact, and edges are cut at the same bits from both sides, as ten
//! digits need. The cost grows with the number of pieces. Not handled: a point in an occluder's plane sees it edge on,
//! as nothing.

use glam::DVec3;

use crate::form_factors::geometry::plane::crossing;
use crate::form_factors::geometry::shadow::{Pieces, Shadow};
use crate::form_factors::objects::facet::Facet;
use crate::form_factors::objects::occluders::Occluder;

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
    use crate::form_factors::geometry::plane::plane_of;
    use crate::form_factors::objects::facet::facets;

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
