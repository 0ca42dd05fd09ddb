//! Verdicts on simulated pictures: noise agrees as often as stated, real differences are found, rare light is no
//! difference.

use halflight::light::Rgb;
use halflight::pictures::Picture;
use halflight::rays::sobol::hash;
use halflight_study::compare::{Answer, Mean, judge};

const SIDE: usize = 24;

/// An answer whose noise counts as normal.
fn known(value: impl Fn(usize) -> f32, noise: f32) -> Answer {
    let picture = Picture::from_fn(SIDE, SIDE, |x, y| Rgb::splat(value(y * SIDE + x)));
    let n = (SIDE * SIDE) as f64;
    let mean = picture.pixels.iter().map(|p| f64::from(p.x)).sum::<f64>() / n;
    Answer {
        noise: Picture::filled(SIDE, SIDE, Rgb::splat(noise)),
        means: vec![Mean { value: [mean; 3], noise: [f64::from(noise) / n.sqrt(); 3], systematic: [0.0; 3] }],
        freedom: f64::INFINITY,
        picture,
        ..Answer::default()
    }
}

/// A stream of numbers uniform in 0..1.
struct Stream(u32);

impl Stream {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(1);
        let bits = hash(self.0, 0x51ed_270b);
        (f64::from(bits) + 0.5) / 4_294_967_296.0
    }

    /// Number of events that arrive at rate 1 in this time.
    fn poisson(&mut self, time: f64) -> u32 {
        let (mut left, mut events) = (time + self.next().ln(), 0);
        while left > 0.0 {
            events += 1;
            left += self.next().ln();
        }
        events
    }
}

const SAMPLES: f64 = 1000.0;

/// The light of a hit from a number uniform in 0..1, and its mean.
type Weight = (fn(f64) -> f64, f64);

/// All hits alike.
const ALIKE: Weight = (|_| 1.0, 1.0);

/// Most of the light in few of the hits; mean 0.01^0.7 (1.01^0.3 - 0.01^0.3) / 0.3.
const MIXED: Weight = (|u| (0.01 / (0.01 + u)).powf(0.7), 0.099_767);

/// What a path tracer reports of a picture of mean `mean(k)` whose samples find light of `weight(u)`, u uniform in
/// 0..1, or none: few of [`SAMPLES`] do.
fn traced(stream: &mut Stream, mean: impl Fn(usize) -> f64, (weight, typical): Weight) -> Answer {
    let (mut values, mut errors) = (Vec::new(), Vec::new());
    let mut largest = 0.0_f64;
    for k in 0..SIDE * SIDE {
        let hits = stream.poisson(SAMPLES * mean(k) / typical);
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..hits {
            let light = weight(stream.next());
            sum += light;
            squares += light * light;
            largest = largest.max(light);
        }
        values.push(sum / SAMPLES);
        errors.push(((squares - sum * sum / SAMPLES) / (SAMPLES * (SAMPLES - 1.0))).sqrt());
    }
    let n = values.len() as f64;
    let noise = errors.iter().map(|e| e * e).sum::<f64>().sqrt() / n;
    let picture =
        |of: &[f64]| Picture { width: SIDE, height: SIDE, pixels: of.iter().map(|&v| Rgb::splat(v as f32)).collect() };
    Answer {
        picture: picture(&values),
        noise: picture(&errors),
        means: vec![Mean { value: [values.iter().sum::<f64>() / n; 3], noise: [noise; 3], systematic: [0.0; 3] }],
        freedom: f64::INFINITY,
        sample: Some(Picture::filled(SIDE, SIDE, Rgb::splat((largest / SAMPLES) as f32))),
        ..Answer::default()
    }
}

fn everywhere() -> Picture {
    Picture::filled(SIDE, SIDE, Rgb::ONE)
}

/// A picture with a bright, a dim and a nearly dark part: 100, 3 and 0.03 hits a pixel for hits of weight 1.
fn uneven(k: usize) -> f64 {
    match k % SIDE {
        0..8 => 0.1,
        8..16 => 0.003,
        _ => 0.000_03,
    }
}

#[test]
fn rare_light_is_no_difference() {
    // Of 200 equal pairs at most 2 may differ on average: more than 7 has a probability of 1e-3.
    for (number, weight) in [ALIKE, MIXED].into_iter().enumerate() {
        let mut stream = Stream(1 << 20 << number);
        let differ = |_: &u32| {
            let a = traced(&mut stream, uneven, weight);
            let exact = known(|k| uneven(k) as f32, 0.0);
            !judge(&a, &exact, &everywhere()).whole.agree
        };
        let count = (0..200).filter(differ).count();
        assert!(count <= 7, "weights {number}: {count} of 200");
    }
}

#[test]
fn a_normal_test_would_call_rare_light_different() {
    // What the bounds are for: the same pictures, their noise taken for normal.
    let mut stream = Stream(5);
    let differ = |_: &u32| {
        let mut a = traced(&mut stream, uneven, ALIKE);
        a.sample = None;
        let exact = known(|k| uneven(k) as f32, 0.0);
        !judge(&a, &exact, &everywhere()).whole.agree
    };
    assert!((0..50).filter(differ).count() > 25);
}

#[test]
fn rare_light_that_differs_by_five_percent_is_found() {
    // 20,000 hits in all: the mean is known to 0.7 %, and 5 % is more than the 4 errors or so that are allowed.
    let mut stream = Stream(77);
    let found = |_: &u32| {
        let a = traced(&mut stream, |k| 1.05 * uneven(k), ALIKE);
        let b = traced(&mut stream, uneven, ALIKE);
        let exact = known(|k| uneven(k) as f32, 0.0);
        assert!(judge(&b, &exact, &everywhere()).means_agree);
        !judge(&a, &exact, &everywhere()).whole.agree
    };
    assert_eq!((0..20).filter(found).count(), 20);
}

#[test]
fn light_missing_from_one_bright_pixel_is_found() {
    let mut stream = Stream(99);
    let mut a = traced(&mut stream, uneven, ALIKE);
    a.picture.pixels[3 + 10 * SIDE] = Rgb::ZERO;
    let exact = known(|k| uneven(k) as f32, 0.0);
    assert_eq!(judge(&a, &exact, &everywhere()).failing_pixels, 1);
}

#[test]
fn noise_agrees_and_a_shifted_pixel_does_not() {
    let mut stream = Stream(3);
    let wobbles: Vec<f32> = (0..SIDE * SIDE).map(|_| (12f64.sqrt() * (stream.next() - 0.5)) as f32).collect();
    let noisy = known(|k| 1.0 + 0.01 * wobbles[k], 0.01);
    assert!(judge(&noisy, &known(|_| 1.0, 0.0), &everywhere()).whole.agree);
    let shifted = known(|k| if k == 100 { 1.1 } else { 1.0 }, 0.0);
    let pair = judge(&noisy, &shifted, &everywhere());
    assert_eq!((pair.whole.agree, pair.failing_pixels), (false, 1));
    // Too small for any pixel, but not for the mean.
    let pair = judge(&noisy, &known(|_| 1.004, 0.0), &everywhere());
    assert_eq!((pair.whole.agree, pair.failing_pixels), (false, 0));
}

#[test]
fn an_order_that_differs_is_named() {
    let mean = |value: f64| Mean { value: [value; 3], noise: [0.001; 3], systematic: [0.0; 3] };
    let [mut a, mut b] = [known(|_| 1.0, 0.01), known(|_| 1.0, 0.01)];
    a.means = vec![mean(1.0), mean(0.5), mean(0.3), mean(0.0)];
    b.means = vec![mean(1.0), mean(0.5), mean(0.31), mean(0.0)];
    let pair = judge(&a, &b, &everywhere());
    assert!(pair.means_agree && !pair.whole.agree);
    let verdicts: Vec<bool> = pair.orders.iter().map(|o| o.means.agree).collect();
    assert_eq!(verdicts, [true, false, true]);
    assert!((pair.orders[1].means.relative - (0.3 - 0.31) / 0.305).abs() < 1e-12);
    // Explained by the patches of one, but not between methods on the same patches.
    a.means[2].systematic = [0.02; 3];
    a.systematic = Some(Picture::new(SIDE, SIDE));
    assert!(judge(&a, &b, &everywhere()).whole.agree);
    b.systematic.clone_from(&a.systematic);
    assert!(!judge(&a, &b, &everywhere()).whole.agree);
}
