//! Wavefront OBJ with its MTL files to polygons, in one pass over the text.
//!
//! Faces whose material is missing are a grey of [`crate::scene::LoadOptions::reflectance`] that emits nothing, under
//! the name that the OBJ has for it, so that a scene file may define more of it; one warning counts the names.
//!
//! | in the files | here |
//! |---|---|
//! | `v` with weight and colour, `vt`, `f`, `o`, `g`, `usemtl`, `mtllib` | modelled |
//! | `newmtl`, `Kd`, `Ke`, `d`, `Tr`, `map_Kd`, `map_Ke`, `map_d`; by request `Ks`, `Ns` | modelled |
//! | `vp` and what else is of curves alone; `bevel`, `lod`, `shadow_obj` and the like | silent |
//! | `Ka`, `map_Ka`, `sharpness`; `Tf`, `Pm`, `Pr`, `illum` of diffuse surfaces; comments | silent |
//! | weights but 1, points, lines, curves, surfaces, normals that differ within a face | said |
//! | `Ks`, `Ni`, metal, coats, mirrors, glass, other textures; what is not known | said |
//! | faces of opacity 0, without area or of two corners; what is defined twice | said |
//! | a missing library, material, image or `Kd`; text that is not UTF-8; shares out of range | said |
//! | numbers that are none or out of range, indices beyond the vertices, broken images | refused |
//! | a text of one line, files of another kind | refused |
//!
//! `lines` parts a text into statements, `statements` reads those of an OBJ and `objects` the names of its parts, `mtl`
//! reads materials, `files` finds MTL files and images.
//!
//! Not handled: normals, curves and surfaces; they are warned of.

mod files;
pub(crate) mod lines;
mod mtl;
mod objects;
mod statements;

use crate::light::Rgb;
use crate::scene::error::{About, Effect, Place, SceneError, Tally, list};
use crate::scene::model::{DEFAULT_GREY, Material, NO_MATERIAL};
use crate::scene::obj::files::{attach_textures, read_libraries};
use crate::scene::obj::lines::Latin;
use crate::scene::obj::mtl::{Libraries, where_uncoloured};
use crate::scene::obj::statements::Statements;
use crate::scene::soup::{Defined, Reflects, SceneInput, Soup, check_rho};

/// Reads an OBJ.
pub(crate) fn read(input: &SceneInput) -> Result<Soup, SceneError> {
    let SceneInput { name, file, bytes, reader, options } = *input;
    let mut latin = Latin::default();
    let text = latin.decode(file, bytes)?;
    let mut obj = statements::read(file, &text)?;
    let Some(first) = obj.polygons.first() else {
        return Err(SceneError::Empty { file: file.to_owned(), dropped: obj.tallies.thin.count });
    };
    let rho = options.reflectance.unwrap_or(DEFAULT_GREY);
    check_rho([f64::from(rho); 3], NO_MATERIAL, || Place::item(file, "line", first.number))?;
    let mut libraries = Libraries::new(options.highlights, !obj.colours.is_empty());
    read_libraries(file, &obj.libraries, reader, &mut latin, &mut libraries)?;
    latin.report(&mut libraries.warnings);
    let grey = format!("{rho} (--reflectance){}", where_uncoloured(!obj.colours.is_empty()));
    let used = find_materials(file, &obj, &mut libraries, rho, &grey);
    let mut soup = Soup {
        name: name.to_owned(),
        file: file.to_owned(),
        item: "line",
        objects: obj.objects.names(),
        materials: libraries.entries.iter().map(|entry| entry.material()).collect(),
        warnings: std::mem::take(&mut libraries.warnings),
        ..Soup::default()
    };
    attach_textures(file, &libraries, &used, &mut soup.materials, reader, &mut soup.warnings)?;
    obj.tallies.report(file, &text, &grey, &mut soup.warnings);
    obj.fill(&mut soup, &used);
    if obj.tallies.bare.count > 0 {
        soup.materials.push(Material::new(NO_MATERIAL, Rgb::splat(rho), Rgb::ZERO));
    }
    if soup.materials.iter().any(Material::has_images) {
        obj.fill_coordinates(&mut soup);
    }
    obj.fill_colours(&mut soup);
    let defined = soup.materials.iter().enumerate().map(|(m, material)| defined(&libraries, material, m)).collect();
    soup.apply_colours(defined);
    Ok(soup)
}

/// What the file defines of a material that vertices may colour. Faces before any usemtl have the one after the last of
/// the libraries.
fn defined(libraries: &Libraries, material: &Material, index: usize) -> Defined {
    let has_image = material.maps.as_ref().is_some_and(|maps| maps.reflectance.is_some());
    let is_defined = has_image || libraries.entries.get(index).is_some_and(|entry| entry.has_kd());
    let rho = if is_defined { Reflects::Defined } else { Reflects::Undefined };
    Defined { rho, mask: material.mask().cloned() }
}

/// For each `usemtl` name of the OBJ, the index of the material. Names that no library defines become greys, with a
/// warning for all of them.
fn find_materials(file: &str, obj: &Statements, libraries: &mut Libraries, rho: f32, grey: &str) -> Vec<usize> {
    let (defined, mut undefined) = (libraries.entries.len(), Tally::default());
    let find = |(name, line): &(String, usize)| {
        libraries.find(name).unwrap_or_else(|| {
            undefined.add(*line);
            libraries.add_grey(name, rho)
        })
    };
    let used = obj.materials.iter().map(find).collect();
    if undefined.count > 0 {
        let names = |of: &[mtl::Entry]| list(of.iter().map(|entry| entry.name.as_str()));
        let (known, added) = libraries.entries.split_at(defined);
        let why = match defined {
            _ if obj.libraries.is_empty() => "the OBJ has no mtllib line".to_owned(),
            0 => "there is no MTL file with materials".to_owned(),
            _ => format!("the MTL files define {}", names(known)),
        };
        let consequence = format!("{} ({why}): reflecting {grey}, emitting nothing", names(added));
        let place = (file, "line");
        undefined.report(
            About::Light(Effect::Guessed),
            place,
            "undefined material",
            &consequence,
            &mut libraries.warnings,
        );
    }
    used
}
