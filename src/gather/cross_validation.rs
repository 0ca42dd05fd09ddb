//! How far the light between irradiance records is off, measured at places drawn by chance with rays of their own.
//!
//! Records lie where those before them could not speak, and get rays and neighbours where they seem to be off. What
//! they say of themselves was therefore chosen by what it says: a record that misses bright light with both halves of
//! its rays looks right, and stays. So places are drawn anew, whether they have a record or not, and their light is
//! gathered by as many rays as stand behind the fit there. The product of what both halves of the fit and of those rays
//! differ by is, in the mean, what the fit is off by beyond the noise that its own halves tell. The rays are not used
//! again, or the next choice would know them.
//!
//! A place i is drawn with the chance p_i; of N places the squared error is the sum of product_i / (N p_i) (M. Hansen,
//! W. Hurwitz, *On the theory of sampling from finite populations*, 1943). A third of the chance is the same
//! everywhere, one goes by the squared light, one by what its records would leave if they were drawn by chance
//! ([`crate::gather::layer_fits`]), as errors lie where those differ.
//!
//! Not handled: errors in fewer layers than are likely to be drawn, of which a standard error from few places tells too
//! little.

use glam::DVec3;

use crate::gather::irradiance_cache::IrradianceCache;
use crate::gather::irradiance_record::{Record, Site};
use crate::gather::layer_fits::LayerFit;
use crate::gather::pixel::Pixel;
use crate::rays::purpose::Purpose;
use crate::rays::sobol::{Stream, hash};

/// Rays cast from the places over those of all records.
const SHARE: f64 = 0.125;
/// Places at least.
const LEAST: f64 = 16.0;

/// A place that was drawn.
#[derive(Clone, Copy, Debug)]
struct Draw {
    place: usize,
    /// What it stands for: how often it was drawn over N p.
    counts: f64,
}

impl IrradianceCache<'_> {
    /// The sum over the pixels of the squared error of the fit beyond what the halves of the rays differ by, as places
    /// drawn in one `round` tell it, channels added.
    pub fn validate(&mut self, pixels: &[Pixel], round: u32) -> f64 {
        let places = self.layer_fits(pixels, round);
        let draws = self.draws(&places, round);
        let mut fresh: Vec<Record> = draws.iter().map(|draw| self.fresh(&places[draw.place], pixels, round)).collect();
        self.extend(&mut fresh, |j| (places[draws[j].place].rays as u32).max(1));
        let told = draws.iter().zip(&fresh).map(|(draw, record)| {
            let place = &places[draw.place];
            let own = self.total(&record.means().collect::<Vec<_>>());
            draw.counts * place.weight * squared_misfit(place.fitted, own, place.rho)
        });
        self.pixel_stride() as f64 * told.sum::<f64>()
    }

    /// A record of a place that knows nothing of those in the cache.
    fn fresh(&mut self, &LayerFit { pixel, layer, .. }: &LayerFit, pixels: &[Pixel], round: u32) -> Record {
        let seed =
            hash(pixel as u32, hash(layer as u32, hash(round, Purpose::CrossValidation.seed(self.density.seed))));
        let site = Site { pixel, looked: pixels[pixel].count, spacing: 1, seed, density: 0 };
        self.record(&pixels[pixel].layers[layer], site)
    }

    /// The places drawn in a round, as many as the rays allow.
    fn draws(&self, places: &[LayerFit], round: u32) -> Vec<Draw> {
        let chances = chances(places);
        let all: f64 = self.records.iter().map(|record| f64::from(record.rays)).sum();
        let price: f64 = chances.iter().zip(places).map(|(chance, place)| chance * place.rays.max(1.0)).sum();
        let count = (SHARE * all / price).max(LEAST).round();
        drawn(
            &chances,
            count,
            Stream::new(hash(round, Purpose::CrossValidation.seed(self.density.seed))).uniform().into(),
        )
    }
}

/// The chance that each place is drawn.
fn chances(places: &[LayerFit]) -> Vec<f64> {
    let even = 1.0 / places.len().max(1) as f64;
    let sum = |part: fn(&LayerFit) -> f64| places.iter().map(part).sum::<f64>();
    let (light, uncertainty) = (sum(|p| p.light), sum(|p| p.uncertainty));
    let of = |part: f64, all: f64| if all > 0.0 { part / all } else { even };
    places.iter().map(|p| (even + of(p.light, light) + of(p.uncertainty, uncertainty)) / 3.0).collect()
}

/// `count` draws, evenly spread over the places one after the other; neighbours are not drawn together by chance.
fn drawn(chances: &[f64], count: f64, offset: f64) -> Vec<Draw> {
    let (mut sum, mut before) = (offset, 0.0);
    let times = chances.iter().map(|chance| {
        sum += count * chance;
        let times = f64::floor(sum) - before;
        before += times;
        times
    });
    let all = times.zip(chances).enumerate();
    all.filter(|(_, (times, _))| *times > 0.0)
        .map(|(place, (times, chance))| Draw { place, counts: times / (count * chance) })
        .collect()
}

/// The product of what both halves reflect too little, channels added: the squared error in the mean, as the halves'
/// noises are independent.
fn squared_misfit(fitted: [DVec3; 2], own: [DVec3; 2], rho: DVec3) -> f64 {
    let [a, b] = [0, 1].map(|half| rho * (fitted[half] - own[half]));
    a.dot(b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gather::adaptive_sampling::sample_pixels;
    use crate::gather::camera_rays::CameraRays;
    use crate::gather::fields::Fields;
    use crate::gather::final_gather::FinalGather;
    use crate::gather::irradiance_cache::Density;
    use crate::gather::sampling::Gathering;
    use crate::gather::settings::Settings;
    use crate::light::{Mode, Rgb};

    #[test]
    fn a_place_counts_one_in_the_mean_however_often_it_is_drawn() {
        let mut random = Stream::new(4);
        let parts: Vec<f64> = (0..50).map(|_| f64::from(random.uniform()).powi(4) + 0.01).collect();
        let sum: f64 = parts.iter().sum();
        let chances: Vec<f64> = parts.iter().map(|part| part / sum).collect();
        const OFFSETS: u32 = 1000;
        let mut counts = [0.0; 50];
        for k in 0..OFFSETS {
            let offset = (f64::from(k) + 0.5) / f64::from(OFFSETS);
            drawn(&chances, 20.0, offset).iter().for_each(|draw| counts[draw.place] += draw.counts);
        }
        // An interval of length l holds l of evenly spread offsets, to one at each end.
        for (count, chance) in counts.iter().zip(&chances) {
            let off = (count / f64::from(OFFSETS) - 1.0).abs();
            assert!(off <= 2.0 / (20.0 * chance * f64::from(OFFSETS)), "{count} {chance}");
        }
    }

    /// Records chosen by what they say of themselves once told 1.0 % where they were off by 2.6 %. Fresh rays tell what
    /// a record at every layer does.
    #[test]
    fn places_tell_what_fresh_rays_at_every_layer_do() {
        let lights = lights_of("furnished-room", Mode::Global.transport(), 300);
        let view = View::new(&lights, (24, 24).into());
        // Few bright patches, so that records miss some of them.
        let light = |i: usize| if i.is_multiple_of(7) { Rgb::splat(8.0) } else { Rgb::splat(0.1) };
        let fields = Fields::new(&[(0..view.patches.len()).map(light).collect()]);
        let settings = Settings::new(&view, &fields, &Gathering::Within { error: 0.1, seed: 0, deadline: None });
        let camera_rays = CameraRays::new(&view, &fields, &settings.camera);
        let pixels = sample_pixels(&camera_rays, &settings.plan, &|_| ());
        let final_gather = FinalGather::new(&view, &fields);
        let cache = |density: Density| {
            let mut cache = IrradianceCache::new(&camera_rays, &final_gather, density, &pixels);
            cache.place(&pixels);
            cache
        };
        let mut own = cache(settings.density);
        let all = cache(Density { spacing: 1, rays: 2048, seed: 77, ..settings.density });
        let fits = own.layer_fits(&pixels, 0);
        let exact = |fit: &LayerFit| {
            let record = all.record_of[all.starts[fit.pixel] + fit.layer] as usize;
            fit.weight * squared_misfit(fit.fitted, all.total(all.means(record)), fit.rho)
        };
        let expected: f64 = fits.iter().map(exact).sum();
        const ROUNDS: u32 = 64;
        let told: Vec<f64> = (0..ROUNDS).map(|round| own.validate(&pixels, round)).collect();
        let count = f64::from(ROUNDS);
        let mean = told.iter().sum::<f64>() / count;
        let variance = told.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / (count - 1.0);
        // The fits are the same throughout; what is exact has less noise than one round by the ratio of all rays.
        assert!((mean - expected).abs() < 4.0 * (variance / count).sqrt(), "{mean} {expected} {variance}");
        assert!(expected > 4.0 * (variance / count).sqrt(), "nothing to tell: {expected} {variance}");
    }
}
