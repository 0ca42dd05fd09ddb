//! `meta.json`: what a folder was made of, and the sums of its files.
//!
//! The sum of `meta.json` itself stands in its first field and goes over its text with zeros in that place, so that a
//! change of any byte shows.
//!
//! Not handled: folders of other versions of the format, which are refused.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::kept::error::KeptError;
use crate::kept::identity::{GeometryIdentity, MaterialIdentity, PatchIdentity};
use crate::kept::sums::{sum_of, sum_of_file};
use halflight::pictures::{WriteError, write_whole};

/// The file's name.
pub const NAME: &str = "meta.json";
/// Raised whenever what is kept, or the rays that a seed stands for, become others.
pub const FORMAT: u32 = 2;
/// What the sum stands in while it is made.
const ZEROS: &str = "00000000000000000000000000000000";
/// Before the sum.
const OPENING: &str = "{\n  \"sum\": \"";

/// What a folder holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Meta {
    pub sum: String,
    pub format: u32,
    /// The program's version.
    pub halflight: String,
    pub scene: GeometryIdentity,
    /// The mode's name, and its (alpha, tau).
    pub mode: String,
    pub alpha: f32,
    pub tau: f32,
    pub patches: PatchIdentity,
    /// The rays of each F.
    pub casts: Vec<CastMeta>,
    pub materials: Vec<MaterialIdentity>,
    /// Lights without area.
    pub lights: String,
    /// Terms that are kept, E among them; 0 where only F is.
    pub terms: usize,
    pub files: BTreeMap<String, FileMeta>,
}

/// One F.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CastMeta {
    pub file: String,
    /// Rays of a patch, and the seed that scrambles them.
    pub rays: u32,
    pub seed: u32,
}

/// A file as it was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileMeta {
    pub bytes: u64,
    pub sum: String,
}

impl Meta {
    /// Takes the sum of a file of a folder that is being written.
    pub fn add(&mut self, folder: &Path, name: &str) -> Result<(), KeptError> {
        let path = folder.join(name);
        let (bytes, sum) = sum_of_file(&path).map_err(|source| KeptError::Read { path, source })?;
        self.files.insert(name.into(), FileMeta { bytes, sum });
        Ok(())
    }

    /// Writes it into a folder.
    pub fn write(&self, folder: &Path) -> Result<(), WriteError> {
        let zeroed = Meta { sum: ZEROS.into(), ..self.clone() };
        let text = serde_json::to_string_pretty(&zeroed).expect("numbers and texts are JSON") + "\n";
        let sum = sum_of(text.as_bytes());
        write_whole(folder.join(NAME), text.replacen(ZEROS, &sum, 1).as_bytes())
    }

    /// Reads that of a folder.
    pub fn read(folder: &Path) -> Result<Meta, KeptError> {
        let path = folder.join(NAME);
        let bytes = fs::read(&path).map_err(|source| KeptError::Read { path: path.clone(), source })?;
        let broken = |what: &str| KeptError::Broken { path: path.clone(), what: what.into() };
        let text = String::from_utf8(bytes).map_err(|_| broken("is no text"))?;
        let rest = text.strip_prefix(OPENING).ok_or_else(|| broken("is not what --save writes"))?;
        let (sum, rest) = rest.split_at_checked(ZEROS.len()).ok_or_else(|| broken("is cut short"))?;
        if sum_of(format!("{OPENING}{ZEROS}{rest}").as_bytes()) != sum {
            return Err(broken("was changed since it was written: its sum is another"));
        }
        // A sum that is right is that of another version, whose fields may be others.
        let version: serde_json::Value = serde_json::from_str(&text).map_err(|_| broken("is no JSON"))?;
        if version["format"] != FORMAT || version["halflight"] != env!("CARGO_PKG_VERSION") {
            let what = format!(
                "it was written by halflight {} in format {}, and this is halflight {}, format {FORMAT}",
                version["halflight"].as_str().unwrap_or("of no version"),
                version["format"],
                env!("CARGO_PKG_VERSION"),
            );
            return Err(KeptError::Differs { path: folder.into(), what });
        }
        serde_json::from_value(version).map_err(|error| broken(&format!("lacks what it needs: {error}")))
    }

    /// The bytes of a file of a folder, which must be those that were written.
    pub fn file(&self, folder: &Path, name: &str) -> Result<Vec<u8>, KeptError> {
        let path = folder.join(name);
        let broken = |what: String| KeptError::Broken { path: path.clone(), what };
        let known = self.files.get(name).ok_or_else(|| broken("is not in meta.json".into()))?;
        let found = fs::metadata(&path).map_err(|source| KeptError::Read { path: path.clone(), source })?.len();
        if found != known.bytes {
            return Err(broken(format!("has {found} bytes, and {} were written", known.bytes)));
        }
        let bytes = fs::read(&path).map_err(|source| KeptError::Read { path: path.clone(), source })?;
        if sum_of(&bytes) != known.sum {
            return Err(broken("was changed since it was written: its sum is another".into()));
        }
        Ok(bytes)
    }
}

/// Whether a folder holds what `--save` wrote and nothing else, or such folders alone: it may be replaced.
pub fn is_kept(folder: &Path) -> bool {
    let Ok(entries) = fs::read_dir(folder) else { return false };
    let all: Vec<std::path::PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    is_unit(folder) || (!all.is_empty() && all.iter().all(|entry| is_unit(entry)))
}

/// Whether all that a folder holds is its `meta.json` and the files that this names.
fn is_unit(folder: &Path) -> bool {
    let text = fs::read_to_string(folder.join(NAME)).unwrap_or_default();
    let Ok(meta) = serde_json::from_str::<serde_json::Value>(&text) else { return false };
    let own = |name: &str| name == NAME || meta["files"].get(name).is_some();
    let mut names = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.file_name());
    text.starts_with(OPENING) && names.all(|name| name.to_str().is_some_and(own))
}

/// The folders in a folder that have a `meta.json`, in order of their names; itself where it has one.
pub fn units(folder: &Path) -> Vec<std::path::PathBuf> {
    if folder.join(NAME).exists() {
        return vec![folder.into()];
    }
    let entries = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut units: Vec<_> = entries.filter(|path| path.join(NAME).exists()).collect();
    units.sort();
    units
}
