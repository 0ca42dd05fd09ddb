//! Phong's specular term, with the half vector of J. Blinn (1977), as OpenGL 1.x lights surfaces by it.
//!
//! ```text
//! seen of light L from direction l by a viewer in direction v: Ks/pi L (n·h)^Ns   if n·l > 0,   h = (l + v) / |l + v|
//! ```
//!
//! per solid angle, added to `rho/pi L (n·l)` of diffuse reflection. In these units the colour of an OpenGL light of
//! radiant intensity I is `(rho (n·l) + Ks (n·h)^Ns) I / (pi (a0 + a1 d + a2 d²))`.
//!
//! The term stands in the visible row of the reflectance matrix alone: what it adds is collected by the camera and
//! never travels, so L = E + K L stays diffuse. Not handled: conservation of energy, which this term does not know, and
//! light that was reflected before.

use glam::{DVec2, DVec3, Vec3};

/// How a surface shows highlights.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Gloss {
    /// Ks, per channel.
    pub specular: Vec3,
    /// Ns, 0 or more.
    pub exponent: f32,
}

impl Gloss {
    /// `(n·h)^Ns` for unit vectors to the light and to the viewer on a side of normal n; 0 where the light is behind
    /// it.
    pub fn lobe(&self, normal: DVec3, to_light: DVec3, to_viewer: DVec3) -> f64 {
        if normal.dot(to_light) <= 0.0 {
            return 0.0;
        }
        let half = (to_light + to_viewer).normalize_or_zero();
        normal.dot(half).max(0.0).powf(f64::from(self.exponent))
    }

    /// Density per solid angle of directions l whose half vectors have the density `(Ns + 1)/(2 pi) (n·h)^Ns`:
    /// that density over `4 (v·h)`.
    pub fn density(&self, normal: DVec3, to_light: DVec3, to_viewer: DVec3) -> f64 {
        let across = 2.0 * (to_light + to_viewer).length();
        f64::from(self.exponent + 1.0) * self.lobe(normal, to_light, to_viewer) / (2.0 * std::f64::consts::PI * across)
    }

    /// The direction of that density for a point `at` of the unit square; none where it lies below the surface.
    pub fn direction(&self, normal: DVec3, to_viewer: DVec3, at: DVec2) -> Option<DVec3> {
        let cosine = (1.0 - at.x).powf(1.0 / f64::from(self.exponent + 1.0));
        let (sin, cos) = (2.0 * std::f64::consts::PI * at.y).sin_cos();
        let across = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        let half = across * (cos * tangent + sin * bitangent) + cosine * normal;
        let along = half.dot(to_viewer);
        let direction = 2.0 * along * half - to_viewer;
        (along > 0.0 && normal.dot(direction) > 0.0).then_some(direction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_have_their_density() {
        // The mean of lobe/density over drawn directions is the integral of the lobe over the hemisphere.
        let to_viewer = DVec3::new(0.3, -0.2, 0.8).normalize();
        for exponent in [0.0, 3.0, 40.0] {
            let gloss = Gloss { specular: Vec3::ONE, exponent };
            let (mut drawn, mut summed) = (0.0, 0.0);
            let count = 400;
            for k in 0..count * count {
                let at = |i: i32| (f64::from(i) + 0.5) / f64::from(count);
                let (u, v) = (at(k % count), at(k / count));
                if let Some(l) = gloss.direction(DVec3::Z, to_viewer, DVec2::new(u, v)) {
                    assert!((l.length() - 1.0).abs() < 1e-12);
                    drawn += gloss.lobe(DVec3::Z, l, to_viewer) / gloss.density(DVec3::Z, l, to_viewer);
                }
                // Uniform over the hemisphere.
                let (sin, cos) = (2.0 * std::f64::consts::PI * v).sin_cos();
                let across = (1.0 - u * u).sqrt();
                let l = DVec3::new(across * cos, across * sin, u);
                summed += 2.0 * std::f64::consts::PI * gloss.lobe(DVec3::Z, l, to_viewer);
            }
            assert!((drawn / summed - 1.0).abs() < 2e-3, "{exponent}: {drawn} {summed}");
        }
    }
}
