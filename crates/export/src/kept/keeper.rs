//! A source of rows that knows those of a folder, and remembers those it casts for another.
//!
//! What is cast to be kept is all of F for its tau: the rows of patches that reflect nothing and the columns of those
//! that send nothing too, so that other materials may use it. A mode gets the part that it needs.
//!
//! Not handled: errors while rows are cast, which no caller expects there; [`Keeper::finish`] has the first.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use halflight_team as team;

use crate::kept::error::KeptError;
use crate::kept::folder::{
    Also, CROSSINGS, KeptMode, Saved, lights, read_division, read_factors, read_layers, read_scene,
};
use crate::kept::identity::{
    GeometryIdentity, MaterialIdentity, felt_difference, materials, sum_of_patches, unfelt_differences,
};
use crate::kept::meta::{FORMAT, Meta, is_kept, units};
use crate::kept::pieces::Pieces;
use crate::kept::sums::Sum;
use halflight::form_factors::{FormFactors, Layers, Sampling, Variant};
use halflight::light::Transport;
use halflight::operator::{Cast, RowSource, Wanted, Whole};
use halflight::pictures::{Exposure, NewFolder, WriteError};
use halflight::render::{Discretization, Fineness, PatchLight, half_of};
use halflight::scene::Scene;

/// What is to be kept, and what was.
#[derive(Clone, Debug, Default)]
pub struct Keeping {
    /// The folder that is made.
    pub save: Option<PathBuf>,
    /// The folder that is read.
    pub load: Option<PathBuf>,
    /// Files beyond those that every folder has.
    pub also: Vec<Also>,
    /// Whether each mode has a folder in the folder.
    pub several: bool,
    /// How bright the colours of patches are.
    pub exposure: Exposure,
}

/// What a folder's series was solved for: with the rows of its [`Keeper`] it comes out as it did.
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

/// A folder that was read, and what it holds.
type Unit = (PathBuf, Meta);

/// What is to be read.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// F.
    Rows,
    /// All crossings, for a map.
    Crossings,
}

/// F of one tau on some patches, all rows and columns.
#[derive(Clone)]
struct Held {
    patches: String,
    sampling: Sampling,
    tau: Vec<f32>,
    factors: Arc<FormFactors>,
}

/// Crossings on some patches, all rows and columns.
#[derive(Clone)]
struct HeldLayers {
    patches: String,
    sampling: Sampling,
    tau: Vec<f32>,
    layers: Arc<Layers>,
}

/// What is held, and made, by now.
#[derive(Default)]
struct State {
    held: Vec<Held>,
    layers: Option<HeldLayers>,
    new: Option<NewFolder>,
    failed: Option<KeptError>,
}

/// Rows of F that are kept.
pub struct Keeper {
    keeping: Keeping,
    /// The folders that were read, one a mode.
    units: Vec<Unit>,
    state: Mutex<State>,
}

impl Keeper {
    /// Reads what the folder to load is made of, and checks that the one to save may be made.
    ///
    /// # Errors
    /// A folder that `--save` did not write, or that cannot be written.
    pub fn open(keeping: Keeping) -> Result<Keeper, KeptError> {
        let mut state = State::default();
        if let Some(folder) = &keeping.save {
            let is_empty = || std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_none());
            if std::fs::symlink_metadata(folder).is_ok() && !is_kept(folder) && !is_empty() {
                return Err(KeptError::Occupied { path: folder.clone() });
            }
            // One of several processes fills it.
            state.new = team::speaks().then(|| NewFolder::new(folder)).transpose()?;
        }
        let found = match &keeping.load {
            Some(folder) => match units(folder) {
                // Then the error names the file that is missing.
                none if none.is_empty() => vec![folder.clone()],
                found => found,
            },
            None => Vec::new(),
        };
        let read = |folder: PathBuf| Meta::read(&folder).map(|meta| (folder, meta));
        let units = found.into_iter().map(read).collect::<Result<_, _>>()?;
        Ok(Keeper { keeping, units, state: Mutex::new(state) })
    }

    /// The patches and rays of the folder that was read; none where there is none, or it was made to a tolerance.
    pub fn fineness(&self) -> Option<Fineness> {
        let (_, meta) = self.units.first()?;
        let [cast] = &meta.casts[..] else { return None };
        Some(Fineness { patches: meta.patches.requested, rays: cast.rays })
    }

    /// What the folder that is read was solved for.
    ///
    /// # Errors
    /// A folder of several modes, of a map or of a tolerance, whose light is no single series; a file that is damaged.
    pub fn series(&self) -> Result<KeptSeries, KeptError> {
        let folder = || self.keeping.load.clone().unwrap_or_default();
        let differs = |what: String| KeptError::Differs { path: folder(), what };
        let (folder, meta) = match &self.units[..] {
            [one] => one,
            [] => return Err(differs("it holds nothing".into())),
            several => {
                let names = several.iter().filter_map(|(folder, _)| folder.file_name()?.to_str()).collect::<Vec<_>>();
                return Err(differs(format!("it holds several modes, each a folder of its own: {}", names.join(", "))));
            }
        };
        let [cast] = &meta.casts[..] else {
            return Err(differs(
                "it was made to a tolerance, from several F: numpy.load reads L.npy and terms.npy".into(),
            ));
        };
        if cast.file == CROSSINGS {
            return Err(differs("it is of `map`: it holds crossings of rays and no F".into()));
        }
        Ok(KeptSeries {
            scene: read_scene(folder, meta)?,
            transport: Transport { alpha: meta.alpha, tau: meta.tau },
            fineness: Fineness { patches: meta.patches.requested, rays: cast.rays },
            seed: cast.seed,
            bounces: meta.terms.checked_sub(1),
        })
    }

    /// The folder that is read.
    pub fn loaded(&self) -> Option<&Path> {
        self.keeping.load.as_deref()
    }

    /// Whether a folder is made.
    pub fn saves(&self) -> bool {
        self.keeping.save.is_some()
    }

    /// Checks that the folder read has what modes of a scene cut into patches need, and reads it; returns what has
    /// changed since without any effect on F. Nothing is checked where no folder is read.
    ///
    /// # Errors
    /// [`KeptError::Differs`] with the first difference; a file that is damaged.
    pub fn check(
        &self,
        p: &Discretization,
        modes: &[Transport],
        sampling: &Sampling,
    ) -> Result<Vec<String>, KeptError> {
        let mut changed = Vec::new();
        for &mode in modes {
            let Some(((folder, meta), since)) = self.fitting(p, mode, Kind::Rows)? else { continue };
            let differs = |what| KeptError::Differs { path: folder.clone(), what };
            check_patches(meta, p, sampling).map_err(differs)?;
            self.hold(folder, meta)?;
            changed.extend(since);
        }
        changed.sort();
        changed.dedup();
        Ok(changed)
    }

    /// The patches and rays that a search for a tolerance ended with, to begin another with, `p` being the scene cut as
    /// [`Keeper::requested`] says; also returns what has changed since. None where no folder is read.
    ///
    /// # Errors
    /// [`KeptError::Differs`] with the first difference; a file that is damaged.
    pub fn start(
        &self,
        p: &Discretization,
        mode: Transport,
        seed: u32,
    ) -> Result<Option<(Discretization, Vec<String>)>, KeptError> {
        let Some(((folder, meta), changed)) = self.fitting(p, mode, Kind::Rows)? else { return Ok(None) };
        let differs = |what| KeptError::Differs { path: folder.clone(), what };
        let [first, second] = &meta.casts[..] else {
            return Err(differs("it was made with given patches and rays, and now a tolerance is requested".into()));
        };
        let rays = first.rays.saturating_mul(2);
        let halves = [0, 1].map(|half| half_of(rays, seed, half));
        if [first, second].iter().zip(&halves).any(|(cast, now)| (cast.rays, cast.seed) != (now.rays, now.seed)) {
            return Err(differs(format!("it is of another seed than {seed}")));
        }
        let divided = read_division(folder, meta, &p.patches)?;
        let start = divided.map_or_else(|| p.clone(), |patches| p.with_patches(patches));
        check_sum(meta, &start).map_err(differs)?;
        self.hold(folder, meta)?;
        Ok(Some((Discretization { begins_with: Some(rays), ..start }, changed)))
    }

    /// Checks that the folder read has the crossings that a map of a scene cut into patches needs, and reads them;
    /// returns what has changed since. Nothing is checked where no folder is read.
    ///
    /// # Errors
    /// As [`Keeper::check`].
    pub fn check_layers(
        &self,
        p: &Discretization,
        mode: Transport,
        sampling: &Sampling,
    ) -> Result<Vec<String>, KeptError> {
        let Some(((folder, meta), changed)) = self.fitting(p, mode, Kind::Crossings)? else { return Ok(Vec::new()) };
        let differs = |what| KeptError::Differs { path: folder.clone(), what };
        check_patches(meta, p, sampling).map_err(differs)?;
        let layers = Arc::new(read_layers(folder, meta)?);
        let tau = meta.materials.iter().map(|m| m.tau).collect();
        let (patches, sampling) = (meta.patches.sum.clone(), *sampling);
        self.state().layers = Some(HeldLayers { patches, sampling, tau, layers });
        Ok(changed)
    }

    /// Writes the folder of a map's crossings.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn save_layers(&self, p: &Discretization, transport: Transport) -> Result<(), KeptError> {
        let held = self.state().layers.clone();
        let (Some(held), Some(folder)) = (held, self.new_folder()) else { return Ok(()) };
        let (geometry, patches, transports) = (&*p.geometry, &*p.patches, &p.transports(transport)[..]);
        let mode = KeptMode { geometry, patches, transport, transports };
        let layers = Some((&*held.layers, held.sampling));
        let exposure = self.keeping.exposure;
        Saved { mode, casts: &[], layers, light: None, also: &[], exposure }.write(&folder)
    }

    /// Where the new folder is filled.
    fn new_folder(&self) -> Option<PathBuf> {
        self.state().new.as_ref().map(|new| new.path().to_path_buf())
    }

    /// About how many patches the folder read was cut into.
    pub fn requested(&self) -> Option<usize> {
        self.units.first().map(|(_, meta)| meta.patches.requested)
    }

    /// The folder of a mode, and what has changed since.
    fn fitting(
        &self,
        p: &Discretization,
        mode: Transport,
        kind: Kind,
    ) -> Result<Option<(&Unit, Vec<String>)>, KeptError> {
        let Some((folder, meta)) = self.units.first() else { return Ok(None) };
        let (scene, differs) = (&p.geometry.scene, |what| KeptError::Differs { path: folder.clone(), what });
        if let Some(what) = meta.scene.difference(&GeometryIdentity::of(scene)) {
            return Err(differs(what));
        }
        match (kind, meta.casts.iter().any(|cast| cast.file == CROSSINGS)) {
            (Kind::Rows, true) => return Err(differs("it is of `map`: it holds crossings of rays and no F".into())),
            (Kind::Crossings, false) => {
                let what = "it holds F of one tau, and a map needs all crossings, which `map --save` keeps";
                return Err(differs(what.into()));
            }
            _ => (),
        }
        let now = materials(scene, &p.transports(mode));
        let unit = self.unit_of(&now).map_err(differs)?;
        let mut changed = unfelt_differences(&unit.1.materials, &now);
        if unit.1.lights != lights(scene) {
            changed.push("lights without area".into());
        }
        Ok(Some((unit, changed)))
    }

    /// The folder of the tau of these materials, or how the first differs.
    fn unit_of(&self, now: &[MaterialIdentity]) -> Result<&Unit, String> {
        let fits = |unit: &&Unit| felt_difference(&unit.1.materials, now).is_none();
        self.units.iter().find(fits).ok_or_else(|| {
            let first = self.units.first().and_then(|unit| felt_difference(&unit.1.materials, now));
            first.unwrap_or_default()
        })
    }

    /// Reads F of a folder, unless it is held.
    fn hold(&self, folder: &Path, meta: &Meta) -> Result<(), KeptError> {
        let tau: Vec<f32> = meta.materials.iter().map(|m| m.tau).collect();
        for (k, cast) in meta.casts.iter().enumerate() {
            let sampling = Sampling { rays: cast.rays, seed: cast.seed, ..Sampling::default() };
            if self.held(&meta.patches.sum, &sampling, &tau).is_none() {
                let factors = Arc::new(read_factors(folder, meta, k)?);
                self.state().held.push(Held { patches: meta.patches.sum.clone(), sampling, tau: tau.clone(), factors });
            }
        }
        Ok(())
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn held(&self, patches: &str, sampling: &Sampling, tau: &[f32]) -> Option<Arc<FormFactors>> {
        let fits = |held: &&Held| {
            (held.sampling.rays, held.sampling.seed) == (sampling.rays, sampling.seed)
                && held.patches == patches
                && held.tau == tau
        };
        self.state().held.iter().find(fits).map(|held| Arc::clone(&held.factors))
    }

    /// All of F for each of several tau, cast unless they are held; and how many rays were.
    fn all_of_f(&self, wanted: &Wanted, taus: &[Vec<f32>]) -> (Vec<Arc<FormFactors>>, u64) {
        let patches = sum_of_patches(wanted.patches);
        let mut missing: Vec<Vec<f32>> = Vec::new();
        for tau in taus {
            if !missing.contains(tau) && self.held(&patches, wanted.sampling, tau).is_none() {
                missing.push(tau.clone());
            }
        }
        let mut rays = 0;
        if !missing.is_empty() {
            let variants: Vec<Variant> =
                missing.iter().map(|tau| Variant::whole(&wanted.geometry.scene, wanted.patches, tau)).collect();
            let (found, cast) = self.cast(&Wanted { variants: &variants, ..*wanted }, &patches);
            rays = cast;
            let mut state = self.state();
            // Rounds of a search go on to other patches and rays.
            let rays = wanted.sampling.rays;
            state.held.retain(|held| held.patches == patches && held.sampling.rays == rays);
            for (tau, factors) in missing.into_iter().zip(found) {
                let (patches, sampling, factors) = (patches.clone(), *wanted.sampling, Arc::new(factors));
                state.held.push(Held { patches, sampling, tau, factors });
            }
        }
        let own = taus.iter().filter_map(|tau| self.held(&patches, wanted.sampling, tau));
        (own.collect(), rays)
    }

    /// Casts rows, and keeps the finished ones where a folder is made.
    fn cast(&self, wanted: &Wanted, patches: &str) -> (Vec<FormFactors>, u64) {
        let Some(pieces) = self.keeping.save.as_deref().map(Pieces::beside) else { return all().rows(wanted) };
        let (found, rays, failed) = pieces.cast(wanted, &identity(&wanted.geometry.scene, patches));
        if let Some(error) = failed {
            self.state().failed.get_or_insert(error.into());
        }
        (found, rays)
    }

    /// Writes the folder of a mode's light, with every F that it was solved with.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn save(&self, light: &PatchLight) -> Result<(), KeptError> {
        let lights = &light.mode.lights;
        let (geometry, patches, transports) = (&*lights.geometry, &*lights.patches, &lights.transports[..]);
        let mode = KeptMode { geometry, patches, transport: light.mode.transport, transports };
        self.save_mode(&mode, Some(*light), light.casts)
    }

    /// The same of a mode, with its light or of F alone.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn save_mode(&self, mode: &KeptMode, light: Option<PatchLight>, casts: &[Sampling]) -> Result<(), KeptError> {
        if !self.saves() {
            return Ok(());
        }
        let KeptMode { geometry, patches, transport, transports } = *mode;
        let tau: Vec<f32> = transports.iter().map(|t| t.tau).collect();
        let factors = casts.iter().flat_map(|sampling| {
            let wanted = Wanted { geometry, patches, variants: &[], sampling, tick: &|_| () };
            self.all_of_f(&wanted, std::slice::from_ref(&tau)).0
        });
        let factors: Vec<Arc<FormFactors>> = factors.collect();
        let casts: Vec<(&FormFactors, Sampling)> = factors.iter().map(|f| &**f).zip(casts.iter().copied()).collect();
        let Some(mut folder) = self.new_folder() else { return Ok(()) };
        if self.keeping.several {
            folder = folder.join(transport.file_name());
            std::fs::create_dir_all(&folder).map_err(|source| WriteError { path: folder.clone(), source })?;
        }
        let Keeping { also, exposure, .. } = &self.keeping;
        Saved { mode: *mode, casts: &casts, layers: None, light, also, exposure: *exposure }.write(&folder)
    }

    /// Puts the folder in its place, where one is made, and says where that is.
    ///
    /// # Errors
    /// The first error since it was begun; then there is no folder.
    pub fn finish(&self) -> Result<Option<PathBuf>, KeptError> {
        let State { new, failed, .. } = std::mem::take(&mut *self.state());
        let (Some(new), Some(path)) = (new, &self.keeping.save) else { return Ok(None) };
        if let Some(failed) = failed {
            return Err(failed);
        }
        if !is_kept(new.path()) {
            // No mode has light: nothing is worth replacing what is there.
            return Ok(None);
        }
        new.finish()?;
        Pieces::beside(path).remove();
        Ok(Some(path.clone()))
    }

    /// Remembers an error that could not be returned.
    pub fn fail(&self, error: KeptError) {
        self.state().failed.get_or_insert(error);
    }
}

fn check_patches(meta: &Meta, p: &Discretization, sampling: &Sampling) -> Result<(), String> {
    let [cast] = &meta.casts[..] else {
        return Err("it was made to a tolerance, and now patches and rays are given".into());
    };
    let differs = |name: &str, kept: usize, now: usize| format!("it is of --{name} {kept}, and now it is {now}");
    let (kept, now) = (meta.patches.requested, p.patches.requested());
    if kept != now {
        return Err(differs("patches", kept, now));
    }
    for (name, kept, now) in [("rays", cast.rays, sampling.rays), ("seed", cast.seed, sampling.seed)] {
        if kept != now {
            return Err(differs(name, kept as usize, now as usize));
        }
    }
    check_sum(meta, p)
}

fn check_sum(meta: &Meta, p: &Discretization) -> Result<(), String> {
    let (kept, now) = (meta.patches.count, p.patches.len());
    let others = || format!("its {kept} patches are others than the {now} that the scene is cut into now");
    if meta.patches.sum == sum_of_patches(&p.patches) { Ok(()) } else { Err(others()) }
}

/// All that rows depend on but for tau and the rays.
fn identity(scene: &Scene, patches: &str) -> String {
    let felt = |m: &MaterialIdentity| format!("{} {:?} ", m.two_sided, m.mask);
    let mut sum = Sum::new();
    sum.number(FORMAT.into());
    let default = vec![Transport::default(); scene.materials.len()];
    let own: String = materials(scene, &default).iter().map(felt).collect();
    for part in [env!("CARGO_PKG_VERSION"), &GeometryIdentity::of(scene).sum, patches, &own] {
        sum.bytes(part.as_bytes());
    }
    sum.digits()
}

/// Whether a variant has any entry.
fn needs_rays(variant: &Variant) -> bool {
    variant.rows.contains(&true) && variant.columns.contains(&true)
}

/// The part of F that a variant needs.
fn part(all: &FormFactors, variant: &Variant) -> FormFactors {
    let sum = |(sum, &is): (&Option<f32>, &bool)| sum.filter(|_| is);
    FormFactors {
        rows: all.rows.restricted(&variant.rows, &variant.columns),
        row_sums: all.row_sums.iter().zip(&variant.rows).map(sum).collect(),
    }
}

/// What is cast, with every process: one of them writes it.
fn all() -> Whole {
    Whole(Arc::new(Cast))
}

impl RowSource for Keeper {
    fn rows(&self, wanted: &Wanted) -> (Vec<FormFactors>, u64) {
        if !self.saves() && !self.knows(wanted) {
            return all().rows(wanted);
        }
        let needed = wanted.variants.iter().filter(|v| needs_rays(v));
        let taus: Vec<Vec<f32>> = needed.map(|v| v.tau.clone()).collect();
        let (all, rays) = self.all_of_f(wanted, &taus);
        let mut all = all.iter();
        let own = |v: &Variant| match needs_rays(v).then(|| all.next()).flatten() {
            Some(all) => part(all, v),
            None => FormFactors::none(wanted.patches.len()),
        };
        (wanted.variants.iter().map(own).collect(), rays)
    }

    fn layers(&self, wanted: &Wanted) -> (Layers, u64) {
        let own = &wanted.variants[0];
        let (patches, sampling) = (sum_of_patches(wanted.patches), *wanted.sampling);
        let fits = |held: &HeldLayers| {
            let rays = (held.sampling.rays, held.sampling.seed) == (sampling.rays, sampling.seed);
            rays && held.patches == patches && held.tau == own.tau
        };
        if let Some(held) = self.state().layers.clone().filter(fits) {
            return (held.layers.restricted(&own.rows, &own.columns), 0);
        }
        if !self.saves() {
            return all().layers(wanted);
        }
        let variants = [Variant::whole(&wanted.geometry.scene, wanted.patches, &own.tau)];
        let (all, rays) = all().layers(&Wanted { variants: &variants, ..*wanted });
        let part = all.restricted(&own.rows, &own.columns);
        self.state().layers = Some(HeldLayers { patches, sampling, tau: own.tau.clone(), layers: Arc::new(all) });
        (part, rays)
    }

    fn knows(&self, wanted: &Wanted) -> bool {
        if self.state().held.is_empty() {
            return false;
        }
        let patches = sum_of_patches(wanted.patches);
        let mut needed = wanted.variants.iter().filter(|v| needs_rays(v));
        needed.all(|v| self.held(&patches, wanted.sampling, &v.tau).is_some())
    }
}
