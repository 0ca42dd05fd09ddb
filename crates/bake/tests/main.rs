//! Maps against closed forms, against light at points, and against one another.

mod closed_forms;
mod gltf_files;
mod lamps;
mod points;

use std::path::{Path, PathBuf};

use halflight::Scene;
use halflight::render::Silent;
use halflight_bake::{Bake, BakeGoal, Held, Lamps, Model, bake};
use tempfile::TempDir;

/// A goal of a small map.
pub fn goal(texels: usize, tolerance: f64) -> BakeGoal<'static> {
    BakeGoal {
        transport: halflight::Mode::Global.transport(),
        tolerance,
        held: Held::All,
        lamps: Lamps::Together,
        texels,
        padding: 2,
        seed: 3,
        memory: 1e9,
        watch: &Silent,
    }
}

/// The maps of a scene of this name.
pub fn baked(name: &str, goal: &BakeGoal) -> (Scene, Bake) {
    let scene = Scene::open(name).expect("a scene");
    let model = Model::open(name, &scene).expect("parts");
    let found = bake(&scene, model.parts(), goal).expect("maps");
    (scene, found)
}

/// A folder with these files.
pub fn folder(files: &[(&str, &str)]) -> TempDir {
    let folder = TempDir::new().expect("a folder");
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).expect("a file");
    }
    folder
}

/// A file of a folder, as scenes are named.
pub fn name(folder: &TempDir, file: &str) -> String {
    folder.path().join(file).display().to_string()
}

/// A file of the project.
pub fn data(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}
