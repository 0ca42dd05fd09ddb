//! A picture and how far it may be off.

use std::fmt::{self, Display, Formatter};
use std::path::Path;

use crate::error::light_tracing::AtLeast;
use crate::form_factors::RowSums;
use crate::gather::Gathered;
use crate::operator::Bounds;
use crate::pictures::{Exposure, ImageError, NamedPicture, Picture, Shows, write_picture};
use crate::render::assembly::{Assembled, PatchLight, Seconds};
use crate::render::goal::Spent;
use crate::render::layers::{Apart, EmitterPower, Layer, named};
use crate::solve::{Solution, Verdict};

/// Estimated relative errors of a picture, and their root sum of squares.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub struct ErrorParts {
    /// Noise of F.
    pub form_factors: f64,
    /// Size of the patches.
    pub patches: f64,
    /// What the series left out, a bound.
    pub truncation: f64,
    /// Sampling of the gather pass, and its fit between irradiance points.
    pub gather: f64,
    /// Square root of the sum of their squares.
    pub total: f64,
    /// Of light as emitted, over the RMS of what the picture shows of it: how much of pixels emitters cover. No part of
    /// the total, which is over the pixels that see no luminaire.
    pub emission: f64,
}

impl ErrorParts {
    /// Sets the total.
    pub(crate) fn sum(mut self) -> ErrorParts {
        let parts = [self.form_factors, self.patches, self.truncation, self.gather];
        self.total = parts.iter().map(|p| p * p).sum::<f64>().sqrt();
        self
    }
}

/// What ended the work on a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ended {
    /// The error was small enough, more effort helped too little, or the effort was given.
    #[default]
    ByItself,
    /// The time was over, or what was left of it was too short for more.
    ByTime,
    /// The gather pass took as many rays as it may without a time.
    ByRays,
    /// As [`Ended::ByItself`], but walks of light show another picture.
    Contradicted,
}

/// Whether the light on patches is returned with a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum LightOnPatches {
    /// In [`Rendered::light`].
    Returned,
    /// Only the picture is.
    #[default]
    LeftOut,
}

/// A picture of one mode, and how far it may be off.
pub struct Rendered {
    /// Linear radiance.
    pub picture: Picture,
    /// Standard error of every pixel from the gather pass.
    pub standard_error: Picture,
    /// The picture taken apart, where that was requested: the emitters, then the bounces, each of which add up to it.
    pub layers: Vec<Layer>,
    /// The powers of the emitters, where their light is kept apart.
    pub emitters: Vec<EmitterPower>,
    /// The light on patches that the picture was read from, where that was requested.
    pub light: Option<PatchLight<'static>>,
    /// Estimated errors of the picture.
    pub error: ErrorParts,
    /// What ended the work on it.
    pub ended: Ended,
    /// Where the time went.
    pub seconds: Seconds,
    /// Patches at last.
    pub patches: usize,
    /// Rays cast in all.
    pub rays: u64,
    /// Proved bounds on the spectral radius.
    pub radius: Bounds,
    /// How the series behaves.
    pub verdict: Verdict,
    /// Row sums of F; none where no ray was needed.
    pub row_sums: Option<RowSums>,
    /// Share of the camera's rays that met the black back of a one-sided face.
    pub backs: f64,
    /// Share of the camera's rays that met a side that reflects.
    pub sees: f64,
}

impl Rendered {
    /// A picture of a solution, of whose errors nothing is known.
    pub(crate) fn new(
        mode: &Assembled,
        solution: &Solution,
        mut gathered: Gathered,
        apart: Apart,
        mut spent: Spent,
    ) -> Rendered {
        spent.seconds.sum();
        let layers = std::mem::take(&mut gathered.layers);
        Rendered {
            picture: gathered.total(),
            layers: named(mode, apart, layers),
            emitters: Vec::new(),
            light: None,
            error: ErrorParts::default(),
            ended: Ended::ByItself,
            seconds: spent.seconds,
            patches: mode.patches().len(),
            rays: spent.rays + gathered.rays,
            radius: solution.radius,
            verdict: solution.verdict,
            row_sums: mode.row_sums,
            backs: gathered.backs,
            sees: gathered.sees,
            standard_error: gathered.standard_error,
        }
    }

    /// The picture that states the smaller error, of this one and a later one, with the work of both.
    pub(crate) fn or(self, later: Rendered) -> Rendered {
        let (seconds, rays) = (self.seconds.plus(&later.seconds), self.rays + later.rays);
        let best = if later.error.total <= self.error.total { later } else { self };
        Rendered { seconds, rays, ..best }
    }

    /// Whether no pixel has any light though the camera sees a surface's reflecting side.
    pub(crate) fn is_black(&self) -> bool {
        let dark = |pixel: &crate::light::Rgb| *pixel == crate::light::Rgb::ZERO;
        self.sees > 0.0 && self.picture.pixels.iter().all(dark)
    }

    /// States an error that walks of light show where it is certain and more than is stated; `signal` is the RMS of the
    /// picture.
    pub(crate) fn contradict(&mut self, least: AtLeast, signal: f64) {
        let of = |squared: f64| if signal > 0.0 { squared.sqrt() / signal } else { f64::from(u8::from(squared > 0.0)) };
        if of(least.certain()) <= self.error.total {
            return;
        }
        let ErrorParts { form_factors, truncation, gather, .. } = self.error;
        let others = form_factors.powi(2) + truncation.powi(2) + gather.powi(2);
        self.error.patches = (of(least.squared).powi(2) - others).max(0.0).sqrt();
        self.error = self.error.sum();
        self.ended = Ended::Contradicted;
    }

    /// Why a picture's estimated error is above its tolerance; none where it is not.
    pub fn unmet(&self, tolerance: f64) -> Option<Unmet> {
        let error = self.error;
        if error.total.max(error.emission) <= tolerance {
            return None;
        }
        let why = match self.ended {
            _ if self.is_black() => Shortfall::Unseen,
            _ if error.total >= 1.0 => Shortfall::Unknown,
            Ended::Contradicted => Shortfall::Contradicted,
            Ended::ByTime => Shortfall::Time,
            Ended::ByRays => Shortfall::Rays,
            Ended::ByItself => Shortfall::Effort,
        };
        Some(Unmet { tolerance, error, why })
    }

    /// Writes the picture: `.exr` holds its radiances, `.png` what the eye is to see of them.
    ///
    /// # Errors
    /// Another extension, a picture without pixels, or a destination that cannot be written.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), ImageError> {
        write_picture(path, &self.picture, Exposure::default())
    }

    /// The layers by their names in files, with the standard errors of all where they are wanted.
    pub fn named_layers(&self, errors: Errors) -> Vec<NamedPicture<&Picture>> {
        let named = |name, shows, picture| NamedPicture { name, shows, picture };
        let with_errors = errors == Errors::Written;
        let mut layers = Vec::new();
        if with_errors {
            layers.push(named(String::new(), Shows::StandardError, &self.standard_error));
        }
        for Layer { kind, light, .. } in &self.layers {
            layers.push(named(kind.name(), Shows::Light, &light.picture));
            if with_errors {
                layers.push(named(kind.name(), Shows::StandardError, &light.standard_error));
            }
        }
        layers
    }
}

/// An estimated error that is above its tolerance.
#[derive(Clone, Copy, Debug)]
pub struct Unmet {
    /// The tolerance.
    pub tolerance: f64,
    /// The estimated errors.
    pub error: ErrorParts,
    /// What keeps them above it.
    pub why: Shortfall,
}

/// What keeps an estimated error above its tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shortfall {
    /// No ray found any light on what the camera sees, so the error is not known.
    Unseen,
    /// Few rays find the ways by which most of the light comes, so the error is not known.
    Unknown,
    /// Walks of light from what emits bring other light to the picture than it shows.
    Contradicted,
    /// The time was over.
    Time,
    /// As many rays were cast as are without a time.
    Rays,
    /// More effort lessened it too little.
    Effort,
}

impl Display for Unmet {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let Unmet { tolerance, error, why } = self;
        let parts = [
            (error.form_factors, "noise of F"),
            (error.patches, "the light read on patches"),
            (error.truncation, "the series' truncation"),
            (error.gather, "the gather pass"),
        ];
        let largest = parts.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
        let (part, name) = largest.unwrap_or_default();
        if error.total <= *tolerance {
            let [emission, tolerance] = [error.emission, *tolerance].map(|share| 100.0 * share);
            return write!(
                f,
                "estimated error of light as emitted {emission:.2} %, more than the {tolerance:.2} % asked for: outlines \
                 of what emits need more rays"
            );
        }
        let ended = match why {
            Shortfall::Unseen => {
                return f.write_str(
                    "the scene emits light, but no ray found any on what the camera sees: the error is not known",
                );
            }
            Shortfall::Unknown => {
                return write!(
                    f,
                    "the error is not known: most of the light comes by ways that few rays find ({name})"
                );
            }
            Shortfall::Contradicted => {
                return write!(
                    f,
                    "the error is at least {:.2} %, more than the {:.2} % asked for: walks of light from what emits bring \
                     other light to the picture than it shows",
                    100.0 * error.total,
                    100.0 * tolerance,
                );
            }
            Shortfall::Time => "when the time was over",
            Shortfall::Rays => "after as many rays as are cast where no time is given",
            Shortfall::Effort => "which more effort lessened too little",
        };
        write!(
            f,
            "estimated error {:.2} %, more than the {:.2} % asked for; most of it ({:.2} %) is {name}, {ended}",
            100.0 * error.total,
            100.0 * tolerance,
            100.0 * part,
        )
    }
}

/// Whether the standard errors of pixels are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Errors {
    /// As layers of their own.
    Written,
    /// Light alone.
    #[default]
    LeftOut,
}
