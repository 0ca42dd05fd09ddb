//! `--layers` and `--per`: pictures taken apart by lamps and by bounces, and where their layers go.
//!
//! An EXR file has the picture in its channels R, G and B and each layer under its name, `lamp.desk.R` or
//! `bounce.2.R`. PNG files have one picture each, so that layers are files of their own.

use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};

use crate::cli::error::CliError;
use crate::pictures::{Exposure, NamedPicture, is_exr, write_layers, write_picture};
use crate::render::{Apart, Layer, Rendered};

/// What pictures are taken apart into.
#[derive(Args, Debug)]
pub struct Layers {
    /// Keep these apart as layers of an EXR file, or PNG files of their own; each kind adds up to the picture
    #[arg(long, value_enum, value_delimiter = ',', value_name = "KIND,KIND")]
    pub layers: Vec<LayerChoice>,
    /// What light is kept apart by.
    #[command(flatten)]
    pub per: PerEmitter,
}

/// What light is kept apart by.
#[derive(Args, Debug)]
pub struct PerEmitter {
    /// Keep the light of every lamp apart: each object or material that emits, the sky, each light without area
    #[arg(long, value_enum, value_name = "WHAT")]
    pub per: Option<Per>,
}

/// What light may be kept apart by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Per {
    /// By lamps
    Luminaire,
}

/// A kind of layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum LayerChoice {
    /// Light that was reflected 0, 1, 2, ... times
    Bounces,
    /// The light of each lamp
    Luminaires,
}

impl PerEmitter {
    /// What light is taken apart into.
    pub fn apart(&self) -> Apart {
        Apart { emitters: self.per.is_some(), bounces: false }
    }
}

impl Layers {
    /// What light is taken apart into.
    pub fn apart(&self) -> Apart {
        let has = |choice| self.layers.contains(&choice);
        Apart {
            emitters: has(LayerChoice::Luminaires) || self.per.apart().emitters,
            bounces: has(LayerChoice::Bounces),
        }
    }
}

/// What names the standard error of a picture or a layer.
pub const STANDARD_ERROR: &str = "standard error";

/// Writes a picture with its layers and, where wanted, the standard error of all; returns the files.
pub fn write(
    path: &Path,
    found: &Rendered,
    exposure: Exposure,
    standard_error: bool,
) -> Result<Vec<PathBuf>, CliError> {
    if !is_exr(path) || (found.layers.is_empty() && !standard_error) {
        let mut files = vec![path.to_path_buf()];
        write_picture(path, &found.picture, exposure)?;
        for Layer { kind, light } in &found.layers {
            let own = beside(path, &kind.name());
            write_picture(&own, &light.picture, exposure)?;
            files.push(own);
        }
        return Ok(files);
    }
    let named = |name: String, picture| NamedPicture { name, picture };
    let mut layers = Vec::new();
    if standard_error {
        layers.push(named(STANDARD_ERROR.into(), &found.standard_error));
    }
    for Layer { kind, light } in &found.layers {
        layers.push(named(kind.name(), &light.picture));
        if standard_error {
            layers.push(named(format!("{}.{STANDARD_ERROR}", kind.name()), &light.standard_error));
        }
    }
    write_layers(path, &found.picture, &layers)?;
    Ok(vec![path.to_path_buf()])
}

/// The place of a layer's own file; what may not be in a file's name is replaced.
fn beside(path: &Path, layer: &str) -> PathBuf {
    let [stem, extension] = [path.file_stem(), path.extension()].map(|s| s.unwrap_or_default().to_string_lossy());
    let safe = |c: char| if c.is_alphanumeric() || "-_.+".contains(c) { c } else { '-' };
    let layer: String = layer.chars().map(safe).collect();
    path.with_file_name(format!("{stem}-{layer}.{extension}"))
}
