//! Random triangles: the hierarchy and the f32 test against every triangle in f64.

use glam::DMat3;
use proptest::prelude::*;

use crate::rays::ray_offset::{LIFT, MARGIN};
use crate::rays::tests::*;

/// What f64 says about a line and a triangle.
#[derive(Debug)]
struct Truth {
    t: f64,
    side: Side,
    /// Least barycentric weight times the triangle's height seen along the ray: the distance inside the outline.
    inside: f64,
    /// |cos| between the ray and the normal.
    slope: f64,
}

fn truth([a, b, c]: [Vec3; 3], ray: &Ray) -> Option<Truth> {
    let [a, b, c, o, d] = [a, b, c, ray.origin, ray.direction].map(|v| v.as_dvec3());
    let cross = (b - a).cross(c - a);
    let matrix = DMat3::from_cols(b - a, c - a, -d);
    if matrix.determinant().abs() < 1e-12 {
        return None;
    }
    let solved = matrix.inverse() * (o - a);
    let weights = [1.0 - solved.x - solved.y, solved.x, solved.y];
    let seen = |p: DVec3, q: DVec3| (q - p).cross(d).length();
    let double_area = cross.dot(d).abs();
    let heights = [seen(b, c), seen(c, a), seen(a, b)].map(|edge| double_area / edge);
    let inside = (0..3).map(|i| weights[i] * heights[i]).fold(f64::INFINITY, f64::min);
    Some(Truth {
        t: solved.z,
        side: if cross.dot(d) < 0.0 { Side::Front } else { Side::Back },
        inside,
        slope: cross.dot(d).abs() / cross.length(),
    })
}

/// Rounding of a sheared corner: three operations on numbers below 4.
const OUTLINE: f64 = 4e-6;

/// The ray as it is cast: from where `RayOffset` moves its start to.
fn moved(scene: &Scene, rays: &Rays, ray: &Ray) -> Ray {
    let origin = Vec3::from(rays.query(ray).origin);
    let most = ray.source.map_or(0.0, |face| most_moved(scene.corners(face)));
    let shift = origin.distance(ray.origin);
    assert!(shift <= most, "{shift} {most}");
    Ray { origin, ..*ray }
}

/// How far a start on a triangle is moved at most: lifted, and moved inwards to the margin on the way to the centroid.
///
/// The centroid keeps a third of a height h from an edge. A start that keeps less than the margin, and less than half
/// of that, goes the share (margin + rounding) / (h / 6) at most of the way, which is at most two thirds of the longest
/// edge L: together 4 L / h margins, of which slivers have many.
fn most_moved([a, b, c]: [Vec3; 3]) -> f32 {
    const ROUNDING: f32 = 5e-7;
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let height = (b - a).cross(c - a).length() / longest;
    LIFT + ROUNDING + 4.0 * (MARGIN + ROUNDING) * longest / height
}

/// The crossings that are certain, and those that rounding may take either way.
fn brute_force(scene: &Scene, rays: &Rays, ray: &Ray) -> (Vec<(u32, Truth)>, Vec<u32>) {
    let (mut sure, mut open) = (Vec::new(), Vec::new());
    for face in 0..scene.faces.len() as u32 {
        if ray.source.is_some_and(|s| rays.plane(s) == rays.plane(face)) {
            continue;
        }
        let Some(truth) = truth(scene.corners(face), ray) else {
            open.push(face);
            continue;
        };
        let doubt = OUTLINE / truth.slope;
        if truth.inside > OUTLINE && truth.t > doubt && truth.slope > 1e-3 {
            sure.push((face, truth));
        } else if truth.inside > -OUTLINE && truth.t > -doubt {
            open.push(face);
        }
    }
    sure.sort_by(|a, b| a.1.t.total_cmp(&b.1.t));
    (sure, open)
}

fn corner() -> impl Strategy<Value = Vec3> {
    (-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

/// Triangles of all sizes, none a sliver.
fn soup() -> impl Strategy<Value = Vec<[Vec3; 3]>> {
    let triangle = (corner(), corner(), corner(), 0.05f32..1.0)
        .prop_map(|(a, b, c, size)| [a, a + 0.5 * size * (b - a), a + 0.5 * size * (c - a)]);
    let fat = triangle.prop_filter("a sliver has no sure plane", |&[a, b, c]| {
        (b - a).cross(c - a).length() > 0.02 * (b - a).length().max((c - a).length()).powi(2)
    });
    prop::collection::vec(fat, 1..120)
}

fn check(scene: &Scene, rays: &Rays, ray: &Ray) -> Result<(), TestCaseError> {
    let cast = moved(scene, rays, ray);
    let (sure, open) = brute_force(scene, rays, &cast);
    let mut hits = Vec::new();
    rays.crossings(ray, &mut hits);
    // Same faces, but for those in doubt.
    let mut found: Vec<u32> = hits.iter().map(|h| h.face).filter(|f| !open.contains(f)).collect();
    let mut expected: Vec<u32> = sure.iter().map(|s| s.0).collect();
    found.sort_unstable();
    expected.sort_unstable();
    prop_assert_eq!(found, expected);
    // Same place and side, in order.
    prop_assert!(hits.windows(2).all(|w| w[0].t <= w[1].t + 1e-5));
    for (face, truth) in &sure {
        let hit = hits.iter().find(|h| h.face == *face).expect("just compared");
        prop_assert_eq!(hit.side, truth.side);
        let doubt = OUTLINE / truth.slope;
        prop_assert!((f64::from(hit.t) - truth.t).abs() < doubt);
        let [a, b, c] = scene.corners(*face);
        let place = (1.0 - hit.u - hit.v) * a + hit.u * b + hit.v * c;
        let off = place.distance(cast.origin + hit.t * cast.direction);
        // The place errs in two coordinates by its weights, the ray's end by t.
        prop_assert!(f64::from(off) < (1.0 + 2f64.sqrt()) * doubt);
    }
    // The closest is the first crossing, up to ties in t that the edge rule merges.
    let closest = rays.closest(ray);
    prop_assert_eq!(closest.is_some(), !hits.is_empty());
    if let (Some(closest), Some(first)) = (closest, hits.first()) {
        prop_assert_eq!(closest, *first);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn crossings_and_closest_agree_with_brute_force(triangles in soup(), seed in 0u32..1_000_000) {
        let scene = plain(&triangles);
        let rays = Rays::new(&scene);
        let mut dice = Random(seed.wrapping_mul(4096));
        for _ in 0..200 {
            let ray = Ray { origin: dice.point(), direction: dice.direction(), source: None };
            check(&scene, &rays, &ray)?;
            // From a face, to either side; the sheet of the face and its like is not met again.
            let face = (dice.next() * triangles.len() as f32) as u32;
            let u = dice.pair();
            let origin = warp::triangle_point(triangles[face as usize], u.x, u.y);
            let ray = Ray { origin, direction: dice.direction(), source: Some(face) };
            check(&scene, &rays, &ray)?;
        }
    }

    #[test]
    fn visibility_agrees_with_brute_force(triangles in soup(), seed in 0u32..1_000_000) {
        let scene = plain(&triangles);
        let rays = Rays::new(&scene);
        let mut dice = Random(seed.wrapping_mul(4096));
        for _ in 0..200 {
            let mut end = || {
                let face = (dice.next() * triangles.len() as f32) as usize;
                let u = dice.pair();
                (warp::triangle_point(triangles[face], u.x, u.y), Some(face as u32))
            };
            let (a, b) = (end(), end());
            let across = b.0 - a.0;
            if across.length() < 1e-3 {
                continue;
            }
            let ray = Ray { origin: a.0, direction: across.normalize(), source: a.1 };
            let (sure, open) = brute_force(&scene, &rays, &ray);
            let length = f64::from(across.length());
            let goal = rays.plane(b.1.expect("on a face"));
            let others = |face: u32| rays.plane(face) != goal;
            let near_end = |s: &Truth| (s.t - length).abs() < OUTLINE / s.slope;
            if sure.iter().any(|(f, s)| others(*f) && near_end(s)) || open.iter().any(|&f| others(f)) {
                continue;
            }
            let blocked = sure.iter().any(|(f, s)| others(*f) && s.t < length);
            prop_assert_eq!(rays.visible(a, b), !blocked);
        }
    }
}
