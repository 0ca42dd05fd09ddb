//! The check of an OBJ's text, line by line, and the clean text that is handed to the reader.
//!
//! Kept: `v` ([`crate::scene::obj_vertices`]), `f` (vertex indices, made absolute), `usemtl`, `o`, `g`, `mtllib`; `vt`
//! is left to [`crate::scene::obj_coordinates`]. Points, lines and free-form geometry, faces that are to look smooth
//! (`vn` that differ from corner to corner, or `s`) and statements that are not known are counted for a warning.
//! Indices may point forward: the range is checked at the end.
//!
//! Source: Wavefront, *Object Files (.obj)*, Advanced Visualizer manual, appendix B1.
//!
//! Not handled: materials; their names are resolved after the check.

use std::collections::HashMap;
use std::fmt::Write;

use glam::Vec3;

use crate::scene::error::{Place, SceneError};
use crate::scene::lines;
use crate::scene::lines::{Statement, shorten};
use crate::scene::obj_objects::Objects;
use crate::scene::obj_vertices::Extras;
use crate::scene::warnings::Tally;

/// Statements of free-form geometry, of which `curv`, `curv2` and `surf` draw something, and those that change nothing
/// on flat diffuse faces.
const WITHOUT_EFFECT: [&str; 23] = [
    "vt",
    "vp",
    "deg",
    "bmat",
    "step",
    "cstype",
    "parm",
    "trim",
    "hole",
    "scrv",
    "sp",
    "end",
    "con",
    "mg",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "shadow_obj",
    "trace_obj",
    "ctech",
    "stech",
    "res",
];

/// How far normals of a face's corners may lie apart to be one.
const ONE_NORMAL: f32 = 1e-3;

/// What the check found. Polygon k of the clean text is `face_lines[k]`.
#[derive(Debug, Default)]
pub(crate) struct ObjText {
    positions: String,
    faces: String,
    /// Number of `v` lines.
    pub vertices: usize,
    /// The line of each face, in order.
    pub face_lines: Vec<usize>,
    /// Objects and groups that have faces.
    pub objects: Objects,
    /// Names after `usemtl`, in order, each with its first line.
    pub materials: Names,
    /// `mtllib` lines: line number and everything after the keyword.
    pub libraries: Vec<(usize, String)>,
    /// Faces before the first `usemtl`.
    pub bare: Tally,
    /// Points, lines, curves and surfaces.
    pub ignored: Tally,
    /// Faces of fewer than three corners.
    pub thin: Tally,
    /// Faces that are to look smooth.
    pub smooth: Tally,
    /// Statements that are not known, by their keywords.
    pub unknown: Tally,
    /// What follows the coordinates of vertices.
    pub extras: Extras,
    /// `vn`, NaN where they are no numbers.
    normals: Vec<Vec3>,
    state: State,
}

/// Different names in order of appearance, and the line each appeared on first.
#[derive(Debug, Default)]
pub(crate) struct Names {
    pub list: Vec<(String, usize)>,
    index: HashMap<String, usize>,
}

impl Names {
    fn intern(&mut self, name: &str, line: usize) -> usize {
        if let Some(&index) = self.index.get(name) {
            return index;
        }
        self.index.insert(name.to_owned(), self.list.len());
        self.list.push((name.to_owned(), line));
        self.list.len() - 1
    }
}

/// Current object and material, and those last written to the clean text.
#[derive(Debug, Default)]
struct State {
    material: Option<usize>,
    /// Whether a smoothing group is on.
    is_smooth: bool,
    written_object: Option<usize>,
    written_material: Option<usize>,
    /// Line and value of the largest index so far, counted from 1.
    largest: (usize, usize),
}

/// Checks an OBJ's text; `file` is its name for messages.
pub(crate) fn check(file: &str, text: &str) -> Result<ObjText, SceneError> {
    let mut obj = ObjText::default();
    lines::refuse_one_line(file, text, &["v", "f", "vt", "vn"])?;
    let mut corners = Vec::new();
    for statement in lines::statements(text) {
        match statement.keyword() {
            "v" => obj.vertex(file, &statement)?,
            "f" | "fo" => obj.face(file, &statement, &mut corners)?,
            "o" | "g" => obj.objects.begin(&statement),
            "vn" => obj.normals.push(vector(&statement)),
            "s" => obj.state.is_smooth = !matches!(statement.words().next(), None | Some("off" | "0")),
            "usemtl" => {
                obj.state.material = Some(obj.materials.intern(statement.material(), statement.line));
            }
            "mtllib" => obj.libraries.push((statement.line, statement.name(file)?.to_owned())),
            "p" | "l" | "curv" | "curv2" | "surf" | "bsp" | "bzp" | "cdc" | "cdp" => obj.ignored.add(statement.line),
            keyword if WITHOUT_EFFECT.contains(&keyword) => {}
            keyword => obj.unknown.add_named(statement.line, keyword),
        }
    }
    obj.check_range(file)?;
    Ok(obj)
}

impl ObjText {
    /// The text for the reader: one library, all vertices, then the faces under numbered objects and materials.
    pub fn clean_text(&self) -> String {
        format!("mtllib all\n{}{}", self.positions, self.faces)
    }

    fn vertex(&mut self, file: &str, statement: &Statement) -> Result<(), SceneError> {
        let mut found = 0;
        self.positions.push('v');
        for word in statement.words().take(3) {
            statement.number(file, word)?;
            self.positions.push(' ');
            self.positions.push_str(word);
            found += 1;
        }
        self.positions.push('\n');
        self.vertices += 1;
        match found {
            3 => {
                self.extras.read(statement, self.vertices - 1);
                Ok(())
            }
            _ => Err(statement.malformed(file, "three coordinates", &found.to_string())),
        }
    }

    fn face(&mut self, file: &str, statement: &Statement, corners: &mut Vec<usize>) -> Result<(), SceneError> {
        corners.clear();
        let (mut first, mut is_smooth) = (None, false);
        for word in statement.words() {
            let corner = self.corner(file, statement, word)?;
            corners.push(corner.position);
            if let Some(normal) = corner.normal {
                is_smooth |= first.get_or_insert(normal).distance(normal) > ONE_NORMAL;
            }
        }
        let (place, found) = (|| Place::line(file, statement.line), corners.len());
        let limit = crate::scene::polygon::MOST_CORNERS;
        match found {
            // They enclose nothing, and exporters write them.
            0..3 => {
                self.thin.add(statement.line);
                return Ok(());
            }
            n if n > limit => {
                return Err(SceneError::TooManyCorners { place: place(), found, limit });
            }
            _ => {}
        }
        if is_smooth || (self.state.is_smooth && first.is_none()) {
            self.smooth.add(statement.line);
        }
        self.write_state(statement.line);
        self.faces.push('f');
        for corner in corners {
            let _ = write!(self.faces, " {corner}");
        }
        self.faces.push('\n');
        self.face_lines.push(statement.line);
        Ok(())
    }

    /// The vertex of `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&mut self, file: &str, statement: &Statement, word: &str) -> Result<Corner, SceneError> {
        let mut parts = word.split('/');
        let position = integer(file, statement, word, parts.next().unwrap_or(""))?;
        let mut other = || match parts.next() {
            None | Some("") => Ok(0),
            Some(part) => integer(file, statement, word, part),
        };
        let normal = (other()?, other()?).1;
        if parts.next().is_some() {
            return Err(statement.malformed(file, "corners of the form v, v/vt, v//vn or v/vt/vn", &shorten(word)));
        }
        let index = absolute(position, self.vertices);
        if index == 0 {
            return Err(self.out_of_range(file, statement.line, position.to_string()));
        }
        if index > self.state.largest.1 {
            self.state.largest = (statement.line, index);
        }
        let normal = self.normals.get(absolute(normal, self.normals.len()).wrapping_sub(1)).copied();
        Ok(Corner { position: index, normal: normal.filter(|normal| normal.is_finite()) })
    }

    /// Names the object and material of the faces that follow, where they changed.
    fn write_state(&mut self, line: usize) {
        let object = self.objects.current();
        if self.state.written_object != Some(object) {
            let _ = writeln!(self.faces, "o {object}");
            self.state.written_object = Some(object);
        }
        let state = &mut self.state;
        match state.material {
            None => self.bare.add(line),
            Some(index) if state.written_material != Some(index) => {
                let _ = writeln!(self.faces, "usemtl {index}");
                state.written_material = Some(index);
            }
            Some(_) => {}
        }
    }

    fn check_range(&self, file: &str) -> Result<(), SceneError> {
        let (line, index) = self.state.largest;
        if index > self.vertices {
            return Err(self.out_of_range(file, line, index.to_string()));
        }
        Ok(())
    }

    fn out_of_range(&self, file: &str, line: usize, index: String) -> SceneError {
        SceneError::IndexOutOfRange { place: Place::line(file, line), index, vertices: self.vertices }
    }
}

/// A corner of a face.
struct Corner {
    /// Of the vertex, counted from 1.
    position: usize,
    /// Where it has one that is there.
    normal: Option<Vec3>,
}

/// An index counted from 1, or backwards from -1 among so many; 0 where there is none.
pub(crate) fn absolute(index: i64, so_far: usize) -> usize {
    let from_start = if index < 0 { (so_far as i64).saturating_add(index).saturating_add(1) } else { index };
    usize::try_from(from_start).unwrap_or(0)
}

/// The three numbers of a statement; NaN where they are none.
fn vector(statement: &Statement) -> Vec3 {
    let mut words = statement.words().map(|word| word.parse().unwrap_or(f32::NAN));
    let mut next = || words.next().unwrap_or(f32::NAN);
    Vec3::new(next(), next(), next()).normalize_or(Vec3::NAN)
}

fn integer(file: &str, statement: &Statement, word: &str, part: &str) -> Result<i64, SceneError> {
    part.parse().map_err(|_| SceneError::NotANumber {
        place: Place::line(file, statement.line),
        statement: statement.keyword().to_owned(),
        word: shorten(word),
    })
}
