//! The check of an OBJ's text, line by line, and the clean text that is handed to the reader.
//!
//! Kept: `v` (three coordinates), `f` (vertex indices, made absolute), `usemtl`, `o`, `g`, `mtllib`. Vertex weights and
//! colours, `vn`, `s` and unknown statements are ignored, `vt` is left to [`crate::scene::obj_coordinates`]; points,
//! lines and free-form geometry are counted for a warning. Indices may point forward: the range is checked at the end.
//!
//! Source: Wavefront, *Object Files (.obj)*, Advanced Visualizer manual, appendix B1.
//!
//! Not handled: materials; their names are resolved after the check.

use std::collections::HashMap;
use std::fmt::Write;

use crate::scene::error::{Place, SceneError};
use crate::scene::lines;
use crate::scene::lines::{Statement, shorten};
use crate::scene::warnings::Tally;

/// What the check found. Polygon k of the clean text is `face_lines[k]`.
#[derive(Debug, Default)]
pub(crate) struct ObjText {
    positions: String,
    faces: String,
    /// Number of `v` lines.
    pub vertices: usize,
    /// The line of each face, in order.
    pub face_lines: Vec<usize>,
    /// Names of objects and groups that have faces, in order of their first face.
    pub objects: Names,
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
    object: Option<(String, usize)>,
    material: Option<usize>,
    written_object: Option<usize>,
    written_material: Option<usize>,
    /// Line and value of the largest index so far, counted from 1.
    largest: (usize, usize),
}

/// Checks an OBJ's text; `file` is its name for messages.
pub(crate) fn check(file: &str, text: &str) -> Result<ObjText, SceneError> {
    let mut obj = ObjText::default();
    let mut corners = Vec::new();
    for statement in lines::statements(text) {
        match statement.keyword() {
            "v" => obj.vertex(file, &statement)?,
            "f" | "fo" => obj.face(file, &statement, &mut corners)?,
            "o" | "g" => obj.state.object = Some((statement.rest().to_owned(), statement.line)),
            "usemtl" => {
                obj.state.material = Some(obj.materials.intern(statement.material(), statement.line));
            }
            "mtllib" => obj.libraries.push((statement.line, statement.name(file)?.to_owned())),
            "p" | "l" | "curv" | "curv2" | "surf" => obj.ignored.add(statement.line),
            _ => {}
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
            3 => Ok(()),
            _ => Err(statement.malformed(file, "three coordinates", &found.to_string())),
        }
    }

    fn face(&mut self, file: &str, statement: &Statement, corners: &mut Vec<usize>) -> Result<(), SceneError> {
        corners.clear();
        for word in statement.words() {
            corners.push(self.corner(file, statement, word)?);
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
        self.write_state(statement.line);
        self.faces.push('f');
        for corner in corners {
            let _ = write!(self.faces, " {corner}");
        }
        self.faces.push('\n');
        self.face_lines.push(statement.line);
        Ok(())
    }

    /// The vertex index of `v`, `v/vt`, `v//vn` or `v/vt/vn`, made absolute, counted from 1.
    fn corner(&mut self, file: &str, statement: &Statement, word: &str) -> Result<usize, SceneError> {
        let mut parts = word.split('/');
        let position = integer(file, statement, word, parts.next().unwrap_or(""))?;
        for other in parts.by_ref().take(2).filter(|part| !part.is_empty()) {
            integer(file, statement, word, other)?;
        }
        if parts.next().is_some() {
            return Err(statement.malformed(file, "corners of the form v, v/vt, v//vn or v/vt/vn", &shorten(word)));
        }
        let absolute = match position {
            ..0 => i64::try_from(self.vertices).unwrap_or(i64::MAX).saturating_add(position + 1),
            _ => position,
        };
        let index = usize::try_from(absolute).unwrap_or(0);
        if index == 0 {
            return Err(self.out_of_range(file, statement.line, position.to_string()));
        }
        if index > self.state.largest.1 {
            self.state.largest = (statement.line, index);
        }
        Ok(index)
    }

    /// Names the object and material of the faces that follow, where they changed.
    fn write_state(&mut self, line: usize) {
        if let Some((name, at)) = self.state.object.take() {
            let name = if name.is_empty() { "default" } else { &name };
            self.start_object(name, at);
        } else if self.objects.list.is_empty() {
            self.start_object("default", line);
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

    fn start_object(&mut self, name: &str, line: usize) {
        let index = self.objects.intern(name, line);
        if self.state.written_object != Some(index) {
            let _ = writeln!(self.faces, "o {index}");
            self.state.written_object = Some(index);
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

fn integer(file: &str, statement: &Statement, word: &str, part: &str) -> Result<i64, SceneError> {
    part.parse().map_err(|_| SceneError::NotANumber {
        place: Place::line(file, statement.line),
        statement: statement.keyword().to_owned(),
        word: shorten(word),
    })
}
