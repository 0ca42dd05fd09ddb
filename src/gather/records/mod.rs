//! Indirect light at pixels: irradiance records, the interpolation between them, and how many there are.

pub(crate) mod final_gather;
pub(crate) mod fit_error;
pub(crate) mod guiding;
pub(crate) mod indirect_light;
pub(crate) mod interpolation;
pub(crate) mod irradiance_cache;
pub(crate) mod pixel_lattice;
pub(crate) mod record;
pub(crate) mod record_rays;
pub(crate) mod record_rounds;
