//! Materials of glTF and their textures: the base colour is rho, what is emitted is E, and double-sided ones have two
//! sides. Alpha cuts holes by `alphaMode`: by the cutoff, or by shares.
//!
//! glTF's unit of emission is the nit, a luminance; a factor of 1 is taken as a radiance of 1 W/(m² sr) in its channel,
//! without a luminous efficacy. The base colour (1, 1, 1), which is also that of materials without any, would reflect
//! everything: without a texture such a material reflects [`DEFAULT_RHO`], with a warning, unless its vertices have
//! colours.
//!
//! An image is decoded once however often it is used. One that is not there, or that is neither PNG nor JPEG, is named
//! among what is ignored; one that is broken is an error. Images in buffer views may have no more bytes together than
//! the buffers, so memory is bounded by the sizes of the files.
//!
//! Not handled: all else that materials have, which [`Ignored`] names; the second of two sets of texture coordinates in
//! one material; filters for small pictures. A material whose emissive texture cannot be read emits nothing, since most
//! such textures are black but for a few texels.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine2, DMat2, DVec2, Vec3};
use gltf_json::Root;
use gltf_json::extensions::texture::TextureTransform;
use gltf_json::material::{AlphaMode, Material as Read};
use gltf_json::texture::{Info, MagFilter, Sampler, WrappingMode};
use gltf_json::validation::Checked;

use crate::pictures::{Texels, TexelsError};
use crate::scene::error::{Place, SceneError, Tally};
use crate::scene::gltf::accessors::{Data, slice};
use crate::scene::gltf::document::{Ignored, fetch, name};
use crate::scene::model::{DEFAULT_RHO, Material, Sides};
use crate::scene::soup::{Defined, Reader, Reflects, Soup, check_emission, check_rho};
use crate::scene::textures::{Channel, Filter, Image, Maps, Mask, Texture, Wrap};

/// The materials of a file.
pub(super) struct Materials {
    pub list: Vec<Material>,
    /// The set of coordinates that the textures of each go by, if it has any.
    pub sets: Vec<Option<u32>>,
    /// What colours of vertices are factors of.
    pub defined: Vec<Defined>,
}

/// All materials of the file in its order.
pub(super) fn materials(root: &Root, images: &mut Images, ignored: &mut Ignored) -> Result<Materials, SceneError> {
    let file = images.file;
    let mut all = Materials { list: Vec::new(), sets: Vec::new(), defined: Vec::new() };
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
        let reflects = if is_white { Reflects::UndefinedWhite } else { Reflects::Defined };
        all.defined.push(Defined { rho: reflects, mask: maps.mask.clone() });
        let lost = read.emissive_texture.is_some() && maps.emission.is_none();
        let emission = if lost { Vec3::ZERO } else { emission };
        let sides = if read.double_sided { Sides::Two } else { Sides::One };
        let mut material = Material { sides, ..Material::new(&name, rho, emission) };
        material.set_maps(maps);
        all.sets.push(material.has_images().then_some(set));
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
    let set = base.as_ref().or(glow.as_ref()).map_or(0, |(_, set)| *set);
    if glow.as_ref().is_some_and(|(_, of_glow)| *of_glow != set) {
        ignored.add("emission by a second set of texture coordinates, of materials", name);
        glow = None;
    }
    let (reflectance, emission) = (base.map(|(texture, _)| texture), glow.map(|(texture, _)| texture));
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
    let shares = |base: &Texture| {
        let image = Arc::new(Image::shares(base.image.texels(), Channel::Alpha));
        Texture { image, ..base.clone() }
    };
    let texture = base.filter(|texture| texture.image.has_alpha()).map(shares);
    Some(Mask { texture, factor, cutoff, over: Vec::new() })
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

/// The images of a file.
pub(super) struct Images<'a, 'r> {
    pub file: &'a str,
    pub data: &'a Data<'a>,
    pub reader: Reader<'r>,
    /// By where their bytes are; none where there is no image.
    known: HashMap<Source<'a>, Option<Arc<Image>>>,
    /// Bytes of buffer views read so far.
    read: usize,
}

/// Where the bytes of an image are.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Source<'a> {
    View(usize),
    Uri(&'a str),
}

impl<'a, 'r> Images<'a, 'r> {
    /// No image yet.
    pub(super) fn new(file: &'a str, data: &'a Data<'a>, reader: Reader<'r>) -> Images<'a, 'r> {
        Images { file, data, reader, known: HashMap::new(), read: 0 }
    }

    /// The texture that a material names and the set of coordinates that it goes by, if its image can be read; else the
    /// material is named in `ignored`.
    ///
    /// # Errors
    /// A broken image.
    pub(super) fn texture(
        &mut self,
        info: Option<&Info>,
        material: &str,
        ignored: &mut Ignored,
    ) -> Result<Option<(Texture, u32)>, SceneError> {
        let Some(info) = info else { return Ok(None) };
        let texture = &self.data.root.textures[info.index.value()];
        let Some(image) = self.image(texture.source.value())? else {
            ignored.add("images that cannot be read, of materials", material);
            return Ok(None);
        };
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        let sampler = texture.sampler.map(|sampler| &self.data.root.samplers[sampler.value()]);
        let texture = Texture {
            image,
            placement: transform.map_or(DAffine2::IDENTITY, placement),
            wrap: sampler.map_or([Wrap::Repeat; 2], |s| [wrap(&s.wrap_s), wrap(&s.wrap_t)]),
            filter: sampler.map_or(Filter::Linear, filter),
        };
        Ok(Some((texture, transform.and_then(|t| t.tex_coord).unwrap_or(info.tex_coord))))
    }

    fn image(&mut self, number: usize) -> Result<Option<Arc<Image>>, SceneError> {
        let Some(image) = self.data.root.images.get(number) else { return Ok(None) };
        let source = match (&image.buffer_view, &image.uri) {
            (Some(view), _) => Source::View(view.value()),
            (None, Some(uri)) => Source::Uri(uri),
            (None, None) => return Ok(None),
        };
        if let Some(known) = self.known.get(&source) {
            return Ok(known.clone());
        }
        let wrong = |message: &str| SceneError::Gltf {
            file: self.file.to_owned(),
            message: format!("image {number} is broken: {message}"),
        };
        let found = match source {
            Source::View(view) => {
                let view = &self.data.root.buffer_views[view];
                let bytes = &self.data.buffers[view.buffer.value()];
                let own = slice(bytes, view.byte_offset.unwrap_or_default().0, view.byte_length.0);
                let own = own.ok_or_else(|| wrong("its buffer view goes beyond its buffer"))?;
                self.read += own.len();
                let all: usize = self.data.buffers.iter().map(|bytes| bytes.len()).sum();
                if self.read > all {
                    return Err(wrong("its buffer view is a part of another image's"));
                }
                decoded(own)
            }
            Source::Uri(uri) => match fetch(uri, self.reader) {
                None => return Err(wrong("its data URI cannot be decoded")),
                Some(Err(_)) => Ok(None),
                Some(Ok(bytes)) => decoded(&bytes),
            },
        };
        let found = found.map_err(|message| wrong(&message))?;
        self.known.insert(source, found.clone());
        Ok(found)
    }
}

/// The image of these bytes, if they are PNG or JPEG.
fn decoded(bytes: &[u8]) -> Result<Option<Arc<Image>>, String> {
    match Texels::decode("", bytes) {
        Ok(texels) => Ok(Some(Arc::new(Image::new(texels)))),
        Err(TexelsError::Format) => Ok(None),
        Err(TexelsError::Broken(message)) => Err(message),
    }
}

/// Scaled, then turned counter-clockwise as seen with v running down, then moved (KHR_texture_transform).
fn placement(transform: &TextureTransform) -> DAffine2 {
    let vector = |[x, y]: [f32; 2]| DVec2::new(f64::from(x), f64::from(y));
    let turn = DMat2::from_angle(-f64::from(transform.rotation.0));
    let matrix2 = turn * DMat2::from_diagonal(vector(transform.scale.0));
    let found = DAffine2 { matrix2, translation: vector(transform.offset.0) };
    if found.is_finite() { found } else { DAffine2::IDENTITY }
}

fn wrap(mode: &Checked<WrappingMode>) -> Wrap {
    match mode {
        Checked::Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Checked::Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        Checked::Valid(WrappingMode::Repeat) | Checked::Invalid => Wrap::Repeat,
    }
}

fn filter(sampler: &Sampler) -> Filter {
    match sampler.mag_filter {
        Some(Checked::Valid(MagFilter::Nearest)) => Filter::Nearest,
        _ => Filter::Linear,
    }
}
