//! Texts that are long, deep or greedy: refused or read, in memory proportional to their length.

use halflight::scene::{LoadOptions, Scene, SceneError};

use super::check;

/// Peak memory of this process so far, KiB; none where the system does not tell.
pub fn peak() -> Option<usize> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse().ok()
}

/// Bytes of memory that a reader may need for each byte of text. A short `v 0 0 0` alone becomes a vector of 24 bytes,
/// lists double as they grow, and they are mapped to unit coordinates once.
const SHARE: usize = 64;

/// What every text may need: the runtime, and the tests that run beside this one.
const BASE: usize = 256 << 10;

fn toml(text: &str) -> Result<Scene, SceneError> {
    let (obj, mtl) = ("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n", "newmtl a\n");
    Scene::from_toml_text("s", text, obj, mtl, LoadOptions::default())
}

fn obj(text: &str) -> Result<Scene, SceneError> {
    Scene::from_obj_text("s", text, "newmtl a\n")
}

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

#[test]
fn a_face_of_a_million_corners_is_refused() {
    let mut text = TRIANGLE.to_owned() + "f";
    text.push_str(&" 1 2 3".repeat(333_334));
    let error = obj(&text).unwrap_err();
    assert!(matches!(error, SceneError::TooManyCorners { found: 1_000_002, .. }), "{error}");
}

#[test]
fn indices_beyond_all_vertices_reserve_nothing() {
    for index in ["4294967296", "9223372036854775807", "-9223372036854775808", "-4"] {
        let error = obj(&format!("{TRIANGLE}f 1 2 {index}\n")).unwrap_err();
        assert!(matches!(error, SceneError::IndexOutOfRange { .. }), "{error}");
    }
}

#[test]
fn deep_tables_are_refused_before_the_stack_ends() {
    for (open, close) in [("[", "]"), ("{a=", "}")] {
        let text = format!("obj = {}1{}\n", open.repeat(200_000), close.repeat(200_000));
        assert!(matches!(toml(&text).unwrap_err(), SceneError::SceneFile { .. }));
        let text = format!("obj = {}", open.repeat(200_000));
        assert!(matches!(toml(&text).unwrap_err(), SceneError::SceneFile { .. }));
    }
    let deep = format!("obj = \"s.obj\"\n[{}a]\n", "a.".repeat(100_000));
    assert!(toml(&deep).is_err());
    let dotted = format!("obj = \"s.obj\"\n{}a = 1\n", "a.".repeat(100_000));
    assert!(toml(&dotted).is_err());
}

/// Work that grows with the square of the text would not end here.
#[test]
fn long_texts_take_time_and_memory_in_proportion() {
    let n = 100_000;
    let names = |f: &dyn Fn(usize) -> String| (0..n).map(f).collect::<String>();
    let materials = names(&|i| format!("newmtl m{i}\nKd .5\n"));
    let mut uses = String::from("mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n");
    uses += &names(&|i| format!("o {i}\nusemtl m{i}\nf 1 2 3\n"));
    let changes = names(&|i| format!("[materials.m{i}]\nalpha = 1\n"));
    let texts: [(&str, String); 6] = [
        ("one long line", "v 0 0 0 ".to_owned() + &"1 ".repeat(n * 10)),
        ("a long chain of continuations", "v 0 0 \\\n".repeat(n)),
        ("a long word", format!("v 0 0 {}", "1".repeat(n * 10))),
        ("vertices", "v 0 0 0\n".repeat(n * 10) + "f 1 2 3\n"),
        ("libraries", "mtllib m.mtl\n".repeat(n) + TRIANGLE),
        ("groups", names(&|i| format!("g {i}\n")) + TRIANGLE),
    ];
    let mut longest = 0;
    for (what, text) in &texts {
        longest = longest.max(text.len());
        println!("{what}");
        check(Scene::from_obj_text("s", text, &materials));
    }
    assert!(check(Scene::from_obj_text("s", &uses, &materials)));
    let options = LoadOptions::default();
    let file = format!("obj = \"s.obj\"\n{changes}");
    assert!(check(Scene::from_toml_text("s", &file, &uses, &materials, options)));
    check(toml(&format!("obj = \"s.obj\"\nx = \"{}\"\n", "\\u0041".repeat(n))));
    check(toml(&format!("obj = [{}]\n", "1,".repeat(n * 10))));
    longest = longest.max(uses.len() + materials.len() + changes.len());
    if let Some(peak) = peak() {
        assert!(peak << 10 < SHARE * longest + (BASE << 10), "{peak} KiB for {longest} bytes");
    }
}
