//! Audits of pictures by the path tracer, which knows its own noise and shares scene and rays with them alone.

use halflight::light::{Mode, Rgb, Transport};
use halflight::pictures::Picture;
use halflight::rays::Rays;
use halflight::render::Silent;
use halflight::scene::{LoadOptions, Scene};
use halflight_audit::{AuditError, AuditGoal, Verdict, audit, verdict};
use halflight_reference::{TraceSettings, Tracer};

use crate::{assert_standard_normal, global, score, told};

const SIZE: (usize, usize) = (24, 20);

/// A traced picture, and the squared relative noise that it has over the pixels of a mask.
fn traced(scene: &Scene, transport: Transport, samples: u32, seed: u32) -> (Picture, Picture) {
    let rays = Rays::new(scene);
    let settings = TraceSettings { seed, ..TraceSettings::default() };
    let mut tracer = Tracer::new(scene, &rays, &scene.transports(transport), SIZE, &settings);
    tracer.pass(samples);
    (tracer.picture(), tracer.standard_error().expect("samples"))
}

/// Sums over what an audit counted: of squared light less noise, of noise squared, of light and of its variance.
fn sums(mask: &Picture, picture: &Picture, noise: &Picture) -> [f64; 4] {
    let counted = (0..mask.pixels.len()).filter(|&k| mask.pixels[k] == Rgb::ONE);
    counted.fold([0.0; 4], |[power, squared, light, variance], k| {
        let (p, e) = (picture.pixels[k].as_dvec3(), noise.pixels[k].as_dvec3());
        let noise = e.length_squared();
        // Channels may vary together, so that their standard errors add up.
        let of_sum = e.element_sum().powi(2);
        [power + p.length_squared() - noise, squared + noise, light + p.element_sum(), variance + of_sum]
    })
}

/// In every scene and mode, lamps, skies, beams, textures, masks and highlights: what paths find here and there has the
/// same mean.
#[test]
fn the_path_tracer_is_off_by_its_noise_and_not_in_the_mean() {
    let between = Transport { alpha: 0.6, tau: 0.4 };
    let modes = [Mode::Global, Mode::OneBounce, Mode::Local].map(Mode::transport);
    let mut scores = Vec::new();
    for name in ["cornell-box", "two-rooms", "gallery", "furnished-room"] {
        let scene = Scene::open(name).expect("a built-in scene");
        for transport in modes.into_iter().chain([between]) {
            let (picture, noise) = traced(&scene, transport, 64, 5);
            let own = told(&scene, transport, &picture, 0.15, 7);
            let [power, squared, light, variance] = sums(&own.mask, &picture, &noise);
            let mean = own.mean.total;
            let spread = (mean.standard_error.powi(2) + variance / (light * light)).sqrt();
            scores.push(mean.value / spread);
            // The tracer's own noise is known from its samples to some part of itself.
            let (value, truth) = (own.error.squared.value, squared / power);
            let known = 3.0 * own.error.squared.standard_error + 0.35 * truth;
            assert!((value - truth).abs() < known, "{name} {transport:?}: {value} {truth} {:?}", own.error);
        }
    }
    assert_standard_normal(&scores, 0.5);
}

#[test]
fn scenes_from_files_with_all_kinds_of_light_have_the_same_mean() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data");
    let mut scores = Vec::new();
    for (file, highlights) in FILES {
        let options = LoadOptions { highlights, ..LoadOptions::default() };
        let scene = Scene::open_with(folder.join(file).to_str().expect("a path"), options).expect("a scene");
        let transport = scene.transport.unwrap_or(Mode::Global.transport());
        let (picture, noise) = traced(&scene, transport, 64, 5);
        let own = told(&scene, transport, &picture, 0.15, 7);
        let [_, _, light, variance] = sums(&own.mask, &picture, &noise);
        let spread = (own.mean.total.standard_error.powi(2) + variance / (light * light)).sqrt();
        scores.push(own.mean.total.value / spread);
    }
    assert_standard_normal(&scores, 0.5);
}

/// Against a picture by many more paths: the errors of one that is off in places, over many seeds.
#[test]
fn scores_are_standard_normal_in_a_room_with_a_lamp() {
    let (scene, mode) = global("cornell-box");
    let (truth, noise) = traced(&scene, mode, 4096, 1);
    let bent = |x: usize, y: usize| truth.pixels[y * SIZE.0 + x] * if x < 9 { 1.12 } else { 0.95 };
    let picture = Picture::from_fn(SIZE.0, SIZE.1, bent);
    let all: Vec<_> = (0..24).map(|seed| told(&scene, mode, &picture, 0.15, seed)).collect();
    let mask = &all[0].mask;
    let [power, own_noise, ..] = sums(mask, &truth, &noise);
    let counted = || (0..mask.pixels.len()).filter(|&k| mask.pixels[k] == Rgb::ONE);
    let apart = |k: usize| (picture.pixels[k] - truth.pixels[k]).as_dvec3().length_squared();
    // The picture was made of the reference, whose noise is in it and not in the scene.
    let expected = counted().map(apart).sum::<f64>() / power + own_noise / power;
    assert!(own_noise / power < 0.1 * expected, "{own_noise} {power} {expected}");
    let scores: Vec<f64> = all.iter().map(|own| score(own.error.squared, expected)).collect();
    assert_standard_normal(&scores, 0.35);
}

#[test]
fn an_audit_repeats_on_any_number_of_threads() {
    let (scene, mode) = global("two-rooms");
    let (picture, _) = traced(&scene, mode, 4, 5);
    let found = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| told(&scene, mode, &picture, 0.3, 2))
    });
    assert!(found[0].error == found[1].error && found[0].mean == found[1].mean);
    assert!(found[0].estimate == found[1].estimate && found[0].signed == found[1].signed);
}

#[test]
fn an_audit_ends_where_it_is_certain_of_what_was_asked() {
    let (scene, mode) = global("cornell-box");
    let (picture, _) = traced(&scene, mode, 4, 5);
    let of = |most: f64| {
        let goal = AuditGoal { at_most: Some(most), ..AuditGoal::default() };
        let own = audit(&scene, mode, &picture, &goal, &Silent).expect("an audit");
        assert!(own.met);
        (verdict(&own.error, most), own.samples)
    };
    let error = told(&scene, mode, &picture, 0.05, 1).error.relative().value;
    assert_eq!(of(0.5 * error).0, Verdict::Above);
    assert_eq!(of(1.5 * error).0, Verdict::Within);
    assert!(of(1.1 * error).1 > of(2.0 * error).1);
}

#[test]
fn what_is_no_picture_is_refused() {
    let (scene, mode) = global("cornell-box");
    let refused = |scene: &Scene, mode: Transport, picture: Picture| {
        audit(scene, mode, &picture, &AuditGoal::default(), &Silent).expect_err("no audit")
    };
    let mut hole = Picture::filled(4, 4, Rgb::ONE);
    hole.pixels[6].y = f32::NAN;
    assert!(matches!(refused(&scene, mode, hole), AuditError::NotFinite { x: 2, y: 1, .. }));
    assert!(matches!(refused(&scene, mode, Picture::new(0, 4)), AuditError::Empty));
    let mut dark = scene.clone();
    dark.materials.iter_mut().for_each(|material| material.emission = Rgb::ZERO);
    assert!(matches!(refused(&dark, mode, Picture::filled(4, 4, Rgb::ONE)), AuditError::Dark { .. }));
    // Shadowless light diverges in the furnished room.
    let (room, shadowless) = (global("furnished-room").0, Mode::Shadowless.transport());
    assert!(matches!(refused(&room, shadowless, Picture::filled(2, 2, Rgb::ONE)), AuditError::Endless));
}

/// Scenes under `tests/data`, and whether they show highlights.
const FILES: [(&str, bool); 7] = [
    ("sunbeam/sunbeam.toml", false),
    ("hybrid/hybrid.toml", true),
    ("textured/room.toml", false),
    ("files/gltf-lights/both.toml", false),
    ("files/opacity/map-128-wall.toml", false),
    ("files/opacity/pane-50-sky.toml", false),
    ("hard/louvres/louvres.toml", false),
];
