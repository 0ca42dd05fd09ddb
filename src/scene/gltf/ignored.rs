//! What a glTF file holds and the picture does not: one line for each kind, with the names of what has it and what is
//! in its place.
//!
//! Not handled: what changes nothing in the picture; it is counted nowhere.

use crate::scene::error::{About, Effect, Warning, list};

/// What is not modelled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Animations,
    Bumps,
    ColoursOutside,
    FurtherColours,
    Gloss,
    GlowBySecondSet,
    ImagesLost,
    ImagesOfOtherFormats,
    ImagesReplaced,
    LightsOfOtherTypes,
    Metal,
    Morphs,
    NoCoordinates,
    Orthographic,
    PointsAndLines,
    Ranges,
    Skins,
    SmoothNormals,
    SoftEdges,
    /// Extensions of which this is lost.
    Extensions(&'static str),
}

impl Kind {
    /// What it concerns, and what becomes of it.
    fn about(self) -> About {
        let effect = self.effect();
        match self {
            Kind::Animations | Kind::Morphs | Kind::PointsAndLines | Kind::Skins | Kind::Extensions(_) => {
                About::Shape(effect)
            }
            _ => About::Light(effect),
        }
    }

    fn effect(self) -> Effect {
        match self {
            Kind::ImagesLost | Kind::ImagesOfOtherFormats | Kind::NoCoordinates | Kind::Skins => Effect::Guessed,
            Kind::Animations
            | Kind::Extensions(_)
            | Kind::FurtherColours
            | Kind::GlowBySecondSet
            | Kind::LightsOfOtherTypes
            | Kind::Morphs
            | Kind::Orthographic
            | Kind::PointsAndLines => Effect::LeftOut,
            Kind::Bumps
            | Kind::ColoursOutside
            | Kind::Gloss
            | Kind::ImagesReplaced
            | Kind::Metal
            | Kind::Ranges
            | Kind::SmoothNormals
            | Kind::SoftEdges => Effect::Simplified,
        }
    }

    /// What it is, and what that means for the picture.
    fn words(self) -> [&'static str; 2] {
        match self {
            Kind::Animations => ["animations", "nothing moves: all is where the nodes themselves say"],
            Kind::Bumps => [
                "textures of gloss, bumps and occlusion, of materials",
                "surfaces are even and diffuse, shadows are those of the geometry",
            ],
            Kind::ColoursOutside => {
                ["what of colours of vertices is outside 0..1, of nodes", "the nearest of 0 and 1 counts"]
            }
            Kind::FurtherColours => ["further colours of vertices, of nodes", "COLOR_0 alone is a factor on rho"],
            Kind::Gloss => ["gloss, of materials", "they mirror nothing: their colour is diffuse"],
            Kind::GlowBySecondSet => {
                ["emission by a second set of texture coordinates, of materials", "they emit nothing"]
            }
            Kind::ImagesLost => ["images that cannot be read, of materials", LOST],
            Kind::ImagesOfOtherFormats => ["images of formats that are not read, of materials", LOST],
            Kind::ImagesReplaced => {
                ["images that are not read, of materials", "the image that the file gives beside them is shown"]
            }
            Kind::LightsOfOtherTypes => ["lights that are neither points, spots nor directional", "they do not shine"],
            Kind::Metal => ["metal, of materials", "it mirrors nothing: its colour is diffuse"],
            Kind::Morphs => ["morph targets of nodes", "the shape is that without them"],
            Kind::NoCoordinates => {
                ["textures without coordinates, of materials", "the texture's colour at (0, 0) is everywhere"]
            }
            Kind::Orthographic => ["orthographic cameras", "they cannot be looked through"],
            Kind::PointsAndLines => ["points and lines of nodes", "they have no area and are left out"],
            Kind::Ranges => ["ranges of lights", "they shine beyond them, by the square of the distance"],
            Kind::Skins => [
                "animated skins of nodes",
                "the bind pose is shown, or that in which the file's joints stand; the node's own transform does not \
                 count (glTF 2.0, 3.7.3.3)",
            ],
            Kind::SmoothNormals => ["smooth normals, of nodes", "faces are flat, each of one normal"],
            Kind::SoftEdges => ["soft edges of spots", "they are hard, at the cone of the same power"],
            Kind::Extensions(lost) => ["extensions", lost],
        }
    }
}

/// What counts for a texture without its image.
const LOST: &str = "the plain colour counts in their place, and where they are of emission, nothing is emitted";

/// Kinds of things that are not modelled, each with the names of what has them.
#[derive(Default)]
pub(super) struct Ignored {
    kinds: Vec<(Kind, Vec<String>)>,
}

impl Ignored {
    /// Counts one thing of a kind.
    pub(super) fn add(&mut self, kind: Kind, name: &str) {
        let known = self.kinds.iter().position(|(known, _)| *known == kind);
        let at = known.unwrap_or_else(|| {
            self.kinds.push((kind, Vec::new()));
            self.kinds.len() - 1
        });
        let names = &mut self.kinds[at].1;
        if names.last().is_none_or(|last| last != name) {
            names.push(name.to_owned());
        }
    }

    /// One warning for each kind: `FILE: not modelled: KIND (NAME, NAME): WHAT IS SHOWN`.
    pub(super) fn report(&self, file: &str, warnings: &mut Vec<Warning>) {
        for (kind, names) in &self.kinds {
            let [what, shown] = kind.words();
            let names = list(names.iter().map(String::as_str));
            warnings.push(kind.about().warning(format!("{file}: not modelled: {what} ({names}): {shown}")));
        }
    }
}
