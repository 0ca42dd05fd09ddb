//! A kept folder that is read: whether it fits a scene, a mode, patches and rays; and its F.
//!
//! Not handled: L and terms, which other programs read and halflight finds anew from F.

use std::fs;
use std::path::{Path, PathBuf};

use crate::kept::error::KeptError;
use crate::kept::factors_file::read_factors;
use crate::kept::identity::{difference, sum};
use crate::kept::meta::{FACTORS, Meta, SCENE, folders_of_modes};
use crate::kept::rows::{KeptRows, Which};
use crate::scene_bytes::scene_from_bytes;
use halflight::form_factors::Sampling;
use halflight::light::Transport;
use halflight::render::{Discretization, Fineness};
use halflight::scene::Scene;

/// What a folder's series was solved for: with the rows of the folder it comes out as it did.
#[derive(Clone, Debug)]
pub struct KeptSeries {
    /// The scene.
    pub scene: Scene,
    /// The mode.
    pub transport: Transport,
    /// Patches and rays.
    pub fineness: Fineness,
    /// The seed of the rays.
    pub seed: u32,
    /// Bounces that are kept, E not counted; none where only F is.
    pub bounces: Option<usize>,
}

/// A folder that `--save` wrote.
pub struct KeptFolder {
    path: PathBuf,
    /// One, or one for each of several modes.
    modes: Vec<KeptMode>,
}

/// The folder of a mode.
struct KeptMode {
    folder: PathBuf,
    meta: Meta,
    scene: Scene,
}

impl KeptFolder {
    /// Reads what a folder was made of.
    ///
    /// # Errors
    /// A folder that `--save` did not write, or that another version wrote.
    pub fn open(path: &Path) -> Result<KeptFolder, KeptError> {
        let modes = folders_of_modes(path).into_iter().map(KeptMode::open).collect::<Result<_, _>>()?;
        Ok(KeptFolder { path: path.into(), modes })
    }

    /// Its name.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its patches and rays; none where it was made to a tolerance.
    pub fn fineness(&self) -> Option<Fineness> {
        let meta = &self.modes.first()?.meta;
        let [cast] = &meta.casts[..] else { return None };
        Some(Fineness { patches: meta.patches.requested, rays: cast.rays })
    }

    /// What it was solved for.
    ///
    /// # Errors
    /// A folder of several modes or of a tolerance, whose light is no single series.
    pub fn series(&self) -> Result<KeptSeries, KeptError> {
        let [KeptMode { meta, scene, .. }] = &self.modes[..] else {
            let names = self.modes.iter().filter_map(|mode| mode.folder.file_name()?.to_str());
            let names = names.collect::<Vec<_>>().join(", ");
            return Err(self.differs(format!("it holds several modes, each a folder of its own: {names}")));
        };
        let ([cast], Some(fineness)) = (&meta.casts[..], self.fineness()) else {
            let what = "it was made to a tolerance, from several F: numpy.load reads L.npy and terms.npy";
            return Err(self.differs(what.into()));
        };
        let (transport, bounces) = (Transport { alpha: meta.alpha, tau: meta.tau }, meta.terms.checked_sub(1));
        Ok(KeptSeries { scene: scene.clone(), transport, fineness, seed: cast.seed, bounces })
    }

    /// Reads F of modes of a scene cut into patches, after checking that it is theirs.
    ///
    /// # Errors
    /// [`KeptError::Differs`] with the first difference; a file that is damaged.
    pub fn read(
        &self,
        p: &Discretization,
        modes: &[Transport],
        sampling: &Sampling,
        into: &KeptRows,
    ) -> Result<(), KeptError> {
        let scene = &p.geometry.scene;
        let Sampling { rays, seed, .. } = *sampling;
        let now = sum(scene, &p.patches);
        for &mode in modes {
            let own = self.of_mode(scene, mode)?;
            own.check_effort(p, sampling).map_err(|what| self.differs(what))?;
            if own.meta.patches.sum != now {
                let (kept, now) = (own.meta.patches.count, p.patches.len());
                let what = format!("its {kept} patches are others than the {now} that the scene is cut into now");
                return Err(self.differs(what));
            }
            let tau = p.transports(mode).iter().map(|t| t.tau).collect();
            let which = Which { sum: now.clone(), rays, seed, tau };
            if into.held(&which).is_none() {
                into.hold(which, read_factors(&own.folder.join(FACTORS[0]), p.patches.len())?);
            }
        }
        Ok(())
    }

    /// The folder whose F is that of a mode.
    fn of_mode(&self, scene: &Scene, mode: Transport) -> Result<&KeptMode, KeptError> {
        let differences = self.modes.iter().map(|own| (own, own.difference(scene, mode)));
        let differences: Vec<_> = differences.collect();
        match differences.iter().find(|(_, difference)| difference.is_none()) {
            Some((own, _)) => Ok(own),
            None => Err(self.differs(differences.into_iter().find_map(|own| own.1).unwrap_or_default())),
        }
    }

    fn differs(&self, what: String) -> KeptError {
        KeptError::Differs { path: self.path.clone(), what }
    }
}

impl KeptMode {
    fn open(folder: PathBuf) -> Result<KeptMode, KeptError> {
        let meta = Meta::read(&folder)?;
        let path = folder.join(SCENE);
        let bytes = fs::read(&path).map_err(|source| KeptError::Read { path: path.clone(), source })?;
        let scene = scene_from_bytes(&bytes).map_err(|error| KeptError::Broken { path, what: error.to_string() })?;
        Ok(KeptMode { folder, meta, scene })
    }

    fn difference(&self, scene: &Scene, mode: Transport) -> Option<String> {
        difference((&self.scene, Transport { alpha: self.meta.alpha, tau: self.meta.tau }), (scene, mode))
    }

    /// Whether it is of these patches and rays, or how it differs.
    fn check_effort(&self, p: &Discretization, sampling: &Sampling) -> Result<(), String> {
        let [cast] = &self.meta.casts[..] else {
            return Err("it was made to a tolerance, and now patches and rays are given".into());
        };
        let numbers = [
            ("patches", self.meta.patches.requested, p.patches.requested()),
            ("rays", cast.rays as usize, sampling.rays as usize),
            ("seed", cast.seed as usize, sampling.seed as usize),
        ];
        match numbers.iter().find(|(_, kept, now)| kept != now) {
            Some((name, kept, now)) => Err(format!("it is of --{name} {kept}, and now it is {now}")),
            None => Ok(()),
        }
    }
}
