//! `meta.json`: what the folder of a mode was made of.
//!
//! Not handled: folders of other versions of the format, which are refused.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::kept::error::{KeptError, bytes_of};
use halflight::pictures::{WriteError, write_whole};

/// The file's name.
pub const NAME: &str = "meta.json";
/// Where the scene is.
pub const SCENE: &str = "scene.bin";
/// Raised whenever what is kept, or the rays that a seed stands for, become others.
pub const FORMAT: u32 = 4;
/// Where each F is.
pub const FACTORS: [&str; 2] = ["F.npz", "F.1.npz"];
/// All other files that a folder may have.
const FILES: [&str; 7] = [NAME, SCENE, "F.mtx", "L.npy", "terms.npy", "patches.vtu", "patches.ply"];

/// What a folder holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Meta {
    pub format: u32,
    /// The program's version.
    pub halflight: String,
    /// The scene's name.
    pub scene: String,
    /// The mode's name, and its (alpha, tau).
    pub mode: String,
    pub alpha: f32,
    pub tau: f32,
    pub patches: PatchesMeta,
    /// The rays of each F.
    pub casts: Vec<CastMeta>,
    /// Terms that are kept, E among them; 0 where only F is.
    pub terms: usize,
}

/// The patches.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PatchesMeta {
    /// About how many were requested.
    pub requested: usize,
    pub count: usize,
    /// That of [`sum`](crate::kept::identity::sum).
    pub sum: String,
}

/// One F.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CastMeta {
    /// Rays of a patch, and the seed that scrambles them.
    pub rays: u32,
    pub seed: u32,
}

impl Meta {
    /// Writes it into a folder.
    pub fn write(&self, folder: &Path) -> Result<(), WriteError> {
        let text = serde_json::to_string_pretty(self).expect("numbers and texts are JSON") + "\n";
        write_whole(folder.join(NAME), text.as_bytes())
    }

    /// Reads that of a folder.
    pub fn read(folder: &Path) -> Result<Meta, KeptError> {
        let path = folder.join(NAME);
        let broken = |error| KeptError::broken(&path, format!("is not what --save writes: {error}"));
        let value: serde_json::Value = serde_json::from_slice(&bytes_of(&path)?).map_err(broken)?;
        if value["format"] != FORMAT || value["halflight"] != env!("CARGO_PKG_VERSION") {
            let what = format!(
                "it was written by halflight {} in format {}, and this is halflight {}, format {FORMAT}",
                value["halflight"].as_str().unwrap_or("of no version"),
                value["format"],
                env!("CARGO_PKG_VERSION"),
            );
            return Err(KeptError::Differs { path: folder.into(), what });
        }
        serde_json::from_value(value).map_err(broken)
    }
}

/// Whether a folder holds what `--save` wrote and nothing else, or such folders alone: it may be replaced.
pub fn is_kept(folder: &Path) -> bool {
    let all = entries(folder);
    is_of_a_mode(folder) || (!all.is_empty() && all.iter().all(|entry| is_of_a_mode(entry)))
}

/// Whether all that a folder holds is a `meta.json` of the program, and files that it writes.
fn is_of_a_mode(folder: &Path) -> bool {
    let text = fs::read_to_string(folder.join(NAME)).unwrap_or_default();
    let meta = serde_json::from_str::<serde_json::Value>(&text).unwrap_or_default();
    let own = |path: PathBuf| FACTORS.iter().chain(&FILES).any(|name| path.ends_with(name));
    meta.get("halflight").is_some() && entries(folder).into_iter().all(own)
}

/// The folders of the modes in a folder, in order of their names; itself where it is one, or holds none.
pub fn folders_of_modes(folder: &Path) -> Vec<PathBuf> {
    let mut folders: Vec<PathBuf> = entries(folder).into_iter().filter(|path| path.join(NAME).exists()).collect();
    folders.sort();
    if folders.is_empty() { vec![folder.into()] } else { folders }
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path()).collect()
}
