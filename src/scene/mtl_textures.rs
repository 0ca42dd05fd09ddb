//! The textures and the opacity of an OBJ's materials: images found, decoded once, and put onto the materials that
//! faces use.
//!
//! An image is looked for beside its MTL file, then beside the scene's files, as MTL files are
//! ([`crate::scene::libraries`]). One that is not there, or is neither PNG, JPEG nor TGA, is warned of, and the
//! material keeps its plain numbers; one that is broken is an error. `Kd` and `Ke` are factors on their textures; left
//! out, or all 0, which would leave nothing of the texture, they count as 1. The opacity is a factor on `map_d`.
//!
//! Not handled: textures of materials that no face uses, which are not read.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io;
use std::sync::Arc;

use crate::light::Rgb;
use crate::pictures::{Texels, TexelsError};
use crate::scene::Material;
use crate::scene::error::{Place, SceneError};
use crate::scene::libraries::{Reader, read_either_way};
use crate::scene::lines::{list, shorten};
use crate::scene::mtl::Libraries;
use crate::scene::mtl_maps::MapLine;
use crate::scene::textures::{Channel, Filter, Image, Maps, Mask, Texture};
use crate::scene::warnings::Tally;

/// Images by name, each decoded once.
struct Images<'a, 'f> {
    reader: Reader<'a>,
    /// The folder of the OBJ, with the slash.
    folder: &'f str,
    known: HashMap<String, Option<Arc<Image>>>,
    /// Lines whose image cannot be read, the names, and the first one's library and reason.
    missing: Tally,
    names: Vec<String>,
    first: Option<(String, String)>,
}

/// Puts textures onto the materials that `used` numbers; `file` names the OBJ. Adds to the warnings.
///
/// # Errors
/// The first image that is there and broken, with the line of its library.
pub(crate) fn attach(
    file: &str,
    libraries: &Libraries,
    used: &[usize],
    materials: &mut [Material],
    reader: Reader,
    warnings: &mut Vec<String>,
) -> Result<(), SceneError> {
    let folder = file.rfind(['/', '\\']).map_or("", |end| &file[..=end]);
    let (missing, known) = (Tally::default(), HashMap::new());
    let mut images = Images { reader, folder, known, missing, names: Vec::new(), first: None };
    for &index in used {
        let lines = libraries.maps(index);
        let material = &mut materials[index];
        let given = libraries.factors(index);
        let mut maps = Maps::default();
        if let Some((line, image)) = images.open(&lines.kd, &material.name)? {
            material.rho = factor(given[0], material.rho);
            maps.reflectance = Some(texture(line, image));
        }
        if let Some((line, image)) = images.open(&lines.ke, &material.name)? {
            material.emission = factor(given[1], material.emission);
            maps.emission = Some(texture(line, image));
        }
        let mut mask = Mask { factor: libraries.opacity(index), ..Mask::WHOLE };
        if let Some((line, image)) = images.open(&lines.d, &material.name)? {
            let own = if image.has_alpha() { Channel::Alpha } else { Channel::Luminance };
            mask.channel = line.channel.unwrap_or(own);
            mask.texture = Some(texture(line, image));
        }
        maps.mask = Some(mask);
        maps.put_on(material);
    }
    images.report(warnings);
    Ok(())
}

/// The factor on a texture.
fn factor(is_given: bool, own: Rgb) -> Rgb {
    if is_given && own != Rgb::ZERO { own } else { Rgb::ONE }
}

fn texture(line: &MapLine, image: Arc<Image>) -> Texture {
    let placement = Texture::upright(line.scale, line.offset);
    Texture { image, placement, wrap: [line.wrap; 2], filter: Filter::Linear }
}

impl Images<'_, '_> {
    /// The image of a line, where there is one that can be read.
    fn open<'l>(
        &mut self,
        line: &'l Option<MapLine>,
        material: &str,
    ) -> Result<Option<(&'l MapLine, Arc<Image>)>, SceneError> {
        let Some(line) = line else { return Ok(None) };
        let library = line.file.rfind(['/', '\\']).map_or("", |end| &line.file[..=end]);
        let key = format!("{library}\n{}", line.name);
        if let Some(known) = self.known.get(&key) {
            if known.is_none() {
                self.missing.add_named(line.line, material);
            }
            return Ok(known.clone().map(|image| (line, image)));
        }
        let found = match self.decoded(library, line) {
            Ok(texels) => Some(Arc::new(Image::new(texels))),
            Err(Failure::Broken(message)) => {
                let place = Place::line(&line.file, line.line);
                return Err(SceneError::Image { place, name: shorten(&line.name), message });
            }
            Err(Failure::Missing(why)) => {
                self.missing.add_named(line.line, material);
                self.names.push(line.name.clone());
                self.first.get_or_insert_with(|| (line.file.clone(), why));
                None
            }
        };
        self.known.insert(key, found.clone());
        Ok(found.map(|image| (line, image)))
    }

    fn decoded(&self, library: &str, line: &MapLine) -> Result<Texels, Failure> {
        let bytes = self.bytes(library, &line.name).map_err(|error| Failure::Missing(error.to_string()))?;
        Texels::decode(&line.name, &bytes).map_err(|error| match error {
            TexelsError::Format => Failure::Missing(error.to_string()),
            TexelsError::Broken(message) => Failure::Broken(message),
        })
    }

    /// The file of that name, or of its last part, in the folder of the library, beside the scene, or beside the OBJ.
    fn bytes(&self, library: &str, name: &str) -> io::Result<Cow<'_, [u8]>> {
        let last = name.rsplit(['/', '\\']).next().unwrap_or(name);
        let folders = [library, "", self.folder];
        let names = folders.iter().flat_map(|folder| [name, last].map(|name| format!("{folder}{name}")));
        let mut failure = None;
        for name in names {
            match read_either_way(&name, self.reader) {
                Ok(bytes) => return Ok(bytes),
                Err(error) => failure = failure.or(Some(error)),
            }
        }
        Err(failure.unwrap_or_else(|| io::ErrorKind::NotFound.into()))
    }

    fn report(&self, warnings: &mut Vec<String>) {
        let Some((file, why)) = &self.first else { return };
        let names = list(self.names.iter().map(String::as_str));
        let consequence = format!("{names} ({why}): the plain numbers count");
        self.missing.report(file, "line", "missing texture", &consequence, warnings);
    }
}

/// Why there are no texels.
enum Failure {
    Missing(String),
    Broken(String),
}
