//! The scene: faces, materials, camera, and the frame that brings any scene to unit size.
//!
//! A [`Scene`] is what the rest of the program sees: triangles with one material each, in *unit coordinates*
//! (centred, largest half extent 1), so that a room of 1e-6 or 1e+6 units gives the same picture. Lengths go back
//! to the file's units through [`Scene::frame`]. Loaded from OBJ + MTL, from glTF 2.0, from a TOML scene file that
//! adds to one of these, or from a scene built in.
//!
//! Not handled: smooth normals, bump maps, curves, instances.

pub(crate) mod build;
pub mod builtin;
pub(crate) mod camera;
pub(crate) mod ceiling_light;
pub(crate) mod coincident;
pub(crate) mod convex_polygon;
pub(crate) mod enclosure;
pub(crate) mod encoding;
pub(crate) mod error;
pub(crate) mod file;
pub(crate) mod geometry_file;
pub(crate) mod gltf;
pub(crate) mod input;
pub(crate) mod libraries;
pub(crate) mod light_table;
pub(crate) mod lines;
pub(crate) mod load;
pub(crate) mod material_checks;
pub(crate) mod model;
pub(crate) mod mtl;
pub(crate) mod mtl_maps;
pub(crate) mod mtl_opacity;
pub(crate) mod mtl_other;
pub(crate) mod mtl_textures;
pub(crate) mod obj;
pub(crate) mod obj_colours;
pub(crate) mod obj_coordinates;
pub(crate) mod obj_objects;
pub(crate) mod obj_text;
pub(crate) mod obj_vertices;
pub(crate) mod opacity;
pub(crate) mod planes;
pub(crate) mod points;
pub(crate) mod polygon;
pub(crate) mod punctual;
pub(crate) mod sky;
pub(crate) mod sky_faces;
pub(crate) mod sky_table;
pub(crate) mod source;
pub(crate) mod surface_means;
pub(crate) mod textured;
pub mod textures;
pub(crate) mod unit_frame;
pub(crate) mod vertex_colours;
pub(crate) mod warnings;

pub use camera::{DEFAULT_FOV, ViewError};
pub use error::{Place, SceneError};
pub use lines::NO_MATERIAL;
pub use model::{AddedLight, Camera, Face, LoadOptions, Material, NamedCamera, Scene, Sides};
pub use mtl::DEFAULT_RHO;
pub use points::THINNEST;
pub use punctual::{PunctualForm, PunctualLight, PunctualPlace};
pub use sky::{Sky, SkyLight};
pub use surface_means::Means;
pub use unit_frame::UnitFrame;
