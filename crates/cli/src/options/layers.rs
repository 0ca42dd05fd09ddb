//! `--layers` and `--per`: what pictures are taken apart into, by lamps, by bounces, and for denoisers.

use clap::{Args, ValueEnum};

use halflight::pictures::{NamedPicture, Picture};
use halflight::rays::Rays;
use halflight::render::{Apart, LayerKind, Rendered};
use halflight::scene::Scene;
use halflight_export::{Guides, LightParts};

/// What pictures are taken apart into.
#[derive(Args, Debug)]
#[command(next_help_heading = "Picture")]
pub struct Layers {
    /// Keep these apart as layers of an EXR file, or PNG files of their own; bounces and luminaires each add up to the
    /// picture, the others are what denoisers take
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
    /// Mean reflectance of what a pixel sees; this and the following in an EXR file alone
    Albedo,
    /// Mean normal of what a pixel sees, as X, Y, Z
    Normal,
    /// Distance along the view's axis, as Z, in the file's units
    Depth,
    /// Light that was reflected once
    Direct,
    /// Light that was reflected more often
    Indirect,
    /// The picture by each half of all rays: half A, half B
    Halves,
    /// All that denoisers take: albedo, normal, depth, direct, indirect, halves
    Denoiser,
}

impl LayerChoice {
    /// The kind that a layer for denoisers belongs to, by its name.
    fn of(name: &str) -> LayerChoice {
        match name {
            "albedo" => LayerChoice::Albedo,
            "normal" => LayerChoice::Normal,
            "depth" => LayerChoice::Depth,
            "direct" => LayerChoice::Direct,
            "indirect" => LayerChoice::Indirect,
            _ => LayerChoice::Halves,
        }
    }
}

/// What denoisers take.
#[derive(Default)]
pub struct ForDenoisers {
    guides: Option<Guides>,
    parts: Option<LightParts>,
    wanted: Vec<LayerChoice>,
}

impl ForDenoisers {
    /// The layers that were requested.
    pub fn layers(&self) -> Vec<NamedPicture<&Picture>> {
        let guides = self.guides.iter().flat_map(Guides::named);
        let all = guides.chain(self.parts.iter().flat_map(LightParts::named));
        let is_wanted = |own: &NamedPicture<&Picture>| {
            self.wanted.contains(&LayerChoice::Denoiser) || self.wanted.contains(&LayerChoice::of(&own.name))
        };
        all.filter(is_wanted).collect()
    }
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
            bounces: has(LayerChoice::Bounces) || self.parts_light(),
        }
    }

    /// Whether denoisers are to have light taken apart.
    fn parts_light(&self) -> bool {
        use LayerChoice::{Denoiser, Direct, Halves, Indirect};
        self.layers.iter().any(|own| matches!(own, Direct | Indirect | Halves | Denoiser))
    }

    /// Whether denoisers are to have what is seen.
    fn has_guides(&self) -> bool {
        use LayerChoice::{Albedo, Denoiser, Depth, Normal};
        self.layers.iter().any(|own| matches!(own, Albedo | Normal | Depth | Denoiser))
    }

    /// Whether some layers are of an EXR file alone.
    pub fn are_numbers(&self) -> bool {
        self.has_guides() || self.parts_light()
    }

    /// What denoisers are to have of a picture; bounces that only they need are taken out of it.
    pub fn for_denoisers(&self, scene: &Scene, rays: &Rays, found: &mut Rendered) -> ForDenoisers {
        let guides = self.has_guides().then(|| Guides::new(scene, rays, found.picture.size()));
        let parts = if self.parts_light() { LightParts::new(&found.layers) } else { None };
        if !self.layers.contains(&LayerChoice::Bounces) {
            found.layers.retain(|layer| matches!(layer.kind, LayerKind::Emitter(_)));
        }
        ForDenoisers { guides, parts, wanted: self.layers.clone() }
    }
}
