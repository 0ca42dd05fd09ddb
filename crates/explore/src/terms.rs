//! The terms `KⁿE` of every lamp at the nodes of tau, direct light in the texels of charts, and what interpolation
//! between the nodes is off by.
//!
//! Terms are those of one cast of rays at alpha = 1, where a material's own alpha stays a factor, so that the visible
//! half of term n at any other alpha is `alpha^(n-1)` times as much. Materials with a tau of their own keep it. Direct
//! light is found anew at the points of texels, by the closed forms and rays of [`halflight::direct`]; light of
//! emitters that are no luminaires is that of the patch.
//!
//! Not handled: emitters beyond [`LAMPS`], whose light is one together; which terms are shown
//! ([`crate::sums`]).

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec2};
use rayon::prelude::*;

use crate::reached::Place;
use crate::sums::{Kept, Mixture, Rest, Shown, State, between, nodes};
use halflight::direct::{LightSum, Lights, Scratch};
use halflight::light::{Light, Rgb, Transport};
use halflight::operator::{EmitterLight, LinearOperator, Source};
use halflight::pictures::unlike;
use halflight::rays::purpose::Purpose;
use halflight::rays::sobol::{Sobol, hash};
use halflight::render::{Assembled, Discretization, Fineness, Unfit, Watch};
use halflight::solve::{each_bounce, explore};

/// Lamps that are kept apart; the last stands for all others where there are more.
pub(super) const LAMPS: usize = 8;
/// Visibility rays of a texel to a luminaire whose visible part is not known.
const RAYS: u32 = 32;
/// Products for the dominant eigenvector at most, and the change of its eigenvalue that is small enough.
const PRODUCTS: usize = 200;
const SETTLED: f64 = 1e-7;
/// Shift of that iteration, as a share of the eigenvalue.
const SHIFT: f64 = 0.2;
/// A check of tau sums the series until a term is this share of all before it, or so many terms.
const LITTLE: f64 = 1e-6;
const MOST: usize = 400;
/// A check where the series diverges has the alpha at which the radius is this.
const SHORT_OF_ONE: f64 = 0.9;

/// Light that one slider moves.
#[derive(Clone, Debug)]
pub(super) struct Lamp {
    pub name: String,
    /// Its name in links.
    pub key: String,
}

/// What a node of tau keeps of light.
pub(super) struct Node {
    /// `KⁿE` of every lamp and n from 1 on, the visible half of each patch.
    pub terms: Vec<Vec<Vec<Rgb>>>,
    /// v, the dominant eigenvector of K on what light reaches: the visible half of each patch, of power pi.
    pub dominant: Vec<Rgb>,
    /// Irradiance over pi of what glows of every lamp, in each patch.
    pub glow: Vec<Vec<Rgb>>,
    /// Emission of every lamp that is no luminaire's, by patch.
    pub glowing: Vec<Vec<Rgb>>,
    /// What lights the patches.
    lights: Arc<Lights>,
}

/// How far what is shown at a tau between nodes is from what is solved there.
#[derive(Clone, Copy, Debug, serde::Serialize)]
pub(super) struct TauError {
    pub tau: f64,
    /// Where the whole series was compared.
    pub alpha: f64,
    /// Relative RMS error of reflected light over the patches, by area.
    pub error: f64,
}

/// All that is solved.
pub(super) struct Solved {
    pub lamps: Vec<Lamp>,
    /// The lamp that each emitter belongs to.
    pub lamp_of: Vec<usize>,
    pub nodes: Vec<Node>,
    pub kept: Kept,
    pub errors: Vec<TauError>,
    pub areas: Vec<f64>,
    pub rho: Vec<Rgb>,
    /// Alpha of the materials themselves.
    pub alpha: Vec<f32>,
    pub rays: u64,
    seed: u32,
}

/// How finely the terms are solved.
#[derive(Clone, Copy, Debug)]
pub struct TermsEffort {
    /// Patches, and rays from each.
    pub fineness: Fineness,
    /// Nodes of tau.
    pub taus: usize,
    /// Terms after E.
    pub terms: usize,
    /// Chooses the sample points.
    pub seed: u32,
    /// Bytes that K may take.
    pub memory: f64,
}

/// Solves the terms of a scene whose emitters are kept apart by the solver.
pub(super) fn solve(p: &Discretization, effort: &TermsEffort, watch: &dyn Watch) -> Result<Solved, Unfit> {
    let (taus, checks) = (nodes(effort.taus), between(effort.taus));
    let transports = |taus: &[f64]| -> Vec<Transport> {
        taus.iter().map(|&tau| Transport { alpha: 1.0, tau: tau as f32 }).collect()
    };
    let sampling = effort.fineness.sampling(effort.seed);
    p.check_memory(&transports(&taus), &sampling, 1, effort.memory)?;
    let (at_nodes, rays) = p.assemble(&transports(&taus), &sampling, watch);
    let first = &at_nodes[0];
    let (lamps, lamp_of) = lamps(first);
    let mut kept = Kept { taus: taus.clone(), ..Kept::default() };
    let mut found = Vec::new();
    watch.begin("terms", taus.len() as u64);
    for (mode, tau) in at_nodes.iter().zip(&taus) {
        let sources = together(&mode.sources(), &lamp_of, lamps.len());
        let mut terms = terms(mode, &sources, effort.terms + 1);
        let (dominant, lambda) = dominant(mode, &terms);
        kept.rest.push(terms.iter().map(|own| rest(mode, own, &dominant)).collect());
        kept.lambda.push(lambda);
        terms.iter_mut().for_each(|own| own.truncate(effort.terms));
        kept.powers.push(powers(mode, &sources, &terms));
        kept.radii.push((*tau, explore(&mode.operator, 1).radius));
        let glow = sources.iter().map(|source| glow(mode, source)).collect();
        let glowing = sources.iter().map(|source| glowing(mode, source)).collect();
        found.push(Node { terms, dominant, glow, glowing, lights: Arc::clone(&mode.lights) });
        watch.tick(1);
    }
    let (areas, rho) = (first.operator.areas().to_vec(), first.operator.reflectances().to_vec());
    let alpha = first.operator.alphas().to_vec();
    drop(at_nodes);
    let (between, _) = p.assemble(&transports(&checks), &sampling, watch);
    for (mode, tau) in between.iter().zip(&checks) {
        kept.radii.push((*tau, explore(&mode.operator, 1).radius));
    }
    kept.radii.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut solved =
        Solved { lamps, lamp_of, nodes: found, kept, errors: Vec::new(), areas, rho, alpha, rays, seed: effort.seed };
    for (mode, tau) in between.iter().zip(&checks) {
        solved.errors.push(solved.error_at(mode, *tau));
    }
    Ok(solved)
}

/// The lamps of a scene, and which each emitter belongs to: the brightest by what they send apart, all others together.
fn lamps(mode: &Assembled) -> (Vec<Lamp>, Vec<usize>) {
    let names = mode.lights.emitters().names();
    let sent = |e: usize| -> f64 {
        let first = mode.operator.first_bounce_of(&mode.operator.emitters()[e]);
        first.iter().zip(mode.operator.areas()).map(|(l, a)| a * l.visible.as_dvec3().element_sum()).sum()
    };
    let mut order: Vec<usize> = (0..names.len()).collect();
    if names.len() > LAMPS {
        let powers: Vec<f64> = (0..names.len()).map(sent).collect();
        order.sort_by(|&a, &b| powers[b].total_cmp(&powers[a]));
        order[..LAMPS - 1].sort_unstable();
    }
    let apart = if names.len() > LAMPS { LAMPS - 1 } else { names.len() };
    let mut lamp_of = vec![apart; names.len()];
    order[..apart].iter().enumerate().for_each(|(lamp, &e)| lamp_of[e] = lamp);
    let mut own: Vec<String> = order[..apart].iter().map(|&e| names[e].clone()).collect();
    if names.len() > LAMPS {
        own.push(format!("{} other lamps", names.len() - apart));
    }
    let keys = unlike(own.iter().map(|name| key(name)), |key, k| format!("{key}-{k}"));
    (own.into_iter().zip(keys).map(|(name, key)| Lamp { name, key }).collect(), lamp_of)
}

/// Words that mean something else in a link.
const RESERVED: [&str; 16] = [
    "mode", "alpha", "tau", "bounce", "term", "terms", "scaled", "rho", "story", "stops", "at", "look", "fov", "test",
    "size", "linear",
];

/// A name as it stands in a link: small letters and digits, all else a dash.
fn key(name: &str) -> String {
    let letters: String = name.to_lowercase().chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
    let key = letters.split('-').filter(|part| !part.is_empty()).collect::<Vec<_>>().join("-");
    match key.as_str() {
        "" => "lamp".to_owned(),
        reserved if RESERVED.contains(&reserved) || reserved.starts_with("rho-") => format!("lamp-{key}"),
        _ => key,
    }
}

/// The light of emitters added up lamp by lamp.
fn together(sources: &[Source], lamp_of: &[usize], lamps: usize) -> Vec<Source> {
    let mut sums: Vec<Option<Source>> = vec![None; lamps];
    for (source, &lamp) in sources.iter().zip(lamp_of) {
        match &mut sums[lamp] {
            Some(sum) => {
                add(&mut sum.emission, &source.emission);
                if let (Some(own), Some(other)) = (&mut sum.first_bounce, &source.first_bounce) {
                    add(own, other);
                }
            }
            none => *none = Some(source.clone()),
        }
    }
    sums.into_iter().flatten().collect()
}

fn add(sum: &mut [Light], other: &[Light]) {
    for (sum, l) in sum.iter_mut().zip(other) {
        sum.invisible += l.invisible;
        sum.visible += l.visible;
    }
}

/// The visible halves of `KⁿE` by lamp and n.
fn terms(mode: &Assembled, sources: &[Source], count: usize) -> Vec<Vec<Vec<Rgb>>> {
    let mut terms: Vec<Vec<Vec<Rgb>>> = vec![Vec::new(); sources.len()];
    each_bounce(&mode.operator, sources, count, |_, light| {
        for (own, light) in terms.iter_mut().zip(light) {
            own.push(light.iter().map(|l| l.visible).collect());
        }
    });
    terms
}

/// `<a, b> = sum A a b / rho`, channel by channel.
fn product(mode: &Assembled, a: &[Rgb], b: &[Rgb]) -> DVec3 {
    let k = &mode.operator;
    let one = |i: usize| k.areas()[i] * (received(a[i], k.reflectances()[i]) * b[i]).as_dvec3();
    (0..a.len()).map(one).sum()
}

/// The dominant eigenvector of K on what light reaches, of power pi in each channel, and its eigenvalue; 0 where the
/// series ends. By iteration from the last terms of all lamps, shifted so that facing walls do not make it swing.
fn dominant(mode: &Assembled, terms: &[Vec<Vec<Rgb>>]) -> (Vec<Rgb>, DVec3) {
    let k = &mode.operator;
    let last: Vec<&Vec<Rgb>> = terms.iter().filter_map(|own| own.last()).collect();
    let mut x: Vec<Rgb> = (0..k.len()).map(|i| last.iter().map(|term| term[i]).sum()).collect();
    let mut lambda = DVec3::ZERO;
    for _ in 0..PRODUCTS {
        let power: DVec3 = x.iter().zip(k.areas()).map(|(x, area)| *area * x.as_dvec3()).sum();
        let scale = Rgb::from_array(power.to_array().map(|p| if p > 0.0 { p.recip() as f32 } else { 0.0 }));
        x.iter_mut().for_each(|x| *x *= scale);
        let light: Vec<Light> = x.iter().map(|x| Light::unseen(*x)).collect();
        let kx: Vec<Rgb> = k.apply(&light).iter().map(|l| l.visible).collect();
        let before = lambda;
        lambda = ratio(product(mode, &x, &kx), product(mode, &x, &x));
        if (lambda - before).abs().cmple(SETTLED * lambda).all() {
            break;
        }
        let shift = (SHIFT * lambda).as_vec3();
        x.iter_mut().zip(&kx).for_each(|(x, kx)| *x = *kx + shift * *x);
    }
    (x, lambda)
}

/// c and mu of a lamp, whose last two terms are the one that is kept last and the one after it.
fn rest(mode: &Assembled, terms: &[Vec<Rgb>], v: &[Rgb]) -> Rest {
    let [.., last, next] = terms else { return Rest::default() };
    let c = ratio(product(mode, v, last), product(mode, v, v));
    let next_c = ratio(product(mode, v, next), product(mode, v, v));
    let without = |term: &[Rgb], c: DVec3| -> Vec<Rgb> {
        term.iter().zip(v).map(|(t, v)| (t.as_dvec3() - c * v.as_dvec3()).as_vec3()).collect()
    };
    let (d, kd) = (without(last, c), without(next, next_c));
    let mu = ratio(product(mode, &d, &kd), product(mode, &d, &d));
    Rest { dominant: c.to_array(), mu: mu.clamp(DVec3::splat(-1.0), DVec3::ONE).to_array() }
}

/// a / b, 0 where b is.
fn ratio(a: DVec3, b: DVec3) -> DVec3 {
    DVec3::select(b.cmpgt(DVec3::ZERO), a / b.max(DVec3::splat(f64::MIN_POSITIVE)), DVec3::ZERO)
}

/// Power of E and of every term, by lamp.
fn powers(mode: &Assembled, sources: &[Source], terms: &[Vec<Vec<Rgb>>]) -> Vec<Vec<DVec3>> {
    let areas = mode.operator.areas();
    let power = |light: &mut dyn Iterator<Item = Rgb>| -> DVec3 {
        PI * light.zip(areas).map(|(l, area)| *area * l.as_dvec3()).sum::<DVec3>()
    };
    let of = |(source, own): (&Source, &Vec<Vec<Rgb>>)| {
        let first = power(&mut source.emission.iter().map(|l| l.visible));
        let rest = own.iter().map(|term| power(&mut term.iter().copied()));
        std::iter::once(first).chain(rest).collect()
    };
    sources.iter().zip(terms).map(of).collect()
}

/// What patches emit of a source without being luminaires.
fn glowing(mode: &Assembled, source: &Source) -> Vec<Rgb> {
    let glows = source.emission.iter().zip(mode.operator.glows());
    glows.map(|(light, glows)| if *glows { light.invisible } else { Rgb::ZERO }).collect()
}

/// Irradiance over pi of that light, in each patch.
fn glow(mode: &Assembled, source: &Source) -> Vec<Rgb> {
    let k = &mode.operator;
    let alone = EmitterLight { emission: source.emission.clone(), received: vec![Rgb::ZERO; k.len()] };
    let reflected = k.first_bounce_of(&alone);
    reflected.iter().zip(k.reflectances()).map(|(l, rho)| received(l.visible, *rho)).collect()
}

/// What a patch receives, irradiance over pi, for what it reflects; 0 in channels where it reflects nothing.
pub(super) fn received(visible: Rgb, rho: Rgb) -> Rgb {
    Rgb::select(rho.cmpgt(Rgb::ZERO), visible / rho.max(Rgb::splat(f32::MIN_POSITIVE)), Rgb::ZERO)
}

impl Solved {
    /// Irradiance over pi of the light of each lamp's luminaires and punctual lights in each texel, by node.
    pub fn direct(&self, places: &[Vec<Place>], watch: &dyn Watch) -> Vec<Vec<Vec<Rgb>>> {
        watch.begin("direct light", self.nodes.len() as u64);
        let of_node = |node: &Node| {
            let found = self.direct_at(&node.lights, places);
            watch.tick(1);
            found
        };
        self.nodes.iter().map(of_node).collect()
    }

    fn direct_at(&self, lights: &Lights, places: &[Vec<Place>]) -> Vec<Vec<Rgb>> {
        let (lamp_of, lamps) = (&self.lamp_of, self.lamps.len());
        let sobol = Sobol::new(lights.points(RAYS) as usize, 2);
        let seed = Purpose::Texels.seed(self.seed);
        let texel = |scratch: &mut Scratch, t: usize| {
            let mut found = vec![DVec3::ZERO; lamps];
            let own = &places[t];
            let share = 1.0 / own.len().max(1) as f64;
            for (point, patch) in own {
                let mut sum = LightSum::default();
                let draw = |choice: halflight::direct::Choice| {
                    let seed = hash(choice.tree, hash(t as u32, seed));
                    Vec2::from([0, 1].map(|d| sobol.point(choice.k, d, seed)))
                };
                lights.add(&mut sum, (point, lights.cuts(*patch), DVec3::splat(share)), RAYS, draw, scratch);
                sum.by_emitter(|e, light| found[lamp_of[e]] += light);
            }
            found.into_iter().map(|light| light.as_vec3().max(Rgb::ZERO)).collect::<Vec<Rgb>>()
        };
        let all: Vec<Vec<Rgb>> = (0..places.len()).into_par_iter().map_init(Scratch::default, texel).collect();
        (0..lamps).map(|lamp| all.iter().map(|own| own[lamp]).collect()).collect()
    }

    /// All lamps as they are.
    pub fn gains(&self) -> Vec<DVec3> {
        vec![DVec3::ONE; self.lamps.len()]
    }

    /// The reflected light of each patch in a state.
    fn reflected(&self, mixture: &Mixture) -> Vec<DVec3> {
        let one = |i: usize| {
            let mut sum = DVec3::ZERO;
            for (node, weights) in self.nodes.iter().zip(&mixture.weights) {
                for (terms, weights) in node.terms.iter().zip(weights) {
                    let own = terms.iter().zip(weights).filter(|(_, weight)| **weight != DVec3::ZERO);
                    sum += own.map(|(term, weight)| *weight * term[i].as_dvec3()).sum::<DVec3>();
                }
            }
            for (node, weight) in self.nodes.iter().zip(&mixture.dominant) {
                sum += *weight * node.dominant[i].as_dvec3();
            }
            sum
        };
        (0..self.areas.len()).into_par_iter().map(one).collect()
    }

    /// How far the sum of all terms at a tau is from that of the equation solved there.
    fn error_at(&self, mode: &Assembled, tau: f64) -> TauError {
        let upper = self.kept.radius(1.0, tau).upper;
        let alpha = if upper < 1.0 { 1.0 } else { (SHORT_OF_ONE / upper * 1e3).floor() / 1e3 };
        let state = State { alpha, tau, shown: Shown::All, gains: self.gains(), rho: 1.0, stops: 0.0 };
        let shown = self.reflected(&self.kept.mixture(&state));
        let exact = whole(mode, &together(&mode.sources(), &vec![0; self.lamp_of.len()], 1), alpha);
        let [mut apart, mut all] = [0.0; 2];
        for ((shown, exact), area) in shown.iter().zip(&exact).zip(&self.areas) {
            apart += area * (*shown - *exact).length_squared();
            all += area * exact.length_squared();
        }
        TauError { tau, alpha, error: if all > 0.0 { (apart / all).sqrt() } else { 0.0 } }
    }
}

/// The sum of `alpha^(n-1) KⁿE` over all n from 1 on, the visible half of each patch.
fn whole(mode: &Assembled, source: &[Source], alpha: f64) -> Vec<DVec3> {
    let k = &mode.operator;
    let Some(source) = source.first() else { return vec![DVec3::ZERO; k.len()] };
    let mut term = source.first_bounce.clone().unwrap_or_else(|| k.apply(&source.emission));
    let mut sum = vec![DVec3::ZERO; k.len()];
    for _ in 0..MOST {
        let [mut added, mut all] = [0.0; 2];
        for ((sum, l), area) in sum.iter_mut().zip(&term).zip(k.areas()) {
            *sum += l.visible.as_dvec3();
            added += area * f64::from(l.visible.element_sum());
            all += area * sum.element_sum();
        }
        if added <= LITTLE * all {
            break;
        }
        // Terms times alpha stay within floats where K alone would leave them.
        term.iter_mut().for_each(|l| l.invisible *= alpha as f32);
        term = k.apply(&term);
    }
    sum
}
