//! Light as emitted in pixels that show outlines of emitters: how much of a pixel each emitting face covers.
//!
//! ```text
//! E(pixel) = sum over emitting faces f of  a_f * mean over rays aimed at f of E_f s     +     mean over rays of all
//! other E
//! ```
//!
//! a_f is the area of the face's projection within the pixel, exact, and s the share of its light that reaches the
//! camera: 0 behind something, 1 where it is seen, between through panes. Where a face is seen whole or not at all
//! there is no noise, however thin its sliver is; camera rays of a pixel meet thin ones by luck. All other emission, as
//! of the sky and of emitters with holes, is the mean over one pair of rays in each of m² cells, whose differences are
//! its variance.
//!
//! Where n rays agree in each of k pixels, they missed about as much as was seen by one ray alone in f other pixels:
//! 1/n of a pixel for each of those and for one more, not of each of the k (Good, 1953). So the variance of what rays
//! agree about is that of a pixel alone times `(f + 1) / k`, at most 1. Worth: a window deep in a wall before a bright
//! panel out of view, 5 %: 4.6 to 4.9 % stated and 1.0 CPU s, 8.9 % and 1.5 with a doubt for each pixel
//! (`tests/data/hard/reveals`).
//!
//! Pixels get four times the rays in the order of what that gains, until the noise of the emission that the picture
//! shows is as requested.
//!
//! Not handled: what neither a projected edge nor a camera ray shows; faces that reach behind the camera, which are
//! left to rays; what the emitters' surfaces reflect, and what is reflected beside them.

use glam::{DVec2, DVec3, Vec2};
use halflight_team::Loop;
use rustc_hash::FxHashSet;

use crate::direct::agreement::LikelyShare;
use crate::gather::pixels::camera_rays::CameraRays;
use crate::gather::pixels::pixel::{Pixel, rays};
use crate::gather::pixels::pixel_light::SeenEmission;
use crate::gather::pixels::projection::{Projection, within};
use crate::gather::pixels::window::window;
use crate::gather::sampling::Limit;
use crate::light::budget::OUTLINES;
use crate::rays::Side;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Stream, hash};
use crate::rays::warp::triangle_point;
use crate::reading::view::View;
use crate::scene::convex_polygon::area;
use crate::scene::{Bounds, Sides};

/// Rays of a pixel at first and at most, each in half as many cells; a quarter as many are aimed at each face.
const FIRST: u32 = 32;
const MOST: u32 = 1 << 13;
/// The variance that four times as many rays leave where an edge passes through cells: of those that it crosses there
/// are twice as many, each with a 16th (M. Pharr et al., *Physically Based Rendering*, 4th edition, 8.1).
const LEFT: f64 = 0.125;
/// What outlines may keep at least that are found late, as a share of what all may keep, of which those found before
/// may have used more.
const LATE: f64 = 0.25;
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
    found: SeenEmission,
}

/// Measures the emission of all pixels that show the outline of an emitter, or whose camera rays disagree about it, but
/// for those that were measured before, until its noise is such a share of its RMS, and of that of reflected light, or
/// the limit is reached.
pub(crate) fn measure_outlines(camera_rays: &CameraRays, pixels: &mut [Pixel], noise: f64, limit: &Limit) {
    let mut outlined = outlined(camera_rays, pixels);
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
    let missed = missed(&outlined);
    for mut own in outlined.into_iter().filter(|own| own.found.rays > 0) {
        own.found.variance += missed * own.found.doubt;
        pixels[own.pixel].light.outline = Some(Box::new(own.found));
    }
}

/// The share of the pixels in which rays agree about what may be emitted there that are taken to be wrong.
fn missed(outlined: &[Outlined]) -> f64 {
    let alike = outlined.iter().filter(|own| own.found.doubt != DVec3::ZERO).count();
    let alone = outlined.iter().filter(|own| own.found.is_rare).count();
    ((alone + 1) as f64 / alike.max(1) as f64).min(1.0)
}

/// The pixels to get more rays: those that lose most variance for a ray, until the noise is predicted to be as
/// requested.
fn next(outlined: &[Outlined], pixels: &[Pixel], noise: f64) -> Vec<usize> {
    let others = pixels.iter().map(|pixel| pixel.mean_emission().length_squared()).sum::<f64>();
    let differs =
        |own: &Outlined| own.found.value.length_squared() - pixels[own.pixel].mean_emission().length_squared();
    let signal = others + outlined.iter().map(differs).sum::<f64>();
    let missed = missed(outlined);
    let variance = |own: &Outlined| (own.found.variance + missed * own.found.doubt).element_sum();
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

/// The pixels that show outlines, in order.
fn outlined(camera_rays: &CameraRays, pixels: &[Pixel]) -> Vec<Outlined> {
    let view = camera_rays.view;
    let projection = Projection::new(view);
    let emits = |face: &u32| {
        let material = view.scene.material(*face);
        material.emits() && material.maps.as_ref().is_none_or(|maps| maps.mask.is_none())
    };
    let faces: Vec<(u32, [DVec2; 3])> = (0..view.scene.solid_faces())
        .filter(emits)
        .filter(|&face| is_seen_from(view, face))
        .filter_map(|face| Some((face, projection.face(face)?)))
        .collect();
    // Rays of a pixel may miss what its neighbours show.
    let mut shows = beside(&pixels.iter().map(Pixel::emission_differs).collect::<Vec<_>>(), view.width);
    for edge in outlines(view, &faces) {
        projection.pixels_along(edge, |k| shows[k] = true);
    }
    shows.iter_mut().zip(pixels).for_each(|(shows, pixel)| *shows &= pixel.light.outline.is_none());
    let mut places = vec![usize::MAX; pixels.len()];
    let mut all = Vec::new();
    for pixel in (0..pixels.len()).filter(|&k| shows[k]) {
        places[pixel] = all.len();
        all.push(Outlined { pixel, parts: Vec::new(), rays: FIRST, found: SeenEmission::default() });
    }
    for (face, polygon) in faces {
        for pixel in projection.pixels_in(&Bounds::of(polygon)).filter(|&k| shows[k]) {
            let corner = DVec2::new((pixel % view.width) as f64, (pixel / view.width) as f64);
            let polygon: Vec<DVec2> = within(&polygon, corner).into_iter().map(|p| p - corner).collect();
            if polygon.len() > 2 && area(&polygon) != 0.0 {
                all[places[pixel]].parts.push(Part { face, polygon });
            }
        }
    }
    all
}

/// The projected edges of faces across which no other face of the same material goes on with the same side in view.
fn outlines(view: &View, faces: &[(u32, [DVec2; 3])]) -> Vec<[DVec2; 2]> {
    const NEXT: [usize; 3] = [1, 2, 0];
    let of_face = |face: u32| {
        let (material, front) = (view.scene.faces[face as usize].material, shows_front(view, face));
        let bits = view.scene.corners(face).map(|corner| corner.to_array().map(f32::to_bits));
        move |from: usize, to: usize| (bits[from], bits[to], material, front)
    };
    let directed = |&(face, _): &(u32, [DVec2; 3])| {
        let edge = of_face(face);
        (0..3).map(move |k| edge(k, NEXT[k]))
    };
    let all: FxHashSet<_> = faces.iter().flat_map(directed).collect();
    let of_outline = |&(face, polygon): &(u32, [DVec2; 3])| {
        let (edge, all) = (of_face(face), &all);
        let ends = (0..3).filter(move |&k| !all.contains(&edge(NEXT[k], k)));
        ends.map(move |k| [polygon[k], polygon[NEXT[k]]])
    };
    faces.iter().flat_map(of_outline).collect()
}

/// The pixels that are marked, and those next to them.
fn beside(marked: &[bool], width: usize) -> Vec<bool> {
    let is_beside = |k: usize| window(k, 1, width, marked.len()).any(|j| marked[j]);
    (0..marked.len()).map(is_beside).collect()
}

/// Whether a side of a face that emits faces the camera.
fn is_seen_from(view: &View, face: u32) -> bool {
    view.scene.material(face).sides == Sides::Two || shows_front(view, face)
}

/// Whether the front of a face is towards the camera.
fn shows_front(view: &View, face: u32) -> bool {
    let to_eye = view.scene.camera.position - view.scene.corners(face)[0];
    view.patches.normal(face, Side::Front).dot(to_eye) > 0.0
}

impl CameraRays<'_> {
    /// The emission of a pixel by its rays.
    fn emission(&self, of: &Outlined) -> SeenEmission {
        let mut random = Stream::new(hash(of.pixel as u32, hash(of.rays, Purpose::Outlines.seed(self.seed()))));
        let mut found = SeenEmission::default();
        for Part { face, polygon } in &of.parts {
            let place = |at: Vec2| point_of(polygon, at.x, at.y);
            let (share, doubted) = (area(polygon).abs(), self.view.scene.material(*face).emission.as_dvec3());
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
    fn add_mean(&self, pixel: usize, aim: &Aim, random: &mut Stream, found: &mut SeenEmission) {
        let side = f64::from(aim.rays / 2).sqrt() as u32;
        let rays = f64::from(2 * side * side);
        let weight = aim.share / rays;
        let (mut variance, mut sum, mut most) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        let (mut first, mut agree) = (None, true);
        for cell in 0..side * side {
            let corner = Vec2::new((cell % side) as f32, (cell / side) as f32);
            let one = |random: &mut Stream, found: &mut SeenEmission| {
                let at = (corner + Vec2::new(random.uniform(), random.uniform())) / side as f32;
                let mut sum = DVec3::ZERO;
                self.emission_at(pixel, (aim.place)(at), CELLS, |face, light| {
                    if (aim.counts)(face) {
                        sum += weight * light;
                        found.add(self.emitter(face), weight * light);
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
            found.doubt += missed * missed;
        } else {
            // Pairs in few cells may agree about an edge that passes between them: of n rays that see a share s, well
            // spread, s (1 - s) n^-3/2.
            let whole = rays * most;
            let least = (sum * (whole - sum)).max(DVec3::ZERO) * rays.powf(-1.5);
            found.variance += variance.max(least);
            let other = sum.element_sum() / most.element_sum();
            found.is_rare |= other.min(rays - other) < 1.5;
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
