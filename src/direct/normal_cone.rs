//! How luminaires face a place: from a cone that holds their normals, as seen from there.
//!
//! Not handled: which of them face it, where only some do.

/// How luminaires face a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Facing {
    /// All of their fronts are seen from it.
    Towards,
    /// None is.
    Away,
    /// Some, or it is not known.
    Both,
}

impl Facing {
    /// From the largest and least angle between a normal and the way to the place.
    pub fn of(most: f64, least: f64) -> Facing {
        use std::f64::consts::FRAC_PI_2;
        if most <= FRAC_PI_2 {
            Facing::Towards
        } else if least >= FRAC_PI_2 {
            Facing::Away
        } else {
            Facing::Both
        }
    }
}
