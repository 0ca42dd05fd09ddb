//! The way from a scene to its solutions: rays, patches, form factors, K, L and the picture, with what each step cost.
//!
//! One set of patches and one cast of rays serves all the modes asked for.

use std::sync::Arc;
use std::time::Instant;

use crate::form_factors::{
    self, Closure, Luminaires, Sampling, Sight, Variant, closure, receive_emitted,
};
use crate::image::{Fields, Gathered, Gathering, View, gather, invisible, linear};
use crate::light::{Light, Rgb, Transport};
use crate::operator::{Operator, PatchMaterials};
use crate::patches::Patches;
use crate::rays::Rays;
use crate::scene::Scene;
use crate::solve::{Settings, Solution};

/// How fine.
#[derive(Clone, Copy, Debug)]
pub struct Fineness {
    /// About how many patches.
    pub patches: usize,
    /// Rays from each patch.
    pub sampling: Sampling,
    /// Wanted tail of the series, as a share of the sum.
    pub solve: Settings,
}

impl Default for Fineness {
    fn default() -> Self {
        Fineness {
            patches: 4000,
            sampling: Sampling::default(),
            solve: Settings::default(),
        }
    }
}

/// Seconds spent on each step.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub struct Seconds {
    /// Reading and checking the files.
    pub load: f64,
    /// Building the ray hierarchy and cutting patches.
    pub patches: f64,
    /// Casting rays for F; shared by all modes of one run.
    pub form_factors: f64,
    /// Bounds on the spectral radius, and the series.
    pub solve: f64,
    /// Rendering the pixels.
    pub gather: f64,
    /// All of these.
    pub total: f64,
}

impl Seconds {
    /// Sets the total.
    pub fn sum(&mut self) {
        self.total = self.load + self.patches + self.form_factors + self.solve + self.gather;
    }
}

/// A scene made ready for any mode.
pub struct Prepared {
    /// The scene.
    pub scene: Scene,
    /// Its rays.
    pub rays: Rays,
    /// Its patches.
    pub patches: Patches,
    /// Its emitters by closed form.
    pub luminaires: Luminaires,
    /// Bytes that K may take; patches that are cut anew stay within. Infinite at first.
    pub memory: f64,
    /// Seconds this took.
    pub seconds: f64,
}

/// K of one mode, with what is known of its F.
pub struct Assembled {
    /// The default (alpha, tau) it was made for.
    pub transport: Transport,
    /// (alpha, tau) of every material.
    pub transports: Vec<Transport>,
    /// What lies between patches and luminaires.
    pub sight: Arc<Sight>,
    /// K.
    pub operator: Operator,
    /// Row sums of F; none where no ray was needed.
    pub closure: Option<Closure>,
}

/// What happens while the pipeline works.
pub trait Watch: Sync {
    /// A step of `length` ticks begins.
    fn begin(&self, step: &str, length: u64);
    /// So many ticks were done.
    fn tick(&self, done: u64);
}

/// Watches nothing.
pub struct Silent;

impl Watch for Silent {
    fn begin(&self, _step: &str, _length: u64) {}
    fn tick(&self, _done: u64) {}
}

/// Builds rays, patches and luminaires.
pub fn prepare(scene: Scene, patches: usize) -> Prepared {
    let start = Instant::now();
    let rays = Rays::new(&scene);
    let patches = Patches::new(&scene, &rays, patches);
    let luminaires = Luminaires::new(&scene);
    Prepared {
        scene,
        rays,
        patches,
        luminaires,
        memory: f64::INFINITY,
        seconds: start.elapsed().as_secs_f64(),
    }
}

impl Prepared {
    /// Cuts the surfaces anew, into about so many patches; scene, rays and luminaires stay.
    pub fn recut(&mut self, patches: usize) {
        let start = Instant::now();
        self.patches = Patches::new(&self.scene, &self.rays, patches);
        self.seconds += start.elapsed().as_secs_f64();
    }
}

/// Casts the rays for all `modes` at once and puts each one's K together; also tells how many rays were cast.
pub fn assemble(
    p: &Prepared,
    modes: &[Transport],
    sampling: &Sampling,
    watch: &dyn Watch,
) -> (Vec<Assembled>, u64) {
    let sights: Vec<Arc<Sight>> = modes
        .iter()
        .map(|&m| sight(p, &p.scene.transports(m)))
        .collect();
    assemble_seeing(p, modes, &sights, sampling, watch)
}

/// The same where it is known what lies between patches and luminaires.
pub(super) fn assemble_seeing(
    p: &Prepared,
    modes: &[Transport],
    sights: &[Arc<Sight>],
    sampling: &Sampling,
    watch: &dyn Watch,
) -> (Vec<Assembled>, u64) {
    let transports: Vec<Vec<Transport>> = modes.iter().map(|&m| p.scene.transports(m)).collect();
    let materials: Vec<PatchMaterials> = transports
        .iter()
        .map(|t| PatchMaterials::new(&p.scene, &p.patches, &p.luminaires, t))
        .collect();
    let variants: Vec<Variant> = transports
        .iter()
        .zip(&materials)
        .map(|(t, m)| Variant {
            tau: t.iter().map(|t| t.tau).collect(),
            rows: m.receives(),
            columns: m.sends(),
        })
        .collect();
    watch.begin("form factors", p.patches.len() as u64);
    let tick = |done| watch.tick(done);
    let path = (&p.rays, &p.patches);
    let (factors, mut rays) = form_factors::cast(&p.scene, path, &variants, sampling, &tick);
    let unit = p.scene.frame.scale * p.scene.frame.scale;
    let areas: Vec<f64> = p.patches.areas().iter().map(|a| a * unit).collect();
    let mut assembled = Vec::new();
    for ((((f, m), t), &transport), sight) in factors
        .into_iter()
        .zip(materials)
        .zip(transports)
        .zip(modes)
        .zip(sights)
    {
        let sight = Arc::clone(sight);
        let (received, cast) = received(p, &sight, &m, sampling, watch);
        rays += cast;
        let closure = closure(&f, p.patches.areas());
        let operator = Operator::new(f, m, areas.clone(), received);
        assembled.push(Assembled {
            transport,
            transports: t,
            sight,
            operator,
            closure,
        });
    }
    (assembled, rays)
}

/// What lies between the patches and the luminaires.
pub(super) fn sight(p: &Prepared, transports: &[Transport]) -> Arc<Sight> {
    let reflects = |&m: &u32| p.scene.materials[m as usize].rho != Rgb::ZERO;
    let receives: Vec<bool> = p.patches.materials().iter().map(reflects).collect();
    let (scene, path, lamps) = (&p.scene, (&p.rays, &p.patches), &p.luminaires);
    Arc::new(Sight::new(scene, path, lamps, transports, &receives))
}

/// `F E` of the luminaires for every patch that reflects.
fn received(
    p: &Prepared,
    sight: &Sight,
    materials: &PatchMaterials,
    sampling: &Sampling,
    watch: &dyn Watch,
) -> (Vec<Rgb>, u64) {
    watch.begin("light as emitted", p.patches.len() as u64);
    receive_emitted(
        (&p.rays, &p.patches),
        &p.luminaires,
        sight,
        &materials.receives(),
        sampling,
        &|done| watch.tick(done),
    )
}

/// What hemisphere rays read of E: all of it but the luminaires', which are gathered by closed form.
pub fn without_luminaires(p: &Prepared, emission: &[Light]) -> Vec<Rgb> {
    let mut field = invisible(emission);
    for (l, &material) in field.iter_mut().zip(p.patches.materials()) {
        if p.luminaires.carries[material as usize] {
            *l = Rgb::ZERO;
        }
    }
    field
}

/// The invisible light that the picture of a solution reads: every term, luminaires' emission excepted.
pub(super) fn reflected(p: &Prepared, terms: &[Vec<Light>]) -> Vec<Rgb> {
    let mut terms = terms.iter();
    let mut field = terms
        .next()
        .map_or_else(Vec::new, |emission| without_luminaires(p, emission));
    for term in terms {
        for (sum, l) in field.iter_mut().zip(term) {
            *sum += l.invisible;
        }
    }
    field
}

/// What the patches receive of the reflected light, irradiance over pi.
pub(super) fn ambient(mode: &Assembled, solution: &Solution) -> Vec<Rgb> {
    let k = &mode.operator;
    let received = |i: usize| {
        let visible = solution.light[i].visible - k.emission()[i].visible;
        let rho = k.reflectance(i);
        let over = |c: usize| {
            if rho[c] > 0.0 {
                visible[c] / rho[c]
            } else {
                0.0
            }
        };
        Rgb::new(over(0), over(1), over(2)) - k.received()[i]
    };
    (0..k.len()).map(received).collect()
}

/// Renders fields of patch light under one choice of (alpha, tau) for every material.
pub fn picture(
    p: &Prepared,
    transports: &[Transport],
    fields: &Fields,
    size: (usize, usize),
    gathering: impl Into<Gathering>,
    watch: &dyn Watch,
) -> Gathered {
    let sight = sight(p, transports);
    look(p, (transports, &sight), fields, size, gathering, watch)
}

/// Fields to gather from one value a patch each, read as linear within a patch.
pub(super) fn fields(p: &Prepared, values: &[Vec<Rgb>]) -> Fields {
    let neighbours = p.patches.neighbours();
    let each = values.iter().map(|field| linear(&neighbours, field));
    Fields::linear(&each.collect::<Vec<_>>())
}

/// Renders the solution of one mode.
pub fn render(
    p: &Prepared,
    mode: &Assembled,
    solution: &Solution,
    size: (usize, usize),
    gathering: impl Into<Gathering>,
    watch: &dyn Watch,
) -> Gathered {
    let fields = fields(p, &[reflected(p, &solution.terms)]).with_ambient(ambient(mode, solution));
    let surfaces = (&mode.transports[..], &*mode.sight);
    look(p, surfaces, &fields, size, gathering, watch)
}

/// Renders the visible half of what the fields send.
pub(super) fn look(
    p: &Prepared,
    (transports, sight): (&[Transport], &Sight),
    fields: &Fields,
    (width, height): (usize, usize),
    gathering: impl Into<Gathering>,
    watch: &dyn Watch,
) -> Gathered {
    let view = View {
        scene: &p.scene,
        rays: &p.rays,
        patches: &p.patches,
        luminaires: &p.luminaires,
        sight,
        transports,
        width,
        height,
    };
    watch.begin("gather", height as u64);
    gather(&view, fields, &gathering.into(), &|done| watch.tick(done))
}
