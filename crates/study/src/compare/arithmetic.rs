//! Pictures as numbers: sums, means and spreads, pixel by pixel and over a mask.

use halflight::light::Rgb;
use halflight::pictures::{Picture, Size};

/// A picture from two, pixel by pixel.
pub(crate) fn combine(a: &Picture, b: &Picture, value: impl Fn(Rgb, Rgb) -> Rgb) -> Picture {
    let pairs = a.pixels.iter().zip(&b.pixels);
    Picture { width: a.width, height: a.height, pixels: pairs.map(|(&a, &b)| value(a, b)).collect() }
}

/// A picture from one.
pub(crate) fn map(a: &Picture, value: impl Fn(Rgb) -> Rgb) -> Picture {
    combine(a, a, |v, _| value(v))
}

/// Sum of at least one picture.
pub(crate) fn sum(pictures: &[Picture]) -> Picture {
    let first = pictures[0].clone();
    pictures[1..].iter().fold(first, |sum, p| combine(&sum, p, |a, b| a + b))
}

/// Mean of at least one picture.
pub(crate) fn average(pictures: &[Picture]) -> Picture {
    sum(pictures).scaled(1.0 / pictures.len() as f32)
}

/// Standard error of the mean of repetitions, unbiased in its square; of a few repetitions, so rough for one pixel.
pub(crate) fn standard_error(pictures: &[Picture], mean: &Picture) -> Picture {
    let n = pictures.len() as f32;
    let apart: Vec<Picture> = pictures.iter().map(|p| combine(p, mean, |a, b| (a - b) * (a - b))).collect();
    map(&sum(&apart), |v| (v / ((n - 1.0) * n)).map(f32::sqrt))
}

/// Numbers of the pixels that count.
pub(crate) fn counted(mask: &Picture) -> Vec<usize> {
    (0..mask.pixels.len()).filter(|&k| mask.pixels[k].x >= 0.5).collect()
}

/// The counted pixels in a square window about pixel k, itself included if it counts.
pub(crate) fn window(mask: &Picture, k: usize, half: usize) -> impl Iterator<Item = usize> {
    let Size { width, height } = mask.size();
    let (x, y) = (k % width, k / width);
    let rows = y.saturating_sub(half)..(y + half + 1).min(height);
    let columns = x.saturating_sub(half)..(x + half + 1).min(width);
    rows.flat_map(move |v| columns.clone().map(move |u| v * width + u)).filter(|&k| mask.pixels[k].x >= 0.5)
}

/// Mean over a square window of pixels; only those of the mask count, so that a lamp's edge does not spread.
pub(crate) fn smoothed(picture: &Picture, half: usize, mask: &Picture) -> Picture {
    let Size { width, height } = picture.size();
    Picture::from_fn(width, height, |x, y| {
        let start = (Rgb::ZERO, 0.0);
        let add = |(sum, count), k: usize| (sum + picture.pixels[k], count + 1.0);
        let (sum, count) = window(mask, y * width + x, half).fold(start, add);
        sum / f32::max(count, 1.0)
    })
}

/// Mean radiance of the pixels of a mask, per channel.
pub(crate) fn masked_mean(picture: &Picture, mask: &Picture) -> [f64; 3] {
    let chosen = counted(mask);
    let n = chosen.len().max(1) as f64;
    let sum = |c| -> f64 { chosen.iter().map(|&k| f64::from(picture.pixels[k][c])).sum() };
    [0, 1, 2].map(|c| sum(c) / n)
}

/// Standard error of the masked mean of pixels whose errors are independent, per channel.
pub(crate) fn masked_error(errors: &Picture, mask: &Picture) -> [f64; 3] {
    let chosen = counted(mask);
    let n = chosen.len().max(1) as f64;
    let square = |k: &usize, c| f64::from(errors.pixels[*k][c]).powi(2);
    [0, 1, 2].map(|c| chosen.iter().map(|k| square(k, c)).sum::<f64>().sqrt() / n)
}
