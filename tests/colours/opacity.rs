//! Opacity by `d` and `Tr`: a mask that is the same everywhere, as the alpha of a glTF material is.

use glam::DVec3;
use halflight::light::{Mode, Rgb};
use halflight::rays::Rays;
use halflight::scene::{AddedLight, LoadOptions, Scene, SkyLight, Warning};
use halflight_reference::{TraceSettings, Tracer};

use super::warns;

/// A room of side 2 about the origin, its back wall with a window, and in it a black pane where `pane` names a
/// material.
fn room(pane: &str, mtl: &str) -> Scene {
    let corners = "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n\
        v -.5 -.5 -1\nv .5 -.5 -1\nv .5 .5 -1\nv -.5 .5 -1\n";
    let walls =
        "f 1 5 6 2\nf 4 3 7 8\nf 1 4 8 5\nf 2 6 7 3\nf 5 8 7 6\nf 1 2 10 9\nf 2 3 11 10\nf 3 4 12 11\nf 4 1 9 12\n";
    let pane = if pane.is_empty() { String::new() } else { format!("usemtl {pane}\nf 9 10 11 12\n") };
    let obj = format!("mtllib m.mtl\n{corners}o room\nusemtl wall\n{walls}{pane}");
    let mtl = format!("newmtl wall\nKd .5 .5 .5\nd 1\nTr 0\n{mtl}");
    let mut scene = Scene::from_obj_text("s", &obj, &mtl).expect("a scene");
    scene.set_sky(SkyLight { upper: Rgb::ONE, lower: Rgb::ONE }, DVec3::Y);
    scene
}

/// The share that is there of a material.
fn opacity(mtl: &str) -> (Option<f32>, Vec<Warning>) {
    let scene = room("glass", &format!("newmtl glass\nKd 0\n{mtl}"));
    let glass = scene.materials.iter().find(|material| material.name == "glass").expect("the glass");
    let mask = glass.maps.as_ref().and_then(|maps| maps.mask.as_ref());
    let is_seen = scene.faces.iter().any(|face| scene.materials[face.material as usize].name == "glass");
    (is_seen.then(|| mask.map_or(1.0, |mask| mask.at(glam::DVec2::ZERO, 1.0))), scene.warnings)
}

#[test]
fn d_and_tr_are_the_share_that_is_there() {
    for (mtl, expected, warned) in [
        ("d .1", Some(0.1), None),
        ("Tr .9", Some(0.1), None),
        ("tr .9\nillum 2", Some(0.1), None),
        ("d .1\nTr .9", Some(0.1), None),
        ("Tr .25\nd .25", Some(0.25), Some("1 contradictory Tr statement of material `glass` (first: m.mtl, line 8)")),
        ("d 1", Some(1.0), None),
        ("Tr 0", Some(1.0), None),
        ("d -halo .3", Some(0.3), Some("1 d -halo statement")),
        ("d 1.5", Some(1.0), Some("1 opacity value of material `glass` (first: m.mtl, line 7): outside 0..1")),
        ("Tr -1", Some(1.0), Some("1 opacity value")),
        ("d 0", None, Some("1 face of material `glass` (first: s.obj, line 26): left out")),
        ("Tr 1", None, Some("left out")),
        ("d .5\nNi 1.5", Some(0.5), Some("1 statement of material `glass` (first: m.mtl, line 8): Ni: not modelled")),
        ("d 1\nNi 1.5", Some(1.0), None),
        ("d .5\nNi 1.000\nTf 1 1 1", Some(0.5), None),
        (
            "Tf .2 .9 .9\nillum 6",
            Some(1.0),
            Some("2 statements of material `glass` (first: m.mtl, line 7): Tf, illum 6"),
        ),
    ] {
        let (found, warnings) = opacity(mtl);
        assert_eq!(warnings.len(), usize::from(warned.is_some()), "{mtl}: {warnings:?}");
        assert!(warned.is_none_or(|part| warnings[0].contains(part)), "{mtl}: {warnings:?}");
        assert!(found.map(|f| (1e6 * f).round()) == expected.map(|e: f32| (1e6 * e).round()), "{mtl}: {found:?}");
    }
    for (mtl, part) in [("d", "one number"), ("d x", "`x`"), ("Tr .1 .2 .3", "found 3"), ("d nan", "not finite")] {
        let glass = format!("newmtl glass\n{mtl}\n");
        let error =
            Scene::from_obj_text("s", "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", &glass).unwrap_err();
        assert!(error.to_string().starts_with("m.mtl, line 2: ") && error.to_string().contains(part), "{error}");
    }
}

/// All light comes through the window, so a black pane of opacity a leaves 1 - a of it in every pixel. The bound is
/// about 7 % of it, and a pane of opacity 0.1 that is passed over is 10 % off.
#[test]
fn a_pane_lets_the_rest_of_the_sky_through() {
    let mean = |scene: &Scene| {
        let rays = Rays::new(scene);
        let transports = scene.transports(Mode::Global.transport());
        let mut tracer = Tracer::new(scene, &rays, &transports, (8, 8), &TraceSettings::default());
        tracer.pass(1024);
        tracer.mean()
    };
    let open = mean(&room("", ""));
    for (mtl, share) in [("d .1", 0.9), ("Tr .4", 0.4), ("d 0", 1.0)] {
        let found = mean(&room("glass", &format!("newmtl glass\nKd 0\n{mtl}")));
        let error = found.error[0].hypot(share * open.error[0]);
        assert!((found.value[0] - share * open.value[0]).abs() < 4.0 * error, "{mtl}: {found:?} {open:?}");
    }
    let solve = |scene: &Scene| {
        let found = halflight::Solver::new(scene).render(Mode::Global, (8, 8)).tolerance(0.02).expect("a picture");
        let sum: f32 = found.picture.pixels.iter().map(|pixel| pixel.x).sum();
        (f64::from(sum) / 64.0, found.error.total)
    };
    let (found, stated) = solve(&room("glass", "newmtl glass\nKd 0\nd .1"));
    let allowed = (4.0 * 0.9 * open.error[0]).hypot(2.0 * stated * found);
    assert!((found - 0.9 * open.value[0]).abs() < allowed, "{found} {open:?} {stated}");
}

#[test]
fn a_mask_is_multiplied_by_the_opacity() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let leaf = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/textured/leaf.png");
    std::fs::copy(leaf, at("leaf.png")).unwrap();
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nusemtl a\nf 1/1 2/2 3/3\n";
    std::fs::write(at("s.obj"), obj).unwrap();
    let coverage = |d: &str| {
        std::fs::write(at("m.mtl"), format!("newmtl a\nKd .5\nmap_d leaf.png\n{d}")).unwrap();
        let scene =
            Scene::load(&at("s.obj"), LoadOptions { light: Some(AddedLight::Sky), ..Default::default() }).unwrap();
        scene.means_of_face(0).coverage
    };
    let whole = coverage("");
    assert!(whole > 0.05 && whole < 0.95 && coverage("d 1") == whole);
    // A share is rounded to single precision at each of 576 points.
    assert!((coverage("d .25") - 0.25 * whole).abs() < 1e-6 && (coverage("Tr .25") - 0.75 * whole).abs() < 1e-6);
}

#[test]
fn a_scene_of_which_nothing_is_there_has_no_faces() {
    let obj = "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    let error = Scene::from_obj_text("s", obj, "newmtl a\nKd 1\nd 0\n").unwrap_err();
    assert!(error.to_string().contains("no faces with area"), "{error}");
    // Some programs write 1 for opaque; then all materials of a library say so.
    let inverted = Scene::from_obj_text("s", obj, "newmtl a\nKd 1\nTr 1.0\nnewmtl b\nKd 1\nTr 1\n").unwrap();
    assert!(inverted.faces.len() == 1 && !inverted.is_textured());
    warns(&inverted, &["2 Tr 1 statements of materials a, b (first: m.mtl, line 3): every material says it"]);
    assert!(inverted.warnings[0].contains("read as opaque"), "{:?}", inverted.warnings);
    let half = Scene::from_obj_text("s", obj, "newmtl a\nKd 1\nKe 4\nd .5\n").unwrap();
    // As of any mask: it emits where it is.
    let means = half.means_of_face(0);
    assert_eq!((means.coverage, means.rho.x, means.emission.x), (0.5, 0.5, 2.0));
    warns(&half, &[]);
}
