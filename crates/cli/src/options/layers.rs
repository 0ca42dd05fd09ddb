//! `--layers` and `--per`: what pictures are taken apart into, by lamps and by bounces.

use clap::{Args, ValueEnum};

use halflight::render::Apart;

/// What pictures are taken apart into.
#[derive(Args, Debug)]
#[command(next_help_heading = "Picture")]
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
#[command(next_help_heading = "Picture")]
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
