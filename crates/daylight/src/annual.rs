//! Illuminance at points under skies, and what a year of it is worth.
//!
//! ```text
//! E_x(t) = sum over p of Y(D_xp) L_p(t) + Y(R_xp) L'_p(t)  +  S_x,sun(t) Es(t)
//! ```
//!
//! L the luminance of the sky without the sun; L' that of the sun alone, spread over the nearest patches, which is good
//! enough for what surfaces reflect; the sun's own light by its disc, where it stands. Y is CIE Y of linear sRGB.
//!
//! | metric | of a point |
//! |---|---|
//! | daylight autonomy | share of occupied hours with at least 300 lx |
//! | sunlit hours | occupied hours with at least 1000 lx of direct sunlight |
//! | UDI | share of occupied hours below 100 lx, from 100 to 300, from 300 to 3000, and above |
//!
//! Of all points: sDA 300/50 %, the share of points with an autonomy of at least half; ASE 1000/250, that of points
//! with more than 250 sunlit hours. The error of a mean illuminance adds up those of all coefficients, as if they all
//! went the same way, and is no smaller than the true one is likely to be.
//!
//! Sources: IES LM-83-12; J. Mardaljevic, L. Heschong, E. Lee, *Daylight metrics and energy savings*, Lighting Res.
//! Technol. 41(3), 2009. Not handled: blinds that LM-83 closes where the sun comes in.

use halflight::pictures::LUMINANCE;
use rayon::prelude::*;
use serde::Serialize;

use crate::coefficients::Coefficients;
use crate::sky::{Skies, Sky};

/// lx that autonomy asks for, and what share of hours.
const AUTONOMY: (f64, f64) = (300.0, 0.5);
/// lx of direct sunlight, and for how many hours.
const SUNLIGHT: (f64, f64) = (1000.0, 250.0);
/// Ends of the classes of UDI, lx.
const USEFUL: [f64; 3] = [100.0, 300.0, 3000.0];

/// Hours of the day, standard time, from the first until before the second.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Occupied {
    /// The first.
    pub from: f64,
    /// The end.
    pub until: f64,
}

impl Default for Occupied {
    /// 8 to 18, every day: 3650 hours, as LM-83 has it.
    fn default() -> Self {
        Occupied { from: 8.0, until: 18.0 }
    }
}

/// Illuminance at points under skies, lx.
#[derive(Clone, Debug)]
pub struct Illuminance {
    /// Points × skies.
    pub all: Vec<f32>,
    /// What the sun alone sends straight there.
    pub sunlight: Vec<f32>,
    /// The mean over skies of each point, and its error.
    pub means: Vec<[f64; 2]>,
    /// Skies.
    pub skies: usize,
}

/// What a year is worth at a point.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PointMetrics {
    /// Mean illuminance over all times, lx.
    pub mean: f64,
    /// Its error, lx.
    pub error: f64,
    /// Share of occupied hours with at least 300 lx.
    pub autonomy: f64,
    /// Occupied hours with at least 1000 lx of direct sunlight.
    pub sunlit: f64,
    /// Share of occupied hours below 100 lx, from 100 to 300, from 300 to 3000, and above.
    pub useful: [f64; 4],
}

/// What a year is worth.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// Of each point.
    pub points: Vec<PointMetrics>,
    /// Share of points with an autonomy of at least half: sDA 300/50 %.
    pub sda: f64,
    /// Share of points with more than 250 sunlit hours: ASE 1000/250.
    pub ase: f64,
    /// Occupied hours.
    pub hours: f64,
    /// Of which day.
    pub occupied: Occupied,
}

/// CIE Y of three channels.
pub(crate) fn luminous(channels: [f64; 3]) -> f64 {
    channels.iter().zip(LUMINANCE).map(|(own, y)| own * y).sum()
}

impl Illuminance {
    /// Of coefficients under skies; where skies have suns, those of the coefficients are theirs, one after the other.
    pub fn new(found: &Coefficients, skies: &Skies) -> Illuminance {
        let (columns, count) = (found.columns(), skies.skies.len());
        let spread: Vec<Vec<(usize, f64)>> =
            skies.skies.iter().map(|sky| few(sky.spread_sun(skies.division))).collect();
        let sums = |x: usize| {
            let own = |values: &dyn Fn(usize) -> [f64; 3]| -> Vec<f64> {
                (0..columns).map(|p| luminous(values(p))).collect()
            };
            let whole = own(&|p| found.of(x, p));
            let reflected = own(&|p| found.reflected[x * columns + p]);
            let errors = own(&|p| found.error_of(x, p));
            let (mut all, mut sunlight) = (Vec::with_capacity(count), Vec::with_capacity(count));
            let (mut mean, mut error, mut sun) = (0.0, 0.0, 0);
            for (sky, spread) in skies.skies.iter().zip(&spread) {
                let dot = |own: &[f64]| own.iter().zip(&sky.luminance).map(|(d, l)| d * l).sum::<f64>();
                let of_sun = |own: &[f64]| spread.iter().map(|(p, l)| own[*p] * l).sum::<f64>();
                let direct = match sky.sun {
                    Some(own) => {
                        sun += 1;
                        own.illuminance * found.suns[x * found.sun_count + sun - 1][0]
                    }
                    None => 0.0,
                };
                let value = dot(&whole) + of_sun(&reflected) + direct;
                mean += value / count as f64;
                error += (dot(&errors) + of_sun(&errors)) / count as f64;
                all.push(value as f32);
                sunlight.push(direct as f32);
            }
            (all, sunlight, [mean, error])
        };
        let found: Vec<_> = (0..found.points).into_par_iter().map(sums).collect();
        let (mut all, mut sunlight, mut means) = (Vec::new(), Vec::new(), Vec::new());
        for (own, sun, mean) in found {
            all.extend(own);
            sunlight.extend(sun);
            means.push(mean);
        }
        Illuminance { all, sunlight, means, skies: count }
    }

    /// What a year is worth; none where no sky has a time within occupied hours.
    pub fn metrics(&self, skies: &Skies, occupied: Occupied) -> Option<Metrics> {
        let is_in = |sky: &Sky| sky.time.is_some_and(|time| time.hour >= occupied.from && time.hour < occupied.until);
        let times: Vec<usize> = (0..self.skies).filter(|&k| is_in(&skies.skies[k])).collect();
        let share = |values: &[f32], (low, high): (f64, f64)| {
            let within = times.iter().filter(|&&k| (low..high).contains(&f64::from(values[k]))).count();
            within as f64 / times.len() as f64
        };
        let hours = times.len() as f64 * skies.hours;
        let [low, middle, high] = USEFUL;
        let rows = self.all.chunks(self.skies.max(1)).zip(self.sunlight.chunks(self.skies.max(1)));
        let point = |((all, sunlight), mean): ((&[f32], &[f32]), &[f64; 2])| PointMetrics {
            mean: mean[0],
            error: mean[1],
            autonomy: share(all, (AUTONOMY.0, f64::INFINITY)),
            sunlit: hours * share(sunlight, (SUNLIGHT.0, f64::INFINITY)),
            useful: [(0.0, low), (low, middle), (middle, high), (high, f64::INFINITY)].map(|range| share(all, range)),
        };
        if times.is_empty() {
            return None;
        }
        let points: Vec<PointMetrics> = rows.zip(&self.means).map(point).collect();
        let count = points.len() as f64;
        let of = |is: &dyn Fn(&PointMetrics) -> bool| points.iter().filter(|own| is(own)).count() as f64 / count;
        let (sda, ase) = (of(&|own| own.autonomy >= AUTONOMY.1), of(&|own| own.sunlit > SUNLIGHT.1));
        Some(Metrics { sda, ase, hours, occupied, points })
    }
}

/// The numbers that are not 0.
fn few(all: Vec<f64>) -> Vec<(usize, f64)> {
    all.into_iter().enumerate().filter(|(_, own)| *own != 0.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coefficients::Way;
    use crate::division::Division;
    use crate::sky::{SkyTime, Sun};
    use glam::DVec3;

    /// Two points below ten hours of skies that grow brighter; the second has the sun for half of them.
    #[test]
    fn metrics_count_hours() {
        let division = Division::new(1).expect("a division");
        let columns = division.columns();
        let mut direct = vec![0.0; 2 * columns];
        direct[1] = 1.0;
        direct[columns + 1] = 2.0;
        let dark = vec![[0.0; 3]; 2 * columns];
        let sky = |k: usize| {
            let mut luminance = vec![0.0; columns];
            luminance[1] = 50.0 * (k + 1) as f64;
            let time = Some(SkyTime { month: 1, day: 1, hour: k as f64 + 8.5 });
            let sun = (k >= 5).then_some(Sun { towards: DVec3::Z, illuminance: 2000.0 });
            Sky { time, luminance, sun }
        };
        let skies = Skies { division, skies: (0..10).map(sky).collect(), hours: 1.0, name: String::new() };
        let suns = (0..10).map(|k| if k < 5 { [0.0; 2] } else { [0.6, 0.0] }).collect();
        let found = Coefficients {
            division,
            points: 2,
            direct_error: vec![0.0; direct.len()],
            direct,
            reflected: dark.clone(),
            reflected_error: dark,
            suns,
            sun_count: 5,
            error: 0.0,
            patch_error: 0.0,
            met: true,
            patches: 0,
            rays: 0,
            way: Way::Direct,
            is_exact: true,
            seconds: 0.0,
        };
        let light = Illuminance::new(&found, &skies);
        assert_eq!(&light.all[..2], [50.0, 100.0]);
        assert_eq!(light.all[15], 600.0 + 1200.0);
        let Metrics { points, sda, ase, hours, .. } = light.metrics(&skies, Occupied::default()).expect("hours");
        assert_eq!((hours, sda, ase), (10.0, 1.0, 0.0));
        assert_eq!((points[0].autonomy, points[0].useful), (0.5, [0.1, 0.4, 0.5, 0.0]));
        assert_eq!((points[1].autonomy, points[1].sunlit), (0.8, 5.0));
        assert!(light.metrics(&skies, Occupied { from: 19.0, until: 20.0 }).is_none());
    }
}
