//! Which texels can be reached from the camera: by paths that start there and go on anywhere, however dark it is.
//!
//! Rooms as people model them hide half of their walls behind skirting boards and panels. A patch there is as bright as
//! the part of it that is seen, which its area does not tell: so a patch stands for its reached texels, and rays of F
//! and the points of direct light start from them. Of small faces that share a patch the points reached are kept.
//!
//! Not handled: spaces that no path finds; patches without a reached texel stand for all of their area.

use std::f32::consts::PI;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::charts::Charts;
use halflight::patches::{Patches, Sample};
use halflight::rays::purpose::Purpose;
use halflight::rays::sobol::{Stream, hash};
use halflight::rays::warp::hemisphere_direction;
use halflight::rays::{Hit, Ray};
use halflight::surfaces::{Geometry, SurfacePoint};

/// Points that paths find for each texel, in the mean.
const POINTS: usize = 16;
/// Rays of a path at most.
const LONGEST: usize = 24;
/// Samples of a patch that light divides, at least twelve of a part; and one patch of so many is divided, so that there
/// are about twice as many parts as patches.
const DIVIDED: usize = 12 * 10;
const PARTS: usize = 8;
/// Paths that one thread follows in one go.
const BATCH: usize = 256;

/// A point of a texel, and its patch.
pub(super) type Place = (SurfacePoint, u32);

/// What paths found.
pub(super) struct Reached {
    /// The points of every texel from which direct light is measured.
    pub places: Vec<Vec<Place>>,
    /// How often paths came to each texel.
    pub counts: Vec<u32>,
    /// Where, in the order of the paths.
    found: Vec<(usize, Place)>,
}

impl Reached {
    /// Follows paths from the camera.
    pub fn new(geometry: &Geometry, charts: &Charts, patches: &Patches, seed: u32) -> Reached {
        let mut places = charts.places(&geometry.scene, patches);
        let batches = (POINTS * places.len()).div_ceil(LONGEST * BATCH);
        let paths = Paths { geometry, charts, patches };
        let of_batch = |k: usize| {
            let mut random = Stream::new(hash(k as u32, Purpose::Reached.seed(seed)));
            let mut found = Vec::new();
            (0..BATCH).for_each(|_| paths.follow(&mut random, &mut found));
            found
        };
        let found: Vec<(usize, Place)> = (0..batches).into_par_iter().flat_map_iter(of_batch).collect();
        let mut counts = vec![0; places.len()];
        for &(texel, place) in &found {
            if !charts.is_of_grid(texel) {
                let own = &mut places[texel];
                if counts[texel] == 0 {
                    own.clear();
                }
                if own.len() < Charts::POINTS {
                    own.push(place);
                }
            }
            counts[texel] += 1;
        }
        Reached { places, counts, found }
    }

    /// What is left of it on some texels.
    pub fn of(mut self, texels: &[usize]) -> Reached {
        Reached {
            places: texels.iter().map(|&t| std::mem::take(&mut self.places[t])).collect(),
            counts: texels.iter().map(|&t| self.counts[t]).collect(),
            found: Vec::new(),
        }
    }

    /// Patches that stand for their reached texels, divided where the light that leaves those differs most: by what it
    /// varies in a patch, times how often paths come there.
    pub fn divided(&self, patches: &Patches, light: &[DVec3]) -> Patches {
        let mut samples: Vec<Vec<Sample>> = vec![Vec::new(); patches.len()];
        for &(texel, (point, patch)) in &self.found {
            let own = &mut samples[patch as usize];
            if own.len() < DIVIDED {
                own.push(Sample { point, light: light[texel] });
            }
        }
        let mut sums = vec![(0.0, DVec3::ZERO, 0.0); patches.len()];
        for &(texel, (_, patch)) in &self.found {
            let (count, sum, squares) = &mut sums[patch as usize];
            (*count, *sum, *squares) = (*count + 1.0, *sum + light[texel], *squares + light[texel].length_squared());
        }
        let varies = |&(count, sum, squares): &(f64, DVec3, f64)| {
            if count > 0.0 { squares - sum.length_squared() / count } else { 0.0 }
        };
        let mut order: Vec<usize> = (0..patches.len()).collect();
        order.sort_by(|&a, &b| varies(&sums[b]).total_cmp(&varies(&sums[a])));
        let whole = self.samples(patches);
        for &patch in &order[(patches.len() / PARTS).max(1).min(order.len())..] {
            samples[patch] = whole[patch].clone();
        }
        patches.divided(samples)
    }

    /// Patches that stand for their reached texels.
    pub fn patches(&self, patches: &Patches) -> Patches {
        patches.divided(self.samples(patches))
    }

    fn samples(&self, patches: &Patches) -> Vec<Vec<Sample>> {
        let mut samples: Vec<Vec<Sample>> = vec![Vec::new(); patches.len()];
        for (own, _) in self.places.iter().zip(&self.counts).filter(|(_, count)| **count > 0) {
            own.iter()
                .for_each(|(point, patch)| samples[*patch as usize].push(Sample { point: *point, light: DVec3::ZERO }));
        }
        samples
    }
}

struct Paths<'a> {
    geometry: &'a Geometry,
    charts: &'a Charts,
    patches: &'a Patches,
}

impl Paths<'_> {
    /// Follows one path, half of them into the picture and half of them anywhere, and adds what it meets.
    fn follow(&self, random: &mut Stream, found: &mut Vec<(usize, Place)>) {
        let Geometry { scene, rays, .. } = self.geometry;
        let camera = &scene.camera;
        let (u, v) = (random.uniform(), random.uniform());
        let (origin, direction) = match random.uniform() < 0.5 {
            true => camera.ray(u, v, 4.0 / 3.0),
            false => (camera.position, anywhere(u, v)),
        };
        let mut ray = Ray { origin, direction, source: None };
        for _ in 0..LONGEST {
            let Some(hit) = rays.closest(&ray).filter(|hit| !scene.is_sky(hit.face)) else { return };
            let Some((texel, place)) = self.met(&ray, &hit) else { return };
            found.push((texel, place));
            let direction = hemisphere_direction(place.0.normal, random.uniform(), random.uniform());
            ray = Ray { origin: place.0.position, direction, source: Some(hit.face) };
        }
    }

    /// The texel that a ray meets, and the point; none on a black back.
    fn met(&self, ray: &Ray, hit: &Hit) -> Option<(usize, Place)> {
        let position = ray.at(hit.t);
        let patch = self.patches.at(hit.face, hit.side, position)?;
        let texel = self.charts.texel(hit.face, hit.side, position)?;
        let normal = self.patches.normal(hit.face, hit.side);
        Some((texel, (SurfacePoint { position, normal, face: hit.face }, patch)))
    }
}

/// A direction, uniform over all.
fn anywhere(u: f32, v: f32) -> Vec3 {
    let (z, angle) = (1.0 - 2.0 * u, 2.0 * PI * v);
    let around = (1.0 - z * z).max(0.0).sqrt();
    Vec3::new(around * angle.cos(), around * angle.sin(), z)
}
