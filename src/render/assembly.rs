//! The equation `L = E + K L` of one mode on patches, put together; the picture of its light from the scene's camera.
//!
//! One cast of rays serves all the modes requested. Not handled: how many patches and rays; callers choose.

use std::borrow::Cow;
use std::f64::consts::PI;
use std::sync::Arc;

use glam::Vec3;

use crate::direct::{Lights, Luminaires, TOLERABLE};
use crate::form_factors::{RowSums, Sampling, Variant, row_sums};
use crate::gather::{GatherPass, Gathered, Nearness, Told, gather};
use crate::light::{Light, Rgb, Transport};
use crate::operator::linear::LinearOperator;
use crate::operator::{Cast, EmitterLight, Operator, PatchMaterials, RowSource, Wanted};
use crate::patches::{Patches, Sample, Spot};
use crate::reading::{Fields, View, invisible, linear};
use crate::scene::{Camera, Emitters, Scene};
use crate::solve::{RaySettings, RayShooter, Solution, Source};
use crate::surfaces::Geometry;

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

/// What happens while the pipeline works.
pub trait Watch: Send + Sync {
    /// A step of `length` ticks begins.
    fn begin(&self, step: &str, length: u64);
    /// So many ticks were done.
    fn tick(&self, done: u64);
    /// Work to a tolerance is so near to it.
    fn near(&self, _nearness: Nearness) {}
}

/// Light on patches.
#[derive(Clone)]
pub struct PatchLight<'a> {
    /// The default (alpha, tau) it was solved for.
    pub transport: Transport,
    /// The patches, and what lights them.
    pub lights: Arc<Lights>,
    /// The rays of each F that it was solved with; the light is the mean of all.
    pub casts: Vec<Sampling>,
    /// `L`.
    pub light: Cow<'a, [Light]>,
    /// `KⁿE`.
    pub terms: Cow<'a, [Vec<Light>]>,
    /// Standard error of the visible half of `L`, where it is known.
    pub error: Option<Vec<Rgb>>,
}

/// Watches nothing.
pub struct Silent;

impl Watch for Silent {
    fn begin(&self, _step: &str, _length: u64) {}
    fn tick(&self, _done: u64) {}
}

/// A scene cut into patches; a value, of which others are made, and cheap to clone.
#[derive(Clone)]
pub struct Discretization {
    /// The scene, its rays and its surfaces.
    pub geometry: Arc<Geometry>,
    /// Emitters by closed form.
    pub luminaires: Arc<Luminaires>,
    /// The patches.
    pub patches: Arc<Patches>,
    /// Where rows of F come from.
    pub rows: Arc<dyn RowSource>,
}

impl Discretization {
    /// A scene cut into about so many patches of one size.
    pub fn new(scene: Scene, patches: usize) -> Discretization {
        let geometry = Geometry::new(scene);
        let luminaires = Arc::new(Luminaires::new(&geometry.scene));
        let patches = Arc::new(Patches::cut(&geometry, patches));
        Discretization { geometry, luminaires, patches, rows: Arc::new(Cast) }
    }

    /// This scene and its patches, with the light of each emitter kept apart.
    pub fn apart(&self) -> Discretization {
        let scene = &self.geometry.scene;
        Discretization { luminaires: Arc::new(Luminaires::apart(scene, Emitters::of(scene))), ..self.clone() }
    }

    /// This scene cut anew into about so many patches of one size.
    pub fn cut(&self, patches: usize) -> Discretization {
        self.with_patches(Patches::cut(&self.geometry, patches).with_spots(self.patches.spots()))
    }

    /// This scene on its patches, which nothing has divided, with more spots, which all others will have.
    pub(crate) fn with_spots(&self, spots: &[Spot]) -> Discretization {
        self.with_patches(Patches::clone(&self.patches).with_spots(spots))
    }

    /// This scene on its patches divided by the light sampled on each of their mesh.
    pub(crate) fn divided(&self, samples: Vec<Vec<Sample>>) -> Discretization {
        self.with_patches(self.patches.divided(samples))
    }

    /// This scene on other patches.
    pub fn with_patches(&self, patches: Patches) -> Discretization {
        Discretization { patches: Arc::new(patches), ..self.clone() }
    }

    /// (alpha, tau) of every material in a mode.
    pub fn transports(&self, mode: Transport) -> Vec<Transport> {
        self.geometry.scene.transports(mode)
    }

    /// `L = E + K L` of several modes, from one cast of rays; also returns how many rays were cast.
    pub fn assemble(&self, modes: &[Transport], sampling: &Sampling, watch: &dyn Watch) -> (Vec<Assembled>, u64) {
        let lights = |&mode: &Transport| (mode, self.lights(self.transports(mode), TOLERABLE));
        assemble(&modes.iter().map(lights).collect::<Vec<_>>(), &*self.rows, sampling, watch)
    }

    /// Whether F of these modes takes no ray.
    pub(crate) fn knows(&self, modes: &[Transport], sampling: &Sampling) -> bool {
        let of = |mode: &Transport| {
            let own = self.transports(*mode);
            variant(&own, &PatchMaterials::new(&self.geometry.scene, &self.patches, &self.luminaires, &own))
        };
        let variants: Vec<Variant> = modes.iter().map(of).collect();
        let (geometry, patches) = (&*self.geometry, &*self.patches);
        self.rows.knows(&Wanted { geometry, patches, variants: &variants, sampling, tick: &|_| () })
    }

    /// Shoots rays from the patches in a mode; no F is made.
    pub fn ray_shooter(&self, mode: Transport, settings: RaySettings) -> RayShooter {
        RayShooter::new(self.lights(self.transports(mode), TOLERABLE), settings)
    }

    /// What lights the patches where materials have these (alpha, tau); stand-ins for many luminaires, or for a
    /// texture, may be off by the share `exactness` of the light.
    pub fn lights(&self, transports: Vec<Transport>, exactness: f64) -> Arc<Lights> {
        Arc::new(Lights::new(&self.geometry, &self.patches, &self.luminaires, transports, exactness))
    }
}

/// `L = E + K L` of one mode on patches.
pub struct Assembled {
    /// The default (alpha, tau) it was made for.
    pub transport: Transport,
    /// The patches, what lights them, and what lies between.
    pub lights: Arc<Lights>,
    /// K, and E.
    pub operator: Operator,
    /// Row sums of F; none where no ray was needed.
    pub row_sums: Option<RowSums>,
    /// The rays of F.
    pub sampling: Sampling,
}

/// Casts the rays for the modes of all `lights`, which share their patches, and puts each one's K together; also
/// returns how many rays were cast.
pub(crate) fn assemble(
    lights: &[(Transport, Arc<Lights>)],
    rows: &dyn RowSource,
    sampling: &Sampling,
    watch: &dyn Watch,
) -> (Vec<Assembled>, u64) {
    let Some((_, any)) = lights.first() else { return (Vec::new(), 0) };
    let (geometry, patches) = (&any.geometry, &any.patches);
    let materials = |(_, lights): &(Transport, Arc<Lights>)| materials(lights);
    let materials: Vec<PatchMaterials> = lights.iter().map(materials).collect();
    let variant = |((_, lights), m): (&(Transport, Arc<Lights>), &PatchMaterials)| variant(&lights.transports, m);
    let variants: Vec<Variant> = lights.iter().zip(&materials).map(variant).collect();
    watch.begin("form factors", patches.len() as u64);
    let tick = |done| watch.tick(done);
    let (factors, mut rays) = rows.rows(&Wanted { geometry, patches, variants: &variants, sampling, tick: &tick });
    let mut assembled = Vec::new();
    for ((f, m), (transport, lights)) in factors.into_iter().zip(materials).zip(lights) {
        watch.begin("light as emitted", patches.len() as u64);
        let received = lights.receive(&m.receives(), sampling, &tick);
        rays += received.rays;
        let row_sums = row_sums(&f, patches.areas());
        let areas = patches.file_areas(&geometry.scene);
        let emitters = emitter_lights(lights, &m.emission, received.emitters);
        let operator =
            Operator::new(f, m, areas, received.luminaires).with_punctual(&received.punctual).with_emitters(emitters);
        let (transport, lights, sampling) = (*transport, Arc::clone(lights), *sampling);
        assembled.push(Assembled { transport, lights, operator, row_sums, sampling });
    }
    (assembled, rays)
}

/// The light of each emitter, given what patches receive of it: a patch of several emits as they share its area.
pub(crate) fn emitter_lights(lights: &Lights, emission: &[Light], received: Vec<Vec<Rgb>>) -> Vec<EmitterLight> {
    let (scene, patches) = (&lights.geometry.scene, &lights.patches);
    let dark = || vec![Light::default(); patches.len()];
    let own = |received| EmitterLight { emission: dark(), received };
    let mut emitters: Vec<EmitterLight> = received.into_iter().map(own).collect();
    for (i, light) in emission.iter().enumerate().filter(|(_, light)| **light != Light::default()) {
        if emitters.is_empty() {
            break;
        }
        let area = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).length();
        let all: f32 = patches.pieces(i).map(|piece| area(piece.1)).sum();
        let count = patches.pieces(i).count() as f32;
        for (face, corners) in patches.pieces(i) {
            let share = if all > 0.0 { area(corners) / all } else { 1.0 / count };
            let own = &mut emitters[lights.emitters().of_face(scene, face)].emission[i];
            own.invisible += share * light.invisible;
            own.visible += share * light.visible;
        }
    }
    emitters
}

/// What the patches are made of in the mode of their lights.
pub(crate) fn materials(lights: &Lights) -> PatchMaterials {
    PatchMaterials::new(&lights.geometry.scene, &lights.patches, &lights.luminaires, &lights.transports)
}

/// The rows and columns of F that patches of these materials need, for tau of each material.
pub(crate) fn variant(transports: &[Transport], m: &PatchMaterials) -> Variant {
    Variant { tau: transports.iter().map(|t| t.tau).collect(), rows: m.receives(), columns: m.sends() }
}

impl Assembled {
    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.lights.geometry.scene
    }

    /// The patches.
    pub fn patches(&self) -> &Patches {
        &self.lights.patches
    }

    /// The invisible light that the picture of a solution reads: every term, luminaires' emission excepted.
    pub(crate) fn reflected(&self, terms: &[Vec<Light>]) -> Vec<Rgb> {
        let mut terms = terms.iter();
        let mut field = terms.next().map_or_else(Vec::new, |emission| without_luminaires(&self.lights, emission));
        for term in terms {
            for (sum, l) in field.iter_mut().zip(term) {
                *sum += l.invisible;
            }
        }
        field
    }

    /// E of each emitter, and what patches reflect of it first; none where they are not kept apart.
    pub fn sources(&self) -> Vec<Source> {
        let first = |light: &EmitterLight| Some(self.operator.first_bounce_of(light));
        let source = |light: &EmitterLight| Source { emission: light.emission.clone(), first_bounce: first(light) };
        self.operator.emitters().iter().map(source).collect()
    }

    /// What the patches receive of the reflected light, irradiance over pi.
    pub(crate) fn ambient(&self, solution: &Solution) -> Vec<Rgb> {
        let k = &self.operator;
        let received = |i: usize| {
            let visible = solution.light[i].visible - k.emission()[i].visible;
            let rho = k.reflectances()[i];
            let over = |c: usize| if rho[c] > 0.0 { visible[c] / rho[c] } else { 0.0 };
            Rgb::new(over(0), over(1), over(2)) - k.received()[i]
        };
        (0..k.len()).map(received).collect()
    }

    /// Light that leaves the patches for what luminaires send there, one value each.
    pub(crate) fn direct(&self) -> Vec<Rgb> {
        let k = &self.operator;
        let one = |(i, received): (usize, &Rgb)| k.passed_on(i) * *received;
        k.received().iter().enumerate().map(one).collect()
    }

    /// The power that patch i reflects of what it receives as emitted, channels added, W.
    pub(crate) fn direct_power(&self, i: usize) -> f64 {
        let k = &self.operator;
        PI * k.areas()[i] * f64::from((k.reflectances()[i] * k.received()[i]).element_sum())
    }

    /// What the picture of a solution is gathered from.
    pub(crate) fn picture_fields(&self, solution: &Solution) -> Fields {
        let mut field = self.reflected(&solution.terms);
        for (sum, l) in field.iter_mut().zip(&solution.later) {
            *sum += l.invisible;
        }
        fields(self.patches(), &[field]).with_ambient(self.ambient(solution))
    }

    /// Renders a solution.
    pub fn picture(&self, solution: &Solution, pass: &GatherPass, watch: &dyn Watch) -> Gathered {
        render(&self.lights, &self.picture_fields(solution), pass, watch)
    }

    /// The same by another camera of the scene; no row of F is cast for it.
    pub fn picture_by(&self, camera: Camera, solution: &Solution, pass: &GatherPass, watch: &dyn Watch) -> Gathered {
        render(&self.lights.seen_by(camera), &self.picture_fields(solution), pass, watch)
    }

    /// A solution of one F.
    pub fn light<'a>(&self, solution: &'a Solution) -> PatchLight<'a> {
        self.patch_light((&solution.light).into(), (&solution.terms).into())
    }

    /// Light of which no error is known.
    pub(crate) fn patch_light<'a>(&self, light: Cow<'a, [Light]>, terms: Cow<'a, [Vec<Light>]>) -> PatchLight<'a> {
        let (transport, lights, casts) = (self.transport, Arc::clone(&self.lights), vec![self.sampling]);
        PatchLight { transport, lights, casts, light, terms, error: None }
    }

    /// Shoots rays from the same patches in the same mode.
    pub fn ray_shooter(&self, settings: RaySettings) -> RayShooter {
        RayShooter::new(Arc::clone(&self.lights), settings)
    }
}

/// What hemisphere rays read of E under some lights: all of it but the luminaires', which are gathered by closed form.
pub fn without_luminaires(lights: &Lights, emission: &[Light]) -> Vec<Rgb> {
    let mut field = invisible(emission);
    for (l, &material) in field.iter_mut().zip(lights.patches.materials()) {
        if lights.luminaires.carries[material as usize] {
            *l = Rgb::ZERO;
        }
    }
    field
}

/// Renders the visible half of what fields of one value a patch send under some lights: a picture each, from the same
/// rays.
pub fn pictures(lights: &Lights, values: &[Vec<Rgb>], pass: &GatherPass, watch: &dyn Watch) -> Gathered {
    render(lights, &fields(&lights.patches, values), pass, watch)
}

/// Fields to gather from one value a patch each, read as linear within a patch.
fn fields(patches: &Patches, values: &[Vec<Rgb>]) -> Fields {
    let neighbours = patches.neighbours();
    let each = values.iter().map(|field| linear(&neighbours, field));
    Fields::linear(&each.collect::<Vec<_>>())
}

/// Renders the visible half of what the fields send.
pub(crate) fn render(lights: &Lights, fields: &Fields, pass: &GatherPass, watch: &dyn Watch) -> Gathered {
    watch.begin("gather", pass.size.height as u64);
    let told = Told { rows: &|done| watch.tick(done), near: &|nearness| watch.near(nearness) };
    gather(&View::new(lights, pass.size), fields, &pass.gathering, &told)
}
