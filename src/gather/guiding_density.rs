//! Densities over the directions of hemisphere rays, and the light expected there.
//!
//! Cosine-distributed directions are made of points of the unit square. Each of its cells has a density g, with mean 1
//! over the square, and an expected light m. Points are warped so that they fall with this density, and a ray that
//! reads L counts
//!
//! ```text
//! mean of m + (L - m) / g
//! ```
//!
//! whose mean is that of L for every g > 0 and every m (importance sampling with a control variate; A. Owen, Y. Zhou,
//! *Safe and effective importance sampling*, 2000). Its variance is least where g goes as the root mean square of L - m
//! in the cell. The warp is monotonous row by row and cell by cell, so that well spread points stay well spread.
//!
//! Not handled: light that differs within a cell, beside what its density says of it.

use crate::light::Rgb;
use crate::rays::FAN;

/// Cells to each side of the square.
pub(crate) const CELLS: usize = 16;
/// The least density: no ray counts more than its inverse.
const FLOOR: f32 = 0.2;

/// Densities over the square of directions.
#[derive(Clone, Debug)]
pub(crate) struct GuidingDensity {
    /// Share of the points in the rows before each row.
    rows: [f32; CELLS + 1],
    /// Row by row the share of its points in the cells before each cell.
    cells: [[f32; CELLS + 1]; CELLS],
    /// Light expected of each cell.
    expected: [Rgb; CELLS * CELLS],
    /// Its mean.
    mean: Rgb,
}

/// A fan's rays after a density has warped their points.
pub(crate) struct Warped {
    /// What the light that a ray reads counts.
    pub weights: [f32; FAN],
    /// The cell that each ray's point lies in.
    pub cells: [u8; FAN],
    /// What is added to the weighted light of each ray: the mean over the square of what is expected, less what is
    /// expected of its own cell, weighted.
    pub offsets: [Rgb; FAN],
}

/// One ray after a density has warped its point, as in [`Warped`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct WarpedRay {
    pub weight: f32,
    pub cell: u8,
    pub offset: Rgb,
}

impl Warped {
    /// Rays that count alike.
    pub const EVEN: Warped = Warped { weights: [1.0; FAN], cells: [0; FAN], offsets: [Rgb::ZERO; FAN] };
}

impl GuidingDensity {
    /// The density of cells by numbers of any mean above 0, and expected light, row by row.
    pub fn new(density: &[f32; CELLS * CELLS], expected: [Rgb; CELLS * CELLS]) -> GuidingDensity {
        let mean = density.iter().sum::<f32>() / (CELLS * CELLS) as f32;
        let g = |k: usize| FLOOR + (1.0 - FLOOR) * density[k] / mean;
        let sums = |row: usize| until(|cell| g(row * CELLS + cell));
        GuidingDensity {
            rows: shares(&until(|row| sums(row)[CELLS])),
            cells: std::array::from_fn(|row| shares(&sums(row))),
            expected,
            mean: expected.iter().sum::<Rgb>() / (CELLS * CELLS) as f32,
        }
    }

    /// Warps points of the square; tells the weight of each and the cell that it comes to lie in.
    pub fn warp(&self, u: &mut [f32; FAN], v: &mut [f32; FAN]) -> Warped {
        let mut warped = Warped::EVEN;
        for k in 0..FAN {
            let one = self.warp_one(&mut u[k], &mut v[k]);
            (warped.weights[k], warped.cells[k], warped.offsets[k]) = (one.weight, one.cell, one.offset);
        }
        warped
    }

    /// Warps one point of the square.
    #[inline]
    pub fn warp_one(&self, u: &mut f32, v: &mut f32) -> WarpedRay {
        let row = step(&self.rows, v);
        let cell = step(&self.cells[row.at], u);
        let weight = row.weight * cell.weight;
        let at = row.at * CELLS + cell.at;
        WarpedRay { weight, cell: at as u8, offset: self.mean - weight * self.expected[at] }
    }
}

/// The step of a piecewise constant density that a number fell on, and its inverse density.
struct Step {
    at: usize,
    weight: f32,
}

/// Takes a number through the inverse of a distribution.
#[inline]
fn step(until: &[f32; CELLS + 1], u: &mut f32) -> Step {
    // The number of ends of steps at or below u, in four halvings.
    let mut at = 0;
    let mut half = CELLS / 2;
    while half > 0 {
        at += if until[at + half] <= *u { half } else { 0 };
        half /= 2;
    }
    let share = until[at + 1] - until[at];
    let inside = ((*u - until[at]) / share).clamp(0.0, 1.0 - f32::EPSILON);
    *u = ((at as f32 + inside) / CELLS as f32).min(1.0 - f32::EPSILON / 2.0);
    Step { at, weight: 1.0 / (share * CELLS as f32) }
}

/// Sums of a function of the cells before each cell, and of all.
fn until(value: impl Fn(usize) -> f32) -> [f32; CELLS + 1] {
    let mut sums = [0.0; CELLS + 1];
    for k in 0..CELLS {
        sums[k + 1] = sums[k] + value(k);
    }
    sums
}

fn shares(sums: &[f32; CELLS + 1]) -> [f32; CELLS + 1] {
    let mut shares = sums.map(|s| s / sums[CELLS]);
    shares[CELLS] = 1.0;
    shares
}

/// The cell of a point of the square that no density has warped.
#[inline]
pub(crate) fn cell(u: f32, v: f32) -> u8 {
    let of = |x: f32| ((x * CELLS as f32) as usize).min(CELLS - 1);
    (of(v) * CELLS + of(u)) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rays::sobol::Sobol;
    use proptest::prelude::*;

    /// Light with an edge across cells.
    fn light(u: f32, v: f32) -> f32 {
        if u + 0.5 * v > 0.83 { 1.0 } else { 0.1 + u }
    }

    /// Mean of what rays count and the largest weight.
    fn estimate(guiding: &GuidingDensity, rays: u32) -> (f32, f32) {
        let sobol = Sobol::new(rays as usize, 2);
        let (mut sum, mut most) = (0.0, 0.0_f32);
        for first in (0..rays).step_by(FAN) {
            let mut u = std::array::from_fn(|k| sobol.point(first + k as u32, 0, 3));
            let mut v = std::array::from_fn(|k| sobol.point(first + k as u32, 1, 3));
            let warped = guiding.warp(&mut u, &mut v);
            for k in 0..FAN {
                assert_eq!(cell(u[k], v[k]), warped.cells[k], "{} {}", u[k], v[k]);
                sum += warped.weights[k] * light(u[k], v[k]) + warped.offsets[k].x;
                most = most.max(warped.weights[k]);
            }
        }
        (sum / rays as f32, most)
    }

    proptest! {
        #[test]
        fn every_density_has_the_same_mean(
            density in prop::collection::vec(0.0..1.0f32, CELLS * CELLS),
            expected in prop::collection::vec(0.0..1.0f32, CELLS * CELLS),
        ) {
            let guiding = GuidingDensity::new(
                &std::array::from_fn(|k| density[k] + 1e-3),
                std::array::from_fn(|k| Rgb::splat(expected[k])),
            );
            const RAYS: u32 = 16_384;
            let (found, most) = estimate(&guiding, RAYS);
            // A thousand rows of midpoints: the edge's cells leave 1e-3.
            let at = |k: u32| (k as f32 + 0.5) / 1000.0;
            let all = (0..1000).flat_map(|i| (0..1000).map(move |k| light(at(k), at(i))));
            let truth = (all.map(f64::from).sum::<f64>() / 1e6) as f32;
            // Four standard errors of independent rays that count at most 2 / FLOOR beside each other.
            let bound = 4.0 / FLOOR / (RAYS as f32).sqrt();
            prop_assert!((found - truth).abs() < bound, "{found} {truth}");
            prop_assert!(most <= 1.001 / FLOOR);
        }
    }

    #[test]
    fn rays_that_find_what_is_expected_have_no_noise() {
        let steps = |k: usize| if k.is_multiple_of(3) { 2.0 } else { 0.5 };
        let guiding = GuidingDensity::new(&[1.0; CELLS * CELLS], std::array::from_fn(|k| Rgb::splat(steps(k))));
        let (mut u, mut v) = ([0.31; FAN], [0.77; FAN]);
        let warped = guiding.warp(&mut u, &mut v);
        let found = warped.weights[0] * steps(warped.cells[0] as usize) + warped.offsets[0].x;
        let mean = (0..CELLS * CELLS).map(steps).sum::<f32>() / (CELLS * CELLS) as f32;
        // 256 roundings of 6e-8.
        assert!((found - mean).abs() < 2e-5, "{found} {mean}");
    }
}
