//! Form factors between objects against the exact cases of `tests/data/factors`: every one, as a scene of its own.
//!
//! Run with `--nocapture` to see the table.

use std::time::Instant;

use glam::DVec3;
use halflight::form_factors::{Estimate, point_to_polygon};
use halflight::scene::Scene;
use halflight_study::{FactorSettings, FactorTable, How, factors};
use serde_json::Value;

use crate::common::Silent;
use crate::common::rows::objects;

const TOLERANCE: f64 = 1e-4;

fn cases(kind: &str) -> Vec<Value> {
    let text = include_str!("../../../tests/data/factors/factors.json");
    let all: Value = serde_json::from_str(text).expect("JSON");
    let cases = all["cases"].as_array().expect("a list").iter();
    cases.filter(|c| c["kind"] == kind).cloned().collect()
}

fn points(polygon: &Value) -> Vec<DVec3> {
    let number = |v: &Value| v.as_f64().expect("a number");
    let point = |p: &Value| DVec3::new(number(&p[0]), number(&p[1]), number(&p[2]));
    polygon.as_array().expect("a list").iter().map(point).collect()
}

/// The polygons of a case as the objects 1, 2 and the occluders.
fn scene(case: &Value) -> Scene {
    let occluders = case["occluders"].as_array().expect("a list").iter();
    let all = [&case["surf1"], &case["surf2"]].into_iter().chain(occluders);
    objects(&all.map(points).collect::<Vec<_>>())
}

fn table(scene: &Scene, tolerance: f64) -> FactorTable {
    let tau = vec![0.0; scene.materials.len()];
    let settings = FactorSettings { tolerance, seed: 0 };
    factors(scene, &tau, &settings, &Silent)
}

fn number(case: &Value, field: &str) -> f64 {
    let value = &case[field];
    let text = value.as_str().map(|t| t.parse().expect("a number"));
    text.or(value.as_f64()).expect("a number")
}

#[test]
fn every_case_within_its_error_and_the_tolerance() {
    let mut wrong = Vec::new();
    println!("| case | truth | found | error | predicted | method | ms |\n|---|---|---|---|---|---|---|");
    for case in cases("polygon_pair") {
        let scene = scene(&case);
        let start = Instant::now();
        let table = table(&scene, TOLERANCE);
        let time = 1e3 * start.elapsed().as_secs_f64();
        let n = table.rows.len();
        let found = table.factors[1];
        let (id, truth) = (case["id"].as_str().expect("a name"), number(&case, "F12"));
        let (value, predicted) = (found.share.value, found.share.error);
        let error = (value - truth).abs();
        let how = found.how.name();
        println!("| {id} | {truth:.10e} | {value:.10e} | {error:.1e} | {predicted:.1e} | {how} | {time:.1} |");
        // The last digits of the truth, and of a number in the file.
        let known = number(&case, "abs_tol") + f64::EPSILON * truth;
        let allowed = match table.rows.len() {
            2 => 1e-6 * truth,
            _ => (TOLERANCE * truth).max(1e-3 * TOLERANCE),
        };
        if error > 4.0 * predicted + known || error > allowed + known {
            wrong.push(format!("{id}: {value} for {truth}"));
        }
        if n == 2 && found.how != How::ClosedForm {
            wrong.push(format!("{id}: by {how}"));
        }
        let share = |f: &halflight_study::Factor| (0.0..=1.0).contains(&f.share.value);
        if !table.factors.iter().all(share) || table.unmet > 0 {
            wrong.push(format!("{id}: a form factor outside 0..=1, or {} unmet", table.unmet));
        }
        for r in &table.reciprocity {
            if r.residual.abs() > 4.0 * r.error + 1e-12 {
                wrong.push(format!("{id}: reciprocity {r:?}"));
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn points_to_polygons() {
    for case in cases("point_polygon") {
        let polygon = points(&case["surf2"]);
        let x = points(&Value::Array(vec![case["point"].clone()]))[0];
        let n = points(&Value::Array(vec![case["normal"].clone()]))[0].normalize();
        let fan = (1..polygon.len() - 1).map(|k| [0, k, k + 1].map(|i| polygon[i] - x));
        let found: f64 = fan.map(|t| point_to_polygon(n, &t)).sum();
        let truth = number(&case, "F12");
        assert!((found - truth).abs() < 1e-12, "{}: {found} {truth}", case["id"]);
    }
}

/// Two squares of side 1 that see each other through a slit of 2/1000 between sheets of 22: only a narrow band of the
/// sender lies where light through it begins and ends.
///
/// The number is a double integral over x and x' of the closed form in y and y', by mpmath 1.3 (`quad`, 25 digits,
/// intervals that end where the slit's edges meet the receiver's).
#[test]
fn squares_beside_a_slit() {
    let square = |x: [f64; 2], y: [f64; 2], z: f64| {
        let p = |x: f64, y: f64| DVec3::new(x, y, z);
        vec![p(x[0], y[0]), p(x[1], y[0]), p(x[1], y[1]), p(x[0], y[1])]
    };
    let mut high = square([-0.758, 0.242], [-0.591, 0.409], 0.5);
    high.reverse();
    let polygons = [
        square([-1.414, -0.414], [0.089, 1.089], 0.0),
        high,
        square([-11.0, -0.668], [-11.0, 11.0], 0.033),
        square([-0.666, 11.0], [-11.0, 11.0], 0.033),
    ];
    let truth = 3.648_184_194_484_348_6e-4;
    for tolerance in [1e-3, TOLERANCE, 1e-6] {
        let table = table(&objects(&polygons), tolerance);
        // The two squares are the objects 0 and 1 of four, of the same area.
        for found in [&table.factors[1], &table.factors[4]] {
            let Estimate { value, error } = found.share;
            let off = (value - truth).abs();
            assert!(off <= 2.0 * error, "{tolerance}: {value} +- {error}");
            assert!(error <= (tolerance * truth).max(1e-3 * tolerance), "{error}");
        }
    }
}
