//! One path: from the camera to the first surface, and on from surface to surface.
//!
//! Every vertex casts one cosine-distributed ray. The emission of all its crossings is summed exactly; the path goes on
//! at one of them, so that it does not branch:
//!
//! ```text
//! crossing c is chosen with p_c = w_c / W, W = sum of w_c, w_c = max over channels of (throughput T_c alpha_c rho_c)
//! throughput  <-  throughput T_c alpha_c rho_c / p_c,   whose largest channel is W whatever c
//! Russian roulette: goes on with q = min(1, W / rho of the first surface), throughput /= q
//! ```
//!
//! Next-event estimation adds a point drawn on an emitter at every vertex. Both ways of finding an emitter are weighted
//! by the power heuristic, so nothing is counted twice and a furnace works too. With tau > 0 the rays that meet
//! emitters find all of a direction's at once, each with the density of a single ray, so the weights stand.
//!
//! Where W is above 1 (light passes through surfaces and each sends more) throughputs may grow without bound and the
//! variance with them: `max_bounces` ends every path.
//!
//! Sources: E. Veach, *Robust Monte Carlo methods for light transport simulation*, 1997, §9.2; Banks and Beason, 2006.

use std::f32::consts::PI;

use glam::{DVec2, Vec3};

use crate::lights::{Emitters, draw_light, sent};
use crate::random::Random;
use crate::surfaces::{Matter, SurfacePoint, Surfaces};
use halflight::light::{Gloss, Rgb};
use halflight::rays::{End, Hit, Ray, Rays, Side};
use halflight::scene::PunctualLight;

/// Bounce orders kept apart: 0 (emission) to `KEPT - 1`. Later ones are kept together.
pub const KEPT: usize = 9;

/// Whether emitters are sampled at every vertex.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NextEvent {
    /// Every vertex also draws a point on an emitter.
    #[default]
    On,
    /// Emitters are found only by rays that happen to meet them, as in the paper; punctual lights, which no ray
    /// meets, are drawn all the same.
    Off,
}

/// What paths run through.
pub(crate) struct Space<'a> {
    pub rays: &'a Rays,
    pub surfaces: Surfaces,
    pub emitters: Emitters,
    pub lights: Vec<PunctualLight>,
    pub next_event: NextEvent,
    pub max_bounces: u32,
}

/// What one path found.
#[derive(Default)]
pub(crate) struct Found {
    /// Visible light by bounce order; the last holds all later ones.
    pub orders: [Rgb; KEPT + 1],
    /// Orders from this one on are black.
    pub used: usize,
    /// The first surface is a luminaire.
    pub luminaire: bool,
    /// The first surface is the black back of a one-sided face.
    pub back: bool,
    /// The path was ended by `max_bounces` with light still to gather.
    pub cut: bool,
    /// Rays cast.
    pub rays: u64,
}

impl Found {
    #[inline]
    fn add(&mut self, order: u32, light: Rgb) {
        let order = (order as usize).min(KEPT);
        self.orders[order] += light;
        self.used = self.used.max(order + 1);
    }
}

/// What a path draws from and works in.
struct Draws<'a> {
    random: &'a mut Random,
    hits: &'a mut Vec<Hit>,
    /// Rays cast.
    rays: u64,
}

impl Space<'_> {
    /// Follows a camera ray.
    pub(crate) fn follow(&self, camera: &Ray, random: &mut Random, hits: &mut Vec<Hit>) -> Found {
        let mut draws = Draws { random, hits, rays: 1 };
        let mut found = self.gather(camera, &mut draws);
        found.rays = draws.rays;
        found
    }

    fn gather(&self, camera: &Ray, draws: &mut Draws) -> Found {
        let mut found = Found::default();
        let Some(hit) = self.rays.closest(camera) else {
            return found;
        };
        let matter = self.surfaces.matter_at(hit.face, [hit.u, hit.v]);
        if !matter.sends(hit.side) {
            // A second side would change nothing where none reflects.
            found.back = matter.rho != Rgb::ZERO;
            return found;
        }
        found.luminaire = matter.emits();
        found.add(0, matter.emitted.visible);
        let (mut point, mut throughput) = (self.surfaces.point(&hit), matter.rho);
        let reference = throughput.max_element();
        if let Some(gloss) = matter.gloss.filter(|_| self.max_bounces > 0) {
            found.add(1, self.highlight(&point, -camera.direction, &gloss, draws));
        }
        for order in 1_u32.. {
            if throughput == Rgb::ZERO {
                break;
            }
            if order > self.max_bounces {
                found.cut = true;
                break;
            }
            // Gather what emitters send here.
            let cosine = |way: Vec3| point.normal.dot(way) / PI;
            if self.next_event == NextEvent::On {
                let light = self.drawn(&point, |way| [cosine(way); 2], draws);
                found.add(order, throughput * light);
            }
            if let Some(sent) = draw_light(&self.lights, &point, draws.random) {
                draws.rays += 1;
                let through = self.through((point.position, Some(point.face)), (sent.end, None), draws.hits);
                found.add(order, throughput * sent.light * through);
            }
            let way = draws.random.cosine_direction(point.normal);
            self.cast(&point, way, draws.hits);
            draws.rays += 1;
            found.add(order, throughput * self.met(way, cosine(way), draws.hits));
            // Go on at one of the crossings.
            let Some((next, carried)) = self.choose(throughput, draws.hits, draws.random) else {
                break;
            };
            let survival = (carried.max_element() / reference).min(1.0);
            if draws.random.uniform() >= survival {
                break;
            }
            (point, throughput) = (next, carried / survival);
        }
        found
    }

    /// A ray from a point; its crossings as far as light comes through.
    fn cast(&self, point: &SurfacePoint, direction: Vec3, hits: &mut Vec<Hit>) {
        let ray = Ray { origin: point.position, direction, source: Some(point.face) };
        if self.surfaces.opaque {
            hits.clear();
            hits.extend(self.rays.closest(&ray));
        } else {
            self.rays.crossings(&ray, hits);
        }
    }

    /// The crossings that send light towards the start of the ray, each with T_c.
    fn sending<'s>(&'s self, hits: &'s [Hit]) -> impl Iterator<Item = (&'s Hit, Matter, f32)> {
        let mut through = 1.0;
        let crossings = hits.iter().map_while(move |hit| {
            let before = through;
            let matter = self.surfaces.matter_at(hit.face, [hit.u, hit.v]);
            through *= matter.tau;
            (before > 0.0).then_some((hit, matter, before))
        });
        crossings.filter(|(hit, matter, _)| matter.sends(hit.side))
    }

    /// Light emitted towards the start of a ray at all its crossings; its direction was drawn with that density.
    fn met(&self, way: Vec3, density: f32, hits: &[Hit]) -> Rgb {
        let lights = self.sending(hits).filter(|(_, matter, _)| matter.emits());
        let weighted = lights.map(|(hit, matter, through)| {
            let facing = self.surfaces.facet(hit.face).normal.dot(way).abs();
            let drawn = if self.next_event == NextEvent::On { self.emitters.density(hit.face) } else { 0.0 };
            // Of the sky no point is drawn.
            let weight = if drawn > 0.0 { power_heuristic(density * facing / (hit.t * hit.t), drawn) } else { 1.0 };
            through * weight * matter.emitted.invisible
        });
        weighted.sum()
    }

    /// Light emitted towards `point` from one point drawn on an emitter, over its probability; `scatter` has the share
    /// of a direction's irradiance that is passed on, and the density with which it would be drawn.
    fn drawn(&self, point: &SurfacePoint, scatter: impl Fn(Vec3) -> [f32; 2], draws: &mut Draws) -> Rgb {
        let Some(drawn) = self.emitters.draw(&self.surfaces, draws.random) else {
            return Rgb::ZERO;
        };
        let across = drawn.position - point.position;
        let way = across.normalize_or_zero();
        let facing = -self.surfaces.facet(drawn.face).normal.dot(way);
        let side = if facing > 0.0 { Side::Front } else { Side::Back };
        let matter = self.surfaces.matter_at(drawn.face, drawn.weights);
        let ([share, density], per_area) = (scatter(way), facing.abs() / across.length_squared());
        // NaN where the two points are one.
        if !(share > 0.0 && per_area > 0.0 && matter.sends(side)) {
            return Rgb::ZERO;
        }
        draws.rays += 1;
        let from = (point.position, Some(point.face));
        let through = self.through(from, (drawn.position, Some(drawn.face)), draws.hits);
        let weight = power_heuristic(drawn.density, density * per_area);
        matter.emitted.invisible * (matter.there * share * per_area / drawn.density * weight * through)
    }

    /// Highlights of all that is emitted, at the point that a camera ray sees: Phong's specular term `Ks/pi L T
    /// (n·h)^Ns`, which the camera collects, of a point drawn on an emitter and of a direction drawn from the lobe,
    /// weighted as paths are; of punctual lights every one. Nothing of it is passed on.
    fn highlight(&self, point: &SurfacePoint, to_viewer: Vec3, gloss: &Gloss, draws: &mut Draws) -> Rgb {
        let (normal, to_viewer) = (point.normal.as_dvec3(), to_viewer.as_dvec3());
        let lobe = |way: Vec3| gloss.lobe(normal, way.as_dvec3(), to_viewer) as f32 / PI;
        let density = |way: Vec3| gloss.density(normal, way.as_dvec3(), to_viewer) as f32;
        let mut sum = Rgb::ZERO;
        for found in self.lights.iter().filter_map(|light| sent(light, point)) {
            let way = (found.end - point.position).normalize();
            let through = self.through((point.position, Some(point.face)), (found.end, None), draws.hits);
            draws.rays += 1;
            sum += found.light * (PI * lobe(way) / point.normal.dot(way) * through);
        }
        if self.next_event == NextEvent::On {
            sum += self.drawn(point, |way| [lobe(way), density(way)], draws);
        }
        let at = DVec2::new(draws.random.uniform().into(), draws.random.uniform().into());
        if let Some(way) = gloss.direction(normal, to_viewer, at).map(|way| way.as_vec3())
            && density(way) > 0.0
        {
            self.cast(point, way, draws.hits);
            draws.rays += 1;
            sum += self.met(way, density(way), draws.hits) * (lobe(way) / density(way));
        }
        gloss.specular * sum
    }

    /// The product of tau between two points.
    fn through(&self, from: End, to: End, hits: &mut Vec<Hit>) -> f32 {
        if self.surfaces.opaque {
            f32::from(u8::from(self.rays.visible(from, to)))
        } else {
            self.rays.transmittance(from, to, &self.surfaces.taus, hits)
        }
    }

    /// The next vertex and the throughput to it, roulette not yet played; none where no crossing passes light on.
    fn choose(&self, throughput: Rgb, hits: &[Hit], random: &mut Random) -> Option<(SurfacePoint, Rgb)> {
        let weigh = |(hit, matter, through): (&Hit, Matter, f32)| {
            let carried = through * throughput * matter.passed_on;
            (*hit, carried, carried.max_element())
        };
        let all = || self.sending(hits).map(weigh).filter(|(_, _, w)| *w > 0.0);
        let total: f32 = all().map(|(_, _, w)| w).sum();
        let mut remaining = random.uniform() * total;
        let mut chosen = None;
        for (hit, carried, weight) in all() {
            chosen = Some((hit, carried * (total / weight)));
            remaining -= weight;
            if remaining < 0.0 {
                break;
            }
        }
        chosen.map(|(hit, carried)| (self.surfaces.point(&hit), carried))
    }
}

/// Weight of a point found with density `own` where another way finds it with density `other`.
#[inline]
fn power_heuristic(own: f32, other: f32) -> f32 {
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}
