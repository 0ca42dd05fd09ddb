//! halflight as an extension module of Python: what `halflight`'s Python files stand on.
//!
//! ```text
//! arguments, shapes, units, words, plots       python/halflight/*.py
//! work, errors, memory                         this module, over the library's public face
//! ```
//!
//! Everything takes numbers that Python has checked and arrays of one type; what is long runs without the interpreter's
//! lock, shows its progress and can be interrupted ([`running`]). Arrays that live in Rust are handed out as views that
//! cannot be written to ([`arrays`]).
//!
//! Not handled: subinterpreters, and Python without the interpreter's lock.

mod arrays;
mod audit;
mod bake;
mod daylight;
mod errors;
mod explore;
mod factors;
mod given;
mod lamps;
mod map;
mod picture;
mod points;
mod running;
mod scene;
mod series;
mod system;

use pyo3::prelude::*;

/// The module `halflight._native`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::audit::{Audited, audit};
    #[pymodule_export]
    use super::bake::{Baked, bake};
    #[pymodule_export]
    use super::daylight::{Daylit, daylight};
    #[pymodule_export]
    use super::explore::explore;
    #[pymodule_export]
    use super::factors::{Between, ObjectFactors, exchange, object_factors, patch_factors};
    #[pymodule_export]
    use super::given::scene_from_arrays;
    #[pymodule_export]
    use super::lamps::{KeptLamps, dimmed, open_lamps};
    #[pymodule_export]
    use super::map::stability_map;
    #[pymodule_export]
    use super::picture::{
        Rendered, encode_png, exposure_of, read_picture, render, save_layers, save_picture, srgb, trace,
    };
    #[pymodule_export]
    use super::points::{Sensed, lux, points};
    #[pymodule_export]
    use super::scene::{Scene, builtin_scenes, open_scene, scene_from_bytes};
    #[pymodule_export]
    use super::series::{
        Lamps, Series, bounces, first_terms, lamps, open_folder, save_folder, solution_picture, summed, term_pictures,
    };
    #[pymodule_export]
    use super::system::{System, assemble, assemble_kept};

    use pyo3::prelude::*;

    /// The version of the library.
    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
