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
use crate::reading::{Fields, linear};
use crate::render::assembly::{Assembled, Watch, render, without_luminaires};
use crate::solve::{Solution, coarse_columns, powers, reflected_columns};

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
    /// How far it may be off; none where nothing is known of the light that was gathered.
    pub error: Option<LayerError>,
}

/// RMS of what a layer adds to reflected light, over the pixels that see no luminaire, and of the estimated error of
/// that, W/(m² sr).
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct LayerError {
    /// Of the layer.
    pub rms: f64,
    /// Of its error.
    pub error: f64,
}

impl LayerError {
    /// The error of layers times their factors together, relative to what they add up to, which is at least as much as
    /// their root sum of squares; 0 where they are black.
    pub fn of_sum(layers: impl Iterator<Item = (LayerError, f64)>) -> f64 {
        let squares = layers.fold([0.0; 2], |[rms, error], (own, factor)| {
            [rms + (factor * own.rms).powi(2), error + (factor * own.error).powi(2)]
        });
        let [rms, error] = squares.map(f64::sqrt);
        if rms > 0.0 { error / rms } else { 0.0 }
    }
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
        let light = (!apart.is_nothing()).then(|| LayerLight::new(self, solution, apart));
        let (fields, powers) = with_layers(self.picture_fields(solution), self, light.as_slice());
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
    kinds.zip(gathered).map(|(kind, light)| Layer { kind, light, error: None }).collect()
}

/// The light of layers on patches as hemisphere rays read it, and what patches reflect of each emitter's in all.
pub(crate) struct LayerLight {
    /// Emitters.
    pub emitters: Vec<Vec<Rgb>>,
    /// Bounces.
    pub bounces: Vec<Vec<Rgb>>,
    /// Power of the visible half of what is reflected of each emitter's light, W.
    reflected: Vec<[f64; 3]>,
}

impl LayerLight {
    /// Of a solution.
    pub(crate) fn new(mode: &Assembled, solution: &Solution, apart: Apart) -> LayerLight {
        let count = solution.terms.len().saturating_sub(1);
        let reflected = || reflected_columns(&mode.operator, &mode.sources(), count);
        LayerLight::of(mode, apart.emitters.then(reflected), apart.bounces.then_some(&solution.terms))
    }

    /// Of the same on patches four times as large, whose terms are known.
    pub(crate) fn coarse(mode: &Assembled, terms: &[Vec<Light>], apart: Apart) -> LayerLight {
        let (weights, parents) = (mode.patches().weights(), mode.patches().parents());
        let count = terms.len().saturating_sub(1);
        let reflected = || coarse_columns(&mode.operator, &weights, parents, &mode.sources(), count);
        LayerLight::of(mode, apart.emitters.then(reflected), apart.bounces.then_some(terms))
    }

    /// Of what is reflected of each emitter's light, and of the terms, where those are layers.
    fn of(mode: &Assembled, reflected: Option<Vec<Vec<Light>>>, terms: Option<&[Vec<Light>]>) -> LayerLight {
        let (reflected, terms) = (reflected.unwrap_or_default(), terms.unwrap_or_default());
        let emitters = mode.operator.emitters().iter().zip(&reflected);
        let of_emitter = |(light, reflected): (&EmitterLight, &Vec<Light>)| {
            let mut field = without_luminaires(&mode.lights, &light.emission);
            field.iter_mut().zip(reflected).for_each(|(sum, l)| *sum += l.invisible);
            field
        };
        let mut bounces = vec![vec![Rgb::ZERO; mode.patches().len()]; terms.len().min(BOUNCES)];
        let last = bounces.len().saturating_sub(1);
        for (n, term) in terms.iter().enumerate() {
            let travelling = travelling(mode, n, term);
            bounces[n.min(last)].iter_mut().zip(travelling).for_each(|(sum, l)| *sum += l);
        }
        let power = |light: &Vec<Light>| powers(mode.operator.areas(), light)[0];
        LayerLight {
            emitters: emitters.map(of_emitter).collect(),
            bounces,
            reflected: reflected.iter().map(power).collect(),
        }
    }

    /// All of them, emitters first.
    pub(crate) fn fields(&self) -> impl Iterator<Item = &Vec<Rgb>> {
        self.emitters.iter().chain(&self.bounces)
    }
}

/// The fields of a picture with those of its layers, the means of those of independent solutions of a mode; and the
/// powers of the emitters. Without any the picture stays whole.
pub(crate) fn with_layers(fields: Fields, mode: &Assembled, found: &[LayerLight]) -> (Fields, Vec<EmitterPower>) {
    if found.is_empty() {
        return (fields, Vec::new());
    }
    let share = 1.0 / found.len() as f32;
    let mean = |of: fn(&LayerLight) -> &Vec<Vec<Rgb>>| {
        let count = found.iter().map(|own| of(own).len()).max().unwrap_or(0);
        let mut means = vec![vec![Rgb::ZERO; mode.patches().len()]; count];
        for own in found {
            for (mean, light) in means.iter_mut().zip(of(own)) {
                mean.iter_mut().zip(light).for_each(|(sum, l)| *sum += share * *l);
            }
        }
        means
    };
    let (emitters, bounces) = (mean(|own| &own.emitters), mean(|own| &own.bounces));
    let neighbours = mode.patches().neighbours();
    let read: Vec<_> = emitters.iter().chain(&bounces).map(|field| linear(&neighbours, field)).collect();
    let reflected: Vec<_> = found.iter().map(|own| &own.reflected).filter(|own| !own.is_empty()).collect();
    let powers = mean_powers(mode, &reflected);
    (fields.with_layers(&read, emitters.len()), powers)
}

/// The powers of the emitters, the reflected ones means over solutions.
fn mean_powers(mode: &Assembled, reflected: &[&Vec<[f64; 3]>]) -> Vec<EmitterPower> {
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
