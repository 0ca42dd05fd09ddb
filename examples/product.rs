//! Seconds that a product `K x` takes: the least and the median of some, for a scene, patches and rays.
//!
//! ```text
//! cargo run --release --example product -- cornell-box 100000 64
//! ```
//!
//! `python/benches/overheads.py` measures the same from Python beside it.

use std::time::Instant;

use halflight::{Fineness, LinearOperator, Mode, Scene, Solver};

/// Products that are measured.
const TIMES: usize = 15;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, patches, rays] = &arguments[..] else { return Err("give a scene, patches and rays".into()) };
    let fineness = Fineness { patches: patches.parse()?, rays: rays.parse()? };
    let k = Solver::new(&Scene::open(scene)?).operator(Mode::Global, fineness)?;
    let x = k.first_bounce();
    let once = || {
        let clock = Instant::now();
        let y = k.apply(&x);
        (clock.elapsed().as_secs_f64(), y.len())
    };
    let mut seconds: Vec<f64> = (0..TIMES).map(|_| once().0).collect();
    seconds.sort_by(f64::total_cmp);
    println!("{} {} {}", k.len(), seconds[0], seconds[TIMES / 2]);
    Ok(())
}
