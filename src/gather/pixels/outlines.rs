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
//! Pixels get four times the rays in the order of what that gains, until the noise of the emission that the picture
//! shows is as requested.
//!
//! Not handled: what neither a projected edge nor a camera ray shows; faces that reach behind the camera, which are
//! left to rays; what the emitters' surfaces reflect, and what is reflected beside them.

use std::time::Instant;

use glam::{DVec2, DVec3, Vec2};
use halflight_team::{Loop, is_over};

use crate::gather::pixels::camera_rays::CameraRays;
use crate::gather::pixels::pixel::Pixel;
use crate::gather::pixels::pixel_light::SeenEmission;
use crate::gather::pixels::projection::{Projection, within};
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
/// The variance that four times as many rays leave.
const LEFT: f64 = 0.25;
/// Cells to a side of a pixel that a ray stands for, where faces have holes.
const CELLS: u32 = 8;

/// A part of an emitting face in a pixel: its projection from the pixel's corner.
struct Part {
    face: u32,
    polygon: Vec<DVec2>,
}

/// A pixel with an outline, and the rays it has.
struct Outlined {
    pixel: usize,
    parts: Vec<Part>,
    rays: u32,
    found: SeenEmission,
}

/// Measures the emission of all pixels that show the outline of an emitter, or whose camera rays disagree about it, until
/// its noise is such a share of its RMS, or the time is over.
pub(crate) fn measure_outlines(camera_rays: &CameraRays, pixels: &mut [Pixel], noise: f64, deadline: Option<Instant>) {
    let mut outlined = outlined(camera_rays, pixels);
    let mut due: Vec<usize> = (0..outlined.len()).collect();
    while !due.is_empty() && !is_over(deadline) {
        let one = |i: usize| camera_rays.emission(&outlined[due[i]]);
        let found = Loop::weighed(due.len(), |i| f64::from(outlined[due[i]].rays)).map(one);
        for (&i, found) in due.iter().zip(found) {
            pixels[outlined[i].pixel].met.rays += found.rays;
            outlined[i].found = found;
        }
        due = next(&outlined, pixels, noise);
        due.iter().for_each(|&i| outlined[i].rays *= 4);
    }
    for own in outlined.into_iter().filter(|own| own.found.rays > 0) {
        pixels[own.pixel].light.outline = Some(Box::new(own.found));
    }
}

/// The pixels to get more rays: those that lose most variance for a ray, until the noise is predicted to be as
/// requested.
fn next(outlined: &[Outlined], pixels: &[Pixel], noise: f64) -> Vec<usize> {
    let others = pixels.iter().map(|pixel| pixel.mean_emission().length_squared()).sum::<f64>();
    let differs =
        |own: &Outlined| own.found.value.length_squared() - pixels[own.pixel].mean_emission().length_squared();
    let signal = others + outlined.iter().map(differs).sum::<f64>();
    let variance = |own: &Outlined| own.found.variance.element_sum();
    let (goal, mut left) = (noise * noise * signal, outlined.iter().map(variance).sum::<f64>());
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
    let mut shows: Vec<bool> = pixels.iter().map(Pixel::emission_differs).collect();
    for (_, [a, b, c]) in &faces {
        for edge in [[a, b], [b, c], [c, a]] {
            projection.pixels_along(edge.map(|p| *p), |k| shows[k] = true);
        }
    }
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

/// Whether a side of a face that emits faces the camera.
fn is_seen_from(view: &View, face: u32) -> bool {
    let to_eye = view.scene.camera.position - view.scene.corners(face)[0];
    view.scene.material(face).sides == Sides::Two || view.patches.normal(face, Side::Front).dot(to_eye) > 0.0
}

impl CameraRays<'_> {
    /// The emission of a pixel by its rays.
    fn emission(&self, of: &Outlined) -> SeenEmission {
        let mut random = Stream::new(hash(of.pixel as u32, hash(of.rays, Purpose::Outlines.seed(self.seed()))));
        let mut found = SeenEmission::default();
        for part in &of.parts {
            self.add_part(of, part, &mut random, &mut found);
        }
        let side = f64::from(of.rays / 2).sqrt() as u32;
        let aimed = |face: u32| of.parts.iter().any(|part| part.face == face);
        let weight = 1.0 / f64::from(side * side);
        for (i, j) in (0..side * side).map(|cell| (cell % side, cell / side)) {
            let mut at =
                || (Vec2::new(i as f32, j as f32) + Vec2::new(random.uniform(), random.uniform())) / side as f32;
            let pair = [at(), at()].map(|at| {
                let mut sum = DVec3::ZERO;
                self.emission_at(of.pixel, at, CELLS, |face, light| {
                    if !aimed(face) {
                        sum += light;
                        found.add(self.emitter(face), 0.5 * weight * light);
                    }
                });
                sum
            });
            let half = 0.5 * (pair[0] - pair[1]) * weight;
            found.variance += half * half;
        }
        found.rays += u64::from(2 * side * side);
        found
    }

    /// Adds what a part of a face sends, by rays aimed at it.
    fn add_part(&self, of: &Outlined, part: &Part, random: &mut Stream, found: &mut SeenEmission) {
        let count = of.rays / 4;
        let (mut sum, mut squares) = (DVec3::ZERO, DVec3::ZERO);
        for k in 0..count {
            let at = point_of(&part.polygon, (k as f32 + random.uniform()) / count as f32, random.uniform());
            let mut light = DVec3::ZERO;
            self.emission_at(of.pixel, at, CELLS, |face, own| {
                if face == part.face {
                    light += own;
                }
            });
            sum += light;
            squares += light * light;
        }
        let (n, covered) = (f64::from(count), area(&part.polygon).abs());
        let spread = (squares / n - (sum / n) * (sum / n)).max(DVec3::ZERO);
        found.variance += covered * covered * spread / (n - 1.0);
        found.add(self.emitter(part.face), covered / n * sum);
        found.rays += u64::from(count);
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
