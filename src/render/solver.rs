//! [`Solver`]: the one way from a scene to its pictures, its bounce series and K.
//!
//! Not handled: scenes without light, whose pictures are black ([`Scene::require_emission`]).

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use halflight_team::deadline_after;

use crate::gather::{GatherPass, GatherSampling};
use crate::light::Transport;
use crate::operator::{Operator, RowSource};
use crate::pictures::Size;
use crate::render::assembly::{Assembled, Discretization, Silent, Watch};
use crate::render::bounces::{BounceSeries, TermsGoal, bounces_to_tolerance};
use crate::render::by_deadline::render_by_deadline;
use crate::render::fineness::Fineness;
use crate::render::goal::{PictureGoal, Spent, timed};
use crate::render::layers::Apart;
use crate::render::memory::{MemoryLimit, Pilot, Unfit, usable_memory};
use crate::render::points::{Sensor, SensorLights, sense};
use crate::render::rendered::{LightOnPatches, Rendered};
use crate::render::search::solved::Task;
use crate::scene::Scene;
use crate::solve::{Diverges, Settings, neumann};
use crate::surfaces::{Atlas, Geometry};

/// The tolerance that patches are cut for before one is asked for.
const TOLERANCE: f64 = 0.01;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// The bounce series is not proved to converge.
    #[error(transparent)]
    Diverges(#[from] Diverges),
    /// K would not fit in memory.
    #[error(transparent)]
    Memory(#[from] Unfit),
}

/// A scene with its rays and surfaces, ready to be solved in any mode; a clone shares them.
///
/// | method | gives |
/// |---|---|
/// | [`render`](Solver::render) | the picture of a mode, to a tolerance, in a time, or with given effort |
/// | [`bounces`](Solver::bounces) | the terms `KⁿE`, with their powers to a tolerance or with given effort |
/// | [`operator`](Solver::operator) | K of a mode, for solvers of [`crate::solve`] or of your own |
/// | [`assemble`](Solver::assemble) | `L = E + K L` of several modes from one cast of rays, with patches and lights |
/// | [`cut`](Solver::cut), [`geometry`](Solver::geometry) | the scene cut into patches; its rays and surfaces |
///
/// Nothing that a solver answers depends on what it was asked before, so it may be shared between threads. Memory and
/// seed are chosen once; work is watched by a [`Watch`].
///
/// ```
/// use halflight::{Fineness, Mode, Scene, Solver};
///
/// let solver = Solver::new(&Scene::open("cornell-box")?).seed(7);
///
/// // A picture with a stated error of at most 10 %, and one with given effort, whose error is not estimated.
/// let picture = solver.render(Mode::Local, (16, 16)).tolerance(0.1)?;
/// assert!(picture.error.total <= 0.1);
/// let coarse = Fineness { patches: 300, rays: 64 };
/// let quick = solver.render(Mode::Global, (16, 16)).fineness(coarse, 16)?;
/// assert_eq!(quick.error.total, 0.0);
///
/// // Powers of KE and K²E within 5 %, with the standard error of each.
/// let series = solver.bounces(Mode::Global, 2).tolerance(0.05);
/// for (bounce, error) in series.solution.bounces.iter().zip(&series.errors) {
///     println!("{}: {:?} W, {:.1} %", bounce.n, bounce.power, 100.0 * error);
/// }
/// assert!(series.errors.iter().all(|error| *error <= 0.05));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Solver {
    /// The scene, cut as it was last.
    last: Mutex<(usize, Discretization)>,
    /// Seconds that building it took.
    ready: f64,
    /// Bytes that K may take.
    memory: f64,
    seed: u32,
    /// What light is taken apart into.
    apart: Apart,
    on_patches: LightOnPatches,
}

impl Clone for Solver {
    fn clone(&self) -> Solver {
        Solver { last: Mutex::new(self.held().clone()), ..*self }
    }
}

impl Solver {
    /// Builds the ray hierarchy and finds the surfaces of a scene, which all else shares. K may take four fifths of the
    /// memory that is free.
    pub fn new(scene: &Scene) -> Solver {
        let patches = Fineness::first(TOLERANCE).patches;
        let (cut, ready) = timed(|| Discretization::new(scene.clone(), patches));
        let last = Mutex::new((patches, cut));
        Solver {
            last,
            ready,
            memory: usable_memory(),
            seed: 0,
            apart: Apart::default(),
            on_patches: LightOnPatches::LeftOut,
        }
    }

    /// Chooses the scrambling of all sample points: a seed gives the same bits on any number of threads.
    pub fn seed(mut self, seed: u32) -> Solver {
        self.seed = seed;
        self
    }

    /// Bytes that K may take; [`Unfit`] says what would fit where it needs more.
    pub fn memory(mut self, bytes: f64) -> Solver {
        self.memory = bytes;
        self
    }

    /// Takes all that is requested apart: [`Rendered::layers`], and the parts of light at points.
    pub fn apart(mut self, apart: Apart) -> Solver {
        let last = self.last.get_mut().unwrap_or_else(PoisonError::into_inner);
        if apart.emitters {
            last.1 = last.1.apart();
        }
        Solver { apart, ..self }
    }

    /// Chooses whether pictures come with the light on patches that they were read from: [`Rendered::light`].
    pub fn light_on_patches(self, on_patches: LightOnPatches) -> Solver {
        Solver { on_patches, ..self }
    }

    /// Takes rows of F from a source that may know some.
    pub fn rows(mut self, rows: Arc<dyn RowSource>) -> Solver {
        self.last.get_mut().unwrap_or_else(PoisonError::into_inner).1.rows = rows;
        self
    }

    /// Makes maps of irradiance over pi, W/(m² sr), in place of pictures: of what an atlas lays out.
    pub fn laid_out(mut self, atlas: Arc<dyn Atlas>) -> Solver {
        let last = self.last.get_mut().unwrap_or_else(PoisonError::into_inner);
        last.1.geometry = last.1.geometry.laid_out(atlas);
        self
    }

    /// The scene, its rays and its surfaces.
    pub fn geometry(&self) -> Arc<Geometry> {
        self.last_cut().geometry
    }

    /// The scene cut into about so many patches of one size; kept until another number is requested.
    pub fn cut(&self, patches: usize) -> Discretization {
        let mut last = self.held();
        if last.0 != patches {
            *last = (patches, last.1.cut(patches));
        }
        last.1.clone()
    }

    /// The picture of a mode, or of any (alpha, tau), so many pixels across and down, from the scene's camera: linear
    /// radiance of the visible half, W/(m² sr).
    pub fn render(&self, mode: impl Into<Transport>, size: impl Into<Size>) -> PictureRequest<'_> {
        PictureRequest {
            solver: self,
            transport: mode.into(),
            size: size.into(),
            time: None,
            pilot: None,
            watch: &Silent,
        }
    }

    /// The irradiance of a mode at points: of the half that travels, as sensors in the scene would measure it.
    pub fn points<'a>(&'a self, mode: impl Into<Transport>, sensors: &'a [Sensor]) -> PointsRequest<'a> {
        PointsRequest { solver: self, transport: mode.into(), sensors, watch: &Silent }
    }

    /// E and the first `count` bounces `KⁿE` of a mode's series.
    pub fn bounces(&self, mode: impl Into<Transport>, count: usize) -> BouncesRequest<'_> {
        BouncesRequest { solver: self, transport: mode.into(), count, time: None, watch: &Silent }
    }

    /// K of a mode with the E it acts on: `L = E + K L`, one equation for each patch, half and channel. F is sampled
    /// with the rays of `fineness`; what is proved of K is proved with that noise in it.
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
        Ok(Equations { modes, apart: self.apart, on_patches: self.on_patches, spent })
    }

    /// Checks that K of a mode fits in memory on the patches that a search for a tolerance begins with: what a few rows
    /// of F show; none where none need be cast.
    ///
    /// # Errors
    /// [`Unfit`] where it does not.
    pub fn pilot(&self, mode: impl Into<Transport>, tolerance: f64) -> Result<Option<Pilot>, Unfit> {
        let first = Fineness::first(tolerance);
        self.cut(first.patches).checked(&[mode.into()], &first.sampling(self.seed), 1, self.memory)
    }

    /// The scene as it was cut last.
    pub fn last_cut(&self) -> Discretization {
        self.held().1.clone()
    }

    /// The scene as it was cut last; what is unwound by an [interrupt](crate::Interrupt) leaves it whole.
    fn held(&self) -> MutexGuard<'_, (usize, Discretization)> {
        self.last.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// `L = E + K L` of one or several modes, and what putting them together took.
pub struct Equations {
    /// In the order in which they were asked for.
    pub modes: Vec<Assembled>,
    apart: Apart,
    on_patches: LightOnPatches,
    spent: Spent,
}

impl Equations {
    /// The first `count` bounces of each equation; errors are not estimated.
    pub fn bounces(self, count: usize) -> Vec<BounceSeries> {
        self.modes.into_iter().map(|mode| BounceSeries::fixed(mode, count)).collect()
    }

    /// Solves each equation and renders it; errors are not estimated. A mode whose spectral radius is not proved to be
    /// below 1 has no picture.
    pub fn render(&self, pass: &GatherPass, watch: &dyn Watch) -> Vec<Result<Rendered, Diverges>> {
        let one = |mode: &Assembled| {
            let mut spent = self.spent.clone();
            let (solution, seconds) = timed(|| neumann(&mode.operator, &Settings::default()));
            let solution = solution?;
            spent.seconds.solve = seconds;
            let ((gathered, emitters), seconds) = timed(|| mode.layered(&solution, pass, self.apart, watch));
            spent.seconds.gather = seconds;
            let rendered = Rendered::new(mode, &solution, gathered, self.apart, spent);
            let light = (self.on_patches == LightOnPatches::Returned)
                .then(|| mode.patch_light(solution.light.into(), solution.terms.into()));
            Ok(Rendered { emitters, light, ..rendered })
        };
        self.modes.iter().map(one).collect()
    }
}

/// A picture that is requested; [`tolerance`](Self::tolerance) or [`fineness`](Self::fineness) makes it.
#[must_use = "nothing is rendered until a tolerance or an effort is given"]
pub struct PictureRequest<'a> {
    solver: &'a Solver,
    transport: Transport,
    size: Size,
    time: Option<f64>,
    pilot: Option<Pilot>,
    watch: &'a dyn Watch,
}

impl<'a> PictureRequest<'a> {
    /// Takes what [`Solver::pilot`] showed for the mode and the tolerance, which is not looked at again.
    pub fn pilot(self, pilot: Option<Pilot>) -> Self {
        Self { pilot, ..self }
    }

    /// Reports every step of the work to `watch`.
    pub fn watch(self, watch: &'a dyn Watch) -> Self {
        Self { watch, ..self }
    }

    /// Ends the search for a tolerance after so many seconds, with the best picture that there is by then.
    pub fn time(self, seconds: f64) -> Self {
        Self { time: Some(seconds), ..self }
    }

    /// The picture with an estimated relative RMS error of at most `tolerance`, such as 0.01, over the pixels that see
    /// no luminaire; patches and rays follow from it.
    ///
    /// Where memory, time or detail end the search before, `error.total` of the picture is larger than `tolerance`.
    ///
    /// # Errors
    /// [`RenderError`] where the series is not proved to converge, or not even a coarse K fits in memory.
    pub fn tolerance(self, tolerance: f64) -> Result<Rendered, RenderError> {
        let deadline = self.time.and_then(|seconds| deadline_after(Instant::now(), seconds));
        let PictureRequest { solver, transport, size, watch, .. } = self;
        let (p, cutting) = timed(|| solver.cut(Fineness::first(tolerance).patches));
        let pilot = match self.pilot {
            None => solver.pilot(transport, tolerance)?,
            known => known,
        };
        let memory = MemoryLimit { bytes: solver.memory, pilot };
        let goal = PictureGoal { tolerance, size, deadline, memory, seed: solver.seed };
        let task = Task { transport, goal: &goal, apart: solver.apart, on_patches: solver.on_patches, watch };
        let found = render_by_deadline(&p, &task)?;
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

/// Light at points that is requested; [`tolerance`](Self::tolerance) computes it.
#[must_use = "nothing is solved until a tolerance is given"]
pub struct PointsRequest<'a> {
    solver: &'a Solver,
    transport: Transport,
    sensors: &'a [Sensor],
    watch: &'a dyn Watch,
}

impl<'a> PointsRequest<'a> {
    /// Has every step of the work reported to `watch`.
    pub fn watch(self, watch: &'a dyn Watch) -> Self {
        Self { watch, ..self }
    }

    /// Irradiance with an estimated relative error of at most `tolerance` at each point; where rays or memory do not
    /// suffice, the errors of the points say so.
    ///
    /// # Errors
    /// [`RenderError`] where the series is not proved to converge, or not even a coarse K fits in memory.
    pub fn tolerance(self, tolerance: f64) -> Result<SensorLights, RenderError> {
        let PointsRequest { solver, transport, sensors, watch } = self;
        let memory = MemoryLimit { bytes: solver.memory, pilot: solver.pilot(transport, tolerance)? };
        let p = solver.cut(Fineness::first(tolerance).patches);
        let size = (1, 1).into();
        let goal = PictureGoal { tolerance, size, deadline: None, memory, seed: solver.seed };
        let (apart, on_patches) = (solver.apart, LightOnPatches::LeftOut);
        Ok(sense(&p, &Task { transport, goal: &goal, apart, on_patches, watch }, sensors)?)
    }
}

/// Terms of a series that are requested; [`tolerance`](Self::tolerance) or [`fineness`](Self::fineness) makes them.
#[must_use = "nothing is solved until a tolerance or an effort is given"]
pub struct BouncesRequest<'a> {
    solver: &'a Solver,
    transport: Transport,
    count: usize,
    time: Option<f64>,
    watch: &'a dyn Watch,
}

impl<'a> BouncesRequest<'a> {
    /// Reports every step of the work to `watch`.
    pub fn watch(self, watch: &'a dyn Watch) -> Self {
        Self { watch, ..self }
    }

    /// Ends the search for a tolerance after about so many seconds.
    pub fn time(self, seconds: f64) -> Self {
        Self { time: Some(seconds), ..self }
    }

    /// The terms with a relative standard error of at most `tolerance` of each one's power, by walks of light from the
    /// emitters; norms and bounds are those of patches whose number follows from it. A series that diverges is shown
    /// growing. [`BounceSeries::end`] says whether it was met.
    pub fn tolerance(self, tolerance: f64) -> BounceSeries {
        let BouncesRequest { solver, transport, count, time, watch } = self;
        let goal = TermsGoal { count, tolerance, time, memory: solver.memory, seed: solver.seed };
        bounces_to_tolerance(&solver.last_cut(), transport, &goal, watch)
    }

    /// The terms on patches of a fineness, powers included; errors are not estimated.
    ///
    /// # Errors
    /// [`Unfit`] where K does not fit in memory.
    pub fn fineness(self, fineness: Fineness) -> Result<BounceSeries, Unfit> {
        let mode = self.solver.assemble(&[self.transport], fineness, self.watch)?.modes.remove(0);
        Ok(BounceSeries::fixed(mode, self.count))
    }
}
