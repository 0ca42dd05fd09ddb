//! Signed differences of pictures as colours: blue where the first is darker, white where equal, red where brighter.
//!
//! The difference is that of the mean of the three channels. The colours run linearly in sRGB codes from `RdBu` of
//! ColorBrewer (C. Brewer), which readers with red-green blindness tell apart. Not handled: differences of colour
//! alone.

use crate::light::Rgb;
use crate::pictures::{Exposure, Picture, decode_srgb};
use crate::plot::sheet::Tile;

const DARKER: Rgb = Rgb::new(0.129, 0.400, 0.675);
const EQUAL: Rgb = Rgb::new(0.969, 0.969, 0.969);
const BRIGHTER: Rgb = Rgb::new(0.698, 0.094, 0.169);

/// A picture with the words that stand above and below it.
#[derive(Clone, Debug)]
pub struct Titled {
    /// The picture.
    pub picture: Picture,
    /// Above it.
    pub title: String,
    /// Below it.
    pub note: String,
}

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

/// The difference a - b and its legend, as tiles for a sheet at `exposure`; full colour at ±`scale`.
pub fn difference_tiles(a: &Picture, b: &Picture, scale: f32, exposure: Exposure) -> [Titled; 2] {
    let shown = |share: f32| colour(share) / exposure.factor();
    let picture =
        Picture { width: a.width, height: a.height, pixels: differences(a, b).map(|d| shown(d / scale)).collect() };
    let height = (a.height / 12).clamp(8, 24).min(a.height);
    let legend = Picture::from_fn(a.width, height, |x, _| shown(2.0 * (x as f32 + 0.5) / a.width as f32 - 1.0));
    [
        Titled { picture, title: "difference".into(), note: String::new() },
        Titled {
            picture: legend,
            title: format!("−{scale} … 0 … +{scale}"),
            note: "W/(m² sr), mean of the channels".into(),
        },
    ]
}

impl<'a> From<&'a Titled> for Tile<'a> {
    /// At the sheet's exposure.
    fn from(Titled { picture, title, note }: &'a Titled) -> Self {
        Tile { picture: Some(picture), title: title.clone(), note: note.clone(), gain: 1.0 }
    }
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
        let [Titled { picture, .. }, _] = difference_tiles(&a, &b, 1.0, Exposure { stops: 0.0 });
        let [darker, equal, brighter] = [0, 1, 2].map(|x| picture.pixels[x]);
        assert!(darker.z > darker.x && brighter.x > brighter.z);
        assert_eq!(equal.x, equal.z);
    }

    #[test]
    fn the_scale_is_a_round_number_above_most_differences() {
        let a = Picture::from_fn(100, 1, |x, _| Rgb::splat(x as f32 * 0.0033));
        let b = Picture::new(100, 1);
        assert!((difference_scale(&a, &b) - 0.5).abs() < 1e-6);
        assert_eq!(difference_scale(&a, &a), 1.0);
    }
}
