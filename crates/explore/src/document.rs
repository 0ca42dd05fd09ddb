//! The document of a page: all that it knows besides numbers in arrays, as JSON, and those arrays.
//!
//! `page/charts.js`, `page/light.js` and `page/patches.js` read the arrays, which have the same names there. Not
//! handled: highlights, placements of several textures of one material that differ (the first counts), masks over
//! masks.

use std::collections::BTreeMap;

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use glam::{DVec3, Vec3};
use serde::Serialize;

use crate::charts::Charts;
use crate::light::Layers;
use crate::numbers::{Arrays, Stored, light_codes, predict};
use crate::rows::CoarseRows;
use crate::sums::Rest;
use crate::terms::{Solved, TauError};
use halflight::patches::Patches;
use halflight::pictures::{ImageError, Size, Texels, encode_srgb, encode_texels};
use halflight::rays::Side;
use halflight::scene::textures::{Coding, Filter, Image, Texture, Wrap};
use halflight::scene::{Material, Scene, SkyRow};
use halflight::surfaces::Geometry;

/// Texels of an image to a side at most; larger ones are halved.
const LARGEST: usize = 512;
/// No lamp, chart or front.
const NONE: u32 = u32::MAX;

/// What a page says about its scene.
#[derive(Clone, Debug, Default)]
pub struct Words {
    /// What the page is called.
    pub title: String,
    /// Who made the scene, and its licence.
    pub attribution: String,
    /// Whether the page opens with its story alone, controls come after it.
    pub story: bool,
}

/// A page's JSON; its parts are not nested there.
#[derive(Serialize)]
struct Document<'a> {
    #[serde(flatten)]
    heading: Heading<'a>,
    #[serde(flatten)]
    space: Space,
    #[serde(flatten)]
    series: Series<'a>,
    errors: ErrorsEntry<'a>,
    effort: EffortEntry,
    #[serde(flatten)]
    surfaces: Surfaces<'a>,
    arrays: &'a BTreeMap<&'static str, Stored>,
    test: TestEntry<'a>,
}

/// What the page shows, in words.
#[derive(Serialize)]
struct Heading<'a> {
    title: &'a str,
    attribution: &'a str,
    scene: &'a str,
    story: bool,
    version: &'static str,
}

/// The unit of length, and from where the page looks at first.
#[derive(Serialize)]
struct Space {
    unit: Unit,
    camera: View,
    up: [f32; 3],
}

/// The terms of the bounce series that the page has, and what it knows of the others; first index tau.
#[derive(Serialize)]
struct Series<'a> {
    taus: &'a [f64],
    terms: usize,
    lamps: Vec<LampEntry<'a>>,
    powers: Vec<Vec<Vec<[f64; 3]>>>,
    lambda: Vec<[f64; 3]>,
    rest: &'a Vec<Vec<Rest>>,
    radii: Vec<Radius>,
}

/// What emits, reflects and lets light through.
#[derive(Serialize)]
struct Surfaces<'a> {
    /// Texels to a side of a chart's cell.
    fine: usize,
    sky: Option<SkyEntry>,
    /// Whether there are punctual lights, which are no patch's.
    punctual: bool,
    #[serde(rename = "ownTransport")]
    own_transport: bool,
    materials: Vec<MaterialEntry<'a>>,
    textures: Vec<TextureEntry>,
    objects: &'a [String],
    coarse: CoarseEntry,
}

#[derive(Serialize)]
struct Unit {
    center: [f64; 3],
    scale: f64,
}

#[derive(Serialize)]
struct View {
    position: [f32; 3],
    forward: [f32; 3],
    right: [f32; 3],
    up: [f32; 3],
    fov: f32,
    /// How far before the eye the nearest surface lies; null where there is none.
    nearest: f32,
}

#[derive(Serialize)]
struct LampEntry<'a> {
    name: &'a str,
    key: &'a str,
    emitted: [f64; 3],
}

#[derive(Serialize)]
struct Radius {
    tau: f64,
    lower: f64,
    upper: f64,
}

#[derive(Serialize)]
struct ErrorsEntry<'a> {
    tau: &'a [TauError],
    rms: Option<f64>,
}

#[derive(Serialize)]
struct EffortEntry {
    patches: usize,
    rays: u64,
    triangles: u32,
}

#[derive(Serialize)]
struct SkyEntry {
    up: [f32; 3],
    north: [f32; 3],
    /// From the zenith down.
    rows: Vec<SkyRow>,
    /// Of all cells, row by row.
    radiances: Vec<[f32; 3]>,
    lamp: usize,
}

#[derive(Serialize)]
struct MaterialEntry<'a> {
    name: &'a str,
    rho: [f32; 3],
    /// As the camera sees it, and as it travels.
    emission: [f32; 3],
    sends: [f32; 3],
    texture: Option<usize>,
    glow: Option<usize>,
    coloured: bool,
    mask: Option<MaskEntry>,
}

#[derive(Serialize)]
struct MaskEntry {
    texture: Option<usize>,
    factor: f32,
    cutoff: Option<f32>,
}

#[derive(Serialize)]
struct TextureEntry {
    url: String,
    wrap: [&'static str; 2],
    nearest: bool,
}

#[derive(Serialize)]
struct CoarseEntry {
    count: usize,
    depths: usize,
    areas: Vec<f64>,
    objects: Vec<i64>,
}

/// States that the page checks itself by.
#[derive(Serialize)]
pub(super) struct TestEntry<'a> {
    pub size: [usize; 2],
    pub states: &'a [Expected],
}

/// A state as a link has it, and the mean of its picture.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Expected {
    pub state: String,
    pub mean: [f64; 3],
}

/// All that a document is made of.
pub(super) struct Contents<'a> {
    pub words: &'a Words,
    pub geometry: &'a Geometry,
    pub patches: &'a Patches,
    /// What they are divided into.
    pub parts: &'a Patches,
    pub charts: &'a Charts,
    pub solved: &'a Solved,
    pub layers: &'a Layers,
    pub rows: &'a CoarseRows,
    pub expected: &'a [Expected],
    pub test_size: Size,
    pub rms: Option<f64>,
    /// How far before the eye the nearest surface lies.
    pub nearest: f32,
    /// The lamp that a face's emission belongs to.
    pub lamp_of: &'a dyn Fn(u32) -> usize,
}

impl Contents<'_> {
    /// The document as JSON, and its numbers as text.
    ///
    /// # Errors
    /// Where a texture cannot be encoded.
    pub fn texts(&self) -> Result<(String, String), ImageError> {
        let mut arrays = Arrays::default();
        let mut textures = Textures::default();
        let materials = self.materials(&mut textures)?;
        self.add_geometry(&mut arrays);
        self.add_charts(&mut arrays);
        self.add_light(&mut arrays);
        let document = Document {
            heading: self.heading(),
            space: self.space(),
            series: self.series(),
            errors: ErrorsEntry { tau: &self.solved.errors, rms: self.rms },
            effort: EffortEntry {
                patches: self.parts.len(),
                rays: self.solved.rays,
                triangles: self.geometry.scene.solid_faces(),
            },
            surfaces: self.surfaces(materials, textures.entries),
            arrays: &arrays.stored,
            test: TestEntry { size: [self.test_size.width, self.test_size.height], states: self.expected },
        };
        // Numbers, strings and lists of them have JSON.
        let json = serde_json::to_string(&document).unwrap_or_default();
        Ok((json, arrays.text()))
    }

    fn heading(&self) -> Heading<'_> {
        let Words { title, attribution, story } = self.words;
        let (scene, version) = (&*self.geometry.scene.name, env!("CARGO_PKG_VERSION"));
        Heading { title, attribution, scene, story: *story, version }
    }

    fn space(&self) -> Space {
        let scene = &self.geometry.scene;
        let camera = &scene.camera;
        Space {
            unit: Unit { center: scene.frame.center.to_array(), scale: scene.frame.scale },
            camera: View {
                position: camera.position.to_array(),
                forward: camera.forward.to_array(),
                right: camera.right.to_array(),
                up: camera.up.to_array(),
                fov: camera.vertical_fov,
                nearest: self.nearest,
            },
            up: up(scene).to_array(),
        }
    }

    fn series(&self) -> Series<'_> {
        let kept = &self.solved.kept;
        let of_lamps =
            |lamps: &Vec<Vec<DVec3>>| lamps.iter().map(|l| l.iter().map(DVec3::to_array).collect()).collect();
        Series {
            taus: &kept.taus,
            terms: kept.terms(),
            lamps: self.lamps(),
            powers: kept.powers.iter().map(of_lamps).collect(),
            lambda: kept.lambda.iter().map(DVec3::to_array).collect(),
            rest: &kept.rest,
            radii: kept.radii.iter().map(|(tau, b)| Radius { tau: *tau, lower: b.lower, upper: b.upper }).collect(),
        }
    }

    fn surfaces<'a>(&'a self, materials: Vec<MaterialEntry<'a>>, textures: Vec<TextureEntry>) -> Surfaces<'a> {
        let scene = &self.geometry.scene;
        Surfaces {
            fine: self.charts.fine,
            sky: self.sky(),
            punctual: !scene.lights.is_empty(),
            own_transport: own_transport(scene),
            materials,
            textures,
            objects: &scene.objects,
            coarse: self.coarse(),
        }
    }

    fn lamps(&self) -> Vec<LampEntry<'_>> {
        let emitted = |l: usize| self.solved.kept.powers[0][l][0].to_array();
        let lamps = self.solved.lamps.iter().enumerate();
        lamps.map(|(l, lamp)| LampEntry { name: &lamp.name, key: &lamp.key, emitted: emitted(l) }).collect()
    }

    fn sky(&self) -> Option<SkyEntry> {
        let scene = &self.geometry.scene;
        let sky = scene.sky.as_ref()?;
        let faces = sky.first..sky.first + sky.cells();
        let shines = faces.clone().find(|face| scene.material(*face).emits());
        Some(SkyEntry {
            up: sky.up.to_array(),
            north: sky.north.to_array(),
            rows: sky.rows.clone(),
            radiances: faces.map(|face| scene.material(face).emission.to_array()).collect(),
            lamp: (self.lamp_of)(shines.unwrap_or(sky.first)),
        })
    }

    fn coarse(&self) -> CoarseEntry {
        let CoarseRows { patches, depths, .. } = self.rows;
        let scene = &self.geometry.scene;
        let object = |i: usize| {
            let Some((face, _)) = patches.pieces(i).next() else { return -1 };
            match &scene.sky {
                Some(sky) if sky.holds(face) => -1 - i64::from(face - sky.first),
                _ => scene.faces[face as usize].object.into(),
            }
        };
        CoarseEntry {
            count: patches.len(),
            depths: *depths,
            areas: patches.file_areas(scene),
            objects: (0..patches.len()).map(object).collect(),
        }
    }

    fn materials(&self, textures: &mut Textures) -> Result<Vec<MaterialEntry<'_>>, ImageError> {
        self.geometry.scene.materials.iter().map(|material| textures.material(material)).collect()
    }

    fn add_geometry(&self, arrays: &mut Arrays) {
        let scene = &self.geometry.scene;
        let mut numbers = vec![NONE; scene.vertices.len()];
        let (mut places, mut corners): ([Vec<f32>; 3], Vec<u32>) = Default::default();
        let (mut lamps, mut slots, mut uv, mut colours) =
            (Vec::new(), Vec::new(), [Vec::new(), Vec::new()], Vec::new());
        for &face in self.charts.list.iter().flat_map(|chart| &chart.faces) {
            for v in scene.faces[face as usize].vertices {
                let number = &mut numbers[v as usize];
                if *number == NONE {
                    *number = places[0].len() as u32;
                    let place = scene.vertices[v as usize];
                    (0..3).for_each(|axis| places[axis].push(place[axis]));
                }
                corners.push(*number);
            }
            let material = scene.material(face);
            let emits = material.emits();
            lamps.push(if emits { (self.lamp_of)(face) as u8 } else { u8::MAX });
            slots.push(self.charts.slots[face as usize]);
            if let Some(texture) = first_texture(material) {
                for at in scene.coordinates.get(face as usize).copied().unwrap_or_default() {
                    let at = texture.placement.transform_point2(at.as_dvec2());
                    uv[0].push(at.x as f32);
                    uv[1].push(at.y as f32);
                }
            }
            if material.maps.as_ref().is_some_and(|maps| maps.vertex_colours) {
                for colour in scene.colours.get(face as usize).copied().unwrap_or_default() {
                    colours.extend(colour.to_array().map(|x| (255.0 * x).round() as u8));
                }
            }
        }
        for (name, places) in ["x", "y", "z"].into_iter().zip(&places) {
            arrays.floats(name, places);
        }
        arrays.words("corners", &corners);
        arrays.bytes("lamp", &lamps);
        arrays.shorts("slot", &slots);
        arrays.floats("textureU", &uv[0]);
        arrays.floats("textureV", &uv[1]);
        arrays.bytes("colours", &colours);
    }

    fn add_charts(&self, arrays: &mut Arrays) {
        let (charts, patches, scene) = (&self.charts.list, self.patches, &self.geometry.scene);
        let shorts = |of: &dyn Fn(usize) -> u16| (0..charts.len()).map(of).collect::<Vec<u16>>();
        arrays.shorts("chartColumns", &shorts(&|k| charts[k].columns as u16));
        arrays.shorts("chartRows", &shorts(&|k| charts[k].rows as u16));
        arrays.shorts("chartMaterial", &shorts(&|k| charts[k].material as u16));
        let frame = charts.iter().flat_map(|c| [c.origin, c.per_cell[0], c.per_cell[1]]).flat_map(|v| v.to_array());
        arrays.floats("chartFrame", &frame.collect::<Vec<f32>>());
        arrays.words("chartTriangles", &charts.iter().map(|c| c.faces.len() as u32).collect::<Vec<_>>());
        arrays.words("chartFront", &charts.iter().map(|c| c.front.map_or(NONE, |f| f as u32)).collect::<Vec<_>>());
        arrays.words("cellPatch", &self.charts.patches);
        let mut areas = vec![0.0_f32; patches.len()];
        let own = self.solved.areas.iter().enumerate();
        own.for_each(|(part, area)| areas[self.parts.whole(part as u32) as usize] += *area as f32);
        arrays.floats("patchArea", &areas);
        arrays.floats(
            "patchRho",
            &self.solved.rho[..patches.len()].iter().flat_map(|rho| rho.to_array()).collect::<Vec<_>>(),
        );
        arrays.shorts("patchMaterial", &patches.materials().iter().map(|&m| m as u16).collect::<Vec<_>>());
        let face = |i: usize| patches.pieces(i).next().map_or(0, |piece| piece.0);
        let object = |i: usize| scene.faces[face(i) as usize].object as u16;
        arrays.shorts("patchObject", &(0..patches.len()).map(object).collect::<Vec<_>>());
        let is_back = |i: usize| u8::from(patches.side(i) == Side::Back);
        arrays.bytes("patchSide", &(0..patches.len()).map(is_back).collect::<Vec<_>>());
        let coarse = |i: usize| self.rows.patches.at(face(i), patches.side(i), patches.middle(i)).unwrap_or(0) as u16;
        arrays.shorts("patchCoarse", &(0..patches.len()).map(coarse).collect::<Vec<_>>());
        arrays.bytes("rows", &self.rows.codes);
    }

    fn add_light(&self, arrays: &mut Arrays) {
        let [mut light, mut direct] = [Vec::new(), Vec::new()];
        let mut dominant = Vec::new();
        for layer in self.layers.reflected.iter().flatten().flatten() {
            light_codes(layer, &mut light);
        }
        for layer in self.layers.direct.iter().flatten() {
            light_codes(layer, &mut direct);
        }
        self.layers.dominant.iter().for_each(|layer| light_codes(layer, &mut dominant));
        let (taus, lamps, terms) = (self.solved.kept.taus.len(), self.solved.lamps.len(), self.solved.kept.terms());
        predict(&mut light, [taus, lamps, terms - 1]);
        predict(&mut direct, [taus, lamps, 1]);
        predict(&mut dominant, [taus, 1, 1]);
        arrays.shorts("light", &light);
        arrays.shorts("direct", &direct);
        arrays.shorts("dominant", &dominant);
    }
}

/// The axis nearest to the camera's up, or that of the sky.
fn up(scene: &Scene) -> Vec3 {
    let up = scene.sky.as_ref().map_or(scene.camera.up, |sky| sky.up);
    let largest = up.abs().max_element();
    let axis = Vec3::from(up.to_array().map(|x| if x.abs() == largest { x.signum() } else { 0.0 }));
    if axis.length_squared() == 1.0 { axis } else { Vec3::Y }
}

/// Whether a material has an alpha or tau of its own.
fn own_transport(scene: &Scene) -> bool {
    let solid = (0..scene.materials.len()).filter(|&m| !scene.is_sky_material(m));
    solid.map(|m| &scene.materials[m]).any(|m| m.alpha.is_some() || m.tau.is_some())
}

/// The texture that a material's coordinates are those of.
fn first_texture(material: &Material) -> Option<&Texture> {
    let maps = material.maps.as_ref()?;
    let of_mask = || maps.mask.as_ref()?.texture.as_ref();
    maps.reflectance.as_ref().or(maps.emission.as_ref()).or_else(of_mask)
}

/// Images that are in the page, each once.
#[derive(Default)]
struct Textures {
    entries: Vec<TextureEntry>,
    known: Vec<*const Image>,
}

impl Textures {
    fn material<'a>(&mut self, material: &'a Material) -> Result<MaterialEntry<'a>, ImageError> {
        let maps = material.maps.as_deref();
        let mask = match maps.and_then(|maps| maps.mask.as_ref()) {
            None => None,
            Some(mask) => {
                let texture = mask.texture.as_ref().map(|texture| self.add(texture)).transpose()?;
                Some(MaskEntry { texture, factor: mask.factor, cutoff: mask.cutoff })
            }
        };
        let texture = maps.and_then(|maps| maps.reflectance.as_ref()).map(|t| self.add(t)).transpose()?;
        let glow = maps.and_then(|maps| maps.emission.as_ref()).map(|t| self.add(t)).transpose()?;
        Ok(MaterialEntry {
            name: &material.name,
            rho: material.rho.to_array(),
            emission: material.emitted().visible.to_array(),
            sends: material.emission.to_array(),
            texture,
            glow,
            coloured: maps.is_some_and(|maps| maps.vertex_colours),
            mask,
        })
    }

    fn add(&mut self, texture: &Texture) -> Result<usize, ImageError> {
        let image: *const Image = &*texture.image;
        if let Some(known) = self.known.iter().position(|other| *other == image) {
            return Ok(known);
        }
        self.known.push(image);
        let wrap = texture.wrap.map(|wrap| match wrap {
            Wrap::Repeat => "repeat",
            Wrap::Mirror => "mirror",
            Wrap::Clamp => "clamp",
        });
        let url = format!("data:image/png;base64,{}", STANDARD.encode(png(texture)?));
        self.entries.push(TextureEntry { url, wrap, nearest: texture.filter == Filter::Nearest });
        Ok(self.entries.len() - 1)
    }
}

/// The PNG file of a texture's image, no larger than [`LARGEST`]: means of the texels in linear light, or of shares.
fn png(texture: &Texture) -> Result<Vec<u8>, ImageError> {
    let image = &texture.image;
    let is_share = image.coding() == Coding::Share;
    let coded = |v: f32| if is_share { v } else { encode_srgb(v) };
    let step = image.width().max(image.height()).div_ceil(LARGEST).max(1);
    let (width, height) = (image.width().div_ceil(step), image.height().div_ceil(step));
    let mut codes = Vec::new();
    for k in 0..width * height {
        let (x, y) = (k % width * step, k / width * step);
        let (right, below) = ((x + step).min(image.width()), (y + step).min(image.height()));
        let own = || (y..below).flat_map(move |y| (x..right).map(move |x| (x, y)));
        let count = own().count() as f32;
        let colour = own().map(|(x, y)| image.colour(x, y)).sum::<Vec3>() / count;
        codes.extend(colour.to_array().map(|v| (255.0 * coded(v)).round() as u8));
    }
    encode_texels(&Texels { width, height, channels: 3, codes })
}
