//! Runs the built program in a directory of its own, on problems small enough for a test.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;

/// A coarse problem.
pub const SMALL: &str = "--size 48x48 --patches 300 --rays 64 --samples 16";

/// A square of one emitting material, its front towards -z, and a camera that looks at it from +z.
pub const SHEET: [(&str, &str); 3] = [
    ("sheet.obj", "mtllib sheet.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl glow\nf 4 3 2 1\n"),
    ("sheet.mtl", "newmtl glow\nKd .5 .5 .5\nKe 1 1 1\n"),
    ("sheet.toml", "obj = \"sheet.obj\"\n[camera]\nposition = [0.5, 0.5, 2]\ntarget = [0.5, 0.5, 0]\nup = [0, 1, 0]\n"),
];

/// What a run left behind, its files apart.
pub struct Ran {
    pub code: Option<i32>,
    pub out: String,
    pub err: String,
}

/// An empty directory that goes away with the test, or one with these files in it.
pub fn place(files: &[(&str, &str)]) -> TempDir {
    let place = TempDir::new().unwrap();
    for (name, text) in files {
        fs::write(place.path().join(name), text).unwrap();
    }
    place
}

/// The program that is tried: that of the tests' own profile, or the one that HALFLIGHT_PROGRAM names.
pub fn program() -> std::path::PathBuf {
    let named = std::env::var_os("HALFLIGHT_PROGRAM").map(Into::into);
    named.unwrap_or_else(|| env!("CARGO_BIN_EXE_halflight").into())
}

/// Runs the program in `place`; the arguments are the words of `arguments`.
pub fn halflight(place: &TempDir, arguments: &str) -> Ran {
    let output = Command::new(program()).args(arguments.split_whitespace()).current_dir(place.path()).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    Ran { code: output.status.code(), out: text(output.stdout), err: text(output.stderr) }
}

/// Runs the program, which must succeed.
#[track_caller]
pub fn succeed(place: &TempDir, arguments: &str) -> Ran {
    let ran = halflight(place, arguments);
    assert_eq!(ran.code, Some(0), "{arguments}: {}", ran.err);
    ran
}

/// The one JSON document on stdout of a run that must succeed.
#[track_caller]
pub fn report(place: &TempDir, arguments: &str) -> Value {
    let ran = succeed(place, &format!("{arguments} --json"));
    serde_json::from_str(&ran.out).unwrap()
}

/// What the report says of the one mode of such a run.
#[track_caller]
pub fn report_of_mode(place: &TempDir, arguments: &str) -> Value {
    let mut report = report(place, arguments);
    let modes = report["modes"].as_array_mut().expect("every report of modes has a list of them");
    assert_eq!(modes.len(), 1, "{arguments}");
    modes.remove(0)
}

/// Everything under a directory: paths from there, with `/` at the end of a directory's, and the files' bytes.
pub fn contents(place: &TempDir) -> BTreeMap<String, Vec<u8>> {
    fn walk(folder: &Path, prefix: &str, found: &mut BTreeMap<String, Vec<u8>>) {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = format!("{prefix}{}", path.file_name().unwrap().to_string_lossy());
            if path.is_dir() {
                found.insert(format!("{name}/"), Vec::new());
                walk(&path, &format!("{name}/"), found);
            } else {
                // A temporary file may be gone by now.
                match fs::read(&path) {
                    Ok(bytes) => drop(found.insert(name, bytes)),
                    Err(e) => assert_eq!(e.kind(), std::io::ErrorKind::NotFound, "{name}"),
                }
            }
        }
    }
    let mut found = BTreeMap::new();
    walk(place.path(), "", &mut found);
    found
}

/// The paths of all files under a directory.
pub fn files(place: &TempDir) -> Vec<String> {
    let all = contents(place).into_keys();
    all.filter(|name| !name.ends_with('/')).collect()
}

/// The names of an object's fields, sorted.
#[track_caller]
pub fn fields(value: &Value) -> Vec<&str> {
    let mut names: Vec<&str> = value.as_object().unwrap().keys().map(|k| &k[..]).collect();
    names.sort_unstable();
    names
}
