//! Importance on its way: paths that start at the camera and go where what the picture shows came from.
//!
//! A pixel shows `rho(x0) ∫ L'` over the hemisphere of the point x0 it sees. A path follows one cosine-distributed ray after the other,
//! and at each point y it reaches keeps
//!
//! ```text
//! w_k     what light 1 that leaves y_k adds to the pixel (the adjoint of light: Smits, Arvo, Salesin 1992)
//! D_k     light as emitted that arrives at y_k, asked with a visibility ray
//! z_k     what the next ray meets: alpha rho (D_k + L'(z_k)) + E is a sample of the light that leaves y_k
//! ```
//!
//! Paths end by chance in proportion to what is absorbed, so that all w of a colourless scene are alike. They know the scene and the
//! lamps but no patches: the same paths serve every set of patches, to tell where patches are seen
//! ([`Walks::samples`]) and by how much the light read on them is off ([`Walks::residual`]).
//!
//! Not handled: series that diverge; paths end after [`LONGEST`] points.

use glam::DVec3;
use rayon::prelude::*;

use crate::gather::reflection::{Memory, Met, Reflection, Walker};
use crate::gather::view::View;
use crate::rays::Ray;
use crate::rays::sobol::{Stream, hash};

/// Points of a path at most.
const LONGEST: usize = 256;

/// A point where a path was reflected.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    pub at: Met,
    /// What light 1 that leaves here adds to the pixel.
    pub weight: DVec3,
    pub found: Reflection,
}

/// One path from a pixel.
#[derive(Clone, Debug)]
pub(crate) struct Path {
    pub pixel: u32,
    pub steps: Vec<Step>,
}

/// Paths from all pixels.
#[derive(Clone, Debug)]
pub struct Walks {
    pub(crate) paths: Vec<Path>,
    pub(crate) width: usize,
    pub(crate) height: usize,
    seed: u32,
    /// Paths of every pixel over those of all in the mean.
    densities: Vec<f32>,
    /// Paths of a pixel so far, in the mean.
    each: u32,
    /// Rays cast.
    pub rays: u64,
}

impl Walks {
    /// No paths yet, of a picture of the view's size; `densities` tell how many each pixel gets over those of all in the mean.
    ///
    /// Squared errors of a picture are mostly those of its bright pixels, so in proportion to their light is a good choice.
    ///
    /// # Panics
    /// If there is not one number a pixel.
    pub fn new(view: &View, densities: Vec<f32>, seed: u32) -> Walks {
        assert_eq!(densities.len(), view.width * view.height);
        Walks { paths: Vec::new(), width: view.width, height: view.height, seed, densities, each: 0, rays: 0 }
    }

    /// Adds `more` paths to every pixel, in the mean.
    pub fn extend(&mut self, view: &View, more: u32) {
        let walker = Walker::new(view);
        let (seed, before, after) = (self.seed, self.each, self.each + more);
        // An even number, and some of every pixel: both halves of the paths need theirs.
        let count = |k: usize, each: u32| match each {
            0 => 0,
            _ => 2 * (0.5 * each as f32 * self.densities[k]).ceil().max(1.0) as u32,
        };
        let rows: Vec<(Vec<Path>, u64)> = (0..self.height)
            .into_par_iter()
            .map_init(Memory::default, |memory, y| {
                let mut paths = Vec::new();
                memory.cast = 0;
                for k in y * view.width..(y + 1) * view.width {
                    for n in count(k, before)..count(k, after) {
                        let random = Stream::new(hash(n, hash(k as u32, seed)));
                        let steps = walk(&walker, k, random, memory);
                        let pixel = k as u32;
                        paths.push(Path { pixel, steps });
                    }
                }
                (paths, memory.cast)
            })
            .collect();
        for (paths, cast) in rows {
            self.paths.extend(paths);
            self.rays += cast;
        }
        self.each = after;
    }

    /// Takes in the paths of others.
    pub fn absorb(&mut self, others: Walks) {
        self.paths.extend(others.paths);
        self.rays += others.rays;
    }

    /// Number of paths of a pixel in the mean.
    pub fn each(&self) -> u32 {
        self.each
    }
}

/// One path from pixel k.
fn walk(walker: &Walker, k: usize, mut random: Stream, memory: &mut Memory) -> Vec<Step> {
    let mut steps = Vec::new();
    let view = walker.view;
    let x = ((k % view.width) as f32 + random.uniform()) / view.width as f32;
    let y = ((k / view.width) as f32 + random.uniform()) / view.height as f32;
    let aspect = view.width as f32 / view.height as f32;
    let (origin, direction) = view.scene.camera.ray(x, y, aspect);
    let ray = Ray { origin, direction, source: None };
    memory.cast += 1;
    let Some(hit) = view.rays.closest(&ray) else {
        return steps;
    };
    // What the camera sees reflects rho whatever its alpha.
    let seen = walker.met(&ray, &hit, 1.0);
    if walker.patch(&seen).is_none() {
        return steps;
    }
    let mut weight = walker.rho(&seen);
    let mut next = match weight == DVec3::ZERO {
        true => return steps,
        false => walker.bounce(&seen, &mut random, memory),
    };
    while let Some((at, share)) = choose(&next, &mut random)
        && steps.len() < LONGEST
    {
        weight *= share;
        let found = walker.reflect(&at, &mut random, memory);
        let onward = weight * found.reflect;
        let chance = (onward.max_element() / weight.max_element()).min(1.0);
        next.clone_from(&found.next);
        steps.push(Step { at, weight, found });
        if f64::from(random.uniform()) >= chance {
            break;
        }
        weight = onward / chance;
    }
    steps
}

/// One of the points met, in proportion to what comes through from it, and what that stands for.
fn choose(met: &[Met], random: &mut Stream) -> Option<(Met, f64)> {
    let total: f32 = met.iter().map(|m| m.through).sum();
    let mut at = random.uniform() * total;
    let chosen = met.iter().find(|m| {
        at -= m.through;
        at < 0.0
    });
    chosen.or(met.last()).map(|m| (*m, f64::from(total)))
}
