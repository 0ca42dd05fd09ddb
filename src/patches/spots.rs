//! Spots: boxes that hold narrow light, as a beam's disc or the sun through a slit, which all points of a patch may
//! miss.
//!
//! Where a box is known that holds it, the patch is cut into strata, what lies in the box and what does not, and what
//! the patch receives as emitted is the sum of the means over both by their areas:
//!
//! ```text
//! D_i = sum over strata s of  A_s / A_i  mean over points of s of D(x)
//! ```
//!
//! So F passes on the power that arrives. A patch as small as the spot would be as bright as that is, and rays of other
//! patches would meet it as seldom as points did. Whoever looks from a place of its own, a pixel, a point, a vertex of
//! a path, samples what the strata reflect there (`direct::strata_light`), so that nothing is blurred. A spot that
//! lies across several patches makes strata in each.
//!
//! Worth: a room of which a beam's disc is a quarter of the light is 25 % off without, 1 to 3 % with
//! (docs/validation.md, Where the stated error was too small).
//!
//! Not handled: where spots are ([`crate::error::landings`]); what masks cut away.

use glam::{DVec3, Vec3};
use rustc_hash::FxHashMap;

use crate::light::shares::draw;
use crate::patches::grid::Fragment;
use crate::rays::warp::triangle_point;
use crate::scene::Bounds;
use crate::scene::convex_polygon::cut;

/// A box, in unit coordinates.
pub type Spot = Bounds<Vec3>;

/// Spots, and the strata of the patches that they cut.
#[derive(Clone, Debug, Default)]
pub(super) struct Spots {
    pub list: Vec<Spot>,
    pub strata: FxHashMap<u32, Vec<Stratum>>,
}

/// A part of a patch's area.
#[derive(Clone, Debug)]
pub(crate) struct Stratum {
    fragments: Vec<Fragment>,
    /// Of the patch's area.
    pub share: f64,
}

impl Stratum {
    fn new(triangles: &[Triangle], whole: f64) -> Stratum {
        let area: f64 = triangles.iter().map(|own| own.area).sum();
        let mut sum = 0.0;
        let fragment = |own: &Triangle| {
            sum += own.area;
            Fragment { corners: own.corners.map(|p| p.as_vec3()), face: own.face, share: (sum / area) as f32 }
        };
        Stratum { fragments: triangles.iter().map(fragment).collect(), share: area / whole }
    }

    /// The point at (u, v) in the unit square, uniform in area, and the face that it lies on.
    pub(super) fn point(&self, u: f32, v: f32) -> (Vec3, u32) {
        let drawn = draw(&self.fragments, |own| own.share, u);
        let Fragment { corners, face, .. } = self.fragments[drawn.index];
        (triangle_point(corners, drawn.again(), v), face)
    }

    /// What of a patch of some triangles lies in each of some spots, and the rest; nothing where it lies in one
    /// altogether, or in none.
    pub(super) fn of(triangles: impl Iterator<Item = (u32, [Vec3; 3])>, spots: &[&Spot]) -> Vec<Stratum> {
        let triangle = |(face, corners): (u32, [Vec3; 3])| Triangle::new(face, corners.map(|p| p.as_dvec3()));
        let mut rest: Vec<Triangle> = triangles.map(triangle).collect();
        let whole: f64 = rest.iter().map(|own| own.area).sum();
        let mut strata = Vec::new();
        for spot in spots {
            let (mut inside, mut outside) = (Vec::new(), Vec::new());
            rest.iter().for_each(|own| own.part(spot, &mut inside, &mut outside));
            rest = outside;
            strata.extend((!inside.is_empty()).then(|| Stratum::new(&inside, whole)));
        }
        if strata.is_empty() || rest.is_empty() {
            return Vec::new();
        }
        strata.push(Stratum::new(&rest, whole));
        strata
    }
}

/// A triangle of a face, with its area.
#[derive(Clone, Copy)]
struct Triangle {
    face: u32,
    corners: [DVec3; 3],
    area: f64,
}

impl Triangle {
    fn new(face: u32, corners: [DVec3; 3]) -> Triangle {
        let [a, b, c] = corners;
        Triangle { face, corners, area: 0.5 * (b - a).cross(c - a).length() }
    }

    /// The triangles of a convex polygon of its face that have an area.
    fn fan(self, polygon: &[DVec3]) -> impl Iterator<Item = Triangle> {
        let triangle = move |k: usize| Triangle::new(self.face, [polygon[0], polygon[k - 1], polygon[k]]);
        (2..polygon.len()).map(triangle).filter(|own| own.area > 0.0)
    }

    /// Adds its parts inside and outside of a spot.
    fn part(self, spot: &Spot, inside: &mut Vec<Triangle>, outside: &mut Vec<Triangle>) {
        let mut rest = self.corners.to_vec();
        for (axis, limit, sign) in (0..3).flat_map(|k| [(k, spot.low[k], 1.0), (k, spot.high[k], -1.0)]) {
            let (mut within, mut beyond) = (Vec::new(), Vec::new());
            let height = |p: DVec3| sign * (p[axis] - f64::from(limit));
            let crossing = |(p, h): (DVec3, f64), (q, g): (DVec3, f64)| p.lerp(q, h / (h - g));
            cut(&rest, height, crossing, |p, [is_within, is_beyond]| {
                within.extend(is_within.then_some(p));
                beyond.extend(is_beyond.then_some(p));
            });
            outside.extend(self.fan(&beyond));
            rest = within;
        }
        inside.extend(self.fan(&rest));
    }
}
