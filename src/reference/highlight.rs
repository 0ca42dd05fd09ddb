//! Highlights at the first surface of a path: Phong's specular term of light as emitted, which the camera collects.
//!
//! ```text
//! Ks/pi L T (n·h)^Ns / density      of a point drawn on an emitter, and of a direction drawn from the lobe,
//! ```
//!
//! weighted by the power heuristic as paths are; of lights without area every one, by closed form and one ray. Nothing
//! of it is passed on. Not handled: highlights of light that was reflected before.

use std::f32::consts::PI;

use glam::DVec2;

use crate::light::Rgb;
use crate::rays::{Hit, Side};
use crate::reference::path::{NextEvent, Space, power_heuristic};
use crate::reference::punctual::sent;
use crate::reference::random::Random;
use crate::reference::surfaces::Seen;

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
