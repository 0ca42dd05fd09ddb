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

use crate::light::Rgb;
use crate::rays::{End, Hit, Ray, Rays, Side};
use crate::reference::lights::{Emitters, draw_light, sent};
use crate::reference::random::Random;
use crate::reference::surfaces::{Matter, Seen, SurfacePoint, Surfaces};
use crate::scene::PunctualLight;

/// Bounce orders kept apart: 0 (emission) to `KEPT - 1`. Later ones are kept together.
pub const KEPT: usize = 9;

/// Whether light is looked for on purpose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NextEvent {
    /// Every vertex also draws a point on an emitter.
    #[default]
    On,
    /// Emitters are found only by rays that happen to meet them, as in the paper; lights without area, which no ray
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

impl Space<'_> {
    /// Follows a camera ray.
    pub(crate) fn follow(&self, camera: &Ray, random: &mut Random, hits: &mut Vec<Hit>) -> Found {
        let mut found = Found { rays: 1, ..Found::default() };
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
            let seen = Seen { point: &point, to_viewer: -camera.direction, gloss };
            let light = self.highlight(&seen, random, hits, &mut found.rays);
            found.add(1, light);
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
            if self.next_event == NextEvent::On {
                let light = self.drawn(&point, random, hits, &mut found.rays);
                found.add(order, throughput * light);
            }
            if let Some(sent) = draw_light(&self.lights, &point, random) {
                found.rays += 1;
                let through = self.through((point.position, Some(point.face)), (sent.end, None), hits);
                found.add(order, throughput * sent.light * through);
            }
            let ray = self.cast(&point, random, hits);
            found.rays += 1;
            found.add(order, throughput * self.met(&point, &ray, hits));
            // Go on at one of the crossings.
            let Some((next, carried)) = self.choose(throughput, hits, random) else {
                break;
            };
            let survival = (carried.max_element() / reference).min(1.0);
            if random.uniform() >= survival {
                break;
            }
            (point, throughput) = (next, carried / survival);
        }
        found
    }

    /// A cosine-distributed ray from a point; its crossings as far as light comes through.
    fn cast(&self, point: &SurfacePoint, random: &mut Random, hits: &mut Vec<Hit>) -> Ray {
        self.cast_along(point, random.cosine_direction(point.normal), hits)
    }

    /// A ray from a point; its crossings as far as light comes through.
    pub(super) fn cast_along(&self, point: &SurfacePoint, direction: Vec3, hits: &mut Vec<Hit>) -> Ray {
        let ray = Ray { origin: point.position, direction, source: Some(point.face) };
        if self.surfaces.opaque {
            hits.clear();
            hits.extend(self.rays.closest(&ray));
        } else {
            self.rays.crossings(&ray, hits);
        }
        ray
    }

    /// The crossings that send light towards the start of the ray, each with T_c.
    pub(super) fn sending<'s>(&'s self, hits: &'s [Hit]) -> impl Iterator<Item = (&'s Hit, Matter, f32)> {
        let mut through = 1.0;
        let crossings = hits.iter().map_while(move |hit| {
            let before = through;
            let matter = self.surfaces.matter_at(hit.face, [hit.u, hit.v]);
            through *= matter.tau;
            (before > 0.0).then_some((hit, matter, before))
        });
        crossings.filter(|(hit, matter, _)| matter.sends(hit.side))
    }

    /// Light emitted towards `point` at all crossings of a ray cast from it.
    fn met(&self, point: &SurfacePoint, ray: &Ray, hits: &[Hit]) -> Rgb {
        let lights = self.sending(hits).filter(|(_, matter, _)| matter.emits());
        let weighted = lights.map(|(hit, matter, through)| {
            let light = through * matter.emitted.invisible;
            match self.next_event {
                NextEvent::Off => light,
                // The sky, of which no point is drawn.
                NextEvent::On if hit.face >= self.surfaces.count() => light,
                NextEvent::On => {
                    let facing = self.surfaces.facet(hit.face).normal.dot(ray.direction);
                    let cosines = point.normal.dot(ray.direction) * facing.abs();
                    let met = cosines / (PI * hit.t * hit.t);
                    light * power_heuristic(met, self.emitters.density(hit.face))
                }
            }
        });
        weighted.sum()
    }

    /// Light emitted towards `point` from one point drawn on an emitter, over its probability.
    fn drawn(&self, point: &SurfacePoint, random: &mut Random, hits: &mut Vec<Hit>, rays: &mut u64) -> Rgb {
        let Some(drawn) = self.emitters.draw(&self.surfaces, random) else {
            return Rgb::ZERO;
        };
        let across = drawn.position - point.position;
        let distance2 = across.length_squared();
        let direction = across / distance2.sqrt();
        let facing = -self.surfaces.facet(drawn.face).normal.dot(direction);
        let matter = self.surfaces.matter_at(drawn.face, drawn.weights);
        let side = if facing > 0.0 { Side::Front } else { Side::Back };
        let cosine = point.normal.dot(direction);
        let met = cosine * facing.abs() / (PI * distance2);
        // NaN where the two points are one.
        if !(cosine > 0.0 && met > 0.0 && matter.sends(side)) {
            return Rgb::ZERO;
        }
        *rays += 1;
        let through = self.through((point.position, Some(point.face)), (drawn.position, Some(drawn.face)), hits);
        let weight = power_heuristic(drawn.density, met);
        matter.emitted.invisible * (matter.there * through * weight * met / drawn.density)
    }

    /// The product of tau between two points.
    pub(super) fn through(&self, from: End, to: End, hits: &mut Vec<Hit>) -> f32 {
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
        let mut left = random.uniform() * total;
        let mut chosen = None;
        for (hit, carried, weight) in all() {
            chosen = Some((hit, carried * (total / weight)));
            left -= weight;
            if left < 0.0 {
                break;
            }
        }
        chosen.map(|(hit, carried)| (self.surfaces.point(&hit), carried))
    }
}

/// Weight of a point found with density `own` where another way finds it with density `other`.
#[inline]
pub(super) fn power_heuristic(own: f32, other: f32) -> f32 {
    let ratio = other / own;
    1.0 / (1.0 + ratio * ratio)
}

// MERGED reference/highlight
// Highlights at the first surface of a path: Phong's specular term of light as emitted, which the camera collects.
//
// ```text
// Ks/pi L T (n·h)^Ns / density      of a point drawn on an emitter, and of a direction drawn from the lobe,
// ```
//
// weighted by the power heuristic as paths are; of lights without area every one, by closed form and one ray. Nothing
// of it is passed on. Not handled: highlights of light that was reflected before.

impl Space<'_> {
    /// Highlights of all that is emitted, at the point that a camera ray sees.
    pub(super) fn highlight(&self, seen: &Seen, random: &mut Random, hits: &mut Vec<Hit>, rays: &mut u64) -> Rgb {
        let point = seen.point;
        let mut sum = Rgb::ZERO;
        for found in self.lights.iter().filter_map(|light| sent(light, point)) {
            let way = (found.end - point.position).normalize();
            let through = self.through((point.position, Some(point.face)), (found.end, None), hits);
            let share = seen.lobe(way) / point.normal.dot(way);
            *rays += 1;
            sum += found.light * (share * through);
        }
        if self.next_event == NextEvent::On {
            *rays += 1;
            sum += self.highlight_drawn(seen, random, hits) / PI;
        }
        *rays += 1;
        seen.gloss.specular * (sum + self.highlight_met(seen, random, hits) / PI)
    }

    /// Light over Ks/pi of one point drawn on an emitter, over its density.
    fn highlight_drawn(&self, seen: &Seen, random: &mut Random, hits: &mut Vec<Hit>) -> Rgb {
        let Some(drawn) = self.emitters.draw(&self.surfaces, random) else {
            return Rgb::ZERO;
        };
        let across = drawn.position - seen.point.position;
        let way = across.normalize_or_zero();
        let facing = -self.surfaces.facet(drawn.face).normal.dot(way);
        let side = if facing > 0.0 { Side::Front } else { Side::Back };
        let matter = self.surfaces.matter_at(drawn.face, drawn.weights);
        let (lobe, per_area) = (seen.lobe(way), facing.abs() / across.length_squared());
        // NaN where the two points are one.
        if !(lobe > 0.0 && per_area > 0.0 && matter.sends(side)) {
            return Rgb::ZERO;
        }
        let from = (seen.point.position, Some(seen.point.face));
        let through = self.through(from, (drawn.position, Some(drawn.face)), hits);
        let weight = power_heuristic(drawn.density, seen.density(way) * per_area);
        matter.emitted.invisible * (matter.there * lobe * per_area / drawn.density * weight * through)
    }

    /// Light over Ks/pi along one direction drawn from the lobe, over its density.
    fn highlight_met(&self, seen: &Seen, random: &mut Random, hits: &mut Vec<Hit>) -> Rgb {
        let (normal, to_viewer) = (seen.point.normal.as_dvec3(), seen.to_viewer.as_dvec3());
        let at = DVec2::new(f64::from(random.uniform()), f64::from(random.uniform()));
        let Some(way) = seen.gloss.direction(normal, to_viewer, at).map(|way| way.as_vec3()) else {
            return Rgb::ZERO;
        };
        let density = seen.density(way);
        if density <= 0.0 {
            return Rgb::ZERO;
        }
        self.cast_along(seen.point, way, hits);
        let weighted = self.sending(hits).filter(|(_, matter, _)| matter.emits()).map(|(hit, matter, through)| {
            let facing = self.surfaces.facet(hit.face).normal.dot(way).abs();
            let drawn = match self.next_event {
                NextEvent::On if hit.face < self.surfaces.count() => self.emitters.density(hit.face),
                _ => 0.0,
            };
            matter.emitted.invisible * (through * power_heuristic(density * facing / (hit.t * hit.t), drawn))
        });
        weighted.sum::<Rgb>() * (seen.lobe(way) / density)
    }
}
