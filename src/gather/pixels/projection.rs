//! How the camera projects points and faces into the picture, and the pixels that they lie in.
//!
//! Not handled: faces that reach behind the camera.

use glam::{DVec2, DVec3};

use crate::reading::view::View;
use crate::scene::Bounds;
use crate::scene::convex_polygon::clip;

/// Corners nearer to the camera than this share of the scene's half extent are not projected.
const NEAR: f64 = 1e-6;

/// How the camera projects points into the picture, in pixels.
pub(crate) struct Projection<'a> {
    pub view: &'a View<'a>,
    pub eye: DVec3,
    /// To the right, down, and forward, where the first two are pixels at distance 1.
    axes: [DVec3; 3],
    pub size: DVec2,
}

impl<'a> Projection<'a> {
    pub(crate) fn new(view: &'a View<'a>) -> Projection<'a> {
        let camera = &view.scene.camera;
        let each = 1.0 / camera.pixel(view.height);
        let [right, up, forward] = [camera.right, camera.up, camera.forward].map(|axis| axis.as_dvec3());
        let size = DVec2::new(view.width as f64, view.height as f64);
        Projection { view, eye: camera.position.as_dvec3(), axes: [each * right, -each * up, forward], size }
    }

    /// Where a point is; none behind the camera.
    pub(crate) fn point(&self, point: DVec3) -> Option<DVec2> {
        let [x, y, depth] = self.axes.map(|axis| axis.dot(point - self.eye));
        (depth > NEAR).then(|| 0.5 * self.size + DVec2::new(x, y) / depth)
    }

    /// A face, if some of it lies in the picture; none in a map, which no camera projects.
    pub(crate) fn face(&self, face: u32) -> Option<[DVec2; 3]> {
        if self.view.atlas.is_some() {
            return None;
        }
        let [a, b, c] = self.view.scene.corners(face).map(|corner| self.point(corner.as_dvec3()));
        let polygon = [a?, b?, c?];
        let bounds = Bounds::of(polygon);
        let is_outside = bounds.high.cmple(DVec2::ZERO).any() || bounds.low.cmpge(self.size).any();
        (!is_outside).then_some(polygon)
    }

    /// The pixels of a rectangle, as far as it lies in the picture.
    pub(crate) fn pixels_in(&self, &Bounds { low, high }: &Bounds<DVec2>) -> impl Iterator<Item = usize> + use<> {
        let (first, end) = (low.max(DVec2::ZERO).as_uvec2(), high.min(self.size).ceil().as_uvec2());
        let width = self.view.width;
        let row = move |y: u32| (first.x..end.x).map(move |x| y as usize * width + x as usize);
        (first.y..end.y).flat_map(row)
    }

    /// Calls `each` with the pixels that a line between two places passes through.
    pub(crate) fn pixels_along(&self, [a, b]: [DVec2; 2], mut each: impl FnMut(usize)) {
        let Bounds { low, high } = Bounds::of([a, b]);
        let rows = low.y.max(0.0) as u32..high.y.min(self.size.y).ceil() as u32;
        for y in rows {
            // Where it enters and leaves the row.
            let within = [f64::from(y), f64::from(y + 1)].map(|y| {
                let share = if a.y == b.y { 0.0 } else { ((y - a.y) / (b.y - a.y)).clamp(0.0, 1.0) };
                a.lerp(b, share)
            });
            let ends = if a.y == b.y { [a, b] } else { within };
            let row = Bounds::of(ends);
            let y = f64::from(y);
            let bounds = Bounds { low: DVec2::new(row.low.x, y), high: DVec2::new(row.high.x + 1e-9, y + 1.0) };
            self.pixels_in(&bounds).for_each(&mut each);
        }
    }
}

/// The part of a polygon in the pixel whose upper left corner this is.
pub(crate) fn within(polygon: &[DVec2], corner: DVec2) -> Vec<DVec2> {
    let between = |low: f64| [Some(low), Some(low + 1.0)];
    clip(&clip(polygon, DVec2::X, between(corner.x)), DVec2::Y, between(corner.y))
}
