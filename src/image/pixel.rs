//! One pixel of the gather pass: its camera rays, and from each point they see the rays to luminaires and over the
//! hemisphere.

use glam::{DVec3, Vec3};

use super::gather::{Fields, GatherSampling, View};
use super::irradiance::Layer;
use crate::form_factors::{DirectSum, Occlusion, Receiver, gather_luminaire};
use crate::light::Rgb;
use crate::rays::cosine::cosine_direction;
use crate::rays::sequence::{Sobol, hash};
use crate::rays::{Hit, Ray, Side};

/// What all pixels share.
pub(super) struct Pass<'a> {
    view: &'a View<'a>,
    fields: &'a Fields,
    sampling: &'a GatherSampling,
    sobol: Sobol,
    occlusion: Occlusion,
    /// No hemisphere ray finds any light.
    dark: bool,
    /// Every ray ends at its first crossing.
    opaque: bool,
}

/// What one pixel found.
pub(super) struct Pixel {
    pub emission: Rgb,
    pub direct: Rgb,
    pub layers: Vec<Layer>,
    pub backs: u32,
    pub rays: u64,
}

/// Memory that one thread uses again for each pixel.
pub(super) struct Scratch {
    hits: Vec<Hit>,
    sums: Vec<DirectSum>,
    incident: Vec<DVec3>,
}

impl<'a> Pass<'a> {
    pub fn new(view: &'a View, fields: &'a Fields, sampling: &'a GatherSampling) -> Pass<'a> {
        let each = sampling.luminaire.max(sampling.hemisphere).max(1);
        Pass {
            view,
            fields,
            sampling,
            sobol: Sobol::new((sampling.camera * each) as usize, 6),
            occlusion: Occlusion::new(view.rays, view.transports),
            dark: fields.is_dark(),
            opaque: view.transports.iter().all(|t| t.tau == 0.0),
        }
    }

    pub fn scratch(&self) -> Scratch {
        Scratch {
            hits: Vec::new(),
            sums: vec![DirectSum::default(); self.view.luminaires.list.len()],
            incident: vec![DVec3::ZERO; self.fields.count],
        }
    }

    /// One pixel: camera rays over its box, and from each point they see rays to luminaires and over the hemisphere.
    pub fn pixel(&self, x: usize, y: usize, scratch: &mut Scratch) -> Pixel {
        let (width, height) = (self.view.width, self.view.height);
        let seed = hash((y * width + x) as u32, self.sampling.seed ^ 0x9a7e_0000);
        scratch.sums.fill(DirectSum::default());
        let mut pixel = Pixel {
            emission: Rgb::ZERO,
            direct: Rgb::ZERO,
            layers: Vec::new(),
            backs: 0,
            rays: u64::from(self.sampling.camera),
        };
        for s in 0..self.sampling.camera {
            let px = (x as f32 + self.sobol.point(s, 0, seed)) / width as f32;
            let py = (y as f32 + self.sobol.point(s, 1, seed)) / height as f32;
            if let Some(seen) = self.seen(px, py) {
                self.shade(seen, (s, seed), &mut pixel, scratch);
            }
        }
        pixel.layers.iter_mut().for_each(Layer::settle);
        let share = 1.0 / self.sampling.camera as f32;
        pixel.emission *= share;
        pixel.direct = self.direct(scratch) * share;
        pixel
    }

    /// Adds what one camera ray found: the light the point emits, and what it receives from luminaires and patches.
    fn shade(
        &self,
        (hit, position): (Hit, Vec3),
        (s, seed): (u32, u32),
        pixel: &mut Pixel,
        scratch: &mut Scratch,
    ) {
        let view = self.view;
        if view.patches.at(hit.face, hit.side, position).is_none() {
            pixel.backs += 1;
            return;
        }
        let material = view.scene.material(hit.face);
        pixel.emission += material.emitted().visible;
        let receiver = Receiver {
            position,
            normal: view.patches.normal(hit.face, hit.side),
            face: hit.face,
        };
        if material.rho == Rgb::ZERO {
            return;
        }
        let rho = material.rho.as_dvec3();
        pixel.rays += self.add_direct(&receiver, rho, s, seed, scratch);
        if !self.dark {
            pixel.rays += u64::from(self.sampling.hemisphere);
            let nearness = self.find_incident(&receiver, s, seed, scratch);
            let material = view.scene.faces[hit.face as usize].material;
            let key = (view.rays.plane(hit.face), hit.side, material);
            let rho = view.scene.material(hit.face).rho;
            let layer = pixel.layer(key, &receiver, rho, self.fields.count);
            layer.add(position, nearness, &scratch.incident);
        }
    }

    /// Light of all luminaires, summed over the camera rays.
    fn direct(&self, scratch: &Scratch) -> Rgb {
        let luminaires = self.view.luminaires.list.iter().zip(&scratch.sums);
        let sum: DVec3 = luminaires
            .map(|(l, sum)| self.occlusion.estimate(sum) * l.radiance.as_dvec3())
            .sum();
        sum.as_vec3()
    }

    /// The first surface under a point of the picture, and where it is met, put exactly into the face's plane.
    fn seen(&self, x: f32, y: f32) -> Option<(Hit, Vec3)> {
        let view = self.view;
        let aspect = view.width as f32 / view.height as f32;
        let (origin, direction) = view.scene.camera.ray(x, y, aspect);
        let ray = Ray {
            origin,
            direction,
            source: None,
        };
        let hit = view.rays.closest(&ray)?;
        let position = origin + hit.t * direction;
        let normal = view.patches.normal(hit.face, Side::Front);
        let off = (position - view.scene.corners(hit.face)[0]).dot(normal);
        Some((hit, position - off * normal))
    }

    /// Adds the light of every luminaire at one point; returns the rays cast.
    fn add_direct(
        &self,
        receiver: &Receiver,
        rho: DVec3,
        s: u32,
        seed: u32,
        scratch: &mut Scratch,
    ) -> u64 {
        let n = self.sampling.luminaire;
        let path = (self.view.rays, &self.occlusion);
        for (l, luminaire) in self.view.luminaires.list.iter().enumerate() {
            let own = hash(l as u32, seed);
            let draw = (0..n as usize).map(|k| {
                let index = s * n + k as u32;
                (
                    self.sobol.point(index, 2, own),
                    self.sobol.point(index, 3, own),
                )
            });
            let sum = &mut scratch.sums[l];
            gather_luminaire(sum, rho, receiver, luminaire, path, draw, &mut scratch.hits);
        }
        match self.occlusion {
            Occlusion::Nothing => 0,
            _ => u64::from(n) * self.view.luminaires.list.len() as u64,
        }
    }

    /// Finds what hemisphere rays from one point read in every field, into `scratch.incident`; returns the sum over
    /// the rays of their inverse lengths, divided by their number.
    fn find_incident(&self, receiver: &Receiver, s: u32, seed: u32, scratch: &mut Scratch) -> f64 {
        let n = self.sampling.hemisphere;
        let mut nearness = 0.0;
        scratch.incident.fill(DVec3::ZERO);
        for index in s * n..(s + 1) * n {
            let (u, v) = (
                self.sobol.point(index, 4, seed),
                self.sobol.point(index, 5, seed),
            );
            let ray = Ray {
                origin: receiver.position,
                direction: cosine_direction(receiver.normal, u, v),
                source: Some(receiver.face),
            };
            self.read(&ray, &mut scratch.hits, &mut scratch.incident);
            nearness += scratch
                .hits
                .first()
                .map_or(0.0, |hit| 1.0 / f64::from(hit.t));
        }
        for sum in &mut scratch.incident {
            *sum /= f64::from(n);
        }
        nearness / f64::from(n)
    }

    /// Reads every field along a ray: each crossing's light times the tau of the surfaces before it.
    fn read(&self, ray: &Ray, hits: &mut Vec<Hit>, incident: &mut [DVec3]) {
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
                    *sum += f64::from(through) * l.as_dvec3();
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

impl Pixel {
    /// The layer of a surface seen; a new one if no camera ray has seen it before.
    fn layer(
        &mut self,
        key: (u32, Side, u32),
        seen: &Receiver,
        rho: Rgb,
        fields: usize,
    ) -> &mut Layer {
        let found = self.layers.iter().position(|l| l.key == key);
        let k = found.unwrap_or_else(|| {
            self.layers.push(Layer::new(key, seen.normal, rho, fields));
            self.layers.len() - 1
        });
        &mut self.layers[k]
    }
}
