//! Lightmaps and irradiance volumes of solved scenes.
//!
//! A map is a picture of surfaces laid out flat ([`halflight::surfaces::Atlas`]): texel by texel the irradiance that
//! arrives there, to a stated error, without a GPU. The light of each luminaire may have a map of its own, so that
//! lamps can be dimmed where the maps are shown. Files are glTF with `MOZ_lightmap`, OpenEXR and PNG; a volume is what
//! Bevy reads, or spherical harmonics.
//!
//! | module | has |
//! |---|---|
//! | `parts`, `gltf_file` | triangles by object and material; glTF files read, and written back |
//! | `charts`, `layout` | pieces that lie flat, packed into a map |
//! | `texels`, `visible` | what each texel shows: parts of triangles outside of solids |
//! | `bake`, `dilation` | maps of irradiance with their errors, and the texels between charts |
//! | `coding`, `glb`, `gltf_scene`, `files` | eight-bit codes, and all files |
//! | `volume`, `ktx2_file` | irradiance on a grid |
//!
//! Not handled: normal maps and directions of light within a map; surfaces that shine.

#![forbid(unsafe_code)]

mod bake;
mod charts;
mod clip;
mod coding;
mod dilation;
mod error;
mod files;
mod glb;
mod gltf_file;
mod gltf_scene;
mod ktx2_file;
mod layout;
mod parts;
mod texels;
mod visible;
mod volume;

pub use bake::{Bake, BakeGoal, Held, LaidOut, Lamps, LightMap, bake};
pub use coding::{range, rgbm, srgb};
pub use dilation::Coverage;
pub use error::BakeError;
pub use files::{BakeReport, MapFiles, Model, ObjectPlace, write_maps};
pub use gltf_file::GltfFile;
pub use layout::Layout;
pub use parts::{Part, Triangle};
pub use volume::{Grid, GridLight, Kind, Volume, VolumeGoal, VolumeReport, volume, write_volume};
