//! The warning of black backs: which objects the camera sees from behind, and what difference it would make if they
//! reflected there.
//!
//! A grid of camera rays finds the objects. Two small path-traced pictures tell the mean radiance as it is, and with both
//! sides of those objects' faces reflecting, each with its standard error. What both sides leave as it is is not advised.
//!
//! Not handled: what makes no picture for certain, light that passes through surfaces (tau above 0): no means are told.

use crate::cli::console::Console;
use crate::light::{Rgb, Transport};
use crate::pictures::Size;
use crate::rays::{Ray, Rays, Side};
use crate::reference::{Mean, TraceSettings, Tracer};
use crate::scene::{Scene, Sides};

/// Share of a picture's camera rays that may meet black backs before it is worth a warning.
const BACKS: f64 = 0.01;
/// Camera rays along the longer side of the picture.
const GRID: usize = 64;
/// Paths of each pixel of a grid.
const SAMPLES: u32 = 16;
/// Objects that are named.
const NAMED: usize = 6;
/// Standard errors that two means differ by if they are not the same.
const APART: f64 = 4.0;

/// What the pictures of a run show.
pub struct Shown<'a> {
    pub scene: &'a Scene,
    pub rays: &'a Rays,
    pub size: Size,
    /// (alpha, tau) of each picture.
    pub transports: &'a [Transport],
}

/// Warns if more of the camera's rays meet black backs than a hundredth; `shares` are those of the pictures, which differ
/// by the backs behind others: the largest is told.
pub fn warn_of_backs(console: &Console, shown: &Shown, shares: impl Iterator<Item = f64>) {
    let backs = shares.fold(0.0, f64::max);
    if backs <= BACKS {
        return;
    }
    let &Shown { scene, rays, transports, .. } = shown;
    let size = grid(shown.size);
    let (names, turned) = behind(scene, rays, size);
    let opaque = transports.iter().find(|mode| scene.transports(**mode).iter().all(|own| own.tau == 0.0));
    let means =
        opaque.and_then(|&mode| Some((mean(scene, rays, mode, size)?, mean(&turned, rays, mode, size)?, mode.label())));
    let advice = "--two-sided gives every face two sides, `two_sided = true` in a scene file those of one material; or \
                  turn these faces";
    let told = match means {
        None => advice.to_owned(),
        Some((own, both, _)) if !differ(&own, &both) => {
            let same = "the picture is as bright in the mean if they reflect on both sides";
            format!("{same} ({})", show(&own))
        }
        Some((own, both, mode)) => format!(
            "the mean radiance of {mode} is {}, and would be {} if they reflected on both sides: {advice}",
            show(&own),
            show(&both)
        ),
    };
    console.warn(format!(
        "{:.1} % of the camera's rays meet the black backs of one-sided faces, of {names}: {told}",
        100.0 * backs,
    ));
}

/// A grid of the picture's shape.
fn grid(Size { width, height }: Size) -> Size {
    let longer = width.max(height).max(1);
    let side = |n: usize| (n * GRID).div_ceil(longer).max(1);
    Size { width: side(width), height: side(height) }
}

/// The objects that the camera sees from behind, the largest in the picture first, and the scene with both sides of
/// their faces reflecting.
fn behind(scene: &Scene, rays: &Rays, Size { width, height }: Size) -> (String, Scene) {
    let mut counts = vec![0; scene.objects.len()];
    for k in 0..width * height {
        let (x, y) = ((k % width) as f32 + 0.5, (k / width) as f32 + 0.5);
        let (origin, direction) = scene.camera.ray(x / width as f32, y / height as f32, width as f32 / height as f32);
        let hit = rays.closest(&Ray { origin, direction, source: None });
        if let Some(hit) = hit.filter(|hit| hit.side == Side::Back && is_black_behind(scene, hit.face)) {
            counts[scene.faces[hit.face as usize].object as usize] += 1;
        }
    }
    let mut order: Vec<usize> = (0..counts.len()).filter(|&object| counts[object] > 0).collect();
    order.sort_by_key(|&object| std::cmp::Reverse(counts[object]));
    let names: Vec<&str> = order.iter().take(NAMED).map(|&object| scene.objects[object].as_str()).collect();
    let more = match order.len().saturating_sub(NAMED) {
        0 => String::new(),
        n => format!(" and {n} more"),
    };
    (format!("{}{more}", names.join(", ")), with_both_sides(scene, |object| counts[object as usize] > 0))
}

/// Whether a face is one that reflects in front and is black behind.
fn is_black_behind(scene: &Scene, face: u32) -> bool {
    let material = scene.material(face);
    !scene.is_sky(face) && material.sides == Sides::One && material.rho != Rgb::ZERO
}

/// The scene with two sides to the faces of some objects that reflect.
fn with_both_sides(scene: &Scene, wanted: impl Fn(u32) -> bool) -> Scene {
    let mut turned = scene.clone();
    turned.materials.iter_mut().for_each(|material| material.sides = Sides::Two);
    // Materials as they were come after the two-sided ones, so that those of a sky are the last.
    turned.materials.extend(scene.materials.iter().cloned());
    for face in 0..scene.faces.len() as u32 {
        let own = &mut turned.faces[face as usize];
        if !(wanted(own.object) && is_black_behind(scene, face)) {
            own.material += scene.materials.len() as u32;
        }
    }
    turned
}

/// The mean radiance of a small picture; none where light overflows.
fn mean(scene: &Scene, rays: &Rays, mode: Transport, size: Size) -> Option<Mean> {
    let mut tracer = Tracer::new(scene, rays, &scene.transports(mode), size, &TraceSettings::default());
    tracer.pass(SAMPLES);
    tracer.check().ok().map(|()| tracer.mean())
}

fn differ(a: &Mean, b: &Mean) -> bool {
    (0..3).any(|c| (a.value[c] - b.value[c]).abs() > APART * a.error[c].hypot(b.error[c]))
}

/// The mean of the channels and its standard error at most.
fn show(mean: &Mean) -> String {
    let of = |numbers: [f64; 3]| numbers.iter().sum::<f64>() / 3.0;
    format!("{:.3} ± {:.3}", of(mean.value), of(mean.error))
}
