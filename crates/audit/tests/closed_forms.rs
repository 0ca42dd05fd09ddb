//! A closed room that emits 0.25 and reflects 0.5 everywhere shows 0.5 everywhere, so every picture's error is known.

use halflight::light::Rgb;
use halflight::pictures::Picture;

use crate::{assert_standard_normal, global, score, told};

/// The furnace, off by a share of a pattern that changes from pixel to pixel, and by a mean.
fn off(share: f32, mean: f32) -> Picture {
    let sign = |x: usize, y: usize| if (x + y).is_multiple_of(2) { share } else { -share };
    Picture::from_fn(16, 12, |x, y| Rgb::splat(0.5 * (1.0 + mean + sign(x, y))))
}

#[test]
fn scores_of_known_errors_are_standard_normal() {
    let (furnace, mode) = global("furnace");
    for (share, mean) in [(0.05, 0.0), (0.3, 0.0), (0.0, 0.08)] {
        let truth = f64::from(share * share + mean * mean);
        let all: Vec<_> = (0..32).map(|seed| told(&furnace, mode, &off(share, mean), 0.25, seed)).collect();
        assert!(all.iter().all(|own| own.met && own.error.pixels == 192));
        // A hundred pixels or so carry the error, so its variance is stated 1.15 times as large.
        let scores: Vec<f64> = all.iter().map(|own| score(own.error.squared, truth)).collect();
        assert_standard_normal(&scores, 0.35);
        let means: Vec<f64> = all.iter().map(|own| score(own.mean.total, f64::from(mean))).collect();
        assert_standard_normal(&means, 0.0);
    }
}

/// What is exact is not told to be off: its square is 0 but for chance, and nothing is on the maps.
#[test]
fn an_exact_picture_is_within_any_tolerance() {
    let (furnace, mode) = global("furnace");
    let all: Vec<_> = (0..16).map(|seed| told(&furnace, mode, &off(0.0, 0.0), 0.25, seed)).collect();
    let scores: Vec<f64> = all.iter().map(|own| score(own.error.squared, 0.0)).collect();
    assert_standard_normal(&scores, 0.35);
    for own in all {
        assert!(own.met && own.error.at(3.0) <= 0.01, "{:?}", own.error);
        assert!(own.signed.pixels.iter().chain(&own.squared.pixels).all(|shown| *shown == Rgb::ZERO));
    }
}

/// Its luminance is all there is: channels are told apart.
#[test]
fn channels_have_their_own_mean_errors() {
    let (furnace, mode) = global("furnace");
    let picture = Picture::filled(16, 12, 0.5 * Rgb::new(1.1, 1.0, 0.8));
    let own = told(&furnace, mode, &picture, 0.1, 3);
    for (channel, truth) in own.mean.channels.iter().zip([0.1, 0.0, -0.2]) {
        assert!(score(channel.expect("light"), truth).abs() < 5.0, "{channel:?} {truth}");
    }
}
