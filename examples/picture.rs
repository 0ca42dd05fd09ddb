//! A picture to a tolerance: what it is off by, where that comes from, and what it cost.
//!
//! `cargo run --release --example picture [SCENE [TOLERANCE]]` writes picture.exr; SCENE is a built-in name, a .toml
//! scene file or an .obj file.

use std::env::args;
use std::error::Error;

use halflight::{Mode, Scene, Solver};

fn main() -> Result<(), Box<dyn Error>> {
    let scene = Scene::open(&args().nth(1).unwrap_or_else(|| "cornell-box".into()))?;
    let tolerance = args().nth(2).map_or(Ok(0.02), |text| text.parse())?;
    let solver = Solver::new(&scene).seed(7);
    let picture = solver.render(Mode::Global, (128, 128)).tolerance(tolerance)?;
    let parts = picture.error;
    let shares = [
        ("noise of F", parts.form_factors),
        ("patch size", parts.patches),
        ("truncation of the series", parts.truncation),
        ("gather pass", parts.gather),
        ("all together", parts.total),
    ];
    for (name, share) in shares {
        println!("{name:<25} {:>7.3} %", 100.0 * share);
    }
    println!("{} patches, {} rays, {:.2} s", picture.patches, picture.rays, picture.seconds.total);
    picture.save("picture.exr")?;
    Ok(())
}
