//! What the camera rays of all pixels tell of the noise of the picture, and the variance that each pixel is taken to
//! have.
//!
//! Not handled: what is done about it ([`crate::gather::adaptive_sampling`]).

use glam::DVec3;
use rayon::prelude::*;

use crate::gather::pixel::Pixel;

/// Neighbours to each side whose variance is pooled.
const POOL: usize = 1;

/// Sums over pixels, weighted as they count.
#[derive(Default)]
pub(crate) struct Measured {
    /// Sum of the pixels' variances, channels added.
    pub variance: f64,
    /// Sum of the pixels' squared values.
    pub signal: f64,
    /// Pixels.
    pub count: f64,
}

impl Measured {
    /// Adds a pixel of some variance and value.
    pub fn add(&mut self, pixel: &Pixel, variance: DVec3, value: DVec3) {
        self.variance += pixel.weight() * variance.element_sum();
        self.signal += pixel.weight() * value.length_squared();
        self.count += pixel.weight();
    }

    /// Radiance above which what a pixel emits counts no more in its noise: twice the RMS of the picture.
    pub fn bright(&self) -> f64 {
        2.0 * (self.signal / (3.0 * self.count.max(1.0))).sqrt()
    }
}

/// The noise of the picture and the picture, with the light of the patches for what is reflected more than once.
///
/// The picture is what is reflected: slivers of a small bright lamp would outshine all of it, and any error would be
/// small beside them. Its noise has emission up to twice the picture, so that the outlines of lamps are looked at.
pub(crate) fn measure(pixels: &[Pixel]) -> Measured {
    let mut measured = Measured::default();
    for pixel in pixels {
        let [a, b] = pixel.halves_below(0.0);
        measured.add(pixel, DVec3::ZERO, (a + b) / pixel.camera());
    }
    let bright = measured.bright();
    let noise = |pixel: &Pixel| pixel.weight() * (pixel.variance_below(bright).element_sum() + pixel.unseen);
    measured.variance = pixels.iter().map(noise).sum();
    measured
}

/// What every pixel shows, its emission up to `bright`.
pub(crate) fn means(pixels: &[Pixel], bright: f64) -> Vec<DVec3> {
    pixels.iter().map(|p| p.halves_below(bright).into_iter().sum::<DVec3>() / p.camera()).collect()
}

/// Whether what pixel k has seen shows around it as well: an edge, on whose two sides pixels differ by more than their
/// noise and by as much as its halves may; or noise of half of the pixels around. Rays of a line thinner than a pixel
/// make neither.
pub(crate) fn is_seen_around(pixels: &[Pixel], means: &[DVec3], width: usize, k: usize) -> bool {
    let variance = pixels[k].differed;
    let beside = |[u, v]: [isize; 2]| {
        let (x, y) = ((k % width).checked_add_signed(u)?, (k / width).checked_add_signed(v)?);
        (x < width && y * width < pixels.len()).then_some(y * width + x)
    };
    const HALF: [[isize; 2]; 4] = [[1, 0], [0, 1], [1, 1], [1, -1]];
    let opposite = HALF.map(|to| beside(to).zip(beside(to.map(|d| -d))));
    let is_edge = |(a, b): (usize, usize)| {
        let noise = 4.0 * (pixels[a].differed + pixels[b].differed);
        (means[a] - means[b]).length_squared() >= variance.max(noise)
    };
    let around = || HALF.into_iter().flat_map(|to| [beside(to), beside(to.map(|d| -d))]).flatten();
    let noisy = around().filter(|j| 4.0 * pixels[*j].differed >= variance).count();
    opposite.into_iter().flatten().any(is_edge) || 2 * noisy >= around().count().max(1)
}

/// The variance of every pixel, whose [`means`] are given: what its neighbourhood's halves differ by, or what an edge
/// through it would leave, if that is more.
///
/// A pixel itself counts as it was foreseen before its last rays, [`Pixel::foreseen`]. What its halves differ by states
/// its error in the end: if the same number chose when to stop, pixels would stop where it is small by chance, and the
/// picture would state less than it is off by (a bathroom's direct light at 1 %, four seeds: 1.34 times as much; 1.07
/// as it is).
///
/// Halves may agree by chance where an edge passes, and such pixels would never get more rays. An edge of contrast c
/// leaves about `c²/12 n^-3/2` of n rays a half, and shows in the second differences of the picture whose squares,
/// summed across it, are c² in the mean.
pub(crate) fn variances(pixels: &[Pixel], means: &[DVec3], width: usize) -> Vec<f64> {
    let height = pixels.len() / width.max(1);
    let bends = |k: usize| -> f64 {
        let (x, y) = (k % width, k / width);
        // A texture that goes on from pixel to pixel is no edge.
        let mean = |j: usize| means[j] * pixels[k].texture.over(&pixels[j].texture);
        let bend = |inside: bool, step: usize| -> f64 {
            if inside { (mean(k - step) - 2.0 * means[k] + mean(k + step)).length_squared() } else { 0.0 }
        };
        bend(x > 0 && x + 1 < width, 1) + bend(y > 0 && y + 1 < height, width)
    };
    let bends: Vec<f64> = (0..pixels.len()).into_par_iter().map(bends).collect();
    let around = |k: usize| {
        let (x, y) = (k % width, k / width);
        let columns = x.saturating_sub(POOL)..(x + POOL + 1).min(width);
        let rows = y.saturating_sub(POOL)..(y + POOL + 1).min(height);
        let pool = || rows.clone().flat_map(|y| columns.clone().map(move |x| y * width + x));
        let n = (columns.len() * rows.len()) as f64;
        let difference = |j: usize| match j == k {
            true => pixels[j].foreseen,
            // A small face is in one pixel.
            false if pixels[j].is_explained => 0.0,
            false => pixels[j].differed,
        };
        let edge = pool().map(|j| bends[j]).sum::<f64>() / n / 12.0 * f64::from(pixels[k].count).powf(-1.5);
        (pool().map(difference).sum::<f64>() / n).max(edge).max(pixels[k].foretold().element_sum())
    };
    (0..pixels.len()).into_par_iter().map(around).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pixel that so many camera rays of each half found some light in.
    fn pixel(count: u32, light: [f64; 2]) -> Pixel {
        Pixel::of_halves(count, light)
    }

    /// Pixels that a few rays see a lamp of 500 W/(m² sr) in once counted it as picture: 14 street lamps stated 0.44 %
    /// where what they light was off by 1.75 %.
    #[test]
    fn a_sliver_of_a_lamp_makes_no_error_small() {
        let share = |pixels: &[Pixel]| {
            let Measured { variance, signal, .. } = measure(pixels);
            variance / signal
        };
        let mut pixels: Vec<Pixel> = (0..16).map(|_| pixel(64, [1.0, 0.9])).collect();
        let without = share(&pixels);
        let lamp = DVec3::splat(64.0 * 500.0);
        (pixels[3].emitted, pixels[3].emitting) = ([lamp; 2], 1);
        assert!((share(&pixels) / without - 1.0).abs() < 1e-9, "{} {without}", share(&pixels));
        pixels[3].emitted = [lamp, DVec3::ZERO];
        assert!(share(&pixels) > without, "the lamp's outline is noise");
        // A picture of nothing but lamps is judged by them.
        pixels.iter_mut().for_each(|pixel| pixel.counts_emission = true);
        assert!(share(&pixels) > 100.0 * without);
    }
}
