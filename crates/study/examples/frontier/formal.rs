//! The formal solution of (I - K) L = E beyond the frontier: there is one, and it is not light.
//!
//! If L >= 0 solved it with radius lambda > 1 and y > 0 the left eigenvector of B, then `y L = y E + lambda y L`, so
//! `y L = -y E/(lambda - 1) < 0`: some patch of every scene whose light reaches everything is negative.
//!
//! Not handled: operators that are singular to rounding.

use std::fmt::{Display, Formatter};

use crate::slice::Slice;
use halflight::light::Light;
use halflight::pictures::Table;
use halflight::solve::direct;

/// What is written on everything that shows a formal solution.
const NOT_LIGHT: &str = "formal solution of (I - K) L = E beyond the frontier: not light";

/// L, negative in places.
pub struct Formal {
    /// Factor on every alpha.
    pub alpha: f64,
    /// One for each patch.
    pub light: Vec<Light>,
}

/// Solves (I - K) L = E by LU ([`direct`]), O(patches³); none where that is singular, lambda being an eigenvalue to
/// rounding.
pub fn formal(slice: &Slice, alpha: f64) -> Option<Formal> {
    Some(Formal { alpha, light: direct(&slice.equations(alpha).operator)? })
}

impl Formal {
    /// Patches with a negative channel.
    pub fn negative(&self) -> usize {
        let least = |l: &&Light| l.invisible.min_element().min(l.visible.min_element());
        self.light.iter().filter(|l| least(l) < 0.0).count()
    }

    /// Every patch, below a line that says what this is not.
    pub fn csv(&self) -> String {
        let mut table = Table::new("patch,invisible_r,invisible_g,invisible_b,visible_r,visible_g,visible_b");
        for (i, l) in self.light.iter().enumerate() {
            let [a, b] = [l.invisible, l.visible];
            table.row(&[&i, &a.x, &a.y, &a.z, &b.x, &b.y, &b.z]);
        }
        format!("# {NOT_LIGHT}; alpha {}\n{}", self.alpha, table.text())
    }
}

impl Display for Formal {
    fn fmt(&self, f: &mut Formatter) -> std::fmt::Result {
        let smallest = self.light.iter().map(|l| l.invisible.min_element()).fold(f32::INFINITY, f32::min);
        let largest = self.light.iter().map(|l| l.invisible.max_element()).fold(f32::NEG_INFINITY, f32::max);
        write!(
            f,
            "{NOT_LIGHT}; alpha {:.4}: radiance {smallest:.4e} to {largest:.4e}, negative in {} of {} patches",
            self.alpha,
            self.negative(),
            self.light.len()
        )
    }
}
