//! A picture: linear radiance on a grid of pixels, and its size.
//!
//! Row 0 is the top, column 0 the left. Values are W/(m² sr) per RGB channel, unclamped. Not handled: alpha, crops.

use crate::light::Rgb;

/// Linear radiance per pixel, row by row from the top left.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` values; pixel (x, y) is number `y * width + x`.
    pub pixels: Vec<Rgb>,
}

impl Picture {
    /// A black picture.
    pub fn new(width: usize, height: usize) -> Self {
        Picture::filled(width, height, Rgb::ZERO)
    }

    /// A picture of one colour.
    pub fn filled(width: usize, height: usize, colour: Rgb) -> Self {
        Picture { width, height, pixels: vec![colour; width * height] }
    }

    /// The picture whose pixel (x, y) is `colour(x, y)`.
    pub fn from_fn(width: usize, height: usize, colour: impl Fn(usize, usize) -> Rgb) -> Self {
        let pixels = (0..width * height).map(|i| colour(i % width, i / width)).collect();
        Picture { width, height, pixels }
    }

    /// Column x of row y, where both are inside the picture.
    pub fn get(&self, x: usize, y: usize) -> Option<Rgb> {
        let inside = x < self.width && y < self.height;
        inside.then(|| self.pixels[y * self.width + x])
    }

    /// Its width and height.
    pub fn size(&self) -> Size {
        Size { width: self.width, height: self.height }
    }

    /// Every pixel times `factor`.
    pub fn scaled(&self, factor: f32) -> Picture {
        let pixels = self.pixels.iter().map(|&p| p * factor).collect();
        Picture { pixels, ..*self }
    }

    /// The picture whose pixels are the means of `step` by `step` of these; what is left over at the right and below is
    /// left out.
    pub fn averaged(&self, step: usize) -> Picture {
        let part = (step * step) as f32;
        let mean = |x: usize, y: usize| {
            let rows = step * y..step * (y + 1);
            let own = rows.flat_map(|y| &self.pixels[y * self.width + step * x..][..step]);
            own.sum::<Rgb>() / part
        };
        Picture::from_fn(self.width / step, self.height / step, mean)
    }

    /// The pixelwise sum; `None` where the sizes differ.
    pub fn plus(&self, other: &Picture) -> Option<Picture> {
        let pair = self.pixels.iter().zip(&other.pixels);
        (self.size() == other.size()).then(|| Picture { pixels: pair.map(|(&a, &b)| a + b).collect(), ..*self })
    }
}

/// Width and height in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize)]
pub struct Size {
    /// Pixels across.
    pub width: usize,
    /// Pixels down.
    pub height: usize,
}

impl Size {
    /// How many times as many pixels each way are `enough` in all.
    pub fn enlargement(self, enough: usize) -> usize {
        let pixels = (self.width * self.height).max(1);
        (1..).find(|step| step * step * pixels >= enough).unwrap_or(1)
    }

    /// So many times as many pixels each way.
    pub fn times(self, step: usize) -> Size {
        Size { width: step * self.width, height: step * self.height }
    }
}

impl From<(usize, usize)> for Size {
    /// From the width and the height, in this order.
    fn from((width, height): (usize, usize)) -> Size {
        Size { width, height }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn row_zero_comes_first_and_columns_run_right() {
        let picture = Picture::from_fn(3, 2, |x, y| Rgb::new(x as f32, y as f32, 0.0));
        assert_eq!(picture.pixels[1], Rgb::new(1.0, 0.0, 0.0));
        assert_eq!(picture.get(2, 1), Some(Rgb::new(2.0, 1.0, 0.0)));
        assert_eq!(picture.get(3, 0), None);
        assert_eq!(picture.get(0, 2), None);
    }

    #[test]
    fn sums_need_equal_sizes() {
        let one = Picture::filled(2, 3, Rgb::ONE);
        assert_eq!(one.plus(&one), Some(one.scaled(2.0)));
        assert_eq!(one.plus(&Picture::new(3, 2)), None);
    }
}
