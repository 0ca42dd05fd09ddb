//! What readers of scene files get and give: polygons in the file's units, with materials, cameras and lights.
//!
//! Colours of vertices are factors on rho, and where alpha counts on the mask, linear over each triangle:
//!
//! ```text
//! rho(x) = rho t_rho(x) c(x),     a(x) = a t_a(x) c_alpha(x),     c(x) = sum of the corners' colours by their weights
//! ```
//!
//! A material whose corners all have one colour takes it into its own numbers. Corners without a colour count as white.
//! Where the file does not define what a material reflects, its colours are what it reflects, and corners without one
//! reflect the grey that stands for such materials; a colour that is white everywhere defines nothing.
//!
//! Not handled: what the bytes of a format mean ([`crate::scene::obj`], [`crate::scene::gltf`]).

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::io;
use std::ops::Range;
use std::sync::Arc;

use glam::{DVec3, Vec2, Vec3, Vec4, Vec4Swizzles};

use crate::scene::error::{About, Effect, Place, SceneError, Tally, Warning, shorten};
use crate::scene::model::{Camera, LoadOptions, Material, UnitFrame};
use crate::scene::punctual::PunctualLight;
use crate::scene::textures::Mask;
use crate::scene::unit::LengthUnit;

/// Reads a file named relative to the OBJ or scene file.
pub(crate) type Reader<'a> = &'a dyn Fn(&str) -> io::Result<Cow<'a, [u8]>>;

/// A file to read a scene from, and what is next to it; texts that are read live as long as their reader.
#[derive(Clone, Copy)]
pub(crate) struct SceneInput<'a, 'r> {
    /// The scene's name.
    pub name: &'a str,
    /// The file's name, for messages and for its extension.
    pub file: &'a str,
    /// All of the file.
    pub bytes: &'a [u8],
    /// Reads files that the file names.
    pub reader: Reader<'r>,
    pub options: LoadOptions,
}

/// Polygons as read, in the file's units.
#[derive(Clone, Debug, Default)]
pub(crate) struct Soup {
    /// The scene's name.
    pub name: String,
    /// The file, or the name again where there is none.
    pub file: String,
    /// What `Polygon::number` counts: `line`, `face` or `triangle`.
    pub item: &'static str,
    /// The unit of its numbers, where it is known.
    pub unit: Option<LengthUnit>,
    pub vertices: Vec<DVec3>,
    /// The corners of all polygons, one after the other.
    pub corners: Vec<u32>,
    /// Texture coordinates of the corners, as many or none; (0, 0) for corners beyond them.
    pub coordinates: Vec<Vec2>,
    /// Linear RGB and alpha of the corners, as many or none.
    pub colours: Vec<Vec4>,
    pub polygons: Vec<Polygon>,
    pub materials: Vec<Material>,
    pub objects: Vec<String>,
    /// The file's own cameras; the first one is the scene's.
    pub cameras: Vec<SoupCamera>,
    /// Punctual lights, in the file's units.
    pub lights: Vec<PunctualLight>,
    /// Whether a camera is given elsewhere, so that none need be found.
    pub has_view: bool,
    pub warnings: Vec<Warning>,
}

/// A camera of a [`Soup`].
#[derive(Clone, Debug)]
pub(crate) struct SoupCamera {
    pub name: String,
    /// The eye, in the file's units.
    pub position: DVec3,
    /// All of the camera but its position.
    pub view: Camera,
}

/// One polygon of a [`Soup`]; its corners follow those of the polygon before it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Polygon {
    pub corners: usize,
    pub material: u32,
    pub object: u32,
    /// Its line or number, for messages.
    pub number: usize,
}

/// What a file defines of a material that has colours of vertices.
pub(crate) struct Defined {
    /// What it reflects without them.
    pub rho: Reflects,
    /// The mask that alpha is a factor of, if alpha counts.
    pub mask: Option<Mask>,
}

/// What a material reflects where vertices have no colour.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Reflects {
    /// What the file defines: the factor on colours.
    Defined,
    /// The grey that stands for what the file does not define, to which white colours of vertices belong as well.
    Undefined,
}

/// The colours of the corners of one material.
#[derive(Clone, Copy)]
enum Corners {
    /// No corner has a colour.
    Bare,
    /// All have this one.
    Even(Vec4),
    Varied,
}

impl Soup {
    /// The polygons, each with the places of its corners.
    pub(super) fn ranges(&self) -> impl Iterator<Item = (Range<usize>, &Polygon)> {
        self.polygons.iter().scan(0, |start, polygon| {
            let own = *start..*start + polygon.corners;
            *start = own.end;
            Some((own, polygon))
        })
    }

    /// Makes the backs of some polygons their fronts.
    pub(super) fn turn(&mut self, polygons: &BTreeSet<usize>) {
        let all: Vec<Range<usize>> = self.ranges().map(|(own, _)| own).collect();
        for own in polygons.iter().map(|&number| all[number].clone()) {
            self.corners[own.clone()].reverse();
            // Corners beyond the lists have values that are all alike.
            let within = |length: usize| own.start.min(length)..own.end.min(length);
            let (coordinates, colours) = (within(self.coordinates.len()), within(self.colours.len()));
            self.coordinates[coordinates].reverse();
            self.colours[colours].reverse();
        }
    }

    /// The frame of unit coordinates; none where no polygon has an extent.
    pub(super) fn frame(&self) -> Option<UnitFrame> {
        let metres = self.unit.unwrap_or_default().metres();
        UnitFrame::of(self.corners.iter().map(|&v| self.vertices[v as usize]), metres)
    }

    /// Removes the polygons of materials of opacity 0, with a warning.
    pub(super) fn remove_invisible(&mut self) {
        let is_invisible = |material: &Material| material.mask().is_some_and(Mask::is_nowhere);
        let invisible: Vec<bool> = self.materials.iter().map(is_invisible).collect();
        if !invisible.contains(&true) {
            return;
        }
        let mut removed = Tally::default();
        let (mut of_polygons, mut of_corners) = (Vec::new(), Vec::new());
        for polygon in &self.polygons {
            let keep = !invisible[polygon.material as usize];
            if !keep {
                removed.add_named(polygon.number, &self.materials[polygon.material as usize].name);
            }
            of_polygons.push(keep);
            of_corners.extend(std::iter::repeat_n(keep, polygon.corners));
        }
        retain(&mut self.corners, &of_corners);
        retain(&mut self.coordinates, &of_corners);
        retain(&mut self.colours, &of_corners);
        retain(&mut self.polygons, &of_polygons);
        let consequence = "left out: its opacity is 0, so nothing is there";
        removed.report(About::Shape(Effect::LeftOut), (&self.file, self.item), "face", consequence, &mut self.warnings);
    }

    /// Puts the colours of the corners, NaN where there is none, onto the materials. Returns whether each material is
    /// coloured, by more than white.
    pub(super) fn apply_colours(&mut self, defined: Vec<Defined>) -> Vec<bool> {
        let mut coloured = vec![false; self.materials.len()];
        if self.colours.is_empty() {
            return coloured;
        }
        self.warn_of_gaps();
        let repeated = |polygon: &Polygon| std::iter::repeat_n(polygon.material as usize, polygon.corners);
        let owners: Vec<usize> = self.polygons.iter().flat_map(repeated).collect();
        let given = self.corners_by_material(&owners);
        for (colour, &owner) in self.colours.iter().zip(&owners) {
            coloured[owner] |= !colour.is_nan() && colour.xyz() != Vec3::ONE;
        }
        let mut bare = vec![Vec4::ONE; self.materials.len()];
        for (m, material) in self.materials.iter_mut().enumerate() {
            let is_defined = match defined[m].rho {
                Reflects::Defined => true,
                Reflects::Undefined => !coloured[m],
            };
            if !is_defined && !matches!(given[m], Corners::Bare) {
                bare[m] = std::mem::replace(&mut material.rho, Vec3::ONE).extend(1.0);
            }
        }
        for (colour, &owner) in self.colours.iter_mut().zip(&owners) {
            let own = if colour.is_nan() { bare[owner] } else { *colour };
            *colour = if defined[owner].mask.is_some() { own } else { own.with_w(1.0) };
        }
        let whole = self.corners_by_material(&owners);
        for ((material, corners), Defined { mask, .. }) in self.materials.iter_mut().zip(whole).zip(defined) {
            colour_material(material, corners, mask);
        }
        if !self.materials.iter().any(|material| material.maps.as_ref().is_some_and(|maps| maps.vertex_colours)) {
            self.colours.clear();
        }
        coloured
    }

    fn corners_by_material(&self, owners: &[usize]) -> Vec<Corners> {
        let mut found: Vec<Option<Corners>> = vec![None; self.materials.len()];
        for (&colour, &owner) in self.colours.iter().zip(owners) {
            found[owner] = Some(match (found[owner], colour.is_nan()) {
                (None | Some(Corners::Bare), true) => Corners::Bare,
                (None, false) => Corners::Even(colour),
                (Some(Corners::Even(known)), false) if known == colour => Corners::Even(known),
                _ => Corners::Varied,
            });
        }
        found.into_iter().map(|corners| corners.unwrap_or(Corners::Bare)).collect()
    }

    /// Warns of faces of which some corners have a colour and others none.
    fn warn_of_gaps(&mut self) {
        let mut gaps = Tally::default();
        for (own, polygon) in self.ranges() {
            let bare = self.colours[own].iter().filter(|colour| colour.is_nan()).count();
            if bare > 0 && bare < polygon.corners {
                gaps.add(polygon.number);
            }
        }
        let consequence = "vertices without a colour count as white there, or reflect what their material does";
        let place = (self.file.as_str(), self.item);
        gaps.report(About::Light(Effect::Guessed), place, "partly coloured face", consequence, &mut self.warnings);
    }
}

/// Takes an even colour into a material's numbers, or marks the material as one whose corners have their own.
fn colour_material(material: &mut Material, corners: Corners, mask: Option<Mask>) {
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
    material.set_maps(maps);
}

/// Keeps the items that are marked; there may be fewer items than marks.
fn retain<T>(items: &mut Vec<T>, kept: &[bool]) {
    let mut marks = kept.iter();
    items.retain(|_| *marks.next().unwrap_or(&true));
}

/// Refuses a reflectance outside 0..=1 (NaN included).
pub(crate) fn check_rho(rho: [f64; 3], material: &str, place: impl Fn() -> Place) -> Result<(), SceneError> {
    let outside = rho.into_iter().find(|value| !(0.0..=1.0).contains(value));
    let error = |value| Err(SceneError::Rho { place: place(), material: shorten(material), value });
    outside.map_or(Ok(()), error)
}

/// Refuses an emission that is negative, NaN, or infinite in single precision.
pub(crate) fn check_emission(emission: [f64; 3], material: &str, place: impl Fn() -> Place) -> Result<(), SceneError> {
    let error = |value| Err(SceneError::Emission { place: place(), material: shorten(material), value });
    outside_f32(&emission).map_or(Ok(()), error)
}

/// Refuses numbers of a highlight that are negative, NaN, or infinite in single precision.
pub(crate) fn check_gloss(numbers: &[f64], material: &str, place: impl Fn() -> Place) -> Result<(), SceneError> {
    let error = |value| Err(SceneError::Gloss { place: place(), material: shorten(material), value });
    outside_f32(numbers).map_or(Ok(()), error)
}

/// The first number that is negative, NaN, or infinite in single precision.
pub(crate) fn outside_f32(numbers: &[f64]) -> Option<f64> {
    numbers.iter().copied().find(|value| !(0.0..=f64::from(f32::MAX)).contains(value))
}
