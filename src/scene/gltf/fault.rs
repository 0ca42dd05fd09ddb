//! What can be wrong with a glTF file: a rule of the format that is broken, or another error of a scene; and items of
//! lists, which may not be there.

use crate::scene::error::SceneError;
use crate::scene::gltf::schema::Index;

/// What is wrong, while the name of the file is not at hand.
pub(super) enum Fault {
    /// A rule of glTF is broken.
    Broken(String),
    /// Any other error.
    Other(SceneError),
}

impl Fault {
    /// The same, told of a place in the file: `PLACE: WHAT`.
    pub(super) fn within(self, place: &str) -> Fault {
        match self {
            Fault::Broken(what) => Fault::Broken(format!("{place}: {what}")),
            other => other,
        }
    }

    /// The error of the file.
    pub(super) fn of(self, file: &str) -> SceneError {
        match self {
            Fault::Broken(message) => SceneError::Gltf { file: file.to_owned(), message },
            Fault::Other(error) => error,
        }
    }
}

impl From<String> for Fault {
    fn from(what: String) -> Fault {
        Fault::Broken(what)
    }
}

impl From<&str> for Fault {
    fn from(what: &str) -> Fault {
        Fault::Broken(what.to_owned())
    }
}

impl From<SceneError> for Fault {
    fn from(error: SceneError) -> Fault {
        Fault::Other(error)
    }
}

/// An item of a list of the file; `what` is its noun.
pub(super) fn item<'a, T>(list: &'a [T], index: Index, what: &str) -> Result<&'a T, Fault> {
    let Index(number) = index;
    let missing = || format!("it names {what} {number}, but there are {} of them", list.len()).into();
    list.get(number).ok_or_else(missing)
}
