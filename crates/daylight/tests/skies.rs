//! Scenes lit by skies of patches, as the core's rays meet them, against closed forms and against D times radiances.
//!
//! Not tested here: pictures (`crates/study`), the command (`crates/cli`).

use std::f64::consts::{PI, TAU};

use glam::{DQuat, DVec3};
use halflight::light::{Mode, Rgb};
use halflight::render::{Sensor, SensorLight};
use halflight::scene::{Sky, SkyLight, SkyPatches};
use halflight::{Scene, Solver};
use halflight_daylight::{Compass, Division, Skies, Standard};

use crate::rooms::{daylight, rectangle, room, scene, sensor, v};

/// Of single precision, a share: rays that find an edge of a patch where it is not.
const ROUNDING: f64 = 1e-4;

fn measure(scene: &Scene, sensors: &[Sensor], seed: u32) -> Vec<SensorLight> {
    Solver::new(scene).seed(seed).points(Mode::Global, sensors).tolerance(0.01).expect("light").points
}

/// The scene under radiances that are the same in all channels.
fn under(scene: &Scene, radiances: &[f64], compass: Compass) -> Scene {
    let mut scene = scene.clone();
    let patches = SkyPatches::new(radiances.iter().map(|own| Rgb::splat(*own as f32)).collect()).expect("patches");
    scene.set_patched_sky(&patches, compass.up, compass.north);
    scene
}

fn ground() -> Scene {
    scene(&[(rectangle(v(-1.0, -1.0, 0.0), v(2.0, 0.0, 0.0), v(0.0, 2.0, 0.0)), 0.5)])
}

fn z_up() -> Compass {
    Compass::new(DVec3::Z, DVec3::Y).expect("a compass")
}

/// Integral of the cosine to the zenith over each column, by the ends of its row: closed form; that of the ground is 0.
fn cosines(division: Division) -> Vec<f64> {
    let row = |row: usize| {
        let (low, high) = (division.altitude(row), division.altitude(row + 1));
        vec![PI / division.in_row(row) as f64 * (high.sin().powi(2) - low.sin().powi(2)); division.in_row(row)]
    };
    std::iter::once(0.0).chain((0..division.rows()).flat_map(row)).collect()
}

fn assert_near(light: &SensorLight, expected: f64, what: &str) {
    let off = (light.irradiance[0] - expected).abs();
    assert!(off < 4.0 * light.error[0] + ROUNDING * expected, "{what}: {light:?}, not {expected}");
}

/// Every patch by its own radiance, in one sum that only the right order gives; MF:1 and MF:2.
#[test]
fn a_level_plane_has_the_sum_of_the_patches_cosines() {
    for mf in [1, 2] {
        let division = Division::new(mf).expect("a division");
        let cosines = cosines(division);
        let radiances: Vec<f64> = (0..division.columns()).map(|k| 1.0 + ((7 * k) % 11) as f64).collect();
        let expected: f64 = radiances.iter().zip(&cosines).map(|(l, cosine)| l * cosine).sum();
        let found = measure(&under(&ground(), &radiances, z_up()), &[sensor(v(0.0, 0.0, 1.0), DVec3::Z)], 0);
        assert_near(&found[0], expected, "a plane");
    }
}

/// CIE's overcast sky: 7/9 pi Lz in the limit of small patches (P. Moon, D. E. Spencer, 1942), and that of a vertical
/// plane over it (7 pi/9): 0.396, by the integral of the same luminance.
#[test]
fn an_overcast_sky_is_that_of_moon_and_spencer() {
    let division = Division::new(4).expect("a division");
    let outside = 7.0 / 9.0 * PI;
    let mut luminance = Skies::standard(Standard::Overcast, division, outside, 0.0).skies.remove(0).luminance;
    luminance[0] = 0.0;
    let scene = under(&ground(), &luminance, z_up());
    let found = measure(&scene, &[sensor(v(0.0, 0.0, 1.0), DVec3::Z), sensor(v(0.0, 0.0, 50.0), DVec3::X)], 1);
    let exact: f64 = luminance.iter().zip(cosines(division)).map(|(l, cosine)| l * cosine).sum();
    // The luminance of a patch is that at its middle: 1e-3 of MF:4.
    assert!((exact / outside - 1.0).abs() < 1e-3, "{exact}");
    assert_near(&found[0], exact, "level");
    // Lz/3 integral (1 + 2 sin a) cos² a da times 2 of azimuths = Lz/3 (pi/2 + 4/3).
    let wall = (PI / 2.0 + 4.0 / 3.0) / 3.0;
    let off = (found[1].irradiance[0] - wall).abs();
    assert!(off < 4.0 * found[1].error[0] + 2e-3 * wall, "{:?} {wall}", found[1]);
}

/// One bright patch lights a wall only from where it is: north, clockwise and up, wherever they point.
#[test]
fn one_patch_lights_what_faces_it() {
    let division = Division::new(1).expect("a division");
    let plane = ground();
    for compass in [z_up(), Compass::of_up(DVec3::Y).expect("a compass"), Compass::new(DVec3::Z, DVec3::NEG_X).unwrap()]
    {
        let Compass { east, north, up } = compass;
        let faces = [north, east, -north, -east, up, -up];
        let far = faces.map(|normal| sensor(50.0 * up + 3.0 * east, normal));
        for (azimuth, toward) in [(0.0, 0), (0.25, 1), (0.5, 2), (0.75, 3)] {
            // A patch of the second row, at 18°, of 12° by 12°.
            let mut radiances = vec![0.0; division.columns()];
            radiances[division.column(1, TAU * azimuth)] = 10.0;
            let found = measure(&under(&plane, &radiances, compass), &far, 2);
            let (low, high) = (division.altitude(1), division.altitude(2));
            let width = TAU / division.in_row(1) as f64;
            // cos of the altitude squared times the cosine of the azimuth.
            let of_altitude = 0.5 * (high - low) + 0.25 * ((2.0 * high).sin() - (2.0 * low).sin());
            // Not all azimuths are middles of patches of 30 a row; 90° lies half a patch off one.
            let middle = TAU * (division.column(1, TAU * azimuth) - division.first(1)) as f64 / 30.0 - TAU * azimuth;
            let across = (middle + 0.5 * width).sin() - (middle - 0.5 * width).sin();
            assert_near(&found[toward], 10.0 * of_altitude * across, "what faces it");
            let opposite = (toward + 2) % 4;
            // Below lies the ground, of a form factor of 5e-4, which reflects a little.
            assert!([opposite, 5].iter().all(|x| found[*x].irradiance[0] < 1e-3), "{found:?}");
            let up = 10.0 * cosines(division)[division.column(1, TAU * azimuth)];
            assert_near(&found[4], up, "above");
        }
    }
}

/// Points of a room with a window, and of a roof with a hole: the two ways agree within both errors, patch by patch all
/// different; and a sky of equal patches is that of two halves.
#[test]
fn points_of_a_room_are_coefficients_times_radiances() {
    let sensors = [v(2.0, 1.5, 0.5), v(0.7, 2.4, 0.8), v(3.2, 0.6, 1.2)].map(|x| sensor(x, DVec3::Z));
    let division = Division::new(1).expect("a division");
    let radiances: Vec<f64> = (0..division.columns()).map(|k| ((5 * k) % 13) as f64).collect();
    for in_roof in [false, true] {
        let room = room(0.5, in_roof, DQuat::IDENTITY);
        let found = daylight(&room, &sensors, 1, (None, 0.01, 0));
        let points = measure(&under(&room, &radiances, z_up()), &sensors, 3);
        let mut two = room.clone();
        two.set_sky(SkyLight { upper: Rgb::ONE, lower: Rgb::splat(0.25) }, DVec3::Z);
        let even: Vec<f64> = std::iter::once(0.25).chain(vec![1.0; division.columns() - 1]).collect();
        let [halves, even] = [two, under(&room, &even, z_up())].map(|scene| measure(&scene, &sensors, 4));
        for (x, light) in points.iter().enumerate() {
            let expected: f64 = radiances.iter().enumerate().map(|(p, l)| found.of(x, p)[0] * l).sum();
            let squares = radiances.iter().enumerate().map(|(p, l)| (found.error_of(x, p)[0] * l).powi(2));
            let both = (squares.sum::<f64>() + light.error[0].powi(2)).sqrt();
            assert!((light.irradiance[0] - expected).abs() < 4.0 * both, "{light:?}, not {expected} by D");
            let both = halves[x].error[0].hypot(even[x].error[0]);
            assert!((halves[x].irradiance[0] - even[x].irradiance[0]).abs() < 4.0 * both, "{:?}", halves[x]);
        }
    }
}

/// Faces that stand for cells leave nothing behind, and their power is what enters the sphere around the scene.
#[test]
fn skies_may_be_replaced_and_have_a_power() {
    let plain = ground();
    let mut scene = under(&plain, &vec![2.0; 578], z_up());
    let sky = scene.sky.clone().expect("a sky");
    assert_eq!((sky.cells(), scene.solid_faces()), (578, plain.faces.len() as u32));
    let area: f64 = (sky.first..sky.first + sky.cells()).map(|face| scene.emitting_area(face)).sum();
    assert!((area / (4.0 * PI * sky.radius.powi(2)) - 1.0).abs() < 1e-9);
    let powers = Solver::new(&scene).bounces(Mode::Global, 1).tolerance(0.05).solution.bounces;
    let metres = scene.frame.in_metres();
    assert!((powers[0].power[0] / (2.0 * PI * area * metres * metres) - 1.0).abs() < 1e-5, "{:?}", powers[0].power);
    // E of patches is known; of KE what arrives of half of the sphere: pi A rho L.
    assert!((powers[1].power[0] / (PI * 4.0 * 0.5 * 2.0) - 1.0).abs() < 0.05, "{:?}", powers[1].power);
    let light = SkyLight { upper: Rgb::ONE, lower: Rgb::ONE };
    scene.set_sky(light, DVec3::Z);
    let mut other = plain;
    other.set_sky(light, DVec3::Z);
    assert_eq!((&scene.vertices, &scene.faces, &scene.sky), (&other.vertices, &other.faces, &other.sky));
    assert_eq!((scene.materials.len(), scene.objects), (other.materials.len(), other.objects));
    assert!(SkyPatches::new(vec![Rgb::ONE; 145]).is_none() && Sky::level(DVec3::Z, DVec3::Z).is_none());
}
