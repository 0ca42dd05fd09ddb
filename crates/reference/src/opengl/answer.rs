//! What OpenGL answers: a picture and who drew it, or why there is none.
//!
//! Not handled: how the picture is drawn.

use halflight::pictures::Picture;

/// A picture by OpenGL.
#[derive(Clone, Debug)]
pub struct OpenGlPicture {
    /// Radiance, W/(m² sr), as OpenGL's colours have it: means over the samples of each pixel.
    pub picture: Picture,
    /// OpenGL's name for itself.
    pub renderer: String,
    /// Its version.
    pub version: String,
    /// From the triangles to the picture, context and upload included.
    pub seconds: f64,
    /// Whether colours were kept as floating point; 8 bits a channel elsewhere, clamped to 0..1.
    pub floating: bool,
}

/// Why OpenGL draws nothing.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoOpenGl {
    /// The cargo feature is off.
    #[error("this program was built without the cargo feature `opengl`")]
    NotBuilt,
    /// The machine has no library, or not one that can do it.
    #[error("this machine has no OpenGL that draws without a display ({0}); Debian's libegl1 and libgl1-mesa-dri have")]
    Missing(String),
    /// The scene has something that fixed-function OpenGL has not.
    #[error("fixed-function OpenGL cannot show the scene: {0}")]
    Unable(String),
}
