//! The files of a bake: maps as OpenEXR and PNG, a glTF file that uses them, and a JSON that names them.
//!
//! | file | holds |
//! |---|---|
//! | `NAME.glb` | the scene with TEXCOORD_1, and `MOZ_lightmap` at its materials: all light, as sRGB codes inside |
//! | `NAME-lightmap.exr` | irradiance of all light, W/m², linear; its standard error as a layer where asked for |
//! | `NAME-lightmap.png` | the same as RGBM, with its range in the JSON |
//! | `NAME-lightmap-LAMP.exr`, `.png` | the same of one luminaire |
//! | `NAME-lightmaps.json` | [`BakeReport`] |
//!
//! Not handled: maps cut out for each object; all share one.

use std::path::{Path, PathBuf};

use glam::DVec2;
use halflight::Scene;
use halflight::pictures::{
    Exposure, NamedPicture, Shows, encode_texels, make_directory, unlike, write_layered, write_whole,
};
use halflight::render::ErrorParts;
use serde::Serialize;

use crate::bake::{Bake, Held, LightMap};
use crate::coding::{range, rgbm, srgb};
use crate::error::BakeError;
use crate::gltf_file::GltfFile;
use crate::gltf_scene::scene_with_lightmap;
use crate::layout::Layout;
use crate::parts::{Part, SceneFaces, of_scene};

/// What shows the maps: the file of the scene where it is glTF, else the scene itself.
pub enum Model {
    /// A glTF file.
    Gltf(Box<GltfFile>),
    /// A scene of any other kind.
    Scene(SceneModel),
}

/// A scene as parts.
pub struct SceneModel {
    parts: Vec<Part>,
    faces: Vec<SceneFaces>,
}

impl Model {
    /// Of a scene that was opened by this name.
    ///
    /// # Errors
    /// A glTF file that cannot be read.
    pub fn open(name: &str, scene: &Scene) -> Result<Model, BakeError> {
        let path = Path::new(name);
        if GltfFile::is(path) {
            return Ok(Model::Gltf(Box::new(GltfFile::open(path)?)));
        }
        Ok(Model::of(scene))
    }

    /// Of a scene alone, whatever file it is from.
    pub fn of(scene: &Scene) -> Model {
        let (parts, faces) = of_scene(scene);
        Model::Scene(SceneModel { parts, faces })
    }

    /// Where the corners of each of so many faces of a scene lie in its map, shares of the map's sides from the upper
    /// left; 0 of a glTF file, whose triangles are no faces.
    pub fn face_places(&self, layout: &Layout, faces: usize) -> Vec<[DVec2; 3]> {
        let mut places = vec![[DVec2::ZERO; 3]; faces];
        if let Model::Scene(model) = self {
            for (part, own) in model.faces.iter().enumerate() {
                own.faces.iter().zip(layout.shares(part)).for_each(|(face, place)| places[*face as usize] = place);
            }
        }
        places
    }

    /// Its parts.
    pub fn parts(&self) -> &[Part] {
        match self {
            Model::Gltf(file) => &file.parts,
            Model::Scene(model) => &model.parts,
        }
    }

    /// What gets no map, and why.
    pub fn left_out(&self) -> &[String] {
        match self {
            Model::Gltf(file) => &file.left_out,
            Model::Scene(_) => &[],
        }
    }

    /// The bytes of the `.glb` file with a map.
    fn with_lightmap(&self, scene: &Scene, bake: &Bake, held: Held) -> Result<Vec<u8>, BakeError> {
        let map = &bake.maps[0].irradiance;
        let intensity = range(map);
        let png = encode_texels(&srgb(map, intensity))?;
        let map = (&png[..], intensity);
        match self {
            Model::Gltf(file) => file.with_lightmap(&bake.layout, map, held == Held::Reflected),
            Model::Scene(SceneModel { parts, faces }) => scene_with_lightmap(scene, (parts, faces), &bake.layout, map),
        }
    }

    /// The node of each part, in glTF.
    fn nodes(&self) -> Vec<Option<usize>> {
        match self {
            Model::Gltf(file) => file.nodes().into_iter().map(Some).collect(),
            Model::Scene(model) => (0..model.parts.len()).map(Some).collect(),
        }
    }
}

/// What a bake made, for those who show it.
#[derive(Clone, Debug, Serialize)]
pub struct BakeReport {
    /// The scene's name.
    pub scene: String,
    /// The glTF file with the map of all light.
    pub model: PathBuf,
    /// `all` light, or what was `reflected` alone.
    pub light: &'static str,
    /// Texels to a side.
    pub texels: usize,
    /// Texels a metre, in the mean where a file brings charts.
    pub texels_per_metre: f64,
    /// Texels that show something.
    pub covered: usize,
    /// Charts.
    pub charts: usize,
    /// Texels around each.
    pub padding: usize,
    /// What was asked for.
    pub tolerance: f64,
    /// Estimated relative RMS error of all light together over the texels, by its causes.
    pub error: ErrorParts,
    /// Whether it is at most the tolerance.
    pub met: bool,
    /// All light first, then the luminaires.
    pub maps: Vec<MapFiles>,
    /// What Bevy needs of each object.
    pub objects: Vec<ObjectPlace>,
    /// What viewers multiply the numbers of a map by.
    pub viewers: Viewers,
    /// Patches at last.
    pub patches: usize,
    /// Rays in all.
    pub rays: u64,
    /// Seconds of the solution and the gather pass.
    pub seconds: f64,
}

/// The files of one map.
#[derive(Clone, Debug, Serialize)]
pub struct MapFiles {
    /// The luminaire; none of all light.
    pub lamp: Option<String>,
    /// Irradiance, W/m², linear.
    pub exr: PathBuf,
    /// `E = range * A * (R, G, B)`.
    pub png: PathBuf,
    /// How the PNG file is coded: `rgbm`.
    pub coding: &'static str,
    /// The largest value, W/m².
    pub range: f32,
    /// RMS irradiance, W/m².
    pub rms: f64,
    /// Estimated RMS error relative to that.
    pub error: f64,
}

/// Where an object lies in the map.
#[derive(Clone, Debug, Serialize)]
pub struct ObjectPlace {
    /// Its name.
    pub name: String,
    /// Its node in the glTF file.
    pub node: Option<usize>,
    /// The EXR file of all light.
    pub image: PathBuf,
    /// The rectangle that its TEXCOORD_1 count in, `[left, top, right, bottom]`: the whole map.
    pub uv_rect: [f64; 4],
    /// The rectangle around it in the map.
    pub bounds: [f64; 4],
}

/// What viewers make of irradiance.
#[derive(Clone, Debug, Serialize)]
pub struct Viewers {
    /// three.js.
    pub three: Viewer,
    /// Bevy.
    pub bevy: Viewer,
}

/// How a viewer uses a map.
#[derive(Clone, Debug, Serialize)]
pub struct Viewer {
    /// What the irradiance of a map is multiplied by.
    pub factor: f64,
    /// In words.
    pub words: &'static str,
}

impl Viewers {
    fn new() -> Viewers {
        Viewers {
            three: Viewer {
                factor: 1.0,
                words: "three.js multiplies lightMap * lightMapIntensity, an irradiance, by albedo / pi: intensity 1 shows \
                        the radiance that halflight renders",
            },
            bevy: Viewer {
                factor: std::f64::consts::FRAC_1_PI,
                words: "Bevy multiplies the image * lightmap_exposure, irradiance / pi, by albedo: exposure 1/pi shows \
                        the radiance that halflight renders, 683/pi that in cd/m² of white light",
            },
        }
    }
}

/// Writes all files of a bake into a folder, each whole or not at all, the JSON last; returns what is in it, with the
/// files' names, and their paths.
///
/// # Errors
/// A destination that cannot be written, or a glTF file that cannot be written back.
pub fn write_maps(
    (folder, stem): (&Path, &str),
    (scene, model): (&Scene, &Model),
    bake: &Bake,
    (held, tolerance): (Held, f64),
    errors: bool,
) -> Result<(BakeReport, Vec<PathBuf>), BakeError> {
    make_directory(folder)?;
    let mut paths = Vec::new();
    let (endings, mut maps) = (endings(bake.maps.iter().map(|map| map.lamp.as_deref())), Vec::new());
    for (map, of_lamp) in bake.maps.iter().zip(endings) {
        let files = MapFiles::write(folder, &format!("{stem}-lightmap{of_lamp}"), map, errors)?;
        paths.extend([folder.join(&files.exr), folder.join(&files.png)]);
        maps.push(files);
    }
    let place = PathBuf::from(format!("{stem}.glb"));
    write_whole(folder.join(&place), &model.with_lightmap(scene, bake, held)?)?;
    paths.push(folder.join(&place));
    let side = bake.layout.texels as f64;
    let object = |(part, (own, node)): (usize, (&Part, Option<usize>))| {
        let [low, high] = bake.layout.rectangle(part).map(|at| at / side);
        let bounds = [low.x, low.y, high.x, high.y];
        let image = maps[0].exr.clone();
        ObjectPlace { name: own.name.clone(), node, image, uv_rect: [0.0, 0.0, 1.0, 1.0], bounds }
    };
    let objects = model.parts().iter().zip(model.nodes()).enumerate().map(object).collect();
    let report = BakeReport {
        scene: scene.name.clone(),
        model: place,
        light: if held == Held::All { "all" } else { "reflected" },
        texels: bake.layout.texels,
        texels_per_metre: bake.layout.scale / scene.frame.metres,
        covered: bake.coverage.count(),
        charts: bake.layout.pieces,
        padding: bake.layout.padding,
        tolerance,
        error: bake.error,
        met: bake.unmet.is_none(),
        objects,
        maps,
        viewers: Viewers::new(),
        patches: bake.patches,
        rays: bake.rays,
        seconds: bake.seconds,
    };
    let json = serde_json::to_vec_pretty(&report).expect("a report of numbers and text");
    let list = folder.join(format!("{stem}-lightmaps.json"));
    write_whole(&list, &json)?;
    paths.push(list);
    Ok((report, paths))
}

/// What stands in the names of files for a lamp, letters that every file system takes; nothing for all of them.
pub(crate) fn endings<'a>(lamps: impl Iterator<Item = Option<&'a str>>) -> Vec<String> {
    const LONGEST: usize = 80;
    let safe = |c: char| if c.is_ascii_alphanumeric() || "-_.".contains(c) { c } else { '_' };
    let of_lamp = |name: &str| format!("-{}", name.chars().take(LONGEST).map(safe).collect::<String>());
    unlike(lamps.map(|lamp| lamp.map_or(String::new(), of_lamp)), |name, k| format!("{name}-{k}"))
}

impl MapFiles {
    /// Writes a map; its files are named as seen from their folder.
    fn write(folder: &Path, name: &str, map: &LightMap, errors: bool) -> Result<MapFiles, BakeError> {
        let (exr, png) = (PathBuf::from(format!("{name}.exr")), PathBuf::from(format!("{name}.png")));
        let layer = NamedPicture { name: String::new(), shows: Shows::StandardError, picture: &map.standard_error };
        let layers = if errors { vec![layer] } else { Vec::new() };
        write_layered(&folder.join(&exr), &map.irradiance, &layers, Exposure::default())?;
        let range = range(&map.irradiance);
        write_whole(folder.join(&png), &encode_texels(&rgbm(&map.irradiance, range))?)?;
        let (lamp, rms, error) = (map.lamp.clone(), map.rms, map.error);
        Ok(MapFiles { lamp, exr, png, coding: "rgbm", range, rms, error })
    }
}
