//! glTF 2.0: scenes of triangles under a graph of nodes, as `.glb` or as `.gltf` with its buffers.
//!
//! y is up and metres are the unit, as in glTF; nothing is turned or scaled. What the format allows, and what comes of
//! it:
//!
//! | glTF | here |
//! |---|---|
//! | GLB, JSON with `data:` URIs or files beside it; a byte order mark; zeros behind the JSON | read |
//! | the default scene, else the first, else all nodes without a parent; nodes with matrix or TRS | modelled |
//! | triangles, strips, fans; with indices or without; sparse, quantised (KHR_mesh_quantization) | modelled |
//! | several nodes of one mesh; EXT_mesh_gpu_instancing | modelled: written out once for each |
//! | a skin | modelled, in the pose in which its joints stand, and said |
//! | COLOR_0; TEXCOORD_n of a texture that is shown | modelled |
//! | base colour, factor and texture; KHR_materials_pbrSpecularGlossiness: the diffuse ones | modelled: rho |
//! | a white base colour without a texture; primitives without a material | 0.8, and said |
//! | `alphaMode`, `alphaCutoff`, `doubleSided` | modelled |
//! | emissive factor and texture, KHR_materials_emissive_strength | modelled: E |
//! | PNG, JPEG, WebP (EXT_texture_webp), BMP; wraps, nearest `magFilter`, KHR_texture_transform | modelled |
//! | perspective cameras; KHR_lights_punctual, candela and lux over 683 lm/W | modelled |
//! | metal, gloss, specular colours, other textures, smooth normals, COLOR_1 and on | said |
//! | soft edges and ranges of lights, lights of other types, orthographic cameras | said |
//! | morph targets of a weight that is not 0, animations, points and lines | said |
//! | images that are not there; KTX2 (KHR_texture_basisu), AVIF, DDS and the like | said, with what counts instead |
//! | other extensions that are used and change what is seen (`extensions`) | said, each with what is not there |
//! | `extras`; attributes that begin with `_`, tangents; `asset` beyond the version | silent |
//! | `target`, `min`, `max`, `minFilter`, `mimeType`, `aspectRatio`, `znear`, `zfar` | silent |
//! | unknown `magFilter`, `wrapS`, `wrapT`, `alphaMode`: the default counts | silent |
//! | what no mesh shown names: materials, images, views, accessors, buffers that are not there | silent |
//! | extensions that change nothing in a picture, required or not; compression beside which all is given | silent |
//! | other extensions that are required; glTF 1; what is not JSON | refused |
//! | of what is shown: indices beyond lists, types that do not fit, numbers beyond buffers, lost buffers | refused |
//! | of what is shown: rho outside 0..1, negative emission, transforms that are not finite, broken images | refused |
//! | nodes with two parents, circles of nodes; instances whose attributes differ in number | refused |
//!
//! `schema` is what is read of the JSON, `document` finds it, `buffers` and `accessors` read numbers, `nodes` places
//! them with cameras and lights, `placements` by instances and skins, `images`, `materials` and `geometry` take what is
//! modelled; `ignored` and `extensions` say what is not. Only place for `data_url`.
//!
//! Not handled: what the table says of it.
//!
//! Source: Khronos Group, *glTF 2.0 Specification*, version 2.0.1 (ISO/IEC 12113:2022).

mod accessors;
mod buffers;
mod document;
mod extensions;
mod fault;
mod geometry;
mod ignored;
mod images;
mod materials;
mod nodes;
mod placements;
mod schema;

use crate::scene::error::SceneError;
use crate::scene::gltf::buffers::Data;
use crate::scene::gltf::document::{parse, split};
use crate::scene::gltf::extensions::lost;
use crate::scene::gltf::fault::Fault;
use crate::scene::gltf::geometry::Geometry;
use crate::scene::gltf::ignored::{Ignored, Kind};
use crate::scene::gltf::images::Images;
use crate::scene::gltf::materials::{Materials, materials, warn_of_white};
use crate::scene::gltf::nodes::{cameras, lights, placed};
use crate::scene::gltf::schema::Root;
use crate::scene::soup::{Reflects, SceneInput, Soup};
use crate::scene::unit::LengthUnit;

/// Reads a glTF file, buffers and images in files of their own included.
///
/// Primitives without a material reflect what the options give for faces without, else what white does.
pub(crate) fn read(input: &SceneInput) -> Result<Soup, SceneError> {
    let SceneInput { name, file, bytes, reader, options } = *input;
    let wrong = |fault: Fault| fault.of(file);
    let (json, binary) = split(bytes).map_err(|message| wrong(message.into()))?;
    let root = parse(file, json)?;
    let data = Data::new(file, &root, binary, reader);
    let nodes = placed(&root).map_err(wrong)?;
    let mut ignored = Ignored::default();
    let read = materials(&root, &nodes, options.reflectance, &mut Images::new(&data), &mut ignored)?;
    let Materials { list: materials, sets, defined } = read;
    let is_white: Vec<bool> = defined.iter().map(|defined| defined.rho == Reflects::Undefined).collect();
    let cameras = cameras(file, &root, &nodes, &mut ignored).map_err(wrong)?;
    let lights = lights(file, &root, &nodes, &mut ignored).map_err(wrong)?;
    let mut soup = Soup {
        name: name.to_owned(),
        file: file.to_owned(),
        item: "triangle",
        unit: Some(LengthUnit::Metre),
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
    ignore(&root, &mut ignored);
    ignored.report(file, &mut soup.warnings);
    Ok(soup)
}

/// Names animations and extensions that are not modelled.
fn ignore(root: &Root, ignored: &mut Ignored) {
    for animation in &root.animations {
        ignored.add(Kind::Animations, animation.name.as_deref().unwrap_or("without a name"));
    }
    for extension in &root.extensions_used {
        if let Some(lost) = lost(extension) {
            ignored.add(Kind::Extensions(lost), extension);
        }
    }
}
