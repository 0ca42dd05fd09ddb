//! From the bytes of a glTF file to polygons.
//!
//! Not handled: what a scene is checked for whatever it was read from; see [`crate::scene::build`].

use crate::light::Rgb;
use crate::scene::build::Soup;
use crate::scene::error::SceneError;
use crate::scene::gltf::accessors::Data;
use crate::scene::gltf::cameras::cameras;
use crate::scene::gltf::container::{buffers, split};
use crate::scene::gltf::document::{READ, parse};
use crate::scene::gltf::geometry::Geometry;
use crate::scene::gltf::ignored::Ignored;
use crate::scene::gltf::lights::lights;
use crate::scene::gltf::materials::{Materials, materials, warn_of_white};
use crate::scene::gltf::nodes::placed;
use crate::scene::gltf::textures::Images;
use crate::scene::input::SceneInput;
use crate::scene::vertex_colours::{Reflects, Said};
use crate::scene::{Material, NO_MATERIAL, vertex_colours};

/// Reads a glTF file, buffers and images in files of their own included.
///
/// Primitives without a material reflect what the options say of faces without.
pub(crate) fn read(input: &SceneInput) -> Result<Soup, SceneError> {
    let SceneInput { name, file, bytes, reader, options } = *input;
    let wrong = |message: String| SceneError::Gltf { file: file.to_owned(), message };
    let container = split(bytes).map_err(wrong)?;
    let root = parse(file, container.json)?;
    let buffers = buffers(file, &root, container.binary, reader)?;
    let nodes = placed(&root).map_err(wrong)?;
    let mut ignored = Ignored::default();
    let data = Data { root: &root, buffers: &buffers };
    let mut images = Images::new(file, &data, reader);
    let Materials { list: mut materials, mut sets, mut said } = materials(&root, &mut images, &mut ignored)?;
    let is_white: Vec<bool> = said.iter().map(|said| said.rho == Reflects::UnsaidWhite).collect();
    materials.push(Material::new(NO_MATERIAL, Rgb::splat(options.reflectance), Rgb::ZERO));
    sets.push(None);
    said.push(Said { rho: Reflects::UnsaidWhite, mask: None });
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
    let coloured = vertex_colours::put_on(&mut soup, said);
    warn_of_white(&mut soup, &is_white, &coloured);
    drop_unused_last(&mut soup);
    for animation in &root.animations {
        ignored.add("animations", animation.name.as_deref().unwrap_or("without a name"));
    }
    for extension in root.extensions_used.iter().filter(|used| !READ.contains(&used.as_str())) {
        ignored.add("extensions", extension);
    }
    ignored.report(file, &mut soup.warnings);
    Ok(soup)
}

/// Takes the material of primitives without any away where there are none.
fn drop_unused_last(soup: &mut Soup) {
    let last = soup.materials.len() as u32 - 1;
    if soup.polygons.iter().all(|polygon| polygon.material != last) {
        soup.materials.pop();
    }
}
