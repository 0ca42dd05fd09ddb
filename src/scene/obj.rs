//! Wavefront OBJ with its MTL files to polygons. Only place for `tobj`, which sees only text already checked.
//!
//! tobj would panic on `Ke 10`, hide a failed library, pass unknown materials and NaN, and fan concave polygons; the
//! text it gets holds none of these and it is not asked to triangulate. The k-th polygon it returns is the k-th `f`
//! line of the check, which gives every polygon its line number.
//!
//! Not handled: textures, normals, curves and surfaces; they are warned of or ignored.

use std::borrow::Cow;
use std::collections::HashSet;
use std::io;

use glam::DVec3;

use crate::light::Rgb;
use crate::scene::build::{Polygon, Soup};
use crate::scene::error::{Place, SceneError};
use crate::scene::lines::{list, shorten};
use crate::scene::mtl::{DEFAULT_RHO, Libraries};
use crate::scene::obj_text::ObjText;
use crate::scene::{Material, obj_text};

/// Reads a file named relative to the OBJ or scene file.
pub(crate) type Reader<'a> = &'a dyn Fn(&str) -> io::Result<Cow<'a, [u8]>>;

/// The material of faces before the first `usemtl`: reflects [`DEFAULT_RHO`].
pub const NO_MATERIAL: &str = "(none)";

/// The most words of an `mtllib` line that are tried as file names.
const MOST_WORDS: usize = 32;

/// Reads an OBJ: `name` for the scene, `file` for messages.
pub(crate) fn read(name: &str, file: &str, bytes: &[u8], reader: Reader) -> Result<Soup, SceneError> {
    let text = obj_text::check(file, bytes)?;
    if text.face_lines.is_empty() {
        return Err(SceneError::Empty { file: file.to_owned(), dropped: 0 });
    }
    let libraries = read_libraries(file, &text, reader)?;
    let used = resolve_materials(file, &text, &libraries)?;
    let (models, materials) = parse(file, &text, &libraries, &used)?;
    let mut soup = Soup {
        name: name.to_owned(),
        file: file.to_owned(),
        item: "line",
        objects: text.objects.list.iter().map(|(name, _)| name.clone()).collect(),
        materials: libraries.names().zip(&materials).map(|(name, m)| material(name, m)).collect(),
        ..Soup::default()
    };
    soup.take_warnings(&text, libraries);
    soup.take_models(&text, &models)?;
    Ok(soup)
}

fn read_libraries(file: &str, text: &ObjText, reader: Reader) -> Result<Libraries, SceneError> {
    let mut libraries = Libraries::default();
    // A library named again says nothing new; reading it for each of many lines would take forever.
    let mut known = HashSet::new();
    for (line, names) in text.libraries.iter().filter(|(_, n)| known.insert(n)) {
        let found = find_libraries(names, reader);
        let found = found.map_err(|source| SceneError::MissingLibrary {
            place: Place::line(file, *line),
            name: shorten(names),
            source,
        })?;
        for (name, bytes) in found {
            libraries.read(&name, &bytes)?;
        }
    }
    Ok(libraries)
}

/// The files of one `mtllib` line. File names may hold spaces, and spaces part file names: the longest run of words
/// that is a file is taken first.
fn find_libraries<'a>(names: &str, reader: Reader<'a>) -> io::Result<Vec<(String, Cow<'a, [u8]>)>> {
    let failure = match read_either_slash(names, reader) {
        Ok(bytes) => return Ok(vec![(names.to_owned(), bytes)]),
        Err(error) => error,
    };
    let words: Vec<&str> = names.split_whitespace().take(MOST_WORDS + 1).collect();
    let (mut found, mut start) = (Vec::new(), 0);
    while start < words.len() && words.len() <= MOST_WORDS {
        let runs = (start + 1..=words.len()).rev().map(|end| (end, words[start..end].join(" ")));
        let mut files = runs.filter_map(|(end, run)| Some((end, read_either_slash(&run, reader).ok()?, run)));
        let Some((end, bytes, run)) = files.next() else {
            return Err(failure);
        };
        found.push((run, bytes));
        start = end;
    }
    if found.is_empty() { Err(failure) } else { Ok(found) }
}

/// Some programs write `\` between folders.
fn read_either_slash<'a>(name: &str, reader: Reader<'a>) -> io::Result<Cow<'a, [u8]>> {
    reader(name).or_else(|error| {
        if !name.contains('\\') {
            return Err(error);
        }
        reader(&name.replace('\\', "/")).map_err(|_| error)
    })
}

/// For each `usemtl` name of the OBJ, the index of the material.
fn resolve_materials(file: &str, text: &ObjText, libraries: &Libraries) -> Result<Vec<usize>, SceneError> {
    let resolve = |(name, line): &(String, usize)| {
        let (place, shown) = (Place::line(file, *line), shorten(name));
        match libraries.find(name) {
            Some(index) => Ok(index),
            None if text.libraries.is_empty() => Err(SceneError::NoLibrary { place, name: shown }),
            None => Err(SceneError::UnknownMaterial { place, name: shown, known: list(libraries.names()) }),
        }
    };
    text.materials.list.iter().map(resolve).collect()
}

type Parsed = (Vec<tobj::Model>, Vec<tobj::Material>);

/// Hands the clean text to tobj. Materials go by the number of their `usemtl` name, unused ones by `u` and their own.
fn parse(file: &str, text: &ObjText, libraries: &Libraries, used: &[usize]) -> Result<Parsed, SceneError> {
    let mut names: Vec<Option<usize>> = vec![None; libraries.names().count()];
    for (number, &material) in used.iter().enumerate() {
        names[material] = Some(number);
    }
    let mtl = libraries.clean_text(|i| names[i].map_or_else(|| format!("u{i}"), |number| number.to_string()));
    let fault = |error: tobj::LoadError| SceneError::Reader { file: file.to_owned(), message: error.to_string() };
    let (models, materials) =
        tobj::load_obj_buf(&mut text.clean_text().as_bytes(), &tobj::LoadOptions::default(), |_| {
            tobj::load_mtl_buf(&mut mtl.as_bytes())
        })
        .map_err(fault)?;
    Ok((models, materials.map_err(fault)?))
}

fn material(name: &str, read: &tobj::Material) -> Material {
    let rgb = |value: Option<[f64; 3]>| DVec3::from_array(value.unwrap_or_default()).as_vec3();
    Material::new(name, rgb(read.diffuse), rgb(read.emissive))
}

impl Soup {
    fn take_warnings(&mut self, text: &ObjText, libraries: Libraries) {
        self.warnings = libraries.warnings;
        let ignored = "points, lines, curves and surfaces are not modelled";
        text.ignored.report(&self.file, "line", "statement", ignored, &mut self.warnings);
        let bare = format!("no usemtl before it; material `{NO_MATERIAL}` reflects {DEFAULT_RHO}");
        text.bare.report(&self.file, "line", "face", &bare, &mut self.warnings);
    }

    /// Appends tobj's models and checks that its polygons are those of the text.
    fn take_models(&mut self, text: &ObjText, models: &[tobj::Model]) -> Result<(), SceneError> {
        let bare = self.materials.len() as u32;
        if text.bare.count > 0 {
            self.materials.push(Material::new(NO_MATERIAL, Rgb::splat(DEFAULT_RHO), Rgb::ZERO));
        }
        let mut lines = text.face_lines.iter();
        for tobj::Model { mesh, name } in models {
            let offset = self.vertices.len() as u32;
            let points = mesh.positions.chunks_exact(3).map(|p| DVec3::new(p[0], p[1], p[2]));
            self.vertices.extend(points);
            self.corners.extend(mesh.indices.iter().map(|index| offset + index));
            let object = name.parse().unwrap_or(0);
            let material = mesh.material_id.map_or(bare, |id| id as u32);
            for corners in arities(mesh) {
                let number = *lines.next().ok_or_else(|| self.mismatch())?;
                self.polygons.push(Polygon { corners, material, object, number });
            }
        }
        let all = self.polygons.iter().map(|polygon| polygon.corners).sum::<usize>();
        let complete = lines.next().is_none() && all == self.corners.len();
        complete.then_some(()).ok_or_else(|| self.mismatch())
    }

    fn mismatch(&self) -> SceneError {
        let message = "it returned other faces than the file has".to_owned();
        SceneError::Reader { file: self.file.clone(), message }
    }
}

/// Corners of each polygon; tobj leaves the list out where all are triangles.
fn arities(mesh: &tobj::Mesh) -> Box<dyn Iterator<Item = usize> + '_> {
    if mesh.face_arities.is_empty() {
        return Box::new(std::iter::repeat_n(3, mesh.indices.len() / 3));
    }
    Box::new(mesh.face_arities.iter().map(|&n| n as usize))
}
