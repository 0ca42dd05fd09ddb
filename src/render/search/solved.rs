//! A solution of one mode with what is needed to estimate its error: the mean of two scramblings, half their
//! difference, and the difference to patches four times as large.
//!
//! Not handled: how fine the patches are and how many rays are cast ([`crate::render::search::rounds`]).

use std::sync::Arc;

use crate::Fineness;
use crate::direct::Lights;
use crate::error::nearest_read;
use crate::form_factors::Sampling;
use crate::gather::{GatherPass, GatherSampling, Gathered};
use crate::light::budget::{CAMERA, STAND_INS, TRUNCATION};
use crate::light::{Light, Rgb, Transport};
use crate::patches::{Neighbours, Patches};
use crate::pictures::Size;
use crate::rays::sobol::replica_seed;
use crate::reading::{Fields, Linear, View, linear};
use crate::render::assembly::{Assembled, Discretization, PatchLight, Watch, assemble, render};
use crate::render::goal::{PictureGoal, Spent, timed};
use crate::render::layers::{Apart, EmitterPower, LayerLight, with_layers};
use crate::render::rendered::{ErrorParts, LightOnPatches, Rendered};
use crate::solve::{Diverges, Settings, Solution, coarse_terms, neumann};

/// Hemisphere rays of a patch for each to a luminaire.
const FOR_EACH: u32 = 4;
/// Width and height of the rough gather at most, pixels.
const ROUGH: usize = 64;
/// Camera rays of its pixels at first.
const ROUGH_CAMERA: u32 = 2;
/// Hemisphere rays of each of its pixels, and camera rays at most.
pub(crate) const ROUGH_RAYS: u32 = 32;
/// Noise of camera rays over all that the picture shows, beyond which they are doubled: what remains of the picture
/// without it is then known too poorly.
const ROUGH_NOISE: f64 = 0.5;

/// Errors of patch size go as the size to this power: second where light is smooth within patches, first across what
/// stands close to a surface. Measured on the furnished room against path tracing: 8.1, 2.7, 1.0 % too dark with 250,
/// 1000, 4000 patches, powers of 1.6 and 1.4. What it gets wrong the residual measured at points shows
/// ([`crate::render::search::residual_check`]), and the rounds correct.
pub(crate) const ORDER: f64 = 1.5;

/// The error on the finer patches as a share of the difference between two levels, whose patches differ by a factor of
/// two in size: `1 / (2^ORDER - 1)`.
pub(crate) fn of_finer() -> f64 {
    1.0 / (ORDER.exp2() - 1.0)
}

/// How many times as many patches make an error so many times smaller: their number goes as the size to the power -2.
pub(crate) fn patches_for(smaller: f64) -> f64 {
    smaller.powf(2.0 / ORDER)
}

/// A small picture of light on patches, enough to estimate its errors.
pub(crate) struct Rough {
    /// Its RMS is that of the picture without the noise, which would make all errors seem small relative to it.
    pub gathered: Gathered,
    /// Camera rays of each pixel.
    pub camera: u32,
    /// Rays that a camera ray of the picture takes with those to luminaires and punctual lights.
    pub camera_ray: f64,
}

/// What is to be solved, and who watches.
#[derive(Clone, Copy)]
pub(crate) struct Task<'a> {
    /// The mode.
    pub transport: Transport,
    /// How near the picture is to be.
    pub goal: &'a PictureGoal,
    /// What the picture is taken apart into.
    pub apart: Apart,
    /// Whether the light on patches is wanted beside the picture.
    pub on_patches: LightOnPatches,
    pub watch: &'a dyn Watch,
}

/// A solution of one mode, with its difference to another scrambling and to larger patches.
pub(crate) struct Solved {
    pub mode: Assembled,
    solution: Solution,
    /// The other scrambling, where the picture is taken apart or the light on patches returned.
    other: Option<(Assembled, Solution)>,
    /// The terms on patches four times as large, where the picture is taken apart.
    pub coarse: Vec<Vec<Light>>,
    pub apart: Apart,
    on_patches: LightOnPatches,
    pub fields: Fields,
    pub error: ErrorParts,
    /// RMS of the picture that the errors of F and of patches are relative to.
    signal: f64,
    /// Share of the squared error of the gather pass that camera rays are to make.
    pub camera: f64,
}

/// The mean of the light of two halves, and half their difference, visible, for its error.
fn mean_light([first, second]: [&Assembled; 2], [a, b]: [&Solution; 2]) -> PatchLight<'static> {
    let mean = |(a, b): (&Light, &Light)| Light {
        invisible: 0.5 * (a.invisible + b.invisible),
        visible: 0.5 * (a.visible + b.visible),
    };
    let all = |a: &[Light], b: &[Light]| -> Vec<Light> { a.iter().zip(b).map(mean).collect() };
    let dark = vec![Light::default(); a.light.len()];
    let term = |n: usize| {
        let [a, b] = [a, b].map(|s| s.terms.get(n).unwrap_or(&dark));
        all(a, b)
    };
    let terms: Vec<_> = (0..a.terms.len().max(b.terms.len())).map(term).collect();
    let error = a.light.iter().zip(&b.light).map(|(a, b)| 0.5 * (a.visible - b.visible).abs()).collect();
    PatchLight {
        casts: vec![first.sampling, second.sampling],
        error: Some(error),
        ..first.patch_light(all(&a.light, &b.light).into(), terms.into())
    }
}

/// Two solutions of one mode on the same patches, of half the rays each, and that on larger patches.
struct TwoSolutions {
    /// K of either half.
    modes: [Assembled; 2],
    solutions: [Solution; 2],
    /// The terms of the first on patches four times as large.
    coarse: Vec<Vec<Light>>,
}

impl TwoSolutions {
    /// Solves with so many rays a patch; also says what that took.
    ///
    /// # Errors
    /// [`Diverges`] where the spectral radius is not proved to be below 1.
    fn new(p: &Discretization, task: &Task, rays: u32) -> Result<(TwoSolutions, Spent), Diverges> {
        let Task { transport, goal, watch, .. } = *task;
        let mut spent = Spent::default();
        let cast = || {
            let lights = p.lights(p.transports(transport), STAND_INS * goal.tolerance);
            [0, 1].map(|half| cast_half(p, &lights, transport, half_of(rays, goal.seed, half), watch))
        };
        let ([(first, a), (second, b)], seconds) = timed(cast);
        (spent.seconds.form_factors, spent.rays) = (seconds, a + b);
        let settings = Settings { tolerance: TRUNCATION * goal.tolerance, ..Settings::default() };
        let solve = || {
            let solutions = [neumann(&first.operator, &settings)?, neumann(&second.operator, &settings)?];
            let patches = &p.patches;
            let last = solutions[0].terms.len() - 1;
            let coarse = coarse_terms(&first.operator, &patches.weights(), patches.parents(), last);
            Ok((solutions, coarse))
        };
        let (solved, seconds) = timed(solve);
        let (solutions, coarse) = solved?;
        spent.seconds.solve = seconds;
        Ok((TwoSolutions { modes: [first, second], solutions, coarse }, spent))
    }
}

impl Solved {
    /// Two solutions of half the rays each: their mean, half their difference, and that to larger patches; and what
    /// that took.
    ///
    /// # Errors
    /// [`Diverges`] where the spectral radius is not proved to be below 1.
    pub(crate) fn new(p: &Discretization, task: &Task, rays: u32) -> Result<(Solved, Spent), Diverges> {
        let (two, mut spent) = TwoSolutions::new(p, task, rays)?;
        let error = ErrorParts { truncation: two.solutions[0].truncation(), ..ErrorParts::default() };
        let TwoSolutions { modes: [mode, second], solutions: [solution, other], coarse } = two;
        let read = || {
            let levels = [&solution.terms, &other.terms, &coarse].map(|terms| mode.reflected(terms));
            fields(&p.patches, levels)
                .with_ambient(mode.ambient(&solution))
                .with_rest([&mode, &second].map(Assembled::direct), &p.patches)
                .without_strata(&p.patches)
        };
        let (fields, seconds) = timed(read);
        spent.seconds.solve += seconds;
        let other =
            (!task.apart.is_nothing() || task.on_patches == LightOnPatches::Returned).then_some((second, other));
        let (signal, apart, on_patches) = (0.0, task.apart, task.on_patches);
        let coarse = if apart.is_nothing() { Vec::new() } else { coarse };
        let camera = CAMERA[1];
        Ok((Solved { mode, solution, other, coarse, apart, on_patches, fields, error, signal, camera }, spent))
    }
}

/// The mean of two scramblings a and b of light on patches, which makes the picture; half their difference, and that of
/// a to c on larger patches ride along on the same rays.
fn fields(patches: &Patches, [a, b, c]: [Vec<Rgb>; 3]) -> Fields {
    let neighbours = patches.neighbours();
    let [a, b] = [&a, &b].map(|values| linear(&neighbours, values));
    let c = larger(patches, &neighbours, &c);
    let mix = |x: &[Linear], y: &[Linear], u: f32, v: f32| -> Vec<Linear> {
        x.iter().zip(y).map(|(x, y)| x.mix(u, y, v)).collect()
    };
    Fields::linear(&[mix(&a, &b, 0.5, 0.5), mix(&a, &b, 0.5, -0.5), mix(&a, &c, 1.0, -1.0)]).with_picture_fields(1)
}

/// Light of larger patches, given on the smaller ones, as linear within the larger.
pub(crate) fn larger(patches: &Patches, neighbours: &Neighbours, values: &[Rgb]) -> Vec<Linear> {
    let parents = patches.parents();
    let neighbours = neighbours.larger(parents, &patches.weights());
    let mut own = vec![Rgb::ZERO; neighbours.len()];
    for (value, &parent) in values.iter().zip(parents) {
        own[parent as usize] = *value;
    }
    let light = linear(&neighbours, &own);
    parents.iter().map(|&parent| light[parent as usize]).collect()
}

/// K from one half of the rays, and how many were cast.
fn cast_half(
    p: &Discretization,
    lights: &Arc<Lights>,
    transport: Transport,
    mut sampling: Sampling,
    watch: &dyn Watch,
) -> (Assembled, u64) {
    if is_dark(lights) {
        // What patches receive goes nowhere.
        sampling.emitter_rays = 1;
    }
    let (mut modes, cast) = assemble(&[(transport, Arc::clone(lights))], &*p.rows, &sampling, watch);
    (modes.remove(0), cast)
}

/// Whether nothing but luminaires sends any light.
fn is_dark(lights: &Lights) -> bool {
    let materials = lights.geometry.scene.materials.iter().zip(&lights.transports);
    let mut all = materials.zip(&lights.luminaires.carries);
    all.all(|((material, t), carried)| (t.alpha == 0.0 || material.rho == Rgb::ZERO) && (*carried || !material.emits()))
}

/// One half of the rays. Those to luminaires become more with the others: noise of light as emitted is noise of F as
/// well, and no other rays lessen it.
pub(crate) fn half_of(rays: u32, seed: u32, half: u32) -> Sampling {
    let rays = (rays / 2).max(1);
    let emitter_rays = Sampling::default().emitter_rays.max(rays / FOR_EACH);
    Sampling { rays, emitter_rays, seed: replica_seed(seed, half) }
}

impl Solved {
    /// The patches it is on.
    pub(crate) fn patches(&self) -> &Patches {
        self.mode.patches()
    }

    /// The terms of its series.
    pub(crate) fn terms(&self) -> usize {
        self.solution.terms.len()
    }

    /// The view of a small picture.
    pub(crate) fn rough_view(&self, goal: &PictureGoal) -> View<'_> {
        View::new(&self.mode.lights, rough_size(goal.size))
    }

    /// The view of the picture.
    pub(crate) fn view(&self, goal: &PictureGoal) -> View<'_> {
        View::new(&self.mode.lights, goal.size)
    }

    /// The light of the layers in both scramblings; nothing where the picture stays whole.
    pub(crate) fn layer_light(&self) -> Vec<LayerLight> {
        let other = self.other.as_ref().filter(|_| !self.apart.is_nothing());
        let halves = other.map(|(second, other)| [(&self.mode, &self.solution), (second, other)]);
        let own = |(mode, solution): (&Assembled, &Solution)| LayerLight::new(mode, solution, self.apart);
        halves.into_iter().flatten().map(own).collect()
    }

    /// A small picture, enough to estimate the errors of the fields.
    pub(crate) fn rough(&self, goal: &PictureGoal, watch: &dyn Watch) -> Rough {
        self.rough_of(&self.fields, goal, watch)
    }

    /// The same of some fields.
    pub(crate) fn rough_of(&self, fields: &Fields, goal: &PictureGoal, watch: &dyn Watch) -> Rough {
        let (mut camera, mut rays) = (ROUGH_CAMERA, 0);
        loop {
            let sampling = GatherSampling { camera, luminaire: 1, hemisphere: ROUGH_RAYS / camera, seed: goal.seed };
            let mut gathered =
                render(&self.mode.lights, fields, &GatherPass::new(rough_size(goal.size), &sampling), watch);
            rays += gathered.rays;
            let noise = gathered.error.share(gathered.error.camera);
            if noise <= ROUGH_NOISE || camera == ROUGH_RAYS || goal.is_late() {
                gathered.rays = rays;
                gathered.error = gathered.error.over_signal_alone();
                let camera_ray = 1.0 + gathered.luminaire_rays;
                return Rough { gathered, camera, camera_ray };
            }
            camera *= 2;
        }
    }

    /// Finds from how near the light of each patch may be read, and returns the rays cast. Errors of patch light
    /// itself, which show whether patches are to be divided, are measured before.
    pub(crate) fn set_nearest(&mut self, goal: &PictureGoal) -> u64 {
        let (nearest, cast) = nearest_read(&self.rough_view(goal), &self.fields, goal.seed);
        self.fields = std::mem::take(&mut self.fields).not_read_nearer(nearest);
        cast
    }

    /// The fields that the picture is gathered from, and the powers of emitters whose light is kept apart; the rough
    /// picture has shown the errors of the other fields.
    pub(crate) fn picture_fields(&self, layers: &[LayerLight]) -> (Fields, Vec<EmitterPower>) {
        let (fields, powers) = with_layers(self.fields.picture_only(), &self.mode, layers);
        (fields.without_strata(self.patches()), powers)
    }

    /// Takes the errors of F and of patch size from a picture.
    pub(crate) fn set_errors(&mut self, gathered: &Gathered) {
        self.signal = gathered.error.signal;
        if let [noise, coarse] = gathered.auxiliary_rms[..] {
            self.error.form_factors = gathered.error.share(noise);
            self.error.patches = of_finer() * gathered.error.share(coarse);
        }
    }

    /// Takes the squared error of the light as it is read, relative to the picture's: noise of F, truncation, all else.
    pub(crate) fn state(&mut self, squared: f64) {
        let noise = self.error.form_factors.min(squared.sqrt());
        let left = (squared - noise * noise).max(0.0);
        let truncation = self.error.truncation.min(left.sqrt());
        self.error.form_factors = noise;
        self.error.truncation = truncation;
        self.error.patches = (left - truncation * truncation).max(0.0).sqrt();
    }

    /// What is rendered, with its errors.
    pub(crate) fn finish(mut self, gathered: Gathered, spent: Spent) -> Rendered {
        // A rough picture that came out too bright made the errors of the light too small relative to it.
        let over = self.signal / gathered.error.signal;
        if over.is_finite() && over > 1.0 {
            self.error.form_factors *= over;
            self.error.patches *= over;
        }
        // Where nodes of many luminaires and polynomials stand for them, those may be off by what is tolerable.
        self.error.gather = gathered.error.relative().hypot(self.mode.lights.stand_ins());
        self.error.emission = gathered.error.of_emission();
        let rendered = Rendered::new(&self.mode, &self.solution, gathered, self.apart, spent);
        let other = self.other.as_ref().filter(|_| self.on_patches == LightOnPatches::Returned);
        let light = other.map(|(second, other)| mean_light([&self.mode, second], [&self.solution, other]));
        Rendered { error: self.error.sum(), light, ..rendered }
    }
}

/// What is to be done after a round.
pub(crate) enum Next {
    /// Nothing: this light is as accurate as requested, or as it can be.
    Accept(Box<Solved>),
    /// So many rays from each patch, on the same patches.
    Rays(u32),
    /// Smaller patches everywhere, and so many rays.
    Finer(Fineness),
    /// Patches of a size do not stand for the scene, or are not known to: divide them by this light, whose squared
    /// error may be infinite.
    Divide(Box<Solved>, f64),
}

/// Width and height of a rough picture.
pub(crate) fn rough_size(Size { width, height }: Size) -> Size {
    let divisor = width.max(height).div_ceil(ROUGH);
    Size { width: width.div_ceil(divisor), height: height.div_ceil(divisor) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With a fixed number of them no rays would lessen the noise of a sun behind windows.
    #[test]
    fn rays_to_luminaires_grow_with_the_others() {
        let of = |rays: u32| half_of(rays, 0, 1).emitter_rays;
        assert_eq!([2, 512, 1024, 8192].map(of), [64, 64, 128, 1024]);
    }
}
