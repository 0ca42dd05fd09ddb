//! Closed forms against form factors known to many digits, and against the Cornell box's irradiances.
//!
//! The sources of the numbers stand in `tests/data`. Not tested here: gaps and slivers so extreme that quadrature over
//! the receiving polygon would need a rule of its own.

use std::f64::consts::PI;

use glam::{DVec3, Vec2};
use halflight::Solver;
use halflight::direct::{Choice, LightSum, Occlusion, Scratch};
use halflight::form_factors::point_to_polygon;
use halflight::rays::sobol::Sobol;
use halflight::surfaces::SurfacePoint;
use serde_json::Value;

use crate::common::{builtin, lights_behind, mean_and_error};

/// x and z of the corners of the Cornell box's lamp.
const LAMP: [(f64, f64); 4] = [(213.0, 227.0), (343.0, 227.0), (343.0, 332.0), (213.0, 332.0)];

#[test]
fn direct_irradiance_of_the_cornell_box() {
    let scene = builtin("cornell-box");
    let lights = lights_behind(&Solver::new(&scene).cut(100), &Occlusion::Opaque);
    let luminaire = &lights.luminaires.list[0];
    let points: Value = serde_json::from_str(include_str!("data/cornell/irradiance_points.json")).unwrap();
    let mut whole = 0;
    for point in points.as_array().unwrap() {
        let receiver = SurfacePoint {
            position: scene.frame.to_unit(vector(&point["pos"])).as_vec3(),
            normal: vector(&point["normal"]).as_vec3(),
            face: point["tri"].as_u64().unwrap() as u32,
        };
        let unit = PI * luminaire.radiance.as_dvec3();
        let closed = unit * luminaire.closed_form(receiver.position, receiver.normal).unwrap();
        let exact = vector(&point["E_direct_analytic_unoccluded"]);
        // That field knows no horizon: it holds where all of the lamp is above it. E_direct below holds everywhere.
        let above = LAMP.iter().all(|&(x, z)| {
            let to_corner = DVec3::new(x, 548.8, z) - vector(&point["pos"]);
            to_corner.dot(vector(&point["normal"])) >= 0.0
        });
        // The place is rounded to f32, 1e-7 of a distance of about 0.3 at the least.
        let apart = (closed - exact).abs().max_element();
        assert!(!above || apart < 1e-5, "{}: {closed} {exact}", point["name"]);
        whole += usize::from(above);
        let estimate = |seed: u32| {
            let (cuts, mut sum, sobol) = (lights.cuts_at(&receiver), LightSum::default(), Sobol::new(8192, 2));
            let draw = |choice: Choice| Vec2::new(sobol.point(choice.k, 0, seed), sobol.point(choice.k, 1, seed));
            lights.add(&mut sum, (&receiver, cuts.cuts(), DVec3::ONE), 1024, draw, &mut Scratch::default());
            (PI * sum.total()).x
        };
        let found: Vec<f64> = (0..8).map(estimate).collect();
        let (mean, error) = mean_and_error(&found);
        let (reference, se) = (vector(&point["E_direct"]).x, vector(&point["E_direct_se"]).x);
        let allowed = 4.0 * error.hypot(se) + 1e-5;
        assert!((mean - reference).abs() < allowed, "{}: {mean} {reference} {allowed}", point["name"]);
    }
    assert!(whole >= 10, "{whole}");
}

/// Points and weights of the Gauss-Legendre rule on [0, 1], by Newton's method on the Legendre polynomial.
fn gauss(n: usize) -> Vec<(f64, f64)> {
    let legendre = |x: f64| {
        let (mut p, mut q) = (1.0, x);
        for k in 2..=n {
            let k = k as f64;
            (p, q) = (q, ((2.0 * k - 1.0) * x * q - (k - 1.0) * p) / k);
        }
        (q, n as f64 * (x * q - p) / (x * x - 1.0))
    };
    let root = |i: usize| {
        let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        for _ in 0..50 {
            let (value, slope) = legendre(x);
            x -= value / slope;
        }
        let slope = legendre(x).1;
        (0.5 + 0.5 * x, 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(root).collect()
}

/// Area of a convex polygon.
fn area(polygon: &[DVec3]) -> f64 {
    let fan = (1..polygon.len() - 1).map(|k| (polygon[k] - polygon[0]).cross(polygon[k + 1] - polygon[0]));
    0.5 * fan.sum::<DVec3>().length()
}

/// Mean over a convex polygon of the form factor to a polygon.
fn mean_form_factor(from: &[DVec3], to: &[DVec3], n: usize) -> f64 {
    let normal = (from[1] - from[0]).cross(from[2] - from[0]).normalize();
    let rule = gauss(n);
    let (mut sum, mut area) = (0.0, 0.0);
    for k in 1..from.len() - 1 {
        let [a, b, c] = [from[0], from[k], from[k + 1]];
        let half = (b - a).cross(c - a).length();
        for &(u, wu) in &rule {
            for &(v, wv) in &rule {
                // Collapsed coordinates: the weight of the triangle's fan is u.
                let x = a + u * (b - a).lerp(c - a, v);
                let weight = wu * wv * u * half;
                area += weight;
                let seen = (1..to.len() - 1).map(|j| [to[0] - x, to[j] - x, to[j + 1] - x]);
                sum += weight * seen.map(|t| point_to_polygon(normal, &t)).sum::<f64>();
            }
        }
    }
    sum / area
}

/// The part of a convex polygon in front of the plane of another.
fn in_front(polygon: &[DVec3], of: &[DVec3]) -> Vec<DVec3> {
    let normal = (of[1] - of[0]).cross(of[2] - of[0]);
    let mut kept = Vec::new();
    for (k, &a) in polygon.iter().enumerate() {
        let b = polygon[(k + 1) % polygon.len()];
        let [h, g] = [a, b].map(|p| (p - of[0]).dot(normal));
        if h >= 0.0 {
            kept.push(a);
        }
        if h * g < 0.0 {
            kept.push(a.lerp(b, h / (h - g)));
        }
    }
    kept
}

fn cases() -> Vec<Value> {
    let file: Value = serde_json::from_str(include_str!("data/factors/factors.json")).unwrap();
    file["cases"].as_array().unwrap().clone()
}

fn vector(v: &Value) -> DVec3 {
    DVec3::from_array([0, 1, 2].map(|k| v[k].as_f64().unwrap()))
}

fn polygon(v: &Value) -> Vec<DVec3> {
    v.as_array().unwrap().iter().map(vector).collect()
}

fn exact(case: &Value) -> f64 {
    case["F12"].as_str().unwrap().parse().unwrap()
}

#[test]
fn polygon_pairs_known_exactly() {
    let groups = ["parallel", "perp_common_edge", "wedge", "triangles", "disc", "horizon"];
    let mut counted = 0;
    for case in cases().iter().filter(|c| groups.contains(&c["group"].as_str().unwrap())) {
        let (from, to) = (polygon(&case["surf1"]), polygon(&case["surf2"]));
        if from.len() > 16 {
            // A polygon of 256 corners would take as long as all the others.
            continue;
        }
        let seeing = in_front(&from, &to);
        let share = area(&seeing) / area(&from);
        let [coarse, fine] = [24, 48].map(|n| share * mean_form_factor(&seeing, &to, n));
        let exact = exact(case);
        // The rule's own error, seen from its refinement, and the digits that cancellation costs to far polygons.
        let allowed = 4.0 * (fine - coarse).abs() + 1e-9 * exact + 1e-14;
        let apart = (fine - exact).abs();
        assert!(apart <= allowed, "{}: {fine} {exact} {coarse}", case["id"]);
        // Where the polygons share an edge the rule converges slowly.
        assert!(apart <= 1e-3 * exact + 1e-14, "{}: {fine} {exact}", case["id"]);
        counted += 1;
    }
    assert!(counted > 20, "{counted}");
}

#[test]
fn points_and_polygons_known_exactly() {
    let cases = cases();
    let points: Vec<&Value> = cases.iter().filter(|c| c["group"] == "point").collect();
    assert_eq!(points.len(), 4);
    for case in points {
        let (x, n) = (vector(&case["point"]), vector(&case["normal"]));
        let to: Vec<DVec3> = polygon(&case["surf2"]).iter().map(|p| *p - x).collect();
        let fan = (1..to.len() - 1).map(|k| [to[0], to[k], to[k + 1]]);
        let found: f64 = fan.map(|t| point_to_polygon(n.normalize(), &t)).sum();
        let exact = exact(case);
        assert!((found / exact - 1.0).abs() < 1e-13, "{}: {found} {exact}", case["id"]);
    }
}
