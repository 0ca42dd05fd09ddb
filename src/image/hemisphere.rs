//! Hemisphere rays from one point that read the solution: irradiance over pi, and how near the surroundings are.

use glam::DVec3;

use super::gather::{Fields, View};
use crate::form_factors::Receiver;
use crate::rays::cosine::cosine_direction;
use crate::rays::sequence::Sobol;
use crate::rays::{Hit, Ray};

/// Reads fields along cosine-distributed rays.
pub(super) struct Reader<'a> {
    view: &'a View<'a>,
    fields: &'a Fields,
    sobol: Sobol,
    /// Every ray ends at its first crossing.
    opaque: bool,
}

impl<'a> Reader<'a> {
    /// A reader whose first `count` rays of a point are tabled.
    pub fn new(view: &'a View, fields: &'a Fields, count: u32) -> Reader<'a> {
        Reader {
            view,
            fields,
            sobol: Sobol::new(count as usize, 3),
            opaque: view.transports.iter().all(|t| t.tau == 0.0),
        }
    }

    /// Number of fields that make the picture.
    pub fn leading(&self) -> usize {
        self.fields.leading()
    }

    /// Number of fields read.
    pub fn fields(&self) -> usize {
        self.fields.count()
    }

    /// Adds what the rays `indices`, which start from the points `from`, read in every field to `incident`; returns
    /// the sum of the rays' inverse lengths.
    pub fn read(
        &self,
        from: &[Receiver],
        indices: std::ops::Range<u32>,
        seed: u32,
        hits: &mut Vec<Hit>,
        incident: &mut [DVec3],
    ) -> f64 {
        let mut nearness = 0.0;
        for index in indices {
            let (u, v) = (
                self.sobol.point(index, 0, seed),
                self.sobol.point(index, 1, seed),
            );
            let from = &from[self.start(index, seed, from.len())];
            let ray = Ray {
                origin: from.position,
                direction: cosine_direction(from.normal, u, v),
                source: Some(from.face),
            };
            self.follow(&ray, hits, incident);
            nearness += hits.first().map_or(0.0, |hit| 1.0 / f64::from(hit.t));
        }
        nearness
    }

    /// Which of some points a ray leaves: a dimension of its own, or each of the points would look at a part of the hemisphere
    /// only.
    fn start(&self, index: u32, seed: u32, count: usize) -> usize {
        match count {
            1 => 0,
            _ => (f64::from(self.sobol.point(index, 2, seed)) * count as f64) as usize,
        }
    }

    /// Reads every field along a ray: each crossing's light times the tau of the surfaces before it.
    fn follow(&self, ray: &Ray, hits: &mut Vec<Hit>, incident: &mut [DVec3]) {
        let view = self.view;
        if self.opaque {
            hits.clear();
            hits.extend(view.rays.closest(ray));
        } else {
            view.rays.crossings(ray, hits);
        }
        let mut through = 1.0;
        for hit in hits.iter() {
            let position = ray.origin + hit.t * ray.direction;
            if let Some(j) = view.patches.at(hit.face, hit.side, position) {
                for (sum, l) in incident.iter_mut().zip(self.fields.of_patch(j)) {
                    *sum += f64::from(through) * l.at(position).as_dvec3();
                }
            }
            let material = view.scene.faces[hit.face as usize].material;
            through *= view.transports[material as usize].tau;
            if through == 0.0 {
                break;
            }
        }
    }
}
