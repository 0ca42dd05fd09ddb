//! Textures of glTF: images in buffer views, `data:` URIs or files, with their samplers and KHR_texture_transform.
//!
//! v runs down from the image's upper edge. An image is decoded once however often it is used. One that is not there,
//! or that is neither PNG nor JPEG, is named among what is ignored; one that is broken is an error. Images in buffer
//! views may have no more bytes together than the buffers, so memory is bounded by the sizes of the files.
//!
//! Not handled: the second of two sets of texture coordinates in one material; filters for small pictures.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DAffine2, DMat2, DVec2};
use gltf_json::extensions::texture::TextureTransform;
use gltf_json::texture::{Info, MagFilter, Sampler, WrappingMode};
use gltf_json::validation::Checked;

use crate::pictures::{Texels, TexelsError};
use crate::scene::error::SceneError;
use crate::scene::gltf::accessors::{Data, slice};
use crate::scene::gltf::container::fetch;
use crate::scene::gltf::ignored::Ignored;
use crate::scene::obj::Reader;
use crate::scene::textures::{Filter, Image, Texture, Wrap};

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

/// A texture and the set of coordinates that it goes by.
pub(super) struct Placed {
    pub texture: Texture,
    pub set: u32,
}

impl<'a, 'r> Images<'a, 'r> {
    /// No image yet.
    pub fn new(file: &'a str, data: &'a Data<'a>, reader: Reader<'r>) -> Images<'a, 'r> {
        Images { file, data, reader, known: HashMap::new(), read: 0 }
    }

    /// The texture that a material names, if it names one whose image can be read; else the material is named in
    /// `ignored`.
    ///
    /// # Errors
    /// A broken image.
    pub fn texture(
        &mut self,
        info: Option<&Info>,
        material: &str,
        ignored: &mut Ignored,
    ) -> Result<Option<Placed>, SceneError> {
        let Some(info) = info else { return Ok(None) };
        let texture = &self.data.root.textures[info.index.value()];
        let Some(image) = self.image(texture.source.value())? else {
            ignored.add("images that cannot be read, of materials", material);
            return Ok(None);
        };
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        let sampler = texture.sampler.map(|sampler| &self.data.root.samplers[sampler.value()]);
        Ok(Some(Placed {
            texture: Texture {
                image,
                placement: transform.map_or(DAffine2::IDENTITY, placement),
                wrap: sampler.map_or([Wrap::Repeat; 2], |s| [wrap(&s.wrap_s), wrap(&s.wrap_t)]),
                filter: sampler.map_or(Filter::Linear, filter),
            },
            set: transform.and_then(|t| t.tex_coord).unwrap_or(info.tex_coord),
        }))
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
