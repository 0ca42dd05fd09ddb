//! Textures of glTF materials: images, with how they lie and are sampled.
//!
//! An image is decoded once however often it is used. PNG, JPEG, WebP and BMP are read, whatever the file calls them.
//! Where a texture has several images, those of extensions count first. One that is not there, or of another format, is
//! named among what is ignored, with what counts in its place; one that is broken is an error. Images in buffer views
//! may have no more bytes together than the buffers, and all together [`FREE_TEXELS`] or [`TEXELS_A_BYTE`], so memory
//! is bounded by the sizes of the files.
//!
//! Not handled: filters for small pictures; KTX2, AVIF and DDS.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine2, DMat2, DVec2};

use crate::pictures::{Texels, TexelsError};
use crate::scene::error::shorten;
use crate::scene::gltf::buffers::Data;
use crate::scene::gltf::fault::{Fault, item};
use crate::scene::gltf::ignored::{Ignored, Kind};
use crate::scene::gltf::schema::{Index, Sampler, Texture as Read, TextureInfo, TextureTransform};
use crate::scene::textures::{Filter, Image, ShareImages, Texture, Wrap};

/// Texels that the images of a file may have together, whatever their sizes.
const FREE_TEXELS: usize = 1 << 28;
/// Texels that they may have for each of their bytes: what one PNG or JPEG may have.
const TEXELS_A_BYTE: usize = 2048;

/// The images of a file.
pub(super) struct Images<'a, 'r> {
    pub data: &'a Data<'a, 'r>,
    pub share_images: ShareImages,
    /// By where their bytes are.
    known: HashMap<Source<'a>, Found>,
    /// Bytes of buffer views read so far.
    read: usize,
    /// Bytes of images read so far, and the texels that they became.
    bytes: usize,
    texels: usize,
}

/// Where the bytes of an image are.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Source<'a> {
    View(Index),
    Uri(&'a str),
}

/// What came of an image.
#[derive(Clone)]
enum Found {
    Image(Arc<Image>),
    /// Bytes of a format that is not read.
    Other(&'static str),
    /// Nothing is there.
    Nothing,
}

impl<'a, 'r> Images<'a, 'r> {
    /// No image yet.
    pub(super) fn new(data: &'a Data<'a, 'r>) -> Images<'a, 'r> {
        Images { data, share_images: ShareImages::default(), known: HashMap::new(), read: 0, bytes: 0, texels: 0 }
    }

    /// The texture that a material names and the set of coordinates that it goes by, if its image can be read; else the
    /// material is named in `ignored`.
    ///
    /// # Errors
    /// A broken image.
    pub(super) fn texture(
        &mut self,
        info: Option<&TextureInfo>,
        material: &str,
        ignored: &mut Ignored,
    ) -> Result<Option<(Texture, u64)>, Fault> {
        let Some(info) = info else { return Ok(None) };
        let root = self.data.root;
        let texture = item(&root.textures, info.index, "texture")?;
        let Some(image) = self.of_texture(texture, material, ignored)? else { return Ok(None) };
        let transform = info.extensions.transform.as_ref();
        let sampler = match texture.sampler {
            Some(index) => Some(item(&root.samplers, index, "sampler")?),
            None => None,
        };
        let texture = Texture {
            image,
            placement: transform.map_or(DAffine2::IDENTITY, placement),
            wrap: sampler.map_or([Wrap::Repeat; 2], |s| [wrap(s.wrap_s), wrap(s.wrap_t)]),
            filter: sampler.map_or(Filter::Linear, filter),
        };
        Ok(Some((texture, transform.and_then(|t| t.tex_coord).unwrap_or(info.tex_coord).0)))
    }

    /// The first image of a texture that can be read.
    fn of_texture(
        &mut self,
        texture: &Read,
        material: &str,
        ignored: &mut Ignored,
    ) -> Result<Option<Arc<Image>>, Fault> {
        let extensions = &texture.extensions;
        let others = [("KTX2", &extensions.basisu), ("AVIF", &extensions.avif), ("DDS", &extensions.dds)];
        let mut lost = Vec::new();
        for (format, _) in others.iter().filter(|(_, other)| other.is_some()) {
            lost.push((Kind::ImagesOfOtherFormats, format!("{material}: {format}")));
        }
        let webp = extensions.webp.as_ref().and_then(|other| other.source);
        let mut image = None;
        for index in [webp, texture.source].into_iter().flatten() {
            match self.image(index)? {
                Found::Image(found) => {
                    image = Some(found);
                    break;
                }
                Found::Other(format) => {
                    lost.push((Kind::ImagesOfOtherFormats, format!("{material}: {format}")));
                }
                Found::Nothing => lost.push((Kind::ImagesLost, format!("{material}: {}", self.name(index)))),
            }
        }
        if image.is_none() && lost.is_empty() {
            lost.push((Kind::ImagesLost, format!("{material}: a texture without an image")));
        }
        for (kind, name) in lost {
            ignored.add(if image.is_some() { Kind::ImagesReplaced } else { kind }, &name);
        }
        Ok(image)
    }

    /// The name of an image for a message.
    fn name(&self, index: Index) -> String {
        let uri = self.data.root.images.get(index.0).and_then(|image| image.uri.as_deref());
        uri.map_or_else(|| format!("image {}", index.0), |uri| shorten(&uri.replace(char::is_control, " ")))
    }

    fn image(&mut self, index: Index) -> Result<Found, Fault> {
        let image = item(&self.data.root.images, index, "image")?;
        let source = match (&image.buffer_view, &image.uri) {
            (Some(view), _) => Source::View(*view),
            (None, Some(uri)) => Source::Uri(uri),
            (None, None) => return Ok(Found::Nothing),
        };
        if let Some(known) = self.known.get(&source) {
            return Ok(known.clone());
        }
        let found = self.decode(source).map_err(|fault| fault.within(&format!("image {} is broken", index.0)))?;
        self.known.insert(source, found.clone());
        Ok(found)
    }

    fn decode(&mut self, source: Source) -> Result<Found, Fault> {
        let uri = match source {
            Source::View(view) => {
                let data = self.data;
                let own = data.view(view)?;
                self.read += own.len();
                if self.read > data.size() {
                    return Err("its buffer view is a part of another image's".into());
                }
                return self.count(own);
            }
            Source::Uri(uri) => uri,
        };
        match self.data.fetch(uri) {
            None => Err("its data URI cannot be decoded".into()),
            Some(Err(_)) => Ok(Found::Nothing),
            Some(Ok(bytes)) => self.count(&bytes),
        }
    }

    /// The image of these bytes, whose texels are counted.
    fn count(&mut self, bytes: &[u8]) -> Result<Found, Fault> {
        let (found, texels) = decoded(bytes)?;
        self.bytes += bytes.len();
        self.texels += texels;
        let fits = self.texels <= FREE_TEXELS.saturating_add(TEXELS_A_BYTE.saturating_mul(self.bytes));
        fits.then_some(found).ok_or_else(|| "with those before it, it has more pixels than their bytes allow".into())
    }
}

/// The image of these bytes, and how many texels it has.
fn decoded(bytes: &[u8]) -> Result<(Found, usize), String> {
    match Texels::decode("", bytes) {
        Ok(texels) => {
            let count = texels.width * texels.height;
            Ok((Found::Image(Arc::new(Image::new(texels))), count))
        }
        Err(TexelsError::Format(format)) => Ok((Found::Other(format), 0)),
        Err(TexelsError::Broken(message)) => Err(message),
    }
}

/// Scaled, then turned counter-clockwise as seen with v running down, then moved (KHR_texture_transform).
fn placement(transform: &TextureTransform) -> DAffine2 {
    let vector = |[x, y]: [f32; 2]| DVec2::new(f64::from(x), f64::from(y));
    let turn = DMat2::from_angle(-f64::from(transform.rotation));
    let matrix2 = turn * DMat2::from_diagonal(vector(transform.scale));
    let found = DAffine2 { matrix2, translation: vector(transform.offset) };
    if found.is_finite() { found } else { DAffine2::IDENTITY }
}

/// How a texture goes on, by its code; as glTF's default by any other.
fn wrap(code: Option<f64>) -> Wrap {
    match code {
        Some(33071.0) => Wrap::Clamp,
        Some(33648.0) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}

fn filter(sampler: &Sampler) -> Filter {
    if sampler.mag_filter == Some(9728.0) { Filter::Nearest } else { Filter::Linear }
}
