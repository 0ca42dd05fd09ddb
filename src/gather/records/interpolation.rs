//! Irradiance between the records of a cache: local linear regression.
//!
//! Indirect irradiance varies slowly along a surface, over lengths of the distance R to what surrounds it (G. Ward, F.
//! Rubinstein, R. Clear 1988: the harmonic mean of the hemisphere rays' lengths). The value at a place is that of a
//! plane fitted to the records nearby, each weighted down to 0 at its valid radius, a small part of its own R; the fit
//! is exact for irradiance that varies linearly, so what remains is of second order in that part, and noise averages
//! over the records.
//!
//! A fit is a linear combination of the records' values. The sum of its squared coefficients is the share of their
//! variance that it leaves: small where many records surround the place, large where it extrapolates.
//!
//! Not handled: direct light, whose shadows have sharp edges.

use glam::{DMat3, DVec3};

use crate::gather::pixels::pixel_layer::Place;

/// Normals of neighbours agree to this cosine.
const ALIGNED: f32 = 0.97;
/// Neighbours lie within this share of the valid radius off the tangent plane.
const FLAT: f64 = 0.02;
/// Where the surface bends they lie off it by at most so much more of their distance for each unit that normals differ
/// by: half of it on a circle, and a little more between flat facets.
const BENT: f64 = 0.75;
/// Ridge of the regression, for neighbours that lie in a line or are few.
const RIDGE: f64 = 1e-4;

/// Place, valid radius and weight of a record.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Support {
    pub place: Place,
    /// The valid radius, unit coordinates.
    pub radius: f64,
    /// Weight in fits.
    pub weight: f64,
}

/// Coefficients of a fit: the irradiance is the sum of `coefficient * value` over the records.
#[derive(Clone, Debug, Default)]
pub(crate) struct Fit {
    pub coefficients: Vec<(u32, f64)>,
    inverse: DMat3,
    terms: Vec<(u32, f64, DVec3)>,
    /// Sum of the weights.
    total: f64,
    /// Unit of length in the fit.
    unit: f64,
    axes: [DVec3; 2],
    /// The value is a mean, not a plane's.
    flat: bool,
}

impl Fit {
    /// Begins a fit at a place.
    pub(crate) fn begin(&mut self, at: &Place) {
        self.terms.clear();
        self.coefficients.clear();
        self.unit = 0.0;
        self.flat = false;
        let (u, v) = at.normal.as_dvec3().any_orthonormal_pair();
        self.axes = [u, v];
    }

    /// Adds record k, unless it is too far from the place, off its plane, or looks another way.
    #[inline]
    pub(crate) fn consider(&mut self, at: &Place, k: u32, support: &Support) {
        let d = support.place.position - at.position;
        let nearness = 1.0 - d.length_squared() / (support.radius * support.radius);
        if nearness <= 0.0
            || at.material != support.place.material
            || at.normal.dot(support.place.normal) < ALIGNED
            || is_off(at, support, d)
        {
            return;
        }
        if self.unit == 0.0 {
            self.unit = support.radius;
        }
        let place = DVec3::new(1.0, d.dot(self.axes[0]) / self.unit, d.dot(self.axes[1]) / self.unit);
        self.terms.push((k, support.weight * nearness, place));
    }

    /// Solves for the value in the middle, the first row of the inverse of the normal equations; false without records.
    pub(crate) fn solve(&mut self) -> bool {
        let mut normal = DMat3::ZERO;
        for (_, w, b) in &self.terms {
            normal += DMat3::from_cols(*b * b.x, *b * b.y, *b * b.z) * *w;
        }
        if normal.x_axis.x <= 0.0 {
            return false;
        }
        self.total = normal.x_axis.x;
        let ridge = RIDGE * (normal.y_axis.y + normal.z_axis.z) + 1e-9 * self.total;
        normal += DMat3::from_diagonal(DVec3::new(0.0, ridge, ridge));
        self.inverse = normal.inverse();
        let first = self.inverse.x_axis;
        self.coefficients.extend(self.terms.iter().map(|(k, w, b)| (*k, w * first.dot(*b))));
        true
    }

    /// Replaces a fit that leaves more than `most` of a record's variance, as it extrapolates, by the mean.
    pub(crate) fn settle(&mut self, most: f64) {
        if self.coefficients.len() > 1 && self.variance() > most {
            self.flat = true;
            let terms = self.terms.iter();
            self.coefficients.clear();
            self.coefficients.extend(terms.map(|(k, w, _)| (*k, w / self.total)));
        }
    }

    /// Coefficients of the change of the fitted value over a step; none where the fit is a mean.
    pub(crate) fn change(&self, step: DVec3) -> impl Iterator<Item = (u32, f64)> {
        let [u, v] = self.axes.map(|axis| step.dot(axis) / self.unit.max(f64::MIN_POSITIVE));
        let row = self.inverse.y_axis * u + self.inverse.z_axis * v;
        let terms = if self.flat { &[][..] } else { &self.terms };
        terms.iter().map(move |(k, w, b)| (*k, w * row.dot(*b)))
    }

    /// The value is 0.
    pub(crate) fn clear(&mut self) {
        self.flat = true;
        self.coefficients.clear();
    }

    /// Takes one record's value as it is.
    pub(crate) fn take(&mut self, record: u32) {
        self.clear();
        self.coefficients.push((record, 1.0));
    }

    /// Variance left of records of equal variance.
    pub(crate) fn variance(&self) -> f64 {
        self.coefficients.iter().map(|(_, s)| s * s).sum()
    }
}

/// Whether a step from a place to a record leaves the surface, as to a parallel one next to it.
#[inline]
fn is_off(at: &Place, support: &Support, d: DVec3) -> bool {
    let bend = f64::from((at.normal - support.place.normal).length());
    d.dot(at.normal.as_dvec3()).abs() > FLAT * support.radius + BENT * bend * d.length()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use glam::Vec3;

    use super::*;

    fn known(x: f64, y: f64, radius: f64, normal: Vec3) -> Support {
        Support { place: Place { position: DVec3::new(x, y, 0.0), normal, material: 0 }, radius, weight: 1.0 }
    }

    /// A floor with records 0.01 apart.
    fn floor(radius: f64) -> Vec<Support> {
        let at = |k: usize| ((k % 9) as f64 * 0.01, (k / 9) as f64 * 0.01);
        (0..81).map(|k| known(at(k).0, at(k).1, radius, Vec3::Z)).collect()
    }

    fn fitted(points: &[Support], at: &Support, value: impl Fn(&Support) -> f64) -> Option<(f64, f64)> {
        let mut fit = Fit::default();
        fit.begin(&at.place);
        for (k, p) in points.iter().enumerate() {
            fit.consider(&at.place, k as u32, p);
        }
        fit.solve().then(|| {
            let coefficients = fit.coefficients.iter();
            let sum = coefficients.map(|(k, s)| s * value(&points[*k as usize])).sum();
            (sum, fit.variance())
        })
    }

    proptest! {
        #[test]
        fn linear_irradiance_passes_unchanged(
            a in 1.0..2.0f64, b in -3.0..3.0f64, c in -3.0..3.0f64, x in 0.0..0.08f64, y in 0.0..0.08f64
        ) {
            let field = |p: &Support| a + b * p.place.position.x + c * p.place.position.y;
            let at = known(x, y, 1.0, Vec3::Z);
            let (value, _) = fitted(&floor(0.035), &at, field).unwrap();
            // A ridge r takes r mᵀ (C + r)⁻¹ s of slopes s over the radius, where m is the neighbours' centroid and C
            // their covariance, summed: 1.94e-4 |s| at most, in the corners of the floor.
            prop_assert!((value - field(&at)).abs() < 2e-4 * 0.035 * b.hypot(c), "{value} {}", field(&at));
        }
    }

    #[test]
    fn variance_falls_inside_and_rises_outside() {
        let points = floor(0.035);
        let variance = |x: f64, y: f64| fitted(&points, &known(x, y, 1.0, Vec3::Z), |_| 1.0);
        let inside = variance(0.04, 0.04).unwrap().1;
        // Some 38 records lie within the radius; the parabolic kernel makes 3/4 as many of them.
        assert!((0.02..0.06).contains(&inside), "{inside}");
        assert!(variance(0.1, 0.04).unwrap().1 > 3.0 * inside);
        assert!(variance(0.2, 0.04).is_none());
    }

    #[test]
    fn a_parallel_board_is_another_surface_and_the_next_facet_of_a_round_one_is_not() {
        // A board 1 mm higher within a radius of 35 mm; a facet of a cylinder of radius 0.1 one degree on.
        let at = known(0.0, 0.0, 1.0, Vec3::Z).place;
        let mut board = known(0.01, 0.0, 0.035, Vec3::Z);
        board.place.position.z = 0.001;
        let angle = f64::to_radians(1.0);
        let mut facet = known(0.1 * angle.sin(), 0.0, 0.035, Vec3::Z);
        facet.place.position.z = 0.1 * (angle.cos() - 1.0);
        facet.place.normal = Vec3::new(angle.sin() as f32, 0.0, angle.cos() as f32);
        let mut fit = Fit::default();
        fit.begin(&at);
        fit.consider(&at, 0, &board);
        fit.consider(&at, 1, &facet);
        assert!(fit.solve());
        assert_eq!(fit.coefficients.iter().map(|s| s.0).collect::<Vec<_>>(), [1]);
    }

    #[test]
    fn another_surface_is_not_mixed_in() {
        let mut points = floor(0.035);
        points.extend((0..81).map(|k| known((k % 9) as f64 * 0.01, (k / 9) as f64 * 0.01, 0.035, Vec3::X)));
        let value = |p: &Support| if p.place.normal == Vec3::X { 5.0 } else { 1.0 };
        let (fit, _) = fitted(&points, &known(0.04, 0.04, 1.0, Vec3::Z), value).unwrap();
        assert!((fit - 1.0).abs() < 1e-9);
    }
}
