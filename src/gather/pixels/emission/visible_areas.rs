//! Light as emitted in a pixel, exact: the projections of the faces that emit, less those of all that is nearer.
//!
//! ```text
//! E(pixel) = sum over emitting faces f of  E_f area(P_f without the union of all P_g where g is nearer than f)
//! ```
//!
//! P_f is the projection of f within the pixel, in pixels. The inverse of depth is linear over a projection, so that g
//! is nearer in the part of P_g on one side of a line, even where two faces pass through each other. A convex polygon
//! less another one is a convex piece beyond each edge of that. There is no noise, no ray is cast, and what is thin is
//! as exact as what is wide. A sky emits from all of the pixel behind everything. Source: E. Catmull, *A hidden-surface
//! algorithm with anti-aliasing*, SIGGRAPH 1978; K. Weiler, P. Atherton, *Hidden surface removal using polygon area
//! sorting*, SIGGRAPH 1977.
//!
//! Not handled, and left to rays ([`outlines`]): faces with holes or opacity, faces in one place but not in one plane,
//! several cells of a sky, textures that go far into the distance, and more than [`MOST`] faces in a pixel. Worth: at
//! 640×360 and 5 % a bathroom with windows takes 85 rays a pixel in place of 165, and a living room with light from
//! behind its windows 112 in place of 246 (docs/validation.md).
//!
//! [`outlines`]: crate::gather::pixels::emission::outlines

use std::sync::atomic::{AtomicU32, Ordering};

use glam::{DVec2, DVec3};
use halflight_team::Loop;
use rayon::prelude::*;

use crate::gather::pixels::camera_rays::CameraRays;
use crate::gather::pixels::pixel_light::SeenEmission;
use crate::gather::pixels::projection::{ProjectedFace, Projection, corner_of, in_pixel, is_nothing};
use crate::light::{Light, Rgb};
use crate::rays::Side;
use crate::reading::view::View;
use crate::scene::convex_polygon::{above, area, edges, parted};
use crate::scene::{Bounds, Sides};

/// Faces of a pixel at most, which bounds memory, and pieces of one.
const MOST: usize = 256;
/// Faces whose nearness differs by less than this share are in one place: positions have 24 bits.
const SAME: f64 = 1e-6;
/// Length of an edge that is none, as a share of the polygon's: its direction is known to a millionth where the polygon
/// is as large as a pixel.
const SHORT: f64 = 1e-7;
/// Nearness of a piece of a texture at most, as a multiple of the least there: a place shows in the picture by the cube
/// of it, and its mean is taken over the surface.
const EVEN: f64 = 1.02;

/// The pixels that may show light as emitted, and the faces in each that are not behind all that emits there.
struct Candidates {
    pixels: Vec<u32>,
    faces: Vec<ProjectedFace>,
    /// Pixel and place in `faces`, in order of that.
    pairs: Vec<(u32, u32)>,
    /// How many faces each pixel of the picture has; those with more than [`MOST`] are not in `pairs`.
    counts: Vec<AtomicU32>,
}

/// A face in a pixel: its projection from the pixel's corner.
struct Part<'a> {
    of: &'a ProjectedFace,
    polygon: Vec<DVec2>,
}

/// One pixel and the faces in it.
struct PixelFaces<'a> {
    camera_rays: &'a CameraRays<'a>,
    projection: &'a Projection<'a>,
    k: usize,
    parts: Vec<Part<'a>>,
}

/// The faces whose side towards the camera may emit; none of a map, which emits nothing.
pub(crate) fn emitting(projection: &Projection) -> Vec<ProjectedFace> {
    let view = projection.view;
    let faces = (0..view.scene.solid_faces()).into_par_iter().filter(|&face| view.scene.material(face).emits());
    faces.filter_map(|face| projection.part(face)).filter(|of| faces_camera(view, of)).collect()
}

/// Whether the camera sees a side of a face that may emit.
fn faces_camera(view: &View, of: &ProjectedFace) -> bool {
    of.side == Side::Front || view.scene.material(of.face).sides == Sides::Two
}

/// Light as emitted of each pixel that is due, by the faces that emit; none where rays are needed.
pub(crate) fn visible_emission(
    camera_rays: &CameraRays,
    projection: &Projection,
    emitting: &[ProjectedFace],
    due: &[bool],
) -> Vec<(usize, Option<SeenEmission>)> {
    let all = Candidates::new(projection, &least_nearness(projection, emitting, due));
    let one = |i: usize| all.of_pixel(i, camera_rays, projection).and_then(|own| own.emission());
    let found = Loop::each(all.pixels.len()).map(one);
    all.pixels.iter().map(|&k| k as usize).zip(found).collect()
}

/// The face of the sky that is behind all of a pixel; none where there are several, or no sky.
pub(crate) fn cell_behind(view: &View, k: usize) -> Option<u32> {
    let sky = view.scene.sky.as_ref()?;
    // Cells have bent edges.
    let mut all = (0..9).map(|n| [n % 3, n / 3].map(|at| 0.5 * at as f32)).map(|[u, v]| view.camera_ray(k, u, v));
    let first = sky.face(all.next()?.direction);
    all.all(|ray| sky.face(ray.direction) == first).then_some(first)
}

impl Candidates {
    /// Of the pixels for which a least nearness is given.
    fn new(projection: &Projection, least: &[f64]) -> Candidates {
        let faces = || {
            let all = (0..projection.view.scene.solid_faces()).into_par_iter();
            all.filter_map(|face| projection.part(face))
        };
        let counts: Vec<AtomicU32> = least.iter().map(|_| AtomicU32::new(0)).collect();
        let count = |k: usize| counts[k].load(Ordering::Relaxed) as usize;
        faces().for_each(|of| {
            each_pixel(projection, least, &of, |k| {
                counts[k].fetch_add(1, Ordering::Relaxed);
            });
        });
        let with_pixels = |of: ProjectedFace| {
            let mut own = Vec::new();
            each_pixel(projection, least, &of, |k| {
                if count(k) <= MOST {
                    own.push(k as u32);
                }
            });
            (!own.is_empty()).then_some((of, own))
        };
        let (faces, of_faces): (Vec<_>, Vec<_>) = faces().filter_map(with_pixels).unzip();
        let pairs = of_faces.iter().zip(0..).flat_map(|(own, face)| own.iter().map(move |&k| (k, face)));
        let mut pairs: Vec<(u32, u32)> = pairs.collect();
        pairs.par_sort_unstable();
        let pixels = (0..least.len() as u32).filter(|&k| !least[k as usize].is_nan()).collect();
        Candidates { pixels, faces, pairs, counts }
    }

    /// The faces in a pixel; none where they are too many.
    fn of_pixel<'a>(
        &'a self,
        i: usize,
        camera_rays: &'a CameraRays,
        projection: &'a Projection,
    ) -> Option<PixelFaces<'a>> {
        let k = self.pixels[i] as usize;
        if self.counts[k].load(Ordering::Relaxed) as usize > MOST {
            return None;
        }
        let part = |&(_, face): &(u32, u32)| {
            let of = &self.faces[face as usize];
            let polygon = in_pixel(&of.polygon, k, projection.view.width);
            (!is_nothing(&polygon)).then_some(Part { of, polygon })
        };
        let first = self.pairs.partition_point(|pair| (pair.0 as usize) < k);
        let own = self.pairs[first..].iter().take_while(|pair| pair.0 as usize == k);
        Some(PixelFaces { camera_rays, projection, k, parts: own.filter_map(part).collect() })
    }
}

/// Of each pixel that is due the least nearness of what emits there, infinite where nothing does; NaN elsewhere.
fn least_nearness(projection: &Projection, emitting: &[ProjectedFace], due: &[bool]) -> Vec<f64> {
    // A sky is behind everything.
    let behind = if projection.view.scene.sky.is_some() { 0.0 } else { f64::INFINITY };
    let mut least: Vec<f64> = due.iter().map(|&due| if due { behind } else { f64::NAN }).collect();
    for of in emitting {
        projection.pixels_under(&of.polygon, |k| {
            if due[k] {
                let own = nearness_at_corners(of, k, projection.view.width).fold(f64::INFINITY, f64::min);
                least[k] = least[k].min(own.max(0.0));
            }
        });
    }
    least
}

/// How near the plane of a face is at the corners of a pixel.
fn nearness_at_corners(of: &ProjectedFace, k: usize, width: usize) -> impl Iterator<Item = f64> {
    let corner = corner_of(k, width);
    [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].into_iter().map(move |more| of.nearness(corner + more))
}

/// Calls `each` with the pixels that a face lies in and may hide something of what emits there, or emit itself.
fn each_pixel(projection: &Projection, least: &[f64], of: &ProjectedFace, mut each: impl FnMut(usize)) {
    projection.pixels_under(&of.polygon, |k| {
        let most = nearness_at_corners(of, k, projection.view.width).fold(0.0, f64::max);
        if most >= least[k] * (1.0 - SAME) {
            each(k);
        }
    });
}

impl PixelFaces<'_> {
    /// Light as emitted, if it is known without rays.
    fn emission(&self) -> Option<SeenEmission> {
        let scene = self.projection.view.scene;
        if self.parts.iter().any(|part| scene.is_masked(part.of.face)) {
            return None;
        }
        let mut found = SeenEmission::default();
        let emits = |part: &&Part| scene.material(part.of.face).emits() && faces_camera(self.projection.view, part.of);
        for part in self.parts.iter().filter(emits) {
            let pieces = self.visible(&part.polygon, Some(part.of))?;
            for piece in pieces {
                found.add(self.camera_rays.emitter(part.of.face), self.light(part.of, &piece)?);
            }
        }
        if let Some((face, radiance)) = self.sky()? {
            let whole = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];
            let seen: f64 = self.visible(&whole, None)?.iter().map(|piece| area(piece)).sum();
            found.add(self.camera_rays.emitter(face), seen * radiance.as_dvec3());
        }
        Some(found)
    }

    /// The light of a piece of a face times its area in pixels; none of a texture that goes far into the distance.
    fn light(&self, of: &ProjectedFace, piece: &[DVec2]) -> Option<DVec3> {
        let material = self.projection.view.scene.material(of.face);
        if material.maps.as_ref().is_none_or(|maps| maps.emission.is_none()) {
            return Some(area(piece) * material.emitted().visible.as_dvec3());
        }
        let corner = corner_of(self.k, self.projection.view.width);
        let nearness = |p: DVec2| of.nearness(corner + p);
        let least = piece.iter().map(|&p| nearness(p)).fold(f64::INFINITY, f64::min);
        let most = piece.iter().map(|&p| nearness(p)).fold(0.0, f64::max);
        let strips = ((most / least).ln() / EVEN.ln()).ceil().max(1.0);
        let edge = |k: f64| least * (most / least).powf(k / strips);
        let strip = |k: u32| {
            let mut own = piece.to_vec();
            if strips > 1.0 {
                let [low, high] = [f64::from(k), f64::from(k + 1)].map(edge);
                own = above(&above(piece, |p| nearness(p) - low), |p| high - nearness(p));
            }
            self.texture(of, &own)
        };
        (strips <= MOST as f64).then(|| (0..strips as u32).map(strip).sum())
    }

    /// The light of a piece of a texture times its area in pixels, by the mean over the surface.
    fn texture(&self, of: &ProjectedFace, piece: &[DVec2]) -> DVec3 {
        if is_nothing(piece) {
            return DVec3::ZERO;
        }
        let Projection { view, .. } = self.projection;
        let corner = corner_of(self.k, view.width);
        let place = |p: DVec2| self.projection.place(corner + p, of.nearness(corner + p)).as_vec3();
        let triangle = |ends: &[DVec2]| {
            let corners = [piece[0], ends[0], ends[1]];
            let emission = view.scene.means(of.face, corners.map(place)).emission.as_vec3();
            let visibility = view.scene.material(of.face).visibility;
            area(&corners) * Light::emitted(emission, visibility).visible.as_dvec3()
        };
        piece[1..].windows(2).map(triangle).sum()
    }

    /// The cell of the sky behind the pixel, if there is one and it emits; none of several.
    fn sky(&self) -> Option<Option<(u32, Rgb)>> {
        let view = self.projection.view;
        if view.scene.sky.is_none() {
            return Some(None);
        }
        let face = cell_behind(view, self.k)?;
        let radiance = view.scene.material(face).emitted().visible;
        Some((radiance != Rgb::ZERO).then_some((face, radiance)))
    }

    /// What is seen of a polygon of a face, or of the sky, in pieces; none where that cannot be told.
    fn visible(&self, polygon: &[DVec2], of: Option<&ProjectedFace>) -> Option<Vec<Vec<DVec2>>> {
        let mut pieces = vec![polygon.to_vec()];
        for other in self.parts.iter().filter(|other| of.is_none_or(|of| of.face != other.of.face)) {
            let hiding = match of {
                Some(of) => self.nearer(polygon, of, other)?,
                None => other.polygon.clone(),
            };
            if !is_nothing(&hiding) {
                pieces = pieces.into_iter().flat_map(|piece| without(piece, &hiding)).collect();
            }
            if pieces.is_empty() {
                break;
            }
            if pieces.len() > MOST {
                return None;
            }
        }
        Some(pieces)
    }

    /// The part of another face that is nearer than a face where it overlaps that one's polygon; none where they are in
    /// one place that is not one plane.
    fn nearer(&self, polygon: &[DVec2], of: &ProjectedFace, other: &Part) -> Option<Vec<DVec2>> {
        let corner = corner_of(self.k, self.projection.view.width);
        let ahead = |p: DVec2| other.of.nearness(corner + p) - of.nearness(corner + p);
        let overlap = inside(polygon.to_vec(), &other.polygon);
        if is_nothing(&overlap) {
            return Some(Vec::new());
        }
        let is_same = |&p: &DVec2| ahead(p).abs() <= SAME * of.nearness(corner + p).abs();
        if !overlap.iter().all(is_same) {
            return Some(above(&other.polygon, ahead));
        }
        // Of a thin sheet the front is first, of one plane the first face, as rays have it.
        let rays = self.projection.view.rays;
        let is_first = (other.of.side, other.of.face) < (of.side, of.face);
        (rays.plane(of.face) == rays.plane(other.of.face))
            .then(|| if is_first { other.polygon.clone() } else { Vec::new() })
    }
}

/// Edges of a convex polygon with an area, as heights of points to their inner side; without those that are too short
/// for a direction.
fn heights(polygon: &[DVec2]) -> impl Iterator<Item = impl Fn(DVec2) -> f64> {
    let least = SHORT * Bounds::of(polygon.iter().copied()).size().max_element();
    let long = edges(polygon).filter(move |(a, b)| a.distance(*b) > least);
    long.map(|(a, b)| move |p: DVec2| (b - a).perp_dot(p - a))
}

/// The part of a convex polygon inside another.
fn inside(mut polygon: Vec<DVec2>, other: &[DVec2]) -> Vec<DVec2> {
    for height in heights(other) {
        polygon = above(&polygon, height);
    }
    polygon
}

/// The convex parts of a convex polygon outside another.
fn without(polygon: Vec<DVec2>, other: &[DVec2]) -> Vec<Vec<DVec2>> {
    match parted(&polygon, heights(other), is_nothing) {
        (Some(_), outside) => outside,
        (None, _) => vec![polygon],
    }
}
