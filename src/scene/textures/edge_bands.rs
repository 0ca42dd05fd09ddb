//! The parts of a polygon that leaves an image whose texels at the edge go on beyond it, for the mean over it.
//!
//! What lies inside of the image and what lies beyond each edge are parts of their own. Beyond an edge nothing changes
//! across it, so a part there is pressed into the outer half of the texels at the edge, which leaves its mean as it is
//! and few texels to read.
//!
//! Not handled: the means of parts ([`crate::scene::textures::mean`]); where an image goes on beyond one edge and is
//! repeated many times along it, means of squares stand for the texels at that edge.

use glam::DVec2;

use crate::scene::convex_polygon::{area, clip};
use crate::scene::textures::texture::Wrap;

/// Area in texels below which rounding tells no mean.
pub(super) const LEAST: f64 = 1e-12;

/// Where along an axis a point lies of an image whose texels at the edge go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Band {
    Before,
    Inside,
    After,
}

impl Band {
    const ALL: [Band; 3] = [Band::Before, Band::Inside, Band::After];

    /// From where to where it is, of so many texels; images that are repeated lie inside everywhere.
    fn limits(self, wrap: Wrap, size: f64) -> [Option<f64>; 2] {
        match (wrap, self) {
            (Wrap::Clamp, Band::Before) => [None, Some(0.0)],
            (Wrap::Clamp, Band::Inside) => [Some(0.0), Some(size)],
            (Wrap::Clamp, Band::After) => [Some(size), None],
            (_, Band::Inside) => [None, None],
            _ => [Some(f64::INFINITY), None],
        }
    }
}

/// What of a polygon lies inside of an image or beyond one of its edges.
pub(super) struct Part {
    /// Its corners in texels, within the image.
    pub corners: Vec<DVec2>,
    /// The area that it stands for.
    pub area: f64,
    /// Whether it lies beyond an edge.
    pub is_beyond: bool,
}

/// The parts of a convex polygon in texels of an image of some size; without those too small for a mean.
pub(super) fn parts(corners: &[DVec2], wrap: [Wrap; 2], size: DVec2) -> Vec<Part> {
    let mut found = Vec::new();
    for bands in Band::ALL.into_iter().flat_map(|column| Band::ALL.map(|row| [column, row])) {
        let part = clip(corners, DVec2::X, bands[0].limits(wrap[0], size.x));
        let mut part = clip(&part, DVec2::Y, bands[1].limits(wrap[1], size.y));
        if part.len() < 3 {
            continue;
        }
        let own = area(&part).abs();
        for axis in 0..2 {
            press(&mut part, axis, bands[axis], wrap[axis], size[axis]);
        }
        if area(&part).abs() > LEAST {
            found.push(Part { corners: part, area: own, is_beyond: bands != [Band::Inside; 2] });
        }
    }
    found
}

/// Presses what lies in a band along an axis into an image of so many texels.
fn press(part: &mut [DVec2], axis: usize, band: Band, wrap: Wrap, size: f64) {
    let (edge, inward) = match band {
        Band::Inside if wrap == Wrap::Clamp => {
            // Rounding may leave a corner beyond the edge that it was cut at.
            return part.iter_mut().for_each(|p| p[axis] = p[axis].clamp(0.0, size));
        }
        Band::Inside => return,
        // The outer half of the texel at the edge is like all beyond it.
        Band::Before => (0.0, 0.5),
        Band::After => (size, -0.5),
    };
    let far = part.iter().map(|p| (p[axis] - edge).abs()).fold(1.0, f64::max);
    part.iter_mut().for_each(|p| p[axis] = edge + inward * (p[axis] - edge).abs() / far);
}
