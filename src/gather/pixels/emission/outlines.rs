//! Light as emitted in pixels that show outlines of emitters: by areas ([`visible_emission`]), and by rays where those
//! do not tell.
//!
//! ```text
//! E(pixel) = sum over emitting faces f of  a_f * mean over rays aimed at f of E_f s     +     mean over rays of all
//! other E
//! ```
//!
//! a_f is the area of the face's projection within the pixel, exact, and s the share of its light that reaches the
//! camera: 0 behind something, 1 where it is seen, between through panes. All other emission, as of the sky and of
//! emitters with holes, is the mean over one pair of rays in each of m² cells, whose differences are its variance. What
//! rays aimed at a face agree about counts as wrong by the share that they are likely to have missed.
//!
//! Pixels get four times the rays in the order of what that gains, until the noise of the emission that the picture
//! shows is as requested.
//!
//! Not handled: what neither a projected face nor a camera ray shows, as thin things before a sky; what the emitters'
//! surfaces reflect, and what is reflected beside them.

use glam::{DVec2, DVec3, Vec2};
use halflight_team::Loop;
use rayon::prelude::*;

use crate::direct::agreement::LikelyShare;
use crate::gather::pixels::camera_rays::CameraRays;
use crate::gather::pixels::emission::visible_areas::{cell_behind, emitting, visible_emission};
use crate::gather::pixels::pixel::{Pixel, rays};
use crate::gather::pixels::pixel_light::SeenEmission;
use crate::gather::pixels::projection::{ProjectedFace, Projection, in_pixel, is_nothing};
use crate::gather::pixels::window::window;
use crate::gather::sampling::Limit;
use crate::light::budget::OUTLINES;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Stream, hash};
use crate::rays::warp::triangle_point;
use crate::scene::convex_polygon::area;

/// Rays of a pixel at first and at most, each in half as many cells; a quarter as many are aimed at each face.
const FIRST: u32 = 32;
const MOST: u32 = 1 << 13;
/// The variance that four times as many rays leave where an edge passes through cells: of those that it crosses there
/// are twice as many, each with a 16th (M. Pharr et al., *Physically Based Rendering*, 4th edition, 8.1).
const LEFT: f64 = 0.125;
/// What outlines may keep at least that are found late, as a share of what all may keep, of which those found before
/// may have used more.
const LATE: f64 = 0.25;
/// Share of an emission by which it may differ from what camera rays show: that of rounding.
const SHOWN: f64 = 1e-9;
/// Share of a pixel from which on emitting faces cover all of it.
const WHOLE: f64 = 1.0 - 1e-6;
/// Cells to a side of a pixel that a ray stands for, where faces have holes.
const CELLS: u32 = 8;

/// A part of an emitting face in a pixel: its projection from the pixel's corner.
struct Part {
    face: u32,
    polygon: Vec<DVec2>,
}

/// Some rays of a pixel.
struct Aim<'a> {
    /// The place within the pixel that belongs to a point of the unit square.
    place: &'a dyn Fn(Vec2) -> Vec2,
    /// Whether the emission of a face counts.
    counts: &'a dyn Fn(u32) -> bool,
    /// The share of the pixel that all these places are.
    share: f64,
    /// The emission that rays which all agree may be wrong about.
    doubted: DVec3,
    rays: u32,
}

/// A pixel with an outline, and the rays it has.
struct Outlined {
    pixel: usize,
    parts: Vec<Part>,
    rays: u32,
    found: Sampled,
}

/// What rays found of the emission of a pixel.
#[derive(Default)]
pub(crate) struct Sampled {
    pub seen: SeenEmission,
    /// Rays cast.
    pub rays: u64,
}

/// The pixels whose light as emitted is measured.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Which {
    /// All that projections of emitting faces lie in, and those that differ.
    All,
    /// Those whose camera rays disagree.
    Differing,
}

/// Measures the emission of all pixels that show the outline of an emitter, or whose camera rays disagree about it, but
/// for those that were measured before, until its noise is such a share of its RMS, and of that of reflected light, or
/// the limit is reached.
pub(crate) fn measure_outlines(
    camera_rays: &CameraRays,
    pixels: &mut [Pixel],
    which: Which,
    noise: f64,
    limit: &Limit,
) {
    let mut outlined = outlined(camera_rays, pixels, which);
    let mut due: Vec<usize> = (0..outlined.len()).collect();
    while !due.is_empty() && !limit.is_over(rays(pixels)) {
        let one = |i: usize| camera_rays.emission(&outlined[due[i]]);
        let found = Loop::weighed(due.len(), |i| f64::from(outlined[due[i]].rays)).map(one);
        for (&i, found) in due.iter().zip(found) {
            pixels[outlined[i].pixel].met.rays += found.rays;
            outlined[i].found = found;
        }
        due = next(&outlined, pixels, noise);
        due.iter().for_each(|&i| outlined[i].rays *= 4);
    }
    for Outlined { pixel, found, .. } in outlined.into_iter().filter(|own| own.found.rays > 0) {
        pixels[pixel].light.outline = Some(Box::new(found.seen));
    }
}

/// The pixels to get more rays: those that lose most variance for a ray, until the noise is predicted to be as
/// requested.
fn next(outlined: &[Outlined], pixels: &[Pixel], noise: f64) -> Vec<usize> {
    let others = pixels.iter().map(|pixel| pixel.mean_emission().length_squared()).sum::<f64>();
    let differs =
        |own: &Outlined| own.found.seen.value.length_squared() - pixels[own.pixel].mean_emission().length_squared();
    let signal = others + outlined.iter().map(differs).sum::<f64>();
    let variance = |own: &Outlined| own.found.seen.variance.element_sum();
    // Slivers of what is bright show beside what is reflected, of whose error they are to be a small part.
    let reflected = pixels.iter().map(|pixel| pixel.weight() * pixel.reflected().length_squared()).sum::<f64>();
    let signal = if reflected > 0.0 { signal.min(reflected) } else { signal };
    let all = OUTLINES * noise * noise * signal;
    let before: f64 = pixels.iter().map(|pixel| pixel.outline_variance().element_sum()).sum();
    let goal = (all - before).max(LATE * all);
    let mut left = outlined.iter().map(variance).sum::<f64>();
    let mut order: Vec<usize> =
        (0..outlined.len()).filter(|&i| outlined[i].rays < MOST && variance(&outlined[i]) > 0.0).collect();
    let worth = |&i: &usize| variance(&outlined[i]) / f64::from(outlined[i].rays);
    order.sort_by(|a, b| worth(b).total_cmp(&worth(a)).then(a.cmp(b)));
    let needed = |&i: &usize| {
        let is_needed = left > goal;
        left -= (1.0 - LEFT) * variance(&outlined[i]);
        is_needed
    };
    order.into_iter().take_while(needed).collect()
}

/// Gives pixels the emission that is known without rays, and finds those that need some: where emitting faces cover
/// only a part, or camera rays disagree.
fn outlined(camera_rays: &CameraRays, pixels: &mut [Pixel], which: Which) -> Vec<Outlined> {
    let view = camera_rays.view;
    let projection = Projection::new(view);
    let faces = emitting(&projection);
    let differs: Vec<bool> = pixels.iter().map(Pixel::emission_differs).collect();
    // Rays of a pixel may miss what its neighbours show.
    let near = |k: usize| window(k, 1, view.width, pixels.len());
    let differs: Vec<bool> = (0..pixels.len()).map(|k| near(k).any(|j| differs[j])).collect();
    let mut due = differs.clone();
    if which == Which::All {
        mark_emission(&projection, &faces, pixels, &mut due);
    }
    due.iter_mut().zip(&*pixels).for_each(|(due, pixel)| *due &= pixel.light.outline.is_none());
    let mut all = Vec::new();
    for (pixel, found) in visible_emission(camera_rays, &projection, &faces, &due) {
        match found {
            Some(found) if is_shown(&pixels[pixel], &found) => (),
            Some(found) => pixels[pixel].light.outline = Some(Box::new(found)),
            None => all.push(Outlined { pixel, parts: Vec::new(), rays: FIRST, found: Sampled::default() }),
        }
    }
    find_parts(&projection, &faces, &mut all);
    all.retain(|own| differs[own.pixel] || own.parts.iter().map(|part| area(&part.polygon)).sum::<f64>() < WHOLE);
    all
}

/// Marks the pixels in which faces emit, and those that show the sky where its cells meet, of which rays may show one.
fn mark_emission(projection: &Projection, faces: &[ProjectedFace], pixels: &[Pixel], marked: &mut [bool]) {
    faces.iter().for_each(|of| projection.pixels_under(&of.polygon, |k| marked[k] = true));
    if projection.view.scene.sky.is_some() {
        let is_border = |k: usize| pixels[k].met.emitting > 0 && cell_behind(projection.view, k).is_none();
        marked.par_iter_mut().enumerate().for_each(|(k, marked)| *marked |= is_border(k));
    }
}

/// Finds what of faces without holes lies in pixels, which are in order.
fn find_parts(projection: &Projection, faces: &[ProjectedFace], outlined: &mut [Outlined]) {
    for of in faces.iter().filter(|of| !projection.view.scene.is_masked(of.face)) {
        projection.pixels_under(&of.polygon, |k| {
            let Ok(place) = outlined.binary_search_by_key(&k, |own| own.pixel) else { return };
            let polygon = in_pixel(&of.polygon, k, projection.view.width);
            if !is_nothing(&polygon) {
                outlined[place].parts.push(Part { face: of.face, polygon });
            }
        });
    }
}

/// Whether the camera rays of a pixel show an emission as it is.
fn is_shown(pixel: &Pixel, emission: &SeenEmission) -> bool {
    let (shown, value) = (pixel.mean_emission(), emission.value);
    !pixel.emission_differs() && (shown - value).abs().max_element() <= SHOWN * value.max_element()
}

impl CameraRays<'_> {
    /// The emission of a pixel by its rays.
    fn emission(&self, of: &Outlined) -> Sampled {
        let mut random = Stream::new(hash(of.pixel as u32, hash(of.rays, Purpose::Outlines.seed(self.seed()))));
        let mut found = Sampled::default();
        for Part { face, polygon } in &of.parts {
            let place = |at: Vec2| point_of(polygon, at.x, at.y);
            let (share, doubted) = (area(polygon), self.view.scene.material(*face).emission.as_dvec3());
            let aim = Aim { place: &place, counts: &|own| own == *face, share, doubted, rays: of.rays / 4 };
            self.add_mean(of.pixel, &aim, &mut random, &mut found);
        }
        let is_other = |face: u32| of.parts.iter().all(|part| part.face != face);
        let doubted = DVec3::ZERO;
        let aim = Aim { place: &|at| at, counts: &is_other, share: 1.0, doubted, rays: of.rays };
        self.add_mean(of.pixel, &aim, &mut random, &mut found);
        found
    }

    /// Adds the mean of the emission that rays find, one pair of them in each of equal cells.
    fn add_mean(&self, pixel: usize, aim: &Aim, random: &mut Stream, found: &mut Sampled) {
        let side = f64::from(aim.rays / 2).sqrt() as u32;
        let rays = f64::from(2 * side * side);
        let weight = aim.share / rays;
        let (mut variance, mut sum, mut most) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        let (mut first, mut agree) = (None, true);
        for cell in 0..side * side {
            let corner = Vec2::new((cell % side) as f32, (cell / side) as f32);
            let one = |random: &mut Stream, found: &mut Sampled| {
                let at = (corner + Vec2::new(random.uniform(), random.uniform())) / side as f32;
                let mut sum = DVec3::ZERO;
                self.emission_at(pixel, (aim.place)(at), CELLS, |face, light| {
                    if (aim.counts)(face) {
                        sum += weight * light;
                        found.seen.add(self.emitter(face), weight * light);
                    }
                });
                sum
            };
            let pair = [one(random, found), one(random, found)];
            variance += (pair[0] - pair[1]) * (pair[0] - pair[1]);
            (sum, most) = (sum + pair[0] + pair[1], most.max(pair[0]).max(pair[1]));
            let first = *first.get_or_insert(pair[0]);
            agree &= pair == [first; 2];
        }
        if agree {
            // Agreement is no proof.
            let missed = aim.share * LikelyShare::of(rays, 0.0).deviation() * aim.doubted;
            found.seen.variance += missed * missed;
        } else {
            // Pairs in few cells may agree about an edge that passes between them: of n rays that see a share s, well
            // spread, s (1 - s) n^-3/2.
            let whole = rays * most;
            let least = (sum * (whole - sum)).max(DVec3::ZERO) * rays.powf(-1.5);
            found.seen.variance += variance.max(least);
        }
        found.rays += u64::from(2 * side * side);
    }
}

/// The point of a convex polygon that belongs to a point of the unit square, uniform in area.
fn point_of(polygon: &[DVec2], u: f32, v: f32) -> Vec2 {
    let fan = || polygon[1..].windows(2).map(|e| [polygon[0], e[0], e[1]]);
    let all: f64 = fan().map(|t| area(&t).abs()).sum();
    let mut left = f64::from(u) * all;
    let mut chosen = (polygon[0], polygon[0], polygon[0], 0.0);
    for t in fan() {
        let own = area(&t).abs();
        chosen = (t[0], t[1], t[2], (left / own.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0));
        if left < own {
            break;
        }
        left -= own;
    }
    let corners = [chosen.0, chosen.1, chosen.2].map(|p| p.extend(0.0).as_vec3());
    triangle_point(corners, (chosen.3 as f32).min(1.0 - 0.5 * f32::EPSILON), v).truncate()
}
