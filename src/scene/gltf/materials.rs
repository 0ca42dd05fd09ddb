//! Materials of glTF: the base colour is rho, what is emitted is E, and double-sided ones have two sides. Alpha cuts
//! holes by `alphaMode`: by the cutoff, or by shares. The diffuse colour of KHR_materials_pbrSpecularGlossiness is the
//! base colour where it is given.
//!
//! glTF's unit of emission is the nit, a luminance; a factor of 1 is taken as a radiance of 1 W/(m² sr) in its channel,
//! without a luminous efficacy. The base colour (1, 1, 1), which is also that of materials without any and of
//! primitives without a material, would reflect everything: without a texture it reflects [`DEFAULT_RHO`], with a
//! warning, unless the vertices have colours.
//!
//! Of a material that no mesh shown uses only the plain numbers are read, and nothing of it is said.
//!
//! Not handled: all else that materials have, which [`Ignored`] names; the second of two sets of texture coordinates in
//! one material. A material whose emissive texture cannot be read emits nothing, since most such textures are black but
//! for a few texels.

use std::collections::HashSet;

use glam::Vec3;

use crate::light::Rgb;
use crate::scene::error::{About, Effect, Place, SceneError, Tally};
use crate::scene::gltf::document::name;
use crate::scene::gltf::fault::Fault;
use crate::scene::gltf::ignored::{Ignored, Kind};
use crate::scene::gltf::images::Images;
use crate::scene::gltf::nodes::Placed;
use crate::scene::gltf::schema::{Material as Read, Root, TextureInfo};
use crate::scene::model::{DEFAULT_RHO, Material, NO_MATERIAL, Sides};
use crate::scene::soup::{Defined, Reflects, Soup, check_emission, check_rho};
use crate::scene::textures::{Channel, Maps, Mask, ShareImages, Texture};

/// Alpha from which on a surface of `alphaMode` MASK is there, where the file does not say.
const DEFAULT_CUTOFF: f32 = 0.5;

/// The materials of a file.
pub(super) struct Materials {
    pub list: Vec<Material>,
    /// The set of coordinates that the textures of each go by, if it has any.
    pub sets: Vec<Option<u64>>,
    /// What colours of vertices are factors of.
    pub defined: Vec<Defined>,
}

impl Materials {
    fn push(&mut self, material: Material, set: Option<u64>, defined: Defined) {
        self.list.push(material);
        self.sets.push(set);
        self.defined.push(defined);
    }
}

/// The base colour of a material: its factor, with alpha, and its texture.
#[derive(Clone, Copy)]
struct Base<'a> {
    factor: [f32; 4],
    texture: Option<&'a TextureInfo>,
}

/// All materials of the file in its order, and behind them the one of primitives without any, which reflects
/// `reflectance` where that is given.
pub(super) fn materials(
    root: &Root,
    nodes: &[Placed],
    reflectance: Option<f32>,
    images: &mut Images,
    ignored: &mut Ignored,
) -> Result<Materials, SceneError> {
    let used = used(root, nodes);
    let mut all = Materials { list: Vec::new(), sets: Vec::new(), defined: Vec::new() };
    for (number, read) in root.materials.iter().enumerate() {
        let name = name(&read.name, "material", number);
        if used.contains(&number) {
            material(read, number, &name, images, ignored, &mut all)?;
        } else {
            all.push(unused(read, &name), None, Defined { rho: Reflects::Defined, mask: None });
        }
    }
    let rho = Rgb::splat(reflectance.unwrap_or(DEFAULT_RHO));
    check_rho(rho.as_dvec3().to_array(), NO_MATERIAL, || Place::item(images.data.file, "material", all.list.len()))?;
    let defined = Defined { rho: Reflects::Undefined, mask: None };
    all.push(Material::new(NO_MATERIAL, rho, Rgb::ZERO), None, defined);
    Ok(all)
}

/// The numbers of the materials of the meshes shown.
fn used(root: &Root, nodes: &[Placed]) -> HashSet<usize> {
    let meshes: HashSet<usize> = nodes.iter().filter_map(|placed| placed.node.mesh).map(|mesh| mesh.0).collect();
    let meshes = meshes.into_iter().filter_map(|mesh| root.meshes.get(mesh));
    meshes.flat_map(|mesh| &mesh.primitives).filter_map(|primitive| primitive.material).map(|m| m.0).collect()
}

/// Appends a material that is used.
fn material(
    read: &Read,
    number: usize,
    name: &str,
    images: &mut Images,
    ignored: &mut Ignored,
    all: &mut Materials,
) -> Result<(), SceneError> {
    let file = images.data.file;
    let place = || Place::item(file, "material", number);
    let base = base(read);
    let [r, g, b, _] = base.factor;
    check_rho([r, g, b].map(f64::from), name, place)?;
    let emission = emission(read);
    check_emission(emission.as_dvec3().to_array(), name, place)?;
    ignore(read, name, ignored);
    let (maps, set) = maps(read, base, name, images, ignored)
        .map_err(|fault| fault.within(&format!("material `{name}`")).of(file))?;
    let is_white = [r, g, b] == [1.0; 3] && maps.reflectance.is_none();
    let rho = if is_white { Vec3::splat(DEFAULT_RHO) } else { Vec3::new(r, g, b) };
    let reflects = if is_white { Reflects::Undefined } else { Reflects::Defined };
    let defined = Defined { rho: reflects, mask: maps.mask.clone() };
    let lost = read.emissive_texture.is_some() && maps.emission.is_none();
    let emission = if lost { Vec3::ZERO } else { emission };
    let sides = if read.double_sided { Sides::Two } else { Sides::One };
    let mut material = Material { sides, ..Material::new(name, rho, emission) };
    material.set_maps(maps);
    let set = material.has_images().then_some(set);
    all.push(material, set, defined);
    Ok(())
}

/// A material that is not used: its plain numbers, and where they are none those of no material.
fn unused(read: &Read, name: &str) -> Material {
    let place = || Place::item("", "material", 0);
    let [r, g, b, _] = base(read).factor;
    let (rho, emission) = (Vec3::new(r, g, b), emission(read));
    let is_rho = check_rho(rho.as_dvec3().to_array(), name, place).is_ok() && rho != Vec3::ONE;
    let emits = check_emission(emission.as_dvec3().to_array(), name, place).is_ok() && read.emissive_texture.is_none();
    let (rho, emission) =
        (if is_rho { rho } else { Vec3::splat(DEFAULT_RHO) }, if emits { emission } else { Vec3::ZERO });
    let sides = if read.double_sided { Sides::Two } else { Sides::One };
    Material { sides, ..Material::new(name, rho, emission) }
}

/// Warns of materials that would reflect everything, and of triangles without a material, unless vertices are coloured.
pub(super) fn warn_of_white(soup: &mut Soup, is_white: &[bool], coloured: &[bool]) {
    let plain = soup.materials.len() - 1;
    let (mut white, mut bare) = (Tally::default(), Tally::default());
    let mut shown = vec![false; soup.materials.len()];
    for polygon in &soup.polygons {
        let material = polygon.material as usize;
        shown[material] = true;
        if material == plain && !coloured[plain] {
            bare.add(polygon.number);
        }
    }
    for (number, material) in soup.materials[..plain].iter().enumerate() {
        if is_white[number] && shown[number] && !coloured[number] {
            white.add_named(number, &material.name);
        }
    }
    let consequence = format!("it would reflect everything; it reflects {DEFAULT_RHO}");
    let place = (soup.file.as_str(), "material");
    white.report(About::Light(Effect::Guessed), place, "white base colour", &consequence, &mut soup.warnings);
    let rho = soup.materials[plain].rho.x;
    let consequence = format!(
        "no material; glTF's default is white, which would reflect everything; reflecting {rho} (--reflectance)"
    );
    let place = (soup.file.as_str(), "triangle");
    bare.report(About::Light(Effect::Guessed), place, "bare face", &consequence, &mut soup.warnings);
}

/// The base colour.
fn base(read: &Read) -> Base<'_> {
    let pbr = &read.pbr_metallic_roughness;
    match &read.extensions.specular_glossiness {
        Some(given) => Base { factor: given.diffuse_factor, texture: given.diffuse_texture.as_ref() },
        None => Base { factor: pbr.base_color_factor, texture: pbr.base_color_texture.as_ref() },
    }
}

/// Emitted radiance, W/(m² sr): the factor times the strength of KHR_materials_emissive_strength.
fn emission(read: &Read) -> Vec3 {
    let strength = read.extensions.emissive_strength.as_ref().map_or(1.0, |given| given.emissive_strength);
    Vec3::from_array(read.emissive_factor) * strength
}

/// The textures of a material and the set of coordinates that they go by.
fn maps(read: &Read, base: Base, name: &str, images: &mut Images, ignored: &mut Ignored) -> Result<(Maps, u64), Fault> {
    let reflectance = images.texture(base.texture, name, ignored)?;
    let mut glow = images.texture(read.emissive_texture.as_ref(), name, ignored)?;
    let set = reflectance.as_ref().or(glow.as_ref()).map_or(0, |(_, set)| *set);
    if glow.as_ref().is_some_and(|(_, of_glow)| *of_glow != set) {
        ignored.add(Kind::GlowBySecondSet, name);
        glow = None;
    }
    let (reflectance, emission) = (reflectance.map(|(texture, _)| texture), glow.map(|(texture, _)| texture));
    let mask = mask(read, base, reflectance.as_ref(), &mut images.share_images);
    Ok((Maps { reflectance, emission, mask, vertex_colours: false }, set))
}

/// The holes that alpha cuts.
fn mask(read: &Read, base: Base, texture: Option<&Texture>, shares: &mut ShareImages) -> Option<Mask> {
    let cutoff = match read.alpha_mode.as_deref() {
        Some("MASK") => Some(read.alpha_cutoff.unwrap_or(DEFAULT_CUTOFF)),
        Some("BLEND") => None,
        _ => return None,
    };
    let [.., factor] = base.factor;
    let of_alpha = |texture: &Texture| {
        let image = shares.of(&texture.image, Channel::Alpha);
        Texture { image, ..texture.clone() }
    };
    let texture = texture.filter(|texture| texture.image.has_alpha()).map(of_alpha);
    Some(Mask { texture, factor, cutoff, over: Vec::new() })
}

/// Names what of a material is not modelled.
fn ignore(read: &Read, name: &str, ignored: &mut Ignored) {
    let pbr = &read.pbr_metallic_roughness;
    let [metal, gloss, textured] = match &read.extensions.specular_glossiness {
        Some(given) => [false, given.specular_factor != [0.0; 3], given.specular_glossiness_texture.is_some()],
        None => [pbr.metallic_factor > 0.0, pbr.roughness_factor < 1.0, pbr.metallic_roughness_texture.is_some()],
    };
    let textured = textured || read.normal_texture.is_some() || read.occlusion_texture.is_some();
    for (kind, there) in [(Kind::Bumps, textured), (Kind::Metal, metal), (Kind::Gloss, gloss)] {
        if there {
            ignored.add(kind, name);
        }
    }
}
