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
use crate::scene::obj_text::absolute;
use crate::scene::warnings::Tally;

/// Coordinates beyond this are not taken for such: single precision tells texels apart no more.
const FARTHEST: f32 = 1e6;

/// Reads the coordinates of a soup's corners from the text it was read from.
pub(crate) fn take(soup: &mut Soup, text: &str) {
    let of_textures = lines::statements(text).filter(|statement| statement.keyword() == "vt");
    let known: Vec<Vec2> = of_textures.map(|statement| coordinates(&statement)).collect();
    let numbers = numbers(text, "vt", 1);
    let mut bare = Tally::default();
    let mut rest = &numbers[..];
    for polygon in &soup.polygons {
        let (own, after) = rest.split_at(polygon.corners.min(rest.len()));
        rest = after;
        let material = &soup.materials[polygon.material as usize];
        let is_known = |k: &usize| known.get(k.wrapping_sub(1)).is_some_and(|at| at.is_finite());
        if material.maps.as_ref().is_some_and(|maps| maps.has_images()) && !own.iter().all(is_known) {
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

/// The numbers, from 1 on, of what all corners of faces name in a part of `v/vt/vn`, which lines of `keyword` define; 0
/// where a corner names none. Faces that have too few corners to be read are left out here as well.
pub(crate) fn numbers(text: &str, keyword: &str, part: usize) -> Vec<usize> {
    let (mut so_far, mut found) = (0, Vec::new());
    for statement in lines::statements(text) {
        match statement.keyword() {
            "f" | "fo" if statement.words().nth(2).is_some() => {
                found.extend(statement.words().map(|word| number(word, part, so_far)));
            }
            own if own == keyword => so_far += 1,
            _ => {}
        }
    }
    found
}

fn number(word: &str, part: usize, so_far: usize) -> usize {
    let given = word.split('/').nth(part).and_then(|part| part.parse::<i64>().ok());
    absolute(given.unwrap_or(0), so_far)
}
