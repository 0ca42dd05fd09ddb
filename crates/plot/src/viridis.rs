//! The colour scale viridis, which rises evenly in lightness and keeps its order in grey and for readers with red-green
//! blindness (S. van der Walt, N. Smith 2015).
//!
//! Not handled: other scales; the eighth of a step that straight lines between eight colours are off by at most.

use crate::drawing::Colour;

/// The scale at even steps.
#[rustfmt::skip]
pub(crate) const VIRIDIS: [Colour; 8] = [
    [68, 1, 84], [70, 50, 127], [54, 92, 141], [39, 127, 143],
    [31, 162, 136], [74, 194, 110], [160, 219, 57], [254, 232, 37],
];

/// sRGB codes at a share of the scale, 0 to 1; those of the nearer end outside, of 0 for no number.
pub(crate) fn viridis(share: f64) -> Colour {
    let last = VIRIDIS.len() - 1;
    let at = if share > 0.0 { share.min(1.0) * last as f64 } else { 0.0 };
    let k = (at as usize).min(last - 1);
    let part = at - k as f64;
    let mix = |c: usize| f64::from(VIRIDIS[k][c]) * (1.0 - part) + f64::from(VIRIDIS[k + 1][c]) * part;
    [0, 1, 2].map(|c| mix(c).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_has_its_ends_and_grows_lighter() {
        assert_eq!([viridis(-1.0), viridis(f64::NAN), viridis(2.0)], [VIRIDIS[0], VIRIDIS[0], VIRIDIS[7]]);
        let grey = |c: Colour| 0.2126 * f64::from(c[0]) + 0.7152 * f64::from(c[1]) + 0.0722 * f64::from(c[2]);
        let all: Vec<f64> = (0..=100).map(|k| grey(viridis(f64::from(k) / 100.0))).collect();
        assert!(all.windows(2).all(|pair| pair[1] >= pair[0]), "{all:?}");
    }
}
