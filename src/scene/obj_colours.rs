//! Colours of an OBJ's vertices at the corners of its faces, for files that have any.
//!
//! Not handled: what stands behind the coordinates of `v` ([`crate::scene::obj_vertices`]), and what colours mean
//! ([`crate::scene::vertex_colours`]).

use glam::{Vec3, Vec4};

use crate::scene::build::Soup;
use crate::scene::obj_coordinates::numbers;

/// Gives a soup's corners the colours of its vertices, NaN where there is none; `text` is what it was read from.
pub(crate) fn take(soup: &mut Soup, text: &str, colours: &[Vec3]) {
    let at = |k: usize| colours.get(k.wrapping_sub(1)).filter(|colour| !colour.is_nan());
    if !colours.is_empty() {
        let corners = numbers(text, "v", 0).into_iter();
        soup.colours = corners.map(|k| at(k).map_or(Vec4::NAN, |colour| colour.extend(1.0))).collect();
    }
}
