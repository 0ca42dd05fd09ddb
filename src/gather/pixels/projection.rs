//! How the camera projects points and faces into the picture, and the pixels that they lie in.
//!
//! Not handled: lenses; faces less than [`NEAR`] before the camera.

use glam::{DVec2, DVec3};
use smallvec::SmallVec;

use crate::rays::Side;
use crate::reading::view::View;
use crate::scene::Bounds;
use crate::scene::convex_polygon::{area, clip, cut};

/// Corners nearer to the camera than this share of the scene's half extent are not projected.
const NEAR: f64 = 1e-6;

/// Width of a polygon that is none, in pixels: places are known to about 1e-13.
const NOTHING: f64 = 1e-11;

/// How the camera projects points into the picture, in pixels.
pub(crate) struct Projection<'a> {
    pub view: &'a View<'a>,
    pub eye: DVec3,
    /// To the right, down, and forward, where the first two are pixels at distance 1.
    axes: [DVec3; 3],
    pub size: DVec2,
}

/// A face in the picture.
pub(crate) struct ProjectedFace {
    pub face: u32,
    /// The side that the camera sees.
    pub side: Side,
    /// The part of it before the camera, in pixels; its area is positive.
    pub polygon: SmallVec<[DVec2; 4]>,
    /// What its nearness is at a place (x, y): the product of these with (x, y, 1).
    nearness: DVec3,
}

impl ProjectedFace {
    /// The inverse of its depth at a place, in unit coordinates.
    pub(crate) fn nearness(&self, place: DVec2) -> f64 {
        self.nearness.dot(place.extend(1.0))
    }
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
        let from_eye = self.along_axes(point);
        (from_eye.z > NEAR).then(|| self.seen_at(from_eye))
    }

    /// A point from the eye along the axes.
    fn along_axes(&self, point: DVec3) -> DVec3 {
        DVec3::from(self.axes.map(|axis| axis.dot(point - self.eye)))
    }

    /// Where a point from the eye is in the picture.
    fn seen_at(&self, from_eye: DVec3) -> DVec2 {
        0.5 * self.size + from_eye.truncate() / from_eye.z
    }

    /// The point that is seen at a place of the picture, of a nearness.
    pub(crate) fn place(&self, place: DVec2, nearness: f64) -> DVec3 {
        let [right, down, forward] = self.axes;
        let [x, y] = (place - 0.5 * self.size).to_array();
        let along = |by: f64, axis: DVec3| by / axis.length_squared() * axis;
        self.eye + (along(x, right) + along(y, down) + forward) / nearness
    }

    /// A face, if some of it lies in the picture; none in a map, which no camera projects.
    pub(crate) fn face(&self, face: u32) -> Option<[DVec2; 3]> {
        if self.view.atlas.is_some() {
            return None;
        }
        let [a, b, c] = self.view.scene.corners(face).map(|corner| self.point(corner.as_dvec3()));
        let polygon = [a?, b?, c?];
        self.reaches(&Bounds::of(polygon)).then_some(polygon)
    }

    /// A face with what of it is before the camera, if some of that lies in the picture; none in a map.
    pub(crate) fn part(&self, face: u32) -> Option<ProjectedFace> {
        if self.view.atlas.is_some() {
            return None;
        }
        let corners = self.view.scene.corners(face).map(|corner| self.along_axes(corner.as_dvec3()));
        let mut before = SmallVec::<[DVec3; 4]>::new();
        let height = |corner: DVec3| corner.z - NEAR;
        let crossing = |(p, h): (DVec3, f64), (q, g): (DVec3, f64)| p.lerp(q, h / (h - g));
        cut(&corners, height, crossing, |corner, [above, _]| {
            if above {
                before.push(corner);
            }
        });
        let mut polygon: SmallVec<[DVec2; 4]> = before.iter().map(|&corner| self.seen_at(corner)).collect();
        if polygon.len() < 3 || !self.reaches(&Bounds::of(polygon.iter().copied())) {
            return None;
        }
        // Of the plane n · q = h and a place p: q = z (p, 1), so that 1/z = n · (p, 1) / h.
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let height = normal.dot(corners[0]);
        let [x, y, z] = (normal / height).to_array();
        let middle = 0.5 * self.size;
        let nearness = DVec3::new(x, y, z - x * middle.x - y * middle.y);
        let turned = area(&polygon);
        if turned < 0.0 {
            polygon.reverse();
        }
        let side = if height < 0.0 { Side::Front } else { Side::Back };
        (turned != 0.0 && nearness.is_finite()).then_some(ProjectedFace { face, side, polygon, nearness })
    }

    /// Whether some of a rectangle lies in the picture.
    fn reaches(&self, bounds: &Bounds<DVec2>) -> bool {
        bounds.high.cmpgt(DVec2::ZERO).all() && bounds.low.cmplt(self.size).all()
    }

    /// Calls `each` with the pixels that some of a convex polygon lies in.
    pub(crate) fn pixels_under(&self, polygon: &[DVec2], mut each: impl FnMut(usize)) {
        let bounds @ Bounds { low, high } = Bounds::of(polygon.iter().copied());
        if (high.ceil() - low.floor()).min_element() <= 1.0 {
            // In one row or column it lies in all of the rectangle.
            return self.pixels_in(&bounds).for_each(each);
        }
        for y in low.y.max(0.0) as u32..high.y.min(self.size.y).ceil() as u32 {
            let y = f64::from(y);
            let row = clip(polygon, DVec2::Y, [Some(y), Some(y + 1.0)]);
            if row.is_empty() {
                continue;
            }
            let Bounds { low, high } = Bounds::of(row);
            let bounds = Bounds { low: DVec2::new(low.x, y), high: DVec2::new(high.x, y + 1.0) };
            self.pixels_in(&bounds).for_each(&mut each);
        }
    }

    /// The pixels of a rectangle, as far as it lies in the picture.
    pub(crate) fn pixels_in(&self, &Bounds { low, high }: &Bounds<DVec2>) -> impl Iterator<Item = usize> + use<> {
        let (first, end) = (low.max(DVec2::ZERO).as_uvec2(), high.min(self.size).ceil().as_uvec2());
        let width = self.view.width;
        let row = move |y: u32| (first.x..end.x).map(move |x| y as usize * width + x as usize);
        (first.y..end.y).flat_map(row)
    }
}

/// The part of a polygon in the pixel whose upper left corner this is.
pub(crate) fn within(polygon: &[DVec2], corner: DVec2) -> Vec<DVec2> {
    let between = |low: f64| [Some(low), Some(low + 1.0)];
    clip(&clip(polygon, DVec2::X, between(corner.x)), DVec2::Y, between(corner.y))
}

/// The part of a polygon in pixel k of rows of `width`, from that pixel's upper left corner.
pub(crate) fn in_pixel(polygon: &[DVec2], k: usize, width: usize) -> Vec<DVec2> {
    let corner = corner_of(k, width);
    within(polygon, corner).into_iter().map(|p| p - corner).collect()
}

/// Whether a convex polygon is as good as none.
pub(crate) fn is_nothing(polygon: &[DVec2]) -> bool {
    polygon.len() < 3 || area(polygon) <= NOTHING * Bounds::of(polygon.iter().copied()).size().max_element()
}

/// The upper left corner of pixel k of rows of `width`.
pub(crate) fn corner_of(k: usize, width: usize) -> DVec2 {
    DVec2::new((k % width) as f64, (k / width) as f64)
}
