//! The Neumann series of each mode: E, KE, K²E, ... with the proved bounds on the spectral radius of K.
//!
//! `cargo run --release --example series [SCENE]` shows that a mode's series converges, ends after KE, or diverges.

use std::env::args;
use std::error::Error;

use halflight::{Fineness, Mode, Scene, Solver, explore};

/// Bounces shown of each mode.
const COUNT: usize = 6;

fn main() -> Result<(), Box<dyn Error>> {
    let scene = Scene::open(&args().nth(1).unwrap_or_else(|| "furnished-room".into()))?;
    let solver = Solver::new(&scene);
    for mode in Mode::ALL {
        let k = solver.operator(mode, Fineness { patches: 1000, rays: 128 })?;
        let series = explore(&k, COUNT);
        let (verdict, radius) = (series.verdict.name(), series.radius);
        println!("{mode}: {verdict}, spectral radius {:.4} to {:.4}", radius.lower, radius.upper);
        for bounce in &series.bounces {
            let [red, green, blue] = bounce.power;
            let rest = bounce.tail_bound.map_or("none".into(), |bound| format!("{bound:.2e}"));
            println!("  {}: {red:9.2} {green:9.2} {blue:9.2} W, bound on all later terms {rest}", bounce.n);
        }
    }
    Ok(())
}
