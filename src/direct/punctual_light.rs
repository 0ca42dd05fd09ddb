//! Light of punctual lights at a receiver: closed form times visibility.
//!
//! ```text
//! sum over punctual lights of  E_l(x) T_l / pi,      E_l by OpenGL's terms (`scene::punctual`)
//! ```
//!
//! with T the product of tau between.
//!
//! Up to [`FEW`] lights at a receiver get a ray each. Of more, [`DRAWN`] are drawn in proportion to E_l by systematic
//! sampling: the closed forms of all are known, so only shadows are sampled, without bias.
//!
//! Not handled: a tree over these lights; the closed form of each is evaluated at every receiver, some 5 ns a light.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};

use crate::direct::drawn_light::{Scratch, point_for};
use crate::direct::emitters::occlusion::Occlusion;
use crate::direct::lights::Lights;
use crate::direct::systematic::{Drawn, systematic};
use crate::scene::{PunctualForm, PunctualLight};
use crate::surfaces::SurfacePoint;

/// Punctual lights at a receiver that get a visibility ray each; of more, some are drawn.
const FEW: usize = 32;
/// Punctual lights drawn where they are many.
const DRAWN: usize = 16;
/// Parallel light comes from so far away: beyond the scene, which lies in [-1, 1]³, seen from any point of it.
const AWAY: f64 = 4.0;
/// Visibility rays end so far before a punctual light, which may lie in a surface: several times what rays take for one
/// plane.
const BEFORE: f64 = 1e-5;

/// What falls on a receiver from one punctual light without occlusion.
struct Falling {
    /// The emitter that the light is.
    emitter: usize,
    /// Irradiance over pi, W/(m² sr).
    light: DVec3,
    /// Where its visibility ray ends.
    end: Vec3,
}

impl Falling {
    /// What falls from a punctual light on a point, `weigh(l)` standing for n·l, l the unit vector to the light; `None`
    /// where nothing does.
    fn new(emitter: usize, light: &PunctualLight, x: DVec3, weigh: &impl Fn(DVec3) -> f64) -> Option<Falling> {
        let (way, share, distance) = match &light.form {
            PunctualForm::Point { place, beam } => {
                let across = place.position - x;
                let distance = across.length();
                let way = across / distance;
                (way, beam.share(-way) / place.weakening(distance), distance)
            }
            PunctualForm::Directional { direction } => (-*direction, 1.0, AWAY),
        };
        let irradiance = weigh(way) * share;
        // NaN where the two points are one.
        (irradiance > 0.0).then(|| Falling {
            emitter,
            light: light.intensity.as_dvec3() * (irradiance / PI),
            end: (x + way * (distance - BEFORE)).as_vec3(),
        })
    }

    fn brightness(&self) -> f64 {
        self.light.element_sum()
    }
}

impl Lights {
    /// Calls `each` with irradiance over pi from punctual lights at a receiver, W/(m² sr), and their emitters.
    pub fn gather_punctual(&self, receiver: &SurfacePoint, scratch: &mut Scratch, each: impl FnMut(usize, DVec3)) {
        let n = receiver.normal.as_dvec3();
        self.gather_weighted(receiver, |way| n.dot(way), scratch, each);
    }

    /// Calls `each` with the light of punctual lights at a receiver weighted by `weigh(l)`, l the unit vector to
    /// each, over pi, and their emitters.
    pub(crate) fn gather_weighted(
        &self,
        receiver: &SurfacePoint,
        weigh: impl Fn(DVec3) -> f64,
        scratch: &mut Scratch,
        mut each: impl FnMut(usize, DVec3),
    ) {
        let x = receiver.position.as_dvec3();
        let lights = self.luminaires.punctual.iter().enumerate();
        let falling =
            lights.filter_map(|(k, light)| Falling::new(self.luminaires.punctual_emitter(k), light, x, &weigh));
        if self.punctual == Occlusion::Nothing {
            return falling.for_each(|f| each(f.emitter, f.light));
        }
        let falling: Vec<Falling> = falling.collect();
        for (k, weight) in drawn(&falling, || point_for(receiver.position, u32::MAX).x) {
            let to = (falling[k].end, None);
            let arrived = self.punctual.transmittance(&self.geometry.rays, receiver.end(), to, &mut scratch.hits);
            each(falling[k].emitter, falling[k].light * (weight * f64::from(arrived)));
            scratch.cast += 1;
        }
    }
}

/// The lights that get a visibility ray, and the weight of each: all of them where they are few.
fn drawn(falling: &[Falling], random: impl Fn() -> f32) -> Drawn {
    if falling.len() <= FEW {
        return (0..falling.len()).map(|k| (k, 1.0)).collect();
    }
    systematic(falling.iter().map(Falling::brightness), DRAWN, f64::from(random()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lights_that_are_drawn_have_the_right_mean() {
        let falling: Vec<Falling> = (0..50)
            .map(|k| Falling { emitter: 0, light: DVec3::new(f64::from(k * k), 1.0, 0.5), end: Vec3::ZERO })
            .collect();
        let mut mean = vec![0.0; falling.len()];
        for u in 0..1000 {
            let chosen = drawn(&falling, || (u as f32 + 0.5) / 1000.0);
            assert!(chosen.len() <= DRAWN + 1);
            chosen.iter().for_each(|&(k, weight)| mean[k] += weight / 1000.0);
            let total: f64 = chosen.iter().map(|&(k, weight)| weight * falling[k].brightness()).sum();
            let all: f64 = falling.iter().map(Falling::brightness).sum();
            assert!((total / all - 1.0).abs() < 0.07);
        }
        assert!(mean.iter().skip(5).all(|m| (m - 1.0).abs() < 0.1), "{mean:?}");
    }
}
