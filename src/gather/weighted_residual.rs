//! By how much a picture is off because of the light it reads on patches, measured at points: the dual-weighted
//! residual of the equation that patches stand for (R. Becker, R. Rannacher, *An optimal control approach to a
//! posteriori error estimation*, Acta Numerica 10, 2001).
//!
//! The light L_h that is read on patches misses the equation of points by `r = E + K L_h - L_h`, and the picture misses
//! that of the exact light by
//!
//! ```text
//! G (L - L_h) = G (I - K)^-1 r = E[ sum over the vertices of a path of w_k r_k ],
//!     r_k = glow + D_k + alpha rho L_h(z_k) - L_h(y_k)
//! ```
//!
//! whose mean over paths ([`crate::gather::importance_paths`]) has no bias however coarse the patches are: it sees the
//! noise of F, the truncation of the series, and patches that mix light which no other grid would part. If the gather
//! pass itself follows d more rays before it reads, the first d terms of the sum are left out; if it asks for direct
//! light where it reads, the term where it reads changes by what that corrects.
//!
//! The squared error is the product of two halves of the paths, so that their noise adds nothing in the mean. Single
//! pixels tell little and whole pictures hide what changes sign, so products are taken over blocks of pixels
//! ([`crate::gather::residual_blocks`]).
//!
//! Not handled: errors that change sign within the smallest block whose noise allows a statement.

use glam::DVec3;
use rayon::prelude::*;

use crate::gather::fields::Fields;
use crate::gather::importance_paths::{ImportancePaths, Path, Vertex};
use crate::gather::path_errors::{errors, sample};
use crate::gather::reading::{Direct, READINGS, Reading};
use crate::gather::reflection::SurfaceHit;
use crate::gather::residual_blocks::{ErrorBlocks, SquaredError};
use crate::patches::{Patches, Sample};
use crate::scene::Scene;
use crate::surfaces::SurfacePoint;

/// The error of the picture for every reading.
#[derive(Clone, Debug)]
pub struct Residual {
    /// By reading.
    blocks: [ErrorBlocks; READINGS],
    /// By reading, what a few pixels tell, where any were asked.
    drawn: Option<[SquaredError; READINGS]>,
}

/// What asking for direct light takes for each of its rays, in rays: points on lamps are drawn and weighed beside.
const ASKED: f64 = 2.0;
/// Standard errors below its estimate that an error of small blocks is likely to lie.
const LIKELY: f64 = 0.5;

/// Sums over the paths of a pixel or block, of either half.
type Halves = [(DVec3, f64); 2];

/// Paths that one thread measures before their sums are added to those of the pixels.
const CHUNK: usize = 1024;

/// Sums over paths, pixel by pixel, of by how much light on patches misses what is measured at points; paths may be
/// added as they are traced.
pub struct ResidualSums {
    pixels: Vec<[Halves; READINGS]>,
    /// Of the picture.
    width: usize,
    /// Paths added so far.
    taken: usize,
}

impl ResidualSums {
    /// No path's sums, for a picture of the size of the paths'.
    pub fn new(paths: &ImportancePaths) -> ResidualSums {
        let pixels = vec![[Halves::default(); READINGS]; paths.starts()];
        ResidualSums { pixels, width: paths.width, taken: 0 }
    }

    /// Adds the leading field's errors at the vertices of the paths that were not added yet.
    pub fn take(&mut self, paths: &ImportancePaths, patches: &Patches, fields: &Fields) {
        let chunks = paths.paths[self.taken..].par_chunks(CHUNK);
        let one = |path: &Path| (path.start, path.half, errors(path, patches, fields));
        let measured: Vec<Vec<_>> = chunks.map(|chunk| sums_by_pixel(chunk.iter().map(one))).collect();
        // One after the other: the sum is the same for any number of threads.
        for (pixel, sums) in measured.into_iter().flatten() {
            for (own, sum) in self.pixels[pixel as usize].iter_mut().zip(sums) {
                for half in 0..2 {
                    own[half].0 += sum[half].0;
                    own[half].1 += sum[half].1;
                }
            }
        }
        self.taken = paths.paths.len();
    }

    /// The squared error that the sums tell.
    pub fn residual(&self) -> Residual {
        // Every pixel counts alike, however many paths it has.
        let mean = |(sum, paths): (DVec3, f64)| sum / paths.max(1.0);
        let of = |reading: usize| self.pixels.iter().map(move |pixel| pixel[reading].map(mean));
        Residual { blocks: std::array::from_fn(|reading| ErrorBlocks::new(of(reading), self.width)), drawn: None }
    }
}

impl Residual {
    /// Of the errors of a picture's pixels in two halves, by reading, `width` to a row.
    #[cfg(test)]
    pub(crate) fn of_pixels(errors: &[[[DVec3; 2]; READINGS]], width: usize) -> Residual {
        let of = |reading: usize| errors.iter().map(move |pixel| pixel[reading]);
        Residual { blocks: std::array::from_fn(|reading| ErrorBlocks::new(of(reading), width)), drawn: None }
    }

    /// Beside what a few pixels tell ([`crate::gather::SampledPixels`]).
    pub(crate) fn beside(self, drawn: Option<[SquaredError; READINGS]>) -> Residual {
        Residual { drawn, ..self }
    }

    /// Whether a few pixels tell it too.
    pub(crate) fn has_drawn(&self) -> bool {
        self.drawn.is_some()
    }

    /// What a few pixels tell of a reading.
    fn drawn(&self, reading: Reading) -> Option<SquaredError> {
        self.drawn.map(|drawn| drawn[reading.number()])
    }

    /// The squared error of a reading by a few pixels if their standard error is at most `wanted`; else over blocks as
    /// small as leaves no more; else over those that tell it best.
    pub fn of(&self, reading: Reading, wanted: f64) -> SquaredError {
        let sure = self.drawn(reading).filter(|drawn| drawn.deviation <= wanted);
        sure.unwrap_or_else(|| self.blocks[reading.number()].within(wanted))
    }

    /// The squared error of a reading by a few pixels, if any were asked, and over blocks of one size each, from single
    /// pixels on.
    pub fn of_sizes(&self, reading: Reading) -> impl Iterator<Item = SquaredError> {
        self.drawn(reading).into_iter().chain(self.blocks[reading.number()].of_sizes())
    }

    /// Mean error of all pixels and channels, W/(m² sr).
    pub fn mean_error(&self, reading: Reading) -> f64 {
        self.blocks[reading.number()].mean_error()
    }

    /// What the squared error of a reading is at most, but for chance of one standard error: that of [`Residual::of`],
    /// or what blocks of one size are likely to hold beyond it.
    pub fn upper(&self, reading: Reading, wanted: f64) -> f64 {
        // Pixels that tell half as well as is wanted still tell what blocks cannot.
        let drawn = self.drawn(reading).filter(|drawn| drawn.deviation <= 2.0 * wanted);
        let told = drawn.unwrap_or_else(|| self.of(reading, wanted));
        let likely = self.of_sizes(reading).map(|s| s.value - LIKELY * s.deviation);
        likely.fold(told.value.max(0.0) + told.deviation, f64::max)
    }
}

impl ImportancePaths {
    /// Measures the light of the leading field on patches at the vertices of all paths.
    pub fn residual(&self, patches: &Patches, fields: &Fields) -> Residual {
        let mut sums = ResidualSums::new(self);
        sums.take(self, patches, fields);
        sums.residual()
    }

    /// By reading: what a gather ray takes until it has read, in rays. It goes on while what it meets is too near, and
    /// direct light is asked for where it goes on, or reads.
    pub fn prices(&self, patches: &Patches, fields: &Fields) -> [f64; READINGS] {
        let asked = ASKED * self.asked();
        let further: [f64; READINGS / 2] = std::array::from_fn(|bounces| self.further(patches, fields, bounces));
        Reading::ALL.map(|reading| {
            let read = if reading.direct == Direct::Asked { asked } else { 0.0 };
            1.0 + read + further[reading.bounces as usize] * (1.0 + asked)
        })
    }

    /// Rays that follow a gather ray before it reads, in the mean: `bounces`, and more while what they meet is near.
    fn further(&self, patches: &Patches, fields: &Fields, bounces: usize) -> f64 {
        let reads = |vertex: &Vertex| {
            let SurfaceHit { face, side, position, distance, .. } = vertex.at;
            patches.at(face, side, position).is_some_and(|patch| !fields.is_near(patch, distance))
        };
        let before = |path: &Path| {
            let read = path.vertices.iter().skip(bounces).position(reads);
            // By how much a path would have gone on that ended before is not known.
            read.map_or(path.vertices.len(), |k| k + bounces)
        };
        let count: usize = self.paths.par_iter().map(before).sum();
        count as f64 / self.paths.len().max(1) as f64
    }

    /// For every patch as it was cut samples of the light that leaves it, at the vertices of the paths, from the
    /// leading field on what they meet; as if every patch reflected its mean, so that no patch is divided for a
    /// texture.
    pub fn samples(&self, scene: &Scene, patches: &Patches, fields: &Fields) -> Vec<Vec<Sample>> {
        let chunks = self.paths.par_chunks(CHUNK);
        let vertices = |chunk: &[Path]| {
            let all = chunk.iter().flat_map(|p| &p.vertices);
            all.filter_map(|vertex| patch_sample(vertex, scene, patches, fields)).collect()
        };
        let found: Vec<Vec<(u32, Sample)>> = chunks.map(vertices).collect();
        let mut samples = vec![Vec::new(); patches.len()];
        for (whole, sample) in found.into_iter().flatten() {
            samples[whole as usize].push(sample);
        }
        samples
    }
}

/// The patch, as it was cut, that a vertex of a path lies on, with a sample of the light that leaves it.
fn patch_sample(vertex: &Vertex, scene: &Scene, patches: &Patches, fields: &Fields) -> Option<(u32, Sample)> {
    let SurfaceHit { face, side, position, .. } = vertex.at;
    let normal = patches.normal(face, side);
    let whole = patches.whole(patches.at(face, side, position)?);
    let mut light = sample(vertex, patches, fields);
    if scene.maps(face).is_some() {
        let own = vertex.found.rho;
        let mean = patches.reflectance(scene, whole as usize).as_dvec3();
        // Where a texel is black nothing is known of the light that arrives.
        let even = || vertex.found.glow + (light - vertex.found.glow) * mean / own;
        light = (own.min_element() > 0.0).then(even)?;
    }
    Some((whole, Sample { point: SurfacePoint { position, normal, face }, light }))
}

/// What a path's pixel adds up, by reading.
type PixelSums = (u32, [Halves; READINGS]);

/// Adds up the errors of paths, those of one pixel beside each other.
fn sums_by_pixel(errors: impl Iterator<Item = (u32, usize, [DVec3; READINGS])>) -> Vec<PixelSums> {
    let mut sums: Vec<PixelSums> = Vec::new();
    for (pixel, half, errors) in errors {
        if sums.last().is_none_or(|last| last.0 != pixel) {
            sums.push((pixel, [Halves::default(); READINGS]));
        }
        let last = sums.len() - 1;
        for (own, error) in sums[last].1.iter_mut().zip(errors) {
            own[half].0 += error;
            own[half].1 += 1.0;
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::view::{Ready, View};
    use crate::light::{Mode, Rgb};
    use crate::rays::sobol::hash;

    /// Four paths of each pixel of a view, and light 1 on its patches.
    fn followed(view: &View) -> (ImportancePaths, Fields) {
        let mut paths = ImportancePaths::new(view, vec![1.0; view.width * view.height], 3);
        paths.extend(view, 4);
        (paths, Fields::new(&[vec![Rgb::ONE; view.patches.len()]]))
    }

    /// Errors that change sign from pixel to pixel are none in blocks.
    #[test]
    fn what_single_pixels_tell_counts_where_it_is_sure() {
        let pixel = |k: usize| {
            let error = if (k % 16 + k / 16).is_multiple_of(2) { 1.0 } else { -1.0 };
            // Noise hides single pixels.
            let noise = if hash(k as u32, 1).is_multiple_of(2) { 9.0 } else { -9.0 };
            [[DVec3::splat(error + noise), DVec3::splat(error - noise)]; READINGS]
        };
        let blocks = Residual::of_pixels(&(0..256).map(pixel).collect::<Vec<_>>(), 16);
        let drawn = |deviation: f64| [SquaredError { value: 1.0, deviation }; READINGS];
        let told = |residual: &Residual| (residual.of(Reading::PLAIN, 0.1).value, residual.upper(Reading::PLAIN, 0.1));
        let sure = blocks.clone().beside(Some(drawn(0.1)));
        assert_eq!(told(&sure), (1.0, 1.1));
        let unsure = blocks.clone().beside(Some(drawn(0.2)));
        assert_eq!(told(&unsure).0, told(&blocks).0);
        assert!(told(&unsure).1 >= 0.9 && told(&blocks).0 < 0.9, "{:?} {:?}", told(&unsure), told(&blocks));
    }

    /// In a closed room nothing ends a ray but what it reads, and its glow is asked for without a ray.
    #[test]
    fn a_reading_is_priced_by_the_rays_it_takes() {
        let ready = Ready::new("furnace", Mode::Global.transport(), 24);
        let view = ready.view(8, 8);
        let (paths, fields) = followed(&view);
        let far = paths.prices(view.patches, &fields);
        assert_eq!(paths.asked(), 0.0);
        // Paths of a room that absorbs half of the light seldom end where the first reads.
        for (reading, price) in Reading::ALL.into_iter().zip(far).take(2) {
            assert_eq!(price, 1.0, "{reading:?}");
        }
        let second = far[2];
        assert!(1.9 < second && second <= 2.0, "{second}");
        // Where everything is near, a ray goes on as long as its path does.
        let near = fields.not_read_nearer(vec![f32::INFINITY; view.patches.len()]);
        let vertices: usize = paths.paths.iter().map(|path| path.vertices.len()).sum();
        assert_eq!(paths.prices(view.patches, &near)[0], 1.0 + vertices as f64 / paths.paths.len() as f64);
    }

    /// Each vertex of the furnished room's paths asks its lamps by rays; what is asked costs as much at every reading.
    #[test]
    fn asking_for_direct_light_has_its_price() {
        let ready = Ready::new("furnished-room", Mode::Global.transport(), 100);
        let view = ready.view(8, 8);
        let (paths, fields) = followed(&view);
        let prices = paths.prices(view.patches, &fields);
        let asked = ASKED * paths.asked();
        let most = ASKED * view.luminaires.list.len() as f64;
        assert!(0.0 < asked && asked <= most, "{asked} {most}");
        assert!((prices[1] - prices[0] - asked).abs() < 1e-12 && (prices[3] - prices[2] - asked).abs() < 1e-12);
    }
}
