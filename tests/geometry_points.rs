//! Light as emitted where receivers lie in an emitter's plane, on its edge or corner, where the horizon cuts it, and
//! where it is so small that hemisphere rays miss it: against Howell's catalogue (B-3, B-4, C-14).

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};
use halflight::Solver;
use halflight::direct::Occlusion;
use halflight::form_factors::{Sampling, point_to_polygon};
use halflight::light::Rgb;
use halflight::render::Discretization;
use halflight::scene::Material;

use crate::common::{Facing, Mesh, all_of_f, grey, lights_behind, mean_and_error, sampling};

fn p(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// Form factor from a point with normal z to a wall in the plane x = c that faces it, y in 0..=b, z in low..=high.
fn wall(c: f64, b: f64, (low, high): (f64, f64)) -> f64 {
    let corners = [p(c, 0., low), p(c, 0., high), p(c, b, high), p(c, b, low)];
    let [q, r, s, t] = corners;
    point_to_polygon(DVec3::Z, &[q, r, s]) + point_to_polygon(DVec3::Z, &[q, s, t])
}

/// Howell's B-4: the wall stands on the receiver's plane, from the point's foot on it along b, height a.
fn b4(c: f64, b: f64, a: f64) -> f64 {
    let (x, y) = (a / b, c / b);
    let s = x.hypot(y);
    (1.0_f64.atan2(y) - y / s * 1.0_f64.atan2(s)) / TAU
}

#[test]
fn closer_and_closer_to_an_edge() {
    // Towards the corner of the wall's foot the form factor tends to 1/4: half of the quarter sphere's projection.
    for exponent in 0..16 {
        let c = 10.0_f64.powi(-exponent);
        let (found, exact) = (wall(c, 2.0, (0.0, 1.0)), b4(c, 2.0, 1.0));
        assert!((found - exact).abs() < 1e-14, "{c}: {found} {exact}");
    }
    assert!((wall(1e-15, 2.0, (0.0, 1.0)) - 0.25).abs() < 1e-14);
}

#[test]
fn in_the_plane_on_the_edge_and_on_the_corner() {
    let square = [p(0., 0., 0.), p(1., 0., 0.), p(1., 1., 0.), p(0., 1., 0.)];
    // A point of the emitter's plane sees it edge on, wherever it lies and whatever way it looks.
    for x in [p(2., 3., 0.), p(0.5, 0., 0.), p(0., 0., 0.), p(1., 1., 0.), p(0.5, 0.5, 0.)] {
        for n in [DVec3::Z, DVec3::NEG_Z, DVec3::X, DVec3::NEG_Y] {
            for triangle in [[0, 1, 2], [0, 2, 3]] {
                let corners = triangle.map(|k| square[k] - x);
                assert_eq!(point_to_polygon(n, &corners), 0.0, "{x} {n}");
            }
        }
    }
}

#[test]
fn the_horizon_cuts_the_polygon() {
    for (low, c) in [(-1.0, 0.5), (-1e-9, 0.1), (-1e6, 2.0)] {
        let (found, exact) = (wall(c, 2.0, (low, 1.0)), b4(c, 2.0, 1.0));
        // Cutting an edge of length |low| leaves the rounding of that length.
        let rounding = 1e-14 + 1e-16 * low.abs();
        assert!((found - exact).abs() < rounding, "{low}: {found} {exact}");
    }
    assert_eq!(wall(0.5, 2.0, (-2.0, -1.0)), 0.0);
    assert_eq!(wall(0.5, 2.0, (-2.0, 0.0)), 0.0);
}

fn lamp() -> Material {
    Material::new("lamp", Rgb::ZERO, Rgb::ONE)
}

/// Mean form factor from the patches of material 0 to the luminaire, of which there is one; and its standard error.
fn emitted(p: &Discretization, occlusion: &Occlusion, only: impl Fn(usize) -> bool) -> (f64, f64) {
    assert_eq!(p.luminaires.list.len(), 1);
    let materials = p.patches.materials();
    let receives: Vec<bool> = (0..p.patches.len()).map(|i| materials[i] == 0 && only(i)).collect();
    let one = |seed: u32| {
        let sampling = Sampling { emitter_rays: 256, ..sampling(1, seed) };
        let lights = lights_behind(p, occlusion);
        let (light, _) = lights.receive_emitted(&receives, &sampling, &|_| ());
        let (mut sum, mut area) = (0.0, 0.0);
        for i in (0..light.len()).filter(|&i| receives[i]) {
            let a = p.patches.areas()[i];
            sum += a * f64::from(light[i].x);
            area += a;
        }
        sum / area
    };
    mean_and_error(&(0..8).map(one).collect::<Vec<f64>>())
}

#[test]
fn a_luminaire_that_stands_on_its_receiver() {
    let mut mesh = Mesh::default();
    mesh.polygon(&[p(0., 0., 0.), p(10., 0., 0.), p(10., 1., 0.), p(0., 1., 0.)], 0);
    mesh.polygon(&[p(0., 0., 0.), p(0., 1., 0.), p(0., 1., 0.1), p(0., 0., 0.1)], 1);
    let p = Solver::new(&mesh.scene(vec![grey("floor", 0.5), lamp()])).cut(300);
    // C-14 with width 10, height 0.1, length 1.
    let truth = 0.004_393_873_007_071_555;
    let (mean, error) = emitted(&p, &Occlusion::Opaque, |_| true);
    assert!((mean - truth).abs() <= 4.0 * error + 1e-6 * truth, "{mean} +- {error}");
    assert!(error < 5e-3 * truth, "{error}");
}

/// A closed room of half extent 1 and in its middle a lamp that faces down, its side a share of the room's.
fn tiny_lamp(share: f64) -> Discretization {
    let mut mesh = Mesh::default();
    mesh.cuboid(DVec3::ZERO, DVec3::ONE, DQuat::IDENTITY, Facing::In, 0);
    mesh.polygon(&[p(-share, -share, 0.), p(-share, share, 0.), p(share, share, 0.), p(share, -share, 0.)], 1);
    Solver::new(&mesh.scene(vec![grey("wall", 0.5), lamp()])).cut(400)
}

#[test]
fn an_emitter_of_a_ten_thousandth_of_the_scene() {
    let share = 1e-4;
    let p = tiny_lamp(share);
    // B-3, four times: from the lamp's middle to the floor at distance 1, half width 1. The lamp's own size changes it
    // by its square.
    let root = 2.0_f64.sqrt();
    let corner = 2.0 / root * (1.0 / root).atan() / TAU;
    let truth = 4.0 * corner * share * share;
    let floor = |i: usize| p.patches.point(i, 0.5, 0.5).normal.z > 0.5;
    let (mean, error) = emitted(&p, &Occlusion::Opaque, floor);
    assert!((mean - truth).abs() <= 4.0 * error + 1e-6 * truth, "{mean} +- {error}, exactly {truth}");
    assert!(error < 2e-3 * truth, "{error} {truth}");
    // Where nothing occludes the closed form needs no ray.
    let (open, spread) = emitted(&p, &Occlusion::Nothing, floor);
    assert!((open - truth).abs() <= 4.0 * spread + 1e-6 * truth, "{open} +- {spread}");
    // Hemisphere rays: of 100,000 one in 10^9 would have to meet the lamp.
    let rows = all_of_f(&p, 0.0, &sampling(256, 0)).rows;
    let materials = p.patches.materials();
    let met = (0..p.patches.len()).flat_map(|i| rows.row(i).0.iter().copied());
    assert!(met.filter(|&j| materials[j as usize] == 1).count() == 0);
}
