//! The page's own picture beside a rendered one: cells are made finer until both are near to each other, or the page
//! is large.
//!
//! Where the first picture is too far off, the terms are solved once more on patches divided where light differs
//! ([`Reached::divided`]). What changes from one attempt to the next are the charts, direct light in their texels
//! and the rows of F of their cells. The picture that is compared is the one that a page opens with, all of global
//! illumination by the file's camera, over the pixels that see no emission.
//!
//! Not handled: scenes whose light at alpha 1 and tau 0 has no rendered picture, whose cells stay as large as patches;
//! what is seen from anywhere else.

use glam::DVec3;

use crate::cell_rows::{CellRows, SentOnce};
use crate::charts::Charts;
use crate::drawn::{SeenError, View};
use crate::finer::Finer;
use crate::light::Layers;
use crate::reached::Reached;
use crate::sums::{Shown, State};
use crate::terms::Solved;
use halflight::light::{Mode, Transport};
use halflight::patches::Patches;
use halflight::pictures::{Picture, Size, relative_rms};
use halflight::render::{Discretization, Solver, Watch};
use halflight::scene::{Emitters, Scene};

/// Texels of direct light to a side of a cell at most, and in all.
const FINEST: usize = 4;
const TEXELS: usize = 1_000_000;
/// The picture that the page is compared with: pixels, its error, and points of a pixel to a side.
const COMPARED: Size = Size { width: 160, height: 90 };
const COMPARED_WITHIN: f64 = 0.02;
const POINTS: usize = 4;
/// Attempts to come nearer.
const ATTEMPTS: usize = 3;
/// The share of an error that is aimed at, so that it is met for certain.
const AIM: f64 = 0.8;
/// Bytes that a number of light takes at first: half of its own two, in the 4/3 of base64.
const BYTES: f64 = 4.0 / 3.0;

/// How near to a rendered picture a page comes, and how large it may get.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Relative RMS difference that is near enough.
    pub within: f64,
    /// Bytes that finer cells may make of it.
    pub bytes: usize,
}

/// What an attempt is made of.
pub(super) struct Fitting<'a> {
    /// The scene on patches that stand for what of them is reached.
    pub cut: &'a Discretization,
    /// The patches as they were cut.
    pub patches: &'a Patches,
    pub solved: &'a Solved,
    pub seed: u32,
    pub watch: &'a dyn Watch,
}

/// The light of a page, and how far its picture is off.
pub(super) struct Fitted {
    pub charts: Charts,
    pub layers: Layers,
    /// None where there is nothing to compare with.
    pub rms: Option<f64>,
    errors: Vec<SeenError>,
    /// Of each texel its number before those that nothing reaches were left out.
    texels: Vec<usize>,
}

impl Fitting<'_> {
    fn scene(&self) -> &Scene {
        &self.cut.geometry.scene
    }

    /// A view of the charts by the file's camera.
    pub fn view(&self, charts: &Charts, size: Size, step: usize) -> View {
        let scene = self.scene();
        let emitters = &*Emitters::of(scene);
        let lamp_of = |face: u32| self.solved.lamp_of.get(emitters.of_face(scene, face)).copied().unwrap_or(0);
        View::new((scene, &self.cut.geometry.rays), charts, &lamp_of, size, step)
    }

    /// The light of charts, and what it is off by.
    pub fn attempt(&self, (charts, reached): (Charts, Reached), rendered: Option<&Picture>) -> Fitted {
        let Fitting { cut, solved, seed, watch, .. } = *self;
        let scene = self.scene();
        let (charts, texels) = charts.kept(scene, &reached.counts);
        let mut reached = reached.of(&texels);
        for (point, patch) in reached.places.iter_mut().flatten() {
            let side = cut.patches.side(*patch as usize);
            *patch = cut.patches.at(point.face, side, point.position).unwrap_or(*patch);
        }
        let taus: Vec<Vec<f32>> = solved.kept.taus.iter().map(|&tau| of_materials(scene, tau)).collect();
        let direct = solved.direct(&reached.places, watch);
        watch.begin("small faces", 1);
        let sent_once = |q: usize, lamp: usize, texel: usize, part: usize| {
            let node = &solved.nodes[q];
            if reached.counts[texel] == 0 {
                return solved.alpha[part] * node.terms[lamp][0][part];
            }
            solved.alpha[part] * solved.rho[part] * (direct[q][lamp][texel] + node.glow[lamp][part])
        };
        let once = (&sent_once as SentOnce, solved.lamps.len());
        let rows = CellRows::new((&cut.geometry.rays, &cut.patches), &charts, &reached, &taus, once, seed);
        let layers = Layers::new((solved, direct), &charts, &rows, &reached);
        let state = State { alpha: 1.0, tau: 0.0, shown: Shown::All, gains: solved.gains(), rho: 1.0, stops: 0.0 };
        let view = self.view(&charts, COMPARED, POINTS);
        let (own, mask) = (view.picture(&layers, &solved.kept.mixture(&state)), view.mask());
        let rms = rendered.and_then(|rendered| relative_rms(&own, rendered, Some(&mask), None).ok());
        let errors = rendered.map_or_else(Vec::new, |rendered| view.errors([&own, rendered], &mask));
        Fitted { charts, layers, rms, errors, texels }
    }

    /// Numbers of light of a cell and its texels.
    fn numbers_of_cell(&self, fine: usize) -> f64 {
        let kept = &self.solved.kept;
        let of_lamp = kept.terms() - 1 + fine * fine;
        (3 * kept.taus.len() * (self.solved.lamps.len() * of_lamp + 1)) as f64
    }

    /// The light of finer charts than the first, where that comes nearer to a rendered picture; `bytes` tells how large
    /// a page would be.
    pub fn refined<E>(
        &self,
        mut best: Fitted,
        rendered: Option<&Picture>,
        limits: &Limits,
        bytes: impl Fn(&Fitted) -> Result<usize, E>,
    ) -> Result<Fitted, E> {
        let fine = best.charts.fine;
        let (mut finer, mut of_cell) = (Finer::default(), BYTES * self.numbers_of_cell(fine));
        let mut size = if best.is_far(limits) { bytes(&best)? } else { 0 };
        for _ in 0..ATTEMPTS {
            let room = (limits.bytes as f64 - size as f64) / of_cell;
            let mut next = finer.clone();
            let enough = (AIM * limits.within).powi(2);
            if !best.is_far(limits) || !next.refine((self.scene(), &best.charts), &best.errors, enough, room) {
                break;
            }
            let charts = Charts::new(self.scene(), self.patches, fine, &next);
            let reached = Reached::new(&self.cut.geometry, &charts, self.patches, self.seed);
            let tried = self.attempt((charts, reached), rendered);
            let (larger, more) = (bytes(&tried)?, tried.charts.cells.len() as f64 - best.charts.cells.len() as f64);
            of_cell = ((larger as f64 - size as f64) / more.max(1.0)).max(1.0);
            if larger > limits.bytes {
                continue;
            }
            if tried.rms >= best.rms {
                break;
            }
            (best, finer, size) = (tried, next, larger);
        }
        Ok(best)
    }
}

impl Fitted {
    /// Whether a picture is further off than is near enough.
    pub fn is_far(&self, limits: &Limits) -> bool {
        self.rms.is_some_and(|rms| rms > limits.within)
    }

    /// The light of lamps that leaves each texel of so many there were before those that nothing reaches were left out.
    pub fn reflected_once(&self, scene: &Scene, count: usize) -> Vec<DVec3> {
        let mut light = vec![DVec3::ZERO; count];
        for chart in &self.charts.list {
            let rho = scene.materials[chart.material as usize].rho.as_dvec3();
            let block = self.charts.fine * self.charts.fine;
            let own = chart.first * block..(chart.first + chart.columns * chart.rows) * block;
            for texel in own {
                let sum: DVec3 = self.layers.direct[0].iter().map(|lamp| lamp[texel].as_dvec3()).sum();
                light[self.texels[texel]] = rho * sum;
            }
        }
        light
    }
}

/// The picture that pages are compared with; none where the series has no sum.
pub(super) fn reference(solver: &Solver, watch: &dyn Watch) -> Option<Picture> {
    let asked = solver.render(Mode::Global, COMPARED).watch(watch);
    asked.tolerance(COMPARED_WITHIN).ok().map(|rendered| rendered.picture)
}

/// tau of every material where those without their own take `tau`.
fn of_materials(scene: &Scene, tau: f64) -> Vec<f32> {
    scene.transports(Transport { alpha: 1.0, tau: tau as f32 }).iter().map(|own| own.tau).collect()
}

/// The charts of patches, with as many texels to a side of a cell as fit.
pub(super) fn first_charts(scene: &Scene, patches: &Patches) -> Charts {
    let of = |fine| Charts::new(scene, patches, fine, &Finer::default());
    let fits = |charts: &Charts| charts.fine == 1 || charts.texels() <= TEXELS;
    (2..=FINEST).rev().map(of).find(fits).unwrap_or_else(|| of(1))
}
