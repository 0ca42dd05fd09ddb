//! Faces smaller or thinner than a pixel, which the pixel's first camera rays may all miss: each is projected into the
//! picture, and sampled once in each pixel that it lies in.
//!
//! A face that covers a share a of a pixel is missed by n rays with probability `(1 - a)^n`. If its light differs from
//! that of the pixel by c, the mean of n rays through the pixel has the variance
//!
//! ```text
//! a (1 - a) |c|² / n · min(1, (a n)^-1/2)
//! ```
//!
//! of which the difference of two halves is a poor estimate in the one pixel that has the face, and 0 where both missed
//! it. (The last factor: scrambled nets are well spread, so that only points near its outline vary.) Worth: a plane
//! with grains of 0.3 % of a pixel is 2 % off at 5 % requested; without, 57 % with 0.2 % stated
//! (`tests/small_things.rs`).
//!
//! Faces farther than all that the rays of a pixel met are taken to be hidden.
//!
//! Not handled: faces wider than a pixel; small bright spots on them ([`crate::gather::pixels::adaptive_sampling`]).

use crate::gather::pixels::camera_rays::{CameraRays, PixelScratch};
use crate::gather::pixels::pixel::{Pixel, SmallFace};
use crate::light::team;
use crate::rays::Side;
use crate::reading::view::View;
use crate::scene::Bounds;
use crate::scene::convex_polygon::{area, clip};
use glam::{DVec2, DVec3};

/// Pixels that one face is sampled in at most.
const MOST_PIXELS: usize = 4096;
/// Corners nearer to the camera than this share of the scene's half extent are not projected.
const NEAR: f64 = 1e-6;

/// Adds the faces smaller or thinner than a pixel to the pixels that show them.
pub(crate) fn find_small_faces(camera_rays: &CameraRays, pixels: &mut [Pixel]) {
    let projection = Projection::new(camera_rays.view);
    let one = |scratch: &mut PixelScratch, face: usize| -> Vec<(usize, SmallFace)> {
        let thin = projection.thin_face(face as u32).into_iter();
        let of_face = |thin: ThinFace| {
            let parts = thin.pixels(&projection).filter_map(|k| thin.part(camera_rays, &pixels[k], k, scratch));
            parts.collect::<Vec<_>>()
        };
        thin.flat_map(of_face).collect()
    };
    let faces = camera_rays.view.scene.solid_faces() as usize;
    let parts = team::share(faces, |_| 1.0).map(|| camera_rays.scratch(), one);
    for (k, face) in parts.into_iter().flatten() {
        pixels[k].small_faces.push(face);
    }
}

/// How the camera projects points into the picture, in pixels.
struct Projection<'a> {
    view: &'a View<'a>,
    eye: DVec3,
    /// To the right, down, and forward, where the first two are pixels at distance 1.
    axes: [DVec3; 3],
    size: DVec2,
}

/// A face smaller or thinner than a pixel, in the picture.
struct ThinFace {
    face: u32,
    side: Side,
    polygon: [DVec2; 3],
    /// A point of its plane, and the normal of that.
    center: DVec3,
    normal: DVec3,
}

impl<'a> Projection<'a> {
    fn new(view: &'a View<'a>) -> Projection<'a> {
        let camera = &view.scene.camera;
        let each = 1.0 / camera.pixel(view.height);
        let [right, up, forward] = [camera.right, camera.up, camera.forward].map(|axis| axis.as_dvec3());
        let size = DVec2::new(view.width as f64, view.height as f64);
        Projection { view, eye: camera.position.as_dvec3(), axes: [each * right, -each * up, forward], size }
    }

    /// Where a point is; none behind the camera.
    fn point(&self, point: DVec3) -> Option<DVec2> {
        let [x, y, depth] = self.axes.map(|axis| axis.dot(point - self.eye));
        (depth > NEAR).then(|| 0.5 * self.size + DVec2::new(x, y) / depth)
    }

    /// A face whose side towards the camera reflects, if it lies in the picture and is no wider than a pixel.
    fn thin_face(&self, face: u32) -> Option<ThinFace> {
        let corners = self.view.scene.corners(face).map(|corner| corner.as_dvec3());
        let [a, b, c] = corners.map(|corner| self.point(corner));
        let polygon = [a?, b?, c?];
        let bounds = Bounds::of(polygon);
        let is_thin = area(&polygon).abs() <= bounds.size().length().max(1.0);
        if !is_thin || bounds.high.cmple(DVec2::ZERO).any() || bounds.low.cmpge(self.size).any() {
            return None;
        }
        let normal = self.view.patches.normal(face, Side::Front).as_dvec3();
        let side = if normal.dot(self.eye - corners[0]) > 0.0 { Side::Front } else { Side::Back };
        let center = corners.iter().sum::<DVec3>() / 3.0;
        self.view.patches.at(face, side, center.as_vec3())?;
        Some(ThinFace { face, side, polygon, center, normal })
    }
}

impl ThinFace {
    /// The pixels that it may lie in.
    fn pixels(&self, projection: &Projection) -> impl Iterator<Item = usize> + use<> {
        let Bounds { low, high } = Bounds::of(self.polygon);
        let (first, end) = (low.max(DVec2::ZERO).as_uvec2(), high.min(projection.size).ceil().as_uvec2());
        let width = projection.view.width;
        let row = move |y: u32| (first.x..end.x).map(move |x| y as usize * width + x as usize);
        (first.y..end.y).flat_map(row).take(MOST_PIXELS)
    }

    /// Its part within a pixel, unless the pixel's rays have met its surface, or hide it.
    fn part(
        &self,
        camera_rays: &CameraRays,
        pixel: &Pixel,
        k: usize,
        scratch: &mut PixelScratch,
    ) -> Option<(usize, SmallFace)> {
        let view = camera_rays.view;
        let key = camera_rays.key(self.face, self.side);
        let point = view.surface_point(self.face, self.side, self.center.as_vec3());
        let is_met = pixel.layers.iter().any(|layer| layer.holds(key, &point));
        if is_met || pixel.hides(self.nearest(view, k)) {
            return None;
        }
        let corner = DVec2::new((k % view.width) as f64, (k / view.width) as f64);
        let inside = within(&self.polygon, corner);
        let share = if inside.len() > 2 { area(&inside).abs() } else { return None };
        let place = inside.iter().sum::<DVec2>() / inside.len() as f64;
        Some((k, SmallFace { share, light: camera_rays.light_of_face(self.face, place, scratch)? }))
    }

    /// The least distance from the camera at which its plane may be met within a pixel: along a pixel that is d wide at
    /// distance 1 that changes by `d tan` of itself, with the angle to the normal.
    fn nearest(&self, view: &View, k: usize) -> f32 {
        let ray = view.camera_ray(k, 0.5, 0.5);
        let [origin, way] = [ray.origin, ray.direction.normalize()].map(|v| v.as_dvec3());
        let cosine = way.dot(self.normal);
        let distance = (self.center - origin).dot(self.normal) / cosine;
        let tangent = (1.0 - cosine * cosine).max(0.0).sqrt() / cosine.abs();
        (distance * (1.0 - view.scene.camera.pixel(view.height) * tangent)) as f32
    }
}

/// The part of a polygon in the pixel whose upper left corner this is.
fn within(polygon: &[DVec2], corner: DVec2) -> Vec<DVec2> {
    let between = |low: f64| [Some(low), Some(low + 1.0)];
    clip(&clip(polygon, DVec2::X, between(corner.x)), DVec2::Y, between(corner.y))
}
