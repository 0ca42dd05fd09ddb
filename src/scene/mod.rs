//! The scene: faces, materials, camera, and the frame that brings any scene to unit size.
//!
//! A [`Scene`] is what the rest of the program sees: triangles with one material each, in *unit coordinates*
//! (centred, largest half extent 1), so that a room of 1e-6 or 1e+6 units gives the same picture. Lengths go back
//! to the file's units through [`Scene::frame`]. Loaded from OBJ + MTL, from glTF 2.0, from a TOML scene file that
//! adds to one of these, or from a scene built in.
//!
//! Not handled: smooth normals, bump maps, curves, instances.

mod bounds;
mod build;
pub mod builtin;
mod camera;
mod ceiling_light;
mod coincident;
pub(crate) mod convex_polygon;
mod emission;
mod enclosure;
mod error;
mod gltf;
mod inside_out;
mod load;
mod model;
mod obj;
mod other_kinds;
mod polygon;
mod punctual;
mod scene_file;
mod sky_cells;
mod soup;
mod surface;
pub mod textures;
mod unit;

pub use bounds::{Bounds, Coordinates};
pub use build::{GivenFace, SceneArrays};
pub(crate) use coincident::planes;
pub use emission::{Emitters, MOST_EMITTERS, RadianceMatrix, SkyLight, SkyPatches};
pub use error::{About, Effect, Place, SceneError, ViewError, Warning};
pub use load::is_scene_file;
pub use model::{
    AddedLight, Camera, DEFAULT_FOV, DEFAULT_GREY, DEFAULT_RHO, Face, LoadOptions, Material, NO_MATERIAL, NamedCamera,
    Scene, Sides, UnitFrame, Winding,
};
pub use polygon::THINNEST;
pub use punctual::photometry::{DrawnDirection, EFFICACY, Photometry};
pub use punctual::{Beam, PunctualForm, PunctualLight, PunctualPlace};
pub use sky_cells::{Sky, SkyRow};
pub use surface::Means;
pub use unit::LengthUnit;
