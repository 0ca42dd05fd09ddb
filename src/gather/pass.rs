//! The gather pass: the visible half of L at every pixel, from the solution on patches.
//!
//! ```text
//! pixel = mean over the box of   E_visible                                     seen directly
//!                              + rho * sum over luminaires of F(x) V(x) E      closed form × visibility
//!                              + rho * F^tau L'                                hemisphere rays that read the solution
//! ```
//!
//! with `L'` the invisible light of the patches less what luminaires emit. Direct light is evaluated at the points
//! seen, irradiance from patches at records placed where it varies, with a linear fit between them. Several fields `L'`
//! are gathered from the same rays, one picture each. A camera ray ends at the first surface whatever its tau, as in
//! the paper; the back of a one-sided face is black.
//!
//! Not handled: depth of field, motion, filters other than the box.

use halflight_team::is_over;

use crate::gather::gathered::Gathered;
use crate::gather::nearness::{Nearing, Told};
use crate::gather::pixels::adaptive_sampling::{Plan, sample_pixels};
use crate::gather::pixels::camera_rays::{CameraRays, CameraSampling};
use crate::gather::pixels::emission::outlines::{Which, measure_outlines};
use crate::gather::pixels::pixel::Pixel;
use crate::gather::records::final_gather::FinalGather;
use crate::gather::records::indirect_light::IndirectLight;
use crate::gather::records::irradiance_cache::{Density, IrradianceCache};
use crate::gather::records::record_rounds::RecordRounds;
use crate::gather::sampling::{Gathering, Limit};
use crate::reading::patch_light::Fields;
use crate::reading::view::View;

/// Renders the visible half: emission, direct light and what each field sends, with their errors.
pub fn gather(view: &View, fields: &Fields, gathering: &Gathering, told: &Told) -> Gathered {
    let settings = GatherSettings::new(view, fields, gathering, told);
    let camera_rays = CameraRays::new(view, fields, &settings.camera);
    let mut pixels = sample_pixels(&camera_rays, &settings.plan);
    let final_gather = FinalGather::new(view, fields);
    let mut cache = IrradianceCache::new(&camera_rays, &final_gather, settings.density, &pixels);
    let mut indirect = IndirectLight::default();
    if !fields.is_dark() {
        indirect = settings.gather_indirect(&pixels, &mut cache);
        indirect.sharpen(&camera_rays, &mut pixels, &cache, &settings.plan);
    }
    if let Some(noise) = settings.plan.noise {
        // Rays since the first ones have shown more.
        measure_outlines(&camera_rays, &mut pixels, Which::Differing, noise, &settings.plan.limit);
    }
    let mut gathered = indirect.assemble(&pixels, fields, view);
    gathered.rays += cache.caster.cast;
    gathered
}

/// Valid radius over the distance to the surroundings, where every pixel has records and at an error of 1 %.
const RADIUS: f64 = 0.15;
/// The least valid radius, in pixels, at an error of 1 %.
const LEAST_RADIUS: f64 = 2.5;
/// Rays of a half at first, at an error of 1 %.
const RAYS: f64 = 128.0;

/// The parameters of the pass that [`Gathering`] makes for one picture.
pub(crate) struct GatherSettings<'a> {
    pub plan: Plan<'a>,
    pub density: Density,
    pub camera: CameraSampling,
    error: Option<f64>,
}

impl<'a> GatherSettings<'a> {
    /// The first estimate; rounds of sampling correct it.
    pub(crate) fn new(view: &View, fields: &Fields, gathering: &Gathering, told: &Told<'a>) -> GatherSettings<'a> {
        let nearing = Nearing { told: *told, squared: 0.0, camera: 1.0 };
        match *gathering {
            Gathering::Uniform(sampling) => GatherSettings {
                plan: Plan { first: (sampling.camera / 2).max(1), noise: None, limit: Limit::NONE, nearing },
                density: Density {
                    spacing: 1,
                    rays: (sampling.camera * sampling.hemisphere / 2).max(1),
                    radius: RADIUS,
                    least: 0.0,
                    seed: sampling.seed,
                },
                camera: CameraSampling {
                    tabled: sampling.camera.max(1),
                    visibility: sampling.luminaire,
                    seed: sampling.seed,
                },
                error: None,
            },
            Gathering::Within { error, camera, seed, limit } => {
                // Without time for rounds the first estimate stays.
                let camera = if fields.is_dark() { 1.0 } else { camera };
                let fineness = if is_over(limit.deadline) { 0.1 } else { (0.01 / error).clamp(0.1, 100.0) };
                GatherSettings {
                    plan: Plan {
                        first: ((2.0 * fineness) as u32).clamp(2, 16).next_power_of_two(),
                        noise: Some(error * camera.sqrt()),
                        limit,
                        nearing: Nearing { squared: error * error, camera, ..nearing },
                    },
                    density: Density {
                        spacing: spacing(view.width.max(view.height)),
                        rays: ((RAYS * fineness.powf(1.4)) as u32).max(16),
                        radius: RADIUS * fineness.powf(-0.5),
                        least: LEAST_RADIUS * fineness.powf(-0.3),
                        seed,
                    },
                    camera: CameraSampling { tabled: 64, visibility: 1, seed },
                    error: Some(error),
                }
            }
        }
    }

    /// Places records and casts their rays until noise and bias are within their parts.
    pub(crate) fn gather_indirect(&self, pixels: &[Pixel], cache: &mut IrradianceCache) -> IndirectLight {
        cache.place(pixels);
        let misfit = self.error.map_or(0.0, |error| RecordRounds::new(cache, pixels, error).run(&self.plan));
        IndirectLight::new(pixels, cache, 1).biased_by(misfit)
    }
}

/// Pixels between the records of the coarsest lattice: some 32 records across the picture.
fn spacing(length: usize) -> usize {
    let most = (length / 32).clamp(1, 16);
    1 << most.ilog2()
}

/// Calls `test` with the pixels of a square picture of a built-in scene whose patches have some `light`, and what
/// makes caches with their first records, of the density for an error of 10 % as `changed`.
#[cfg(test)]
pub(crate) fn with_records(
    (scene, patches, side): (&str, usize, usize),
    light: impl Fn(usize) -> crate::light::Rgb,
    test: impl for<'a> FnOnce(&'a [Pixel], &'a dyn Fn(fn(Density) -> Density) -> IrradianceCache<'a>),
) {
    let lights = crate::reading::view::lights_of(scene, crate::light::Mode::Global.transport(), patches);
    let view = View::new(&lights, (side, side).into());
    let fields = Fields::new(&[(0..view.patches.len()).map(light).collect()]);
    let gathering = Gathering::Within { error: 0.1, camera: 0.25, seed: 0, limit: Limit::NONE };
    let settings = GatherSettings::new(&view, &fields, &gathering, &Told::NOBODY);
    let camera_rays = CameraRays::new(&view, &fields, &settings.camera);
    let pixels = sample_pixels(&camera_rays, &settings.plan);
    let final_gather = FinalGather::new(&view, &fields);
    test(&pixels, &|changed| {
        let density = changed(settings.density);
        let mut cache = IrradianceCache::new(&camera_rays, &final_gather, density, &pixels);
        cache.place(&pixels);
        cache
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::sampling::GatherPass;
    use crate::light::{Mode, Rgb};
    use crate::reading::view::lights_of;

    /// An error that takes more rays: a pass ends all the same, after the round that takes it beyond its limit.
    #[test]
    fn a_pass_ends_where_it_took_as_many_rays_as_it_may() {
        let lights = lights_of("cornell-box", Mode::Global.transport(), 200);
        let size = (12, 12).into();
        let view = View::new(&lights, size);
        let fields = Fields::new(&[vec![Rgb::ONE; view.patches.len()]]);
        let limit = Limit { deadline: None, rays: 3_000_000 };
        let within = Gathering::Within { error: 5e-4, camera: 0.5, seed: 0, limit };
        let gathered = gather(&view, &fields, &GatherPass::new(size, within).gathering, &Told::NOBODY);
        // A round of records casts eight times as many at most.
        assert!((limit.rays..9 * limit.rays).contains(&gathered.rays), "{}", gathered.rays);
        assert!(gathered.error.relative() > 5e-4);
    }
}
