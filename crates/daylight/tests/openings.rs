//! Direct parts through openings against closed forms: those of CIE 171:2006, 5.9 to 5.12, for openings without glass.
//!
//! Under a uniform sky the sky component is the form factor of the opening, in closed form; under the overcast sky it
//! is an integral over the opening that is done here by another way, over areas instead of directions.

use std::f64::consts::PI;

use glam::{DQuat, DVec3};
use halflight_daylight::{Compass, DIAMETER, Division, Skies, Standard, direction};

use crate::rooms::{daylight, lambert, rectangle, room, scene, seen_by, sensor, v};

/// The error of S that its quadrature is to keep to, a share of pi.
const QUADRATURE: f64 = 2e-6;

#[test]
fn an_open_plane_sees_all_of_the_sky_and_a_wall_half_of_it() {
    let ground = scene(&[(rectangle(v(-1.0, -1.0, 0.0), v(2.0, 0.0, 0.0), v(0.0, 2.0, 0.0)), 0.5)]);
    for mf in [1, 2, 4] {
        let normals = [DVec3::Z, DVec3::X, v(0.6, 0.0, 0.8)];
        let sensors = normals.map(|normal| sensor(v(0.0, 0.0, 50.0), normal));
        let found = daylight(&ground, &sensors, mf, (Some(0), 0.02, 0));
        let sky = |x: usize| (1..found.columns()).map(|p| found.of(x, p)[0]).sum::<f64>();
        // A plane that is tilted by t sees (1 + cos t) / 2 of a uniform sky.
        for (x, share) in [(0, 1.0), (1, 0.5), (2, 0.9)] {
            assert!((sky(x) / PI - share).abs() < QUADRATURE, "MF:{mf}, {x}: {}", sky(x) / PI);
        }
        let patches = Division::new(mf).expect("a division").patches();
        for (p, patch) in patches.iter().enumerate().skip(1) {
            // A horizontal plane: the closed form of each patch, by the ends of its row.
            let row = (0..found.division.rows()).rfind(|&row| found.division.altitude(row) <= patch.altitude);
            let row = row.expect("a row");
            let (low, high) = (found.division.altitude(row), found.division.altitude(row + 1));
            let exact = PI / found.division.in_row(row) as f64 * (high.sin().powi(2) - low.sin().powi(2));
            assert!((found.of(0, p)[0] - exact).abs() < QUADRATURE * PI, "MF:{mf}, {p}");
        }
    }
}

#[test]
fn the_sky_component_of_openings_is_their_form_factor() {
    let normals = [DVec3::Z, DVec3::X, DVec3::Y, v(0.3, -0.5, 0.4).normalize()];
    for in_roof in [true, false] {
        let own = room(0.0, in_roof, DQuat::IDENTITY);
        let hole = if in_roof {
            [v(1.0, 1.0, 2.5), v(3.0, 1.0, 2.5), v(3.0, 2.0, 2.5), v(1.0, 2.0, 2.5)]
        } else {
            [v(1.0, 0.0, 1.0), v(3.0, 0.0, 1.0), v(3.0, 0.0, 2.0), v(1.0, 0.0, 2.0)]
        };
        let sensors: Vec<_> = [v(2.0, 1.5, 0.0), v(0.7, 2.4, 0.8), v(3.6, 0.4, 1.7)]
            .into_iter()
            .flat_map(|x| normals.map(|n| sensor(x, n)))
            .filter(|own| hole.iter().all(|corner| (*corner - own.position).dot(own.normal) > 0.0))
            .collect();
        assert!(sensors.len() > 3);
        let found = daylight(&own, &sensors, 1, (Some(0), 0.02, 0));
        for (x, own) in sensors.iter().enumerate() {
            let all: f64 = (0..found.columns()).map(|p| found.of(x, p)[0]).sum();
            let exact = lambert(own.position, own.normal, &hole);
            let stated: f64 = found.direct_error[x * found.columns()..][..found.columns()].iter().sum();
            // Points are lifted off surfaces by 4e-6 of the half extent, which changes form factors by as much.
            assert!((all / PI - exact).abs() < QUADRATURE + 2e-5 * exact, "{in_roof} {own:?}: {} {exact}", all / PI);
            assert!(stated < QUADRATURE * PI * 10.0, "{stated}");
        }
    }
}

/// The integral of the overcast sky over an opening, by points of its area: L cos cos / d².
fn overcast(x: DVec3, n: DVec3, corner: DVec3, a: DVec3, b: DVec3) -> f64 {
    let normal = a.cross(b);
    let steps = 200;
    let mut sum = 0.0;
    for i in 0..steps {
        for j in 0..steps {
            let (s, t) = ((f64::from(i) + 0.5) / f64::from(steps), (f64::from(j) + 0.5) / f64::from(steps));
            let to = corner + s * a + t * b - x;
            let towards = to.normalize();
            let sky = if towards.z > 0.0 { Standard::Overcast.relative(towards) } else { 0.0 };
            sum += sky * towards.dot(n).max(0.0) * towards.dot(normal).abs() / to.length_squared();
        }
    }
    sum / f64::from(steps * steps)
}

/// Luminance that is constant over patches changes what comes through a window by less, the finer they are: at MF:8
/// patches are 1.6° wide, and the luminance of the overcast sky changes by at most 2 cos(alt) / (1 + 2 sin alt) a
/// radian, 5.5 % from row to row, half of it from the middle of a patch to its ends, with both signs over a window.
#[test]
fn the_sky_component_under_the_overcast_sky_is_the_integral_over_the_opening() {
    let own = room(0.0, false, DQuat::IDENTITY);
    let sensors = [v(2.0, 0.8, 0.8), v(2.0, 2.5, 0.8), v(0.5, 1.5, 0.8)].map(|x| sensor(x, DVec3::Z));
    let found = daylight(&own, &sensors, 8, (Some(0), 0.02, 0));
    let skies = Skies::standard(Standard::Overcast, found.division, 7.0 / 9.0 * PI, 0.0);
    for (x, own) in sensors.iter().enumerate() {
        let luminance = &skies.skies[0].luminance;
        let ours: f64 = (1..found.columns()).map(|p| found.of(x, p)[0] * luminance[p]).sum();
        let exact = overcast(own.position, own.normal, v(1.0, 0.0, 1.0), v(2.0, 0.0, 0.0), v(0.0, 0.0, 1.0));
        assert!((ours / exact - 1.0).abs() < 3e-3, "{ours} {exact}");
    }
}

/// An external obstruction of the opening, CIE 171's 5.13 in its simplest form: a wall that hides the sky up to an
/// altitude over all azimuths it covers.
#[test]
fn what_stands_before_the_sky_hides_it_to_its_edge() {
    // Seen from the origin a wall 100 m wide and 1 m high, 1 m away, hides all azimuths near north up to 45°.
    let wall = scene(&[(rectangle(v(-50.0, 1.0, -1.0), v(0.0, 0.0, 2.0), v(100.0, 0.0, 0.0)), 0.0)]);
    let found = daylight(&wall, &[sensor(v(0.0, 0.0, 0.0), DVec3::Z)], 1, (Some(0), 0.02, 0));
    let all: f64 = (1..found.columns()).map(|p| found.of(0, p)[0]).sum();
    // The point is lifted by 5e-6 of the half extent, 50 m.
    let hidden = lambert(
        v(0.0, 0.0, 2.5e-4),
        DVec3::Z,
        &[v(-50.0, 1.0, 2.5e-4), v(50.0, 1.0, 2.5e-4), v(50.0, 1.0, 1.0), v(-50.0, 1.0, 1.0)],
    );
    assert!((all / PI - 1.0 + hidden).abs() < 2.0 * QUADRATURE, "{} {hidden}", all / PI);
}

#[test]
fn a_pane_passes_its_share_and_a_stack_of_them_the_product() {
    let pane = |z: f64| (rectangle(v(-50.0, -50.0, z), v(100.0, 0.0, 0.0), v(0.0, 100.0, 0.0)), 0.0);
    let mut own =
        scene(&[pane(1.0), pane(2.0), (rectangle(v(-1.0, -1.0, 0.0), v(2.0, 0.0, 0.0), v(0.0, 2.0, 0.0)), 0.0)]);
    (own.materials[0].tau, own.materials[1].tau) = (Some(0.5), Some(0.25));
    let found = daylight(&own, &[sensor(v(0.0, 0.0, 0.5), DVec3::Z)], 1, (Some(0), 0.02, 0));
    let zenith = found.columns() - 1;
    let exact = 0.125 * PI * (6.0_f64.to_radians()).sin().powi(2);
    assert!((found.of(0, zenith)[0] - exact).abs() < QUADRATURE * PI, "{} {exact}", found.of(0, zenith)[0]);
}

#[test]
fn a_sun_shines_by_the_part_of_its_disc_that_is_seen() {
    let compass = Compass::new(DVec3::Z, DVec3::Y).expect("a compass");
    let at = direction(40.0_f64.to_radians(), 30.0_f64.to_radians());
    // A half plane whose edge passes the disc's middle at a distance of `off` radii.
    let (across, above) = (DVec3::Z.cross(at).normalize(), at.cross(DVec3::Z.cross(at).normalize()));
    let radius = (0.5 * DIAMETER).tan();
    for off in [-2.0, -0.5, 0.0, 0.3, 2.0] {
        let edge = 10.0 * at + 10.0 * off * radius * above;
        let own = scene(&[(rectangle(edge - 5.0 * across, 10.0 * across, 8.0 * above), 0.0)]);
        let sensors = [DVec3::Z, at, -at].map(|normal| sensor(DVec3::ZERO, normal));
        let found = seen_by(&own, &sensors, &[at], 1, (Some(0), 0.02, 0), compass);
        // The share of a circle below a chord.
        let open = f64::clamp(off, -1.0, 1.0);
        let seen = 1.0 - (open.acos() - open * (1.0 - open * open).sqrt()) / PI;
        for (x, cosine) in [(0, at.z), (1, 1.0), (2, 0.0)] {
            let [own, error] = found.suns[x];
            // Over a disc of this size cosines differ by 5e-3, and with the disc cut its middle moves by half of that.
            assert!((own - cosine * seen).abs() <= 4e-3 * seen, "{off} {x}: {own} {}", cosine * seen);
            assert!(error < 1e-4, "{error}");
            if x == 1 {
                assert!((own - seen).abs() < 3e-5, "{off}: {own} {seen}");
            }
        }
    }
}

#[test]
fn a_scene_that_is_turned_has_turned_columns() {
    let turn = DQuat::from_rotation_z(-72.0_f64.to_radians());
    let (own, other) = (room(0.5, false, DQuat::IDENTITY), room(0.5, false, turn));
    let place = v(2.0, 1.0, 0.8);
    let found = daylight(&own, &[sensor(place, DVec3::Z)], 1, (None, 0.05, 0));
    let turned = daylight(&other, &[sensor(turn * place, DVec3::Z)], 1, (None, 0.05, 1));
    let (mut apart, mut stated) = (0.0, 0.0);
    for row in 0..found.division.rows() {
        let (first, many) = (found.division.first(row), found.division.in_row(row));
        // 72° are a fifth of the circle: only rows of a multiple of 5 patches turn into themselves.
        if many % 5 != 0 {
            continue;
        }
        for j in 0..many {
            let (a, b) = (first + j, first + (j + many / 5) % many);
            let direct = [found.direct[a], turned.direct[b]];
            assert!((direct[0] - direct[1]).abs() < 2.0 * QUADRATURE * PI, "{row} {j}: {direct:?}");
            apart += (found.of(0, a)[0] - turned.of(0, b)[0]).powi(2);
            stated += found.error_of(0, a)[0].powi(2) + turned.error_of(0, b)[0].powi(2);
        }
    }
    assert!(apart.sqrt() < 2.0 * stated.sqrt(), "{} {}", apart.sqrt(), stated.sqrt());
}
