//! Materials of glTF: the base colour is rho, what is emitted is E, and double-sided ones have two sides.
//!
//! Base colours and emission are linear. glTF's unit of emission is the nit, a luminance; a factor of 1 is taken as a
//! radiance of 1 W/(m² sr) in its channel, without a luminous efficacy. The base colour (1, 1, 1), which is also that
//! of materials without any, would reflect everything: such a material reflects [`DEFAULT_RHO`], with a warning.
//!
//! Not handled: all else that materials have, which [`Ignored`] names. A material with an emissive texture emits
//! nothing, since most such textures are black but for a few texels.

use glam::Vec3;
use gltf_json::Root;
use gltf_json::material::{AlphaMode, Material as Read};
use gltf_json::validation::Checked;

use crate::scene::error::{Place, SceneError};
use crate::scene::gltf::ignored::Ignored;
use crate::scene::mtl::{DEFAULT_RHO, check_emission, check_rho};
use crate::scene::warnings::Tally;
use crate::scene::{Material, Sides};

/// All materials of the file in its order.
pub(super) fn materials(
    file: &str,
    root: &Root,
    ignored: &mut Ignored,
    warnings: &mut Vec<String>,
) -> Result<Vec<Material>, SceneError> {
    let mut all = Vec::new();
    let mut white = Tally::default();
    for (number, read) in root.materials.iter().enumerate() {
        let name = name(&read.name, "material", number);
        let place = || Place::item(file, "material", number);
        let [r, g, b, _] = read.pbr_metallic_roughness.base_color_factor.0;
        check_rho([r, g, b].map(f64::from), &name, place)?;
        let emission = emission(read);
        check_emission(emission.as_dvec3().to_array(), &name, place)?;
        ignore(read, &name, ignored);
        let mut rho = Vec3::new(r, g, b);
        if rho == Vec3::ONE {
            white.add_named(number, &name);
            rho = Vec3::splat(DEFAULT_RHO);
        }
        let sides = if read.double_sided { Sides::Two } else { Sides::One };
        all.push(Material { sides, ..Material::new(&name, rho, emission) });
    }
    let consequence = format!("it would reflect everything; it reflects {DEFAULT_RHO}");
    white.report(file, "material", "white base colour", &consequence, warnings);
    Ok(all)
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
    if read.emissive_texture.is_some() {
        return Vec3::ZERO;
    }
    let strength = read.extensions.as_ref().and_then(|e| e.emissive_strength.as_ref());
    Vec3::from_array(read.emissive_factor.0) * strength.map_or(1.0, |s| s.emissive_strength.0)
}

fn ignore(read: &Read, name: &str, ignored: &mut Ignored) {
    let pbr = &read.pbr_metallic_roughness;
    let textured = [
        pbr.base_color_texture.is_some(),
        pbr.metallic_roughness_texture.is_some(),
        read.normal_texture.is_some(),
        read.occlusion_texture.is_some(),
    ];
    let opaque = matches!(read.alpha_mode, Checked::Valid(AlphaMode::Opaque));
    for (kind, there) in [
        ("textures of materials", textured.contains(&true)),
        ("emission by textures, of materials", read.emissive_texture.is_some()),
        ("metal, of materials", pbr.metallic_factor.0 > 0.0),
        ("gloss, of materials", pbr.roughness_factor.0 < 1.0),
        ("alpha of materials", !opaque),
    ] {
        if there {
            ignored.add(kind, name);
        }
    }
}
