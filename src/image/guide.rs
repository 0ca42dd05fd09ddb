//! Where around a point light comes from, as rays nearby found it, so that later rays go there more often.
//!
//! Cosine-distributed directions are made of points of the unit square. A guide gives each of its cells a density g, with mean 1 over
//! the square; points are bent so that they fall with this density, and what their rays read counts 1/g. The mean is the same for every g > 0;
//! the variance is least where g goes as the root of the mean square of what rays through the cell read (importance
//! sampling; T. Müller, M. Gross, J. Novák, *Practical path guiding*, 2017). The bend is monotonous row by row and cell by cell, so that well
//! spread points stay well spread. Rays of points of one place and normal teach one guide; only rays cast later follow it,
//! so their mean stays unbiased.
//!
//! Sums are kept as whole numbers, which add up to the same in any order.
//!
//! Not handled: light from the directions of less than a cell beside dark ones, which gets the density of the cell.

use std::collections::HashMap;
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::light::Rgb;
use crate::rays::FAN;

/// Cells to each side of the square.
const CELLS: usize = 16;
/// The least density: no ray counts more than its inverse.
const FLOOR: f32 = 0.2;
/// Rays that a guide is made of at least: one for every four cells.
const ENOUGH: u32 = (CELLS * CELLS / 4) as u32;
/// Rays of the mean brightness that every cell is thought to have met before its own.
const PRIOR: f32 = 2.0;
/// What the square of the brightest light of patches is counted as, and how much brighter light may be counted.
const UNIT: f64 = (1_u64 << 36) as f64;
const BRIGHTEST: f64 = 16.0;
/// Normals whose coordinates round alike at this many steps to 1 share a guide.
const NORMALS: f32 = 3.0;

/// Densities over the square of directions.
#[derive(Clone, Debug)]
pub(super) struct Guide {
    /// Share of the points in the rows before each row.
    rows: [f32; CELLS + 1],
    /// Row by row the share of its points in the cells before each cell.
    cells: [[f32; CELLS + 1]; CELLS],
    /// Light expected of each cell.
    expected: [Rgb; CELLS * CELLS],
    /// Its mean.
    mean: Rgb,
}

/// A fan's rays after a guide has bent their points.
pub(super) struct Bent {
    /// What the light that a ray reads counts.
    pub weights: [f32; FAN],
    /// The cell that each ray's point lies in.
    pub cells: [u8; FAN],
    /// What is added to the weighted light of each ray: the mean over the square of what is expected, less what is expected of its
    /// own cell, weighted.
    pub offsets: [Rgb; FAN],
}

impl Bent {
    /// Rays that count alike.
    pub const EVEN: Bent = Bent {
        weights: [1.0; FAN],
        cells: [0; FAN],
        offsets: [Rgb::ZERO; FAN],
    };
}

impl Guide {
    /// A guide by densities of any mean above 0, row by row.
    fn new(density: &[f32; CELLS * CELLS], expected: [Rgb; CELLS * CELLS]) -> Guide {
        let mean = density.iter().sum::<f32>() / (CELLS * CELLS) as f32;
        let g = |k: usize| FLOOR + (1.0 - FLOOR) * density[k] / mean;
        let sums = |row: usize| until(|cell| g(row * CELLS + cell));
        Guide {
            rows: shares(&until(|row| sums(row)[CELLS])),
            cells: std::array::from_fn(|row| shares(&sums(row))),
            expected,
            mean: expected.iter().sum::<Rgb>() / (CELLS * CELLS) as f32,
        }
    }

    /// Bends points of the square; tells the weight of each and the cell that it comes to lie in.
    pub fn bend(&self, u: &mut [f32; FAN], v: &mut [f32; FAN]) -> Bent {
        let mut bent = Bent::EVEN;
        for k in 0..FAN {
            let row = step(&self.rows, &mut v[k]);
            let cell = step(&self.cells[row.at], &mut u[k]);
            bent.weights[k] = row.weight * cell.weight;
            let at = row.at * CELLS + cell.at;
            bent.cells[k] = at as u8;
            bent.offsets[k] = self.mean - bent.weights[k] * self.expected[at];
        }
        bent
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
    Step {
        at,
        weight: share * CELLS as f32,
    }
    .inverse()
}

impl Step {
    fn inverse(self) -> Step {
        Step {
            weight: 1.0 / self.weight,
            ..self
        }
    }
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

/// The cell of a point of the square that no guide has bent.
#[inline]
pub(super) fn cell(u: f32, v: f32) -> u8 {
    let of = |x: f32| ((x * CELLS as f32) as usize).min(CELLS - 1);
    (of(v) * CELLS + of(u)) as u8
}

/// What rays of one place found in the cells.
struct Lessons {
    brightest: f32,
    /// Sum over the rays through each cell of the square of what they read, in [`UNIT`]s of the brightest light's.
    squares: Vec<AtomicU64>,
    /// The same of what they read, channel by channel.
    sums: Vec<[AtomicU64; 3]>,
    counts: Vec<AtomicU32>,
}

impl Lessons {
    fn none(brightest: f32) -> Lessons {
        Lessons {
            brightest,
            squares: (0..CELLS * CELLS).map(|_| AtomicU64::new(0)).collect(),
            sums: (0..CELLS * CELLS).map(|_| Default::default()).collect(),
            counts: (0..CELLS * CELLS).map(|_| AtomicU32::new(0)).collect(),
        }
    }

    /// The guide that these rays teach; none where they are few, or dark.
    fn guide(&self) -> Option<Guide> {
        let squares = |k: usize| (self.squares[k].load(Ordering::Relaxed) as f64 / UNIT) as f32;
        let counts = |k: usize| self.counts[k].load(Ordering::Relaxed) as f32;
        let all = 0..CELLS * CELLS;
        let count: f32 = all.clone().map(counts).sum();
        // Cells weigh alike, however many rays went through each.
        let known: Vec<usize> = all.clone().filter(|&k| counts(k) > 0.0).collect();
        let mean = |value: &dyn Fn(usize) -> f32| {
            known.iter().map(|&k| value(k) / counts(k)).sum::<f32>() / known.len().max(1) as f32
        };
        let square = mean(&squares);
        if count < ENOUGH as f32 || square <= 0.0 {
            return None;
        }
        let near = blurred(counts);
        let expect = |value: &dyn Fn(usize) -> f32| -> [f32; CELLS * CELLS] {
            let (sums, mean) = (blurred(value), mean(value));
            std::array::from_fn(|k| (sums[k] + PRIOR * mean) / (near[k] + PRIOR))
        };
        let channel = |c: usize| {
            expect(&|k: usize| (self.sums[k][c].load(Ordering::Relaxed) as f64 / UNIT) as f32)
        };
        let (channels, squares) = ([0, 1, 2].map(channel), expect(&squares));
        let light = |k: usize| Rgb::new(channels[0][k], channels[1][k], channels[2][k]);
        let spread = |k: usize| {
            let v = squares[k] - light(k).length_squared();
            (v.max(0.0) + PRIOR * square / (near[k] + PRIOR) * 0.1).sqrt()
        };
        let spread = std::array::from_fn(spread);
        let brightest = self.brightest;
        Some(Guide::new(
            &spread,
            std::array::from_fn(|k| light(k) * brightest),
        ))
    }
}

/// Weighted means of cells and their neighbours, 1 2 1 along either side: places of one guide see things in directions that differ.
fn blurred(value: impl Fn(usize) -> f32) -> [f32; CELLS * CELLS] {
    let near = |k: usize| {
        [
            (k.saturating_sub(1), 0.25),
            (k, 0.5),
            ((k + 1).min(CELLS - 1), 0.25),
        ]
    };
    std::array::from_fn(|k| {
        let rows = near(k / CELLS).into_iter();
        let each = rows.flat_map(|(row, a)| {
            near(k % CELLS).map(|(cell, b)| a * b * value(row * CELLS + cell))
        });
        each.sum()
    })
}

/// Guides by place in the picture and normal.
pub(super) struct Guides {
    /// Pixels to a side of the squares that share guides.
    tile: usize,
    width: usize,
    /// The inverse square of the brightest light, times [`UNIT`].
    brightest: f64,
    numbers: HashMap<(u32, u32, [i8; 4]), u32>,
    lessons: Vec<Lessons>,
    guides: Vec<Option<Guide>>,
}

impl Guides {
    /// No guides yet, for squares of `tile` pixels of a picture so many pixels wide; no light is much brighter than `brightest`.
    pub fn new(tile: usize, width: usize, brightest: f64) -> Guides {
        Guides {
            tile,
            width,
            brightest: brightest.max(1e-18),
            numbers: HashMap::new(),
            lessons: Vec::new(),
            guides: Vec::new(),
        }
    }

    /// The number of the guide for a normal seen in pixel k.
    pub fn number(&mut self, k: usize, normal: Vec3) -> u32 {
        let round = |x: f32| (NORMALS * x).round() as i8;
        // The directions' frame turns over where z changes sign.
        let way = [
            round(normal.x),
            round(normal.y),
            round(normal.z),
            i8::from(normal.z.is_sign_negative()),
        ];
        let (x, y) = (k % self.width / self.tile, k / self.width / self.tile);
        let next = self.lessons.len() as u32;
        let number = *self
            .numbers
            .entry((x as u32, y as u32, way))
            .or_insert(next);
        if number == next {
            self.lessons.push(Lessons::none(self.brightest as f32));
            self.guides.push(None);
        }
        number
    }

    /// Makes the guides anew from all that rays have found.
    pub fn learn(&mut self) {
        let lessons = self.lessons.par_iter();
        self.guides = lessons.map(Lessons::guide).collect();
    }

    /// The guide of a number, and where its rays are told.
    pub fn of(&self, number: u32) -> Guided<'_> {
        Guided {
            guide: self.guides[number as usize].as_ref(),
            lessons: Some(&self.lessons[number as usize]),
            scale: 1.0 / self.brightest,
        }
    }
}

/// A guide to follow, and where to tell what rays find.
#[derive(Clone, Copy)]
pub(super) struct Guided<'a> {
    guide: Option<&'a Guide>,
    lessons: Option<&'a Lessons>,
    scale: f64,
}

impl Guided<'_> {
    /// No guide; nobody learns.
    pub const ALONE: Guided<'static> = Guided {
        guide: None,
        lessons: None,
        scale: 0.0,
    };

    /// Bends the points of a fan.
    #[inline]
    pub fn bend(&self, u: &mut [f32; FAN], v: &mut [f32; FAN]) -> Bent {
        match (self.guide, self.lessons) {
            (Some(guide), _) => guide.bend(u, v),
            (None, None) => Bent::EVEN,
            (None, Some(_)) => Bent {
                cells: std::array::from_fn(|k| cell(u[k], v[k])),
                ..Bent::EVEN
            },
        }
    }

    /// Tells what light a ray through a cell found.
    #[inline]
    pub fn tell(&self, cell: u8, light: DVec3) {
        let Some(lessons) = self.lessons else { return };
        let whole = |x: f64| (UNIT * x.clamp(0.0, BRIGHTEST)) as u64;
        let light = self.scale * light;
        let cell = cell as usize;
        lessons.squares[cell].fetch_add(whole(light.length_squared()), Ordering::Relaxed);
        for (sum, x) in lessons.sums[cell].iter().zip(light.to_array()) {
            sum.fetch_add(whole(x), Ordering::Relaxed);
        }
        lessons.counts[cell].fetch_add(1, Ordering::Relaxed);
    }
}
