//! A whole scene as bytes, with its textures: for another process, and for a folder that needs no other file.
//!
//! ```text
//! halflight scene, format, version      one line of text        then the scene, as serde has it (postcard)
//! ```
//!
//! A scene that is read has the bits of the one that was written, so that everything found for it has too. Bytes of
//! another version are refused: they are kept work, and no format to exchange scenes in; OBJ and glTF are.
//!
//! Not handled: one image in several materials, which is there once for each; bytes that no `scene_to_bytes` wrote,
//! whose numbers are not checked again.

use halflight::scene::Scene;

/// Raised whenever what a scene consists of becomes another.
const FORMAT: u32 = 2;

/// Why bytes are no scene.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("no scene of halflight {}: {message}", env!("CARGO_PKG_VERSION"))]
#[diagnostic(help("load the scene's file again"))]
pub struct SceneBytesError {
    message: String,
}

fn opening() -> String {
    format!("halflight scene {FORMAT} {}\n", env!("CARGO_PKG_VERSION"))
}

/// All of a scene.
pub fn scene_to_bytes(scene: &Scene) -> Vec<u8> {
    let mut bytes = opening().into_bytes();
    bytes.extend(postcard::to_stdvec(scene).expect("a scene has numbers, texts and lists only"));
    bytes
}

/// The scene that [`scene_to_bytes`] wrote.
///
/// # Errors
/// Bytes of something else or of another version.
pub fn scene_from_bytes(bytes: &[u8]) -> Result<Scene, SceneBytesError> {
    let error = |message: &str| SceneBytesError { message: message.into() };
    let rest = bytes.strip_prefix(opening().as_bytes());
    let rest = rest.ok_or_else(|| error("the bytes begin otherwise, as those of another version do"))?;
    postcard::from_bytes(rest).map_err(|found| error(&format!("the bytes are broken: {found}")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use halflight::scene::builtin;

    #[test]
    fn every_scene_comes_back_bit_by_bit() {
        for name in builtin::names() {
            let scene = Scene::open(name).expect("a scene");
            let bytes = scene_to_bytes(&scene);
            let back = scene_from_bytes(&bytes).expect("the same scene");
            assert_eq!(format!("{scene:?}"), format!("{back:?}"), "{name}");
            assert_eq!(scene_to_bytes(&back), bytes);
        }
    }

    #[test]
    fn other_bytes_are_refused() {
        let bytes = scene_to_bytes(&Scene::open("furnace").expect("a scene"));
        let refused = |bytes: &[u8]| scene_from_bytes(bytes).expect_err("no scene").to_string();
        assert!(refused(b"").contains("begin otherwise"));
        assert!(refused(&bytes[..bytes.len() - 3]).contains("broken"));
    }
}
