//! One pixel of the gather pass: its camera rays, and from each point they see the rays to luminaires.
//!
//! Every camera ray carries its own points on the luminaires, drawn together from one Sobol sequence, so that a
//! penumbra is sampled over pixel and emitter at once. Camera rays come in two halves with independent scramblings:
//! what the halves differ by is the standard error.

use glam::{DVec3, Vec3};

use crate::direct::{DirectSum, LightCuts, Scratch as Memory};
use crate::gather::fields::Fields;
use crate::gather::pixel::Pixel;
use crate::gather::view::View;
use crate::light::Rgb;
use crate::rays::sobol::{Sobol, hash};
use crate::rays::{Hit, Ray, Side};
use crate::surfaces::SurfacePoint;

/// Tells the two halves' scramblings apart.
const HALVES: [u32; 2] = [0x9a7e_0000, 0x3c6e_f372];

/// What all pixels share.
pub(crate) struct Pass<'a> {
    pub view: &'a View<'a>,
    pub fields: &'a Fields,
    sobol: Sobol,
    /// Visibility rays a camera ray and luminaire.
    luminaire: u32,
    seed: u32,
    /// No hemisphere ray finds any light.
    dark: bool,
}

/// Memory that one thread uses again for each pixel.
pub(crate) struct Scratch {
    memory: Memory,
    sums: Vec<DirectSum>,
    /// Light of luminaires that are too many for a sum each.
    linked: DVec3,
}

impl<'a> Pass<'a> {
    /// A pass with so many visibility rays for each camera ray; the first `camera` rays of a half are tabled.
    pub fn new(view: &'a View, fields: &'a Fields, (camera, luminaire): (u32, u32), seed: u32) -> Pass<'a> {
        let luminaire = luminaire.max(1);
        let most = view.sight.cuts.as_ref().map_or(1, |_| LightCuts::MOST_DRAWN);
        Pass {
            view,
            fields,
            sobol: Sobol::new((camera * luminaire * most) as usize, 4),
            luminaire,
            seed,
            dark: fields.is_dark(),
        }
    }

    pub fn scratch(&self) -> Scratch {
        Scratch {
            memory: Memory::default(),
            sums: match self.view.sight.cuts {
                Some(_) => Vec::new(),
                None => vec![DirectSum::default(); self.view.luminaires.list.len()],
            },
            linked: DVec3::ZERO,
        }
    }

    /// Casts camera rays until each half has `count`.
    pub fn extend(&self, k: usize, pixel: &mut Pixel, count: u32, scratch: &mut Scratch) {
        for (half, scrambling) in HALVES.into_iter().enumerate() {
            let seed = hash(k as u32, self.seed ^ scrambling);
            scratch.sums.fill(DirectSum::default());
            scratch.linked = DVec3::ZERO;
            for s in pixel.count..count {
                let (u, v) = (self.sobol.point(s, 0, seed), self.sobol.point(s, 1, seed));
                if let Some(seen) = self.seen(k, u, v) {
                    self.shade(seen, (s, seed, half), pixel, scratch);
                }
            }
            let direct = self.direct(scratch);
            pixel.direct += direct;
            pixel.lit[half] += direct;
        }
        pixel.rays += 2 * u64::from(count - pixel.count);
        pixel.count = count;
    }

    /// Adds what one camera ray found: the light the point emits, and what it receives from luminaires.
    fn shade(
        &self,
        (hit, position): (Hit, Vec3),
        (s, seed, half): (u32, u32, usize),
        pixel: &mut Pixel,
        scratch: &mut Scratch,
    ) {
        let view = self.view;
        let Some(patch) = view.patches.at(hit.face, hit.side, position) else {
            pixel.backs += 1;
            return;
        };
        let index = view.scene.faces[hit.face as usize].material;
        let material = &view.scene.materials[index as usize];
        let emitted = material.emitted().visible.as_dvec3();
        pixel.emission += emitted;
        pixel.emitting += u32::from(emitted != DVec3::ZERO);
        pixel.lit[half] += emitted;
        if material.rho == Rgb::ZERO {
            return;
        }
        pixel.reflecting += 1;
        let receiver = self.receiver(&hit, position);
        let rho = material.rho.as_dvec3();
        pixel.rays += self.add_direct(&receiver, patch, rho, (s, seed), scratch);
        if !self.dark {
            pixel.ambient[half] += rho * self.fields.ambient(patch).as_dvec3();
            let key = (view.rays.plane(hit.face), hit.side, index);
            pixel.layer(key, receiver, material.rho).add(half, &receiver);
        }
    }

    /// Light of all luminaires, summed over the camera rays.
    fn direct(&self, scratch: &Scratch) -> DVec3 {
        let luminaires = self.view.luminaires.list.iter().zip(&scratch.sums);
        let each = luminaires.map(|(l, sum)| sum.estimate() * l.radiance.as_dvec3());
        each.sum::<DVec3>() + scratch.linked
    }

    /// The surface that camera ray s of one half of pixel k sees: its plane, side and material, and the point.
    pub fn look(&self, k: usize, half: usize, s: u32) -> Option<((u32, Side, u32), SurfacePoint)> {
        let view = self.view;
        let seed = hash(k as u32, self.seed ^ HALVES[half]);
        let (u, v) = (self.sobol.point(s, 0, seed), self.sobol.point(s, 1, seed));
        let (hit, position) = self.seen(k, u, v)?;
        view.patches.at(hit.face, hit.side, position)?;
        let material = view.scene.faces[hit.face as usize].material;
        let key = (view.rays.plane(hit.face), hit.side, material);
        Some((key, self.receiver(&hit, position)))
    }

    fn receiver(&self, hit: &Hit, position: Vec3) -> SurfacePoint {
        SurfacePoint { position, normal: self.view.patches.normal(hit.face, hit.side), face: hit.face }
    }

    /// The first surface under a point of pixel k, and where it is met, put exactly into the face's plane.
    fn seen(&self, k: usize, u: f32, v: f32) -> Option<(Hit, Vec3)> {
        let view = self.view;
        let x = ((k % view.width) as f32 + u) / view.width as f32;
        let y = ((k / view.width) as f32 + v) / view.height as f32;
        let aspect = view.width as f32 / view.height as f32;
        let (origin, direction) = view.scene.camera.ray(x, y, aspect);
        let ray = Ray { origin, direction, source: None };
        let hit = view.rays.closest(&ray)?;
        let position = origin + hit.t * direction;
        let normal = view.patches.normal(hit.face, Side::Front);
        let off = (position - view.scene.corners(hit.face)[0]).dot(normal);
        Some((hit, position - off * normal))
    }

    /// Adds the light of every luminaire at one point; returns the rays cast.
    fn add_direct(
        &self,
        receiver: &SurfacePoint,
        patch: u32,
        rho: DVec3,
        (s, seed): (u32, u32),
        scratch: &mut Scratch,
    ) -> u64 {
        let n = self.luminaire;
        let lighting = self.view.lighting();
        if let Some(cuts) = &lighting.sight.cuts {
            return self.add_by_cut(cuts, receiver, patch, rho, (s, seed), scratch);
        }
        let mut cast = 0;
        for l in 0..lighting.luminaires.list.len() {
            // The first luminaire shares the camera ray's scrambling: joint points over pixel and emitter.
            let own = if l == 0 { seed } else { hash(l as u32, seed) };
            let draw = (0..n as usize).map(|k| {
                let index = s * n + k as u32;
                (self.sobol.point(index, 2, own), self.sobol.point(index, 3, own))
            });
            let sum = &mut scratch.sums[l];
            let lamp = lighting.lamp(l, patch);
            cast += lighting.gather_luminaire(lamp, receiver, rho, draw, &mut scratch.memory, sum);
        }
        cast
    }

    /// Adds the light of many luminaires at one point, some of which are drawn; returns the rays cast.
    fn add_by_cut(
        &self,
        cuts: &LightCuts,
        receiver: &SurfacePoint,
        patch: u32,
        rho: DVec3,
        (s, seed): (u32, u32),
        scratch: &mut Scratch,
    ) -> u64 {
        // Blocks of one length for all patches, or two of them in a pixel would share points.
        let block = self.luminaire * LightCuts::MOST_DRAWN;
        let draw = |k: usize| {
            let at = |d: usize| self.sobol.point(s * block + k as u32, d, seed);
            (at(2), at(3))
        };
        let drawn = (0..(self.luminaire * cuts.draws(patch)) as usize).map(draw);
        let (light, cast) = cuts.gather(&self.view.lighting(), receiver, patch, drawn, &mut scratch.memory);
        scratch.linked += rho * light;
        cast
    }
}
