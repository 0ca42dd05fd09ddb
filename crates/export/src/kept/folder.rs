//! The files of one mode's folder: written from what was solved, and F read back.
//!
//! Not handled: which folder is whose ([`Keeper`](crate::kept::Keeper)).

use std::path::Path;

use crate::arrays::{Array, Values};
use crate::fields::{light_array, terms_array};
use crate::kept::error::KeptError;
use crate::kept::identity::{GeometryIdentity, PatchIdentity, materials, sum_of_patches};
use crate::kept::meta::{CastMeta, FORMAT, Meta};
use crate::kept::sums::sum_of;
use crate::matrix_market::write_matrix_market;
use crate::mesh::{CellData, PatchMesh};
use crate::npz::{csr, read_npz, rows_of_csr, write_npz};
use crate::scene_bytes::{SceneBytesError, scene_from_bytes, scene_to_bytes};
use halflight::form_factors::{FormFactors, LayerNumbers, Layers, Sampling};
use halflight::light::{Rgb, Transport};
use halflight::patches::{DivisionNumbers, Patches};
use halflight::pictures::{Exposure, write_whole, write_whole_by};
use halflight::render::PatchLight;
use halflight::scene::Scene;
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

/// A mode of a scene cut into patches, of which F is kept.
#[derive(Clone, Copy)]
pub struct KeptMode<'a> {
    /// The scene with its rays.
    pub geometry: &'a Geometry,
    /// Its patches.
    pub patches: &'a Patches,
    /// The mode.
    pub transport: Transport,
    /// (alpha, tau) of every material in it.
    pub transports: &'a [Transport],
}

/// What a folder is made of.
#[derive(Clone, Copy)]
pub struct Saved<'a> {
    /// The mode, with its scene and patches.
    pub mode: KeptMode<'a>,
    /// Every F of the mode, all rows and columns, and its rays.
    pub casts: &'a [(&'a FormFactors, Sampling)],
    /// All crossings for every tau, in place of F.
    pub layers: Option<(&'a Layers, Sampling)>,
    /// None where only F is kept.
    pub light: Option<PatchLight<'a>>,
    /// What else is written.
    pub also: &'a [Also],
    /// How bright the colours of patches are.
    pub exposure: Exposure,
}

/// The file of F number k.
fn factors_name(k: usize) -> String {
    if k == 0 { "F.npz".into() } else { format!("F.{k}.npz") }
}

impl Saved<'_> {
    fn scene(&self) -> &Scene {
        &self.mode.geometry.scene
    }

    /// Writes all files into an empty folder, `meta.json` last.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), KeptError> {
        let mut meta = self.meta();
        write_whole(folder.join(SCENE), &scene_to_bytes(self.scene()))?;
        meta.add(folder, SCENE)?;
        for (k, (factors, _)) in self.casts.iter().enumerate() {
            write_factors(&folder.join(factors_name(k)), factors)?;
            meta.add(folder, &factors_name(k))?;
        }
        if let Some((layers, _)) = self.layers {
            write_npz(folder.join(CROSSINGS), &layer_arrays(&layers.numbers()))?;
            meta.add(folder, CROSSINGS)?;
        }
        if let Some(numbers) = self.mode.patches.division() {
            write_npz(folder.join(DIVISION), &division_arrays(&numbers))?;
            meta.add(folder, DIVISION)?;
        }
        if let Some(PatchLight { light, terms, .. }) = self.light {
            for (name, array) in [("L.npy", light_array(light)), ("terms.npy", terms_array(terms))] {
                write_whole_by(folder.join(name), |file| array.write_to(&mut std::io::BufWriter::new(file)))?;
                meta.add(folder, name)?;
            }
        }
        let mesh = PatchMesh::new(self.scene(), self.mode.patches);
        mesh.write_vtu(folder.join("patches.vtu"), &self.cell_data())?;
        meta.add(folder, "patches.vtu")?;
        for also in self.also {
            match (also, self.light, self.casts.first()) {
                (Also::Ply, Some(light), _) => {
                    let seen: Vec<Rgb> = light.light.iter().map(|l| l.visible).collect();
                    mesh.write_ply(folder.join("patches.ply"), &seen, self.exposure)?;
                    meta.add(folder, "patches.ply")?;
                }
                (Also::Mtx, _, Some((factors, _))) => {
                    write_matrix_market(folder.join("F.mtx"), &factors.rows)?;
                    meta.add(folder, "F.mtx")?;
                }
                _ => (),
            }
        }
        Ok(meta.write(folder)?)
    }

    fn meta(&self) -> Meta {
        let cast = |(k, (_, sampling)): (usize, &(_, Sampling))| CastMeta {
            file: factors_name(k),
            rays: sampling.rays,
            seed: sampling.seed,
        };
        let crossings = |(_, sampling): (&Layers, Sampling)| CastMeta {
            file: CROSSINGS.into(),
            rays: sampling.rays,
            seed: sampling.seed,
        };
        let KeptMode { patches, transport, transports, .. } = self.mode;
        Meta {
            sum: String::new(),
            format: FORMAT,
            halflight: env!("CARGO_PKG_VERSION").into(),
            scene: GeometryIdentity::of(self.scene()),
            mode: transport.label(),
            alpha: transport.alpha,
            tau: transport.tau,
            patches: PatchIdentity {
                requested: patches.requested(),
                count: patches.len(),
                sum: sum_of_patches(patches),
            },
            casts: self.casts.iter().enumerate().map(cast).chain(self.layers.map(crossings)).collect(),
            materials: materials(self.scene(), transports),
            lights: lights(self.scene()),
            terms: self.light.map_or(0, |light| light.terms.len()),
            files: Default::default(),
        }
    }

    /// What is shown on the patches: light and its terms, visible half; reflectance, area, material.
    fn cell_data(&self) -> Vec<CellData> {
        let (scene, KeptMode { patches, transports, .. }) = (self.scene(), self.mode);
        let all = || 0..patches.len();
        let mut data = Vec::new();
        if let Some(PatchLight { light, terms, error, .. }) = self.light {
            data.push(CellData::colour("L", light.iter().map(|l| l.visible)));
            data.push(CellData::colour("L_invisible", light.iter().map(|l| l.invisible)));
            data.extend(error.map(|error| CellData::colour("standard_error", error.iter().copied())));
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

/// Where the scene is.
const SCENE: &str = "scene.bin";

/// The scene of a folder.
///
/// # Errors
/// A file that is missing, or not the one that was written.
pub fn read_scene(folder: &Path, meta: &Meta) -> Result<Scene, KeptError> {
    let broken = |error: SceneBytesError| KeptError::Broken { path: folder.join(SCENE), what: error.to_string() };
    scene_from_bytes(&meta.file(folder, SCENE)?).map_err(broken)
}

/// Where the crossings of all rays are.
pub const CROSSINGS: &str = "crossings.npz";

fn layer_arrays(numbers: &LayerNumbers) -> Vec<(&'static str, Array<'_>)> {
    vec![
        ("rays", Array::vector(Values::I32(vec![numbers.rays].into()))),
        ("columns_of", Array::vector(Values::I64((&numbers.columns_of).into()))),
        ("rays_of", Array::vector(Values::I64((&numbers.rays_of).into()))),
        ("columns", Array::vector(Values::I32((&numbers.columns).into()))),
        ("ends", Array::vector(Values::I32((&numbers.ends).into()))),
        ("slots", Array::vector(Values::I32((&numbers.slots).into()))),
        ("depths", Array::vector(Values::I32((&numbers.depths).into()))),
        ("weights", Array::vector(Values::F32((&numbers.weights).into()))),
    ]
}

/// The crossings of a folder.
///
/// # Errors
/// A file that is missing, or not the one that was written.
pub fn read_layers(folder: &Path, meta: &Meta) -> Result<Layers, KeptError> {
    let broken = |what: &str| KeptError::Broken { path: folder.join(CROSSINGS), what: what.into() };
    let mut arrays = read_npz(&meta.file(folder, CROSSINGS)?).map_err(|what| broken(&what))?;
    let mut take = |name: &str| match arrays.remove(name).map(|array| array.values) {
        Some(Values::I32(numbers)) => Some(numbers.into_owned()),
        _ => None,
    };
    let of = |take: &mut dyn FnMut(&str) -> Option<Vec<u32>>| {
        Some([take("rays")?, take("columns")?, take("ends")?, take("slots")?, take("depths")?])
    };
    let whole = of(&mut take);
    let mut long = |name: &str| match arrays.remove(name).map(|array| array.values) {
        Some(Values::I64(numbers)) => Some(numbers.into_owned()),
        _ => None,
    };
    let (columns_of, rays_of) = (long("columns_of"), long("rays_of"));
    let weights = arrays.remove("weights").map(|array| array.values);
    let (Some([rays, columns, ends, slots, depths]), Some(columns_of), Some(rays_of), Some(Values::F32(weights))) =
        (whole, columns_of, rays_of, weights)
    else {
        return Err(broken("does not hold the crossings of rays"));
    };
    let [rays] = rays[..] else { return Err(broken("does not hold the crossings of rays")) };
    let weights = weights.into_owned();
    let numbers = LayerNumbers { rays, columns_of, rays_of, columns, ends, slots, depths, weights };
    let layers = Layers::of_numbers(&numbers).filter(|_| numbers.columns_of.len() == meta.patches.count);
    layers.ok_or_else(|| broken("does not hold the crossings of these patches"))
}

/// Where the patches' division by light is.
const DIVISION: &str = "division.npz";

fn division_arrays(numbers: &DivisionNumbers) -> Vec<(&'static str, Array<'_>)> {
    let DivisionNumbers { parts: [roots, wholes, planes], areas, counts, faces, places } = numbers;
    vec![
        ("roots", Array::vector(Values::I32(roots.into()))),
        ("wholes", Array::vector(Values::I32(wholes.into()))),
        ("planes", Array::vector(Values::I32(planes.into()))),
        ("areas", Array::vector(Values::F64(areas.into()))),
        ("counts", Array::vector(Values::I64(counts.into()))),
        ("faces", Array::vector(Values::I32(faces.into()))),
        ("places", Array::vector(Values::F32(places.into()))),
    ]
}

/// The patches of a folder: those of a mesh, divided as they were.
///
/// # Errors
/// A file that is missing, or not the one that was written.
pub fn read_division(folder: &Path, meta: &Meta, mesh: &Patches) -> Result<Option<Patches>, KeptError> {
    if !meta.files.contains_key(DIVISION) {
        return Ok(None);
    }
    let broken = |what: &str| KeptError::Broken { path: folder.join(DIVISION), what: what.into() };
    let mut arrays = read_npz(&meta.file(folder, DIVISION)?).map_err(|what| broken(&what))?;
    let mut take = |name: &str| arrays.remove(name).map(|array| array.values);
    let (
        Some(Values::I32(roots)),
        Some(Values::I32(wholes)),
        Some(Values::I32(planes)),
        Some(Values::F64(areas)),
        Some(Values::I64(counts)),
        Some(Values::I32(faces)),
        Some(Values::F32(places)),
    ) = (take("roots"), take("wholes"), take("planes"), take("areas"), take("counts"), take("faces"), take("places"))
    else {
        return Err(broken("does not hold a division of patches"));
    };
    let numbers = DivisionNumbers {
        parts: [roots, wholes, planes].map(std::borrow::Cow::into_owned),
        areas: areas.into_owned(),
        counts: counts.into_owned(),
        faces: faces.into_owned(),
        places: places.into_owned(),
    };
    let divided = mesh.divided_as(numbers);
    divided.map(Some).ok_or_else(|| broken("does not hold a division of these patches"))
}

/// The sum over the lights without area.
pub fn lights(scene: &Scene) -> String {
    sum_of(format!("{:?}", scene.lights).as_bytes())
}

/// F with the sums of its rows; NaN where no ray was cast.
fn write_factors(path: &Path, factors: &FormFactors) -> Result<(), KeptError> {
    let sums: Vec<f32> = factors.row_sums.iter().map(|sum| sum.unwrap_or(f32::NAN)).collect();
    let mut arrays = csr(&factors.rows);
    arrays.push(("row_sums", Array::vector(Values::F32(sums.into()))));
    Ok(write_npz(path, &arrays)?)
}

/// F number k of a folder.
///
/// # Errors
/// A file that is missing, or not the one that was written.
pub fn read_factors(folder: &Path, meta: &Meta, k: usize) -> Result<FormFactors, KeptError> {
    let name = factors_name(k);
    let broken = |what: String| KeptError::Broken { path: folder.join(&name), what };
    let mut arrays = read_npz(&meta.file(folder, &name)?).map_err(broken)?;
    let rows = rows_of_csr(&mut arrays).map_err(broken)?;
    match arrays.remove("row_sums").map(|array| array.values) {
        Some(Values::F32(sums)) if sums.len() == rows.len() && rows.len() == meta.patches.count => {
            let row_sums = sums.iter().map(|&sum| (!sum.is_nan()).then_some(sum)).collect();
            Ok(FormFactors { rows, row_sums })
        }
        _ => Err(broken("does not hold a row for each patch".into())),
    }
}
