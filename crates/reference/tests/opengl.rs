//! Real OpenGL: closed forms of its lighting, with and without highlights, and its tiles. Built with the cargo feature
//! `opengl`; where the machine has no library the tests say that they are skipped, and why.
//!
//! Not handled: the local mode beside it, which figure 4 of the crate `study` compares.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use halflight::light::Gloss;
use halflight::pictures::{Picture, Size};
use halflight::scene::{Beam, Camera, Material, PunctualForm, PunctualLight, PunctualPlace, Scene};
use halflight_reference::opengl::{NoOpenGl, OpenGlPicture, render};

/// OpenGL's picture; none where there is no OpenGL.
fn drawn(scene: &Scene, size: impl Into<Size>, samples: u32) -> Option<OpenGlPicture> {
    match render(scene, size, samples) {
        Ok(found) => Some(found),
        Err(NoOpenGl::Missing(why)) => {
            eprintln!("skipped: this machine has no OpenGL ({why})");
            None
        }
        Err(other) => panic!("{other}"),
    }
}

/// A floor of 2 by 2 in unit coordinates, seen from an eye through a pixel of its middle.
fn floor(gloss: Option<Gloss>, lights: Vec<PunctualLight>) -> Scene {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (0.0, 0.0)];
    let corners = corners.map(|(x, y)| DVec3::new(x, y, 0.0));
    // The middle is a corner of four triangles: what is lit there is exact.
    let faces = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]].map(|f: [u32; 3]| (f.to_vec(), 0));
    let material = Material { gloss, ..Material::new("floor", Vec3::new(0.5, 0.25, 1.0), Vec3::ZERO) };
    let mut scene = Scene::from_faces("floor", &corners, &faces, vec![material]).expect("a scene");
    let position = Vec3::new(0.6, -1.2, 1.5);
    let forward = -position.normalize();
    let right = forward.cross(Vec3::Z).normalize();
    scene.camera = Camera { position, forward, right, up: right.cross(forward), vertical_fov: 1e-3 };
    scene.lights = lights;
    scene
}

#[test]
fn its_colours_are_the_closed_form() {
    let position = DVec3::new(-0.5, 0.4, 1.1);
    let place = PunctualPlace { position, attenuation: [0.3, 0.2, 0.7] };
    let direction = DVec3::new(0.2, -0.1, -1.0).normalize();
    let spot = PunctualForm::Point { place, beam: Beam::Spot { direction, exponent: 3.0, cutoff: 0.0 } };
    let d = position.length();
    let l = position / d;
    let weak = 0.3 + 0.2 * d + 0.7 * d * d;
    let cases = [
        (PunctualForm::even(place), l, 1.0 / weak),
        (spot, l, (-direction.dot(l)).powi(3) / weak),
        (PunctualForm::Directional { direction }, -direction, 1.0),
    ];
    for (form, l, falling) in cases {
        for gloss in [None, Some(Gloss { specular: Vec3::new(0.1, 0.2, 0.3), exponent: 12.0 })] {
            let scene = floor(
                gloss,
                vec![PunctualLight { form: form.clone(), intensity: Vec3::new(1.0, 0.8, 0.6), name: None }],
            );
            let Some(found) = drawn(&scene, (1, 1), 4) else { return };
            let h = (l + scene.camera.position.as_dvec3().normalize()).normalize();
            let specular = gloss.map_or(DVec3::ZERO, |g| g.specular.as_dvec3() * h.z.powf(f64::from(g.exponent)));
            let expected = (DVec3::new(0.5, 0.25, 1.0) * l.z + specular) * DVec3::new(1.0, 0.8, 0.6) * falling / PI;
            let apart = (found.picture.pixels[0].as_dvec3() - expected).abs().max_element();
            let allowed = if found.floating { 2e-5 } else { 2.5e-3 };
            assert!(apart < allowed, "{form:?} {gloss:?}: {} {expected}", found.picture.pixels[0]);
        }
    }
}

#[test]
fn what_it_has_not_is_refused() {
    let place = PunctualPlace { position: DVec3::Z, attenuation: [0.0, 0.0, 1.0] };
    let light = PunctualLight { form: PunctualForm::even(place), intensity: Vec3::ONE, name: None };
    let many = floor(None, vec![light.clone(); 9]);
    let sharp = floor(Some(Gloss { specular: Vec3::ONE, exponent: 500.0 }), vec![light]);
    for scene in [many, sharp] {
        match render(&scene, (1, 1), 1) {
            Err(NoOpenGl::Missing(why)) => eprintln!("skipped: this machine has no OpenGL ({why})"),
            Err(NoOpenGl::Unable(_)) => (),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn tiles_fit_together() {
    let mut scene = Scene::open("cornell-box").expect("a built-in scene");
    let place = PunctualPlace { position: DVec3::new(0.1, 0.3, 0.2), attenuation: [0.0, 0.0, 1.0] };
    scene.lights = vec![PunctualLight { form: PunctualForm::even(place), intensity: Vec3::splat(0.5), name: None }];
    // 128 by 128 samples a pixel: tiles of 32 pixels. A pixel of it is the mean of four of a picture twice as large.
    let size = Size { width: 40, height: 20 };
    let Some(whole) = drawn(&scene, size, 128 * 128) else { return };
    let twice = drawn(&scene, (80, 40), 64 * 64).expect("again").picture;
    let mean = Picture::from_fn(size.width, size.height, |x, y| {
        let at = |dx, dy| twice.get(2 * x + dx, 2 * y + dy).expect("a pixel");
        0.25 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1))
    });
    assert!(mean.pixels.iter().any(|p| p.max_element() > 0.05));
    for (a, b) in whole.picture.pixels.iter().zip(&mean.pixels) {
        assert!((*a - *b).abs().max_element() < 2e-3, "{a} {b}");
    }
}
