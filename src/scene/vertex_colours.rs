//! Colours of vertices: factors on rho, and where alpha counts on the mask, linear over each triangle.
//!
//! ```text
//! rho(x) = rho t_rho(x) c(x),     a(x) = a t_a(x) c_alpha(x),     c(x) = sum of the corners' colours by their weights
//! ```
//!
//! A material whose corners all have one colour takes it into its own numbers. Corners without a colour count as white.
//! Where the file does not say what a material reflects, its colours are what it reflects, and corners without one
//! reflect the grey that stands for such materials; a colour that is white everywhere says nothing in glTF.
//!
//! Not handled: how formats store colours ([`crate::scene::obj_colours`], [`crate::scene::gltf`]).

use std::sync::Arc;

use glam::{Vec3, Vec4, Vec4Swizzles};

use crate::scene::build::Soup;
use crate::scene::textures::Mask;
use crate::scene::warnings::Tally;

/// What a file says of a material that has colours of vertices.
pub(crate) struct Said {
    /// What it reflects without them.
    pub rho: Reflects,
    /// The mask that alpha is a factor of, if alpha counts.
    pub mask: Option<Mask>,
}

/// What a material reflects where vertices have no colour.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reflects {
    /// What the file says: the factor on colours.
    Said,
    /// The grey that stands for what the file does not say.
    Unsaid,
    /// The same, and white colours of vertices say nothing either.
    UnsaidWhite,
}

/// What the corners of one material have.
#[derive(Clone, Copy)]
enum Corners {
    /// No corner has a colour.
    Bare,
    /// All have this one.
    Even(Vec4),
    Varied,
}

/// Puts the colours of a soup's corners, NaN where there is none, onto its materials. Returns whether each material is
/// coloured, by more than white.
pub(crate) fn put_on(soup: &mut Soup, said: Vec<Said>) -> Vec<bool> {
    if soup.colours.is_empty() {
        return vec![false; soup.materials.len()];
    }
    warn_of_gaps(soup);
    let owners = owners(soup);
    let given = by_material(soup, &owners);
    let mut coloured = vec![false; soup.materials.len()];
    for (colour, &owner) in soup.colours.iter().zip(&owners) {
        coloured[owner as usize] |= !colour.is_nan() && colour.xyz() != Vec3::ONE;
    }
    let bare: Vec<Vec4> = (0..soup.materials.len())
        .map(|m| match (said[m].rho, given[m]) {
            (Reflects::Said, _) | (_, Corners::Bare) => Vec4::ONE,
            (Reflects::UnsaidWhite, _) if !coloured[m] => Vec4::ONE,
            _ => std::mem::replace(&mut soup.materials[m].rho, Vec3::ONE).extend(1.0),
        })
        .collect();
    for (colour, &owner) in soup.colours.iter_mut().zip(&owners) {
        let own = if colour.is_nan() { bare[owner as usize] } else { *colour };
        *colour = if said[owner as usize].mask.is_some() { own } else { own.with_w(1.0) };
    }
    let whole = by_material(soup, &owners);
    for (number, (corners, Said { mask, .. })) in whole.into_iter().zip(said).enumerate() {
        finish(soup, number, corners, mask);
    }
    if !soup.materials.iter().any(|material| material.maps.as_ref().is_some_and(|maps| maps.vertex_colours)) {
        soup.colours.clear();
    }
    coloured
}

/// The material of each corner.
fn owners(soup: &Soup) -> Vec<u32> {
    soup.polygons.iter().flat_map(|polygon| std::iter::repeat_n(polygon.material, polygon.corners)).collect()
}

/// What the corners of each material have.
fn by_material(soup: &Soup, owners: &[u32]) -> Vec<Corners> {
    let mut found: Vec<Option<Corners>> = vec![None; soup.materials.len()];
    for (&colour, &owner) in soup.colours.iter().zip(owners) {
        let slot = &mut found[owner as usize];
        *slot = Some(match (*slot, colour.is_nan()) {
            (None, true) => Corners::Bare,
            (None, false) => Corners::Even(colour),
            (Some(Corners::Bare), true) => Corners::Bare,
            (Some(Corners::Even(known)), false) if known == colour => Corners::Even(known),
            _ => Corners::Varied,
        });
    }
    found.into_iter().map(|corners| corners.unwrap_or(Corners::Bare)).collect()
}

/// Takes an even colour into a material's numbers, or marks the material as one whose corners have their own.
fn finish(soup: &mut Soup, number: usize, corners: Corners, mask: Option<Mask>) {
    let material = &mut soup.materials[number];
    let mut maps = material.maps.take().map(Arc::unwrap_or_clone).unwrap_or_default();
    match corners {
        Corners::Bare => {}
        Corners::Even(colour) => {
            material.rho *= colour.xyz();
            maps.mask = mask.map(|mask| Mask { factor: mask.factor * colour.w, ..mask });
        }
        Corners::Varied => {
            maps.mask = mask;
            maps.vertex_colours = true;
        }
    }
    maps.put_on(material);
}

/// Faces of which some corners have a colour and others none.
fn warn_of_gaps(soup: &mut Soup) {
    let (mut gaps, mut rest) = (Tally::default(), &soup.colours[..]);
    for polygon in &soup.polygons {
        let (own, after) = rest.split_at(polygon.corners.min(rest.len()));
        rest = after;
        if own.iter().any(|colour| colour.is_nan()) && !own.iter().all(|colour| colour.is_nan()) {
            gaps.add(polygon.number);
        }
    }
    let consequence = "vertices without a colour count as white there, or reflect what their material does";
    gaps.report(&soup.file, soup.item, "partly coloured face", consequence, &mut soup.warnings);
}
