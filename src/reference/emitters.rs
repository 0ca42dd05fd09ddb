//! Points drawn on emitters for next-event estimation: a face by its power, then a uniform point of it.
//!
//! ```text
//! density of a point of face f, per area:   p_f = P_f / A_f,   P_f = A_f |E_f| / sum of the same
//! with |E| the sum of channels
//! ```
//!
//! A face that sends from both sides is one face here: a point is lit by the side it sees. Not handled: distance and
//! orientation, which the weights against rays that meet emitters by chance make up for; the sky, which only those
//! meet.

use glam::Vec3;

use crate::reference::random::Random;
use crate::reference::surfaces::Surfaces;

/// All faces that emit.
pub(crate) struct Emitters {
    faces: Vec<u32>,
    /// Sum of P up to and including each of `faces`.
    cumulative: Vec<f64>,
    /// p_f of every face of the scene, 0 where it does not emit and for the sky.
    densities: Vec<f32>,
}

/// A point on an emitter.
pub(crate) struct Drawn {
    pub position: Vec3,
    pub face: u32,
    /// Weights of the face's second and third corner.
    pub weights: [f32; 2],
    /// Per area in unit coordinates.
    pub density: f32,
}

impl Emitters {
    /// The faces of a scene that emit.
    pub(crate) fn new(surfaces: &Surfaces) -> Emitters {
        let strength = |face: u32| strength(surfaces, face);
        let faces: Vec<u32> = (0..surfaces.count()).filter(|&face| surfaces.matter(face).emits()).collect();
        let mut densities = vec![0.0; surfaces.faces()];
        let mut sum = 0.0;
        let powers = faces.iter().map(|&face| {
            sum += strength(face) * surfaces.facet(face).area();
            sum
        });
        let mut cumulative: Vec<f64> = powers.collect();
        for &face in &faces {
            densities[face as usize] = (strength(face) / sum) as f32;
        }
        for share in &mut cumulative {
            *share /= sum;
        }
        Emitters { faces, cumulative, densities }
    }

    /// A point; none where nothing emits.
    pub(crate) fn draw(&self, surfaces: &Surfaces, random: &mut Random) -> Option<Drawn> {
        let last = self.faces.len().checked_sub(1)?;
        let share = random.fine();
        let face = self.faces[self.cumulative.partition_point(|&c| c <= share).min(last)];
        // The half of the unit square beyond the diagonal is folded back.
        let (u, v) = (random.uniform(), random.uniform());
        let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
        Some(Drawn { position: surfaces.facet(face).at(u, v), face, weights: [u, v], density: self.density(face) })
    }

    /// The density at which points of a face are drawn, per area.
    #[inline]
    pub(crate) fn density(&self, face: u32) -> f32 {
        self.densities[face as usize]
    }
}

/// |E| of a face: where it has a texture, the mean over some points of it, and at least as much as if one of them were
/// white, for all light may lie between them.
fn strength(surfaces: &Surfaces, face: u32) -> f64 {
    const SIDE: u32 = 16;
    let of = |at: [f32; 2]| {
        let matter = surfaces.matter_at(face, at);
        f64::from(matter.there * matter.emitted.invisible.element_sum())
    };
    if !surfaces.is_textured() {
        return of([0.0; 2]);
    }
    let number = |k: u32| (k as f32 + 0.5) / SIDE as f32;
    let points = (0..SIDE * SIDE).map(|k| (number(k % SIDE), number(k / SIDE)));
    let folded = points.map(|(u, v)| if u + v > 1.0 { [1.0 - u, 1.0 - v] } else { [u, v] });
    let white = f64::from(surfaces.matter(face).emitted.invisible.element_sum());
    folded.map(of).sum::<f64>().max(white) / f64::from(SIDE * SIDE)
}
