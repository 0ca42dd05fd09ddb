//! Form factors between bodies of many faces: a box in a room is known in closed form for every tau.
//!
//! With a convex body in a convex room, `q = A_body / A_room`: every ray from the body meets the room, so by
//! reciprocity a share q of the room's rays meets the body; these cross its front and its back, and so
//! `F(room, room) = 1 - q + q tau²`, `F(room, body) = q`, `F(body, room) = 1`.

use glam::{DQuat, DVec3, EulerRot};
use halflight::form_factors::{Bodies, Sampler, Tolerance};
use halflight::rays::Rays;
use halflight::scene::Scene;
use halflight_study::{FactorSettings, FactorTable, How, factors};

use crate::common::{Facing, Mesh, Silent, builtin, grey};

/// A room of 24 and in it a turned box of 1.6 * 1.04: the objects 0 and 1, and q.
fn box_in_room() -> (Scene, f64) {
    let mut mesh = Mesh::default();
    let half = DVec3::new(0.4, 0.2, 0.3);
    let turn = DQuat::from_euler(EulerRot::XYZ, 0.3, 0.7, 0.2);
    mesh.cuboid(DVec3::ZERO, DVec3::ONE, DQuat::IDENTITY, Facing::In, 0);
    mesh.cuboid(DVec3::new(0.2, -0.1, -0.3), half, turn, Facing::Out, 1);
    let mut scene = mesh.scene(vec![grey("wall", 0.5), grey("box", 0.5)]);
    scene.objects = vec!["room".into(), "box".into()];
    for face in &mut scene.faces {
        face.object = face.material;
    }
    let area = 8.0 * (half.x * half.y + half.y * half.z + half.z * half.x);
    (scene, area / 24.0)
}

fn table(scene: &Scene, tau: f32, tolerance: f64) -> FactorTable {
    let tau = vec![tau; scene.materials.len()];
    factors(scene, &tau, &FactorSettings { tolerance, seed: 0 }, &Silent)
}

#[test]
fn a_box_in_a_room_for_every_tau() {
    let (scene, q) = box_in_room();
    for tau in [0.0, 0.3, 1.0_f32] {
        let table = table(&scene, tau, 1e-4);
        let t = f64::from(tau);
        let exact = [1.0 - q + q * t * t, q, 1.0, 0.0];
        for (f, exact) in table.factors.iter().zip(exact) {
            let apart = (f.share.value - exact).abs();
            let allowed = if tau == 1.0 { 1e-9 } else { 1e-4 * exact };
            let what = format!("tau {tau}, {} to {}: {f:?} {exact}", f.from, f.to);
            assert!(apart <= allowed && apart <= 4.0 * f.share.error + 1e-14, "{what}");
        }
        assert!(table.reciprocity.iter().all(|r| r.residual.abs() <= 1e-4));
        assert_eq!(table.factors[3].how, How::ClosedForm);
    }
}

#[test]
fn every_crossing_counts_where_light_passes() {
    // Three boxes around each other: rays from each reach the room, so the room's rays cross their fronts
    // 0.81 + 0.64 + 0.49 times on average.
    let mut mesh = Mesh::default();
    mesh.cuboid(DVec3::ZERO, DVec3::ONE, DQuat::IDENTITY, Facing::In, 0);
    for half in [0.9, 0.8, 0.7] {
        mesh.cuboid(DVec3::ZERO, DVec3::splat(half), DQuat::IDENTITY, Facing::Out, 1);
    }
    let mut scene = mesh.scene(vec![grey("wall", 0.5), grey("boxes", 0.5)]);
    scene.objects = vec!["room".into(), "boxes".into()];
    for face in &mut scene.faces {
        face.object = face.material;
    }
    let table = table(&scene, 1.0, 1e-4);
    for (f, exact) in table.factors.iter().zip([1.0, 1.94, 1.0, 0.0]) {
        assert!((f.share.value - exact).abs() < 1e-9, "{f:?} {exact}");
    }
}

#[test]
fn rays_agree_with_the_exact_way() {
    let (scene, q) = box_in_room();
    let rays = Rays::new(&scene);
    for tau in [0.0, 0.3_f32] {
        let taus = [tau, tau];
        let sampler = Sampler { scene: &scene, rays: &rays, tau: &taus, most: 1 << 18, seed: 5 };
        let tolerance = Tolerance { relative: 1e-3, absolute: 1e-6 };
        let row = sampler.row(0, &[true, true], &tolerance);
        let exact = [1.0 - q + q * f64::from(tau * tau), q];
        for (e, exact) in row.iter().zip(exact) {
            // Corners are rounded to single precision.
            let apart = (e.value - exact).abs();
            assert!(apart <= 4.0 * e.error + 1e-6, "{e:?} {exact}");
            // No worse than as many independent rays, but for the error of a standard error of 16 scramblings.
            let independent = (exact / f64::from(1 << 18)).sqrt();
            assert!(e.error < 1.7 * independent, "{e:?} {independent}");
        }
        // A tolerance that needs fewer rays is met.
        let loose = Tolerance { relative: 1e-2, absolute: 1e-5 };
        let few = sampler.row(0, &[true, true], &loose);
        assert!(few.iter().all(|e| e.error <= loose.of(e.value)));
    }
}

#[test]
fn bodies_of_many_faces_are_left_to_rays() {
    let scene = builtin("concentric-spheres");
    let tolerance = Tolerance { relative: 1e-2, absolute: 1e-5 };
    assert!(Bodies::new(&scene, &vec![0.0; scene.materials.len()]).factor(0, 0, &tolerance, 1000).is_none());
    let table = table(&scene, 0.0, 1e-2);
    assert_eq!(table.unmet, 0);
    for row in &table.rows {
        assert!((row.sum.value - 1.0).abs() <= 4.0 * row.sum.error, "{row:?}");
    }
    for r in &table.reciprocity {
        assert!(r.residual.abs() <= 4.0 * r.error, "{r:?}");
    }
}

#[test]
fn the_same_bits_for_any_number_of_threads() {
    let (scene, _) = box_in_room();
    let found = [1, 3].map(|threads| {
        let pool = rayon_pool(threads);
        let values = |t: FactorTable| -> Vec<u64> {
            let bits = |v: f64| v.to_bits();
            let all = t.factors.iter();
            all.flat_map(|f| [bits(f.share.value), bits(f.share.error)]).collect()
        };
        pool.install(|| values(table(&scene, 0.0, 1e-3)))
    });
    assert_eq!(found[0], found[1]);
}

fn rayon_pool(threads: usize) -> rayon::ThreadPool {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
    builder.build().expect("a pool of threads")
}
