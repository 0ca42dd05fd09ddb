//! A kept folder that is made: all files of every mode's light, put in its place whole or not at all.
//!
//! Not handled: reading it ([`KeptFolder`](crate::kept::KeptFolder)).

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::fields::{light_array, terms_array};
use crate::kept::error::KeptError;
use crate::kept::factors_file::write_factors;
use crate::kept::identity::sum;
use crate::kept::meta::{CastMeta, FACTORS, FORMAT, Meta, PatchesMeta, SCENE, is_kept};
use crate::kept::rows::KeptRows;
use crate::matrix_market::write_matrix_market;
use crate::mesh::{CellData, PatchMesh};
use crate::scene_bytes::scene_to_bytes;
use halflight::form_factors::{FormFactors, Sampling};
use halflight::light::{Rgb, Transport, team};
use halflight::operator::Wanted;
use halflight::patches::Patches;
use halflight::pictures::{Exposure, NewFolder, WriteError, write_whole, write_whole_by};
use halflight::render::{Discretization, PatchLight};
use halflight::surfaces::Geometry;

/// Terms that are shown on the patches, each an array of its own; `terms.npy` has all.
const SHOWN: usize = 16;

/// Files that a folder may have beyond those that every one has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Also {
    /// `patches.ply`: the patches with the colours of their light.
    Ply,
    /// `F.mtx`: F as Matrix Market.
    Mtx,
}

/// What is to be kept.
#[derive(Clone, Debug, Default)]
pub struct Keeping {
    /// The folder that is made.
    pub folder: PathBuf,
    /// Files beyond those that every folder has.
    pub also: Vec<Also>,
    /// Whether each mode has a folder in the folder.
    pub several: bool,
    /// How bright the colours of patches are.
    pub exposure: Exposure,
}

/// A folder that is being made.
pub struct NewKept {
    keeping: Keeping,
    /// Where F is.
    rows: Arc<KeptRows>,
    /// One of several processes fills it.
    new: Option<NewFolder>,
}

/// What the files of a mode are written from, beside F.
struct Contents<'a> {
    geometry: &'a Geometry,
    patches: &'a Patches,
    transport: Transport,
    /// The rays of each F.
    casts: &'a [Sampling],
    /// None where only F is kept.
    light: Option<&'a PatchLight<'a>>,
}

impl NewKept {
    /// Begins a folder; `rows` is where F of its modes comes from.
    ///
    /// # Errors
    /// A folder that cannot be made, or would replace what `--save` did not write.
    pub fn begin(keeping: Keeping, rows: &Arc<KeptRows>) -> Result<NewKept, KeptError> {
        let folder = &keeping.folder;
        let is_empty = || fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_none());
        if fs::symlink_metadata(folder).is_ok() && !is_kept(folder) && !is_empty() {
            return Err(KeptError::Occupied { path: folder.clone() });
        }
        let new = team::speaks().then(|| NewFolder::new(folder)).transpose()?;
        Ok(NewKept { keeping, rows: Arc::clone(rows), new })
    }

    /// Writes the folder of a mode's light, with every F that it was solved with.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn save(&self, light: &PatchLight) -> Result<(), KeptError> {
        let PatchLight { transport, lights, casts, .. } = light;
        let (geometry, patches) = (&*lights.geometry, &*lights.patches);
        self.write(&Contents { geometry, patches, transport: *transport, casts, light: Some(light) })
    }

    /// Writes the folder of a mode's F alone.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn save_factors(&self, p: &Discretization, transport: Transport, sampling: Sampling) -> Result<(), KeptError> {
        let (geometry, patches, casts) = (&*p.geometry, &*p.patches, &[sampling][..]);
        self.write(&Contents { geometry, patches, transport, casts, light: None })
    }

    fn write(&self, own: &Contents) -> Result<(), KeptError> {
        let Contents { geometry, patches, transport, .. } = *own;
        let tau: Vec<f32> = geometry.scene.transports(transport).iter().map(|t| t.tau).collect();
        let factors = own.casts.iter().flat_map(|sampling| {
            let wanted = Wanted { geometry, patches, variants: &[], sampling, tick: &|_| () };
            self.rows.whole(&wanted, std::slice::from_ref(&tau)).0
        });
        let factors: Vec<Arc<FormFactors>> = factors.collect();
        let Some(new) = &self.new else { return Ok(()) };
        let mut folder = new.path().to_path_buf();
        if self.keeping.several {
            folder.push(transport.file_name());
            fs::create_dir_all(&folder).map_err(|source| WriteError { path: folder.clone(), source })?;
        }
        own.write(&factors, &self.keeping, &folder)
    }

    /// Puts the folder in its place, and says where that is; none where no mode has light.
    ///
    /// # Errors
    /// A folder that cannot be put there.
    pub fn finish(self) -> Result<Option<PathBuf>, KeptError> {
        let Some(new) = self.new.filter(|new| is_kept(new.path())) else { return Ok(None) };
        new.finish()?;
        self.rows.remove_pieces();
        Ok(Some(self.keeping.folder))
    }
}

impl Contents<'_> {
    /// Writes all files into an empty folder, `meta.json` last.
    fn write(&self, factors: &[Arc<FormFactors>], keeping: &Keeping, folder: &Path) -> Result<(), KeptError> {
        let scene = &self.geometry.scene;
        write_whole(folder.join(SCENE), &scene_to_bytes(scene))?;
        for (factors, name) in factors.iter().zip(FACTORS) {
            write_factors(&folder.join(name), factors)?;
        }
        if let Some(PatchLight { light, terms, .. }) = self.light {
            for (name, array) in [("L.npy", light_array(light)), ("terms.npy", terms_array(terms))] {
                write_whole_by(folder.join(name), |file| array.write_to(&mut std::io::BufWriter::new(file)))?;
            }
        }
        let mesh = PatchMesh::new(scene, self.patches);
        mesh.write_vtu(folder.join("patches.vtu"), &self.cell_data())?;
        if let Some(light) = self.light.filter(|_| keeping.also.contains(&Also::Ply)) {
            let seen: Vec<Rgb> = light.light.iter().map(|l| l.visible).collect();
            mesh.write_ply(folder.join("patches.ply"), &seen, keeping.exposure)?;
        }
        if let Some(factors) = factors.first().filter(|_| keeping.also.contains(&Also::Mtx)) {
            write_matrix_market(folder.join("F.mtx"), &factors.rows)?;
        }
        Ok(self.meta().write(folder)?)
    }

    fn meta(&self) -> Meta {
        let (scene, patches) = (&self.geometry.scene, self.patches);
        Meta {
            format: FORMAT,
            halflight: env!("CARGO_PKG_VERSION").into(),
            scene: scene.name.clone(),
            mode: self.transport.label(),
            alpha: self.transport.alpha,
            tau: self.transport.tau,
            patches: PatchesMeta { requested: patches.requested(), count: patches.len(), sum: sum(scene, patches) },
            casts: self.casts.iter().map(|cast| CastMeta { rays: cast.rays, seed: cast.seed }).collect(),
            terms: self.light.map_or(0, |light| light.terms.len()),
        }
    }

    /// What is shown on the patches: light and its terms, visible half; reflectance, area, material.
    fn cell_data(&self) -> Vec<CellData> {
        let (scene, patches) = (&self.geometry.scene, self.patches);
        let transports = scene.transports(self.transport);
        let all = || 0..patches.len();
        let mut data = Vec::new();
        if let Some(PatchLight { light, terms, error, .. }) = self.light {
            data.push(CellData::colour("L", light.iter().map(|l| l.visible)));
            data.push(CellData::colour("L_invisible", light.iter().map(|l| l.invisible)));
            data.extend(error.iter().map(|error| CellData::colour("standard_error", error.iter().copied())));
            for (n, term) in terms.iter().take(SHOWN).enumerate() {
                data.push(CellData::colour(&format!("bounce_{n}"), term.iter().map(|l| l.visible)));
            }
        }
        let areas = patches.file_areas(scene);
        data.push(CellData::colour("rho", all().map(|i| patches.reflectance(scene, i))));
        data.push(CellData::scalar("area", areas.iter().map(|&area| area as f32)));
        data.push(CellData::scalar("material", patches.materials().iter().map(|&m| m as f32)));
        data.push(CellData::scalar("alpha", patches.materials().iter().map(|&m| transports[m as usize].alpha)));
        data
    }
}
