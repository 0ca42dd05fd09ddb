//! Wavefront OBJ with its MTL files to polygons. Only place for `tobj`, which sees only text already checked.
//!
//! Faces whose material is missing are a grey of [`crate::scene::LoadOptions::reflectance`] that emits nothing, under
//! the name that the OBJ has for it, so that a scene file may say more of it; one warning counts the names.
//!
//! tobj would panic on `Ke 10`, hide a failed library, pass unknown materials and NaN, and fan concave polygons; the
//! text it gets holds none of these and it is not asked to triangulate. The k-th polygon it returns is the k-th `f`
//! line of the check, which gives every polygon its line number.
//!
//! Not handled: normals, curves and surfaces; they are warned of.

use glam::DVec3;

use crate::light::{Gloss, Rgb};
use crate::scene::build::{Polygon, Soup};
use crate::scene::encoding::Latin;
use crate::scene::error::{Place, SceneError};
use crate::scene::input::SceneInput;
pub(crate) use crate::scene::libraries::Reader;
use crate::scene::lines::{NO_MATERIAL, list};
use crate::scene::material_checks::check_rho;
use crate::scene::mtl::{Libraries, where_uncoloured};
use crate::scene::obj_text::ObjText;
use crate::scene::vertex_colours::{Reflects, Said};
use crate::scene::warnings::Tally;
use crate::scene::{Material, libraries, mtl_textures, obj_colours, obj_coordinates, obj_text, vertex_colours};

/// Reads an OBJ.
pub(crate) fn read(input: &SceneInput) -> Result<Soup, SceneError> {
    let SceneInput { name, file, bytes, reader, options } = *input;
    let mut latin = Latin::default();
    let decoded = latin.decode(file, bytes)?;
    let text = obj_text::check(file, &decoded)?;
    if text.face_lines.is_empty() {
        return Err(SceneError::Empty { file: file.to_owned(), dropped: text.thin.count });
    }
    let rho = options.reflectance;
    check_rho([f64::from(rho); 3], NO_MATERIAL, || Place::item(file, "line", text.face_lines[0]))?;
    let coloured = !text.extras.colours.is_empty();
    let none = Libraries::new(options.highlights, coloured);
    let mut libraries = libraries::read(file, &text.libraries, reader, &mut latin, none)?;
    latin.report(&mut libraries.warnings);
    let used = find_materials(file, &text, &mut libraries, rho);
    let (models, materials) = parse(file, &text, &libraries, &used)?;
    let mut soup = Soup {
        name: name.to_owned(),
        file: file.to_owned(),
        item: "line",
        objects: text.objects.names(),
        materials: libraries.names().zip(libraries.gloss()).zip(&materials).map(material).collect(),
        warnings: std::mem::take(&mut libraries.warnings),
        ..Soup::default()
    };
    mtl_textures::attach(file, &libraries, &used, &mut soup.materials, reader, &mut soup.warnings)?;
    soup.take_warnings(&text, &decoded, rho);
    soup.take_models(&text, &models, rho)?;
    if soup.materials.iter().any(|material| material.maps.as_ref().is_some_and(|maps| maps.has_images())) {
        obj_coordinates::take(&mut soup, &decoded);
    }
    obj_colours::take(&mut soup, &decoded, &text.extras.colours);
    let said = (0..soup.materials.len()).map(|m| said(&libraries, &soup.materials[m], m)).collect();
    vertex_colours::put_on(&mut soup, said);
    Ok(soup)
}

/// What the file says of a material that vertices may colour.
fn said(libraries: &Libraries, material: &Material, index: usize) -> Said {
    let maps = material.maps.as_ref();
    let has_image = maps.is_some_and(|maps| maps.reflectance.is_some());
    // Faces before any usemtl have the material after the last of the libraries.
    let is_said = has_image || index < libraries.names().count() && libraries.factors(index)[0];
    let rho = if is_said { Reflects::Said } else { Reflects::Unsaid };
    Said { rho, mask: maps.and_then(|maps| maps.mask.clone()) }
}

/// For each `usemtl` name of the OBJ, the index of the material. Names that no library defines become greys, with a
/// warning for all of them.
fn find_materials(file: &str, text: &ObjText, libraries: &mut Libraries, rho: f32) -> Vec<usize> {
    let (defined, mut undefined) = (libraries.names().count(), Tally::default());
    let find = |(name, line): &(String, usize)| {
        libraries.find(name).unwrap_or_else(|| {
            undefined.add(*line);
            libraries.add_grey(name, rho)
        })
    };
    let used = text.materials.list.iter().map(find).collect();
    if undefined.count > 0 {
        let why = match defined {
            _ if text.libraries.is_empty() => "the OBJ has no mtllib line".to_owned(),
            0 => "there is no MTL file with materials".to_owned(),
            _ => format!("the MTL files define {}", list(libraries.names().take(defined))),
        };
        let names = list(libraries.names().skip(defined));
        let extent = where_uncoloured(!text.extras.colours.is_empty());
        let consequence = format!("{names} ({why}): reflecting {rho} (--reflectance){extent}, emitting nothing");
        undefined.report(file, "line", "undefined material", &consequence, &mut libraries.warnings);
    }
    used
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

fn material(((name, gloss), read): ((&str, Option<Gloss>), &tobj::Material)) -> Material {
    let rgb = |value: Option<[f64; 3]>| DVec3::from_array(value.unwrap_or_default()).as_vec3();
    Material { gloss, ..Material::new(name, rgb(read.diffuse), rgb(read.emissive)) }
}

impl Soup {
    fn take_warnings(&mut self, text: &ObjText, decoded: &str, rho: f32) {
        let ignored = "points, lines, curves and surfaces are not modelled";
        text.ignored.report(&self.file, "line", "statement", ignored, &mut self.warnings);
        let thin = "left out: with fewer than three corners they have no area";
        text.thin.report(&self.file, "line", "face", thin, &mut self.warnings);
        let smooth = "faces are flat: smooth shading (vn, s) is not modelled";
        text.smooth.report(&self.file, "line", "smooth face", smooth, &mut self.warnings);
        let unknown = "neither modelled nor known to change nothing, and left out";
        text.unknown.report_keywords(&self.file, unknown, &mut self.warnings);
        text.extras.report(&self.file, decoded, &mut self.warnings);
        let extent = where_uncoloured(!text.extras.colours.is_empty());
        let bare = format!("no usemtl before it; material `{NO_MATERIAL}` reflects {rho} (--reflectance){extent}");
        text.bare.report(&self.file, "line", "face", &bare, &mut self.warnings);
    }

    /// Appends tobj's models and checks that its polygons are those of the text.
    fn take_models(&mut self, text: &ObjText, models: &[tobj::Model], rho: f32) -> Result<(), SceneError> {
        let bare = self.materials.len() as u32;
        if text.bare.count > 0 {
            self.materials.push(Material::new(NO_MATERIAL, Rgb::splat(rho), Rgb::ZERO));
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
