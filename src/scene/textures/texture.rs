//! A texture: an image, where it lies on the surface, and what is beyond its edge.
//!
//! Coordinates of vertices go through an affine map to the image's unit square, x to the right and y down from the
//! upper left corner. Texel (i, j) has its middle at ((i + 0.5)/width, (j + 0.5)/height); between middles linear light
//! is bilinear, or that of the nearest texel.
//!
//! Not handled: means of many texels ([`crate::scene::textures::mean`]).

use std::sync::Arc;

use glam::{DAffine2, DMat2, DVec2, Vec3};

use crate::scene::textures::stored_image::{Cells, Image};

/// A texture of one material.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Texture {
    /// Its texels.
    pub image: Arc<Image>,
    /// From coordinates of vertices to the image's unit square, y down.
    pub placement: DAffine2,
    /// Beyond the edge to the left and right, and above and below.
    pub wrap: [Wrap; 2],
    /// Between the middles of texels.
    pub filter: Filter,
}

/// What is beyond the edge of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The image again, mirrored.
    Mirror,
    /// The texel at the edge.
    Clamp,
}

/// What is between the middles of texels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Filter {
    /// The four around, bilinear in linear light.
    #[default]
    Linear,
    /// The texel that the point lies in.
    Nearest,
}

impl Wrap {
    /// The texel, of n in a row, that stands at an index.
    #[inline]
    pub(crate) fn index(self, i: i64, n: usize) -> usize {
        let n = n as i64;
        let found = match self {
            Wrap::Repeat => i.rem_euclid(n),
            Wrap::Clamp => i.clamp(0, n - 1),
            Wrap::Mirror => {
                let k = i.rem_euclid(2 * n);
                k.min(2 * n - 1 - k)
            }
        };
        found as usize
    }
}

impl Texture {
    /// The placement of images by coordinates whose v runs up from the lower edge, each scaled and then moved.
    pub fn upright(scale: DVec2, offset: DVec2) -> DAffine2 {
        let flip = DAffine2 { matrix2: DMat2::from_diagonal(DVec2::new(1.0, -1.0)), translation: DVec2::Y };
        flip * DAffine2 { matrix2: DMat2::from_diagonal(scale), translation: offset }
    }

    /// A point by coordinates of vertices, in texels from the image's upper left corner.
    #[inline]
    pub(crate) fn in_texels(&self, at: DVec2) -> DVec2 {
        self.placement.transform_point2(at) * DVec2::new(self.image.width() as f64, self.image.height() as f64)
    }

    /// The mean of linear RGB over a square of texels that the point lies in, one of those whose means are known: the
    /// largest whose sides are at most `most` in coordinates of the image's unit square; the point's own where there is
    /// none so small.
    pub(crate) fn colour_about(&self, at: DVec2, most: DVec2) -> Vec3 {
        let place = self.placement.transform_point2(at);
        // Beyond the edge of an image whose texels there go on squares do not.
        let beyond = |axis: usize| self.wrap[axis] == Wrap::Clamp && !(0.0..1.0).contains(&place[axis]);
        let size = |cells: &Cells| DVec2::new(cells.width as f64, cells.height as f64);
        let fits = |cells: &&Cells| (size(cells) * most).cmpge(DVec2::ONE).all();
        match self.image.means().iter().rev().find(fits) {
            Some(cells) if !beyond(0) && !beyond(1) => {
                let cell = (place * size(cells)).floor();
                let index = |axis: usize, n: usize| self.wrap[axis].index(cell[axis] as i64, n);
                cells.at(index(0, cells.width), index(1, cells.height))
            }
            _ => self.colour(at),
        }
    }

    /// Linear RGB at coordinates of vertices.
    pub fn colour(&self, at: DVec2) -> Vec3 {
        let place = self.in_texels(at);
        let [column, row] = [0, 1].map(|axis| {
            let n = if axis == 0 { self.image.width() } else { self.image.height() };
            move |i: f64| self.wrap[axis].index(i as i64, n)
        });
        if self.filter == Filter::Nearest {
            let cell = place.floor();
            return self.image.colour(column(cell.x), row(cell.y));
        }
        let middle = place - 0.5;
        let low = middle.floor();
        let share = (middle - low).as_vec2();
        let [left, right] = [column(low.x), column(low.x + 1.0)];
        let [above, below] = [row(low.y), row(low.y + 1.0)];
        let mix = |a: Vec3, b: Vec3, t: f32| a + t * (b - a);
        let [upper, lower] =
            [above, below].map(|y| mix(self.image.colour(left, y), self.image.colour(right, y), share.x));
        mix(upper, lower, share.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pictures::Texels;

    /// Two by two texels of code 0, 255 above 255, 0.
    fn checker(wrap: Wrap, filter: Filter) -> Texture {
        let texels = Texels { width: 2, height: 2, channels: 1, codes: vec![0, 255, 255, 0] };
        let placement = Texture::upright(DVec2::ONE, DVec2::ZERO);
        Texture { image: Arc::new(Image::new(texels)), placement, wrap: [wrap; 2], filter }
    }

    #[test]
    fn the_lower_left_texel_lies_at_the_origin() {
        let found = |u, v| checker(Wrap::Repeat, Filter::Nearest).colour(DVec2::new(u, v)).x;
        assert_eq!([found(0.1, 0.1), found(0.9, 0.1), found(0.1, 0.9), found(0.9, 0.9)], [1.0, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn light_is_linear_between_the_middles_of_texels() {
        let found = |u, v| checker(Wrap::Repeat, Filter::Linear).colour(DVec2::new(u, v)).x;
        assert_eq!([found(0.25, 0.25), found(0.5, 0.25), found(0.5, 0.5), found(0.375, 0.25)], [1.0, 0.5, 0.5, 0.75]);
        // Across the edge the image goes on.
        assert_eq!([found(0.0, 0.25), found(1.0, 0.25)], [0.5, 0.5]);
    }

    #[test]
    fn what_is_beyond_the_edge() {
        let found = |wrap, u| checker(wrap, Filter::Linear).colour(DVec2::new(u, 0.25)).x;
        for (u, repeated, mirrored, clamped) in [(1.25, 1.0, 0.0, 0.0), (-0.25, 0.0, 1.0, 1.0), (7.75, 0.0, 1.0, 0.0)] {
            assert_eq!(found(Wrap::Repeat, u), repeated, "{u}");
            assert_eq!(found(Wrap::Mirror, u), mirrored, "{u}");
            assert_eq!(found(Wrap::Clamp, u), clamped, "{u}");
        }
        assert_eq!([Wrap::Repeat, Wrap::Mirror, Wrap::Clamp].map(|w| w.index(-3, 4)), [1, 2, 0]);
    }

    #[test]
    fn squares_stand_for_their_texels_where_they_are_small_enough() {
        let codes = (0..32 * 32 * 3).map(|k| (k * k * 7 + k * 13) as u8).collect();
        let image = Arc::new(Image::new(Texels { width: 32, height: 32, channels: 3, codes }));
        let placement = Texture::upright(DVec2::ONE, DVec2::ZERO);
        let texture = Texture { image, placement, wrap: [Wrap::Clamp; 2], filter: Filter::Linear };
        let (at, beyond) = (DVec2::new(0.3, 0.8), DVec2::new(1.3, 0.8));
        // Squares of 8 texels are a quarter of the image wide.
        for (most, expected) in [
            (0.0, texture.colour(at)),
            (0.24, texture.colour(at)),
            (0.25, texture.image.means()[0].at(1, 0)),
            (0.9, texture.image.means()[0].at(1, 0)),
            (1.0, texture.image.mean()),
        ] {
            assert_eq!(texture.colour_about(at, DVec2::splat(most)), expected, "{most}");
            // What goes on beyond the edge is the texel there, not the square.
            assert_eq!(texture.colour_about(beyond, DVec2::splat(most)), texture.colour(beyond));
        }
        assert_eq!(texture.colour_about(at, DVec2::new(1.0, 0.1)), texture.colour(at));
    }

    #[test]
    fn an_image_is_scaled_and_then_moved() {
        let moved = Texture {
            placement: Texture::upright(DVec2::splat(2.0), DVec2::new(0.5, 0.0)),
            ..checker(Wrap::Repeat, Filter::Nearest)
        };
        // u = 0.05 lies at 0.6 of the image, u = 0.3 at 0.1 of the next.
        assert_eq!([0.05, 0.3].map(|u| moved.colour(DVec2::new(u, 0.1)).x), [0.0, 1.0]);
    }
}
