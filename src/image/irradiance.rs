//! Irradiance smoothed over the surface: local linear regression on the neighbouring pixels' estimates.
//!
//! Indirect irradiance varies slowly along a surface, over lengths of the distance R to what surrounds it (Ward,
//! Rubinstein and Clear 1988: the harmonic mean of the hemisphere rays' lengths). Each point's estimate is replaced by
//! the value there of a plane fitted to the estimates within a small part of R, weighted by nearness; the fit is exact
//! for irradiance that varies linearly, so what remains is of second order in the part of R, and the noise falls with
//! the square root of the number of neighbours. Near a contact R shrinks and nothing is smoothed.
//!
//! Not handled: direct light, whose shadows have sharp edges.

use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;

use crate::light::Rgb;
use crate::rays::Side;

/// What the camera rays of one pixel saw of one surface, and the irradiance found there.
#[derive(Clone, Debug)]
pub(super) struct Layer {
    /// Plane, side and material: camera rays of one pixel that agree in these share a layer.
    pub key: (u32, Side, u32),
    /// Mean of the points seen.
    pub position: DVec3,
    /// Unit normal of the side seen.
    pub normal: Vec3,
    /// Reflectance.
    pub rho: Rgb,
    /// Number of camera rays.
    pub count: u32,
    /// Harmonic mean of the distances to what surrounds the points; while adding, the sum of inverse distances.
    pub surroundings: f64,
    /// Irradiance over pi of each field, mean over the camera rays: W/(m² sr).
    pub incident: Vec<DVec3>,
}

impl Layer {
    /// A layer that no ray has seen yet.
    pub fn new(key: (u32, Side, u32), normal: Vec3, rho: Rgb, fields: usize) -> Layer {
        Layer {
            key,
            position: DVec3::ZERO,
            normal,
            rho,
            count: 0,
            surroundings: 0.0,
            incident: vec![DVec3::ZERO; fields],
        }
    }

    /// Adds one camera ray: the point seen, its mean inverse distance to the surroundings, its irradiance over pi.
    pub fn add(&mut self, position: Vec3, nearness: f64, incident: &[DVec3]) {
        self.count += 1;
        self.position += position.as_dvec3();
        self.surroundings += nearness;
        for (sum, i) in self.incident.iter_mut().zip(incident) {
            *sum += *i;
        }
    }

    /// Turns sums into means.
    pub fn settle(&mut self) {
        let count = f64::from(self.count);
        self.position /= count;
        self.surroundings = count / self.surroundings;
        for sum in &mut self.incident {
            *sum /= count;
        }
    }
}

/// Neighbours lie within this share of R.
const REACH: f64 = 0.15;
/// Pixels looked at to each side.
const WINDOW: usize = 3;
/// Normals of neighbours agree to this cosine.
const ALIGNED: f32 = 0.97;
/// Neighbours lie within this share of the reach off the tangent plane.
const FLAT: f64 = 0.25;
/// Keeps the fit regular where neighbours lie in a line or are few: a slope costs something.
const RIDGE: f64 = 1e-4;

/// The smoothed irradiance of every layer of every pixel, in the same order; `layers[y * width + x]`.
pub(super) fn smooth(layers: &[Vec<Layer>], width: usize) -> Vec<Vec<Vec<Rgb>>> {
    let height = layers.len() / width.max(1);
    let around = |x: usize, y: usize| {
        let rows = y.saturating_sub(WINDOW)..(y + WINDOW + 1).min(height);
        rows.flat_map(move |v| {
            let columns = x.saturating_sub(WINDOW)..(x + WINDOW + 1).min(width);
            columns.flat_map(move |u| &layers[v * width + u])
        })
    };
    layers
        .par_iter()
        .enumerate()
        .map(|(k, own)| {
            let fit = |layer| fitted(layer, around(k % width, k / width));
            own.iter().map(fit).collect()
        })
        .collect()
}

/// The value at a layer of the plane fitted to its neighbours (itself among them), field by field.
fn fitted<'a>(own: &Layer, around: impl Iterator<Item = &'a Layer>) -> Vec<Rgb> {
    let neighbours: Vec<(f64, DVec3, &Layer)> = around
        .filter_map(|other| relate(own, other).map(|(w, b)| (w, b, other)))
        .collect();
    // Solve the normal equations for the value at the middle: the first row of the inverse.
    let mut normal = DMat3::ZERO;
    for (w, b, _) in &neighbours {
        normal += DMat3::from_cols(*b * b.x, *b * b.y, *b * b.z) * *w;
    }
    let ridge = RIDGE * (normal.y_axis.y + normal.z_axis.z) + 1e-12 * normal.x_axis.x;
    normal += DMat3::from_diagonal(DVec3::new(0.0, ridge, ridge));
    let first = normal.inverse().x_axis;
    let mut values = vec![DVec3::ZERO; own.incident.len()];
    for (w, b, other) in &neighbours {
        let share = w * first.dot(*b);
        for (sum, value) in values.iter_mut().zip(&other.incident) {
            *sum += share * *value;
        }
    }
    // A plane through noise may dip below the dark; light does not.
    values
        .iter()
        .map(|v| v.max(DVec3::ZERO).as_vec3())
        .collect()
}

/// A neighbour's weight and its place (1, u, v) in the tangent plane, in units of the reach; none where it is too far,
/// off the plane, or looks another way.
fn relate(own: &Layer, other: &Layer) -> Option<(f64, DVec3)> {
    let normal = own.normal.as_dvec3();
    let reach = REACH * own.surroundings.min(other.surroundings);
    let d = other.position - own.position;
    let off = d.dot(normal).abs();
    let itself = std::ptr::eq(own, other);
    if itself || reach == 0.0 {
        return itself.then_some((f64::from(own.count), DVec3::X));
    }
    if d.length_squared() >= reach * reach
        || own.normal.dot(other.normal) < ALIGNED
        || off > FLAT * reach
    {
        return None;
    }
    let (u, v) = normal.any_orthonormal_pair();
    let (u, v) = (d.dot(u) / reach, d.dot(v) / reach);
    let weight = f64::from(other.count) * (1.0 - u * u - v * v).max(0.0);
    Some((weight, DVec3::new(1.0, u, v)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const WIDTH: usize = 9;

    /// A floor seen from above, one layer a pixel, 0.01 apart, with the irradiance that `value` gives.
    fn floor(value: impl Fn(f64, f64) -> f64) -> Vec<Vec<Layer>> {
        let at = |k: usize| ((k % WIDTH) as f64 * 0.01, (k / WIDTH) as f64 * 0.01);
        (0..WIDTH * WIDTH)
            .map(|k| {
                let (x, y) = at(k);
                vec![Layer {
                    key: (0, Side::Front, 0),
                    position: DVec3::new(x, y, 0.0),
                    normal: Vec3::Z,
                    rho: Rgb::ONE,
                    count: 4,
                    surroundings: 1.0,
                    incident: vec![DVec3::splat(value(x, y))],
                }]
            })
            .collect()
    }

    proptest! {
        #[test]
        fn linear_irradiance_passes_unchanged(a in 1.0..2.0f64, b in -3.0..3.0f64, c in -3.0..3.0f64) {
            let layers = floor(|x, y| a + b * x + c * y);
            for (own, found) in layers.iter().zip(smooth(&layers, WIDTH)) {
                let (exact, found) = (own[0].incident[0].x, f64::from(found[0][0].x));
                // The ridge damps slopes by a few times 1e-4, over the 0.03 of the window.
                prop_assert!((found - exact).abs() < 2e-3 * 0.03 * 6.0 + 1e-6, "{found} {exact}");
            }
        }
    }

    #[test]
    fn noise_falls_with_the_number_of_neighbours() {
        let noise = |x: f64, y: f64| 1.0 + ((x * 7919.0 + y * 104_729.0) * 1e3).sin();
        let layers = floor(noise);
        let spread = |values: &[f32]| {
            let mean = values.iter().sum::<f32>() / values.len() as f32;
            values.iter().map(|v| (v - mean).powi(2)).sum::<f32>() / values.len() as f32
        };
        let raw: Vec<f32> = layers.iter().map(|l| l[0].incident[0].x as f32).collect();
        let smoothed: Vec<f32> = smooth(&layers, WIDTH).iter().map(|l| l[0][0].x).collect();
        // Inside the window of 49 the variance falls at least tenfold, at the rim of the picture less.
        assert!(spread(&smoothed) < 0.2 * spread(&raw));
    }

    #[test]
    fn a_contact_keeps_its_own_value() {
        let mut layers = floor(|x, _| x);
        for l in layers.iter_mut().flatten() {
            l.surroundings = 1e-3;
        }
        for (own, found) in layers.iter().zip(smooth(&layers, WIDTH)) {
            assert_eq!(own[0].incident[0].as_vec3(), found[0][0]);
        }
    }

    #[test]
    fn another_surface_is_not_mixed_in() {
        let mut layers = floor(|_, _| 1.0);
        for l in layers.iter_mut().skip(40).flatten() {
            l.normal = Vec3::X;
            l.incident = vec![DVec3::splat(5.0)];
        }
        for (own, found) in layers.iter().zip(smooth(&layers, WIDTH)) {
            assert!((own[0].incident[0].x as f32 - found[0][0].x).abs() < 1e-5);
        }
    }
}
