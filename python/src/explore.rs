//! Pages to play with, as the program's `explore` writes them.

use std::path::PathBuf;

use halflight::pictures::{ImageError, write_whole};
use halflight::render::Fineness;
use halflight_explore::{Counts, Limits, Page, PageEffort, PageError, TermsEffort, Words, page};
use pyo3::prelude::*;

use crate::errors::Raise;
use crate::running::run;
use crate::scene::{Run, Scene};

/// How much is done for a page: `halflight._explore.Effort`.
#[derive(FromPyObject)]
pub struct Effort {
    patches: usize,
    rays: u32,
    terms: usize,
    taus: usize,
    tolerance: f64,
    bytes: usize,
}

/// What a page holds: patches, cells, texels, lamps and bytes; its error between the taus that were solved; and the RMS
/// difference of its picture from a rendered one.
type Made = ([usize; 5], f64, Option<f64>);

/// Writes a page with a title and an attribution, and whether it opens with the story.
#[pyfunction]
pub fn explore(
    py: Python,
    scene: &Scene,
    file: PathBuf,
    words: (String, String, bool),
    effort: Effort,
    asked: Run,
) -> PyResult<Made> {
    let (title, attribution, story) = words;
    let words = Words { title, attribution, story };
    let limits = Limits { within: effort.tolerance, bytes: effort.bytes };
    let terms = TermsEffort {
        fineness: Fineness { patches: effort.patches, rays: effort.rays },
        taus: effort.taus,
        terms: effort.terms,
        seed: asked.seed,
        memory: asked.bytes(),
    };
    let effort = PageEffort { terms, limits };
    let made = run(py, asked.progress.as_ref(), |steps| page(&scene.scene, &effort, &words, steps))?;
    let Page { html, counts, tau_error, rms } = made.map_err(PageError::raise)?;
    write_whole(&file, html.as_bytes()).map_err(|error| ImageError::from(error).raise())?;
    let Counts { patches, cells, texels, lamps } = counts;
    Ok(([patches, cells, texels, lamps, html.len()], tau_error, rms))
}
