//! Signed differences of pictures as colours: blue where the first is darker, white where equal, red where brighter.
//!
//! The difference is that of the mean of the three channels. The colours run linearly in sRGB codes from `RdBu` of
//! ColorBrewer (C. Brewer), which readers with red-green blindness distinguish. Not handled: differences of colour
//! alone.

use crate::page::{Cell, Heading, Shown};
use halflight::light::Rgb;
use halflight::pictures::{Exposure, Picture, decode_srgb};

const DARKER: Rgb = Rgb::new(0.129, 0.400, 0.675);
const EQUAL: Rgb = Rgb::new(0.969, 0.969, 0.969);
const BRIGHTER: Rgb = Rgb::new(0.698, 0.094, 0.169);

/// A scale that shows all but the largest hundredth of the differences without saturating, rounded up to 1, 2 or 5
/// times a power of ten; 1 for equal pictures.
pub fn difference_scale(a: &Picture, b: &Picture) -> f32 {
    let mut sizes: Vec<f32> = differences(a, b).map(f32::abs).collect();
    sizes.sort_by(f32::total_cmp);
    let large = sizes.get(sizes.len().saturating_sub(1) * 99 / 100);
    match large.copied().filter(|l| *l > 0.0 && l.is_finite()) {
        Some(large) => {
            let exponent = large.log10().floor() as i32;
            // Read from decimal digits, so that 0.005 is written as such in the legend.
            let round = |digit: i32| format!("{digit}e{exponent}").parse().unwrap_or(f32::MAX);
            let steps = [1, 2, 5, 10].map(round);
            steps.into_iter().find(|s| *s >= large).unwrap_or(1.0)
        }
        None => 1.0,
    }
}

/// The difference a - b and its legend, as cells of a page; full colour at ±`scale`, whatever the page's exposure.
pub fn difference_cells(a: &Picture, b: &Picture, scale: f32) -> [Cell; 2] {
    let cell = |title: String, picture: &Picture| {
        Cell::new(Heading::new(title, ""), Shown::image(picture, Exposure::default()))
    };
    let pixels = differences(a, b).map(|d| colour(d / scale)).collect();
    let height = (a.height / 12).clamp(8, 24).min(a.height);
    let legend = Picture::from_fn(a.width, height, |x, _| colour(2.0 * (x as f32 + 0.5) / a.width as f32 - 1.0));
    let legend = cell(format!("−{scale} … 0 … +{scale}"), &legend);
    [
        cell("difference".into(), &Picture { pixels, ..*a }),
        Cell { below: "W/(m² sr), mean of the channels".into(), ..legend },
    ]
}

fn differences(a: &Picture, b: &Picture) -> impl Iterator<Item = f32> {
    let apart = |(a, b): (&Rgb, &Rgb)| (*a - *b).element_sum() / 3.0;
    a.pixels.iter().zip(&b.pixels).map(apart)
}

/// Linear light of the colour map at a share of full scale, -1 to 1.
fn colour(share: f32) -> Rgb {
    let end = if share < 0.0 { DARKER } else { BRIGHTER };
    let code = EQUAL.lerp(end, share.abs().min(1.0));
    Rgb::new(decode_srgb(code.x), decode_srgb(code.y), decode_srgb(code.z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signs_have_their_colours_and_equal_is_neutral() {
        let a = Picture::from_fn(3, 1, |x, _| Rgb::splat(x as f32));
        let b = Picture::filled(3, 1, Rgb::ONE);
        let [Cell { shown: Shown::Image(shown), .. }, _] = difference_cells(&a, &b, 1.0) else { panic!() };
        let [darker, equal, brighter] = [0, 1, 2].map(|x| shown.get(x, 0).unwrap());
        assert!(darker[2] > darker[0] && brighter[0] > brighter[2]);
        assert_eq!(equal[0], equal[2]);
    }

    #[test]
    fn the_scale_is_a_round_number_above_most_differences() {
        let a = Picture::from_fn(100, 1, |x, _| Rgb::splat(x as f32 * 0.0033));
        let b = Picture::new(100, 1);
        assert!((difference_scale(&a, &b) - 0.5).abs() < 1e-6);
        assert_eq!(difference_scale(&a, &a), 1.0);
    }
}
