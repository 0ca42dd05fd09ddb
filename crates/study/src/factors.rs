//! Form factors between the objects of a scene, with the sums of their rows and how well they are reciprocal.
//!
//! Every ordered pair is found by itself, so that `A_i F_ij` against `A_j F_ji` is a check and not a tautology. Facets
//! in double precision first; the rows with pairs of too many facets, or whose quadrature was stopped, by rays. Where
//! there is a sky, each row ends with the share of rays that leave the scene, found by rays.

use halflight_team::Loop;

use halflight::form_factors::{Bodies, Estimate, Method, Sampler, Tolerance};
use halflight::rays::Rays;
use halflight::render::Watch;
use halflight::scene::Scene;

/// Share of the relative tolerance that is the absolute one.
const ABSOLUTE: f64 = 1e-3;

/// Work for all quadratures together, see [`Bodies::factor`]: half a minute of one core.
const WORK: usize = 16_000_000;

/// Share of `sqrt(F / N)` that the error of N rays falls to at best (measured: 0.36 for a room's own walls, 1.3 for a
/// table's leg): what is known better is not cast for.
const RAYS_AT_BEST: f64 = 0.3;

/// Rays for all rows together, and for one: half a minute of one core.
const RAYS: (u32, u32) = (1 << 26, 1 << 23);

/// How a form factor was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum How {
    /// Contour integrals: nothing lies between.
    ClosedForm,
    /// Quadrature over the sender of the exact visible part of the receiver.
    Quadrature,
    /// Rays.
    Rays,
}

impl How {
    /// As in the table and the files.
    pub fn name(self) -> &'static str {
        match self {
            How::ClosedForm => "closed-form",
            How::Quadrature => "quadrature",
            How::Rays => "rays",
        }
    }
}

/// One form factor.
#[derive(Clone, Copy, Debug)]
pub struct Factor {
    /// The object that sends rays.
    pub from: usize,
    /// The object that receives them; the one after the last is the sky.
    pub to: usize,
    /// Share of the cosine-distributed rays from `from` that reach fronts of `to`, 0..=1 (more where surfaces
    /// transmit).
    pub share: Estimate,
    /// The way to it.
    pub how: How,
}

/// What is known of one object.
#[derive(Clone, Debug)]
pub struct Row {
    /// Its name in the file.
    pub name: String,
    /// Its sending area in the file's units squared.
    pub area: f64,
    /// Sum of the form factors from it.
    pub sum: Estimate,
}

/// How far two form factors are from being reciprocal.
#[derive(Clone, Copy, Debug)]
pub struct Reciprocity {
    /// The objects, the first with the lower number.
    pub pair: (usize, usize),
    /// `A_i F_ij - A_j F_ji` over the larger of the two; 0 where both are 0.
    pub residual: f64,
    /// Standard error of the residual.
    pub error: f64,
}

/// All form factors between the objects of a scene.
#[derive(Clone, Debug)]
pub struct FactorTable {
    /// The objects.
    pub rows: Vec<Row>,
    /// Names of what receives: the objects and, where there is one, the sky.
    pub columns: Vec<String>,
    /// Row by row.
    pub factors: Vec<Factor>,
    /// All pairs of different objects.
    pub reciprocity: Vec<Reciprocity>,
    /// Form factors whose standard error exceeds the tolerance.
    pub unmet: usize,
}

/// How exact the table is.
#[derive(Clone, Copy, Debug)]
pub struct FactorSettings {
    /// Error allowed, as a share of each form factor; a thousandth of it is allowed to any.
    pub tolerance: f64,
    /// Chooses the rays.
    pub seed: u32,
}

impl FactorSettings {
    fn tolerance(&self) -> Tolerance {
        Tolerance { relative: self.tolerance, absolute: ABSOLUTE * self.tolerance }
    }
}

/// Finds the form factors between all objects; `tau` holds one number per material.
pub fn factors(scene: &Scene, tau: &[f32], settings: &FactorSettings, watch: &dyn Watch) -> FactorTable {
    let tolerance = settings.tolerance();
    let (n, columns) = (scene.solid_objects(), scene.objects.len());
    let bodies = Bodies::new(scene, tau);
    watch.begin("form factors", (n * columns) as u64);
    let pair = |k: usize| {
        let (from, to) = (k / columns, k % columns);
        let found = if to < n { bodies.factor(from, to, &tolerance, WORK / (n * n)) } else { None };
        watch.tick(1);
        found
    };
    let exact: Vec<Option<(Estimate, Method)>> = Loop::each(n * columns).map(pair);
    let most = f64::from(RAYS.1);
    let missing: Vec<bool> = exact
        .iter()
        .map(|found| match found {
            None => true,
            Some((e, _)) => {
                let rays = RAYS_AT_BEST * (e.value / most).sqrt();
                e.error > tolerance.of(e.value).max(rays)
            }
        })
        .collect();
    let sampled = sample_rows(scene, tau, settings, &missing, watch);
    let factors: Vec<Factor> = (0..n * columns)
        .map(|k| {
            let (share, how) = better(exact[k], sampled[k]);
            let (from, to) = (k / columns, k % columns);
            Factor { from, to, share, how }
        })
        .collect();
    summary(scene, &bodies, factors, &tolerance)
}

/// Rays for every row in which something is missing; `None` elsewhere.
fn sample_rows(
    scene: &Scene,
    tau: &[f32],
    settings: &FactorSettings,
    missing: &[bool],
    watch: &dyn Watch,
) -> Vec<Option<Estimate>> {
    let (n, columns) = (scene.solid_objects(), scene.objects.len());
    let mut found = vec![None; n * columns];
    if !missing.contains(&true) {
        return found;
    }
    let rays = Rays::new(scene);
    let rows = missing.chunks(columns).filter(|row| row.contains(&true)).count();
    let sampler = Sampler { scene, rays: &rays, tau, most: (RAYS.0 / rows as u32).min(RAYS.1), seed: settings.seed };
    watch.begin("rays", n as u64);
    for (i, (wanted, row)) in missing.chunks(columns).zip(found.chunks_mut(columns)).enumerate() {
        if wanted.contains(&true) {
            let means = sampler.row(i as u32, wanted, &settings.tolerance());
            for (cell, mean) in row.iter_mut().zip(means) {
                *cell = Some(mean);
            }
        }
        watch.tick(1);
    }
    found
}

/// The estimate with the smaller error.
fn better(exact: Option<(Estimate, Method)>, sampled: Option<Estimate>) -> (Estimate, How) {
    let exact = exact.map(|(e, method)| match method {
        Method::ClosedForm => (e, How::ClosedForm),
        Method::Quadrature => (e, How::Quadrature),
    });
    match (exact, sampled) {
        (Some(e), Some(s)) if s.error < e.0.error => (s, How::Rays),
        (Some(e), _) => e,
        (None, s) => (s.unwrap_or_default(), How::Rays),
    }
}

fn summary(scene: &Scene, bodies: &Bodies, factors: Vec<Factor>, tolerance: &Tolerance) -> FactorTable {
    let (n, columns) = (scene.solid_objects(), scene.objects.len());
    let square = scene.frame.scale * scene.frame.scale;
    let row = |i: usize| {
        let own = &factors[i * columns..(i + 1) * columns];
        let value = own.iter().map(|f| f.share.value).sum();
        let squares: f64 = own.iter().map(|f| f.share.error.powi(2)).sum();
        let error = squares.sqrt();
        Row { name: scene.objects[i].clone(), area: square * bodies.area(i), sum: Estimate { value, error } }
    };
    let pairs = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
    let areas: Vec<f64> = (0..n).map(|i| bodies.area(i)).collect();
    let reciprocity = pairs.map(|(i, j)| {
        let exchange = |i: usize, j: usize| {
            let share = factors[i * columns + j].share;
            (areas[i] * share.value, areas[i] * share.error)
        };
        let ((sent, e), (back, g)) = (exchange(i, j), exchange(j, i));
        let larger = sent.max(back);
        let over = if larger > 0.0 { 1.0 / larger } else { 0.0 };
        Reciprocity { pair: (i, j), residual: over * (sent - back), error: over * e.hypot(g) }
    });
    let unmet = |f: &&Factor| f.share.error > tolerance.of(f.share.value);
    FactorTable {
        reciprocity: reciprocity.collect(),
        rows: (0..n).map(row).collect(),
        columns: scene.objects.clone(),
        unmet: factors.iter().filter(unmet).count(),
        factors,
    }
}
