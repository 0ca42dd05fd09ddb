//! Pages of `halflight explore`: what is in the file; and in a real browser, whether its pictures are the program's
//! sums, whether they are those of `render`, and whether a person can play with it.
//!
//! The browser is Chromium without a window, named by HALFLIGHT_CHROMIUM or found on the PATH; HALFLIGHT_PLAYWRIGHT
//! names the folder of the npm package playwright-core. Tests say that they were skipped where these are missing. Not
//! handled: other browsers.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use halflight::light::Rgb;
use halflight::pictures::{Picture, relative_rms};
use halflight::{Mode, Scene, Solver};
use serde_json::Value;
use tempfile::TempDir;

use crate::run::{halflight, place, report, succeed};

/// A coarse page.
const COARSE: &str = "--patches 800 --rays 128";
/// Mean colours agree within a step of eight bits.
const STEP: f64 = 1.0 / 255.0;

/// A page of a scene.
fn page(place: &TempDir, scene: &str, arguments: &str) -> PathBuf {
    let scene = if Path::new(scene).extension().is_some() { data(scene) } else { scene.to_owned() };
    succeed(place, &format!("explore {scene} {arguments} -o page.html"));
    place.path().join("page.html")
}

/// A file of the project.
fn data(path: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path).display().to_string()
}

/// The browser, or nothing, which is said.
pub(crate) fn browser() -> Option<PathBuf> {
    let named = std::env::var_os("HALFLIGHT_CHROMIUM").map(PathBuf::from);
    let folders: Vec<PathBuf> =
        std::env::var_os("PATH").map(|path| std::env::split_paths(&path).collect()).unwrap_or_default();
    let found = |name: &str| folders.iter().map(|folder| folder.join(name)).find(|file| file.is_file());
    let browser = named.or_else(|| found("chromium-headless-shell")).or_else(|| found("chromium"));
    if browser.is_none() {
        eprintln!("skipped: there is no Chromium on the PATH, and HALFLIGHT_CHROMIUM names none");
    }
    browser
}

/// The document of a page as it stands when nothing moves any more.
fn dom(browser: &Path, page: &Path, link: &str) -> String {
    let flags = ["--no-sandbox", "--headless", "--virtual-time-budget=5000", "--dump-dom"];
    let address = format!("file://{}#{link}", page.display());
    let profile = format!("--user-data-dir={}", page.with_extension("profile").display());
    let command = Command::new(browser).args(flags).args([&profile, &address]).output();
    let ran = command.expect("a browser that starts");
    String::from_utf8_lossy(&ran.stdout).into_owned()
}

/// What a page finds when it tests itself, asked for by `link`.
fn tested(browser: &Path, page: &Path, link: &str) -> Value {
    let document = dom(browser, page, link);
    let found = document.split_once("<pre id=\"test\">").and_then(|(_, rest)| rest.split_once("</pre>"));
    let (json, _) = found.unwrap_or_else(|| panic!("no test in the page: {} bytes", document.len()));
    serde_json::from_str(&json.replace("&amp;", "&")).expect("JSON")
}

/// The linear picture of a page.
fn linear(browser: &Path, page: &Path, link: &str, (width, height): (usize, usize)) -> Picture {
    let found = tested(browser, page, &format!("test=linear&size={width}x{height}&{link}"));
    let bytes = STANDARD.decode(found["pixels"].as_str().expect("pixels")).expect("base64");
    let pixels = bytes.as_chunks::<12>().0.iter().map(|pixel| {
        let channel = |c: usize| f32::from_le_bytes(std::array::from_fn(|k| pixel[4 * c + k]));
        Rgb::new(channel(0), channel(1), channel(2))
    });
    Picture { width, height, pixels: pixels.collect() }
}

fn mean(state: &Value, field: &str) -> [f64; 3] {
    std::array::from_fn(|c| state[field][c].as_f64().expect("a number"))
}

#[test]
fn a_page_is_one_whole_file_without_an_address() {
    let place = place(&[]);
    let found = report(&place, &format!("explore cornell-box {COARSE} --attribution A&B --title <box> -o page.html"));
    let html = fs::read_to_string(place.path().join("page.html")).expect("a page");
    assert!(html.starts_with("<!DOCTYPE html>") && html.trim_end().ends_with("</html>"));
    for address in ["http:", "https:", "//cdn", "<link", " src=", "@import", "{{"] {
        assert!(!html.contains(address), "{address}");
    }
    assert!(html.contains("&lt;box&gt;") && !html.contains("<box>"));
    assert_eq!(found["bytes"], html.len());
    assert_eq!((&found["lamps"], &found["files"][0]), (&1.into(), &"page.html".into()));
    // What is between the nodes of tau is stated, and so is how far the picture is from a rendered one.
    assert!(found["tau_error"].as_f64().is_some_and(|e| (0.0..0.01).contains(&e)), "{found}");
    assert!(found["rms"].as_f64().is_some_and(|e| (0.0..0.05).contains(&e)), "{found}");
}

#[test]
fn pages_do_not_depend_on_threads_and_do_on_the_seed() {
    let place = place(&[]);
    let bytes = |more: &str| {
        fs::read(page(&place, "meshes/cornell-box-lights.toml", &format!("{COARSE} {more}"))).expect("a page")
    };
    let one = bytes("--threads 1");
    assert!(one == bytes("--threads 2") && one != bytes("--seed 1"));
}

#[test]
fn wrong_arguments_leave_no_file() {
    let place = place(&[("way", "a file in the way")]);
    for (arguments, code) in [
        ("explore cornell-box -o way/page.html", 1),
        ("explore nowhere -o page.html", 3),
        ("explore cornell-box --taus 1 -o page.html", 2),
        ("explore cornell-box --patches 90000 --memory 0.01 -o page.html", 5),
    ] {
        let ran = halflight(&place, arguments);
        assert_eq!(ran.code, Some(code), "{arguments}: {}", ran.err);
    }
    assert_eq!(fs::read_dir(place.path()).expect("a folder").count(), 1);
}

/// Lamps of every kind, a series that diverges, textures with a mask, a sky.
#[test]
fn pages_show_the_sums_of_the_program() {
    let Some(browser) = browser() else { return };
    let mut diverging = 0;
    for scene in ["meshes/cornell-box-lights.toml", "furnished-room", "gallery", "tests/data/textured/room.toml"] {
        let place = place(&[]);
        let found = tested(&browser, &page(&place, scene, COARSE), "test");
        assert_eq!(found["webgl2"], true, "{scene}");
        let states = found["states"].as_array().expect("states");
        assert!(states.len() >= 20, "{scene}: {}", states.len());
        for state in states {
            let (shown, expected) = (mean(state, "mean"), mean(state, "expected"));
            let apart = (0..3).map(|c| (shown[c] - expected[c]).abs()).fold(0.0, f64::max);
            assert!(apart < STEP, "{scene}: {state}");
        }
        // The last term stands for a series that diverges: its picture is not that of the first eight.
        let named = |link: &str| states.iter().find(|state| state["state"] == link).expect("a state");
        let [whole, third] =
            ["mode=shadowless", "mode=shadowless&term=3&stops=-2"].map(|link| mean(named(link), "mean"));
        assert!(whole != third && third[0] > 0.0, "{scene}");
        diverging += usize::from(scene == "furnished-room");
        // Each lamp that is switched off takes something away.
        let off = states.iter().filter(|state| state["state"].as_str().is_some_and(|link| link.ends_with("=0")));
        let lit = mean(named("mode=global"), "mean");
        assert!(off.clone().count() >= 1 && off.clone().all(|state| mean(state, "mean")[1] < lit[1]), "{scene}");
    }
    assert_eq!(diverging, 1);
}

/// Pictures of [`Solver::render`] are another way to the same light: gathered at every pixel, not kept in texels.
#[test]
fn pages_show_what_is_rendered() {
    let Some(browser) = browser() else { return };
    let size = (96, 72);
    for (scene, mode) in [("cornell-box", Mode::Global), ("gallery", Mode::OneBounce), ("gallery", Mode::Shadowless)] {
        let place = place(&[]);
        let page = page(&place, scene, "--patches 4000 --rays 512");
        // Three by three points of every pixel, as the page's picture has one of each.
        let shown = linear(&browser, &page, &format!("mode={mode}"), (3 * size.0, 3 * size.1)).averaged(3);
        let solver = Solver::new(&Scene::open(scene).expect("a scene"));
        let rendered = solver.render(mode, size).tolerance(0.02).expect("a picture").picture;
        // Luminaires and their edges are far brighter than all else.
        let dim = |x: usize, y: usize| {
            let near = |x: usize, y: usize| rendered.get(x, y).is_none_or(|pixel| pixel.max_element() < 2.0);
            (0..9).all(|k| near((x + k % 3).saturating_sub(1), (y + k / 3).saturating_sub(1)))
        };
        let mask = Picture::from_fn(size.0, size.1, |x, y| Rgb::splat(f32::from(u8::from(dim(x, y)))));
        let apart = relative_rms(&shown, &rendered, Some(&mask), None).expect("pictures of one size");
        // The target: 5 %, of which render may have 2.
        assert!(apart < 0.05, "{scene} {mode}: {apart}");
    }
}

/// Where a picture is off, cells become finer; where that does not do, page and program say how far off it is.
#[test]
fn pages_come_nearer_or_say_how_far_they_are_off() {
    let place = place(&[]);
    let rms = |more: &str| {
        let coarse = "explore gallery --patches 100 --rays 128 --terms 3 --taus 2 -o page.html";
        report(&place, &format!("{coarse} {more}"))["rms"].as_f64().expect("a number")
    };
    let (as_it_is, nearer) = (rms("--tolerance 1"), rms("--tolerance 0.05"));
    assert!(nearer < 0.9 * as_it_is, "{nearer} {as_it_is}");
    let far = "explore gallery --patches 20 --rays 32 --terms 2 --taus 2 --tolerance 1 -o page.html";
    let ran = halflight(&place, far);
    assert!(ran.err.contains("off a rendered one"), "{}", ran.err);
    let Some(browser) = browser() else { return };
    let is_doubtful =
        |link: &str| !dom(&browser, &place.path().join("page.html"), link).contains("role=\"note\" hidden");
    assert!(is_doubtful("mode=global"));
    succeed(&place, "explore cornell-box --patches 400 --rays 128 --terms 2 --taus 2 -o page.html");
    assert!(!is_doubtful("mode=global"));
}

/// A reflectance that is changed in the page against the same in the file: all surfaces exactly, one material by light
/// between few coarse patches.
#[test]
fn reflectances_in_a_page_are_those_of_a_file() {
    let Some(browser) = browser() else { return };
    let [obj, mtl] = ["meshes/cornell-box.obj", "meshes/cornell-box.mtl"].map(|file| fs::read_to_string(data(file)));
    let (obj, mtl) = (obj.expect("an OBJ"), mtl.expect("an MTL"));
    let toml = fs::read_to_string(data("meshes/cornell-box.toml")).expect("a scene");
    let picture = |mtl: &str, link: &str| {
        let place = place(&[("cornell-box.obj", &obj), ("cornell-box.mtl", mtl), ("box.toml", &toml)]);
        succeed(&place, "explore box.toml --patches 800 --rays 512 --taus 2 --tolerance 1 -o page.html");
        linear(&browser, &place.path().join("page.html"), link, (96, 72))
    };
    let white = mtl.replace("Kd 0.73 0.73 0.73", "Kd 0.365 0.365 0.365");
    let half =
        white.replace("Kd 0.63 0.065 0.05", "Kd 0.315 0.0325 0.025").replace("0.14 0.45 0.091", "0.07 0.225 0.0455");
    assert!(half != white && white != mtl);
    for (changed, link, within) in [(&half, "rho=0.5", 2e-3), (&white, "rho-white=0.5", 0.02)] {
        let (theirs, ours, before) = (picture(changed, ""), picture(&mtl, link), picture(&mtl, ""));
        let apart = |picture: &Picture| relative_rms(picture, &theirs, None, None).expect("pictures of one size");
        // The luminaire, far brighter than all else, is in both.
        assert!(apart(&ours) < within * 10.0 * apart(&before), "{link}: {} {}", apart(&ours), apart(&before));
    }
}

#[test]
fn a_story_is_told_alone_where_it_is_asked_for() {
    let place = place(&[]);
    succeed(&place, "explore cornell-box --patches 200 --rays 64 --terms 2 --taus 2 --story -o page.html");
    assert!(fs::read_to_string(place.path().join("page.html")).expect("a page").contains("\"story\":true"));
    let Some(browser) = browser() else { return };
    let told = dom(&browser, &place.path().join("page.html"), "story=2");
    assert!(told.contains("<body class=\"told\">") && told.contains("2 of 5"));
}

#[test]
fn a_person_plays_with_a_page() {
    let (Some(browser), Some(package)) = (browser(), std::env::var_os("HALFLIGHT_PLAYWRIGHT")) else {
        eprintln!("skipped: HALFLIGHT_PLAYWRIGHT does not name the package playwright-core");
        return;
    };
    let place = place(&[]);
    let page = page(&place, "furnished-room", COARSE);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/explore/play.mjs");
    let ran = Command::new("node").arg(script).arg(&page).arg(&browser).arg(package).output().expect("node");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(ran.status.success(), "{}{}", text(&ran.stdout), text(&ran.stderr));
}
