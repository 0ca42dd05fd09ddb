//! Path guiding: what hemisphere rays of neighbouring records found, direction by direction, and the densities that
//! later rays follow.
//!
//! Records close to each other in the picture that look the same way see much the same. Their rays build one density:
//! the light expected of each cell of directions, and how it varies there. Only rays cast later follow it, so their
//! mean stays unbiased (T. Müller, M. Gross, J. Novák, *Practical path guiding for efficient light-transport
//! simulation*, 2017). Sums are kept as whole numbers, which add up to the same in any order and so for any number of
//! threads.
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
//! Not handled: what is seen from one point of a place only, as at an edge; light that differs within a cell.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use glam::{DVec3, Vec3};
use halflight_team::Loop;
use rayon::prelude::*;

use crate::light::Rgb;
use crate::rays::FAN;

/// Rays that a density is made of at least: one for every four cells.
const ENOUGH: f32 = (CELLS * CELLS / 4) as f32;
/// Rays over those that a density was made of, from which it is worth making anew: its noise falls by a tenth.
const MORE: f32 = 1.25;
/// Rays of mean light that every cell is thought to have met before its own.
const PRIOR: f32 = 2.0;
/// Share of the mean square of light that a cell may vary by beyond what few rays show.
const UNSEEN: f32 = 0.1;
/// What the brightest light of patches is counted as.
const UNIT: f64 = (1_u64 << 36) as f64;
/// How much brighter light may be counted: 2^24 rays of a cell do not overflow.
const BRIGHTEST: f64 = 4.0;
/// Normals whose coordinates round alike at this many steps to 1 share a density.
const NORMALS: f32 = 3.0;

/// A number for each cell.
type Cells = [f32; CELLS * CELLS];

/// Statistics of what the rays of one place found, cell by cell.
struct CellStatistics {
    /// Length of the light that all is counted in.
    brightest: f32,
    /// Sum over the rays through each cell of the square of what they read, times [`UNIT`].
    squares: Vec<AtomicU64>,
    /// Sums of what they read, channel by channel, times [`UNIT`].
    sums: [Vec<AtomicU64>; 3],
    /// Number of rays through each cell.
    counts: Vec<AtomicU32>,
}

/// What rays through one cell found.
pub(crate) struct CellSums {
    pub cell: u8,
    pub sums: [u64; 3],
    pub squares: u64,
    pub count: u32,
}

impl CellStatistics {
    fn none(brightest: f32) -> CellStatistics {
        let none = || (0..CELLS * CELLS).map(|_| AtomicU64::new(0)).collect();
        CellStatistics {
            brightest,
            squares: none(),
            sums: [none(), none(), none()],
            counts: (0..CELLS * CELLS).map(|_| AtomicU32::new(0)).collect(),
        }
    }

    /// Takes out the numbers of the cells that rays went through, and leaves none.
    fn take(&mut self) -> Vec<CellSums> {
        let mut taken = Vec::new();
        for (k, count) in self.counts.iter_mut().enumerate().filter(|(_, count)| count.load(Ordering::Relaxed) > 0) {
            let sums = self.sums.each_mut().map(|sums| std::mem::take(sums[k].get_mut()));
            let squares = std::mem::take(self.squares[k].get_mut());
            taken.push(CellSums { cell: k as u8, sums, squares, count: std::mem::take(count.get_mut()) });
        }
        taken
    }

    /// Adds numbers of some cells.
    fn add(&mut self, more: &[CellSums]) {
        for own in more {
            let k = usize::from(own.cell);
            self.sums.iter_mut().zip(own.sums).for_each(|(sums, more)| *sums[k].get_mut() += more);
            *self.squares[k].get_mut() += own.squares;
            *self.counts[k].get_mut() += own.count;
        }
    }

    /// Number of rays so far.
    fn rays(&self) -> f32 {
        self.counts.iter().map(|count| count.load(Ordering::Relaxed) as f32).sum()
    }

    /// The density that these rays make; none where they are dark.
    fn density(&self) -> Option<GuidingDensity> {
        let known = CellCounts::new(&self.counts);
        let squares = known.expected(&self.squares);
        if squares.iter().all(|s| *s <= 0.0) {
            return None;
        }
        let channels = [0, 1, 2].map(|c| known.expected(&self.sums[c]));
        let light = |k: usize| Rgb::from_array(channels.map(|c| c[k]));
        let mean = squares.iter().sum::<f32>() / squares.len() as f32;
        let spread = |k: usize| {
            let seen = (squares[k] - light(k).length_squared()).max(0.0);
            (seen + UNSEEN * mean * PRIOR / (known.near[k] + PRIOR)).sqrt()
        };
        let expected = std::array::from_fn(|k| light(k) * self.brightest);
        Some(GuidingDensity::new(&std::array::from_fn(spread), expected))
    }
}

/// How many rays are known of the cells.
struct CellCounts {
    own: Cells,
    /// With those of neighbours.
    near: Cells,
}

impl CellCounts {
    fn new(counts: &[AtomicU32]) -> CellCounts {
        let own: Cells = std::array::from_fn(|k| counts[k].load(Ordering::Relaxed) as f32);
        CellCounts { near: blurred(&own), own }
    }

    /// Mean of what rays through each cell and its neighbours found, drawn to that of all cells where they are few.
    fn expected(&self, sums: &[AtomicU64]) -> Cells {
        let sums: Cells = std::array::from_fn(|k| (sums[k].load(Ordering::Relaxed) as f64 / UNIT) as f32);
        // Cells weigh alike, however many rays went through each.
        let seen = (0..sums.len()).filter(|&k| self.own[k] > 0.0);
        let mean = seen.clone().map(|k| sums[k] / self.own[k]).sum::<f32>();
        let mean = mean / seen.count().max(1) as f32;
        let sums = blurred(&sums);
        std::array::from_fn(|k| (sums[k] + PRIOR * mean) / (self.near[k] + PRIOR))
    }
}

/// Weighted means of cells and their neighbours, 1 2 1 along either side: places of one density see things in
/// directions that differ.
fn blurred(value: &Cells) -> Cells {
    let near = |k: usize| [(k.saturating_sub(1), 0.25), (k, 0.5), ((k + 1).min(CELLS - 1), 0.25)];
    std::array::from_fn(|k| {
        let rows = near(k / CELLS).into_iter();
        let each = rows.flat_map(|(row, a)| near(k % CELLS).map(|(cell, b)| a * b * value[row * CELLS + cell]));
        each.sum()
    })
}

/// Guiding densities by place in the picture and normal.
pub(crate) struct GuidingField {
    /// Pixels to a side of the squares that share densities.
    tile: usize,
    width: usize,
    /// Length of the brightest light.
    brightest: f64,
    numbers: HashMap<(u32, u32, [i8; 4]), u32>,
    places: Vec<GuidedPlace>,
}

/// What rays of one place found, and the density that later ones follow.
pub(crate) struct GuidedPlace {
    statistics: CellStatistics,
    /// What rays of this process found and others do not know yet; none where it has cast all.
    news: Option<Box<CellStatistics>>,
    density: Option<Box<GuidingDensity>>,
    /// Rays that the density was made of.
    rays: f32,
}

impl GuidedPlace {
    /// Nothing found yet; `brightest` is the length of the light that all is counted in.
    pub(crate) fn none(brightest: f64) -> GuidedPlace {
        GuidedPlace { statistics: CellStatistics::none(brightest as f32), news: None, density: None, rays: 0.0 }
    }

    /// The density to follow, and where rays are recorded.
    pub(crate) fn guiding(&self) -> Guiding<'_> {
        let scale = 1.0 / f64::from(self.statistics.brightest);
        let statistics = self.news.as_deref().unwrap_or(&self.statistics);
        Guiding { density: self.density.as_deref(), statistics: Some(statistics), scale }
    }

    /// Makes the density anew where rays have become more by a share that shows.
    pub(crate) fn update(&mut self) {
        let rays = self.statistics.rays();
        if rays >= ENOUGH.max(MORE * self.rays) {
            self.rays = rays;
            self.density = self.statistics.density().map(Box::new);
        }
    }
}

impl GuidingField {
    /// No densities yet, for squares of `tile` pixels of a picture so many pixels wide; no light is much brighter than
    /// `brightest`.
    pub(crate) fn new(tile: usize, width: usize, brightest: f64) -> GuidingField {
        GuidingField {
            tile,
            width,
            brightest: brightest.max(f64::from(f32::MIN_POSITIVE)),
            numbers: HashMap::new(),
            places: Vec::new(),
        }
    }

    /// The number of the density for a normal seen in pixel k.
    pub(crate) fn number(&mut self, k: usize, normal: Vec3) -> u32 {
        let round = |x: f32| (NORMALS * x).round() as i8;
        // The directions' frame turns over where z changes sign.
        let way = [round(normal.x), round(normal.y), round(normal.z), i8::from(normal.z.is_sign_negative())];
        let (x, y) = (k % self.width / self.tile, k / self.width / self.tile);
        let next = self.places.len() as u32;
        let number = *self.numbers.entry((x as u32, y as u32, way)).or_insert(next);
        if number == next {
            self.places.push(GuidedPlace::none(self.brightest));
        }
        number
    }

    /// Makes densities anew from what rays have found, where those have become more, and is ready for the rays of a
    /// loop.
    pub(crate) fn update(&mut self, casts: &Loop) {
        let (is_shared, brightest) = (!casts.is_everyone(), self.brightest as f32);
        self.places.par_iter_mut().for_each(|place| {
            place.update();
            if is_shared {
                place.news.get_or_insert_with(|| Box::new(CellStatistics::none(brightest)));
            }
        });
    }

    /// Takes in what the rays of a loop have found.
    pub(crate) fn gather(&mut self, casts: &Loop) {
        let news = |(k, place): (usize, &mut GuidedPlace)| {
            let own = place.news.as_mut()?.take();
            (!own.is_empty()).then_some((k, own))
        };
        let own: Vec<(usize, Vec<CellSums>)> = self.places.par_iter_mut().enumerate().filter_map(news).collect();
        for (k, more) in casts.all(own).into_iter().flatten() {
            self.places[k].statistics.add(&more);
        }
    }

    /// The density of a number, and where its rays are recorded.
    pub(crate) fn of(&self, number: u32) -> Guiding<'_> {
        self.places[number as usize].guiding()
    }
}

/// A density to follow, and where to record what rays find.
#[derive(Clone, Copy)]
pub(crate) struct Guiding<'a> {
    density: Option<&'a GuidingDensity>,
    statistics: Option<&'a CellStatistics>,
    /// The inverse length of the brightest light.
    scale: f64,
}

impl Guiding<'_> {
    /// No density; nothing is recorded.
    pub(crate) const NONE: Guiding<'static> = Guiding { density: None, statistics: None, scale: 0.0 };

    /// Warps the points of a fan.
    #[inline]
    pub(crate) fn warp(&self, u: &mut [f32; FAN], v: &mut [f32; FAN]) -> Warped {
        match (self.density, self.statistics) {
            (Some(density), _) => density.warp(u, v),
            (None, None) => Warped::EVEN,
            (None, Some(_)) => Warped { cells: std::array::from_fn(|k| cell(u[k], v[k])), ..Warped::EVEN },
        }
    }

    /// Records what light a ray through a cell found.
    #[inline]
    pub(crate) fn record(&self, cell: u8, light: DVec3) {
        let Some(statistics) = self.statistics else { return };
        let whole = |x: f64, most: f64| (UNIT * x.clamp(0.0, most)) as u64;
        let light = self.scale * light;
        let cell = cell as usize;
        statistics.squares[cell].fetch_add(whole(light.length_squared(), BRIGHTEST * BRIGHTEST), Ordering::Relaxed);
        for (sums, x) in statistics.sums.iter().zip(light.to_array()) {
            sums[cell].fetch_add(whole(x, BRIGHTEST), Ordering::Relaxed);
        }
        statistics.counts[cell].fetch_add(1, Ordering::Relaxed);
    }
}

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
    pub(crate) const EVEN: Warped = Warped { weights: [1.0; FAN], cells: [0; FAN], offsets: [Rgb::ZERO; FAN] };
}

impl GuidingDensity {
    /// The density of cells by numbers of any mean above 0, and expected light, row by row.
    pub(crate) fn new(density: &[f32; CELLS * CELLS], expected: [Rgb; CELLS * CELLS]) -> GuidingDensity {
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
    pub(crate) fn warp(&self, u: &mut [f32; FAN], v: &mut [f32; FAN]) -> Warped {
        let mut warped = Warped::EVEN;
        for k in 0..FAN {
            let one = self.warp_one(&mut u[k], &mut v[k]);
            (warped.weights[k], warped.cells[k], warped.offsets[k]) = (one.weight, one.cell, one.offset);
        }
        warped
    }

    /// Warps one point of the square.
    #[inline]
    pub(crate) fn warp_one(&self, u: &mut f32, v: &mut f32) -> WarpedRay {
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
    use proptest::prelude::*;

    use super::*;
    use crate::rays::sobol::Sobol;

    /// Records rays that see light in a quarter of the directions; returns how often rays that follow go there.
    fn followed(rays: usize) -> f32 {
        let mut field = GuidingField::new(8, 64, 1.0);
        let number = field.number(100, Vec3::X);
        let light = |cell: u8| {
            let (row, column) = (cell as usize / CELLS, cell as usize % CELLS);
            // Speckled, so that what is expected of a cell is not what its rays find.
            let bright = row < CELLS / 2 && column < CELLS / 2;
            if bright { 1.0 } else { 0.0 }
        };
        for k in 0..rays {
            let cell = (k * 37 % (CELLS * CELLS)) as u8;
            let speckle = f64::from(u32::from(k % 2 == 0));
            field.of(number).record(cell, DVec3::splat(light(cell) * speckle));
        }
        field.update(&Loop::everyone(0));
        let at = |k: usize| (k as f32 + 0.5) / FAN as f32;
        let mut there = 0.0;
        for row in 0..FAN {
            let (mut u, mut v) = (std::array::from_fn(at), [at(row); FAN]);
            let warped = field.of(number).warp(&mut u, &mut v);
            there += warped.cells.iter().map(|&c| light(c) as f32).sum::<f32>();
        }
        there / (FAN * FAN) as f32
    }

    #[test]
    fn rays_go_where_light_was_uneven() {
        // Too few rays teach nothing: a quarter of the directions is a quarter of the rays.
        assert_eq!(followed(ENOUGH as usize - 1), 0.25);
        // By density 1 there and the floor elsewhere it would be 1 / (1 + 3 * 0.2) = 0.62; unseen light and blur take a
        // little.
        assert!(followed(8192) > 0.5, "{}", followed(8192));
    }

    #[test]
    fn places_and_normals_have_their_own_densities() {
        let mut field = GuidingField::new(8, 64, 1.0);
        let own = field.number(3, Vec3::Z);
        assert_eq!(field.number(7 + 64 * 7, Vec3::Z), own);
        assert_ne!(field.number(8, Vec3::Z), own);
        assert_ne!(field.number(3, Vec3::NEG_Z), own);
    }

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
