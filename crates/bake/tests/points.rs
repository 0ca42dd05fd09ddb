//! Maps against the irradiance that sensors measure at the middles of texels, and across borders of charts.

use glam::{DMat3, DVec3};
use halflight::render::Sensor;
use halflight::{Mode, Scene, Solver};
use halflight_bake::{BakeGoal, LaidOut, Model};

use crate::{folder, goal, name};

/// An L-shaped room lit by a panel in one of its arms.
const L_ROOM: [(&str, &str); 2] = [
    (
        "l.obj",
        "mtllib l.mtl\n\
         v 0 0 0\nv 4 0 0\nv 4 0 2\nv 2 0 2\nv 2 0 4\nv 0 0 4\nv 0 2.5 0\nv 4 2.5 0\nv 4 2.5 2\nv 2 2.5 2\nv 2 2.5 4\n\
         v 0 2.5 4\nv 3 2.49 .7\nv 3.6 2.49 .7\nv 3.6 2.49 1.3\nv 3 2.49 1.3\n\
         usemtl white\no floor\nf 1 4 3 2\nf 1 6 5 4\no ceiling\nf 7 8 9 10\nf 7 10 11 12\n\
         o walls\nf 1 2 8 7\nf 2 3 9 8\nf 3 4 10 9\nusemtl red\nf 4 5 11 10\nusemtl white\nf 5 6 12 11\nf 6 1 7 12\n\
         usemtl glow\no panel\nf 13 14 15 16\n",
    ),
    ("l.mtl", "newmtl white\nKd .7 .7 .7\nnewmtl red\nKd .6 .2 .1\nnewmtl glow\nKd 0 0 0\nKe 8 8 8\n"),
];

/// The RMS difference between a map and sensors at the middles of whole texels, one in `step`, relative to the RMS of
/// the map; and the errors that both state.
fn against_points(name: &str, goal: &BakeGoal, step: usize) -> (f64, f64) {
    let scene = Scene::open(name).expect("a scene");
    let model = Model::open(name, &scene).expect("parts");
    let solver = Solver::new(&scene).seed(goal.seed);
    let laid = LaidOut::new(&solver, model.parts(), goal).expect("charts");
    let middles = laid.middles(&scene);
    let found = laid.bake(solver, goal).expect("maps");
    let black = |k: usize| found.maps[0].irradiance.pixels[k] == glam::Vec3::ZERO;
    let whole = |k: &usize| found.coverage.of(*k) > 0.999 && !black(*k);
    let chosen: Vec<usize> = (0..middles.len()).filter(whole).step_by(step).collect();
    let sensor = |&k: &usize| {
        let (position, normal) = middles[k].expect("shown");
        Sensor { position, normal }
    };
    let sensors: Vec<Sensor> = chosen.iter().map(sensor).collect();
    let measured =
        Solver::new(&scene).seed(99).points(Mode::Global, &sensors).tolerance(goal.tolerance).expect("light");
    let (mut apart, mut errors) = (0.0, 0.0);
    for (&k, point) in chosen.iter().zip(&measured.points) {
        let own = found.maps[0].irradiance.pixels[k].as_dvec3();
        apart += own.distance_squared(DVec3::from(point.irradiance));
        errors += DVec3::from(point.error).length_squared();
    }
    let over = 3.0 * chosen.len() as f64 * found.maps[0].rms.powi(2);
    assert!(chosen.len() > 200, "{}", chosen.len());
    ((apart / over).sqrt(), found.maps[0].error.hypot((errors / over).sqrt()))
}

/// Squared errors add up; 1.25 is four standard errors of an RMS over 200 texels that are alike in groups of two.
#[test]
fn a_map_is_what_sensors_measure() {
    let (apart, stated) = against_points("cornell-box", &goal(96, 0.02), 11);
    assert!(apart < 1.25 * stated, "cornell-box: {apart} {stated}");
    let folder = folder(&L_ROOM);
    let (apart, stated) = against_points(&name(&folder, "l.obj"), &goal(96, 0.02), 11);
    assert!(apart < 1.25 * stated, "L: {apart} {stated}");
}

/// A box lit by a panel, whose floor is two rectangles that meet at x = 1 under it.
const HALVES: [(&str, &str); 2] = [
    (
        "l.obj",
        "mtllib l.mtl\nv 0 0 0\nv 1 0 0\nv 2 0 0\nv 2 0 1\nv 1 0 1\nv 0 0 1\nv 0 1 0\nv 2 1 0\nv 2 1 1\nv 0 1 1\n\
         v .5 .99 .3\nv .9 .99 .3\nv .9 .99 .7\nv .5 .99 .7\nusemtl white\no west\nf 1 6 5 2\no east\nf 2 5 4 3\n\
         o rest\nf 7 8 9 10\nf 1 3 8 7\nf 3 4 9 8\nf 4 6 10 9\nf 6 1 7 10\nusemtl glow\no panel\nf 11 12 13 14\n",
    ),
    L_ROOM[1],
];

/// The halves' charts lie apart in the map: texels beside the seam differ by their errors and by what light changes
/// from one to the next.
#[test]
fn texels_on_both_sides_of_a_seam_agree() {
    let folder = folder(&HALVES);
    let (name, goal) = (name(&folder, "l.obj"), goal(128, 0.02));
    let scene = Scene::open(&name).expect("a scene");
    let model = Model::open(&name, &scene).expect("parts");
    let solver = Solver::new(&scene).seed(goal.seed);
    let laid = LaidOut::new(&solver, model.parts(), &goal).expect("charts");
    let (middles, size) = (laid.middles(&scene), 1.0 / laid.layout.scale);
    let found = laid.bake(solver, &goal).expect("maps");
    let light = |k: usize| found.maps[0].irradiance.pixels[k].as_dvec3();
    let floor = |k: &usize| middles[*k].is_some_and(|(at, normal)| at.y < 1e-3 && normal.y > 0.9);
    let all: Vec<(usize, DVec3)> =
        (0..middles.len()).filter(floor).map(|k| (k, middles[k].expect("shown").0)).collect();
    let near =
        |side: f64| all.iter().filter(move |(_, at)| side * (at.x - 1.0) > 0.0 && (at.x - 1.0).abs() < 1.5 * size);
    let (mut squares, mut count) = (0.0, 0);
    for (j, at) in near(-1.0) {
        // Light as it goes on from the other side: a plane through the texels around.
        let around = all.iter().filter(|(_, p)| p.x > 1.0 && p.distance(*at) < 4.5 * size);
        let (mut matrix, mut sums, mut few) = (DMat3::ZERO, [DVec3::ZERO; 3], 0);
        for (k, p) in around {
            let row = DVec3::new(1.0, (p.x - at.x) / size, (p.z - at.z) / size);
            matrix += DMat3::from_cols(row * row.x, row * row.y, row * row.z);
            sums.iter_mut().zip(row.to_array()).for_each(|(sum, x)| *sum += x * light(*k));
            few += 1;
        }
        if few < 12 {
            continue;
        }
        let first = matrix.inverse().row(0);
        let expected = first.x * sums[0] + first.y * sums[1] + first.z * sums[2];
        squares += (light(*j) - expected).length_squared() / 3.0;
        count += 1;
    }
    let rms = (squares / f64::from(count)).sqrt();
    // A texel on one side and what those on the other say together, each with the map's error.
    let stated = 2.0_f64.sqrt() * found.maps[0].error * found.maps[0].rms;
    assert!(count > 20 && rms < stated, "{count} {rms} {stated}");
}
