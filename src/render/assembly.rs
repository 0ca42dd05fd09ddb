//! The way from a scene to its operators: rays, patches, form factors and K, with what each step cost.
//!
//! One set of patches and one cast of rays serves all the modes asked for.

use std::ops::Deref;
use std::sync::Arc;
use std::time::Instant;

use crate::direct::{Lighting, Luminaires, Sight, receive_emitted, receive_punctual};
use crate::form_factors::{Closure, Sampling, Variant, cast_counts, closure};
use crate::light::{Rgb, Transport};
use crate::operator::{Operator, PatchMaterials};
use crate::patches::{Patches, Sample};
use crate::rays::Rays;
use crate::scene::Scene;
use crate::surfaces::Surfaces;

/// Seconds spent on each step.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub struct Seconds {
    /// Reading and checking the files.
    pub load: f64,
    /// Building the ray hierarchy, which all modes of one run share, and cutting patches.
    pub patches: f64,
    /// Casting rays for F; shared by all modes of one run.
    pub form_factors: f64,
    /// Bounds on the spectral radius, the series, and measuring its light at points.
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

    /// These and so many that making the scene ready took.
    pub(crate) fn after(mut self, prepared: f64) -> Seconds {
        self.patches += prepared;
        self.sum();
        self
    }

    /// The seconds of both, step by step.
    pub(crate) fn plus(&self, other: &Seconds) -> Seconds {
        Seconds {
            load: self.load + other.load,
            patches: self.patches + other.patches,
            form_factors: self.form_factors + other.form_factors,
            solve: self.solve + other.solve,
            gather: self.gather + other.gather,
            total: self.total + other.total,
        }
    }
}

/// What no choice of patches changes: a scene, its rays and its surfaces.
pub struct Geometry {
    /// The scene.
    pub scene: Scene,
    /// Its rays.
    pub rays: Rays,
    /// Its surfaces.
    pub surfaces: Arc<Surfaces>,
    /// Seconds that finding them, and cutting the first patches, took.
    pub seconds: f64,
}

/// A scene made ready for any mode: its [`Geometry`], which nothing changes and which is read as if it were part of
/// this, and what is cut anew.
pub struct Prepared {
    geometry: Geometry,
    /// Its patches.
    pub patches: Patches,
    /// Its emitters by closed form.
    pub luminaires: Luminaires,
    /// Rays of each patch over the number asked for; empty where all have the same.
    pub(crate) densities: Vec<f32>,
    /// The number of patches asked for, where all of them are of one size as first cut.
    even: Option<usize>,
}

/// Rays, scene and surfaces are there to be read; there is no way to change them.
impl Deref for Prepared {
    type Target = Geometry;

    fn deref(&self) -> &Geometry {
        &self.geometry
    }
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
    let surfaces = Surfaces::new(&scene, &rays);
    let cut = Patches::cut(&scene, &rays, &surfaces, patches);
    let luminaires = Luminaires::new(&scene);
    let seconds = start.elapsed().as_secs_f64();
    let geometry = Geometry { scene, rays, surfaces, seconds };
    Prepared { geometry, patches: cut, luminaires, densities: Vec::new(), even: Some(patches) }
}

impl Prepared {
    /// The patches that [`Prepared::recut`] makes, which is not done again where they are those.
    pub(crate) fn cut_to(&mut self, patches: usize) {
        if self.even == Some(patches) {
            self.densities.clear();
        } else {
            self.recut(patches);
        }
    }

    /// Cuts the surfaces anew, into about so many patches; scene, rays and luminaires stay.
    pub fn recut(&mut self, patches: usize) {
        self.densities.clear();
        self.patches = Patches::cut(&self.scene, &self.rays, &self.surfaces, patches);
        self.even = Some(patches);
    }

    /// Divides the patches as they were cut by the light sampled on them.
    pub(crate) fn divide(&mut self, samples: Vec<Vec<Sample>>) {
        self.even = None;
        self.patches.divide(samples);
    }

    /// Mean over the patches of their rays over the number asked for.
    pub(crate) fn density(&self) -> f64 {
        let sum: f64 = self.densities.iter().map(|&d| f64::from(d)).sum();
        match self.densities.len() {
            0 => 1.0,
            n => sum / n as f64,
        }
    }

    /// Rays of each patch where `rays` are asked for.
    fn counts(&self, rays: u32) -> Vec<u32> {
        let count = |density: &f32| (rays as f32 * density).ceil() as u32;
        if self.densities.len() == self.patches.len() {
            self.densities.iter().map(count).collect()
        } else {
            vec![rays; self.patches.len()]
        }
    }
}

/// Casts the rays for all `modes` at once and puts each one's K together; also tells how many rays were cast.
pub fn assemble(p: &Prepared, modes: &[Transport], sampling: &Sampling, watch: &dyn Watch) -> (Vec<Assembled>, u64) {
    let sights: Vec<Arc<Sight>> = modes.iter().map(|&m| sight(p, &p.scene.transports(m))).collect();
    assemble_seeing(p, modes, &sights, sampling, watch)
}

/// The same where it is known what lies between patches and luminaires.
pub(crate) fn assemble_seeing(
    p: &Prepared,
    modes: &[Transport],
    sights: &[Arc<Sight>],
    sampling: &Sampling,
    watch: &dyn Watch,
) -> (Vec<Assembled>, u64) {
    let transports: Vec<Vec<Transport>> = modes.iter().map(|&m| p.scene.transports(m)).collect();
    let materials: Vec<PatchMaterials> =
        transports.iter().map(|t| PatchMaterials::new(&p.scene, &p.patches, &p.luminaires, t)).collect();
    let variants: Vec<Variant> = transports
        .iter()
        .zip(&materials)
        .map(|(t, m)| Variant { tau: t.iter().map(|t| t.tau).collect(), rows: m.receives(), columns: m.sends() })
        .collect();
    watch.begin("form factors", p.patches.len() as u64);
    let tick = |done| watch.tick(done);
    let counts = p.counts(sampling.rays);
    let (factors, mut rays) = cast_counts(&p.rays, &p.patches, &variants, sampling, &counts, &tick);
    let unit = p.scene.frame.scale * p.scene.frame.scale;
    let areas: Vec<f64> = p.patches.areas().iter().map(|a| a * unit).collect();
    let mut assembled = Vec::new();
    for ((((f, m), t), &transport), sight) in factors.into_iter().zip(materials).zip(transports).zip(modes).zip(sights)
    {
        let sight = Arc::clone(sight);
        let received = received(p, &sight, &m, sampling, watch);
        rays += received.rays;
        let closure = closure(&f, p.patches.areas());
        let operator = Operator::new(f, m, areas.clone(), received.luminaires).with_punctual(&received.punctual);
        assembled.push(Assembled { transport, transports: t, sight, operator, closure });
    }
    (assembled, rays)
}

/// What lies between the patches and the luminaires.
pub(crate) fn sight(p: &Prepared, transports: &[Transport]) -> Arc<Sight> {
    let reflects = |&m: &u32| p.scene.materials[m as usize].rho != Rgb::ZERO;
    let receives: Vec<bool> = p.patches.materials().iter().map(reflects).collect();
    Arc::new(Sight::new(&p.scene, &p.rays, &p.patches, &p.luminaires, transports, &receives))
}

/// What patches receive as emitted.
pub(crate) struct Received {
    /// `F E` of the luminaires for every patch that reflects.
    pub luminaires: Vec<Rgb>,
    /// Irradiance over pi from lights without area; empty where there are none.
    pub punctual: Vec<Rgb>,
    /// Rays cast.
    pub rays: u64,
}

/// Light as emitted that every patch that reflects receives by closed form.
pub(crate) fn received(
    p: &Prepared,
    sight: &Sight,
    materials: &PatchMaterials,
    sampling: &Sampling,
    watch: &dyn Watch,
) -> Received {
    watch.begin("light as emitted", p.patches.len() as u64);
    let lighting = Lighting { rays: &p.rays, luminaires: &p.luminaires, sight };
    let receives = materials.receives();
    let (luminaires, cast) = receive_emitted(&lighting, &p.patches, &receives, sampling, &|done| watch.tick(done));
    let (punctual, more) = receive_punctual(&lighting, &p.patches, &receives, sampling);
    Received { luminaires, punctual, rays: cast + more }
}
