//! What can go wrong with picture files, in words for people.

use std::path::PathBuf;

use crate::pictures::atomic::WriteError;

/// What can go wrong with a picture file.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
pub enum ImageError {
    /// The extension names no format this program knows.
    #[error("{}: {} is not a picture format known here", path.display(), named(extension))]
    #[diagnostic(
        code(halflight::image::extension),
        help("pictures are written as .png or .exr and read from .png, .exr or .hdr")
    )]
    Extension {
        /// The file asked for.
        path: PathBuf,
        /// Its extension, empty where it has none.
        extension: String,
    },
    /// The file is missing or cannot be read.
    #[error("cannot read {}: {source}", path.display())]
    #[diagnostic(code(halflight::image::read), help("check the file's name and permissions"))]
    Read {
        /// The file asked for.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file's content is not what its extension promises.
    #[error("{} does not hold a readable {format} picture: {reason}", path.display())]
    #[diagnostic(
        code(halflight::image::decode),
        help(
            "the file may be cut short, or be of another format than its extension says; EXR needs channels R, G and B"
        )
    )]
    Decode {
        /// The file asked for.
        path: PathBuf,
        /// `PNG`, `OpenEXR` or `Radiance HDR`.
        format: &'static str,
        /// What the decoder said.
        reason: String,
    },
    /// The picture cannot be encoded.
    #[error("cannot encode a picture of {width} x {height} pixels: {reason}")]
    #[diagnostic(
        code(halflight::image::encode),
        help("a picture needs at least one pixel and at most 2^32 - 1 a side")
    )]
    Encode {
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
        /// What the encoder said.
        reason: String,
    },
    /// The encoded file cannot be written.
    #[error(transparent)]
    #[diagnostic(transparent)]
    Write(#[from] WriteError),
}

fn named(extension: &str) -> String {
    match extension {
        "" => "a name without extension".into(),
        other => format!("\".{other}\""),
    }
}
