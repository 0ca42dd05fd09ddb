//! Light along a ray: the crossings it may come from, and the product of tau that it passes.
//!
//! ```text
//! F^tau:  sum over crossings c of (what c sends) * product of tau of the surfaces crossed before c
//! ```
//!
//! Behind tau = 0 nothing is seen: the walk stops there, and where every surface is opaque only the closest crossing is
//! asked for.
//!
//! Not handled: which sides send light; [`Rays::transmit`] shows all crossings to its caller.

use std::ops::Mul;

use crate::rays::ray::{Hit, Ray};
use crate::rays::scene_rays::Rays;

impl Rays {
    /// The crossings that light along a ray may come from into `out`, cleared first: all in order, or the closest where
    /// every surface is `opaque`.
    #[inline]
    pub fn light_crossings(&self, ray: &Ray, opaque: bool, out: &mut Vec<Hit>) {
        if opaque {
            out.clear();
            out.extend(self.closest(ray));
        } else {
            self.crossings(ray, out);
        }
    }

    /// Calls `meet` with each crossing in order and the product of tau before it, until that is 0; returns the product
    /// behind the last. `tau` is asked by material.
    #[inline]
    pub fn transmit<T: Copy + From<f32> + Mul<Output = T> + PartialEq>(
        &self,
        crossings: &[Hit],
        tau: impl Fn(usize) -> T,
        mut meet: impl FnMut(&Hit, T),
    ) -> T {
        let mut through = T::from(1.0);
        for hit in crossings {
            meet(hit, through);
            through = through * tau(self.material(hit.face));
            if through == T::from(0.0) {
                break;
            }
        }
        through
    }
}
