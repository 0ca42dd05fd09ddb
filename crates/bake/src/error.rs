//! Why there is no map.
//!
//! Not handled: what is wrong with a scene itself, which its reader says.

use std::path::PathBuf;

use halflight::pictures::{ImageError, WriteError};
use halflight::render::RenderError;
use miette::Diagnostic;

/// Why there is no map or volume.
#[derive(Debug, thiserror::Error, Diagnostic)]
pub enum BakeError {
    /// The charts of a part overlap.
    #[error("the second texture coordinates (TEXCOORD_1) of `{part}` overlap: its triangles {first} and {second}")]
    #[diagnostic(
        code(halflight::bake::charts),
        help(
            "unwrap it without overlaps (Blender: UV > Lightmap Pack), or leave its second UV map out: charts are made"
        )
    )]
    Overlap {
        /// Its name.
        part: String,
        /// Numbers of two triangles.
        first: usize,
        /// The other.
        second: usize,
    },
    /// The charts of a part leave the unit square.
    #[error("the second texture coordinates (TEXCOORD_1) of `{part}` leave the square from 0 to 1: ({u}, {v})")]
    #[diagnostic(
        code(halflight::bake::charts),
        help(
            "unwrap it within the square (Blender: UV > Lightmap Pack), or leave its second UV map out: charts are made"
        )
    )]
    Outside {
        /// Its name.
        part: String,
        /// Where.
        u: f64,
        /// Where.
        v: f64,
    },
    /// The charts of a part have no area.
    #[error("the second texture coordinates (TEXCOORD_1) of `{part}` have no area")]
    #[diagnostic(
        code(halflight::bake::charts),
        help("unwrap it (Blender: UV > Lightmap Pack), or leave its second UV map out: charts are made")
    )]
    Flat {
        /// Its name.
        part: String,
    },
    /// Nothing has an area.
    #[error("no surface has an area to bake")]
    #[diagnostic(code(halflight::bake::charts), help("name a scene with meshes"))]
    Nothing,
    /// The charts are too many for the map.
    #[error("{pieces} charts with {padding} texels around each do not fit in {texels} x {texels} texels")]
    #[diagnostic(code(halflight::bake::charts), help("pass more --texels, less --padding, or a scene of fewer faces"))]
    Crowded {
        /// How many.
        pieces: usize,
        /// Texels to a side.
        texels: usize,
        /// Texels around each.
        padding: usize,
    },
    /// There is no solution, or it does not fit in memory.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A glTF file cannot be written back.
    #[error("{}: {message}", path.display())]
    #[diagnostic(code(halflight::bake::gltf), help("{help}"))]
    Gltf {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        message: String,
        /// What to do.
        help: String,
    },
    /// A picture cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Image(#[from] ImageError),
    /// A file cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
}
