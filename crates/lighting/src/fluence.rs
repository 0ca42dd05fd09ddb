//! Light that arrives at points from all around: scalar, cylindrical and semicylindrical irradiance.
//!
//! ```text
//! scalar          E_0  = integral over the sphere of L dw = 4 mean over directions n of E(n)        4 pi times mean L
//! cylindrical     E_z  = 1/pi integral of L sin t dw      = mean over level directions n of E(n)    t from up
//! semicylindrical E_sc = 1/pi integral of L sin t (1 + cos a) dw = E_z + (E(f) - E(-f)) / pi        a from f, level
//! ```
//!
//! with E(n) the irradiance of a plane that faces n, which sensors measure. Means over directions are those of
//! three sets, each turned at random by itself, so that their mean has no bias: the corners of an icosahedron and
//! of a dodecahedron, exact up to spherical harmonics of degree 9, and nine level directions, an odd number,
//! which is as good as twice as many. What one sensor's plane cuts a small lamp off by is the largest error: the
//! difference between the sets is stated for it, with the sensors' own errors.
//!
//! Sources: CIE S 017:2020 (17-21-054 and following); A. D. McLaren, *Optimal numerical integration on a sphere*, Math.
//! Comp. 17, 1963. Not handled: skin and retina's spectra.

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec3};
use halflight::rays::sobol::{Stream, hash};
use halflight::render::{Sensor, SensorLight};
use serde::Serialize;

/// Sets of directions.
const TURNS: usize = 3;
/// Level directions of a set.
const AROUND: usize = 9;
/// Weights of the corners of an icosahedron and of a dodecahedron.
const WEIGHTS: [f64; 2] = [5.0 / 168.0, 9.0 / 280.0];
/// Corners of both.
const CORNERS: [usize; 2] = [12, 20];
/// Sensors that one point takes.
const A_POINT: usize = 1 + 2 + TURNS * (CORNERS[0] + CORNERS[1] + AROUND);

/// Light from all around.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Fluence {
    /// Per channel, W/m².
    pub scalar: [f64; 3],
    /// Its standard error.
    pub scalar_error: [f64; 3],
    /// Per channel, W/m².
    pub cylindrical: [f64; 3],
    /// Its standard error.
    pub cylindrical_error: [f64; 3],
    /// Towards the level part of the point's normal, W/m²; none where it points up or down.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub semicylindrical: Option<[f64; 3]>,
    /// Its standard error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub semicylindrical_error: Option<[f64; 3]>,
}

/// Corners of an icosahedron, then of a dodecahedron, in one position of both.
fn corners() -> Vec<DVec3> {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let turned = |a: f64, b: f64| [DVec3::new(0.0, a, b), DVec3::new(a, b, 0.0), DVec3::new(b, 0.0, a)];
    let signs = |a: f64, b: f64| [(a, b), (a, -b), (-a, b), (-a, -b)].into_iter().flat_map(move |(a, b)| turned(a, b));
    let cube = (0..8).map(|k| DVec3::from([0, 1, 2].map(|bit| if (k >> bit) & 1 == 0 { 1.0 } else { -1.0 })));
    let all = signs(1.0, golden).chain(cube).chain(signs(golden, 1.0 / golden));
    all.map(DVec3::normalize).collect()
}

/// A turn that is as likely as any other.
fn turn(random: &mut Stream) -> DQuat {
    let [u, v, w] = [(); 3].map(|()| f64::from(random.uniform()));
    let (a, b) = ((1.0 - u).sqrt(), u.sqrt());
    DQuat::from_xyzw(a * (TAU * v).sin(), a * (TAU * v).cos(), b * (TAU * w).sin(), b * (TAU * w).cos())
}

/// The level part of a direction; some level direction where it has none, and whether it has.
fn level(normal: DVec3, up: DVec3) -> (DVec3, bool) {
    let own = normal.normalize_or_zero();
    let flat = own - own.dot(up) * up;
    if flat.length() > 1e-6 { (flat.normalize(), true) } else { (up.any_orthonormal_vector(), false) }
}

/// The sensors of points, 126 for each, its own first. `up` is a unit vector.
pub fn all_around(points: &[Sensor], up: DVec3, seed: u32) -> Vec<Sensor> {
    let corners = corners();
    let of = |(k, point): (usize, &Sensor)| {
        let mut random = Stream::new(hash(k as u32, seed ^ 0x666c_7565));
        let (facing, _) = level(point.normal, up);
        let mut normals = vec![point.normal, facing, -facing];
        for _ in 0..TURNS {
            let turn = turn(&mut random);
            normals.extend(corners.iter().map(|corner| turn * *corner));
            let first = f64::from(random.uniform());
            let around = |j: usize| DQuat::from_axis_angle(up, TAU * (j as f64 + first) / AROUND as f64) * facing;
            normals.extend((0..AROUND).map(around));
        }
        normals.into_iter().map(|normal| Sensor { position: point.position, normal }).collect::<Vec<_>>()
    };
    points.iter().enumerate().flat_map(of).collect()
}

/// What the sensors of one point found: the light of its own, and that from all around.
///
/// If there are not 126, as many as [`all_around`] has for a point.
pub fn of_point(point: &Sensor, up: DVec3, found: &[SensorLight]) -> (SensorLight, Fluence) {
    assert_eq!(found.len(), A_POINT);
    let a_set = CORNERS[0] + CORNERS[1] + AROUND;
    let sets: Vec<_> = found[3..].chunks_exact(a_set).collect();
    let scalar = |set: &[SensorLight], c: usize| {
        let (ico, rest) = set.split_at(CORNERS[0]);
        let sum = |some: &[SensorLight]| some.iter().map(|own| own.irradiance[c]).sum::<f64>();
        4.0 * (WEIGHTS[0] * sum(ico) + WEIGHTS[1] * sum(&rest[..CORNERS[1]]))
    };
    let around = |set: &[SensorLight], c: usize| {
        set[CORNERS[0] + CORNERS[1]..].iter().map(|own| own.irradiance[c]).sum::<f64>() / AROUND as f64
    };
    let own_error = |c: usize| {
        // Errors of sensors at one place go together: their relative RMS is that of the mean.
        let (wrong, all) = found
            .iter()
            .fold((0.0, 0.0), |(wrong, all), own| (wrong + own.error[c].powi(2), all + own.irradiance[c].powi(2)));
        if all > 0.0 { f64::sqrt(wrong / all) } else { 0.0 }
    };
    let both = |of: &dyn Fn(&[SensorLight], usize) -> f64| {
        let each = |c: usize| {
            let values: Vec<f64> = sets.iter().map(|set| of(set, c)).collect();
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            let spread = values.iter().map(|own| (own - mean).powi(2)).sum::<f64>() / (count - 1.0) / count;
            (mean, (spread + (own_error(c) * mean).powi(2)).sqrt())
        };
        let [r, g, b] = [0, 1, 2].map(each);
        ([r.0, g.0, b.0], [r.1, g.1, b.1])
    };
    let ((scalar, scalar_error), (cylindrical, cylindrical_error)) = (both(&scalar), both(&around));
    let net = |c: usize| (found[1].irradiance[c] - found[2].irradiance[c]) / PI;
    let net_error = |c: usize| found[1].error[c].hypot(found[2].error[c]) / PI;
    let faces = level(point.normal, up).1;
    let fluence = Fluence {
        scalar,
        scalar_error,
        cylindrical,
        cylindrical_error,
        semicylindrical: faces.then(|| [0, 1, 2].map(|c| cylindrical[c] + net(c))),
        semicylindrical_error: faces.then(|| [0, 1, 2].map(|c| cylindrical_error[c].hypot(net_error(c)))),
    };
    (found[0].clone(), fluence)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn found(sensors: &[Sensor], irradiance: impl Fn(DVec3) -> f64) -> Vec<SensorLight> {
        let of = |own: &Sensor| SensorLight {
            irradiance: [irradiance(own.normal.normalize()); 3],
            error: [0.0; 3],
            bounces: Vec::new(),
            luminaires: BTreeMap::new(),
            is_inside: false,
        };
        sensors.iter().map(of).collect()
    }

    #[test]
    fn within_an_even_light_all_are_known() {
        let point = Sensor { position: DVec3::ZERO, normal: DVec3::X };
        let sensors = all_around(&[point], DVec3::Y, 1);
        let (_, fluence) = of_point(&point, DVec3::Y, &found(&sensors, |_| PI));
        // L = 1: E = pi all around, 4 pi, integral of sin over the sphere over pi = pi, and no net flux.
        assert!((fluence.scalar[0] - 4.0 * PI).abs() < 1e-12 && fluence.scalar_error[0] < 1e-12);
        assert!((fluence.cylindrical[0] - PI).abs() < 1e-12);
        assert!((fluence.semicylindrical.expect("a facing")[0] - PI).abs() < 1e-12);
    }

    /// A lamp that sends 1 W/m² past a point from a direction s: E_0 = 1, E_z = sin t / pi and
    /// E_sc = sin t (1 + cos a) / pi.
    /// Over directions the RMS of true errors is at most 1.2 times what is stated.
    #[test]
    fn a_small_lamp_is_known_within_its_error() {
        let (mut apart, mut stated, mut most) = ([0.0; 3], [0.0; 3], 0.0_f64);
        for k in 0..400 {
            let mut random = Stream::new(k);
            let s = turn(&mut random) * DVec3::Z;
            let point = Sensor { position: DVec3::ZERO, normal: DVec3::new(1.0, 0.3, 0.0) };
            let sensors = all_around(&[point], DVec3::Y, k);
            let (_, own) = of_point(&point, DVec3::Y, &found(&sensors, |n| n.dot(s).max(0.0)));
            let sine = (1.0 - s.y * s.y).sqrt();
            let truth = [1.0, sine / PI, (sine + s.x) / PI];
            let semi = (own.semicylindrical.expect("a facing")[0], own.semicylindrical_error.expect("a facing")[0]);
            let all = [(own.scalar[0], own.scalar_error[0]), (own.cylindrical[0], own.cylindrical_error[0]), semi];
            for (j, (value, error)) in all.into_iter().enumerate() {
                apart[j] += (value - truth[j]).powi(2) / 400.0;
                stated[j] += error.powi(2) / 400.0;
            }
            most = most.max((own.scalar[0] - 1.0).abs());
        }
        for j in 0..3 {
            assert!(apart[j].sqrt() < 1.2 * stated[j].sqrt(), "{j}: {} {}", apart[j].sqrt(), stated[j].sqrt());
            assert!(apart[j].sqrt() < 0.01, "{j}: {}", apart[j].sqrt());
        }
        assert!(most < 0.04, "{most}");
    }

    #[test]
    fn the_rule_is_exact_for_low_harmonics() {
        let corners = corners();
        let mean = |f: &dyn Fn(DVec3) -> f64| {
            let sum = |some: &[DVec3]| some.iter().map(|n| f(*n)).sum::<f64>();
            WEIGHTS[0] * sum(&corners[..12]) + WEIGHTS[1] * sum(&corners[12..])
        };
        let axis = DVec3::new(0.3, 0.5, -0.7).normalize();
        for power in 0..=9 {
            let exact = if power % 2 == 0 { 1.0 / f64::from(power + 1) } else { 0.0 };
            assert!((mean(&|n| n.dot(axis).powi(power)) - exact).abs() < 1e-12, "{power}");
        }
    }
}
