//! What would explain an error: the picture's brightness, its gamma, or a shift.
//!
//! A picture D of the scene T that is off by one of these alone is
//!
//! ```text
//! D = f T            D - T = a D                 f = 1 / (1 - a)
//! D = (f T)^g        T = a D^p                   g = 1 / p, by Gauss and Newton's method
//! D(x) = T(x - s)    D - T ≈ -s · grad D         s in pixels, to the right and down, to first order
//! ```
//!
//! Coefficients are fitted by least squares to D - B, or to B. They are linear in B, so that they have no bias (a gamma
//! but that of the last step), and their covariance follows from that of independent estimates; what a fit takes from
//! the squared error is
//!
//! ```text
//! explained = c' A c - tr(A cov c),     A the normal matrix        of sum q
//! ```
//!
//! Pixels near others that do not count are left out, since a picture that is shifted shows a luminaire there, which
//! would be all that a fit sees.
//!
//! Not handled: several of them at once; shifts of several pixels, which are told too small; exposures that clip.

use glam::{DMat2, DVec2, DVec3};

use crate::crossed::{Estimated, PixelMean};
use halflight::light::Rgb;
use halflight::pictures::Picture;

/// Standard errors beyond which a coefficient is not chance.
const CERTAIN: f64 = 4.0;
/// Steps of Newton's method for a gamma, which a factor of two takes.
const STEPS: usize = 5;

/// Pixels to either side within which none may see a luminaire.
const CLEAR: usize = 4;

/// The pixels that count and are so far from all that do not.
pub(crate) fn clear_of_others(counts: &[bool], width: usize) -> Vec<bool> {
    let height = counts.len() / width.max(1);
    let across = |k: usize| {
        let x = k % width;
        (k - x.min(CLEAR)..=k + (width - 1 - x).min(CLEAR)).all(|k| counts[k])
    };
    let rows: Vec<bool> = (0..counts.len()).map(across).collect();
    let down = |k: usize| {
        let (x, y) = (k % width, k / width);
        (y.saturating_sub(CLEAR)..=(y + CLEAR).min(height - 1)).all(|y| rows[y * width + x])
    };
    (0..counts.len()).map(down).collect()
}

/// What explains a part of an error.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
pub enum Cause {
    /// The picture is so many times as bright as the scene.
    Brightness {
        /// How many times.
        factor: Estimated,
        /// Share of the squared error that is explained.
        explains: f64,
    },
    /// The picture is the scene's to this power, but for its brightness.
    Gamma {
        /// The power.
        gamma: Estimated,
        /// Share of the squared error that is explained.
        explains: f64,
    },
    /// The picture shows the scene shifted.
    Shift {
        /// By so many pixels to the right, about.
        right: Estimated,
        /// By so many pixels down, about.
        down: Estimated,
        /// Share of the squared error that is explained.
        explains: f64,
    },
}

impl Cause {
    /// Share of the squared error that is explained.
    pub fn explains(&self) -> f64 {
        match self {
            Cause::Brightness { explains, .. } | Cause::Gamma { explains, .. } | Cause::Shift { explains, .. } => {
                *explains
            }
        }
    }
}

/// Coefficients of two fields, the covariance, and what they take from the sum of squares.
struct Fit {
    coefficients: DVec2,
    covariance: DMat2,
    explained: f64,
}

impl Fit {
    fn of(fields: &[DVec3; 2], normal: DMat2, products: &Products) -> Option<Fit> {
        // A field that is nothing, or both alike.
        let is_one = fields[1] == DVec3::ZERO;
        let regular = if is_one { DMat2::from_diagonal(DVec2::new(normal.col(0).x, 1.0)) } else { normal };
        let inverse = regular.try_inverse()?;
        let coefficients = inverse * products.sum;
        let covariance = inverse * products.covariance * inverse;
        let spread = normal * covariance;
        let explained = coefficients.dot(normal * coefficients) - spread.col(0).x - spread.col(1).y;
        Some(Fit { coefficients, covariance, explained })
    }

    fn coefficient(&self, k: usize) -> Estimated {
        Estimated { value: self.coefficients[k], standard_error: self.covariance.col(k)[k].max(0.0).sqrt() }
    }
}

/// Sums of the products of two fields with D - B, and their covariance.
struct Products {
    sum: DVec2,
    covariance: DMat2,
}

impl Products {
    /// Of no pixels; the matrix that glam has as default is not 0.
    const NONE: Products = Products { sum: DVec2::ZERO, covariance: DMat2::ZERO };

    fn add(&mut self, shown: DVec3, fields: &[DVec3; 2], estimates: &[DVec3]) {
        let g = estimates.len() as f64;
        let of = |light: DVec3| DVec2::new(fields[0].dot(light), fields[1].dot(light));
        let mean = of(estimates.iter().sum::<DVec3>() / g);
        self.sum += of(shown) - mean;
        for estimate in estimates {
            let apart = of(*estimate) - mean;
            let share = 1.0 / (g * (g - 1.0));
            self.covariance += DMat2::from_cols(share * apart.x * apart, share * apart.y * apart);
        }
    }
}

/// Pixels of a picture, and their estimates.
pub(crate) struct Evidence<'a, E> {
    pub picture: &'a Picture,
    pub counts: &'a [bool],
    pub estimates: E,
    /// Sum of their crossed squares.
    pub squared: f64,
}

impl<G: AsRef<[DVec3]>, E: Fn(usize) -> G> Evidence<'_, E> {
    /// What explains a part of the error that is not chance, the most first.
    pub(crate) fn causes(&self) -> Vec<Cause> {
        let mut all: Vec<Cause> = [self.brightness(), self.gamma(), self.shift()].into_iter().flatten().collect();
        all.sort_by(|a, b| b.explains().total_cmp(&a.explains()));
        all
    }

    fn shown(&self, k: usize) -> DVec3 {
        self.picture.pixels[k].as_dvec3()
    }

    fn counted(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.counts.len()).filter(|&k| self.counts[k])
    }

    /// Fits two fields to `shown` less the scene; none where they explain nothing.
    fn fit(&self, shown: impl Fn(usize) -> DVec3, fields: impl Fn(usize) -> [DVec3; 2]) -> Option<Fit> {
        let (mut normal, mut products, mut any) = (DMat2::ZERO, Products::NONE, [DVec3::ZERO; 2]);
        for k in self.counted() {
            let own = fields(k);
            let dot = |i: usize, j: usize| own[i].dot(own[j]);
            normal += DMat2::from_cols_array(&[dot(0, 0), dot(1, 0), dot(0, 1), dot(1, 1)]);
            products.add(shown(k), &own, (self.estimates)(k).as_ref());
            any = [0, 1].map(|i| any[i] + own[i].abs());
        }
        Fit::of(&any, normal, &products).filter(|fit| fit.explained > 0.0 && self.squared > 0.0)
    }

    fn brightness(&self) -> Option<Cause> {
        let fit = self.fit(|k| self.shown(k), |k| [self.shown(k), DVec3::ZERO])?;
        let Estimated { value, standard_error } = fit.coefficient(0);
        let rest = 1.0 - value;
        let factor = Estimated { value: 1.0 / rest, standard_error: standard_error / (rest * rest) };
        let explains = fit.explained / self.squared;
        (value.abs() > CERTAIN * standard_error && rest > 0.0).then_some(Cause::Brightness { factor, explains })
    }

    /// `B ≈ a D^p` by Gauss and Newton's method from p = 1, so that the gamma is 1/p.
    fn gamma(&self) -> Option<Cause> {
        let power = |d: f64, p: f64| if d > 0.0 { d.powf(p) } else { 0.0 };
        let bent = |d: f64, p: f64| if d > 0.0 { d.powf(p) * d.ln() } else { 0.0 };
        let (mut p, mut last) = (1.0, None);
        for _ in 0..STEPS {
            let fields = |k: usize| [self.shown(k).map(|d| power(d, p)), self.shown(k).map(|d| bent(d, p))];
            let fit = self.fit(|_| DVec3::ZERO, fields)?;
            let (scale, step) = (fit.coefficients.x, fit.coefficient(1));
            p += (step.value / scale).clamp(-0.5, 0.5);
            last = Some((fit.explained, step.standard_error / scale.abs()));
        }
        let (explained, standard_error) = last.filter(|_| p > 0.0)?;
        // Of sum |D - B|² = sum |D|² - 2 D · B + |B|² the fit explains what it explains of the last.
        let own = |k: usize| self.shown(k).dot(self.shown(k) - 2.0 * PixelMean::of((self.estimates)(k).as_ref()).mean);
        let explains = (explained + self.counted().map(own).sum::<f64>()) / self.squared;
        let gamma = Estimated { value: 1.0 / p, standard_error: standard_error / (p * p) };
        ((p - 1.0).abs() > CERTAIN * standard_error && explains > 0.0).then_some(Cause::Gamma { gamma, explains })
    }

    fn shift(&self) -> Option<Cause> {
        let fit = self.fit(|k| self.shown(k), |k| self.gradient(k))?;
        let [right, down] = [0, 1].map(|i| {
            let Estimated { value, standard_error } = fit.coefficient(i);
            Estimated { value: -value, standard_error }
        });
        let is_certain = |s: Estimated| s.value.abs() > CERTAIN * s.standard_error;
        let explains = fit.explained / self.squared;
        (is_certain(right) || is_certain(down)).then_some(Cause::Shift { right, down, explains })
    }

    /// Half the differences of the pixels to either side, across and down; 0 beside pixels that do not count.
    fn gradient(&self, k: usize) -> [DVec3; 2] {
        let (width, height) = (self.picture.width, self.picture.height);
        let (x, y) = (k % width, k / width);
        let between = |before: usize, after: usize| {
            let all = self.counts[before] && self.counts[after];
            let apart: Rgb = self.picture.pixels[after] - self.picture.pixels[before];
            if all { 0.5 * apart.as_dvec3() } else { DVec3::ZERO }
        };
        let across = if (1..width - 1).contains(&x) { between(k - 1, k + 1) } else { DVec3::ZERO };
        let down = if (1..height - 1).contains(&y) { between(k - width, k + width) } else { DVec3::ZERO };
        [across, down]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scene of smooth hills.
    fn hills(x: f64, y: f64) -> Rgb {
        let height = 2.0 + (0.3 * x).sin() + (0.2 * y).cos();
        Rgb::new(height as f32, 0.7 * height as f32, 0.3 * height as f32)
    }

    /// The causes of a picture of the hills known to a hundredth.
    fn causes(shown: impl Fn(f64, f64) -> Rgb) -> Vec<Cause> {
        let picture = Picture::from_fn(48, 40, |x, y| shown(x as f64, y as f64));
        let truth = Picture::from_fn(48, 40, |x, y| hills(x as f64, y as f64));
        let estimates = |k: usize| {
            let noise = |i: usize| if i.is_multiple_of(2) { 1.01 } else { 0.99 };
            let t = truth.pixels[k].as_dvec3();
            (0..8).map(|i| t * noise(i + k)).collect::<Vec<_>>()
        };
        let squared = picture.pixels.iter().zip(&truth.pixels).map(|(d, t)| (*d - *t).as_dvec3().length_squared());
        let counts = vec![true; 48 * 40];
        let squared = squared.sum();
        Evidence { picture: &picture, counts: &counts, estimates, squared }.causes()
    }

    #[test]
    fn brightness_is_told_exactly() {
        let all = causes(|x, y| 1.25 * hills(x, y));
        let told = all.iter().find_map(|own| match own {
            Cause::Brightness { factor, explains } => Some((*factor, *explains)),
            _ => None,
        });
        let (factor, explains) = told.expect("a factor");
        assert!((factor.value - 1.25).abs() < 1e-3 && (explains - 1.0).abs() < 1e-3, "{all:?}");
        // Estimates 1 % off have that over sqrt(7) as standard error of their mean: of sum D B over sum D².
        let squares = |power: i32| {
            let one = |k: usize| f64::from(hills((k % 48) as f64, (k / 48) as f64).length_squared()).powi(power);
            (0..48 * 40).map(one).sum::<f64>()
        };
        let expected = 0.01 / 7.0_f64.sqrt() * squares(2).sqrt() / squares(1) * 1.25;
        assert!((factor.standard_error / expected - 1.0).abs() < 1e-3, "{all:?} {expected}");
    }

    #[test]
    fn gamma_and_shift_are_told() {
        let all = causes(|x, y| hills(x, y).map(|v| v.powf(1.05)));
        let Some(Cause::Gamma { gamma, explains }) = all.first() else { panic!("{all:?}") };
        assert!((gamma.value - 1.05).abs() < 1e-3 && *explains > 0.99, "{all:?}");
        let all = causes(|x, y| hills(x - 0.5, y + 0.25));
        let Some(Cause::Shift { right, down, explains }) = all.first() else { panic!("{all:?}") };
        assert!((right.value - 0.5).abs() < 0.03 && (down.value + 0.25).abs() < 0.03, "{all:?}");
        // Rows and columns at the border have no gradient.
        assert!(*explains > 0.9, "{all:?}");
    }
}
