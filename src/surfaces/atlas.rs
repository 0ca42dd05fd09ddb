//! Surfaces laid out flat, in place of what a camera sees: a picture of them is a map of irradiance.
//!
//! ```text
//! texel = mean over its points x of   sum over luminaires of F(x) V(x) E  +  F^tau L'        irradiance over pi
//! ```
//!
//! Every texel of a map stands for some points of surfaces, as a pixel does for the points that a camera sees in it.
//! Rays reach them from straight before, so nothing hides them; they are shown as white, and light as emitted is left
//! out. All else is as in a picture: how many points, records and rays, and how the error is estimated.
//!
//! Not handled: surfaces that reflect nothing in any channel, whose texels stay black; what walks of light from the
//! emitters would say of the map, and faces thinner than a texel, which pictures look for.

use glam::{Vec2, Vec3};

use crate::pictures::Size;
use crate::rays::{Hit, Ray};
use crate::surfaces::surface_point::SurfacePoint;

/// A map of surfaces.
pub trait Atlas: Send + Sync {
    /// Texels across and down.
    fn size(&self) -> Size;

    /// The point of a texel, counted row by row, that belongs to a place in the unit square, so that equal areas of the
    /// square are equal areas of what the texel shows: unit coordinates, with the normal of the side that is meant.
    /// None where the texel shows nothing.
    fn point(&self, texel: usize, at: Vec2) -> Option<SurfacePoint>;

    /// How wide a texel is on the surfaces that it shows, unit coordinates.
    fn width(&self, texel: usize) -> f64;
}

/// How far before a surface rays to it start, unit coordinates: rays take faces closer than half of it for one plane.
const BEFORE: f32 = 4e-6;
/// How far they go at most, and the least cosine between the normals of what is meant and of what is met.
const REACH: f32 = 4.0 * BEFORE;
const ALONG: f32 = 0.7;
/// Far outside of every scene.
const OUTSIDE: Vec3 = Vec3::new(1e3, 1e3, 1e3);

/// The texel that a place of a map lies in, shares of its sides, and the place within it.
fn texel(atlas: &dyn Atlas, x: f32, y: f32) -> (usize, Vec2) {
    let Size { width, height } = atlas.size();
    let (x, y) = (x * width as f32, y * height as f32);
    let (column, row) = ((x as usize).min(width - 1), (y as usize).min(height - 1));
    let within = Vec2::new(x - column as f32, y - row as f32).clamp(Vec2::ZERO, Vec2::splat(1.0 - f32::EPSILON));
    (row * width + column, within)
}

/// The ray to the point at a place of a map; one that meets nothing where there is none.
pub(crate) fn ray_to(atlas: &dyn Atlas, x: f32, y: f32) -> Ray {
    let (texel, at) = texel(atlas, x, y);
    match atlas.point(texel, at) {
        Some(SurfacePoint { position, normal, .. }) => {
            Ray { origin: position + BEFORE * normal, direction: -normal, source: None }
        }
        None => Ray { origin: OUTSIDE, direction: OUTSIDE.normalize(), source: None },
    }
}

/// Whether a ray met the surface that was meant, whose front or back has a normal.
pub(crate) fn is_meant(ray: &Ray, hit: &Hit, normal: Vec3) -> bool {
    hit.t <= REACH && ray.direction.dot(normal) <= -ALONG
}

/// How wide a part of a map is on the surfaces that it shows, of which there are so many across.
pub(crate) fn width_at(atlas: &dyn Atlas, x: f32, y: f32, across: usize) -> f64 {
    let (texel, _) = texel(atlas, x, y);
    atlas.width(texel) * atlas.size().width as f64 / across.max(1) as f64
}
