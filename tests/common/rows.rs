//! Mean form factors between materials as the rows of K have them, and objects as OBJ text.

use glam::DVec3;
use halflight::Solver;
use halflight::scene::Scene;

use super::{all_of_f, mean_and_error, sampling};

/// Patches the scenes are cut into.
const PATCHES: usize = 200;

/// The mean form factor from material `from` to material `to` by hemisphere rays of tau 0, and its standard error.
pub fn by_rows(scene: &Scene, (from, to): (u32, u32), rays: u32) -> (f64, f64) {
    let p = Solver::new(&scene.clone()).cut(PATCHES);
    let one = |seed: u32| {
        let f = all_of_f(&p, 0.0, &sampling(rays, seed)).rows;
        let materials = p.patches.materials();
        let (mut sum, mut area) = (0.0, 0.0);
        for i in (0..p.patches.len()).filter(|&i| materials[i] == from) {
            let (columns, values) = f.row(i);
            let own = columns.iter().zip(values);
            let received = own.filter(|(j, _)| materials[**j as usize] == to);
            let a = p.patches.areas()[i];
            sum += a * received.map(|(_, v)| f64::from(*v)).sum::<f64>();
            area += a;
        }
        sum / area
    };
    let (mean, error) = mean_and_error(&(0..8).map(one).collect::<Vec<f64>>());
    // Where no ray differs the spread says nothing: then one ray in all of them.
    (mean, error.max(1.0 / (8.0 * f64::from(rays) * PATCHES as f64)))
}

/// Polygons as the objects of an OBJ, named 1, 2, ...
pub fn objects(polygons: &[Vec<DVec3>]) -> Scene {
    let mut obj = String::new();
    for (k, polygon) in polygons.iter().enumerate() {
        obj += &format!("o {}\n", k + 1);
        for p in polygon {
            obj += &format!("v {:?} {:?} {:?}\n", p.x, p.y, p.z);
        }
        let corners: Vec<String> = (1..=polygon.len()).map(|i| format!("-{i}")).rev().collect();
        obj += &format!("f {}\n", corners.join(" "));
    }
    Scene::from_obj_text("objects", &obj, "").expect("a correct scene")
}
