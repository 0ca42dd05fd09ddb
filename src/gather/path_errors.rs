//! By how much a picture is off because of the light it reads on patches, as one path tells: the dual-weighted residual
//! of the equation that patches stand for (R. Becker, R. Rannacher, *An optimal control approach to a posteriori error
//! estimation*, Acta Numerica 10, 2001).
//!
//! The light L_h that is read on patches misses the equation of points by `r = E + K L_h - L_h`, and the picture misses
//! that of the exact light by
//!
//! ```text
//! G (L - L_h) = G (I - K)^-1 r = E[ sum over the vertices of a path of w_k r_k ],
//!     r_k = glow + D_k + alpha rho L_h(z_k) - L_h(y_k)
//! ```
//!
//! whose mean over paths ([`crate::gather::importance_paths`]) has no bias however coarse the patches are: it sees the
//! noise of F, the truncation of the series, and patches that mix light which no other grid would part. If the gather
//! pass itself follows one more ray before it reads, the first term of the sum is left out.
//!
//! Not handled: what many paths tell of a picture ([`crate::gather::sampled_pixels`]).

use glam::DVec3;

use crate::gather::fields::Fields;
use crate::gather::importance_paths::{Path, Vertex};
use crate::gather::reading::READINGS;
use crate::gather::reflection::SurfaceHit;
use crate::light::Rgb;
use crate::patches::Patches;

/// The leading field on the patch of a point, as a ray reads it; nothing where there is none.
fn light_at(patches: &Patches, fields: &Fields, at: &SurfaceHit) -> DVec3 {
    let read = |patch: u32| fields.of_patch(patch)[0].at(at.position) * at.over_patch(patches, patch);
    patches.at(at.face, at.side, at.position).map_or(DVec3::ZERO, |patch| read(patch).as_dvec3())
}

/// A sample of the light that leaves a vertex of a path, from the leading field on what its next rays meet.
pub(crate) fn sample(vertex: &Vertex, patches: &Patches, fields: &Fields) -> DVec3 {
    let incident = |m: &SurfaceHit| f64::from(m.through) * light_at(patches, fields, m);
    vertex.found.light(vertex.found.next.iter().map(incident).sum())
}

/// `sum of w_k r_k` over the vertices of a path that each reading leaves to the patches.
pub(crate) fn errors(path: &Path, patches: &Patches, fields: &Fields) -> [DVec3; READINGS] {
    let mut errors = [DVec3::ZERO; READINGS];
    // From the last vertex on, so that sums over what follows are known.
    let (mut rest, mut own) = (DVec3::ZERO, DVec3::ZERO);
    for (k, vertex) in path.vertices.iter().enumerate().rev() {
        let SurfaceHit { face, side, position, distance, .. } = vertex.at;
        let patch = patches.at(face, side, position);
        let over_patch = patch.map_or(Rgb::ONE, |patch| vertex.at.over_patch(patches, patch));
        let read = |patch: u32| (fields.of_patch(patch)[0].at(position) * over_patch).as_dvec3();
        let light = patch.map_or(DVec3::ZERO, read);
        rest += vertex.weight * (sample(vertex, patches, fields) - light);
        // A ray that is too short goes on: what the next one leaves is what it leaves.
        if !patch.is_some_and(|patch| fields.is_near(patch, distance)) {
            own = rest;
        }
        if let Some(error) = errors.get_mut(k) {
            *error = own;
        }
    }
    errors
}
