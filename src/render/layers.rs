//! A picture taken apart: the light of each emitter, and that of each bounce.
//!
//! ```text
//! picture = sum over emitters of  E_e + rho (D_e + F L_e)    =    E + KE + K²E + ...       each visible half
//! ```
//!
//! The solutions that make the picture are repeated emitter by emitter, all in one pass over F for each bounce, and
//! gathered by the rays and at the places of the picture itself. So each set of layers adds up to the picture to
//! rounding, and neither the picture nor its stated error changes.
//!
//! Not handled: emitters and bounces together.

use crate::gather::{GatherPass, Gathered, GatheredLayer};
use crate::light::{Light, Rgb};
use crate::operator::{EmitterLight, LinearOperator};
use crate::reading::{Fields, Linear, linear};
use crate::render::assembly::{Assembled, Watch, render, without_luminaires};
use crate::solve::{Solution, powers, reflected_columns};

/// What a picture is taken apart into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Apart {
    /// The light of each emitter ([`Emitters`](crate::scene::Emitters)).
    pub emitters: bool,
    /// Light that was reflected 0, 1, 2, ... times; the last has all that was reflected more.
    pub bounces: bool,
}

impl Apart {
    /// Whether the picture stays whole.
    pub fn is_nothing(self) -> bool {
        self == Apart::default()
    }
}

/// Bounces that are kept apart, E among them; the last holds all that follow.
pub(crate) const BOUNCES: usize = 16;

/// What a layer of a picture shows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LayerKind {
    /// The light of an emitter, by its name.
    Emitter(String),
    /// `KⁿE`.
    Bounce(usize),
    /// `KⁿE` and all that follows.
    BouncesFrom(usize),
}

/// Before the names of layers that are emitters.
const EMITTER: &str = "lamp.";

impl LayerKind {
    /// The emitter that a layer of this name shows; none of another kind.
    pub fn emitter(name: &str) -> Option<&str> {
        name.strip_prefix(EMITTER)
    }

    /// Its name in files, by the convention that groups channels by what stands before the last dot: `lamp.desk`,
    /// `bounce.2`.
    pub fn name(&self) -> String {
        match self {
            LayerKind::Emitter(name) => format!("{EMITTER}{name}"),
            LayerKind::Bounce(n) => format!("bounce.{n}"),
            LayerKind::BouncesFrom(n) => format!("bounce.{n}+"),
        }
    }
}

/// The power of an emitter, and what the surfaces make of it.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct EmitterPower {
    /// Its name.
    pub name: String,
    /// Power of the visible half of its E per channel, W: `pi sum A_i E_i`; 0 of punctual lights.
    pub emitted: [f64; 3],
    /// Power of the visible half of all that is reflected of its light per channel, W: of `KE + K²E + ...`.
    pub reflected: [f64; 3],
}

/// A layer of a picture.
#[derive(Clone, Debug)]
pub struct Layer {
    /// What it shows.
    pub kind: LayerKind,
    /// Linear radiance, and its standard error.
    pub light: GatheredLayer,
}

impl Assembled {
    /// Renders a solution, and its light apart; also the powers of the emitters.
    pub(crate) fn layered(
        &self,
        solution: &Solution,
        pass: &GatherPass,
        apart: Apart,
        watch: &dyn Watch,
    ) -> (Gathered, Vec<EmitterPower>) {
        let solved = [(self, solution)];
        let solved = if apart.is_nothing() { &[][..] } else { &solved };
        let (fields, powers) = with_layers(self.picture_fields(solution), solved, apart);
        (render(&self.lights, &fields, pass, watch), powers)
    }
}

/// Names the layers of a picture in the order in which they are gathered.
pub(crate) fn named(mode: &Assembled, apart: Apart, gathered: Vec<GatheredLayer>) -> Vec<Layer> {
    let emitters = if apart.emitters { mode.lights.emitters().names() } else { &[] };
    let bounces = gathered.len() - emitters.len();
    let names = emitters.iter().map(|name| LayerKind::Emitter(name.clone()));
    let bounce = |n: usize| if n == BOUNCES { LayerKind::BouncesFrom(n) } else { LayerKind::Bounce(n) };
    let kinds = names.chain((0..bounces).map(bounce));
    kinds.zip(gathered).map(|(kind, light)| Layer { kind, light }).collect()
}

/// The fields of a picture with those of its layers: the means of independent solutions, each with its equation; and
/// the powers of the emitters.
pub(crate) fn with_layers(
    fields: Fields,
    solved: &[(&Assembled, &Solution)],
    apart: Apart,
) -> (Fields, Vec<EmitterPower>) {
    let Some((mode, _)) = solved.first() else { return (fields, Vec::new()) };
    let mut emitted = Vec::new();
    let neighbours = mode.patches().neighbours();
    let count = mode.operator.emitters().len();
    let mut emitters = vec![vec![Rgb::ZERO; mode.patches().len()]; if apart.emitters { count } else { 0 }];
    let terms = solved.iter().map(|(_, solution)| solution.terms.len()).max().unwrap_or(0);
    let bounces = if apart.bounces { terms.min(BOUNCES) } else { 0 };
    let mut bounces = vec![vec![Rgb::ZERO; mode.patches().len()]; bounces];
    let share = 1.0 / solved.len() as f32;
    for (mode, solution) in solved {
        let add = |field: &mut Vec<Rgb>, light: &[Rgb]| {
            field.iter_mut().zip(light).for_each(|(sum, l)| *sum += share * *l);
        };
        if !emitters.is_empty() {
            let found = of_emitters(mode, solution);
            for (field, (light, _)) in emitters.iter_mut().zip(&found) {
                add(field, light);
            }
            emitted.push(found.into_iter().map(|own| own.1).collect::<Vec<_>>());
        }
        let last = bounces.len().saturating_sub(1);
        for (n, term) in solution.terms.iter().enumerate().take(if apart.bounces { usize::MAX } else { 0 }) {
            add(&mut bounces[n.min(last)], &travelling(mode, n, term));
        }
    }
    let read =
        |fields: &[Vec<Rgb>]| -> Vec<Vec<Linear>> { fields.iter().map(|field| linear(&neighbours, field)).collect() };
    (fields.with_layers(&read(&emitters), &read(&bounces)), mean_powers(mode, &emitted))
}

/// The powers of the emitters, the reflected ones means over solutions.
fn mean_powers(mode: &Assembled, reflected: &[Vec<[f64; 3]>]) -> Vec<EmitterPower> {
    if reflected.is_empty() {
        return Vec::new();
    }
    let areas = mode.operator.areas();
    let names = mode.lights.emitters().names().iter().zip(mode.operator.emitters()).enumerate();
    let mean = |e: usize, c: usize| reflected.iter().map(|all| all[e][c]).sum::<f64>() / reflected.len() as f64;
    let one = |(e, (name, light)): (usize, (&String, &EmitterLight))| EmitterPower {
        name: name.clone(),
        emitted: powers(areas, &light.emission)[0],
        reflected: [0, 1, 2].map(|c| mean(e, c)),
    };
    names.map(one).collect()
}

/// What hemisphere rays read of term n.
fn travelling(mode: &Assembled, n: usize, term: &[Light]) -> Vec<Rgb> {
    if n == 0 { without_luminaires(&mode.lights, term) } else { term.iter().map(|l| l.invisible).collect() }
}

/// What hemisphere rays read of the light of each emitter, summed over as many bounces as a solution has, and the power
/// of the visible half of what is reflected.
fn of_emitters(mode: &Assembled, solution: &Solution) -> Vec<(Vec<Rgb>, [f64; 3])> {
    let operator = &mode.operator;
    let reflected = reflected_columns(operator, &mode.sources(), solution.terms.len().saturating_sub(1));
    let all = operator.emitters().iter().zip(reflected);
    all.map(|(light, reflected)| {
        let mut field = without_luminaires(&mode.lights, &light.emission);
        field.iter_mut().zip(&reflected).for_each(|(sum, l)| *sum += l.invisible);
        (field, powers(operator.areas(), &reflected)[0])
    })
    .collect()
}
