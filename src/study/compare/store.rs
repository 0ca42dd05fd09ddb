//! References kept on disk, found again by what they show.
//!
//! The key is a hash of everything the picture depends on: the scene's faces, materials and camera, the modes' numbers,
//! the picture's size, and this program's version. A reference is three EXR files (picture, standard error, mask) and a
//! JSON file that tells the key and how it was made, written last. One that does not fit (another key, a file missing
//! or broken, less time than is now allowed) is not used and made anew.
//!
//! The hash is FNV-1a with 128 bits (Fowler, Noll, Vo): it finds changes, and is no defence against forgery.

use std::fmt::{self, Write as _};
use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::light::Transport;
use crate::pictures::{Exposure, ImageError, Picture, Size, make_directory, read_picture, write_picture, write_whole};
use crate::scene::Scene;
use crate::study::compare::ladder::StudyPlan;
use crate::study::compare::truth::{Made, Truth};

const OFFSET: u128 = 0x6c62_272e_07bb_0142_62b8_2175_6295_c58d;
const PRIME: u128 = 0x0000_0000_0100_0000_0000_0000_0000_013b;

/// What a reference shows, as 32 hexadecimal digits.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Key(String);

/// FNV-1a over what is written into it.
struct Hash(u128);

impl fmt::Write for Hash {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            self.0 = (self.0 ^ u128::from(byte)).wrapping_mul(PRIME);
        }
        Ok(())
    }
}

impl Key {
    /// The key of a scene seen in one mode at one size.
    fn of(scene: &Scene, transport: Transport, size: Size) -> Key {
        let mut hash = Hash(OFFSET);
        let version = env!("CARGO_PKG_VERSION");
        let transports = scene.transports(transport);
        // The shortest decimal form of a float tells it from any other. Writing into the hash cannot fail.
        let _ = write!(hash, "{version}({}, {}){transports:?}", size.width, size.height);
        let _ = write!(hash, "{:?}{:?}", scene.camera, scene.frame);
        let _ = write!(hash, "{:?}{:?}", scene.materials, scene.faces);
        let _ = write!(hash, "{:?}", scene.vertices);
        if scene.is_textured() {
            let _ = write!(hash, "{:?}{:?}", scene.coordinates, scene.colours);
        }
        Key(format!("{:032x}", hash.0))
    }
}

/// What stands beside the pictures.
#[derive(Serialize, Deserialize)]
struct Label {
    key: String,
    /// Seconds it was allowed.
    time: f64,
    made: Made,
}

/// The place of one reference.
pub(crate) struct Kept {
    folder: PathBuf,
    stem: String,
    key: Key,
    /// Seconds it is allowed now.
    time: f64,
}

impl Kept {
    /// In `folder`, named for a reader after the scene, the mode and the method, and told apart by the key.
    pub(crate) fn new(folder: &Path, scene: &Scene, plan: &StudyPlan, by: &str) -> Kept {
        let key = Key::of(scene, plan.transport, plan.size);
        let mode = plan.transport.label().replace(' ', "-");
        let stem = format!("{}-{mode}-{by}-{}", scene.name, &key.0[..12]);
        Kept { folder: folder.to_path_buf(), stem, key, time: plan.seconds }
    }

    fn path(&self, end: &str) -> PathBuf {
        self.folder.join(format!("{}{end}", self.stem))
    }

    /// The three pictures' files.
    fn pictures(&self) -> [PathBuf; 3] {
        [".exr", "-se.exr", "-mask.exr"].map(|end| self.path(end))
    }

    /// The reference, where it is whole, shows what the key says, and had at least so much time.
    pub(crate) fn read(&self) -> Option<Truth> {
        let label = fs::read_to_string(self.path(".json")).ok()?;
        let label: Label = serde_json::from_str(&label).ok()?;
        if label.key != self.key.0 || label.time < self.time {
            return None;
        }
        let files = self.pictures();
        let [picture, noise, mask] = files.each_ref().map(|path| read_picture(path).ok());
        let (picture, noise, mask) = (picture?, noise?, mask?);
        let size = picture.size();
        let fits = |p: &Picture| p.size() == size && p.pixels.iter().all(|colour| colour.is_finite());
        let whole = [&picture, &noise, &mask].into_iter().all(fits);
        whole.then(|| Truth {
            noise,
            mask,
            made: label.made,
            kept: true,
            files: files.to_vec(),
            ..Truth::of(picture, "")
        })
    }

    /// Puts a reference there, its label last, and gives it back with its files.
    ///
    /// # Errors
    /// A folder that cannot be made or written.
    pub(crate) fn write(&self, truth: Truth) -> Result<Truth, ImageError> {
        make_directory(&self.folder)?;
        let files = self.pictures();
        let pictures = [&truth.picture, &truth.noise, &truth.mask];
        for (path, picture) in files.iter().zip(pictures) {
            write_picture(path, picture, Exposure::default())?;
        }
        let label = Label { key: self.key.0.clone(), time: self.time, made: truth.made.clone() };
        let text = serde_json::to_string_pretty(&label).expect("labels have string keys");
        write_whole(self.path(".json"), text.as_bytes())?;
        Ok(Truth { files: files.to_vec(), ..truth })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Mode;

    const SIZE: Size = Size { width: 2, height: 2 };

    fn cornell() -> Scene {
        Scene::open("cornell-box").unwrap()
    }

    fn key(scene: &Scene) -> Key {
        Key::of(scene, Mode::Global.transport(), SIZE)
    }

    #[test]
    fn the_key_tells_what_the_picture_depends_on() {
        let scene = cornell();
        let own = key(&scene);
        assert_eq!(own, key(&cornell()));
        let changes: [fn(&mut Scene); 4] = [
            |s| s.materials[0].rho.x += 1e-7,
            |s| s.vertices[3].y = s.vertices[3].y.next_up(),
            |s| s.camera.vertical_fov += 0.001,
            |s| s.faces.swap(0, 1),
        ];
        for change in changes {
            let mut other = scene.clone();
            change(&mut other);
            assert_ne!(own, key(&other));
        }
        assert_ne!(own, Key::of(&scene, Mode::Local.transport(), SIZE));
        assert_ne!(own, Key::of(&scene, Mode::Global.transport(), Size { height: 3, ..SIZE }));
    }
}
