//! Luminance of the sky by Perez's all-weather model, from irradiances that are measured.
//!
//! ```text
//! epsilon = ((Ed + Eb) / Ed + 1.041 z³) / (1 + 1.041 z³)      clearness: Ed diffuse on the horizontal, Eb direct
//! delta   = Ed m / (1367 e)                                   normal, z the sun's zenith angle, m air mass
//! l       = (1 + a exp(b / cos zeta)) (1 + c exp(d gamma) + e cos² gamma)
//! ```
//!
//! with a to e from epsilon, delta and z by tables for eight classes of epsilon, zeta the angle of a direction to the
//! zenith and gamma to the sun. The luminance of a patch is l at its middle, scaled so that all patches together give
//! the diffuse illuminance. Illuminances follow from irradiances by the luminous efficacies of the same authors.
//! Bounds on epsilon, delta and z are those of `gendaymtx`.
//!
//! Sources: R. Perez, P. Ineichen, R. Seals, J. Michalsky, R. Stewart, *Modeling daylight availability and irradiance
//! components from direct and global irradiance*, Solar Energy 44(5), 1990 (equations 1 to 3, 7, 8, table 4); R. Perez,
//! R. Seals, J. Michalsky, *All-weather model for sky luminance distribution*, Solar Energy 50(3), 1993, and erratum
//! 51(5) (equations 1, 6 to 8, table 1); air mass by F. Kasten, 1966. Not handled: coloured skies.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::division::{Division, SkyPatch};
use crate::sun::SunPlace;

/// Extraterrestrial irradiance, W/m².
const SOLAR: f64 = 1367.0;

/// Classes of clearness begin here.
const CLASSES: [f64; 8] = [1.0, 1.065, 1.23, 1.5, 1.95, 2.8, 4.5, 6.2];

/// The coefficients x1 to x4 of a, b, c, d and e for each class.
const SHAPES: [[[f64; 4]; 5]; 8] = [
    [
        [1.3525, -0.2576, -0.2690, -1.4366],
        [-0.7670, 0.0007, 1.2734, -0.1233],
        [2.8000, 0.6004, 1.2375, 1.0000],
        [1.8734, 0.6297, 0.9738, 0.2809],
        [0.0356, -0.1246, -0.5718, 0.9938],
    ],
    [
        [-1.2219, -0.7730, 1.4148, 1.1016],
        [-0.2054, 0.0367, -3.9128, 0.9156],
        [6.9750, 0.1774, 6.4477, -0.1239],
        [-1.5798, -0.5081, -1.7812, 0.1080],
        [0.2624, 0.0672, -0.2190, -0.4285],
    ],
    [
        [-1.1000, -0.2515, 0.8952, 0.0156],
        [0.2782, -0.1812, -4.5000, 1.1766],
        [24.7219, -13.0812, -37.7000, 34.8438],
        [-5.0000, 1.5218, 3.9229, -2.6204],
        [-0.0156, 0.1597, 0.4199, -0.5562],
    ],
    [
        [-0.5484, -0.6654, -0.2672, 0.7117],
        [0.7234, -0.6219, -5.6812, 2.6297],
        [33.3389, -18.3000, -62.2500, 52.0781],
        [-3.5000, 0.0016, 1.1477, 0.1062],
        [0.4659, -0.3296, -0.0876, -0.0329],
    ],
    [
        [-0.6000, -0.3566, -2.5000, 2.3250],
        [0.2937, 0.0496, -5.6812, 1.8415],
        [21.0000, -4.7656, -21.5906, 7.2492],
        [-3.5000, -0.1554, 1.4062, 0.3988],
        [0.0032, 0.0766, -0.0656, -0.1294],
    ],
    [
        [-1.0156, -0.3670, 1.0078, 1.4051],
        [0.2875, -0.5328, -3.8500, 3.3750],
        [14.0000, -0.9999, -7.1406, 7.5469],
        [-3.4000, -0.1078, -1.0750, 1.5702],
        [-0.0672, 0.4016, 0.3017, -0.4844],
    ],
    [
        [-1.0000, 0.0211, 0.5025, -0.5119],
        [-0.3000, 0.1922, 0.7023, -1.6317],
        [19.0000, -5.0000, 1.2438, -1.9094],
        [-4.0000, 0.0250, 0.3844, 0.2656],
        [1.0468, -0.3788, -2.4517, 1.4656],
    ],
    [
        [-1.0500, 0.0289, 0.4260, 0.3590],
        [-0.3250, 0.1156, 0.7781, 0.0025],
        [31.0625, -14.5000, -46.1148, 55.3750],
        [-7.2312, 0.4050, 13.3500, 0.6234],
        [1.5000, -0.6426, 1.8564, 0.5636],
    ],
];

/// Luminous efficacy of diffuse light, lm/W: `a + b w + c cos z + d ln delta`, w the precipitable water.
const DIFFUSE: [[f64; 4]; 8] = [
    [97.24, -0.46, 12.00, -8.91],
    [107.22, 1.15, 0.59, -3.95],
    [104.97, 2.96, -5.53, -8.77],
    [102.39, 5.59, -13.95, -13.90],
    [100.71, 5.94, -22.75, -23.74],
    [106.42, 3.83, -36.15, -28.83],
    [141.88, 1.90, -53.24, -14.03],
    [152.23, 0.35, -45.27, -7.98],
];

/// That of direct light: `a + b w + c exp(5.73 z - 5) + d delta`.
const DIRECT: [[f64; 4]; 8] = [
    [57.20, -4.55, -2.98, 117.12],
    [98.99, -3.46, -1.21, 12.38],
    [109.83, -4.90, -1.71, -8.81],
    [110.34, -5.84, -1.99, -4.56],
    [106.36, -3.97, -1.75, -6.16],
    [107.19, -1.25, -1.51, -26.73],
    [105.75, 0.77, -1.26, -34.44],
    [101.18, 1.58, -1.10, -8.29],
];

/// What a weather file has of a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measured {
    /// Direct normal and diffuse horizontal irradiance, W/m².
    Irradiance {
        /// Direct, on a plane that faces the sun.
        direct: f64,
        /// Diffuse, on the horizontal.
        diffuse: f64,
    },
    /// The same in lux.
    Illuminance {
        /// Direct, on a plane that faces the sun.
        direct: f64,
        /// Diffuse, on the horizontal.
        diffuse: f64,
    },
}

/// The sky and the sun of a time.
#[derive(Clone, Debug, PartialEq)]
pub struct Daylight {
    /// Luminance of each column of a division, cd/m²; the ground's is 0.
    pub luminance: Vec<f64>,
    /// Diffuse illuminance of the horizontal, lx.
    pub diffuse: f64,
    /// Direct illuminance of a plane that faces the sun, lx.
    pub direct: f64,
}

/// What the model knows a sky by.
struct Condition {
    zenith: f64,
    clearness: f64,
    brightness: f64,
    class: usize,
}

impl Condition {
    fn new((direct, diffuse): (f64, f64), sun: SunPlace, day: usize, brightest: f64) -> Condition {
        let lowest =
            if sun.altitude >= 87.0_f64.to_radians() { 3.0_f64.to_radians() } else { FRAC_PI_2 - sun.altitude };
        let zenith = if sun.altitude <= 0.0 { FRAC_PI_2 } else { lowest };
        let mass = 1.0 / (zenith.cos() + 0.15 * (93.885 - zenith.to_degrees()).powf(-1.253));
        let day = 2.0 * PI / 365.0 * (day as f64 - 1.0);
        let orbit = 1.00011
            + 0.034221 * day.cos()
            + 0.00128 * day.sin()
            + 0.000719 * (2.0 * day).cos()
            + 0.000077 * (2.0 * day).sin();
        let cubed = 1.041 * zenith.powi(3);
        let clearness = ((diffuse + direct) / diffuse + cubed) / (1.0 + cubed);
        // Without any diffuse light the sky is as clear as may be.
        let clearness = if clearness.is_nan() { 1.0 } else { clearness.clamp(1.0, brightest) };
        let brightness = (diffuse * mass / (SOLAR * orbit)).clamp(0.01, 0.6);
        let class = CLASSES.iter().rposition(|least| clearness >= *least).unwrap_or(0);
        Condition { zenith, clearness, brightness, class }
    }

    /// Luminous efficacy of diffuse light and of direct light, lm/W, with so much water in the air, cm.
    fn efficacy(&self, water: f64) -> [f64; 2] {
        let [a, b, c, d] = DIFFUSE[self.class];
        let diffuse = a + b * water + c * self.zenith.cos() + d * self.brightness.ln();
        let [a, b, c, d] = DIRECT[self.class];
        let direct = a + b * water + c * (5.73 * self.zenith - 5.0).exp() + d * self.brightness;
        [diffuse, direct.max(0.0)]
    }

    /// a to e.
    fn shape(&self) -> [f64; 5] {
        let Condition { zenith: z, clearness, mut brightness, class } = *self;
        if clearness > 1.065 && clearness < 2.8 {
            brightness = brightness.max(0.2);
        }
        let x = SHAPES[class];
        let mut shape = x.map(|[x1, x2, x3, x4]| x1 + x2 * z + brightness * (x3 + x4 * z));
        if class == 0 {
            let [c, d] = [x[2], x[3]];
            shape[2] = (brightness * (c[0] + c[1] * z)).powf(c[2]).exp() - c[3];
            shape[3] = -(brightness * (d[0] + d[1] * z)).exp() + d[2] + brightness * d[3];
        }
        shape
    }
}

/// The sky of a time: the sun's place, the day of the year, what was measured, and the dew point, °C, of the hours
/// about it.
pub fn perez(division: Division, sun: SunPlace, day: usize, measured: Measured, dew_point: f64) -> Daylight {
    let water = (0.07 * dew_point - 0.075).exp();
    let (condition, [diffuse, direct]) = match measured {
        Measured::Irradiance { direct, diffuse } => {
            let condition = Condition::new((direct, diffuse), sun, day, 11.9);
            let [of_diffuse, of_direct] = condition.efficacy(water);
            (condition, [diffuse * of_diffuse, direct * of_direct])
        }
        Measured::Illuminance { direct, diffuse } => {
            (of_illuminance([direct, diffuse], sun, day, water), [diffuse, direct])
        }
    };
    let patches = division.patches();
    let mut luminance = relative(&patches, &condition, sun);
    let cosines = patches.iter().map(|patch| patch.altitude.sin() * patch.solid_angle);
    let sum: f64 = luminance.iter().zip(cosines).skip(1).map(|(own, cosine)| own * cosine).sum();
    if sum > 1e-6 {
        luminance.iter_mut().for_each(|own| *own *= diffuse / sum);
    } else {
        luminance[1..].fill(diffuse / PI);
    }
    Daylight { luminance, diffuse, direct }
}

/// l at the middles of the patches; 0 on the ground.
fn relative(patches: &[SkyPatch], condition: &Condition, sun: SunPlace) -> Vec<f64> {
    let [a, b, c, d, e] = condition.shape();
    let (sin, cos) = condition.zenith.sin_cos();
    let of = |patch: &SkyPatch| {
        // A patch at the zenith has a cosine of 1; none lies on the horizon.
        let (height, level) = (patch.altitude.sin(), patch.altitude.cos());
        let to_sun = cos * height + sin * level * (patch.azimuth - sun.azimuth).cos();
        let gamma = to_sun.clamp(-1.0, 1.0).acos();
        ((1.0 + a * (b / height).exp()) * (1.0 + c * (d * gamma).exp() + e * gamma.cos().powi(2))).max(0.0)
    };
    patches.iter().enumerate().map(|(column, patch)| if column == 0 { 0.0 } else { of(patch) }).collect()
}

/// The condition of a sky whose illuminances are known: irradiances follow by the efficacies, which follow from those.
fn of_illuminance([direct, diffuse]: [f64; 2], sun: SunPlace, day: usize, water: f64) -> Condition {
    let by_constant = SOLAR / 127_500.0;
    let mut irradiance = [direct * by_constant, diffuse * by_constant];
    let condition = |[direct, diffuse]: [f64; 2]| Condition::new((direct, diffuse), sun, day, 12.0);
    let mut found = condition(irradiance);
    for _ in 0..5 {
        let [of_diffuse, of_direct] = found.efficacy(water);
        let before = irradiance;
        irradiance = [if of_direct > 0.1 { direct / of_direct } else { of_direct }, diffuse / of_diffuse];
        found = condition(irradiance);
        if irradiance.iter().zip(before).all(|(now, before)| (now - before).abs() <= 10.0) {
            break;
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_patches_together_give_the_diffuse_illuminance() {
        let division = Division::new(2).expect("a division");
        let sun = SunPlace { altitude: 0.7, azimuth: 2.0 };
        for (direct, diffuse) in [(0.0, 150.0), (200.0, 180.0), (800.0, 90.0), (0.0, 0.0)] {
            for measured in [
                Measured::Irradiance { direct, diffuse },
                Measured::Illuminance { direct: 100.0 * direct, diffuse: 120.0 * diffuse },
            ] {
                let sky = perez(division, sun, 172, measured, 11.0);
                let patches = division.patches();
                let all: f64 =
                    sky.luminance.iter().zip(&patches).skip(1).map(|(l, p)| l * p.altitude.sin() * p.solid_angle).sum();
                assert!((all - sky.diffuse).abs() <= 1e-9 * sky.diffuse, "{all} {}", sky.diffuse);
                assert!(sky.luminance.iter().all(|l| *l >= 0.0) && sky.luminance[0] == 0.0);
            }
        }
    }

    #[test]
    fn a_clear_sky_is_brightest_by_the_sun_and_an_overcast_one_is_nearly_even() {
        let division = Division::new(1).expect("a division");
        let patches = division.patches();
        let sun = SunPlace { altitude: 0.6, azimuth: 1.0 };
        let brightest = |direct: f64, diffuse: f64| {
            let sky = perez(division, sun, 100, Measured::Irradiance { direct, diffuse }, 11.0);
            let most = (1..patches.len()).max_by(|a, b| sky.luminance[*a].total_cmp(&sky.luminance[*b]));
            patches[most.expect("patches")].direction()
        };
        assert!(brightest(850.0, 80.0).dot(sun.direction()) > 0.98);
        // Under an overcast one the side of the sun is hardly brighter than the other, and the zenith than the horizon.
        let overcast = perez(division, sun, 100, Measured::Irradiance { direct: 0.0, diffuse: 120.0 }, 11.0).luminance;
        let contrast = |sky: &[f64]| {
            sky[1..].iter().copied().fold(0.0, f64::max) / sky[1..].iter().copied().fold(f64::INFINITY, f64::min)
        };
        let clear = perez(division, sun, 100, Measured::Irradiance { direct: 850.0, diffuse: 80.0 }, 11.0).luminance;
        assert!(overcast[patches.len() - 1] > overcast[1] && contrast(&overcast) < 2.0 && contrast(&clear) > 8.0);
    }
}
