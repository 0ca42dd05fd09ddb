//! Where walks of light land first, and whether patches know of it.
//!
//! What a patch receives as emitted is the mean over points of it, which narrow light may all miss: a beam's disc, the
//! sun through a slit, a lamp that touches a wall. Walks start from what emits and go where its light goes, so they
//! land there in proportion to its power. Where n of them bring a patch the power P by portions p, and less than half
//! of what is certain of that was received,
//!
//! ```text
//! P - 4 sqrt(sum of p²)  >  2 pi A rho D
//! ```
//!
//! the places where they lie closest together become spots, which have points of their own
//! ([`crate::patches::spots`]). A regression tree between the landings and as many points uniform over the patch finds
//! these places; a spot is the box around the landings of a leaf, wider by what the outermost of n leave beyond them.
//! A spot is small beside its patch: of a larger one points and paths know.
//!
//! As many walks start as light that is the tolerance's share of all lands by some hundred.
//!
//! Not handled: light that is reflected before; emitters that are no luminaires, whose light is in the rows of F;
//! patches divided by light, which do not stand for all of their area.

use glam::{DVec3, Vec3};
use halflight_team::Loop;

use crate::direct::Lights;
use crate::error::light_walks::Walks;
use crate::light::Transport;
use crate::patches::division::{Tree, grow};
use crate::patches::{Patches, Sample, Spot};
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Stream, hash};
use crate::rays::{Hit, Side};
use crate::scene::Bounds;
use crate::surfaces::SurfacePoint;

/// Landings of light that is the tolerance's share of all.
const ENOUGH: f64 = 256.0;
/// Walks at most.
const MOST: f64 = 1e6;
/// Standard errors beyond which power is certain.
const CERTAIN: f64 = 4.0;
/// How many times what was received walks certainly bring where points missed light.
const MISSED: f64 = 2.0;
/// Landings of a spot at least.
const LEAST: usize = 12;
/// How many times denser than over all of the patch they lie there.
const DENSE: f64 = 4.0;
/// Share of a patch's area that a spot is at most: of a larger one points and paths know.
const SMALL: f64 = 1.0 / 64.0;

/// Where a walk meets a surface first.
pub(crate) struct Landing {
    pub position: Vec3,
    pub face: u32,
    pub side: Side,
    /// What the visible half reflects of it, channels added, W.
    pub power: f64,
}

/// First landings of walks from luminaires and punctual lights.
pub(crate) struct Landings {
    list: Vec<Landing>,
    /// Rays cast.
    pub rays: u64,
    seed: u32,
}

impl Landings {
    /// Follows walks until they land, as many as the relative error of a picture asks for.
    pub(crate) fn new(lights: &Lights, transport: Transport, tolerance: f64, seed: u32) -> Landings {
        let geometry = &lights.geometry;
        let walks = Walks::new(&geometry.scene, &geometry.rays, transport, lights.emitters());
        let count = (ENOUGH / tolerance).min(MOST) as usize;
        let is_luminaire = |face: u32| lights.luminaires.carries[geometry.scene.faces[face as usize].material as usize];
        let seed = Purpose::Landings.seed(seed);
        let one = |hits: &mut Vec<_>, walk: usize| {
            let mut random = Stream::new(hash(walk as u32, seed));
            let mut landed = Vec::new();
            let start = walks.sources.start(&mut random);
            if let Some(start) = start.filter(|start| start.face.is_none_or(is_luminaire)) {
                let weight = |hit: &Hit| start.power(f64::from(hit.t)) / count as f64;
                walks.cross(&start.ray, hits, weight, |hit, reflected, _| {
                    let (position, power) = (start.ray.at(hit.t), reflected.element_sum());
                    let landing = Landing { position, face: hit.face, side: hit.side, power };
                    landed.extend((power > 0.0).then_some(landing));
                });
            }
            landed
        };
        let found = Loop::each(count).map_init(Vec::new, one);
        Landings { list: found.into_iter().flatten().collect(), rays: count as u64, seed }
    }

    /// The spots of patches that have missed light, of which patch i reflects the power `reflected(i)`, W, of what it
    /// receives as emitted.
    pub(crate) fn missed(&self, patches: &Patches, reflected: impl Fn(usize) -> f64) -> Vec<Spot> {
        let mut of_patch: Vec<(u32, usize)> = Vec::new();
        for (k, own) in self.list.iter().enumerate() {
            of_patch.extend(patches.at(own.face, own.side, own.position).map(|patch| (patch, k)));
        }
        of_patch.sort_unstable();
        let each = of_patch.chunk_by(|(a, _), (b, _)| a == b).filter(|own| own.len() >= LEAST);
        let is_missed = |own: &&[(u32, usize)]| {
            let powers = || own.iter().map(|&(_, k)| self.list[k].power);
            let certain = powers().sum::<f64>() - CERTAIN * powers().map(|power| power * power).sum::<f64>().sqrt();
            certain > MISSED * reflected(own[0].0 as usize)
        };
        each.filter(is_missed).flat_map(|own| self.spots(patches, own)).collect()
    }

    /// Where the landings on a patch lie closest together.
    fn spots(&self, patches: &Patches, own: &[(u32, usize)]) -> Vec<Spot> {
        let patch = own[0].0 as usize;
        let mut random = Stream::new(hash(patch as u32, self.seed));
        let landed = own.iter().map(|&(_, k)| {
            let Landing { position, face, side, .. } = self.list[k];
            Sample { point: SurfacePoint { position, normal: patches.normal(face, side), face }, light: DVec3::ONE }
        });
        let mut samples: Vec<Sample> = landed.collect();
        let anywhere = |_| patches.point(patch, random.uniform(), random.uniform());
        samples.extend((0..own.len()).map(anywhere).map(|point| Sample { point, light: DVec3::ZERO }));
        let mut spots = Vec::new();
        put_spots(&grow(samples), &mut spots);
        let largest = SMALL * patches.areas()[patch];
        spots.retain(|spot| across(spot) <= largest);
        spots
    }
}

/// The area of the largest side of a box.
fn across(spot: &Spot) -> f64 {
    let Vec3 { x, y, z } = spot.size();
    f64::from((x * y).max(y * z).max(z * x))
}

/// Adds the boxes around the landings of the leaves in which they lie close together.
fn put_spots(tree: &Tree, spots: &mut Vec<Spot>) {
    let own = match tree {
        Tree::Plane { sides, .. } => return sides.iter().for_each(|side| put_spots(side, spots)),
        Tree::Leaf(own) => own,
    };
    let landed: Vec<Vec3> = own.iter().filter(|s| s.light != DVec3::ZERO).map(|s| s.point.position).collect();
    let others = own.len() - landed.len();
    if landed.len() < LEAST || (landed.len() as f64) < DENSE * (others as f64 + 1.0) {
        return;
    }
    let Bounds { low, high } = Bounds::of(landed.iter().copied());
    // Between the outermost of n and the edge there is one n-th of the width in the mean; and roundings.
    let margin = (high - low) * (2.0 / landed.len() as f32) + Vec3::splat(4.0 * f32::EPSILON);
    spots.push(Bounds { low: low - margin, high: high + margin });
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;
    use std::sync::Arc;

    use super::*;
    use crate::direct::{Luminaires, TOLERABLE};
    use crate::form_factors::Sampling;
    use crate::light::{Mode, Rgb};
    use crate::scene::{Beam, PunctualForm, PunctualLight, PunctualPlace, Scene};
    use crate::surfaces::Geometry;

    /// Half angle of a beam in the box, whose disc is a hundredth as wide as that.
    const CUTOFF: f64 = 0.01;
    const INTENSITY: f64 = 100.0;

    /// The box, lit by nothing but a beam on its floor.
    fn beam_in_a_box() -> Arc<Geometry> {
        let mut scene = Scene::open("cornell-box").expect("built in");
        scene.materials.iter_mut().for_each(|material| material.emission = Rgb::ZERO);
        let position = DVec3::new(0.213, 0.4, 0.107);
        let place = PunctualPlace::new(position, PunctualLight::PHYSICAL, scene.frame.in_metres());
        let beam = Beam::Spot { direction: DVec3::NEG_Y, exponent: 0.0, cutoff: CUTOFF.cos() };
        let form = PunctualForm::Point { place, beam };
        scene.lights.push(PunctualLight { form, intensity: Rgb::splat(INTENSITY as f32), name: None });
        Geometry::new(scene)
    }

    /// All that a beam sends arrives, `I 2 pi (1 - cos)`, though no point of the patches lies in its disc.
    #[test]
    fn what_a_beam_brings_between_points_is_received() {
        let (geometry, transport) = (beam_in_a_box(), Mode::Global.transport());
        let luminaires = Arc::new(Luminaires::new(&geometry.scene));
        let lights = |patches: Patches| {
            let transports = geometry.scene.transports(transport);
            Lights::new(&geometry, &Arc::new(patches), &luminaires, transports, TOLERABLE)
        };
        let sent = INTENSITY * 2.0 * PI * (1.0 - CUTOFF.cos());
        let even = lights(Patches::cut(&geometry, 300));
        for seed in 0..4 {
            // Powers that patches receive and reflect, W a channel.
            let powers = |lights: &Lights| {
                let patches = &lights.patches;
                let sampling = Sampling { rays: 1, emitter_rays: 32, seed };
                let light = lights.receive_punctual(&vec![true; patches.len()], &sampling).0;
                let areas = patches.file_areas(&geometry.scene);
                let power = |i: usize| PI * areas[i] * light[i].as_dvec3();
                let reflected = |i: usize| power(i) * patches.reflectance(&geometry.scene, i).as_dvec3();
                let all = 0..patches.len();
                let received = all.clone().map(|i| power(i).x).sum::<f64>();
                (received, all.map(|i| reflected(i).element_sum()).collect::<Vec<f64>>())
            };
            let (before, reflected) = powers(&even);
            assert!(before < 0.5 * sent, "{seed}: {before} of {sent}");
            let landings = Landings::new(&even, transport, 0.05, seed);
            let spots = landings.missed(&even.patches, |i| reflected[i]);
            assert!(!spots.is_empty());
            let mended = lights(Patches::clone(&even.patches).with_spots(&spots));
            let (after, reflected) = powers(&mended);
            // A disc is pi / 4 of the box around it: the share of 32 well spread points that lie in it is off by less
            // than the root of 0.17 / 32.
            assert!((after / sent - 1.0).abs() < 4.0 * 0.073 / (PI / 4.0), "{seed}: {after} of {sent}");
            assert!(landings.missed(&mended.patches, |i| reflected[i]).is_empty());
        }
    }
}
