//! glTF 2.0: scenes of triangles under a graph of nodes, as `.glb` or as `.gltf` with its buffers.
//!
//! `container` finds JSON and bytes, `document` checks the JSON, `accessors` reads numbers within the buffers, `nodes`
//! places them, `materials`, `textures`, `cameras`, `lights`, `geometry` and `attributes` take what is modelled,
//! `ignored` names what is not. y is up and metres are the unit, as glTF says; nothing is turned or scaled. Only place
//! for `gltf_json` and `data_url`.
//!
//! Not handled: gloss and metal, bump maps, skins, morph targets, animation, compressed geometry.
//!
//! Source: Khronos Group, *glTF 2.0 Specification*, version 2.0.1 (ISO/IEC 12113:2022).

mod accessors;
mod attributes;
mod cameras;
mod container;
mod document;
mod geometry;
mod ignored;
mod lights;
mod materials;
mod nodes;
mod read;
mod textures;

pub(crate) use read::read;
