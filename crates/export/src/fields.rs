//! Light on patches as arrays: L as patches × halves × channels, terms as bounces × patches × halves × channels.
//!
//! Halves are 0 invisible, 1 visible; channels red, green, blue; W/(m² sr), float32. Not handled: where patches lie
//! ([`crate::PatchMesh`]).

use crate::arrays::{Array, Values};
use halflight::light::Light;

/// Numbers of the light of a patch.
const EACH: usize = 6;

/// `L` of every patch: shape (patches, 2, 3).
pub fn light_array(light: &[Light]) -> Array<'static> {
    Array { shape: vec![light.len(), 2, 3], values: Values::F32(numbers(light).collect::<Vec<_>>().into()) }
}

/// `KⁿE` of every patch, n from 0: shape (bounces, patches, 2, 3).
pub fn terms_array(terms: &[Vec<Light>]) -> Array<'static> {
    let patches = terms.first().map_or(0, Vec::len);
    let mut all = Vec::with_capacity(EACH * patches * terms.len());
    terms.iter().for_each(|term| all.extend(numbers(term)));
    Array { shape: vec![terms.len(), patches, 2, 3], values: Values::F32(all.into()) }
}

fn numbers(light: &[Light]) -> impl Iterator<Item = f32> {
    light.iter().flat_map(|l| [l.invisible, l.visible].into_iter().flat_map(|half| half.to_array()))
}
