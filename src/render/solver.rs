//! The crate's face: pictures and operators of one scene, whose rays and surfaces are built once.
//!
//! [`Solver::render`] makes a picture, to a tolerance or with given effort; [`Solver::operator`] hands out K for
//! whatever else is to be done with it. Not handled: several modes from one cast of rays ([`crate::render::assemble`]),
//! reports of progress ([`crate::render::Watch`]), and scenes without light, whose pictures are black
//! ([`Scene::require_emission`]).

use std::time::Instant;

use crate::gather::{GatherPass, GatherSampling};
use crate::light::Transport;
use crate::operator::Operator;
use crate::pictures::Size;
use crate::render::assembly::{Assembled, Prepared, Silent, Watch, assemble, prepare};
use crate::render::deadline::render_within;
use crate::render::fineness::Fineness;
use crate::render::look::render;
use crate::render::memory::{check_memory, usable_memory};
use crate::render::rendered::{Ended, ErrorParts, Rendered};
use crate::render::solved::Spent;
use crate::render::unfit::Unfit;
use crate::render::wanted::Wanted;
use crate::scene::Scene;
use crate::solve::{Diverges, Settings, neumann};

/// The tolerance that patches are cut for before one is asked for.
const TOLERANCE: f64 = 0.01;

/// Why there is no picture.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum RenderError {
    /// The bounce series is not proved to converge.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Diverges(#[from] Diverges),
    /// K would not fit in memory.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Memory(#[from] Unfit),
}

/// A scene with its rays and surfaces, ready to be rendered in any mode. What it answers does not depend on what it was
/// asked before.
pub struct Solver {
    prepared: Prepared,
    /// Bytes that K may take.
    memory: f64,
    seed: u32,
}

impl Solver {
    /// Builds the ray hierarchy and finds the surfaces of a scene. Four fifths of the memory that is free may be used.
    pub fn new(scene: &Scene) -> Solver {
        let prepared = prepare(scene.clone(), Fineness::first(TOLERANCE).patches);
        Solver { prepared, memory: usable_memory(), seed: 0 }
    }

    /// Chooses the scrambling of all sample points: a seed gives the same bits on any number of threads.
    pub fn seed(mut self, seed: u32) -> Solver {
        self.seed = seed;
        self
    }

    /// Bytes of memory that K may take.
    pub fn memory(mut self, bytes: f64) -> Solver {
        self.memory = bytes;
        self
    }

    /// Asks for the picture of a mode, so many pixels across and down, from the scene's camera.
    pub fn render(&mut self, mode: impl Into<Transport>, size: impl Into<Size>) -> Request<'_> {
        Request { transport: mode.into(), size: size.into(), solver: self }
    }

    /// K of a mode with the E it acts on: `L = E + K L`, one equation for each patch, half and channel.
    ///
    /// # Errors
    /// [`Unfit`] where K would not fit in memory, with the number of patches that would.
    pub fn operator(&mut self, mode: impl Into<Transport>, fineness: Fineness) -> Result<Operator, Unfit> {
        let mut spent = Spent::default();
        Ok(self.assembled(mode.into(), fineness, &mut spent)?.operator)
    }

    fn assembled(&mut self, transport: Transport, fineness: Fineness, spent: &mut Spent) -> Result<Assembled, Unfit> {
        let clock = Instant::now();
        let p = &mut self.prepared;
        p.cut_to(fineness.patches);
        spent.seconds.patches = clock.elapsed().as_secs_f64();
        let sampling = fineness.sampling(self.seed);
        check_memory(p, &[transport], &sampling, self.memory)?;
        let clock = Instant::now();
        let (mut modes, rays) = assemble(p, &[transport], &sampling, &Silent);
        spent.seconds.form_factors = clock.elapsed().as_secs_f64();
        spent.rays = rays;
        Ok(modes.remove(0))
    }
}

/// A picture that is asked for; what is left to say is how good it is to be.
#[must_use = "nothing is rendered until a tolerance or an effort is given"]
pub struct Request<'a> {
    solver: &'a mut Solver,
    transport: Transport,
    size: Size,
}

impl Request<'_> {
    /// The picture with an estimated relative RMS error of at most `tolerance`, such as 0.01; patches and rays follow
    /// from it.
    ///
    /// Where memory or detail end the search before, `error.total` of the picture says so.
    ///
    /// # Errors
    /// [`RenderError`] where the series is not proved to converge, or not even a coarse K fits in memory.
    pub fn tolerance(self, tolerance: f64) -> Result<Rendered, RenderError> {
        let Solver { prepared, memory, seed } = self.solver;
        let (memory, seed) = (*memory, *seed);
        let first = Fineness::first(tolerance);
        let clock = Instant::now();
        prepared.cut_to(first.patches);
        let cutting = clock.elapsed().as_secs_f64();
        check_memory(prepared, &[self.transport], &first.sampling(seed), memory)?;
        let wanted = Wanted { tolerance, size: self.size, deadline: None, memory, seed };
        let found = render_within(prepared, self.transport, &wanted, &Silent)?;
        Ok(Rendered { seconds: found.seconds.after(cutting), ..found })
    }

    /// The picture on patches of a fineness, with about `samples` hemisphere rays for each pixel; its error is not
    /// estimated.
    ///
    /// # Errors
    /// [`RenderError`] where the series is not proved to converge, or K does not fit in memory.
    pub fn fineness(self, fineness: Fineness, samples: u32) -> Result<Rendered, RenderError> {
        let mut spent = Spent::default();
        let mode = self.solver.assembled(self.transport, fineness, &mut spent)?;
        let pass = GatherPass::new(self.size, &GatherSampling::with_samples(samples, self.solver.seed));
        Ok(render_fixed(&self.solver.prepared, &mode, &pass, spent, &Silent)?)
    }
}

/// Solves an assembled mode and renders it with given effort: of its errors none is known. `spent` is what assembly
/// took.
///
/// # Errors
/// [`Diverges`] where the spectral radius is not proved to be below 1.
pub(crate) fn render_fixed(
    p: &Prepared,
    mode: &Assembled,
    pass: &GatherPass,
    mut spent: Spent,
    watch: &dyn Watch,
) -> Result<Rendered, Diverges> {
    let clock = Instant::now();
    let solution = neumann(&mode.operator, &Settings::default())?;
    spent.seconds.solve = clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let gathered = render(p, mode, &solution, pass, watch);
    spent.seconds.gather = clock.elapsed().as_secs_f64();
    Ok(Rendered {
        picture: gathered.total(),
        error: ErrorParts::default(),
        ended: Ended::ByItself,
        seconds: spent.seconds.after(p.seconds),
        patches: p.patches.len(),
        rays: spent.rays + gathered.rays,
        radius: solution.radius,
        verdict: solution.verdict,
        closure: mode.closure,
        backs: gathered.backs,
        sees: gathered.sees,
        standard_error: gathered.standard_error,
    })
}
