//! `halflight scenes`: the scenes that need no file.

use serde::Serialize;

use crate::cli::console::Console;
use crate::cli::error::CliError;
use crate::cli::options::Common;
use crate::scene::{Scene, builtin};

#[derive(Serialize)]
struct Listed {
    name: &'static str,
    description: &'static str,
    triangles: u32,
}

/// Lists the built-in scenes.
pub fn run(common: &Common) -> Result<(), CliError> {
    let console = Console::new(common);
    let mut list = Vec::new();
    for (name, description) in builtin::NAMES {
        let scene = Scene::open(name)?;
        let triangles = scene.solid_faces();
        console.say(format!("{name:<18} {triangles:>6} triangles  {description}"));
        list.push(Listed { name, description, triangles });
    }
    console.report(&list)
}
