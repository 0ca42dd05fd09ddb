//! Which emitters hemisphere rays find well enough, and which are worth a closed form.
//!
//! Of N hemisphere rays a share F meets the emitter, so light from it has the relative variance `(1 - F) / (F N)`. A
//! luminaire is asked by its closed form and one visibility ray, which together cost what `1 + PRICE n` hemisphere rays
//! do where it has n faces, and leave the variance `(1 - V) / V` where the share V of it is seen, 1 if that is a half.
//! So luminaires are the better way where
//!
//! ```text
//! (1 - F) / F  >  1 + PRICE n          F < 1 / (2 + PRICE n)
//! ```
//!
//! F is measured in each scene: the mean of the closed form over points of the reflecting surfaces, of those that the
//! emitter is above the horizon of. A wide window far away is small by that measure, however large its area; a sky
//! around everything, or a furnace, is large.
//!
//! Not handled: what lies between. A sky seen through a window counts as large, since its closed form would mostly be
//! of what is hidden.

use glam::DVec3;

use crate::form_factors::point_to_polygon;
use crate::light::Rgb;
use crate::rays::sobol::{Sobol, hash};
use crate::rays::warp::triangle_point;
use crate::scene::{Scene, Sides};

/// Cost of one triangle of a closed form over that of a ray, about (measured on one core: 20 ns, and 300 ns in a small
/// room). The choice moves by little where this is off: a lamp of two faces is carried up to F = 0.47, one of a hundred
/// to 0.12.
const PRICE: f64 = 1.0 / 16.0;
/// Faces that a receiver asks at most: where there are more, [`crate::direct::light_cut`] spare it most of them.
const MOST_ASKED: usize = 128;
/// Points of the reflecting surfaces.
const POINTS: usize = 256;
/// Closed forms of triangles for all points together; of more faces only every so many are taken.
const MOST_FORMS: usize = 1 << 19;

/// A face with its corners turned so that they run counter-clockwise seen from a side that counts.
type Turned = [DVec3; 3];

/// Per material: whether it emits, has no mask, and is small enough, as seen from the surfaces that reflect,
/// for luminaires to carry it.
pub(crate) fn carried(scene: &Scene) -> Vec<bool> {
    let points = receivers(scene);
    let carried = |m: usize| {
        let material = &scene.materials[m];
        let whole = material.maps.as_ref().is_none_or(|maps| maps.mask.is_none());
        material.emits() && whole && !scene.is_sky_material(m) && {
            let faces = sides(scene, |face| face == m as u32);
            let asked = faces.len().min(MOST_ASKED) as f64;
            seen(&points, &faces) < 1.0 / (2.0 + PRICE * asked)
        }
    };
    (0..scene.materials.len()).map(carried).collect()
}

/// The sides that reflect and emit of the faces whose material is `wanted`.
fn sides(scene: &Scene, wanted: impl Fn(u32) -> bool) -> Vec<Turned> {
    let mut list = Vec::new();
    for (f, face) in scene.faces.iter().enumerate() {
        if wanted(face.material) {
            let [a, b, c] = scene.exact_corners(f as u32);
            list.push([a, b, c]);
            if scene.material(f as u32).sides == Sides::Two {
                list.push([a, c, b]);
            }
        }
    }
    list
}

/// Points of the reflecting surfaces, spread evenly over their area, with their normals.
fn receivers(scene: &Scene) -> Vec<(DVec3, DVec3)> {
    let reflects = |m: u32| scene.materials[m as usize].rho != Rgb::ZERO;
    let faces = sides(scene, reflects);
    let mut until = Vec::with_capacity(faces.len());
    let mut sum = 0.0;
    for [a, b, c] in &faces {
        sum += (*b - *a).cross(*c - *a).length();
        until.push(sum);
    }
    let sobol = Sobol::new(POINTS, 2);
    let point = |k: usize| {
        let at = (k as f64 + 0.5) / POINTS as f64 * sum;
        let face = faces[until.partition_point(|&u| u <= at).min(faces.len() - 1)];
        let [a, b, c] = face;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let (u, v) = (sobol.point(k as u32, 0, 0), sobol.point(k as u32, 1, 0));
        let place = triangle_point(face.map(|p| p.as_vec3()), u, v);
        (place.as_dvec3(), normal)
    };
    let count = if faces.is_empty() { 0 } else { POINTS };
    (0..count).map(point).collect()
}

/// Mean form factor to the faces from those of the points that they are above the horizon of; 0 where there are none.
fn seen(points: &[(DVec3, DVec3)], faces: &[Turned]) -> f64 {
    let stride = (faces.len() * points.len()).div_ceil(MOST_FORMS).max(1);
    let from = |(k, &(x, n)): (usize, &(DVec3, DVec3))| -> f64 {
        let first = hash(k as u32, 0x1a6e) as usize % stride;
        let taken = faces.iter().skip(first).step_by(stride);
        let forms = taken.map(|t| point_to_polygon(n, &t.map(|p| p - x)));
        stride as f64 * forms.sum::<f64>()
    };
    let forms: Vec<f64> = points.iter().enumerate().map(from).collect();
    let count = forms.iter().filter(|&&f| f > 0.0).count();
    forms.iter().sum::<f64>() / count.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Material;

    /// A floor of side 2 and a panel above it that faces down, of the given side and height.
    fn under(side: f64, height: f64) -> Scene {
        let floor = Material::new("floor", Rgb::splat(0.5), Rgb::ZERO);
        let glow = Material::new("glow", Rgb::ZERO, Rgb::ONE);
        let square = |a: f64, z: f64, turn: f64| {
            let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
            corners.map(|(x, y)| DVec3::new(0.5 * a * x, 0.5 * a * turn * y, z))
        };
        let corners = [square(2.0, 0.0, 1.0), square(side, height, -1.0)].concat();
        let faces = [(vec![0, 1, 2, 3], 0), (vec![4, 5, 6, 7], 1)];
        Scene::from_faces("panel", &corners, &faces, vec![floor, glow]).expect("a correct scene")
    }

    #[test]
    fn what_is_large_is_told_by_solid_angle_and_not_by_area() {
        // Form factors from the floor's middle: 4/(20² pi), 0.24 and 0.99.
        assert_eq!(carried(&under(4.0, 20.0)), [false, true]);
        assert_eq!(carried(&under(2.0, 2.0)), [false, true]);
        assert_eq!(carried(&under(20.0, 1.0)), [false, false]);
    }

    #[test]
    fn the_mean_form_factor_is_that_of_the_catalogue() {
        // Two parallel unit squares one apart, twice as large: Howell's catalogue, C-11.
        let scene = under(2.0, 2.0);
        let found = seen(&receivers(&scene), &sides(&scene, |m| m == 1));
        // 256 stratified points: their error is far below the integrand's range of 0.1 over sqrt(256).
        assert!((found - 0.199_825).abs() < 0.1 / 16.0, "{found}");
    }

    #[test]
    fn lamps_are_luminaires_and_a_furnace_is_not() {
        for (name, luminaires) in [
            ("cornell-box", true),
            ("furnace", false),
            ("concentric-spheres", true),
            ("furnished-room", true),
            ("two-rooms", true),
        ] {
            let scene = Scene::open(name).expect("built in");
            assert_eq!(carried(&scene).contains(&true), luminaires, "{name}");
        }
    }
}
