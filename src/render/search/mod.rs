//! Light to a tolerance: rounds of patches and rays, what judges them, and how near the light is.

pub(crate) mod both_sides;
pub(crate) mod division;
pub(crate) mod layer_errors;
pub(crate) mod nearing_light;
pub(crate) mod picture_cost;
pub(crate) mod residual_check;
pub(crate) mod rounds;
pub(crate) mod solved;
