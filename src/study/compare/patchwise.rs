//! The patch methods' ladder: each rung twice as fine in patches, rays and samples, as long as the next fits the time.
//!
//! The best rung is repeated with independent scramblings for its noise, and with a quarter of the patches for its
//! systematic error: an error of first order in patch size halves with the size, one of second order falls to a
//! quarter, so the difference of the two bounds what is left from above in either case. It is averaged over a window
//! of pixels, because the difference of two noisy pictures is noisy itself.

use std::time::Instant;

use super::{Estimate, Method, ORDERS};
use crate::form_factors::Sampling;
use crate::image::{Fields, GatherSampling, Picture};
use crate::light::{Light, Rgb, Transport};
use crate::scene::Scene;
use crate::solve::{Diverges, RaySettings, Settings, Shooting, ShootingSettings, neumann};
use crate::study::pipeline::{Prepared, Silent, assemble, picture, prepare, without_luminaires};
use crate::study::shoot::{assembled_shooter, ray_shooter};

/// How fine a patch method works.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rung {
    /// About how many patches.
    pub patches: usize,
    /// Rays a patch.
    pub rays: u32,
    /// Camera rays a pixel; each with 4 rays to a luminaire and 8 over the hemisphere.
    pub camera: u32,
}

/// Unshot share, and tail of the series, that count as none beside the errors compared.
const REST: f64 = 1e-4;
/// Repetitions for the standard error.
const REPLICAS: u32 = 4;
/// Half the window, in pixels, over which variances and systematic errors are averaged.
const WINDOW: usize = 3;

impl Rung {
    /// The k-th rung.
    pub fn new(k: u32) -> Rung {
        Rung {
            patches: 250 << k,
            rays: (64 << k).min(1 << 16),
            camera: 2 << k,
        }
    }
}

/// Climbs while the time of a rung, as foreseen from the last, is below `seconds`; the first rung always counts.
///
/// # Errors
/// [`Diverges`] where the series does.
pub fn climb(
    scene: &Scene,
    method: Method,
    transport: Transport,
    size: (usize, usize),
    seed: u32,
    seconds: f64,
) -> Result<Vec<(Rung, Estimate)>, Diverges> {
    let mut ladder: Vec<(Rung, Estimate)> = Vec::new();
    for k in 0..12 {
        // A rung costs some two and a half times the one before.
        if ladder
            .last()
            .is_some_and(|(_, e)| 2.5 * e.seconds > seconds)
        {
            break;
        }
        let rung = Rung::new(k);
        ladder.push((rung, run(scene, method, transport, size, seed, rung)?));
    }
    Ok(ladder)
}

/// Repeats a rung with other seeds and with a quarter of the patches; the mean of the repetitions, with its errors.
///
/// # Errors
/// [`Diverges`] where the series does.
pub fn replicate(
    scene: &Scene,
    method: Method,
    transport: Transport,
    size: (usize, usize),
    seed: u32,
    rung: Rung,
    mask: &Picture,
) -> Result<Estimate, Diverges> {
    let coarse = Rung {
        patches: (rung.patches / 4).max(1),
        ..rung
    };
    let seeds = || (1..=REPLICAS).map(|r| seed.wrapping_add(r.wrapping_mul(0x9e37_79b9)));
    let repeat = |rung| -> Result<Vec<Estimate>, Diverges> {
        seeds()
            .map(|s| run(scene, method, transport, size, s, rung))
            .collect()
    };
    let (fine, coarse) = (repeat(rung)?, repeat(coarse)?);
    let pictures = |of: &[Estimate]| of.iter().map(|e| e.picture.clone()).collect::<Vec<_>>();
    let (fine_pictures, coarse_pictures) = (pictures(&fine), pictures(&coarse));
    let (mean, coarse_mean) = (average(&fine_pictures), average(&coarse_pictures));
    let systematic = smoothed(&combine(&mean, &coarse_mean, |a, b| a - b), WINDOW, mask);
    let order = |n: usize| fine.iter().map(|e| e.orders[n].clone()).collect::<Vec<_>>();
    let orders: Vec<Vec<Picture>> = (0..=ORDERS).map(order).collect();
    Ok(Estimate {
        seconds: fine.iter().map(|e| e.seconds).sum(),
        effort: format!("mean of {REPLICAS}: {}", fine[0].effort),
        mean_error: mean_error(&fine_pictures, &systematic, mask),
        noise: Some(standard_error(&fine_pictures, &mean)),
        // What the series or the shooting left out counts too.
        systematic: Some(combine(&systematic, &mean, |v, m| {
            v.abs() + REST as f32 * m
        })),
        orders: orders.iter().map(|o| average(o)).collect(),
        order_noise: Some(
            orders
                .iter()
                .map(|o| standard_error(o, &average(o)))
                .collect(),
        ),
        picture: mean,
    })
}

/// One rung from scratch: rays, patches, the solution, and the pictures of its generations.
fn run(
    scene: &Scene,
    method: Method,
    transport: Transport,
    size: (usize, usize),
    seed: u32,
    rung: Rung,
) -> Result<Estimate, Diverges> {
    let start = Instant::now();
    let p = prepare(scene.clone(), rung.patches);
    let generations = solve(&p, method, transport, seed, rung)?;
    let orders = pictures(&p, transport, size, seed, rung, &generations);
    let total = orders
        .iter()
        .skip(1)
        .fold(orders[0].clone(), |sum, o| combine(&sum, o, |a, b| a + b));
    Ok(Estimate {
        seconds: start.elapsed().as_secs_f64(),
        effort: format!(
            "{} patches, {} rays a patch, {} camera rays a pixel",
            p.patches.len(),
            rung.rays,
            rung.camera
        ),
        picture: total,
        noise: None,
        systematic: None,
        orders: orders.into_iter().take(ORDERS + 1).collect(),
        order_noise: None,
        mean_error: [0.0; 3],
    })
}

/// Patch light of every generation.
fn solve(
    p: &Prepared,
    method: Method,
    transport: Transport,
    seed: u32,
    rung: Rung,
) -> Result<Vec<Vec<Light>>, Diverges> {
    let sampling = Sampling {
        rays: rung.rays,
        seed,
        ..Sampling::default()
    };
    let shooting = ShootingSettings {
        unshot: REST,
        ..ShootingSettings::default()
    };
    let all = |s: &Shooting| (0..s.generations()).map(|n| s.generation(n)).collect();
    if method == Method::ShootingRays {
        let settings = RaySettings {
            rays: rung.rays.saturating_mul(p.patches.len() as u32),
            seed,
            ..RaySettings::default()
        };
        let shooter = ray_shooter(p, transport, settings);
        let mut shooting = Shooting::new(&shooter, shooting)?;
        shooting.run(|_| ())?;
        return Ok(all(&shooting));
    }
    let (modes, _) = assemble(p, &[transport], &sampling, &Silent);
    if method == Method::ShootingAssembled {
        let shooter = assembled_shooter(&modes[0]);
        let mut shooting = Shooting::new(&shooter, shooting)?;
        shooting.run(|_| ())?;
        return Ok(all(&shooting));
    }
    let settings = Settings {
        tolerance: REST,
        ..Settings::default()
    };
    Ok(neumann(&modes[0].operator, &settings)?.terms)
}

/// Pictures of bounces 0 to [`ORDERS`], then of all later ones together.
fn pictures(
    p: &Prepared,
    transport: Transport,
    size: (usize, usize),
    seed: u32,
    rung: Rung,
    generations: &[Vec<Light>],
) -> Vec<Picture> {
    let mut fields = vec![vec![Rgb::ZERO; p.patches.len()]; ORDERS + 1];
    fields[0] = without_luminaires(p, &generations[0]);
    for (n, generation) in generations.iter().enumerate().skip(1) {
        for (sum, l) in fields[n.min(ORDERS)].iter_mut().zip(generation) {
            *sum += l.invisible;
        }
    }
    let sampling = GatherSampling {
        camera: rung.camera,
        luminaire: 4,
        hemisphere: 8,
        seed,
    };
    let transports = p.scene.transports(transport);
    let parts = picture(
        p,
        &transports,
        &Fields::new(&fields),
        size,
        &sampling,
        &Silent,
    );
    let mut orders = vec![parts.emission];
    orders.extend(parts.indirect);
    orders[1] = combine(&orders[1], &parts.direct, |a, b| a + b);
    orders
}

fn combine(a: &Picture, b: &Picture, value: impl Fn(Rgb, Rgb) -> Rgb) -> Picture {
    Picture::from_fn(a.width, a.height, |x, y| {
        let k = y * a.width + x;
        value(a.pixels[k], b.pixels[k])
    })
}

fn map(a: &Picture, value: impl Fn(Rgb) -> Rgb) -> Picture {
    combine(a, a, |v, _| value(v))
}

fn average(pictures: &[Picture]) -> Picture {
    let sum = pictures[1..]
        .iter()
        .fold(pictures[0].clone(), |sum, p| combine(&sum, p, |a, b| a + b));
    sum.scaled(1.0 / pictures.len() as f32)
}

/// Standard error of the mean of repetitions, unbiased in its square; of a few repetitions, so rough for one pixel.
fn standard_error(pictures: &[Picture], mean: &Picture) -> Picture {
    let n = pictures.len() as f32;
    let apart = pictures
        .iter()
        .map(|p| combine(p, mean, |a, b| (a - b) * (a - b)))
        .reduce(|a, b| combine(&a, &b, |a, b| a + b));
    let variance = apart.map_or_else(|| mean.scaled(0.0), |a| a.scaled(1.0 / ((n - 1.0) * n)));
    map(&variance, |v| v.map(f32::sqrt))
}

/// Mean over a square window of pixels; only those of the mask count, so that a lamp's edge does not spread.
pub(super) fn smoothed(picture: &Picture, half: usize, mask: &Picture) -> Picture {
    let (width, height) = picture.size();
    Picture::from_fn(width, height, |x, y| {
        let rows = y.saturating_sub(half)..(y + half + 1).min(height);
        let columns = x.saturating_sub(half)..(x + half + 1).min(width);
        let around = rows.flat_map(|v| columns.clone().map(move |u| v * width + u));
        let counted = around.filter(|&k| mask.pixels[k].x >= 0.5);
        let (sum, count) = counted.fold((Rgb::ZERO, 0.0), |(sum, count), k| {
            (sum + picture.pixels[k], count + 1.0)
        });
        sum / f32::max(count, 1.0)
    })
}

/// Standard error of the masked mean from the repetitions' spread, and the systematic part of it.
fn mean_error(pictures: &[Picture], systematic: &Picture, mask: &Picture) -> [f64; 3] {
    let means: Vec<_> = pictures
        .iter()
        .map(|p| super::verdict::masked_mean(p, mask))
        .collect();
    let shift = super::verdict::masked_mean(systematic, mask);
    let n = means.len() as f64;
    [0, 1, 2].map(|c| {
        let mean = means.iter().map(|m| m[c]).sum::<f64>() / n;
        let variance = means.iter().map(|m| (m[c] - mean).powi(2)).sum::<f64>() / ((n - 1.0) * n);
        (variance + shift[c] * shift[c] + (REST * mean).powi(2)).sqrt()
    })
}
