//! Warnings before and after pictures are made: black backs, a path tracer's infinite variance, a tolerance not met.
//!
//! Black backs are found by a grid of camera rays, and a ray from each place where one ends. Small path-traced pictures
//! estimate the mean radiance as it is, with both sides of those objects' faces reflecting, and with two sides to every
//! face, each with its standard error. What makes no difference is not advised, and not said where the camera sees no
//! back itself.
//!
//! Not handled: black backs where light passes through surfaces (tau above 0), of which no means are estimated.

use glam::Vec3;

use crate::console::Console;
use halflight::light::{Rgb, Transport};
use halflight::pictures::Size;
use halflight::rays::sobol::{fraction, hash};
use halflight::rays::warp::cosine_direction;
use halflight::rays::{Hit, Ray, Rays, Side};
use halflight::render::Rendered;
use halflight::scene::{Scene, Sides};
use halflight_reference::{Mean, TraceSettings, Tracer};
use halflight_study::map::{Growth, Variance, growth};

/// Share of rays that may meet black backs before it is worth a warning.
const BACKS: f64 = 0.01;
/// Camera rays along the longer side of the picture.
const GRID: usize = 64;
/// Paths of each pixel of a grid.
const SAMPLES: u32 = 16;
/// Objects that are named.
const NAMED: usize = 6;
/// Standard errors that two means differ by if they are not the same.
const APART: f64 = 4.0;

/// Digits behind the point of a mean, at most.
const MOST_DIGITS: f64 = 12.0;

/// What the pictures of a run show.
pub struct Pictured<'a> {
    pub scene: &'a Scene,
    pub rays: &'a Rays,
    pub size: Size,
    /// (alpha, tau) of each picture.
    pub transports: &'a [Transport],
}

/// Black backs that rays meet.
struct Backs {
    /// Share of the rays.
    share: f64,
    /// How many of them meet those of each object.
    counts: Vec<usize>,
}

/// Warns if more than a hundredth of the camera's rays, or of those from where they end, meet black backs; `shares` are
/// those of the pictures' camera rays, which differ by the backs behind others: the largest is said.
pub fn warn_of_backs(console: &Console, pictured: &Pictured, shares: impl Iterator<Item = f64>) {
    if !console.warns() {
        return;
    }
    let Pictured { scene, rays, .. } = pictured;
    let size = grid(pictured.size);
    let [mut seen, further] = met(scene, rays, size);
    seen.share = shares.fold(0.0, f64::max);
    let is_seen = seen.share > BACKS;
    let backs = if is_seen { seen } else { further };
    if backs.share <= BACKS {
        return;
    }
    let means = Means::new(pictured, size, &backs);
    let advice = match &means {
        Some(means) if means.differ() => means.words(),
        Some(_) if !is_seen => return,
        Some(means) => format!("the picture is as bright in the mean ({}) if they reflect there", show(&means.own)),
        None if is_seen => {
            "turn these faces, or give their material two sides (`two_sided = true` in a scene file)".into()
        }
        None => return,
    };
    let which = if is_seen { "the camera's rays" } else { "the rays from what the camera sees" };
    let share = 100.0 * backs.share;
    console.warn(format!(
        "{share:.1} % of {which} meet the black backs of one-sided faces, of {}: {advice}",
        backs.names(scene)
    ));
}

/// A grid of the picture's shape.
fn grid(Size { width, height }: Size) -> Size {
    let longer = width.max(height).max(1);
    let side = |n: usize| (n * GRID).div_ceil(longer).max(1);
    Size { width: side(width), height: side(height) }
}

/// The black backs that a grid of camera rays meets, and those that rays from there meet.
fn met(scene: &Scene, rays: &Rays, Size { width, height }: Size) -> [Backs; 2] {
    let mut found = [(); 2].map(|()| Backs { share: 0.0, counts: vec![0; scene.objects.len()] });
    let mut cast = [0usize; 2];
    for k in 0..width * height {
        let (x, y) = ((k % width) as f32 + 0.5, (k / width) as f32 + 0.5);
        let (origin, direction) = scene.camera.ray(x / width as f32, y / height as f32, width as f32 / height as f32);
        let mut ray = Ray { origin, direction, source: None };
        for (backs, cast) in found.iter_mut().zip(&mut cast) {
            *cast += 1;
            let Some(hit) = rays.closest(&ray).filter(|hit| !scene.is_sky(hit.face)) else { break };
            if is_black(scene, &hit) {
                backs.counts[scene.faces[hit.face as usize].object as usize] += 1;
                break;
            }
            ray = from(scene, &ray, &hit, k as u32);
        }
    }
    for (backs, cast) in found.iter_mut().zip(cast) {
        backs.share = backs.counts.iter().sum::<usize>() as f64 / cast.max(1) as f64;
    }
    found
}

/// A cosine-distributed ray from where another ends, on its side.
fn from(scene: &Scene, ray: &Ray, hit: &Hit, k: u32) -> Ray {
    let [a, b, c] = scene.exact_corners(hit.face);
    let front: Vec3 = (b - a).cross(c - a).normalize().as_vec3();
    let normal = if hit.side == Side::Front { front } else { -front };
    let [u, v] = [1, 2].map(|axis| fraction(hash(k, axis)));
    Ray { origin: ray.at(hit.t), direction: cosine_direction(normal, u, v), source: Some(hit.face) }
}

/// Whether a ray ends at a back that is black though the front reflects.
fn is_black(scene: &Scene, hit: &Hit) -> bool {
    hit.side == Side::Back && reflects_in_front(scene, hit.face)
}

fn reflects_in_front(scene: &Scene, face: u32) -> bool {
    let material = scene.material(face);
    !scene.is_sky(face) && material.sides == Sides::One && material.rho != Rgb::ZERO
}

impl Backs {
    /// The objects, the most seen first.
    fn names(&self, scene: &Scene) -> String {
        let mut order: Vec<usize> = (0..self.counts.len()).filter(|&object| self.counts[object] > 0).collect();
        order.sort_by_key(|&object| std::cmp::Reverse(self.counts[object]));
        let names: Vec<&str> = order.iter().take(NAMED).map(|&object| scene.objects[object].as_str()).collect();
        let more = order.len().saturating_sub(NAMED);
        if more == 0 { names.join(", ") } else { format!("{} and {more} more", names.join(", ")) }
    }
}

/// Mean radiance of a small picture of one mode.
struct Means {
    mode: String,
    own: Mean,
    /// With both sides of the objects seen from behind reflecting.
    turned: Mean,
    /// With two sides to every face.
    all: Mean,
}

impl Means {
    /// Of the first mode without light that passes through surfaces; none where there is none, or light overflows.
    fn new(pictured: &Pictured, size: Size, backs: &Backs) -> Option<Means> {
        let &Pictured { scene, rays, transports, .. } = pictured;
        let is_opaque = |mode: &&Transport| scene.transports(**mode).iter().all(|own| own.tau == 0.0);
        let mode = *transports.iter().find(is_opaque)?;
        let behind = |face: u32| backs.counts[scene.faces[face as usize].object as usize] > 0;
        let turned = with_both_sides(scene, |face| behind(face) && reflects_in_front(scene, face));
        let all = with_both_sides(scene, |face| !scene.is_sky(face));
        let of = |scene: &Scene| mean(scene, rays, mode, size);
        Some(Means { mode: mode.label(), own: of(scene)?, turned: of(&turned)?, all: of(&all)? })
    }

    fn differ(&self) -> bool {
        differ(&self.own, &self.turned) || differ(&self.own, &self.all)
    }

    fn words(&self) -> String {
        let Means { mode, own, turned, all } = self;
        let lamps = if differ(turned, all) { ", where everything else has two sides too" } else { "" };
        format!(
            "the mean radiance of {mode} is {}, and {} if they are turned or get two sides (`two_sided = true` for their \
             material in a scene file), {} with --two-sided{lamps}",
            show(own),
            show(turned),
            show(all),
        )
    }
}

/// The scene with two sides to the faces wanted.
fn with_both_sides(scene: &Scene, wanted: impl Fn(u32) -> bool) -> Scene {
    let mut turned = scene.clone();
    turned.materials.iter_mut().for_each(|material| material.sides = Sides::Two);
    // Materials as they were come after the two-sided ones, so that those of a sky are the last.
    turned.materials.extend(scene.materials.iter().cloned());
    for face in (0..scene.faces.len() as u32).filter(|&face| !wanted(face)) {
        turned.faces[face as usize].material += scene.materials.len() as u32;
    }
    turned
}

fn mean(scene: &Scene, rays: &Rays, mode: Transport, size: Size) -> Option<Mean> {
    let mut tracer = Tracer::new(scene, rays, &scene.transports(mode), size, &TraceSettings::default());
    tracer.pass(SAMPLES);
    tracer.check().ok().map(|()| tracer.mean())
}

fn differ(a: &Mean, b: &Mean) -> bool {
    (0..3).any(|c| (a.value[c] - b.value[c]).abs() > APART * a.error[c].hypot(b.error[c]))
}

/// The mean of the channels, and that of their standard errors, which is an upper limit of its own: to the first figure
/// of the error.
fn show(mean: &Mean) -> String {
    let of = |numbers: [f64; 3]| numbers.iter().sum::<f64>() / 3.0;
    let (value, error) = (of(mean.value), of(mean.error));
    let least = if error > 0.0 { error } else { value };
    let digits = if least > 0.0 { (-least.log10().floor()).clamp(0.0, MOST_DIGITS) as usize } else { 0 };
    format!("{value:.digits$} ± {error:.digits$}")
}

/// Looks at the variance of path tracing a mode, and warns where it is infinite or may be.
pub fn check_variance(console: &Console, scene: &Scene, rays: &Rays, transport: Transport, seed: u32) -> Growth {
    let found = growth(scene, rays, transport, seed);
    if let Some(words) = warning(&found) {
        console.warn(format!("{}: {words}", transport.label()));
    }
    found
}

fn warning(g: &Growth) -> Option<String> {
    let (mean, squares) = (g.mean?, g.squares?);
    let range = |low: f64, high: f64| format!("{low:.3} to {high:.3}");
    let radius = range(mean.lower, mean.upper);
    let growth = range(squares.lower, squares.upper);
    if g.diverges() {
        return Some(format!(
            "the series E + KE + K²E + … diverges (spectral radius of K {radius}), so a traced picture is its sum up to \
             --max-bounces and grows with that; `halflight bounces` shows the terms, smaller --alpha or --tau converge"
        ));
    }
    let instead = "`halflight render` solves L = E + K L without it; smaller --alpha or --tau tame it";
    match g.variance {
        Variance::Finite => None,
        Variance::Infinite => {
            let slower = match g.exponent {
                Some(x) => format!("about as N^-{x:.2}, not as N^-1/2"),
                None => "slower than N^-1/2".into(),
            };
            Some(format!(
                "the variance is infinite though the mean is not (spectral radius of K {radius}, of the squared weights \
                 of its paths {growth}), so with N samples the error falls {slower}, and reported standard errors are too small; \
                 {instead}"
            ))
        }
        Variance::Undecided => Some(format!(
            "the variance may be infinite (spectral radius of K {radius}, of the squared weights of its paths at most \
             about {:.3}, and 1 is the limit), so with N samples the error may fall slower than N^-1/2; {instead}",
            squares.upper,
        )),
    }
}

/// Warns where the estimated error is above the tolerance.
pub(crate) fn warn_of_error(console: &Console, transport: Transport, found: &Rendered, tolerance: f64) {
    if let Some(why) = found.unmet(tolerance) {
        console.warn(format!("{}: {why}", transport.label()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight::operator::Bounds;

    fn found(variance: Variance, mean: f64, squares: f64, exponent: Option<f64>) -> Growth {
        let around = |x: f64| Bounds { lower: x, upper: 1.001 * x };
        Growth { variance, mean: Some(around(mean)), squares: Some(around(squares)), exponent }
    }

    #[test]
    fn each_side_of_each_frontier_has_its_words() {
        assert_eq!(warning(&found(Variance::Finite, 0.5, 0.4, Some(0.5))), None);
        let words = |g| warning(&g).unwrap();
        let between = words(found(Variance::Infinite, 0.9, 1.3, Some(0.341)));
        assert!(between.contains("N^-0.34") && between.contains("render"));
        let near = words(found(Variance::Undecided, 0.8, 0.99, None));
        assert!(near.contains("may be infinite") && near.contains("0.991"));
        let beyond = words(found(Variance::Infinite, 1.2, 2.0, None));
        assert!(beyond.contains("diverges") && beyond.contains("--max-bounces"));
    }
}
