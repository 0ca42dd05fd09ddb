//! glTF 2.0: scenes of triangles under a graph of nodes, as `.glb` or as `.gltf` with its buffers.
//!
//! `document` finds and checks JSON and bytes, `accessors` reads numbers within the buffers, `nodes` places them with
//! cameras and lights, `materials` and `geometry` take what is modelled; one warning names what is not. y is up and
//! metres are the unit, as in glTF; nothing is turned or scaled. Only place for `gltf_json` and `data_url`.
//!
//! Not handled: gloss and metal, bump maps, skins, morph targets, animation, compressed geometry.
//!
//! Source: Khronos Group, *glTF 2.0 Specification*, version 2.0.1 (ISO/IEC 12113:2022).

mod accessors;
mod document;
mod geometry;
mod materials;
mod nodes;

use crate::light::Rgb;
use crate::scene::error::SceneError;
use crate::scene::gltf::accessors::Data;
use crate::scene::gltf::document::{Ignored, READ, buffers, parse, split};
use crate::scene::gltf::geometry::Geometry;
use crate::scene::gltf::materials::{Images, Materials, materials, warn_of_white};
use crate::scene::gltf::nodes::{cameras, lights, placed};
use crate::scene::model::{Material, NO_MATERIAL};
use crate::scene::soup::{Defined, Reflects, SceneInput, Soup};

/// Reads a glTF file, buffers and images in files of their own included.
///
/// Primitives without a material reflect what the options give for faces without.
pub(crate) fn read(input: &SceneInput) -> Result<Soup, SceneError> {
    let SceneInput { name, file, bytes, reader, options } = *input;
    let wrong = |message: String| SceneError::Gltf { file: file.to_owned(), message };
    let (json, binary) = split(bytes).map_err(wrong)?;
    let root = parse(file, json)?;
    let buffers = buffers(file, &root, binary, reader)?;
    let nodes = placed(&root).map_err(wrong)?;
    let mut ignored = Ignored::default();
    let data = Data { root: &root, buffers: &buffers };
    let mut images = Images::new(file, &data, reader);
    let Materials { list: mut materials, mut sets, mut defined } = materials(&root, &mut images, &mut ignored)?;
    let is_white: Vec<bool> = defined.iter().map(|defined| defined.rho == Reflects::UndefinedWhite).collect();
    materials.push(Material::new(NO_MATERIAL, Rgb::splat(options.reflectance), Rgb::ZERO));
    sets.push(None);
    defined.push(Defined { rho: Reflects::UndefinedWhite, mask: None });
    let cameras = cameras(file, &root, &nodes, &mut ignored)?;
    let lights = lights(file, &root, &nodes, &mut ignored)?;
    let mut soup = Soup {
        name: name.to_owned(),
        file: file.to_owned(),
        item: "triangle",
        materials,
        cameras,
        lights,
        ..Soup::default()
    };
    Geometry { data: &data, soup: &mut soup, ignored: &mut ignored, sets: &sets }.take(&nodes).map_err(wrong)?;
    let coloured = soup.apply_colours(defined);
    warn_of_white(&mut soup, &is_white, &coloured);
    let unused = soup.materials.len() as u32 - 1;
    if soup.polygons.iter().all(|polygon| polygon.material != unused) {
        soup.materials.pop();
    }
    for animation in &root.animations {
        ignored.add("animations", animation.name.as_deref().unwrap_or("without a name"));
    }
    for extension in root.extensions_used.iter().filter(|used| !READ.contains(&used.as_str())) {
        ignored.add("extensions", extension);
    }
    ignored.report(file, &mut soup.warnings);
    Ok(soup)
}
