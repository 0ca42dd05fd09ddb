//! Importance paths: paths that start at the camera and carry importance, the adjoint of light (B. Smits, J. Arvo, D.
//! Salesin, *An importance-driven radiosity algorithm*, 1992).
//!
//! A pixel shows `rho(x0) ∫ L'` over the hemisphere of the point x0 it sees. A path follows one cosine-distributed ray
//! after the other, and at each vertex y it keeps
//!
//! ```text
//! w_k     importance: what light 1 that leaves y_k adds to the pixel
//! D_k     light as emitted that arrives at y_k, sampled with a visibility ray
//! z_k     what the next rays meet: alpha rho (D_k + mean L'(z_k)) + E is a sample of the light that leaves y_k
//! ```
//!
//! Every vertex casts [`SPREAD`] rays, well spread over the hemisphere, and the path goes on along one of them
//! (splitting: J. Arvo, D. Kirk, *Particle transport and image synthesis*, 1990), as most of the variance of a sample
//! is that of where its rays end, and a ray costs less than the direct light of a vertex. Russian roulette in
//! proportion to the absorption keeps all w of a colourless scene alike. Paths depend on the scene and the luminaires
//! and on no patches, so that they serve every set of patches.
//!
//! Of a texture a path sees the mean over a narrow cone, as texels would be noise of the few paths.
//!
//! Of several processes each keeps the paths that it traced: what is asked of them is a few numbers for each.
//!
//! Not handled: series that diverge; paths end after [`LONGEST`] vertices.

use glam::DVec3;
use halflight_team::{Loop, Travels};
use rayon::prelude::*;

use crate::light::Rgb;
use crate::rays::sobol::{Sobol, Stream, hash};
use crate::rays::{FAN, Fan, Ray};
use crate::reading::reflection::{Memory, Met, Reflection, SurfaceHit, Walker};
use crate::reading::view::View;

/// Width h at distance 1 of the cone that a ray stands for: means over it leave h² of the contrast of texels in the
/// light that they send, less than half a percent.
const CONE: f64 = 1.0 / 16.0;

/// Rays of a vertex. Compared with 1 they leave a tenth of the variance of the squared error of a picture, by paths
/// that cost twice as much (`cargo bench --bench gather -- residual`).
const SPREAD: usize = 8;
/// Vertices of a path at most.
const LONGEST: usize = 256;

/// A point where a path was reflected.
#[derive(Clone, Debug)]
pub(crate) struct Vertex {
    pub at: SurfaceHit,
    /// What light 1 that leaves here adds to the pixel.
    pub weight: DVec3,
    pub reflection: Reflection,
}

/// A pixel that paths start from.
#[derive(Clone, Copy, Debug)]
struct StartPixel {
    pixel: u32,
    /// Its paths over those of all in the mean.
    density: f32,
}

/// One path from a pixel.
#[derive(Clone, Debug)]
pub(crate) struct Path {
    /// The number of its pixel among those that paths start from.
    pub start: u32,
    pub vertices: Vec<Vertex>,
}

/// Paths that were added together.
#[derive(Clone, Debug)]
struct Addition {
    /// Which of them each process keeps.
    shared: Loop,
    /// Those of this process.
    own: Vec<Path>,
}

/// Paths from all pixels, or from some.
#[derive(Clone, Debug)]
pub struct ImportancePaths {
    /// What was added at a time.
    additions: Vec<Addition>,
    /// All of them, wherever they are kept.
    pub(crate) count: usize,
    starts: Vec<StartPixel>,
    seed: u32,
    /// Paths of a pixel so far, in the mean.
    each: u32,
    /// Rays cast.
    pub rays: u64,
}

impl ImportancePaths {
    /// No paths yet, of a picture of the view's size; `densities` are the paths of each pixel over the mean of all.
    /// Squared errors of a picture are mostly those of its bright pixels, so their light is a good density.
    ///
    /// # Panics
    /// If there is not one number a pixel.
    pub fn new(view: &View, densities: Vec<f32>, seed: u32) -> ImportancePaths {
        assert_eq!(densities.len(), view.width * view.height);
        ImportancePaths::from_starts((0..).zip(densities).map(|(pixel, density)| StartPixel { pixel, density }), seed)
    }

    /// No paths yet; all are to start from a few pixels, which get the same number of them.
    pub(crate) fn from_pixels(pixels: impl Iterator<Item = u32>, seed: u32) -> ImportancePaths {
        ImportancePaths::from_starts(pixels.map(|pixel| StartPixel { pixel, density: 1.0 }), seed)
    }

    fn from_starts(starts: impl Iterator<Item = StartPixel>, seed: u32) -> ImportancePaths {
        ImportancePaths { additions: Vec::new(), count: 0, starts: starts.collect(), seed, each: 0, rays: 0 }
    }

    /// Adds `more` paths to every pixel that they start from, in the mean.
    pub fn extend(&mut self, view: &View, more: u32) {
        let tracer = PathTracer::new(view);
        let (seed, before, after) = (self.seed, self.each, self.each + more);
        // By path and not by pixel: those of some take many times as long as those of others.
        let until: Vec<usize> = self.starts.iter().scan(0, |sum, own| Some(own.added(before, after, sum))).collect();
        let all = until.last().copied().unwrap_or(0);
        let shared = Loop::each(all);
        let added = shared.keep(Memory::default, |memory, k| {
            let start = until.partition_point(|&until| until <= k);
            let own = &self.starts[start];
            let n = own.paths(after) - (until[start] - k) as u32;
            memory.scratch.cast = 0;
            let random = Stream::new(hash(n, hash(own.pixel, seed)));
            let vertices = tracer.trace_pixel(own.pixel as usize, random, memory);
            (Path { start: start as u32, vertices }, memory.scratch.cast)
        });
        let (own, cast): (Vec<Path>, Vec<u64>) = added.into_iter().unzip();
        self.count += all;
        self.rays += shared.sum(cast.into_iter().sum());
        self.additions.push(Addition { shared, own });
        self.each = after;
    }

    /// Takes in the paths of others.
    pub fn absorb(&mut self, others: ImportancePaths) {
        self.additions.extend(others.additions);
        self.count += others.count;
        self.rays += others.rays;
    }

    /// How often paths were added.
    pub(crate) fn additions(&self) -> usize {
        self.additions.len()
    }

    /// What `of_path` finds for the paths that were added from the `first` time on, all in their order.
    pub(crate) fn each_of<T: Travels>(&self, first: usize, of_path: impl Fn(&Path) -> T + Sync + Send) -> Vec<T> {
        let all = |added: &Addition| added.shared.join(added.own.par_iter().map(&of_path).collect());
        self.additions[first..].iter().flat_map(all).collect()
    }

    /// The sum of what `of_path` finds for all paths, wherever they are kept.
    pub(crate) fn sum(&self, of_path: impl Fn(&Path) -> u64 + Sync + Send) -> u64 {
        self.additions.iter().map(|added| added.shared.sum(added.own.par_iter().map(&of_path).sum())).sum()
    }

    /// Visibility rays per vertex, in the mean.
    pub(crate) fn direct_rays(&self) -> f64 {
        let reflecting = |path: &Path| path.vertices.iter().filter(|v| v.reflection.reflect != DVec3::ZERO).count();
        let vertices = self.sum(|path| path.vertices.len() as u64);
        // From the camera, from what it sees, and from the vertices.
        let others = self.sum(|path| 2 + (SPREAD * reflecting(path)) as u64);
        self.rays.saturating_sub(others) as f64 / vertices.max(1) as f64
    }

    /// Bytes that all of them take.
    pub(crate) fn bytes(&self) -> u64 {
        let met = |next: &Met| if next.spilled() { next.capacity() * size_of::<SurfaceHit>() } else { 0 };
        let own = |vertex: &Vertex| size_of::<Vertex>() + met(&vertex.reflection.next);
        self.sum(|path| path.vertices.iter().map(own).sum::<usize>() as u64)
    }
}

impl StartPixel {
    /// Its paths where all have `each` in the mean; some of every pixel.
    fn paths(&self, each: u32) -> u32 {
        if each == 0 { 0 } else { (each as f32 * self.density).ceil().max(1.0) as u32 }
    }

    /// Adds to a number of paths those that it gets where all go from `before` to `after` in the mean.
    fn added(&self, before: u32, after: u32, sum: &mut usize) -> usize {
        *sum += (self.paths(after) - self.paths(before)) as usize;
        *sum
    }
}

/// Traces paths through a view.
pub(crate) struct PathTracer<'a> {
    pub walker: Walker<'a>,
    sobol: Sobol,
    /// Rays of a vertex.
    spread: usize,
}

impl<'a> PathTracer<'a> {
    /// Paths through a view.
    pub(crate) fn new(view: &'a View) -> PathTracer<'a> {
        PathTracer { walker: Walker::new(view).with_cone(CONE), sobol: Sobol::new(FAN, 3), spread: SPREAD }
    }

    /// The same with so many rays of a vertex, at most [`FAN`].
    pub(crate) fn with_spread(self, spread: usize) -> PathTracer<'a> {
        PathTracer { spread, ..self }
    }

    /// The vertices of one path from pixel k.
    fn trace_pixel(&self, k: usize, mut random: Stream, memory: &mut Memory) -> Vec<Vertex> {
        let walker = &self.walker;
        let view = walker.view;
        let ray = view.camera_ray(k, random.uniform(), random.uniform());
        memory.scratch.cast += 1;
        let Some(hit) = view.rays.closest(&ray).filter(|hit| view.is_looked_at(&ray, hit)) else {
            return Vec::new();
        };
        // What the camera sees reflects rho whatever its alpha.
        let Some(seen) = walker.met(&ray, &hit, 1.0) else {
            return Vec::new();
        };
        let weight = match view.atlas {
            None => walker.rho_within(&seen, view.scene.camera.pixel(view.height)),
            Some(_) => shown_in_map(view, &seen),
        };
        if weight == DVec3::ZERO {
            return Vec::new();
        }
        let next = walker.bounce(&seen, &mut random, memory);
        self.go_on(weight, next, &mut random, memory)
    }

    /// The vertices of one path that a ray begins, for light that arrives along the ray.
    pub(crate) fn trace_ray(&self, ray: &Ray, random: &mut Stream, memory: &mut Memory) -> Vec<Vertex> {
        let mut next = Met::new();
        self.walker.follow(ray, memory, |m| next.push(m));
        self.go_on(DVec3::ONE, next, random, memory)
    }

    /// The vertices of a path from what its first ray met on, where light 1 counts `weight`.
    fn go_on(&self, mut weight: DVec3, mut next: Met, random: &mut Stream, memory: &mut Memory) -> Vec<Vertex> {
        let mut vertices = Vec::new();
        while let Some((at, share)) = draw(&next, random)
            && vertices.len() < LONGEST
        {
            weight *= share;
            let reflection = self.reflect(&at, random, memory);
            let onward = weight * reflection.reflect;
            let chance = (onward.max_element() / weight.max_element()).min(1.0);
            next.clone_from(&reflection.next);
            vertices.push(Vertex { at, weight, reflection });
            if f64::from(random.uniform()) >= chance {
                break;
            }
            weight = onward / chance;
        }
        vertices
    }

    /// What leaves a vertex, with what the rays from there meet.
    pub(crate) fn reflect(&self, at: &SurfaceHit, random: &mut Stream, memory: &mut Memory) -> Reflection {
        let mut reflection = self.walker.direct(at, random, memory);
        if reflection.reflect != DVec3::ZERO {
            let fan = Fan::new(&self.sobol, 0, random.bits());
            reflection.next = self.walker.bounce_all(at, &fan, self.spread, memory);
        }
        reflection
    }
}

/// What a map shows of light at a point: all of it, unless the surface reflects nothing.
fn shown_in_map(view: &View, at: &SurfaceHit) -> DVec3 {
    if view.scene.material(at.face).rho == Rgb::ZERO { DVec3::ZERO } else { DVec3::ONE }
}

/// One of the points met, drawn in proportion to the transmittance to it, and the sum of all transmittances.
fn draw(met: &[SurfaceHit], random: &mut Stream) -> Option<(SurfaceHit, f64)> {
    let total: f32 = met.iter().map(|m| m.through).sum();
    let mut at = random.uniform() * total;
    let chosen = met.iter().find(|m| {
        at -= m.through;
        at < 0.0
    });
    chosen.or(met.last()).map(|m| (*m, f64::from(total)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Mode;
    use crate::reading::view::lights_of;

    /// In a closed room nothing escapes: the rays of a vertex stand for the whole hemisphere.
    #[test]
    fn rays_of_a_vertex_stand_for_the_hemisphere() {
        let lights = lights_of("furnace", Mode::Global.transport(), 24);
        let view = View::new(&lights, (8, 8).into());
        let mut paths = ImportancePaths::new(&view, vec![1.0; 64], 3);
        paths.extend(&view, 4);
        assert_eq!((paths.count, paths.sum(|_| 1)), (256, 256));
        for path in paths.additions.iter().flat_map(|added| &added.own) {
            let mut next: Option<DVec3> = None;
            for vertex in &path.vertices {
                let whole: f32 = vertex.reflection.next.iter().map(|m| m.through).sum();
                assert!(vertex.reflection.next.len() == SPREAD && (whole - 1.0).abs() < 1e-6, "{whole}");
                // Roulette makes up for what is absorbed, so that a colourless room keeps every weight.
                assert!(next.is_none_or(|w| (w - vertex.weight).abs().max_element() < 1e-6 * w.x), "{next:?}");
                next = Some(vertex.weight);
            }
        }
    }
}
