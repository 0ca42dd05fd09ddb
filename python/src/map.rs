//! The stability map over the (alpha, tau) square.

use halflight::form_factors::Sampling;
use halflight_study::map::{FrontierPoint, check_crossings, map};
use pyo3::prelude::*;

use crate::errors::Raise;
use crate::running::run;
use crate::scene::{Run, Scene};

/// tau, alpha, its lower and its upper bound, of each point of a frontier.
type Frontier = Vec<[f64; 4]>;

/// What a map has: columns of tau, and bounds on the spectral radius at alpha 1; alpha_c and alpha_variance of tau; tau_c
/// of alpha with the bounds on the radius there; whether the variance's frontier is exact; patches, rays and crossings.
type Mapped = (Vec<[f64; 3]>, Frontier, Frontier, Vec<[f64; 4]>, bool, (usize, u64, usize));

/// Maps a scene.
#[pyfunction]
pub fn stability_map(
    py: Python,
    scene: &Scene,
    grid: usize,
    patches: usize,
    rays: u32,
    asked: Run,
) -> PyResult<Mapped> {
    let sampling = Sampling { rays, seed: asked.seed, ..Sampling::default() };
    let found = run(py, asked.progress.as_ref(), |steps| {
        let bytes = asked.bytes();
        let cut = scene.solver(asked.seed, bytes).cut(patches);
        check_crossings(&cut, &sampling, grid, bytes)?;
        Ok((map(&cut, grid, &sampling, steps), cut.patches.len()))
    })?;
    let (map, patches) = found.map_err(halflight::render::Unfit::raise)?;
    let frontier = |points: Vec<FrontierPoint>| -> Frontier {
        points.iter().map(|p| [p.tau, p.alpha, p.lower, p.upper]).collect()
    };
    let columns = map.columns.iter().map(|c| [c.tau, c.radius.lower, c.radius.upper]).collect();
    let of_alpha = map.tau_frontier.iter().map(|p| [p.alpha, p.tau, p.radius.lower, p.radius.upper]).collect();
    let counts = (patches, map.rays, map.crossings);
    Ok((columns, frontier(map.frontier()), frontier(map.variance_frontier()), of_alpha, map.grey, counts))
}
