//! Materials of glTF: the base colour is rho, what is emitted is E, and double-sided ones have two sides.
//!
//! Base colours and emission are linear. glTF's unit of emission is the nit, a luminance; a factor of 1 is taken as a
//! radiance of 1 W/(m² sr) in its channel, without a luminous efficacy. The base colour (1, 1, 1), which is also that
//! of materials without any, would reflect everything: such a material reflects [`DEFAULT_RHO`], with a warning, unless
//! its vertices have colours.
//!
//! Textures of the base colour and of emission are multiplied by their factors; a base colour with a texture may be
//! white. Alpha cuts holes as `alphaMode` says: by the cutoff, or by shares.
//!
//! Not handled: all else that materials have, which [`Ignored`] names. A material whose emissive texture cannot be read
//! emits nothing, since most such textures are black but for a few texels.

use glam::Vec3;
use gltf_json::Root;
use gltf_json::material::{AlphaMode, Material as Read};
use gltf_json::validation::Checked;

use crate::scene::build::Soup;
use crate::scene::error::{Place, SceneError};
use crate::scene::gltf::ignored::Ignored;
use crate::scene::gltf::textures::{Images, Placed};
use crate::scene::material_checks::{check_emission, check_rho};
use crate::scene::mtl::DEFAULT_RHO;
use crate::scene::textures::{Channel, Maps, Mask, Texture};
use crate::scene::vertex_colours::{Reflects, Said};
use crate::scene::warnings::Tally;
use crate::scene::{Material, Sides};

/// The materials of a file.
pub(super) struct Materials {
    pub list: Vec<Material>,
    /// The set of coordinates that the textures of each go by, if it has any.
    pub sets: Vec<Option<u32>>,
    /// What colours of vertices are factors of.
    pub said: Vec<Said>,
}

/// All materials of the file in its order.
pub(super) fn materials(root: &Root, images: &mut Images, ignored: &mut Ignored) -> Result<Materials, SceneError> {
    let file = images.file;
    let mut all = Materials { list: Vec::new(), sets: Vec::new(), said: Vec::new() };
    for (number, read) in root.materials.iter().enumerate() {
        let name = name(&read.name, "material", number);
        let place = || Place::item(file, "material", number);
        let [r, g, b, _] = read.pbr_metallic_roughness.base_color_factor.0;
        check_rho([r, g, b].map(f64::from), &name, place)?;
        let emission = emission(read);
        check_emission(emission.as_dvec3().to_array(), &name, place)?;
        ignore(read, &name, ignored);
        let (maps, set) = maps(read, &name, images, ignored)?;
        let mut rho = Vec3::new(r, g, b);
        let is_white = rho == Vec3::ONE && maps.reflectance.is_none();
        if is_white {
            rho = Vec3::splat(DEFAULT_RHO);
        }
        let reflects = if is_white { Reflects::UnsaidWhite } else { Reflects::Said };
        all.said.push(Said { rho: reflects, mask: maps.mask.clone() });
        let lost = read.emissive_texture.is_some() && maps.emission.is_none();
        let emission = if lost { Vec3::ZERO } else { emission };
        let sides = if read.double_sided { Sides::Two } else { Sides::One };
        let mut material = Material { sides, ..Material::new(&name, rho, emission) };
        maps.put_on(&mut material);
        all.sets.push(material.maps.as_ref().filter(|maps| maps.has_images()).map(|_| set));
        all.list.push(material);
    }
    Ok(all)
}

/// Warns of materials that would reflect everything, but of those whose vertices are coloured.
pub(super) fn warn_of_white(soup: &mut Soup, is_white: &[bool], coloured: &[bool]) {
    let mut white = Tally::default();
    for (number, material) in soup.materials.iter().enumerate() {
        if is_white.get(number) == Some(&true) && !coloured[number] {
            white.add_named(number, &material.name);
        }
    }
    let consequence = format!("it would reflect everything; it reflects {DEFAULT_RHO}");
    white.report(&soup.file, "material", "white base colour", &consequence, &mut soup.warnings);
}

/// A name without control characters, or the number where there is none.
pub(super) fn name(given: &Option<String>, what: &str, number: usize) -> String {
    match given.as_deref().map(str::trim) {
        None | Some("") => format!("{what} {number}"),
        Some(name) => name.replace(char::is_control, " "),
    }
}

/// Emitted radiance, W/(m² sr): the factor times the strength of KHR_materials_emissive_strength.
fn emission(read: &Read) -> Vec3 {
    let strength = read.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref());
    Vec3::from_array(read.emissive_factor.0) * strength.map_or(1.0, |s| s.emissive_strength.0)
}

/// The textures of a material and the set of coordinates that they go by.
fn maps(read: &Read, name: &str, images: &mut Images, ignored: &mut Ignored) -> Result<(Maps, u32), SceneError> {
    let pbr = &read.pbr_metallic_roughness;
    let base = images.texture(pbr.base_color_texture.as_ref(), name, ignored)?;
    let mut glow = images.texture(read.emissive_texture.as_ref(), name, ignored)?;
    let set = base.as_ref().or(glow.as_ref()).map_or(0, |placed| placed.set);
    if glow.as_ref().is_some_and(|glow| glow.set != set) {
        ignored.add("emission by a second set of texture coordinates, of materials", name);
        glow = None;
    }
    let texture = |placed: Option<Placed>| placed.map(|placed| placed.texture);
    let (reflectance, emission) = (texture(base), texture(glow));
    let mask = mask(read, reflectance.as_ref());
    Ok((Maps { reflectance, emission, mask, vertex_colours: false }, set))
}

/// The holes that alpha cuts.
fn mask(read: &Read, base: Option<&Texture>) -> Option<Mask> {
    let cutoff = match read.alpha_mode {
        Checked::Valid(AlphaMode::Mask) => Some(read.alpha_cutoff.unwrap_or_default().0),
        Checked::Valid(AlphaMode::Blend) => None,
        Checked::Valid(AlphaMode::Opaque) | Checked::Invalid => return None,
    };
    let [.., factor] = read.pbr_metallic_roughness.base_color_factor.0;
    let texture = base.filter(|texture| texture.image.has_alpha()).cloned();
    Some(Mask { texture, channel: Channel::Alpha, factor, cutoff, over: Vec::new() })
}

fn ignore(read: &Read, name: &str, ignored: &mut Ignored) {
    let pbr = &read.pbr_metallic_roughness;
    let textured =
        [pbr.metallic_roughness_texture.is_some(), read.normal_texture.is_some(), read.occlusion_texture.is_some()];
    for (kind, there) in [
        ("textures of gloss, bumps and occlusion, of materials", textured.contains(&true)),
        ("metal, of materials", pbr.metallic_factor.0 > 0.0),
        ("gloss, of materials", pbr.roughness_factor.0 < 1.0),
    ] {
        if there {
            ignored.add(kind, name);
        }
    }
}
