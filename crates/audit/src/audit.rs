//! The audit of a picture: sampling until its error is told, and all that is told.
//!
//! Every round has more samples than all before, as many as the standard error of the round before asks for. A picture
//! is judged after a round by all samples so far. Rounds end by what they find, which biases an error that is told only
//! just by a small part of its standard error; tests hold the scores of many audits against the normal distribution.
//!
//! Not handled: pixels that see emission, as in the errors of all pictures here; what no path has found.

use std::ops::Range;
use std::sync::Arc;
use std::time::Instant;

use glam::DVec3;
use halflight_team::agree;

use crate::blocks::{Blocks, Look, Sums};
use crate::causes::{Cause, Evidence, clear_of_others};
use crate::crossed::{Estimated, PairMean, PixelMean, SquaredError};
use crate::estimates::{Estimates, GROUPS};
use crate::paths::Paths;
use halflight::direct::{Lights, Luminaires, TOLERABLE};
use halflight::light::Transport;
use halflight::patches::Patches;
use halflight::pictures::Picture;
use halflight::rays::purpose::Purpose;
use halflight::render::Watch;
use halflight::scene::Scene;
use halflight::surfaces::Geometry;

/// Patches that choose by which luminaires points are lit; no light is read from them.
const PATCHES: usize = 1000;
/// A round has so many times the samples of all before at least, and at most.
const ROUND: (f64, f64) = (1.5, 4.0);
/// Samples of a pixel in the mean at most, where no time is given.
const MOST_SAMPLES: f64 = 8192.0;
/// Standard errors of the square within which the error is certain.
pub const SURE: f64 = 3.0;
/// Tiles along the longer side of the picture, for the list of where.
const TILES: usize = 8;
/// Tiles that are listed at most, and the share of the squared error that one has at least.
const LISTED: usize = 5;
const WORTH_LISTING: f64 = 0.01;

/// What an audit aims at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AuditGoal {
    /// Standard error of the relative RMS error, as a share of it.
    pub resolve: f64,
    /// An error that is certainly below this is not resolved further.
    pub tolerance: f64,
    /// Ends where the error is certainly at most this or certainly more, in place of the two above.
    pub at_most: Option<f64>,
    /// Begins no round that would end after so many seconds of sampling.
    pub seconds: Option<f64>,
    /// Chooses the samples.
    pub seed: u32,
}

impl Default for AuditGoal {
    fn default() -> AuditGoal {
        AuditGoal { resolve: 0.1, tolerance: 0.01, at_most: None, seconds: None, seed: 0 }
    }
}

/// Whether an error is at most what was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// It certainly is.
    Within,
    /// It certainly is not.
    Above,
    /// Both are possible.
    Open,
}

impl AuditGoal {
    /// Whether an error is enough known.
    fn is_met(&self, error: &SquaredError) -> bool {
        let squared = error.squared;
        match self.at_most {
            Some(most) => verdict(error, most) != Verdict::Open,
            None => squared.standard_error <= 2.0 * self.resolve * squared.value || error.at(SURE) <= self.tolerance,
        }
    }

    /// The standard error of the square that would do, if the square is what it seems to be.
    fn needed(&self, error: &SquaredError) -> f64 {
        let squared = error.squared.value.max(0.0);
        match self.at_most {
            Some(most) => (squared - most * most).abs() / SURE,
            None => (2.0 * self.resolve * squared).max((self.tolerance.powi(2) - squared) / SURE),
        }
    }
}

/// Whether an error is at most `most`, by [`SURE`] standard errors of its square.
pub fn verdict(error: &SquaredError, most: f64) -> Verdict {
    if error.at(SURE) <= most {
        Verdict::Within
    } else if error.at(-SURE) > most {
        Verdict::Above
    } else {
        Verdict::Open
    }
}

/// Why there is no audit.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum AuditError {
    /// A pixel of the picture is no number.
    #[error("the picture has the value {value} at column {x}, row {y}")]
    #[diagnostic(
        code(halflight::audit::value),
        help("a picture with such a pixel has no error: find out where it is from")
    )]
    NotFinite {
        /// The pixel's channels.
        value: halflight::light::Rgb,
        /// Column, 0 on the left.
        x: usize,
        /// Row, 0 on top.
        y: usize,
    },
    /// The picture has no pixels.
    #[error("the picture has no pixels")]
    #[diagnostic(code(halflight::audit::empty), help("check that it is the right file"))]
    Empty,
    /// No sample found light on what the picture counts.
    #[error("no path found any light in the {pixels} pixels that see no luminaire, so no error can be relative to it")]
    #[diagnostic(
        code(halflight::audit::dark),
        help("check the scene, its mode and its camera; `halflight trace` shows what paths find")
    )]
    Dark {
        /// How many pixels count.
        pixels: usize,
    },
    /// Paths do not end.
    #[error(
        "paths carry light on without an end: the bounce series diverges, or nearly, so there is no picture to judge by"
    )]
    #[diagnostic(
        code(halflight::audit::endless),
        help("smaller --alpha or --tau converge; `halflight bounces` shows the series")
    )]
    Endless,
}

/// Light of the picture less that of the scene, over the pixels that count, relative to that of the scene.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct MeanError {
    /// Channels together.
    pub total: Estimated,
    /// Channel by channel; none where the scene shows none.
    pub channels: [Option<Estimated>; 3],
}

/// A part of the picture that has much of its error.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Part {
    /// Columns, from 0 on the left.
    pub columns: Range<usize>,
    /// Rows, from 0 on top.
    pub rows: Range<usize>,
    /// Its share of the squared error.
    pub share: f64,
    /// Light of the picture less that of the scene there, relative to that of the scene.
    pub mean: Estimated,
}

/// What is told of a picture.
#[derive(Clone, Debug)]
pub struct Audit {
    /// Its squared relative error.
    pub error: SquaredError,
    /// Whether it is brighter or darker.
    pub mean: MeanError,
    /// What would explain it.
    pub causes: Vec<Cause>,
    /// Where most of it is.
    pub parts: Vec<Part>,
    /// Picture less scene, W/(m² sr), block by block where it is certain; black elsewhere.
    pub signed: Picture,
    /// RMS error, W/(m² sr), block by block where it is certain; black elsewhere.
    pub squared: Picture,
    /// The means of all samples of every pixel that counts: a noisy picture of the scene.
    pub estimate: Picture,
    /// Standard error of that.
    pub standard_error: Picture,
    /// 1 where pixels count.
    pub mask: Picture,
    /// Whether the goal was met.
    pub met: bool,
    /// Samples of a pixel that counts, in the mean.
    pub samples: f64,
    /// Rays cast.
    pub rays: u64,
    /// Seconds to prepare the scene, and to sample.
    pub seconds: [f64; 2],
}

/// Tells the error of a picture of a scene in a mode, seen by its camera.
///
/// # Errors
/// A picture that is none, a scene without light, a series that diverges.
pub fn audit(
    scene: &Scene,
    transport: Transport,
    picture: &Picture,
    goal: &AuditGoal,
    watch: &dyn Watch,
) -> Result<Audit, AuditError> {
    check(picture)?;
    let clock = Instant::now();
    watch.begin("lights", 1);
    let lights = lights(scene, transport);
    let seed = Purpose::Audit.seed(goal.seed);
    let mut estimates = Estimates::new(Paths::new(&lights, picture.size()), picture.size(), seed);
    let prepared = agree(|| clock.elapsed().as_secs_f64());
    let sampled = Instant::now();
    let elapsed = || agree(|| sampled.elapsed().as_secs_f64());
    let mut samples = GROUPS as f64;
    let (error, met) = loop {
        watch.begin("audit", picture.height as u64);
        estimates.extend(samples, |done| watch.tick(done));
        if estimates.cut > 0 {
            return Err(AuditError::Endless);
        }
        let error = judge(picture, &estimates).ok_or(AuditError::Dark { pixels: estimates.counted().count() })?;
        let met = goal.is_met(&error);
        let more = more(goal, &error, elapsed());
        samples = more * estimates.mean_samples();
        if met || more < 1.1 || goal.seconds.is_none() && estimates.mean_samples() >= MOST_SAMPLES {
            break (error, met);
        }
    };
    let seconds = [prepared, elapsed()];
    Ok(told(picture, &estimates, error, met, seconds))
}

/// How many times as many samples the next round ends with.
fn more(goal: &AuditGoal, error: &SquaredError, elapsed: f64) -> f64 {
    let needed = goal.needed(error);
    let (least, most) = ROUND;
    let wanted = if needed > 0.0 { (error.squared.standard_error / needed).clamp(least, most) } else { most };
    // Sampling takes as long as there are samples.
    let in_time = goal.seconds.map_or(f64::INFINITY, |seconds| seconds / elapsed.max(1e-9));
    wanted.min(in_time)
}

/// The lights of a scene in a mode.
fn lights(scene: &Scene, transport: Transport) -> Lights {
    let geometry = Geometry::new(scene.clone());
    let patches = Arc::new(Patches::cut(&geometry, PATCHES));
    let luminaires = Arc::new(Luminaires::new(&geometry.scene));
    Lights::new(&geometry, &patches, &luminaires, scene.transports(transport), TOLERABLE)
}

fn check(picture: &Picture) -> Result<(), AuditError> {
    let Some(k) = picture.pixels.iter().position(|pixel| !pixel.is_finite()) else {
        return if picture.pixels.is_empty() { Err(AuditError::Empty) } else { Ok(()) };
    };
    let (value, x, y) = (picture.pixels[k], k % picture.width, k / picture.width);
    Err(AuditError::NotFinite { value, x, y })
}

fn judge(picture: &Picture, estimates: &Estimates) -> Option<SquaredError> {
    let groups: Vec<(DVec3, [DVec3; GROUPS])> =
        estimates.counted().map(|k| (picture.pixels[k].as_dvec3(), estimates.of(k))).collect();
    SquaredError::of(groups.iter().map(|(d, own)| (*d, &own[..])))
}

/// All that is told.
fn told(picture: &Picture, estimates: &Estimates, error: SquaredError, met: bool, seconds: [f64; 2]) -> Audit {
    let mut found = [0, 1].map(|_| Picture::new(picture.width, picture.height));
    let mut sums = vec![Sums::default(); picture.pixels.len()];
    let (mut light, mut apart, mut variance) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
    for k in estimates.counted() {
        let (d, groups) = (picture.pixels[k].as_dvec3(), estimates.of(k));
        let mean = PixelMean::of(&groups);
        let squared = PairMean::of(&groups, |a, b| (d - a).dot(d - b));
        sums[k] = Sums::of(d, &mean, squared.value, squared.variance);
        found[0].pixels[k] = mean.mean.as_vec3();
        found[1].pixels[k] = mean.variance.map(f64::sqrt).as_vec3();
        (light, apart, variance) = (light + mean.mean, apart + d - mean.mean, variance + mean.variance);
    }
    let clear = clear_of_others(&estimates.counts, picture.width);
    let squared = sums.iter().zip(&clear).filter(|(_, is_clear)| **is_clear).map(|(own, _)| own.squared).sum();
    let evidence = Evidence { picture, counts: &clear, estimates: |k| estimates.of(k), squared };
    let blocks = Blocks::new(picture.size(), sums);
    let whole = blocks.whole();
    let channel = |c: usize| (light[c] > 0.0).then(|| relative(apart[c], light[c], variance[c]));
    let [estimate, standard_error] = found;
    let shown = |own: &bool| halflight::light::Rgb::splat(f32::from(u8::from(*own)));
    Audit {
        error,
        mean: MeanError { total: mean_of(&whole), channels: [0, 1, 2].map(channel) },
        causes: evidence.causes(),
        parts: parts(&blocks, picture),
        signed: blocks.map(Look::Signed),
        squared: blocks.map(Look::Squared),
        estimate,
        standard_error,
        mask: Picture { pixels: estimates.counts.iter().map(shown).collect(), ..*picture },
        met,
        samples: estimates.mean_samples(),
        rays: estimates.rays,
        seconds,
    }
}

/// A difference over light that is as uncertain as it.
fn relative(apart: f64, light: f64, variance: f64) -> Estimated {
    let value = apart / light;
    Estimated { value, standard_error: (1.0 + value).abs() * variance.sqrt() / light }
}

fn mean_of(sums: &Sums) -> Estimated {
    relative(sums.apart.element_sum(), sums.light, sums.variance)
}

/// The tiles of a coarse grid with the largest shares of the squared error that are certain.
fn parts(blocks: &Blocks, picture: &Picture) -> Vec<Part> {
    let whole = blocks.whole();
    let side = picture.width.max(picture.height).div_ceil(TILES).max(1);
    let tiles = |length: usize| (0..length).step_by(side).map(move |at| at..(at + side).min(length));
    let all = tiles(picture.height).flat_map(|rows| tiles(picture.width).map(move |columns| (columns, rows.clone())));
    let mut parts: Vec<Part> = all
        .filter_map(|(columns, rows)| {
            let sums = blocks.within(columns.clone(), rows.clone());
            let share = sums.squared / whole.squared;
            let is_certain = sums.squared > SURE * sums.variances.stated().sqrt() && share > WORTH_LISTING;
            is_certain.then(|| Part { columns, rows, share, mean: mean_of(&sums) })
        })
        .collect();
    parts.sort_by(|a, b| b.share.total_cmp(&a.share));
    parts.truncate(LISTED);
    parts
}
