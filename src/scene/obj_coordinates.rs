//! Texture coordinates of an OBJ, read for scenes that have textures only.
//!
//! The corners of all `f` lines have them in order: `vt` by number, from 1 on or backwards from -1. Corners of textured
//! faces that name none, or one that is not there or not a number, take (0, 0), with one warning.
//!
//! Not handled: the third coordinate.

use glam::Vec2;

use crate::scene::build::Soup;
use crate::scene::lines;
use crate::scene::lines::Statement;
use crate::scene::warnings::Tally;

/// Coordinates beyond this are not taken for such: single precision tells texels apart no more.
const FARTHEST: f32 = 1e6;

/// Reads the coordinates of a soup's corners from the text it was read from.
pub(crate) fn take(soup: &mut Soup, text: &str) {
    let mut known: Vec<Vec2> = Vec::new();
    let mut numbers: Vec<usize> = Vec::with_capacity(soup.corners.len());
    for statement in lines::statements(text) {
        match statement.keyword() {
            "vt" => known.push(coordinates(&statement)),
            "f" | "fo" => numbers.extend(statement.words().map(|word| number(word, known.len()))),
            _ => {}
        }
    }
    let mut bare = Tally::default();
    let mut rest = &numbers[..];
    for polygon in &soup.polygons {
        let (own, after) = rest.split_at(polygon.corners.min(rest.len()));
        rest = after;
        let material = &soup.materials[polygon.material as usize];
        let is_known = |k: &usize| known.get(k.wrapping_sub(1)).is_some_and(|at| at.is_finite());
        if material.maps.is_some() && !own.iter().all(is_known) {
            bare.add_named(polygon.number, &material.name);
        }
    }
    let at = |k: &usize| known.get(k.wrapping_sub(1)).copied().filter(|at| at.is_finite()).unwrap_or_default();
    soup.coordinates = numbers.iter().map(at).collect();
    let consequence = "they have no texture coordinates, and take those of one point, (0, 0)";
    bare.report(&soup.file, "line", "textured face", consequence, &mut soup.warnings);
}

/// The coordinates of a `vt`; NaN where they are no numbers.
fn coordinates(statement: &Statement) -> Vec2 {
    let mut words = statement.words().map(|word| word.parse::<f32>().unwrap_or(f32::NAN));
    let at = Vec2::new(words.next().unwrap_or(f32::NAN), words.next().unwrap_or(0.0));
    if at.abs().max_element() <= FARTHEST { at } else { Vec2::NAN }
}

/// The number, from 1 on, of the coordinates of a corner; 0 where it has none.
fn number(word: &str, so_far: usize) -> usize {
    let given = word.split('/').nth(1).and_then(|part| part.parse::<i64>().ok()).unwrap_or(0);
    let absolute = if given < 0 { (so_far as i64).saturating_add(given).saturating_add(1) } else { given };
    usize::try_from(absolute).unwrap_or(0)
}
