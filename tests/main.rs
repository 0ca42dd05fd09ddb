//! All tests of the core but those that measure the memory of their process, as one program: it is compiled and linked
//! once. The witness to it is `halflight_reference`.
//!
//! A file that is not named here is not run; `architecture` tells which that are.

mod architecture;
mod both_sides;
mod builtin_scenes;
mod closed_forms;
mod colours;
mod common;
mod direct_light;
mod form_factors;
mod frontier;
mod furnace;
mod geometry_points;
mod gltf;
mod hard_scenes;
mod highlights;
mod lamps;
mod lenient_files;
mod local_picture;
mod modes;
mod operator;
mod outlines;
mod peoples_files;
mod points;
mod punctual;
mod reference;
mod rust_version;
mod scale;
mod scene_files;
mod shooting;
mod shortcuts;
mod small_things;
mod source;
mod spheres;
mod surfaces;
mod textures;
mod tolerance;
