//! The gather pass: the visible half of L at every pixel, from the solution on patches.
//!
//! ```text
//! pixel = mean over the box of   E_visible                                     seen directly
//!                              + rho * sum over luminaires of F(x) V(x) E      closed form × visibility
//!                              + rho * F^tau L'                                hemisphere rays that read the solution
//! ```
//!
//! with `L'` the invisible light of the patches less what luminaires emit. Direct light is evaluated at the points
//! seen; irradiance from patches at records placed where it varies, with a linear fit between them, so no patch edge
//! shows. Several fields `L'` are gathered from the same rays, one picture each: the bounces of a series cost no more
//! rays than their sum. A camera ray ends at the first surface whatever its tau, as in the paper; the back of a
//! one-sided face is black.
//!
//! No visibility ray is cast where nothing can occlude, and no hemisphere ray where no field has light.
//!
//! Not handled: depth of field, motion, filters other than the box.

use crate::form_factors::Progress;
use crate::gather::adaptive_sampling::sample_pixels;
use crate::gather::camera_rays::CameraRays;
use crate::gather::fields::Fields;
use crate::gather::final_gather::FinalGather;
use crate::gather::gathered::Gathered;
use crate::gather::indirect_light::IndirectLight;
use crate::gather::irradiance_cache::IrradianceCache;
use crate::gather::sampling::Gathering;
use crate::gather::settings::Settings;
use crate::gather::view::View;

/// Renders the visible half: emission, direct light and what each field sends, with their errors; `tick` counts rows.
pub fn gather(view: &View, fields: &Fields, gathering: &Gathering, tick: Progress) -> Gathered {
    let settings = Settings::new(view, fields, gathering);
    let camera_rays = CameraRays::new(view, fields, &settings.camera);
    let mut pixels = sample_pixels(&camera_rays, &settings.plan, tick);
    let final_gather = FinalGather::new(view, fields);
    let mut cache = IrradianceCache::new(&camera_rays, &final_gather, settings.density, &pixels);
    let mut found = IndirectLight::default();
    if !fields.is_dark() {
        found = settings.gather_indirect(&pixels, &mut cache);
        found.sharpen(&camera_rays, &mut pixels, &cache, &settings.plan);
    }
    let mut gathered = found.assemble(&pixels, fields, view);
    gathered.rays += cache.cast;
    gathered
}
