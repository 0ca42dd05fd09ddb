//! What the examples of this crate have in common: where their files go, the scene that they open, and how they end.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use miette::{Diagnostic, MietteDiagnostic};

use halflight::render::Unfit;
use halflight::scene::Scene;
use halflight_plot::Drawing;

/// Why an example ends early.
pub type Failure = Box<dyn Diagnostic>;

/// Where files go, and what chooses the samples.
#[derive(Args, Debug)]
pub struct Output {
    /// Directory for the files written, made if there is none
    #[arg(long, global = true, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
    /// Chooses the sample points; the same seed gives the same bytes
    #[arg(long, global = true, value_name = "N", default_value_t = 0)]
    pub seed: u32,
}

impl Output {
    /// Writes a drawing as PNG and SVG, and says where.
    pub fn draw(&self, name: &str, drawing: &Drawing) -> Result<(), Failure> {
        for kind in ["png", "svg"] {
            let path = self.out.join(format!("{name}.{kind}"));
            drawing.write(&path)?;
            println!("{}", path.display());
        }
        Ok(())
    }
}

/// Reads and checks the scene of that name or path, which must emit, and prints its warnings.
pub fn open(scene: &str) -> Result<Scene, Failure> {
    let scene = Scene::open(scene)?;
    scene.require_emission()?;
    scene.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    Ok(scene)
}

/// What does not fit in memory, and what would.
pub fn too_large(unfit: Unfit) -> Failure {
    let help = format!("about {} patches would fit: pass fewer --patches or --rays", unfit.fitting);
    MietteDiagnostic::new(unfit.to_string()).with_help(help).into()
}

/// The exit code of an example, which says on stderr why it ended early and what to do.
pub fn end(ended: Result<(), Failure>) -> ExitCode {
    let Err(failure) = ended else { return ExitCode::SUCCESS };
    eprintln!("error: {failure}");
    if let Some(help) = failure.help() {
        eprintln!("help: {help}");
    }
    ExitCode::FAILURE
}
