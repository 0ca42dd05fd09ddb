//! Shim.
#![allow(missing_docs)]

use crate::direct::luminaire_texture::TOLERABLE;
use std::sync::Arc;
use std::time::Instant;

use crate::direct::Lights;
use crate::direct::Luminaires;
use crate::direct::Received;
use crate::form_factors::Sampling;
use crate::gather::GatherPass;
use crate::gather::Gathered;
use crate::gather::Gathering;
use crate::gather::gather;
use crate::light::{Light, Rgb, Transport};
use crate::operator::PatchMaterials;
use crate::patches::Patches;
use crate::pictures::Size;
use crate::reading::Fields;
use crate::reading::View;
use crate::reading::invisible;
use crate::reading::linear;
use crate::render::assembly::{Assembled, Discretization, Watch};
use crate::render::bounces::BounceSeries;
use crate::render::bounces::bounces_to_tolerance;
use crate::render::memory::{Estimate, Held, check_held, estimate};
use crate::render::rendered::Rendered;
use crate::render::unfit::Unfit;
use crate::scene::Scene;
use crate::solve::{AssembledShooter, Diverges, RaySettings, RayShooter, Solution};
use crate::surfaces::Geometry;

pub struct Prepared {
    pub(crate) cut: Discretization,
    pub patches: Arc<Patches>,
    pub luminaires: Arc<Luminaires>,
    pub seconds: f64,
}
impl std::ops::Deref for Prepared {
    type Target = Geometry;
    fn deref(&self) -> &Geometry {
        &self.cut.geometry
    }
}
pub fn prepare(scene: Scene, patches: usize) -> Prepared {
    let start = Instant::now();
    let cut = Discretization::new(scene, patches);
    let (patches, luminaires) = (Arc::clone(&cut.patches), Arc::clone(&cut.luminaires));
    Prepared { cut, patches, luminaires, seconds: start.elapsed().as_secs_f64() }
}
impl Prepared {
    pub fn recut(&mut self, patches: usize) {
        self.cut = self.cut.cut(patches);
        self.patches = Arc::clone(&self.cut.patches);
    }
    pub fn lights(&self, transports: Vec<Transport>) -> Arc<Lights> {
        self.cut.lights(transports, TOLERABLE)
    }
}
pub fn assemble(p: &Prepared, modes: &[Transport], sampling: &Sampling, watch: &dyn Watch) -> (Vec<Assembled>, u64) {
    let lights: Vec<_> = modes.iter().map(|&m| (m, p.lights(p.scene.transports(m)))).collect();
    crate::render::assembly::assemble(&lights, sampling, watch)
}
pub fn ray_shooter(p: &Prepared, mode: Transport, settings: RaySettings) -> RayShooter<'static> {
    let lights = Box::leak(Box::new(p.lights(p.scene.transports(mode))));
    RayShooter::new(lights, settings)
}
pub fn assembled_shooter(mode: &Assembled) -> AssembledShooter<'_> {
    mode.shooter()
}
pub fn check_memory(p: &Prepared, modes: &[Transport], sampling: &Sampling, limit: f64) -> Result<(), Unfit> {
    check_held(&p.cut, modes, sampling, Held::of_modes(modes, 1), limit)
}
pub fn estimate_memory(p: &Prepared, modes: &[Transport], sampling: &Sampling, casts: usize, limit: f64) -> Estimate {
    estimate(&p.cut, modes, sampling, Held::of_modes(modes, casts), limit)
}
#[derive(Clone, Copy, Debug)]
pub struct Wanted {
    pub tolerance: f64,
    pub size: Size,
    pub deadline: Option<Instant>,
    pub memory: f64,
    pub seed: u32,
}
pub fn render_within(
    p: &mut Prepared,
    transport: Transport,
    w: &Wanted,
    watch: &dyn Watch,
) -> Result<Rendered, Diverges> {
    let Wanted { tolerance, size, deadline, memory, seed } = *w;
    let wanted = crate::render::wanted::Wanted { tolerance, size, deadline, memory, seed };
    let cut = p.cut.cut(crate::render::Fineness::first(tolerance).patches);
    let task = crate::render::solved::Task { transport, wanted: &wanted, watch };
    let found = crate::render::by_deadline::render_by_deadline(&cut, &task)?;
    Ok(Rendered { seconds: found.seconds.after(p.seconds), ..found })
}
#[derive(Clone, Copy, Debug)]
pub struct WantedTerms {
    pub count: usize,
    pub tolerance: f64,
    pub time: Option<f64>,
    pub memory: f64,
    pub seed: u32,
}
pub fn explore_within(p: &mut Prepared, transport: Transport, w: &WantedTerms, watch: &dyn Watch) -> BounceSeries {
    let WantedTerms { count, tolerance, time, memory, seed } = *w;
    let wanted = crate::render::bounces::WantedTerms { count, tolerance, time, memory, seed };
    let found = bounces_to_tolerance(&p.cut, transport, &wanted, watch);
    p.patches = Arc::clone(&found.mode.lights.patches);
    p.cut.patches = Arc::clone(&p.patches);
    found
}
pub fn without_luminaires(p: &Prepared, emission: &[Light]) -> Vec<Rgb> {
    let mut field = invisible(emission);
    for (l, &material) in field.iter_mut().zip(p.patches.materials()) {
        if p.luminaires.carries[material as usize] {
            *l = Rgb::ZERO;
        }
    }
    field
}
pub fn picture(
    p: &Prepared,
    transports: &[Transport],
    fields: &Fields,
    pass: &GatherPass,
    watch: &dyn Watch,
) -> Gathered {
    let lights = p.lights(transports.to_vec());
    look(&View::new(&lights, pass.size), fields, &pass.gathering, watch)
}
pub fn render(_: &Prepared, mode: &Assembled, solution: &Solution, pass: &GatherPass, watch: &dyn Watch) -> Gathered {
    mode.picture(solution, pass, watch)
}
pub(crate) fn fields(p: &Prepared, values: &[Vec<Rgb>]) -> Fields {
    let neighbours = p.patches.neighbours();
    let each = values.iter().map(|field| linear(&neighbours, field));
    Fields::linear(&each.collect::<Vec<_>>())
}
pub(crate) fn look(view: &View, fields: &Fields, gathering: &Gathering, watch: &dyn Watch) -> Gathered {
    watch.begin("gather", view.height as u64);
    gather(view, fields, gathering, &|done| watch.tick(done))
}
pub(crate) fn sight(p: &Prepared, transports: &[Transport]) -> Arc<Lights> {
    p.lights(transports.to_vec())
}
pub(crate) fn received(
    _: &Prepared,
    lights: &Lights,
    m: &PatchMaterials,
    sampling: &Sampling,
    watch: &dyn Watch,
) -> Received {
    watch.begin("light as emitted", lights.patches.len() as u64);
    lights.receive(&m.receives(), sampling, &|done| watch.tick(done))
}
pub(crate) fn render_fixed(
    p: &Prepared,
    mode: &Assembled,
    pass: &GatherPass,
    mut spent: Spent,
    watch: &dyn Watch,
) -> Result<Rendered, Diverges> {
    let clock = Instant::now();
    let solution = crate::solve::neumann(&mode.operator, &crate::solve::Settings::default())?;
    spent.seconds.solve = clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let gathered = mode.picture(&solution, pass, watch);
    spent.seconds.gather = clock.elapsed().as_secs_f64();
    spent.seconds = spent.seconds.after(p.seconds);
    Ok(Rendered::new(mode, &solution, gathered, spent))
}
pub(crate) use crate::render::wanted::Spent;
