//! The statements of an OBJ, each read once and checked with its line.
//!
//! Read: `v` with what stands behind its coordinates (`w` a weight, `r g b` a colour, `w r g b` both), `vt`,
//! `vn`, `f`, `usemtl`, `o`, `g`, `mtllib`. Colours outside 0..1 are clamped; weights other than 1, points, lines,
//! free-form geometry, faces that ask for smooth shading (`vn` that differ from corner to corner, or `s`) and unknown
//! statements are counted for a warning. Indices may point forward: the range is checked at the end.
//!
//! Source: Wavefront, *Object Files (.obj)*, Advanced Visualizer manual, appendix B1.
//!
//! Not handled: materials, whose names are resolved afterwards; the third texture coordinate; colours in comments
//! (`#MRGB`), which are warned of.

use std::collections::HashMap;

use glam::{DVec3, Vec2, Vec3, Vec4};

use crate::pictures::decode_srgb;
use crate::scene::NO_MATERIAL;
use crate::scene::error::{About, Effect, Place, SceneError, Tally, Warning, shorten};
use crate::scene::obj::lines::{Statement, refuse_one_line, statements};
use crate::scene::obj::objects::Objects;
use crate::scene::polygon::MOST_CORNERS;
use crate::scene::soup::{Polygon, Soup};

/// Statements that change nothing on flat diffuse faces, and those of free-form geometry that draw nothing themselves.
const WITHOUT_EFFECT: &str = "vp deg bmat step cstype parm trim hole scrv sp end con mg bevel c_interp d_interp lod \
                              shadow_obj trace_obj ctech stech res";

/// Points, lines, curves and surfaces.
const IGNORED: &str = "p l curv curv2 surf bsp bzp cdc cdp";

/// How far normals of a face's corners may lie apart to be one.
const ONE_NORMAL: f32 = 1e-3;

/// Texture coordinates beyond this are not taken for such: single precision resolves texels no more.
const FARTHEST: f32 = 1e6;

/// The material of faces before the first `usemtl`.
const BARE: u32 = u32::MAX;

/// What the statements hold.
#[derive(Debug, Default)]
pub(super) struct Statements {
    pub vertices: Vec<DVec3>,
    pub corners: Vec<u32>,
    /// Their materials are numbers of [`Self::materials`], or [`BARE`].
    pub polygons: Vec<Polygon>,
    /// Objects and groups that have faces.
    pub objects: Objects,
    /// Names after `usemtl`, in order, each with its first line.
    pub materials: Vec<(String, usize)>,
    /// `mtllib` lines: line number and everything after the keyword.
    pub libraries: Vec<(usize, String)>,
    /// Linear RGB of each vertex up to the last one that has a colour, decoded; NaN for those without.
    pub colours: Vec<Vec3>,
    pub tallies: Tallies,
    /// `vt`, NaN where they are no numbers.
    coordinates: Vec<Vec2>,
    /// For each corner the number of its `vt` from 1; 0 where it has none.
    coordinate_numbers: Vec<u32>,
    /// `vn`, NaN where they are no numbers.
    normals: Vec<Vec3>,
    numbers_of_materials: HashMap<String, u32>,
    material: Option<u32>,
    /// Whether a smoothing group is on.
    is_smooth: bool,
    /// Line and value of the largest index so far, counted from 1.
    largest: (usize, usize),
}

/// Occurrences of what is passed over or not modelled.
#[derive(Debug, Default)]
pub(super) struct Tallies {
    /// Faces of fewer than three corners.
    pub thin: Tally,
    /// Faces before the first `usemtl`.
    pub bare: Tally,
    ignored: Tally,
    smooth: Tally,
    unknown: Tally,
    colours_outside: Tally,
    weights: Tally,
    weights_and_colours: Tally,
    odd_vertices: Tally,
}

/// Reads an OBJ's text; `file` is its name for messages.
pub(super) fn read(file: &str, text: &str) -> Result<Statements, SceneError> {
    let mut obj = Statements::default();
    refuse_one_line(file, text, &["v", "f", "vt", "vn"])?;
    for statement in statements(text) {
        obj.take(file, &statement)?;
    }
    let (line, index) = obj.largest;
    if index > obj.vertices.len() { Err(obj.out_of_range(file, line, index.to_string())) } else { Ok(obj) }
}

impl Statements {
    fn take(&mut self, file: &str, statement: &Statement) -> Result<(), SceneError> {
        match statement.keyword() {
            "v" => self.vertex(file, statement)?,
            "vt" => self.coordinates.push(coordinates(statement)),
            "vn" => self.normals.push(normal(statement)),
            "f" | "fo" => self.face(file, statement)?,
            "o" | "g" => self.objects.begin(statement),
            "s" => self.is_smooth = !matches!(statement.words().next(), None | Some("off" | "0")),
            "usemtl" => self.material = Some(self.number_of(statement.material(), statement.line)),
            "mtllib" => self.libraries.push((statement.line, statement.name(file)?.to_owned())),
            keyword if IGNORED.split(' ').any(|ignored| ignored == keyword) => self.tallies.ignored.add(statement.line),
            keyword if WITHOUT_EFFECT.split(' ').any(|known| known == keyword) => {}
            keyword => self.tallies.unknown.add_named(statement.line, keyword),
        }
        Ok(())
    }

    fn number_of(&mut self, material: &str, line: usize) -> u32 {
        let next = self.materials.len() as u32;
        if let Some(&known) = self.numbers_of_materials.get(material) {
            return known;
        }
        self.numbers_of_materials.insert(material.to_owned(), next);
        self.materials.push((material.to_owned(), line));
        next
    }

    fn vertex(&mut self, file: &str, statement: &Statement) -> Result<(), SceneError> {
        let (mut place, mut found, mut words) = ([0.0; 3], 0, statement.words());
        for (part, word) in place.iter_mut().zip(words.by_ref()) {
            *part = statement.number(file, word)?;
            found += 1;
        }
        if found < 3 {
            return Err(statement.malformed(file, "three coordinates", &found.to_string()));
        }
        self.vertices.push(DVec3::from_array(place));
        self.weight_and_colour(words, statement.line);
        Ok(())
    }

    /// Reads what stands behind the coordinates of the last vertex.
    fn weight_and_colour<'w>(&mut self, words: impl Iterator<Item = &'w str>, line: usize) {
        let (mut numbers, mut count) = ([0.0; 4], 0);
        for word in words {
            if let Some(slot) = numbers.get_mut(count) {
                *slot = word.parse().unwrap_or(f64::NAN);
            }
            count += 1;
        }
        let [w, x, y, z] = numbers;
        let (weight, colour) = match count {
            0 => return,
            1 => (w, None),
            3 => (1.0, Some([w, x, y])),
            4 => (w, Some([x, y, z])),
            _ => (f64::NAN, None),
        };
        let tallies = &mut self.tallies;
        if weight.is_nan() || numbers.iter().any(|number| !number.is_finite()) {
            return tallies.odd_vertices.add(line);
        }
        if count == 4 {
            tallies.weights_and_colours.add(line);
        }
        if weight != 1.0 {
            tallies.weights.add(line);
        }
        let Some(colour) = colour else { return };
        if colour.iter().any(|part| !(0.0..=1.0).contains(part)) {
            tallies.colours_outside.add(line);
        }
        self.colours.resize(self.vertices.len() - 1, Vec3::NAN);
        // What writes such files writes sRGB codes over 255.
        self.colours.push(Vec3::from_array(colour.map(|code: f64| decode_srgb(code.clamp(0.0, 1.0) as f32))));
    }

    fn face(&mut self, file: &str, statement: &Statement) -> Result<(), SceneError> {
        let (start, line) = (self.corners.len(), statement.line);
        let (mut first, mut is_bent) = (None, false);
        for word in statement.words() {
            if let Some(normal) = self.corner(file, statement, word)? {
                is_bent |= first.get_or_insert(normal).distance(normal) > ONE_NORMAL;
            }
        }
        let corners = self.corners.len() - start;
        if corners > MOST_CORNERS {
            let place = Place::line(file, line);
            return Err(SceneError::TooManyCorners { place, found: corners, limit: MOST_CORNERS });
        }
        if corners < 3 {
            // They enclose nothing, and exporters write them.
            self.corners.truncate(start);
            self.coordinate_numbers.truncate(start);
            self.tallies.thin.add(line);
            return Ok(());
        }
        if is_bent || (self.is_smooth && first.is_none()) {
            self.tallies.smooth.add(line);
        }
        if self.material.is_none() {
            self.tallies.bare.add(line);
        }
        let (material, object) = (self.material.unwrap_or(BARE), self.objects.current() as u32);
        self.polygons.push(Polygon { corners, material, object, number: line });
        Ok(())
    }

    /// Adds a corner `v`, `v/vt`, `v//vn` or `v/vt/vn`; its normal, where it has one that is there.
    fn corner(&mut self, file: &str, statement: &Statement, word: &str) -> Result<Option<Vec3>, SceneError> {
        let mut parts = word.split('/');
        let integer = |part: &str| part.parse().map_err(|_| statement.not_a_number(file, word));
        let position: i64 = integer(parts.next().unwrap_or(""))?;
        let mut other = || parts.next().filter(|part| !part.is_empty()).map_or(Ok(0), integer);
        let (coordinates, normal) = (other()?, other()?);
        if parts.next().is_some() {
            return Err(statement.malformed(file, "corners of the form v, v/vt, v//vn or v/vt/vn", &shorten(word)));
        }
        let index = absolute(position, self.vertices.len());
        if index == 0 {
            return Err(self.out_of_range(file, statement.line, position.to_string()));
        }
        if index > self.largest.1 {
            self.largest = (statement.line, index);
        }
        self.corners.push((index - 1) as u32);
        self.coordinate_numbers.push(u32::try_from(absolute(coordinates, self.coordinates.len())).unwrap_or(0));
        let normal = self.normals.get(absolute(normal, self.normals.len()).wrapping_sub(1)).copied();
        Ok(normal.filter(|normal| normal.is_finite()))
    }

    fn out_of_range(&self, file: &str, line: usize, index: String) -> SceneError {
        SceneError::IndexOutOfRange { place: Place::line(file, line), index, vertices: self.vertices.len() }
    }

    /// Moves vertices and polygons into a soup, whose materials `used` has by the numbers of their names. Faces without
    /// a material take the one after the last.
    pub(super) fn fill(&mut self, soup: &mut Soup, used: &[usize]) {
        soup.vertices = std::mem::take(&mut self.vertices);
        soup.corners = std::mem::take(&mut self.corners);
        soup.polygons = std::mem::take(&mut self.polygons);
        for polygon in &mut soup.polygons {
            let known = used.get(polygon.material as usize).copied();
            polygon.material = known.unwrap_or(soup.materials.len()) as u32;
        }
    }

    /// Gives the corners of a soup texture coordinates. Corners of textured faces that name none, or one that is not
    /// there or not a number, take (0, 0), with a warning.
    pub(super) fn fill_coordinates(&self, soup: &mut Soup) {
        let at = |k: &u32| self.coordinates.get((*k as usize).wrapping_sub(1)).filter(|at| at.is_finite());
        let mut bare = Tally::default();
        for (own, polygon) in soup.ranges() {
            let material = &soup.materials[polygon.material as usize];
            if material.has_images() && !self.coordinate_numbers[own].iter().all(|k| at(k).is_some()) {
                bare.add_named(polygon.number, &material.name);
            }
        }
        soup.coordinates = self.coordinate_numbers.iter().map(|k| at(k).copied().unwrap_or_default()).collect();
        let consequence = "they have no texture coordinates, and take those of one point, (0, 0)";
        bare.report(
            About::Light(Effect::Guessed),
            (&soup.file, "line"),
            "textured face",
            consequence,
            &mut soup.warnings,
        );
    }

    /// Gives the corners of a soup the colours of its vertices, NaN where there is none, if any vertex has one.
    pub(super) fn fill_colours(&self, soup: &mut Soup) {
        let at = |k: &u32| self.colours.get(*k as usize).map_or(Vec4::NAN, |colour| colour.extend(1.0));
        if !self.colours.is_empty() {
            soup.colours = soup.corners.iter().map(at).collect();
        }
    }
}

impl Tallies {
    /// Warns of what was passed over; `text` is all of the file, and `grey` what bare faces reflect.
    pub(super) fn report(&self, file: &str, text: &str, grey: &str, warnings: &mut Vec<Warning>) {
        let mut report = |about, tally: &Tally, noun, consequence: &str| {
            tally.report(about, (file, "line"), noun, consequence, warnings);
        };
        report(
            About::Shape(Effect::LeftOut),
            &self.ignored,
            "statement",
            "points, lines, curves and surfaces are not modelled",
        );
        report(
            About::Shape(Effect::Simplified),
            &self.thin,
            "face",
            "left out: with fewer than three corners they have no area",
        );
        report(
            About::Light(Effect::Simplified),
            &self.smooth,
            "smooth face",
            "faces are flat: smooth shading (vn, s) is not modelled",
        );
        self.unknown.report_keywords(
            About::Shape(Effect::LeftOut),
            file,
            "neither modelled nor known to change nothing, and left out",
            warnings,
        );
        let mut report = |about, tally: &Tally, noun, consequence: &str| {
            tally.report(about, (file, "line"), noun, consequence, warnings);
        };
        let outside = "its numbers are clamped to 0..1; divide those of eight bits by 255";
        report(About::Light(Effect::Simplified), &self.colours_outside, "vertex colour", outside);
        let weights = "w of `v x y z w` counts in curves alone, and positions are not divided by it";
        report(About::Shape(Effect::Simplified), &self.weights, "vertex weight", weights);
        let both = "read as x y z w r g b, of which w has no effect; write x y z r g b if the last one is an alpha";
        report(About::Light(Effect::Guessed), &self.weights_and_colours, "seven-number v", both);
        let odd = "what follows x y z is left out: neither a weight nor a colour of three numbers";
        report(About::Shape(Effect::LeftOut), &self.odd_vertices, "v", odd);
        if let Some(at) = text.find("#MRGB") {
            let line = 1 + text[..at].matches('\n').count();
            let text = format!("{file}, line {line}: colours of vertices in comments (#MRGB) are not modelled");
            warnings.push(About::Light(Effect::LeftOut).warning(text));
        }
        let bare = format!("no usemtl before it; material `{NO_MATERIAL}` reflects {grey}");
        self.bare.report(About::Light(Effect::Guessed), (file, "line"), "face", &bare, warnings);
    }
}

/// An index counted from 1, or backwards from -1 among so many; 0 where there is none.
fn absolute(index: i64, so_far: usize) -> usize {
    let from_start = if index < 0 { (so_far as i64).saturating_add(index).saturating_add(1) } else { index };
    usize::try_from(from_start).unwrap_or(0)
}

/// The coordinates of a `vt`; NaN where they are no numbers.
fn coordinates(statement: &Statement) -> Vec2 {
    let mut words = statement.words().map(|word| word.parse().unwrap_or(f32::NAN));
    let at = Vec2::new(words.next().unwrap_or(f32::NAN), words.next().unwrap_or(0.0));
    if at.abs().max_element() <= FARTHEST { at } else { Vec2::NAN }
}

/// The unit vector of a `vn`; NaN where it is none.
fn normal(statement: &Statement) -> Vec3 {
    let mut words = statement.words().map(|word| word.parse().unwrap_or(f32::NAN));
    let mut next = || words.next().unwrap_or(f32::NAN);
    Vec3::new(next(), next(), next()).normalize_or(Vec3::NAN)
}
