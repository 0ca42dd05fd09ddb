//! Concentric spheres, where the spectral radius is known in closed form for every tau.
//!
//! Inner radius r facing out, outer R facing in, q = A_inner/A_outer: F12 = 1, F21 = q, F22 = 1 - q + q tau². With
//! uniform rho the radius of K is `rho alpha/2 (F22 + sqrt(F22² + 4 q))`. For the means over tessellated spheres this
//! holds with q the ratio of the polyhedra's areas: both are convex, so a line from outer to outer crosses the inner
//! twice or never. What is left is how uneven the polyhedra are, of second order in their dihedral angles, and noise.

use halflight::Solver;
use halflight::light::{Rgb, Transport};
use halflight::operator::spectrum;
use halflight::rays::Side;
use halflight::render::{Assembled, Discretization};
use halflight::solve::{Settings, Verdict, neumann, verdict};

use crate::common::{Facing, Mesh, Silent, assemble_one, grey, sampling, transport};

const RHO: f32 = 0.9;
const RAYS: u32 = 1024;

/// The outer sphere emits; both reflect RHO.
fn spheres() -> Discretization {
    let mut mesh = Mesh::default();
    mesh.sphere(1.0, 4, Facing::In, 0);
    mesh.sphere(0.6, 3, Facing::Out, 1);
    let mut outer = grey("outer", RHO);
    outer.emission = Rgb::ONE;
    Solver::new(&mesh.scene(vec![outer, grey("inner", RHO)])).cut(600)
}

/// Area of the patches of a material.
fn area(p: &Discretization, material: u32) -> f64 {
    let pairs = p.patches.materials().iter().zip(p.patches.areas());
    pairs.filter(|(m, _)| **m == material).map(|(_, a)| a).sum()
}

/// Spectral radius for `alpha rho = 1` as a function of F22 and q.
fn closed_form(q: f64, tau: f64) -> f64 {
    let f22 = 1.0 - q + q * tau * tau;
    0.5 * (f22 + (f22 * f22 + 4.0 * q).sqrt())
}

/// Allowed relative error of the radius: four standard errors of the mean of F21 and F22 over the outer patches, plus
/// the unevenness of an icosahedron cut `levels` times.
fn tolerance(p: &Discretization, q: f64) -> f64 {
    let outer = p.patches.materials().iter().filter(|&&m| m == 0).count() as f64;
    // A ray meets the inner sphere or not: variance q (1 - q) at most, whatever is stratified.
    let noise = (q * (1.0 - q) / (outer * f64::from(RAYS))).sqrt();
    // The unevenness of F over a patch is that of the distance to the centre, whose square enters the eigenvalue. The
    // outer patches, the larger, have a half diagonal d with d² about half the patch's area: distances differ by d²/2.
    let patch = area(p, 0) / outer;
    4.0 * 2.0 * noise + (0.25 * patch).powi(2)
}

/// alpha at which the radius is 1.
fn frontier(q: f64, tau: f32) -> f64 {
    1.0 / (f64::from(RHO) * closed_form(q, tau.into()))
}

/// K for each of the (alpha, tau), all from one cast of rays.
fn operators(p: &Discretization, modes: &[Transport]) -> Vec<Assembled> {
    p.assemble(modes, &sampling(RAYS, 1), &Silent).0
}

#[test]
fn the_bounds_enclose_the_radius_of_the_closed_form() {
    let p = spheres();
    let q = area(&p, 1) / area(&p, 0);
    let allowed = tolerance(&p, q);
    assert!(allowed < 0.01, "the test would prove little: {allowed}");
    let modes = [0.0, 0.5, 1.0].map(|tau| transport(1.0, tau));
    for found in operators(&p, &modes) {
        let tau = f64::from(found.transport.tau);
        let exact = f64::from(RHO) * closed_form(q, tau);
        let bounds = spectrum(&found.operator).worst();
        let shown = format!("tau {tau}: {bounds:?}, exactly {exact}");
        assert!(bounds.lower <= exact * (1.0 + allowed), "{shown}");
        assert!(bounds.upper >= exact * (1.0 - allowed), "{shown}");
        assert!(bounds.upper <= 1.01 * bounds.lower, "{shown}");
    }
}

#[test]
fn form_factors_between_the_spheres_are_the_exact_ones() {
    let p = spheres();
    let q = area(&p, 1) / area(&p, 0);
    let modes = [0.0, 0.5, 1.0].map(|tau| transport(1.0, tau));
    for found in operators(&p, &modes) {
        let tau = f64::from(found.transport.tau);
        let f = found.operator.form_factors();
        // Area-weighted mean over the rows of one sphere of the sum over the columns of the other.
        let share = |from: u32, to: u32| {
            let mut sum = 0.0;
            for i in (0..f.len()).filter(|&i| p.patches.materials()[i] == from) {
                let (columns, values) = f.row(i);
                let to = columns.iter().zip(values).filter(|(j, _)| p.patches.materials()[**j as usize] == to);
                sum += p.patches.areas()[i] * to.map(|(_, v)| f64::from(*v)).sum::<f64>();
            }
            sum / area(&p, from)
        };
        let outer = p.patches.materials().iter().filter(|&&m| m == 0).count() as f64;
        let noise = 4.0 * (q * (1.0 - q) / (outer * f64::from(RAYS))).sqrt();
        assert!((share(0, 1) - q).abs() < noise, "tau {tau}: {} {q}", share(0, 1));
        let f22 = 1.0 - q + q * tau * tau;
        assert!((share(0, 0) - f22).abs() < noise, "tau {tau}: {} {f22}", share(0, 0));
        // From the inner sphere every ray meets the outer once, and a convex body never itself.
        assert!((share(1, 0) - 1.0).abs() < 1e-6);
        assert_eq!(share(1, 1), 0.0);
        assert!((0..p.patches.len()).all(|i| p.patches.side(i) == Side::Front));
    }
}

#[test]
fn the_verdict_changes_at_the_frontier() {
    let p = spheres();
    let q = area(&p, 1) / area(&p, 0);
    let margin = 0.005 + tolerance(&p, q);
    for tau in [0.75, 1.0] {
        let at = frontier(q, tau);
        let modes = [1.0 - margin, 1.0 + margin].map(|m| transport((at * m) as f32, tau));
        assert!(modes[1].alpha < 1.0);
        let found: Vec<Verdict> = operators(&p, &modes).iter().map(|mode| verdict(&mode.operator).0).collect();
        assert_eq!(found, [Verdict::Converges, Verdict::Diverges], "tau {tau}");
    }
    // An opaque closed scene converges as long as anything is absorbed.
    let opaque = operators(&p, &[transport(1.0, 0.0)]).remove(0);
    assert_eq!(verdict(&opaque.operator).0, Verdict::Converges);
}

#[test]
fn a_diverging_series_is_refused_with_the_alpha_that_would_do() {
    let p = spheres();
    let q = area(&p, 1) / area(&p, 0);
    for tau in [0.8, 1.0] {
        let mode = assemble_one(&p, transport(1.0, tau), &sampling(RAYS, 1));
        let refused = neumann(&mode.operator, &Settings::default()).expect_err("the radius is above 1");
        assert_eq!(refused.verdict, Verdict::Diverges);
        assert!(refused.uniform);
        // The limit is 1 over a proved upper bound: never too high, and within the gap of the bounds.
        let (exact, allowed) = (frontier(q, tau), tolerance(&p, q));
        let limit = refused.alpha_limit;
        assert!(limit <= exact * (1.0 + allowed), "{limit} {exact}");
        assert!(limit >= exact * (1.0 - allowed - 0.01), "{limit} {exact}");
        let below = transport((0.9999 * limit) as f32, tau);
        let mode = assemble_one(&p, below, &sampling(RAYS, 1));
        assert_eq!(verdict(&mode.operator).0, Verdict::Converges, "alpha {}", below.alpha);
    }
}
