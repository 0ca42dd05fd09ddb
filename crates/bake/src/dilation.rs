//! Texels that show nothing get the light of those around them, so that neither bilinear lookups nor mipmaps of any
//! level mix in the dark between charts.
//!
//! Near charts, ring by ring, each is the mean of its known neighbours; what is farther than the rings takes the mean
//! of ever larger squares (push and pull).
//!
//! Not handled: light that goes on beyond a border as its slope says.

use glam::Vec3;
use halflight::pictures::Picture;

/// Rings around charts that are filled one by one.
const RINGS: usize = 16;

/// The share of each texel of a square map that shows something.
#[derive(Clone, Debug)]
pub struct Coverage(Vec<f32>);

impl Coverage {
    pub(crate) fn new(shares: impl Iterator<Item = f64>) -> Coverage {
        Coverage(shares.map(|share| share as f32).collect())
    }

    /// The share of a texel.
    pub fn of(&self, texel: usize) -> f64 {
        f64::from(self.0[texel])
    }

    /// Texels that show something.
    pub fn count(&self) -> usize {
        self.0.iter().filter(|share| **share > 0.0).count()
    }

    /// RMS of all channels over the texels that show something, each as much as it shows.
    pub(crate) fn rms(&self, picture: &Picture) -> f64 {
        let (mut sum, mut area) = (0.0, 0.0);
        for (pixel, share) in picture.pixels.iter().zip(&self.0) {
            sum += f64::from(*share) * f64::from(pixel.length_squared());
            area += f64::from(*share);
        }
        if area > 0.0 { (sum / (3.0 * area)).sqrt() } else { 0.0 }
    }
}

/// The picture with all texels filled.
pub(crate) fn dilated(picture: &Picture, coverage: &Coverage) -> Picture {
    let Picture { width, height, .. } = *picture;
    let mut light: Vec<Option<Vec3>> =
        picture.pixels.iter().zip(&coverage.0).map(|(p, share)| (*share > 0.0).then_some(*p)).collect();
    for _ in 0..RINGS {
        let before = light.clone();
        for (k, own) in light.iter_mut().enumerate().filter(|(_, own)| own.is_none()) {
            *own = mean_around(&before, width, height, k);
        }
    }
    let filled = pulled(&light, width, height);
    Picture { pixels: light.into_iter().zip(filled).map(|(own, other)| own.unwrap_or(other)).collect(), ..*picture }
}

/// The mean of the neighbours that are known: of those beside, else of those at the corners.
fn mean_around(light: &[Option<Vec3>], width: usize, height: usize, k: usize) -> Option<Vec3> {
    const BESIDE: [[isize; 2]; 4] = [[1, 0], [-1, 0], [0, 1], [0, -1]];
    const CORNERS: [[isize; 2]; 4] = [[1, 1], [-1, 1], [1, -1], [-1, -1]];
    let known = |[u, v]: [isize; 2]| {
        let (x, y) = ((k % width).checked_add_signed(u)?, (k / width).checked_add_signed(v)?);
        if x < width && y < height { light[y * width + x] } else { None }
    };
    let mean = |places: [[isize; 2]; 4]| {
        let found: Vec<Vec3> = places.into_iter().filter_map(known).collect();
        (!found.is_empty()).then(|| found.iter().sum::<Vec3>() / found.len() as f32)
    };
    mean(BESIDE).or_else(|| mean(CORNERS))
}

/// A value of every texel from the means of the smallest squares around it in which something is known.
fn pulled(light: &[Option<Vec3>], width: usize, height: usize) -> Vec<Vec3> {
    if width * height <= 1 || light.iter().all(Option::is_some) {
        return light.iter().map(|own| own.unwrap_or_default()).collect();
    }
    let (columns, rows) = (width.div_ceil(2), height.div_ceil(2));
    let square = |k: usize| {
        let (x, y) = (2 * (k % columns), 2 * (k / columns));
        let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
        let inside = four.into_iter().filter(|(x, y)| *x < width && *y < height);
        let known: Vec<Vec3> = inside.filter_map(|(x, y)| light[y * width + x]).collect();
        (!known.is_empty()).then(|| known.iter().sum::<Vec3>() / known.len() as f32)
    };
    let smaller: Vec<Option<Vec3>> = (0..columns * rows).map(square).collect();
    let filled = pulled(&smaller, columns, rows);
    let of = |k: usize| filled[(k / width / 2) * columns + k % width / 2];
    (0..light.len()).map(|k| light[k].unwrap_or_else(|| of(k))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everything_is_filled_and_nothing_known_changes() {
        const SIDE: usize = 64;
        let is_known = |k: usize| (10..14).contains(&(k % SIDE)) && (20..30).contains(&(k / SIDE));
        let pixels =
            (0..SIDE * SIDE).map(|k| if is_known(k) { Vec3::splat(1.0 + (k % SIDE) as f32) } else { Vec3::ZERO });
        let picture = Picture { pixels: pixels.collect(), ..Picture::new(SIDE, SIDE) };
        let coverage = Coverage::new((0..SIDE * SIDE).map(|k| f64::from(u8::from(is_known(k)))));
        let found = dilated(&picture, &coverage);
        for (k, (own, before)) in found.pixels.iter().zip(&picture.pixels).enumerate() {
            assert!(if is_known(k) { own == before } else { (11.0..=14.0).contains(&own.x) }, "{k} {own}");
        }
        // Beside the border it is the border's.
        assert_eq!((found.pixels[25 * SIDE + 14].x, found.pixels[25 * SIDE + 9].x), (14.0, 11.0));
    }
}
