//! The machine's own fixed-function OpenGL, as a third answer to local illumination: real OpenGL, not a model of it.
//!
//! With the cargo feature `opengl` a library is looked for at run time (Mesa's will do, without display or graphics
//! card); nothing is linked. Without the feature or the library [`render`] says what is missing.
//!
//! Not handled: what fixed-function OpenGL has not: shadows, interreflection, light with an area. Emitters are seen and
//! light nothing.

pub(crate) mod answer;
#[cfg(feature = "opengl")]
pub(crate) mod calls;
#[cfg(feature = "opengl")]
pub(crate) mod constants;
#[cfg(feature = "opengl")]
pub(crate) mod draw;

pub use answer::{NoOpenGl, OpenGlPicture};
#[cfg(feature = "opengl")]
pub use draw::render;

/// No picture: this program was built without the feature `opengl`.
///
/// # Errors
/// Always [`NoOpenGl::NotBuilt`].
#[cfg(not(feature = "opengl"))]
pub fn render(
    _: &halflight::scene::Scene,
    _: impl Into<halflight::pictures::Size>,
    _: u32,
) -> Result<OpenGlPicture, NoOpenGl> {
    Err(NoOpenGl::NotBuilt)
}
