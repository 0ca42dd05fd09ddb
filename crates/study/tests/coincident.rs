//! Faces in one place: of those that face the same way the first in the file is there, for every method alike.

use std::path::Path;

use glam::{DVec3, Vec3};
use halflight::light::Mode;
use halflight::rays::{Ray, Rays, Side};
use halflight::scene::{LoadOptions, Scene, Sides};
use halflight::{Fineness, Solver};
use halflight_reference::{NextEvent, TraceSettings, Tracer};
use halflight_study::{FactorSettings, FactorTable, factors};

use crate::common::Silent;

const ROOM: &str = include_str!("../../../tests/data/coincident/room.obj");
const MATERIALS: &str = include_str!("../../../tests/data/coincident/room.mtl");

/// Half the room's largest extent.
const SCALE: f64 = 2.0;

/// A rectangle at a height that faces down, its corners turned by so many.
struct Panel([f64; 4], f64, usize);

impl Panel {
    fn text(&self, object: &str, material: &str) -> String {
        let Panel([x0, x1, z0, z1], y, turn) = *self;
        let corners = [(x0, z0), (x1, z0), (x1, z1), (x0, z1)];
        let lines = (0..4).map(|k| corners[(k + turn) % 4]).map(|(x, z)| format!("v {x:?} {y:?} {z:?}\n"));
        format!("{}o {object}\nusemtl {material}\nf -4 -3 -2 -1\n", lines.collect::<String>())
    }
}

fn panel(x0: f64, x1: f64, z0: f64, z1: f64) -> Panel {
    Panel([x0, x1, z0, z1], 2.4, 0)
}

fn room(more: &str) -> Scene {
    // The mask's image is no text: without it a card is whole.
    let materials: String =
        MATERIALS.lines().filter(|line| !line.starts_with("map_d")).map(|l| format!("{l}\n")).collect();
    Scene::from_obj_text("room", &format!("{ROOM}{more}"), &materials).expect("a correct scene")
}

/// The room with panels of the lamp's material, each an object of its own.
fn lit(panels: &[Panel]) -> Scene {
    room(&panels.iter().enumerate().map(|(k, panel)| panel.text(&format!("lamp{k}"), "lamp")).collect::<String>())
}

/// The area that emits, in the file's units squared.
fn emitting(scene: &Scene) -> f64 {
    let faces = (0..scene.faces.len() as u32).filter(|&face| scene.material(face).emits());
    faces.map(|face| scene.area(face)).sum::<f64>() * SCALE * SCALE
}

fn table(scene: &Scene, tolerance: f64) -> FactorTable {
    let tau = vec![0.0; scene.materials.len()];
    factors(scene, &tau, &FactorSettings { tolerance, seed: 0 }, &Silent)
}

#[test]
fn what_lies_twice_is_there_once() {
    let once = || panel(1.2, 1.8, 1.6, 2.4);
    let raised = |by: f64| Panel([1.2, 1.8, 1.6, 2.4], 2.4 + by, 0);
    let turned = Panel([1.2, 1.8, 1.6, 2.4], 2.4, 1);
    // Gaps below 2e-6 of half the extent, which is 2.
    let pairs = [once(), turned, raised(3e-6), raised(-3e-6)];
    for second in pairs {
        let scene = lit(&[once(), second]);
        assert_eq!(scene.faces, lit(&[once()]).faces);
        let [warning] = &scene.warnings[..] else { panic!("one warning: {:?}", scene.warnings) };
        assert!(
            warning.starts_with("2 triangles of object `lamp1`") && warning.contains("object `lamp0`"),
            "{warning}"
        );
    }
    let apart = lit(&[once(), raised(-1e-5)]);
    assert!(apart.warnings.is_empty() && apart.faces.len() == 16);
}

#[test]
fn what_overlaps_is_its_union() {
    // Three and four deep, in parts; the union is an L, or a rectangle.
    let ell = [panel(1.0, 2.0, 1.0, 2.0), panel(1.0, 1.5, 1.0, 3.0), panel(1.2, 1.4, 1.5, 2.5)];
    let whole =
        [panel(1.0, 2.0, 1.0, 1.6), panel(1.2, 2.0, 1.4, 2.0), panel(1.0, 1.5, 1.1, 2.0), panel(1.1, 1.9, 1.2, 1.8)];
    // The corners' rounding to single precision, over the sides.
    let rounding = 1e-6;
    assert!((emitting(&lit(&ell)) - 1.5).abs() < rounding);
    assert!((emitting(&lit(&whole)) - 1.0).abs() < rounding);
    // Many small ones under one, and one under many.
    let tiles = || (0..100).map(|k| (1.0 + 0.1 * f64::from(k % 10), 1.0 + 0.1 * f64::from(k / 10)));
    let tiles = || tiles().map(|(x, z)| panel(x, x + 0.1, z, z + 0.1));
    let over: Vec<Panel> = tiles().chain([panel(0.9, 2.1, 0.9, 2.1)]).collect();
    let under: Vec<Panel> = [panel(0.9, 2.1, 0.9, 2.1)].into_iter().chain(tiles()).collect();
    assert!((emitting(&lit(&over)) - 1.44).abs() < 20.0 * rounding, "{}", emitting(&lit(&over)));
    assert_eq!(lit(&under).faces.len(), 14);
}

#[test]
fn a_pile_costs_about_as_much_as_it_has_faces() {
    let pile: Vec<Panel> = (0..5000).map(|k| Panel([1.2, 1.8, 1.6, 2.4], 2.4, k % 4)).collect();
    let scene = lit(&pile);
    assert_eq!((scene.faces.len(), scene.warnings.len()), (14, 1));
}

/// So do panels of which each is shifted beyond the last, along a side and across both.
#[test]
fn a_row_of_shifted_faces_costs_about_as_much_as_it_has_faces() {
    let (n, step) = (2000, 1e-4);
    for across in [0.0, 1.0] {
        let along = |k: u32| f64::from(k) * step;
        let one = |k: u32| panel(1.2 + along(k), 1.6 + along(k), 1.6 + across * along(k), 2.0 + across * along(k));
        let scene = lit(&(0..n).map(one).collect::<Vec<Panel>>());
        let shown = step * 0.4 + across * step * (0.4 - step);
        let expected = 0.16 + f64::from(n - 1) * shown;
        // A corner is rounded by 1.2e-7, and the sides that are not shared are those of the union.
        assert!((emitting(&scene) - expected).abs() < 2e-5, "{} {expected}", emitting(&scene));
    }
}

#[test]
fn rows_of_a_closed_room_add_up_whatever_lies_twice() {
    let wall = "v 0 0 4\nv 0 2.5 4\nv 0 2.5 0\nv 0 0 0\no again\nusemtl red\nf -1 -2 -3 -4\n";
    let part = "v 0 .5 1\nv 0 2 1\nv 0 2 3\nv 0 .5 3\no poster\nusemtl red\nf -4 -3 -2 -1\n";
    for more in [wall.to_owned(), part.to_owned(), format!("{part}{wall}")] {
        let found = table(&room(&more), 1e-6);
        for row in found.rows.iter().take(6) {
            let (sum, error) = (row.sum.value, row.sum.error);
            assert!((sum - 1.0).abs() <= 4.0 * error + 1e-9, "{}: {sum} +- {error}", row.name);
        }
        assert!(found.rows[6..].iter().all(|row| row.area == 0.0));
    }
}

#[test]
fn pictures_and_paths_are_those_of_once() {
    let once = lit(&[panel(1.2, 1.8, 1.6, 2.4)]);
    let twice = lit(&[panel(1.2, 1.8, 1.6, 2.4), panel(1.2, 1.8, 1.6, 2.4), panel(1.3, 1.7, 1.7, 2.2)]);
    let picture = |scene: &Scene| {
        let effort = Fineness { patches: 100, rays: 64 };
        let k = Solver::new(scene).operator(Mode::Global, effort).expect("an operator");
        halflight::explore(&k, 2).bounces[1].power
    };
    assert_eq!(picture(&once), picture(&twice));
    for next_event in [NextEvent::On, NextEvent::Off] {
        let settings = TraceSettings { next_event, max_bounces: 4, seed: 0 };
        let traced = |scene: &Scene| {
            let rays = Rays::new(scene);
            let mut tracer = Tracer::new(scene, &rays, &scene.transports(Mode::Global.transport()), (8, 8), &settings);
            tracer.pass(4);
            tracer.picture().pixels
        };
        assert_eq!(traced(&once), traced(&twice));
    }
}

/// What an opacity leaves of a face is the next one's, but where that is the same face once more.
#[test]
fn an_opacity_leaves_the_next_face_its_share() {
    let materials = "newmtl white\nKd .7 .7 .7\nnewmtl red\nKd .6 .1 .1\nnewmtl lamp\nKe 9 9 9\n\
                     newmtl pane\nKd .5 .5 .5\nd .25\nnewmtl glow\nKe 9 9 9\nd .25\n";
    let whole = || panel(1.2, 1.8, 1.6, 2.4);
    let (left, right) = (panel(1.2, 1.5, 1.6, 2.4), panel(1.5, 1.8, 1.6, 2.4));
    let cases = [
        (vec![(whole(), "pane"), (whole(), "lamp")], 0.75),
        (vec![(whole(), "pane"), (whole(), "pane"), (whole(), "lamp")], 0.75),
        (vec![(left, "pane"), (whole(), "lamp")], 0.875),
        (vec![(whole(), "glow"), (whole(), "glow")], 0.25),
        (vec![(whole(), "lamp"), (right, "pane")], 1.0),
        (vec![(whole(), "glow"), (whole(), "lamp"), (whole(), "white")], 1.0),
    ];
    for (panels, share) in cases {
        let text = |(k, (panel, material)): (usize, &(Panel, &str))| panel.text(&format!("p{k}"), material);
        let obj = panels.iter().enumerate().map(text).collect::<String>();
        let scene = Scene::from_obj_text("room", &format!("{ROOM}{obj}"), materials).expect("a correct scene");
        let lamps = (0..scene.faces.len() as u32).filter(|&face| scene.material(face).emits());
        let found = lamps.map(|f| scene.means_of_face(f).coverage * scene.area(f)).sum::<f64>() * SCALE * SCALE / 0.48;
        let names: Vec<&str> = panels.iter().map(|panel| panel.1).collect();
        assert!((found - share).abs() < 1e-5, "{names:?}: {found}");
    }
}

/// Where the first of two faces is cut out, the second is there; nowhere else.
#[test]
fn under_a_mask_the_next_face_is_there() {
    let open = |name: &str| {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/coincident");
        Scene::load(&folder.join(name), LoadOptions::default()).expect("a correct scene")
    };
    let (leaf, card) = (open("leaf.obj"), open("card.obj"));
    let (bare, both) = (Rays::new(&leaf), Rays::new(&card));
    let (mut cut_out, mut hits) = (0, Vec::new());
    for k in 0..900 {
        let at =
            DVec3::new(1.2 + 0.6 * (f64::from(k % 30) + 0.5) / 30.0, 1.0, 1.6 + 0.8 * (f64::from(k / 30) + 0.5) / 30.0);
        let ray = Ray { origin: card.frame.to_unit(at).as_vec3(), direction: Vec3::Y, source: None };
        let alone = bare.closest(&ray).expect("a closed room");
        let met = both.closest(&ray).expect("a closed room");
        let name = |scene: &Scene, face: u32| scene.objects[scene.faces[face as usize].object as usize].clone();
        let expected = if name(&leaf, alone.face) == "card" { "card" } else { "lamp" };
        assert_eq!((name(&card, met.face).as_str(), met.side), (expected, Side::Front), "{k}");
        // Every method counts the lamp by what the mask leaves of it.
        let lamp = (0..card.faces.len() as u32).filter(|&face| name(&card, face) == "lamp");
        let position = card.frame.to_unit(at.with_y(2.4)).as_vec3();
        both.crossings(&ray, &mut hits);
        let below = hits.iter().filter(|hit| hit.t < met.t + 1e-4).count();
        assert_eq!(below, 1);
        if expected == "lamp" {
            assert!(lamp.clone().any(|face| (card.coverage_at(face, position) - 1.0).abs() < 1.0));
            cut_out += 1;
        }
    }
    assert!((50..850).contains(&cut_out), "{cut_out}");
    let emitted = |face: u32| card.means_of_face(face).coverage * card.area(face);
    let shares: Vec<f64> = (0..card.faces.len() as u32).filter(|&f| card.material(f).emits()).map(emitted).collect();
    let share = shares.iter().sum::<f64>() * SCALE * SCALE / 0.48;
    // Means of masked faces are taken over some hundred points each, and these over 900: texels are cut at their edges.
    assert!((share - f64::from(cut_out) / 900.0).abs() < 0.05, "{share} {cut_out}");
}

/// Of a two-sided face the back is not there where the front of another lies on it, which rays meet first.
#[test]
fn a_back_behind_a_front_is_not_there() {
    let sheet = "v 1 1 2\nv 2 1 2\nv 2 2 2\nv 1 2 2\no sheet\nusemtl red\nf -4 -3 -2 -1\n";
    let behind = "v 1 1 2\nv 1.5 1 2\nv 1.5 2 2\nv 1 2 2\no behind\nusemtl white\nf -1 -2 -3 -4\n";
    let toml = "obj = 'room.obj'\n[materials.red]\ntwo_sided = true\n";
    let materials: String =
        MATERIALS.lines().filter(|line| !line.starts_with("map_d")).map(|l| format!("{l}\n")).collect();
    let obj = format!("{ROOM}{sheet}{behind}");
    let scene = Scene::from_toml_text("room", toml, &obj, &materials, LoadOptions::default()).expect("a correct scene");
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let area = |sides: Sides| {
        let own = (0..scene.faces.len() as u32).filter(|&f| scene.material(f).name == "red");
        own.filter(|&f| scene.material(f).sides == sides).map(|f| scene.area(f)).sum::<f64>() * SCALE * SCALE
    };
    assert!((area(Sides::One) - 0.5).abs() < 1e-6 && (area(Sides::Two) - 0.5).abs() < 1e-6);
    // A square that lies in one place with the other half is seen from both sides once.
    let found = table(&scene, 1e-4);
    for row in &found.rows {
        assert!((row.sum.value - 1.0).abs() <= 4.0 * row.sum.error + 1e-9, "{}: {:?}", row.name, row.sum);
    }
}
