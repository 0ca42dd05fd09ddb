//! The crate's door: whatever is asked of one scene, whose rays and surfaces are built once.
//!
//! * [`Solver::render`]: the picture of a mode, to a tolerance, in a time, or of given effort;
//! * [`Solver::bounces`]: the terms of its bounce series, with their powers to a tolerance or of given effort;
//! * [`Solver::assemble`]: `L = E + K L` of several modes from one cast of rays, to be solved, looked at and shot over;
//! * [`Solver::operator`]: K alone;
//! * [`Solver::cut`] and [`Solver::geometry`]: what they are made on.
//!
//! Nothing that a solver answers depends on what it was asked before, so it may be shared. Memory and seed are chosen
//! once ([`Solver::memory`], [`Solver::seed`]); whoever wants to see how work goes on gives a [`Watch`].
//!
//! Not handled: scenes without light, whose pictures are black ([`Scene::require_emission`]).

use std::sync::{Arc, Mutex};
use std::time::Instant;

use crate::error::deadline::deadline_after;
use crate::gather::{GatherPass, GatherSampling};
use crate::light::Transport;
use crate::operator::Operator;
use crate::pictures::Size;
use crate::render::assembly::{Assembled, Discretization, Silent, Watch};
use crate::render::bounces::{BounceSeries, TermsGoal, bounces_to_tolerance};
use crate::render::by_deadline::render_by_deadline;
use crate::render::fineness::Fineness;
use crate::render::goal::{PictureGoal, Spent, timed};
use crate::render::memory::{Unfit, usable_memory};
use crate::render::rendered::Rendered;
use crate::render::search::solved::Task;
use crate::scene::Scene;
use crate::solve::{Diverges, Settings, explore, neumann};
use crate::surfaces::Geometry;

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

/// A scene with its rays and surfaces, ready to be solved in any mode.
pub struct Solver {
    /// The scene, cut as it was last.
    last: Mutex<(usize, Discretization)>,
    /// Seconds that building it took.
    ready: f64,
    /// Bytes that K may take.
    memory: f64,
    seed: u32,
}

impl Solver {
    /// Builds the ray hierarchy and finds the surfaces of a scene. Four fifths of the memory that is free may be used.
    pub fn new(scene: &Scene) -> Solver {
        let patches = Fineness::first(TOLERANCE).patches;
        let (cut, ready) = timed(|| Discretization::new(scene.clone(), patches));
        let last = Mutex::new((patches, cut));
        Solver { last, ready, memory: usable_memory(), seed: 0 }
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

    /// The scene, its rays and its surfaces.
    pub fn geometry(&self) -> Arc<Geometry> {
        self.last_cut().geometry
    }

    /// The scene cut into about so many patches of one size; not done again where it was the last time.
    pub fn cut(&self, patches: usize) -> Discretization {
        let mut last = self.last.lock().expect("no holder of this panics");
        if last.0 != patches {
            *last = (patches, last.1.cut(patches));
        }
        last.1.clone()
    }

    /// The picture of a mode, so many pixels across and down, from the scene's camera.
    pub fn render(&self, mode: impl Into<Transport>, size: impl Into<Size>) -> PictureRequest<'_> {
        PictureRequest { solver: self, transport: mode.into(), size: size.into(), time: None, watch: &Silent }
    }

    /// The first `count` bounces of a mode's series, E not counted.
    pub fn bounces(&self, mode: impl Into<Transport>, count: usize) -> BouncesRequest<'_> {
        BouncesRequest { solver: self, transport: mode.into(), count, time: None, watch: &Silent }
    }

    /// K of a mode with the E it acts on: `L = E + K L`, one equation for each patch, half and channel.
    ///
    /// # Errors
    /// [`Unfit`] where K would not fit in memory, with the number of patches that would.
    pub fn operator(&self, mode: impl Into<Transport>, fineness: Fineness) -> Result<Operator, Unfit> {
        Ok(self.assemble(&[mode.into()], fineness, &Silent)?.modes.remove(0).operator)
    }

    /// `L = E + K L` of several modes on the same patches, from one cast of rays.
    ///
    /// # Errors
    /// [`Unfit`] where K of all modes together would not fit in memory.
    pub fn assemble(&self, modes: &[Transport], fineness: Fineness, watch: &dyn Watch) -> Result<Equations, Unfit> {
        let (p, cutting) = timed(|| self.cut(fineness.patches));
        let sampling = fineness.sampling(self.seed);
        p.check_memory(modes, &sampling, 1, self.memory)?;
        let ((modes, rays), casting) = timed(|| p.assemble(modes, &sampling, watch));
        let mut spent = Spent { rays, ..Spent::default() };
        (spent.seconds.patches, spent.seconds.form_factors) = (self.ready + cutting, casting);
        Ok(Equations { modes, spent })
    }

    /// Checks that K of each of the `modes` fits in memory on the patches that a search for a tolerance begins with.
    ///
    /// # Errors
    /// [`Unfit`] where it does not.
    pub fn check_tolerance(&self, modes: &[Transport], tolerance: f64) -> Result<(), Unfit> {
        let first = Fineness::first(tolerance);
        let (p, sampling) = (self.cut(first.patches), first.sampling(self.seed));
        modes.iter().try_for_each(|mode| p.check_memory(&[*mode], &sampling, 1, self.memory))
    }

    /// The scene as it was cut last.
    pub fn last_cut(&self) -> Discretization {
        self.last.lock().expect("no holder of this panics").1.clone()
    }
}

/// `L = E + K L` of one or several modes, and what putting them together took.
pub struct Equations {
    /// In the order in which they were asked for.
    pub modes: Vec<Assembled>,
    spent: Spent,
}

impl Equations {
    /// Solves each equation and renders it; errors are not estimated. A mode whose spectral radius is not proved to be
    /// below 1 has no picture.
    pub fn render(&self, pass: &GatherPass, watch: &dyn Watch) -> Vec<Result<Rendered, Diverges>> {
        let one = |mode: &Assembled| {
            let mut spent = self.spent.clone();
            let (solution, seconds) = timed(|| neumann(&mode.operator, &Settings::default()));
            let solution = solution?;
            spent.seconds.solve = seconds;
            let (gathered, seconds) = timed(|| mode.picture(&solution, pass, watch));
            spent.seconds.gather = seconds;
            Ok(Rendered::new(mode, &solution, gathered, spent))
        };
        self.modes.iter().map(one).collect()
    }
}

/// A picture that is asked for; what is left to say is how good it is to be.
#[must_use = "nothing is rendered until a tolerance or an effort is given"]
pub struct PictureRequest<'a> {
    solver: &'a Solver,
    transport: Transport,
    size: Size,
    time: Option<f64>,
    watch: &'a dyn Watch,
}

impl<'a> PictureRequest<'a> {
    /// Has every step of the work told to `watch`.
    pub fn watch(self, watch: &'a dyn Watch) -> Self {
        Self { watch, ..self }
    }

    /// Ends the search for a tolerance after so many seconds, with the best picture that there is by then.
    pub fn time(self, seconds: f64) -> Self {
        Self { time: Some(seconds), ..self }
    }

    /// The picture with an estimated relative RMS error of at most `tolerance`, such as 0.01; patches and rays follow
    /// from it.
    ///
    /// Where memory, time or detail end the search before, `error.total` of the picture says so.
    ///
    /// # Errors
    /// [`RenderError`] where the series is not proved to converge, or not even a coarse K fits in memory.
    pub fn tolerance(self, tolerance: f64) -> Result<Rendered, RenderError> {
        let deadline = self.time.and_then(|seconds| deadline_after(Instant::now(), seconds));
        let PictureRequest { solver, transport, size, watch, .. } = self;
        let (memory, seed) = (solver.memory, solver.seed);
        let first = Fineness::first(tolerance);
        let (p, cutting) = timed(|| solver.cut(first.patches));
        p.check_memory(&[transport], &first.sampling(seed), 1, memory)?;
        let goal = PictureGoal { tolerance, size, deadline, memory, seed };
        let found = render_by_deadline(&p, &Task { transport, goal: &goal, watch })?;
        Ok(Rendered { seconds: found.seconds.after(solver.ready + cutting), ..found })
    }

    /// The picture on patches of a fineness, with about `samples` hemisphere rays for each pixel; its error is not
    /// estimated.
    ///
    /// # Errors
    /// [`RenderError`] where the series is not proved to converge, or K does not fit in memory.
    pub fn fineness(self, fineness: Fineness, samples: u32) -> Result<Rendered, RenderError> {
        let equations = self.solver.assemble(&[self.transport], fineness, self.watch)?;
        let pass = GatherPass::new(self.size, &GatherSampling::with_samples(samples, self.solver.seed));
        Ok(equations.render(&pass, self.watch).remove(0)?)
    }
}

/// Terms of a series that are asked for; what is left to say is how good they are to be.
#[must_use = "nothing is solved until a tolerance or an effort is given"]
pub struct BouncesRequest<'a> {
    solver: &'a Solver,
    transport: Transport,
    count: usize,
    time: Option<f64>,
    watch: &'a dyn Watch,
}

impl<'a> BouncesRequest<'a> {
    /// Has every step of the work told to `watch`.
    pub fn watch(self, watch: &'a dyn Watch) -> Self {
        Self { watch, ..self }
    }

    /// Ends the search for a tolerance after about so many seconds.
    pub fn time(self, seconds: f64) -> Self {
        Self { time: Some(seconds), ..self }
    }

    /// The terms with an estimated relative error of at most `tolerance` of each one's power; a series that diverges is
    /// shown growing.
    pub fn tolerance(self, tolerance: f64) -> BounceSeries {
        let BouncesRequest { solver, transport, count, time, watch } = self;
        let goal = TermsGoal { count, tolerance, time, memory: solver.memory, seed: solver.seed };
        bounces_to_tolerance(&solver.last_cut(), transport, &goal, watch)
    }

    /// The terms on patches of a fineness; errors are not estimated.
    ///
    /// # Errors
    /// [`Unfit`] where K does not fit in memory.
    pub fn fineness(self, fineness: Fineness) -> Result<BounceSeries, Unfit> {
        let mode = self.solver.assemble(&[self.transport], fineness, self.watch)?.modes.remove(0);
        let solution = explore(&mode.operator, self.count);
        Ok(BounceSeries { mode, solution, errors: Vec::new(), end: None })
    }
}
