//! The picture from the other side: walks of light send what they bring to surfaces on to the camera.
//!
//! ```text
//! mean radiance of the part B of the picture, reflected light
//!    =  mean over walks of  sum over surfaces met of  W s rho / pi · cos_y V / (d² cos³_c |B|)
//! ```
//!
//! with W s rho the power that a walk reflects there, d the distance to the camera, cos_y and cos_c the cosines at the
//! surface and at the camera, |B| the area of the part in the plane at unit distance, and V whether the camera sees the
//! surface (P. Dutré, E. Lafortune, Y. Willems, *Monte Carlo light tracing with direct computation of pixel
//! intensities*, 1993). It has no bias, and shares nothing with a picture that is gathered but the scene and its rays.
//!
//! Of parts of any size the squared difference of two means, less the variance of the walks, has the mean of the
//! picture's squared error in these parts, which is no more than the picture's (Jensen). So a difference that chance
//! does not explain bounds the error from below: what neither patches nor paths from the camera ever met is seen here.
//!
//! Walks that bring less than the picture shows may have missed rare ones. If the picture is right, of mean m in a part
//! of P pixels, and N walks bring light in portions of v a pixel, theirs has the variance `m v / (N P)` (Poisson), and
//! its square the fourth cumulant `m v³ / (N P)³` beside the normal distribution's. No less is taken, with what white
//! surfaces would have reflected as portions: `v = sum v² / sum v`, and `sum v⁴ / sum v²` for its square.
//!
//! Not handled: errors that leave the mean of every part as it is; highlights.

use std::f64::consts::PI;

use glam::DVec3;
use halflight_team::Loop;

use crate::error::light_walks::{Met, Walks};
use crate::light::Transport;
use crate::pictures::Size;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Stream, hash};
use crate::reading::View;
use crate::scene::Emitters;

/// Parts of a picture along each side, from coarse to fine; every one divides the last.
const PARTS: [usize; 3] = [1, 4, 16];
const FINEST: usize = 16;
/// Batches of walks, whose means show the variance.
const BATCHES: usize = 64;
/// Walks of a batch at least and at most.
const WALKS: (u64, u64) = (256, 1 << 14);
/// Standard errors beyond which chance does not explain a difference: of normal ones 1 picture in 10,000, at three
/// sizes of parts.
const CERTAIN: f64 = 4.0;

/// How many walks are followed, and for which picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TracingGoal {
    pub size: Size,
    /// Walks in all, about.
    pub walks: u64,
    /// Reflections of a walk at most.
    pub terms: usize,
    pub seed: u32,
}

/// The mean radiance of each part, the channels' mean, by walks of light.
pub(crate) struct TracedParts {
    size: Size,
    /// Of every batch, the finest parts.
    batches: Vec<Vec<f64>>,
    /// Pixels of each of these.
    pixels: Vec<f64>,
    /// Walks in all.
    walks: f64,
    /// The portion of light that a walk may bring a pixel, and the square of that by fourth powers.
    portion: f64,
    rare: f64,
    /// Rays cast.
    pub rays: u64,
}

/// A squared error of a picture that is at least there: an estimate without bias and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct AtLeast {
    pub squared: f64,
    pub error: f64,
}

impl AtLeast {
    /// What chance does not explain of it.
    pub(crate) fn certain(&self) -> f64 {
        (self.squared - CERTAIN * self.error).max(0.0)
    }
}

/// Follows walks from what emits, and adds up what the camera sees of them.
pub(crate) fn traced_parts(view: &View, transport: Transport, goal: &TracingGoal) -> TracedParts {
    let walks = Walks::new(view.scene, view.rays, transport, &Emitters::together());
    let count = (goal.walks / BATCHES as u64).clamp(WALKS.0, WALKS.1) as u32;
    let lens = Lens::new(view, goal.size);
    let batch = |batch: usize| {
        let (mut sums, mut portions, mut rays) = (vec![0.0; FINEST * FINEST], [0.0; 3], 0);
        let (mut hits, seed) = (Vec::new(), Purpose::LightTracing.seed(goal.seed));
        for walk in 0..count {
            let mut random = Stream::new(hash(batch as u32 * count + walk, seed));
            walks.follow(&mut random, goal.terms, &mut hits, |met: &Met| {
                rays += 1;
                if let Some((part, kernel)) = lens.sees(met) {
                    sums[part] += kernel * met.reflected.element_sum();
                    let white = kernel * met.carried;
                    portions.iter_mut().zip([1, 2, 4]).for_each(|(sum, power)| *sum += white.powi(power));
                    rays += 1;
                }
            });
        }
        sums.iter_mut().zip(&lens.pixels).for_each(|(sum, pixels)| *sum /= f64::from(count) * pixels.max(1.0));
        (sums, portions, rays)
    };
    let found = Loop::each(BATCHES).map(batch);
    let rays = found.iter().map(|(_, _, rays)| rays).sum();
    let [sum, squares, fourths] = [0, 1, 2].map(|k| found.iter().map(|(_, portions, _)| portions[k]).sum::<f64>());
    TracedParts {
        size: goal.size,
        batches: found.into_iter().map(|(sums, ..)| sums).collect(),
        pixels: lens.pixels,
        walks: f64::from(count) * BATCHES as f64,
        portion: if sum > 0.0 { squares / sum } else { f64::INFINITY },
        rare: if squares > 0.0 { fourths / squares } else { f64::INFINITY },
        rays,
    }
}

impl TracedParts {
    /// The least squared error of a picture of reflected light, of the sizes of parts that which is most certain.
    pub(crate) fn error_of(&self, reflected: impl Fn(usize) -> DVec3) -> AtLeast {
        let own = summed(self.size, |k| reflected(k).element_sum() / 3.0);
        let found = PARTS.map(|parts| self.error_in(parts, &own));
        let most = found.into_iter().max_by(|a, b| a.certain().total_cmp(&b.certain()));
        most.unwrap_or_default()
    }

    /// The same for so many parts along each side; `own` are sums over the pixels of the finest.
    fn error_in(&self, parts: usize, own: &[f64]) -> AtLeast {
        let coarse = |k: usize| (k / FINEST * parts / FINEST) * parts + k % FINEST * parts / FINEST;
        let (mut count, mut shown) = (vec![0.0; parts * parts], vec![0.0; parts * parts]);
        let mut difference = vec![vec![0.0; parts * parts]; self.batches.len()];
        for (k, pixels) in self.pixels.iter().enumerate() {
            count[coarse(k)] += pixels;
            shown[coarse(k)] += own[k];
            for (sums, batch) in difference.iter_mut().zip(&self.batches) {
                sums[coarse(k)] += pixels * batch[k] - own[k];
            }
        }
        let (all, n) = (count.iter().sum::<f64>(), self.batches.len() as f64);
        let (mut squared, mut variance) = (0.0, 0.0);
        for (part, count) in count.iter().enumerate().filter(|(_, count)| **count > 0.0) {
            let of = |sums: &Vec<f64>| sums[part] / count;
            let mean = difference.iter().map(of).sum::<f64>() / n;
            let noise = difference.iter().map(|sums| (of(sums) - mean).powi(2)).sum::<f64>() / (n * (n - 1.0));
            let of_few = shown[part].max(0.0) / count * self.portion / (self.walks * count);
            let noise = if shown[part] > 0.0 { noise.max(of_few) } else { noise };
            let share = count / all;
            squared += share * (mean * mean - noise);
            // Of few large portions the square has a fourth cumulant too.
            let fourth = if noise > 0.0 { noise * self.rare / (self.walks * count).powi(2) } else { 0.0 };
            variance += share * share * (4.0 * mean * mean * noise + 2.0 * noise * noise + fourth);
        }
        AtLeast { squared, error: variance.sqrt() }
    }
}

/// The part of a pixel.
fn part_of(Size { width, height }: Size, [x, y]: [usize; 2]) -> usize {
    (y * FINEST / height) * FINEST + x * FINEST / width
}

/// Sums of a value of every pixel over the finest parts.
fn summed(size: Size, value: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut sums = vec![0.0; FINEST * FINEST];
    for k in 0..size.width * size.height {
        sums[part_of(size, [k % size.width, k / size.width])] += value(k);
    }
    sums
}

/// How the camera sees surfaces.
struct Lens<'a> {
    view: &'a View<'a>,
    size: Size,
    /// Half of the picture's sides at unit distance.
    half: [f64; 2],
    /// Metres of a unit.
    scale: f64,
    /// Pixels of each part.
    pixels: Vec<f64>,
}

impl<'a> Lens<'a> {
    fn new(view: &'a View<'a>, size: Size) -> Lens<'a> {
        let half = 0.5 * size.height as f64 * view.scene.camera.pixel(size.height);
        let aspect = size.width as f64 / size.height as f64;
        let scale = view.scene.frame.in_metres();
        Lens { view, size, half: [half * aspect, half], scale, pixels: summed(size, |_| 1.0) }
    }

    /// The finest part that a surface is seen in, and the mean radiance of its pixel for a power reflected there; none
    /// where the camera does not see it.
    fn sees(&self, met: &Met) -> Option<(usize, f64)> {
        let camera = &self.view.scene.camera;
        let way = met.position - camera.position;
        let along = f64::from(way.dot(camera.forward));
        let across = [camera.right, -camera.up].map(|axis| f64::from(way.dot(axis)) / along);
        let Size { width, height } = self.size;
        let at = |k: usize, pixels: usize| {
            let share = 0.5 + 0.5 * across[k] / self.half[k];
            (along > 0.0 && (0.0..1.0).contains(&share)).then_some((share * pixels as f64) as usize)
        };
        let pixel = [at(0, width)?, at(1, height)?];
        let normal = self.view.patches.normal(met.face, met.side).as_dvec3();
        let (away, distance) = (way.as_dvec3(), f64::from(way.length()));
        let cosine = -normal.dot(away) / distance;
        let is_seen = || self.view.rays.visible((camera.position, None), (met.position, Some(met.face)));
        if cosine <= 0.0 || !is_seen() {
            return None;
        }
        let area = 4.0 * self.half[0] * self.half[1] / (width * height) as f64;
        let kernel = cosine / (distance * distance * (along / distance).powi(3) * area);
        Some((part_of(self.size, pixel), kernel / (3.0 * PI * self.scale * self.scale)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Mode;
    use crate::reading::view::lights_of;

    /// All sides of a closed cube emit 0.25 and reflect 0.5: the camera sees 0.25 reflected everywhere.
    #[test]
    fn walks_bring_a_picture_what_is_reflected() {
        let transport = Mode::Global.transport();
        let lights = lights_of("furnace", transport, 100);
        let goal = TracingGoal { size: (40, 24).into(), walks: 1 << 16, terms: 60, seed: 1 };
        let traced = traced_parts(&View::new(&lights, goal.size), transport, &goal);
        assert!(traced.rays > goal.walks);
        let of = |light: &dyn Fn(usize) -> f64| traced.error_of(|k| DVec3::splat(light(k)));
        let right = of(&|_| 0.25);
        assert!(right.certain() == 0.0 && right.error.sqrt() < 0.02, "{right:?}");
        // Too dark all over, and too bright in a corner.
        let dark = of(&|_| 0.2);
        assert!(dark.certain() > 0.0 && (dark.squared.sqrt() - 0.05).abs() < 3.0 * dark.error / 0.1, "{dark:?}");
        let corner = of(&|k| if k % 40 < 10 && k / 40 < 6 { 0.75 } else { 0.25 });
        assert!(corner.certain() > 0.0 && (corner.squared - 0.25 / 16.0).abs() < 3.0 * corner.error, "{corner:?}");
    }
}
