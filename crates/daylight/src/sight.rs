//! What a point sees: the sky by closed form or by rays, whichever costs less, and the surfaces by rays.
//!
//! Where a scene has few faces the sky is seen between them exactly ([`crate::barriers`]). Of more than [`FACES`] each
//! point would cost more than the rays that find it to the same error, and rays see holes in masks as well.
//!
//! Not handled: light that is emitted; daylight alone is looked at.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::{DVec3, Vec3};
use halflight::light::{Rgb, Transport};
use halflight::rays::sobol::{Sobol, hash};
use halflight::rays::warp::cosine_direction;
use halflight::rays::{Hit, Ray};
use halflight::scene::Scene;
use halflight::surfaces::{Geometry, SurfacePoint};

use crate::barriers::{Barriers, Place};
use crate::division::{Compass, Division};
use crate::sun::DIAMETER;

/// Faces up to which the sky is seen between them by closed form.
const FACES: usize = 4000;
/// How far before a surface a place is looked from, unit coordinates: what rounding of coordinates needs.
const BEFORE: f64 = 1e-6;
/// Rays by which the sky over a point is found, in so many sets, from the differences of which the error is.
const RAYS: (u32, usize) = (1 << 12, 8);
/// Rays to a sun.
const SUN_RAYS: u32 = 256;
/// Rays that stand for a meridian.
const A_MERIDIAN: usize = 4;

/// A scene without light of its own, as the sky is seen from it.
pub(crate) struct Sight {
    pub geometry: Arc<Geometry>,
    pub division: Division,
    pub compass: Compass,
    pub transports: Vec<Transport>,
    tau: Vec<f32>,
    is_opaque: bool,
    barriers: Option<Barriers>,
    sobol: Sobol,
}

/// A direct part and its standard error, column by column.
pub(crate) type WithErrors = (Vec<f64>, Vec<f64>);

impl Sight {
    pub fn new(geometry: Arc<Geometry>, transports: Vec<Transport>, compass: Compass, division: Division) -> Sight {
        let scene = &geometry.scene;
        let tau: Vec<f32> = transports.iter().map(|own| own.tau).collect();
        let barriers = Barriers::new(scene, &tau, compass, division);
        Sight {
            division,
            compass,
            is_opaque: tau.iter().all(|own| *own == 0.0),
            barriers: (barriers.len() <= FACES).then_some(barriers),
            tau,
            transports,
            sobol: Sobol::new(RAYS.0 as usize, 4),
            geometry,
        }
    }

    pub fn scene(&self) -> &Scene {
        &self.geometry.scene
    }

    /// Whether the sky is seen by closed form.
    pub fn is_exact(&self) -> bool {
        self.barriers.is_some()
    }

    /// The point of a set of well spread numbers.
    pub fn numbers(&self, index: u32, seed: u32) -> [f32; 4] {
        [0, 1, 2, 3].map(|dimension| self.sobol.point(index, dimension, seed))
    }

    /// The cosine-weighted solid angle of every column that a point sees, sr.
    pub fn sky(&self, point: &SurfacePoint, seed: u32) -> WithErrors {
        if let Some(barriers) = &self.barriers {
            return barriers.exact(&place(point));
        }
        let columns = self.division.columns();
        let (mut sum, mut squares) = (vec![0.0; columns], vec![0.0; columns]);
        for set in 0..RAYS.1 {
            let mut own = vec![0.0; columns];
            self.by_rays(point, RAYS.0, hash(set as u32, seed), 1.0, &mut own);
            for ((sum, squares), own) in sum.iter_mut().zip(&mut squares).zip(own) {
                *sum += f64::from(own) / RAYS.1 as f64;
                *squares += f64::from(own).powi(2) / RAYS.1 as f64;
            }
        }
        // What no ray met may still be one ray's.
        let least = PI / f64::from(RAYS.0) / RAYS.1 as f64;
        let error = |(sum, squares): (&f64, f64)| {
            let variance = (squares - sum * sum).max(0.0) / (RAYS.1 - 1) as f64;
            (variance + least * least).sqrt()
        };
        let errors = sum.iter().zip(squares).map(error).collect();
        (sum, errors)
    }

    /// An estimate of that without bias, times a scale, added to what there is: over so many meridians, or the rays
    /// that cost as much.
    pub fn sampled_sky(&self, point: &SurfacePoint, (meridians, seed): (usize, u32), scale: f64, out: &mut [f32]) {
        match &self.barriers {
            Some(barriers) => {
                let first = f64::from(self.sobol.point(0, 0, seed));
                barriers.sampled(&place(point), (meridians, first), scale, out);
            }
            None => self.by_rays(point, (A_MERIDIAN * meridians) as u32, seed, scale, out),
        }
    }

    fn by_rays(&self, point: &SurfacePoint, count: u32, seed: u32, scale: f64, out: &mut [f32]) {
        let mut hits = Vec::new();
        for k in 0..count {
            let (u, v) = (self.sobol.point(k, 0, seed), self.sobol.point(k, 1, seed));
            let direction = cosine_direction(point.normal, u, v);
            let through = self.out_through(&self.ray(point, direction), &mut hits);
            if through > 0.0 {
                out[self.column(direction)] += (scale * PI / f64::from(count) * f64::from(through)) as f32;
            }
        }
    }

    /// Irradiance by a sun of unit irradiance on a plane that faces it, and its error.
    pub fn sun(&self, point: &SurfacePoint, towards: DVec3, seed: u32) -> (f64, f64) {
        if let Some(barriers) = &self.barriers {
            return barriers.sun(&place(point), towards);
        }
        let middle = self.compass.vector(towards);
        let (x, y) = middle.any_orthonormal_pair();
        let mut hits = Vec::new();
        let (mut sum, mut squares) = (0.0, 0.0);
        for k in 0..SUN_RAYS {
            let [u, v, ..] = self.numbers(k, seed).map(f64::from);
            let cosine = 1.0 - u * (1.0 - (0.5 * DIAMETER).cos());
            let sine = (1.0 - cosine * cosine).sqrt();
            let direction = cosine * middle + sine * ((TAU * v).cos() * x + (TAU * v).sin() * y);
            let facing = direction.dot(point.normal.as_dvec3()).max(0.0);
            let through =
                if facing > 0.0 { self.out_through(&self.ray(point, direction.as_vec3()), &mut hits) } else { 0.0 };
            let own = facing * f64::from(through);
            (sum, squares) = (sum + own, squares + own * own);
        }
        let count = f64::from(SUN_RAYS);
        let mean = sum / count;
        (mean, ((squares / count - mean * mean).max(0.0) / count).sqrt())
    }

    pub fn ray(&self, point: &SurfacePoint, direction: Vec3) -> Ray {
        Ray { origin: point.position, direction, source: point.source() }
    }

    fn column(&self, direction: Vec3) -> usize {
        let local = self.compass.of(direction.as_dvec3()).normalize();
        if local.z <= 0.0 {
            return 0;
        }
        let altitude = local.z.min(1.0).asin();
        let rows = self.division.rows();
        let row = (1..rows).take_while(|row| self.division.altitude(*row) <= altitude).count();
        self.division.column(row, local.x.atan2(local.y).rem_euclid(TAU))
    }

    /// The share of light along a ray that comes from outside.
    fn out_through(&self, ray: &Ray, hits: &mut Vec<Hit>) -> f32 {
        let mut out = 0.0;
        let through = self.follow(ray, hits, |hit, through| {
            if self.geometry.rays.is_sky(hit.face) {
                out = through;
            }
        });
        if self.scene().sky.is_some() { out } else { through }
    }

    /// Calls `meet` with what a ray meets, in order, and the share of light that passes what was before; returns the
    /// share behind the last.
    pub fn follow(&self, ray: &Ray, hits: &mut Vec<Hit>, mut meet: impl FnMut(&Hit, f32)) -> f32 {
        self.geometry.rays.light_crossings(ray, self.is_opaque, hits);
        self.geometry.rays.transmit(hits, |material| self.tau[material], |hit, through| meet(hit, through))
    }

    /// `alpha rho` where a ray meets a face.
    pub fn passed_on(&self, hit: &Hit, at: Vec3) -> Rgb {
        let material = self.geometry.rays.material(hit.face);
        self.transports[material].alpha * self.scene().rho_at(hit.face, at)
    }
}

/// A point as the sky is seen from it, lifted off its surface.
fn place(point: &SurfacePoint) -> Place {
    let normal = point.normal.as_dvec3().normalize();
    Place { position: point.position.as_dvec3() + BEFORE * normal, normal }
}
