//! The way from a scene to its solutions: rays, patches, form factors, K, L and the picture, with what each step cost.
//!
//! One set of patches and one cast of rays serves all the modes asked for.

use std::time::Instant;

use crate::form_factors::{
    self, Closure, Luminaires, Occlusion, Sampling, Variant, closure, receive_emitted,
};
use crate::image::{Fields, GatherSampling, Gathered, View, gather, invisible};
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
    /// Seconds this took.
    pub seconds: f64,
}

/// K of one mode, with what is known of its F.
pub struct Assembled {
    /// The default (alpha, tau) it was made for.
    pub transport: Transport,
    /// (alpha, tau) of every material.
    pub transports: Vec<Transport>,
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
        seconds: start.elapsed().as_secs_f64(),
    }
}

impl Prepared {
    /// Cuts the surfaces anew; scene, rays and luminaires stay.
    pub fn recut(&mut self, patches: usize) {
        self.patches = Patches::new(&self.scene, &self.rays, patches);
    }
}

/// Casts the rays for all `modes` at once and puts each one's K together; also tells how many rays were cast.
pub fn assemble(
    p: &Prepared,
    modes: &[Transport],
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
    for (((f, m), t), &transport) in factors
        .into_iter()
        .zip(materials)
        .zip(transports)
        .zip(modes)
    {
        let (received, cast) = received(p, &t, &m, sampling, watch);
        rays += cast;
        let closure = closure(&f, p.patches.areas());
        let operator = Operator::new(f, m, areas.clone(), received);
        assembled.push(Assembled {
            transport,
            transports: t,
            operator,
            closure,
        });
    }
    (assembled, rays)
}

/// `F E` of the luminaires for every patch that reflects.
fn received(
    p: &Prepared,
    transports: &[Transport],
    materials: &PatchMaterials,
    sampling: &Sampling,
    watch: &dyn Watch,
) -> (Vec<Rgb>, u64) {
    watch.begin("light as emitted", p.patches.len() as u64);
    let occlusion = Occlusion::new(&p.rays, transports);
    receive_emitted(
        (&p.rays, &p.patches),
        &p.luminaires,
        &occlusion,
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
fn reflected(p: &Prepared, solution: &Solution) -> Vec<Rgb> {
    let mut terms = solution.terms.iter();
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

/// Renders fields of patch light under one mode.
pub fn picture(
    p: &Prepared,
    transports: &[Transport],
    fields: &Fields,
    (width, height): (usize, usize),
    sampling: &GatherSampling,
    watch: &dyn Watch,
) -> Gathered {
    let view = View {
        scene: &p.scene,
        rays: &p.rays,
        patches: &p.patches,
        luminaires: &p.luminaires,
        transports,
        width,
        height,
    };
    watch.begin("gather", height as u64);
    gather(&view, fields, sampling, &|done| watch.tick(done))
}

/// Renders the solution of one mode.
pub fn render(
    p: &Prepared,
    mode: &Assembled,
    solution: &Solution,
    size: (usize, usize),
    sampling: &GatherSampling,
    watch: &dyn Watch,
) -> Gathered {
    let fields = Fields::new(&[reflected(p, solution)]);
    picture(p, &mode.transports, &fields, size, sampling, watch)
}
