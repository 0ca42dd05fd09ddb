//! Errors of the library as exceptions of `halflight._errors`, with what they know as attributes.
//!
//! What to do follows the message: the help of errors of files, in which `halflight._errors` puts Python's words for the
//! program's options, and what is said here of the others.

use std::fmt::Display;

use halflight::pictures::ImageError;
use halflight::render::{PictureUnfit, RenderError, Unfit};
use halflight::scene::{SceneError, ViewError};
use halflight::solve::Diverges;
use halflight_explore::PageError;
use halflight_export::SceneBytesError;
use halflight_export::kept::KeptError;
use halflight_lighting::LampError;
use halflight_reference::Overflow;
use miette::Diagnostic;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// The message of an error, and what to do about it.
pub fn words(error: &(impl Diagnostic + Display)) -> String {
    match error.help() {
        Some(help) => format!("{error}\n{help}"),
        None => error.to_string(),
    }
}

/// An exception of `halflight._errors` with a message and attributes.
fn raised(name: &str, message: String, known: impl FnOnce(&Bound<PyDict>) -> PyResult<()>) -> PyErr {
    let make = |py: Python| {
        let attributes = PyDict::new(py);
        known(&attributes)?;
        let kind = py.import("halflight._errors")?.getattr(name)?;
        Ok(PyErr::from_value(kind.call((message,), Some(&attributes))?))
    };
    Python::attach(|py| make(py).unwrap_or_else(|error| error))
}

/// What the library may fail with.
pub trait Raise {
    /// The exception for it.
    fn raise(self) -> PyErr;
}

impl Raise for SceneError {
    fn raise(self) -> PyErr {
        let place = self.place().cloned();
        let file = self.file().map(str::to_owned);
        let line = place.as_ref().filter(|place| place.item == "line").map(|place| place.number);
        raised("SceneError", words(&self), |known| {
            known.set_item("file", file)?;
            known.set_item("line", line)?;
            known.set_item("item", place.map(|place| (place.item, place.number)))
        })
    }
}

impl Raise for ViewError {
    fn raise(self) -> PyErr {
        PyValueError::new_err(format!(
            "{self}: position and target must differ, up must not point along the view, vertical_fov is in degrees"
        ))
    }
}

impl Raise for Diverges {
    fn raise(self) -> PyErr {
        let of = if self.uniform { "" } else { " of the present alphas" };
        let message = format!(
            "{self}\nit converges for alpha below {:.4}{of}: pass a smaller `alpha`, a smaller `tau`, or lower the \
             reflectances",
            self.alpha_limit
        );
        raised("Diverges", message, |known| {
            known.set_item("radius", (self.radius.lower, self.radius.upper))?;
            known.set_item("verdict", self.verdict.name())?;
            known.set_item("alpha_limit", self.alpha_limit)
        })
    }
}

impl Raise for Unfit {
    fn raise(self) -> PyErr {
        // A requested count is met within about a third.
        let fewer = (self.fitting * 2 / 3).max(1);
        let message = format!(
            "{self}\nabout {} patches would fit: pass patches={fewer}, fewer `rays`, or `memory` if there is more than \
             it seems",
            self.fitting
        );
        raised("DoesNotFit", message, |known| {
            known.set_item("bytes", self.bytes)?;
            known.set_item("limit", self.limit)?;
            known.set_item("fitting", self.fitting)
        })
    }
}

impl Raise for PictureUnfit {
    fn raise(self) -> PyErr {
        let message = format!(
            "{self}\nabout {} pixels would fit: pass a smaller `size`, or `memory` if there is more than it seems",
            self.fitting
        );
        raised("DoesNotFit", message, |known| {
            known.set_item("bytes", self.bytes)?;
            known.set_item("limit", self.limit)?;
            known.set_item("fitting", self.fitting)
        })
    }
}

impl Raise for RenderError {
    fn raise(self) -> PyErr {
        match self {
            RenderError::Diverges(error) => error.raise(),
            RenderError::Memory(error) => error.raise(),
        }
    }
}

impl Raise for Overflow {
    fn raise(self) -> PyErr {
        let message = format!("{self}\na smaller `max_bounces` shows the first bounces");
        raised("Diverges", message, |_| Ok(()))
    }
}

impl Raise for KeptError {
    fn raise(self) -> PyErr {
        raised("FolderError", words(&self), |_| Ok(()))
    }
}

impl Raise for SceneBytesError {
    fn raise(self) -> PyErr {
        PyValueError::new_err(words(&self))
    }
}

impl Raise for LampError {
    fn raise(self) -> PyErr {
        match self {
            LampError::Read { .. } | LampError::Picture(_) => PyOSError::new_err(words(&self)),
            _ => PyValueError::new_err(words(&self)),
        }
    }
}

impl Raise for PageError {
    fn raise(self) -> PyErr {
        match self {
            PageError::Memory(error) => error.raise(),
            PageError::Image(error) => error.raise(),
        }
    }
}

impl Raise for ImageError {
    fn raise(self) -> PyErr {
        PyOSError::new_err(words(&self))
    }
}
