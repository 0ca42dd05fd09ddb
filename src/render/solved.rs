//! A solution of one mode with what is needed to tell its error: another scrambling, and larger patches.
//!
//! Not handled: how fine the patches are and how many rays are cast ([`crate::render::tolerance`]).

use std::sync::Arc;
use std::time::Instant;

use crate::direct::Sight;
use crate::form_factors::Sampling;
use crate::gather::{
    Brightness, Effort, Fields, GatherPass, GatherSampling, Gathered, READINGS, Reading, SampledPixels, SquaredError,
    View, nearest_read,
};
use crate::light::budget::TRUNCATION;
use crate::light::{Rgb, Transport};
use crate::operator::{LinearOperator, Operator};
use crate::pictures::Size;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::replica_seed;
use crate::render::assembly::{Assembled, Prepared, Seconds, Watch, assemble_seeing, sight};
use crate::render::levels::{fields, of_finer};
use crate::render::look::{ambient, look, mode_view, reflected};
use crate::render::rendered::{Ended, ErrorParts, Rendered};
use crate::render::wanted::Wanted;
use crate::solve::{Diverges, Settings, Solution, coarse_terms, neumann};

/// Hemisphere rays of a patch for each to a luminaire.
const FOR_EACH: u32 = 4;
/// Width and height of the rough gather at most, pixels.
const ROUGH: usize = 64;
/// Camera rays of its pixels at first.
const ROUGH_CAMERA: u32 = 2;
/// Hemisphere rays of each of its pixels, and camera rays at most.
pub(crate) const ROUGH_RAYS: u32 = 32;
/// Noise of camera rays over all that the picture shows, beyond which they are doubled: what is left of the picture
/// without it is then known too poorly.
const ROUGH_NOISE: f64 = 0.5;

/// What was spent so far.
#[derive(Clone, Default)]
pub(crate) struct Spent {
    pub seconds: Seconds,
    pub rays: u64,
}

/// A small picture of light on patches, enough to tell the errors of that.
pub(crate) struct Rough {
    /// Its RMS is that of the picture without the noise, which would make all errors seem small beside it.
    pub gathered: Gathered,
    /// Camera rays of each pixel.
    pub camera: u32,
}

/// What is to be solved, and who watches.
#[derive(Clone, Copy)]
pub(crate) struct Task<'a> {
    /// The mode.
    pub transport: Transport,
    /// How near the picture is to be.
    pub wanted: &'a Wanted,
    pub watch: &'a dyn Watch,
}

/// A solution of one mode, with its difference to another scrambling and to larger patches.
pub(crate) struct Solved {
    pub mode: Assembled,
    solution: Solution,
    pub fields: Fields,
    pub error: ErrorParts,
    /// RMS of the picture that the errors of F and of patches are told beside.
    signal: f64,
    /// How the gather pass is to read the light.
    pub reading: Reading,
}

/// Two solutions of half the rays each: their mean, half their difference, and that to larger patches.
pub(crate) fn solve(p: &Prepared, task: &Task, rays: u32, spent: &mut Spent) -> Result<Solved, Diverges> {
    let Task { transport, wanted, .. } = *task;
    let clock = Instant::now();
    let sights = [sight(p, &p.scene.transports(transport))];
    let halves = [0, 1].map(|half| self::half(rays, wanted.seed, half));
    let [first, second] = halves.map(|sampling| cast_half(p, task, &sights, sampling));
    spent.rays += first.1 + second.1;
    spent.seconds.form_factors += clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let settings = Settings { tolerance: TRUNCATION * wanted.tolerance, ..Settings::default() };
    let solution = neumann(&first.0.operator, &settings)?;
    let other = neumann(&second.0.operator, &settings)?;
    let operator = &first.0.operator;
    let coarse = coarse_terms(operator, &p.patches.weights(), p.patches.parents(), solution.terms.len() - 1);
    let levels = [&solution.terms, &other.terms, &coarse].map(|terms| reflected(p, terms));
    let fields = fields(p, levels);
    let truncation = solution.rest() / solution.reflected.max(f64::MIN_POSITIVE);
    let fields = fields
        .with_ambient(ambient(&first.0, &solution))
        .with_rest([operator, &second.0.operator].map(direct), &p.patches);
    spent.seconds.solve += clock.elapsed().as_secs_f64();
    Ok(Solved {
        mode: first.0,
        solution,
        fields,
        error: ErrorParts { truncation, ..ErrorParts::default() },
        signal: 0.0,
        reading: Reading::AtOnce,
    })
}

/// Light that leaves the patches for what luminaires send there, one value each.
fn direct(k: &Operator) -> Vec<Rgb> {
    let one = |(i, received): (usize, &Rgb)| k.passed_on(i) * *received;
    k.received().iter().enumerate().map(one).collect()
}

/// K from one half of the rays.
fn cast_half(
    p: &Prepared,
    &Task { transport, watch, .. }: &Task,
    sights: &[Arc<Sight>],
    mut sampling: Sampling,
) -> (Assembled, u64) {
    if is_dark(p, transport) {
        // What patches receive goes nowhere.
        sampling.emitter_rays = 1;
    }
    let (mut modes, cast) = assemble_seeing(p, &[transport], sights, &sampling, watch);
    (modes.remove(0), cast)
}

/// Whether nothing but luminaires sends any light.
fn is_dark(p: &Prepared, transport: Transport) -> bool {
    let transports = p.scene.transports(transport);
    let materials = p.scene.materials.iter().zip(&transports);
    let mut all = materials.zip(&p.luminaires.carries);
    all.all(|((material, t), carried)| (t.alpha == 0.0 || material.rho == Rgb::ZERO) && (*carried || !material.emits()))
}

/// One half of the rays. Those to luminaires become more with the others: noise of light as emitted is noise of F as
/// well, and no other rays lessen it.
pub(crate) fn half(rays: u32, seed: u32, half: u32) -> Sampling {
    let rays = (rays / 2).max(1);
    let emitter_rays = Sampling::default().emitter_rays.max(rays / FOR_EACH);
    Sampling { rays, emitter_rays, seed: replica_seed(seed, half) }
}

impl Solved {
    /// A picture of light on patches, seen as this mode has it.
    pub fn gather(&self, p: &Prepared, fields: &Fields, pass: &GatherPass, watch: &dyn Watch) -> Gathered {
        look(&mode_view(p, &self.mode, pass.size), fields, &pass.gathering, watch)
    }

    /// What a small picture looks at.
    pub fn rough_view<'a>(&'a self, p: &'a Prepared, wanted: &Wanted) -> View<'a> {
        mode_view(p, &self.mode, rough(wanted.size))
    }

    /// A small picture, enough to tell the errors of the fields.
    pub fn rough(&self, p: &Prepared, wanted: &Wanted, spent: &mut Spent, watch: &dyn Watch) -> Rough {
        let clock = Instant::now();
        let (mut camera, mut rays) = (ROUGH_CAMERA, 0);
        loop {
            let sampling = GatherSampling { camera, luminaire: 1, hemisphere: ROUGH_RAYS / camera, seed: wanted.seed };
            let mut gathered = self.gather(p, &self.fields, &GatherPass::new(rough(wanted.size), &sampling), watch);
            rays += gathered.rays;
            let noise = gathered.error.share(gathered.error.camera);
            if noise <= ROUGH_NOISE || camera == ROUGH_RAYS || wanted.is_late() {
                spent.rays += rays;
                spent.seconds.gather += clock.elapsed().as_secs_f64();
                gathered.rays = rays;
                gathered.error = gathered.error.beside_signal_alone();
                return Rough { gathered, camera };
            }
            camera *= 2;
        }
    }

    /// Finds from how near the light of each patch may be read. Errors of patch light itself, which tell whether
    /// patches are to be divided, are measured before.
    pub fn set_nearest(&mut self, p: &Prepared, wanted: &Wanted, spent: &mut Spent) {
        let clock = Instant::now();
        let (nearest, cast) = nearest_read(&self.rough_view(p, wanted), &self.fields, wanted.seed);
        self.fields = std::mem::take(&mut self.fields).not_read_nearer(nearest);
        spent.rays += cast;
        spent.seconds.solve += clock.elapsed().as_secs_f64();
    }

    /// Pixels of the picture that are to tell its error; `bright` are those of a rough one.
    pub fn pixels(&self, p: &Prepared, wanted: &Wanted, bright: &[f32]) -> SampledPixels {
        let bright = Brightness { values: bright, size: rough(wanted.size) };
        SampledPixels::new(&self.full_view(p, wanted), bright, Purpose::SampledPixels.seed(wanted.seed))
    }

    /// What pixels of the picture tell of the light, by reading; no more of them where there is no time.
    pub fn drawn(
        &self,
        p: &Prepared,
        wanted: &Wanted,
        pixels: &mut SampledPixels,
        mut effort: Effort,
        spent: &mut Spent,
    ) -> [SquaredError; READINGS] {
        let before = pixels.rays();
        if wanted.is_late() {
            effort.most = 0;
        }
        let drawn = pixels.measure(&self.full_view(p, wanted), &self.fields, effort);
        spent.rays += pixels.rays() - before;
        drawn
    }

    /// What the picture looks at.
    fn full_view<'a>(&'a self, p: &'a Prepared, wanted: &Wanted) -> View<'a> {
        mode_view(p, &self.mode, wanted.size)
    }

    /// Takes the errors of F and of patch size from a picture.
    pub fn set_errors(&mut self, gathered: &Gathered) {
        self.signal = gathered.error.signal;
        if let [noise, coarse] = gathered.riders[..] {
            self.error.form_factors = gathered.error.share(noise);
            self.error.patches = of_finer() * gathered.error.share(coarse);
        }
    }

    /// Takes the squared error of the light as it is read, relative to the picture's: noise of F, truncation, all else.
    pub fn state(&mut self, squared: f64) {
        let noise = self.error.form_factors.min(squared.sqrt());
        let left = (squared - noise * noise).max(0.0);
        let truncation = self.error.truncation.min(left.sqrt());
        self.error.form_factors = noise;
        self.error.truncation = truncation;
        self.error.patches = (left - truncation * truncation).max(0.0).sqrt();
    }

    /// What is rendered, with its errors.
    pub fn finish(mut self, p: &Prepared, gathered: Gathered, mut spent: Spent) -> Rendered {
        // A rough picture that came out too bright made the errors of the light too small beside it.
        let beside = self.signal / gathered.error.signal;
        if beside.is_finite() && beside > 1.0 {
            self.error.form_factors *= beside;
            self.error.patches *= beside;
        }
        // Where nodes of many luminaires and polynomials stand for them, those may be off by what is tolerable.
        let stand_in = if self.mode.sight.cuts.is_some() { p.luminaires.tolerable } else { 0.0 };
        self.error.gather = gathered.error.relative().hypot(stand_in);
        spent.seconds.sum();
        Rendered {
            picture: gathered.total(),
            error: self.error.sum(),
            ended: Ended::ByItself,
            seconds: spent.seconds,
            patches: p.patches.len(),
            rays: spent.rays + gathered.rays,
            radius: self.solution.radius,
            verdict: self.solution.verdict,
            closure: self.mode.closure,
            backs: gathered.backs,
            sees: gathered.sees,
            standard_error: gathered.standard_error,
        }
    }
}

/// Width and height of a rough picture.
pub(crate) fn rough(Size { width, height }: Size) -> Size {
    let divisor = width.max(height).div_ceil(ROUGH);
    Size { width: width.div_ceil(divisor), height: height.div_ceil(divisor) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::linear;
    use crate::light::Mode;
    use crate::render::assembly::{Silent, prepare};
    use crate::scene::Scene;

    /// They were 64 whatever the others were, so that no number of rays lessened the noise of a sun behind windows.
    #[test]
    fn rays_to_luminaires_grow_with_the_others() {
        let of = |rays: u32| half(rays, 0, 1).emitter_rays;
        assert_eq!([2, 512, 1024, 8192].map(of), [64, 64, 128, 1024]);
    }

    fn solved(scene: &str, patches: usize) -> (Prepared, Solved) {
        let scene = Scene::open(scene).expect("a scene");
        let p = prepare(scene, patches);
        let wanted = Wanted { tolerance: 0.01, size: (8, 8).into(), deadline: None, memory: f64::INFINITY, seed: 0 };
        let transport = Mode::Global.transport();
        let mut spent = Spent::default();
        let found = solve(&p, &Task { transport, wanted: &wanted, watch: &Silent }, 1024, &mut spent);
        (p, found.expect("converges"))
    }

    /// Mean of the picture of light on patches, seen along the same rays whatever the patches.
    fn seen(p: &Prepared, s: &Solved, fields: &Fields) -> f32 {
        let sampling = GatherSampling { camera: 2, luminaire: 1, hemisphere: 32, seed: 3 };
        let picture = s.gather(p, fields, &GatherPass::new((24, 24), &sampling), &Silent);
        let pixels = picture.indirect[0].pixels.iter();
        pixels.map(|p| p.element_sum()).sum()
    }

    #[test]
    fn extrapolated_light_is_nearer_to_that_of_small_patches() {
        for scene in ["furnished-room", "two-rooms"] {
            let (q, fine) = solved(scene, 6000);
            let exact = seen(&q, &fine, &fine.fields);
            let (p, coarse) = solved(scene, 400);
            let plain = linear(&p.patches.neighbours(), &reflected(&p, &coarse.solution.terms));
            let before = seen(&p, &coarse, &Fields::linear(&[plain])) / exact - 1.0;
            let after = seen(&p, &coarse, &coarse.fields) / exact - 1.0;
            // Errors of order p leave |2 - 2^p| of themselves: nothing for p = 1, all but a sixth for 1.5.
            assert!(after.abs() < 0.83 * before.abs(), "{scene}: {before} {after}");
        }
    }
}
