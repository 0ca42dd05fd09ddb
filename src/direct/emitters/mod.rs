//! Luminaires: emitters with an area, textures of their emission, and occlusion.

pub(crate) mod emission_tree;
pub(crate) mod halving;
pub(crate) mod luminaire;
pub(crate) mod luminaire_texture;
pub(crate) mod luminaires;
pub(crate) mod occlusion;
pub(crate) mod shafts;
pub(crate) mod toward;
