//! What is exported, read back by the tools that it is meant for: SciPy, pandas, VTK through pyvista (or meshio) and
//! trimesh.
//!
//! They are Python's: `HALFLIGHT_PYTHON` names an interpreter that has them, or `.ci/run` makes one in `target/python`.
//! Where there is none the test says that it is skipped.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use glam::Vec3;
use halflight::rays::sobol::Stream;
use halflight::{Fineness, Light, LinearOperator, Mode, Scene, Solver};
use halflight_export::{Array, Values, light_array};

use crate::run::{place, succeed};

/// Two unit squares face to face.
const SQUARES: &str = "o low\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\no high, with comma\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\nf 8 7 6 5\n";

/// An interpreter that has numpy, scipy, pandas and trimesh.
fn python() -> Option<PathBuf> {
    let named = std::env::var_os("HALFLIGHT_PYTHON").map(PathBuf::from);
    let python = named.unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/python/bin/python"));
    let tries = Command::new(&python).args(["-c", "import numpy, scipy, pandas, trimesh"]).output();
    tries.is_ok_and(|tried| tried.status.success()).then_some(python)
}

fn write(path: PathBuf, array: &Array) {
    let mut bytes = Vec::new();
    array.write_to(&mut bytes).unwrap();
    fs::write(path, bytes).unwrap();
}

#[test]
fn the_real_tools_read_what_is_exported() {
    let Some(python) = python() else {
        eprintln!("skipped: no Python with numpy, scipy, pandas and trimesh (HALFLIGHT_PYTHON, or .ci/run)");
        return;
    };
    let place = place(&[("squares.obj", SQUARES)]);
    let effort = "--patches 300 --rays 64";
    succeed(&place, &format!("bounces --mode global {effort} --samples 4 --size 8x8 --save kept --save-also ply,mtx"));
    succeed(&place, "factors squares.obj --out factors");
    succeed(&place, "factors squares.obj --out factors --patches 40 --rays 1024");

    let solver = Solver::new(&Scene::open("cornell-box").unwrap());
    let k = solver.operator(Mode::Global, Fineness { patches: 300, rays: 64 }).unwrap();
    let mut random = Stream::new(3);
    let mut half = || Vec3::new(random.uniform(), random.uniform(), random.uniform());
    let mut x: Vec<Light> = (0..k.len()).map(|_| Light { invisible: half(), visible: half() }).collect();
    // F on disk has the columns of luminaires too, which reflect nothing: K acts on light as reflected.
    (0..k.len()).filter(|&i| k.passed_on(i) == Vec3::ZERO).for_each(|i| x[i] = Light::default());
    write(place.path().join("x.npy"), &light_array(&x));
    write(place.path().join("y.npy"), &light_array(&k.apply(&x)));
    let rho: Vec<f32> = k.reflectances().iter().flat_map(|rho| rho.to_array()).collect();
    write(place.path().join("rho.npy"), &Array { shape: vec![k.len(), 3], values: Values::F32(rho.into()) });
    write(place.path().join("alpha.npy"), &Array::vector(Values::F32(k.alphas().into())));

    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/exports/read.py");
    let read = Command::new(python).arg(script).arg(place.path()).output().unwrap();
    let (said, failed) = (String::from_utf8_lossy(&read.stdout), String::from_utf8_lossy(&read.stderr));
    assert!(read.status.success(), "{said}{failed}");
    assert_eq!(said.lines().filter(|line| line.starts_with("ok ")).count(), 15, "{said}");
}
