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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::form_factors::{Luminaires, Sight};
    use crate::light::{Mode, Rgb, Transport};
    use crate::patches::Patches;
    use crate::rays::Rays;
    use crate::scene::{LoadOptions, Scene};

    /// Rays once took their points in turn. Of Sobol points every other one lies in the same half of the interval, so each point
    /// looked at a half of its hemisphere only.
    #[test]
    fn every_point_that_rays_leave_looks_all_around() {
        let scene = Scene::open("furnace", LoadOptions::default()).unwrap();
        let rays = Rays::new(&scene);
        let patches = Patches::new(&scene, &rays, 6);
        let transports: Vec<Transport> = scene.transports(Mode::Global.transport());
        let luminaires = Luminaires::new(&scene);
        let receives = vec![true; patches.len()];
        let sight = Sight::new(
            &scene,
            (&rays, &patches),
            &luminaires,
            &transports,
            &receives,
        );
        let view = View {
            scene: &scene,
            rays: &rays,
            patches: &patches,
            luminaires: &luminaires,
            sight: &sight,
            transports: &transports,
            width: 1,
            height: 1,
        };
        // Three walls that meet in a corner are bright.
        let bright = |i: usize| patches.point(i, 0.5, 0.5).normal.element_sum() > 0.0;
        let field = (0..patches.len()).map(|i| Rgb::splat(f32::from(bright(i))));
        let fields = Fields::new(&[field.collect()]);
        let reader = Reader::new(&view, &fields, 64);
        let middle = |i: usize| {
            let p = patches.point(i, 0.5, 0.5);
            Receiver {
                position: p.position,
                normal: p.normal,
                face: p.face,
            }
        };
        const RAYS: u32 = 4096;
        let read = |from: &[Receiver]| {
            let mut sums = [DVec3::ZERO];
            reader.read(from, 0..RAYS, 5, &mut Vec::new(), &mut sums);
            sums[0].x / f64::from(RAYS)
        };
        for i in 0..patches.len() {
            for j in 0..i {
                let apart = read(&[middle(i), middle(j)]);
                let each = 0.5 * (read(&[middle(i)]) + read(&[middle(j)]));
                // Four standard errors of independent rays that see bright or dark; the two estimates share no points.
                let bound = 4.0 * (0.25 / f64::from(RAYS) * 2.0).sqrt();
                assert!((apart - each).abs() < bound, "{i} {j}: {apart} {each}");
            }
        }
    }
}
