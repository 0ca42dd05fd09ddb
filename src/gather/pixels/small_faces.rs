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

use halflight_team::Loop;

use crate::gather::pixels::camera_rays::{CameraRays, PixelScratch};
use crate::gather::pixels::pixel::{Pixel, SmallFace};
use crate::gather::pixels::projection::{Projection, corner_of, within};
use crate::rays::Side;
use crate::reading::view::View;
use crate::scene::Bounds;
use crate::scene::convex_polygon::area;
use glam::{DVec2, DVec3};

/// Pixels that one face is sampled in at most.
const MOST_PIXELS: usize = 4096;

/// Adds the faces smaller or thinner than a pixel to the pixels that show them.
pub(crate) fn find_small_faces(camera_rays: &CameraRays, pixels: &mut [Pixel]) {
    let projection = Projection::new(camera_rays.view);
    let one = |scratch: &mut PixelScratch, face: usize| -> Vec<(usize, SmallFace)> {
        let thin = ThinFace::new(&projection, face as u32).into_iter();
        let of_face = |thin: ThinFace| {
            let parts = thin.pixels(&projection).filter_map(|k| thin.part(camera_rays, &pixels[k], k, scratch));
            parts.collect::<Vec<_>>()
        };
        thin.flat_map(of_face).collect()
    };
    let faces = camera_rays.view.scene.solid_faces() as usize;
    let parts = Loop::each(faces).map_init(|| camera_rays.scratch(), one);
    for (k, face) in parts.into_iter().flatten() {
        pixels[k].small_faces.push(face);
    }
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

impl ThinFace {
    /// A face whose side towards the camera reflects, if it lies in the picture and is no wider than a pixel.
    fn new(projection: &Projection, face: u32) -> Option<ThinFace> {
        let view = projection.view;
        let polygon = projection.face(face)?;
        if area(&polygon).abs() > Bounds::of(polygon).size().length().max(1.0) {
            return None;
        }
        let corners = view.scene.corners(face).map(|corner| corner.as_dvec3());
        let normal = view.patches.normal(face, Side::Front).as_dvec3();
        let side = if normal.dot(projection.eye - corners[0]) > 0.0 { Side::Front } else { Side::Back };
        let center = corners.iter().sum::<DVec3>() / 3.0;
        view.patches.at(face, side, center.as_vec3())?;
        Some(ThinFace { face, side, polygon, center, normal })
    }

    /// The pixels that it may lie in.
    fn pixels(&self, projection: &Projection) -> impl Iterator<Item = usize> + use<> {
        projection.pixels_in(&Bounds::of(self.polygon)).take(MOST_PIXELS)
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
        if is_met || pixel.met.hides(self.nearest(view, k)) {
            return None;
        }
        let inside = within(&self.polygon, corner_of(k, view.width));
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
