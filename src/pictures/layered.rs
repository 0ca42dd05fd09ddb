//! A picture and its standard error in one EXR file.
//!
//! The picture has the channels R, G and B, so that every reader finds it; the other picture's channels have its name
//! before them (`standard error.R`), which is how OpenEXR tells layers of one part apart. Linear 32-bit floats, exact.
//!
//! Not handled: reading such layers back; [`crate::pictures::files::read_picture`] reads the picture.

use std::io::Cursor;
use std::path::Path;

use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer};
use exr::meta::header::LayerAttributes;
use exr::prelude::WritableImage;

use crate::pictures::atomic::write_whole;
use crate::pictures::error::ImageError;
use crate::pictures::picture::Picture;
use crate::pictures::size::Size;

/// The name of the layer.
const LAYER: &str = "standard error";

/// Writes a picture with the standard error of each pixel, an `.exr` file.
///
/// # Errors
/// Pictures without pixels or of two sizes, or a destination that cannot be written. Nothing is left behind.
pub fn write_with_error(path: impl AsRef<Path>, picture: &Picture, standard_error: &Picture) -> Result<(), ImageError> {
    let Size { width, height } = picture.size();
    let refused = |reason: &str| ImageError::Encode { width, height, reason: reason.into() };
    if width == 0 || height == 0 {
        return Err(refused("it has no pixels"));
    }
    if standard_error.size() != picture.size() {
        return Err(refused("its standard error is of another size"));
    }
    let channel = |name: String, of: &Picture, c: usize| {
        let samples = of.pixels.iter().map(|p| p[c]).collect();
        AnyChannel::new(name.as_str(), FlatSamples::F32(samples))
    };
    let colours = ["R", "G", "B"].into_iter().enumerate();
    let all = colours.flat_map(|(c, colour)| {
        [channel(colour.into(), picture, c), channel(format!("{LAYER}.{colour}"), standard_error, c)]
    });
    let layer = Layer::new(
        (width, height),
        LayerAttributes::default(),
        Encoding::FAST_LOSSLESS,
        AnyChannels::sort(all.collect()),
    );
    let mut file = Cursor::new(Vec::new());
    let image = Image::from_layer(layer);
    let writer = image.write().non_parallel();
    writer.to_buffered(&mut file).map_err(|error| refused(&error.to_string()))?;
    Ok(write_whole(path.as_ref(), &file.into_inner())?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::Rgb;
    use crate::pictures::files::read_picture;

    #[test]
    fn readers_of_pictures_find_the_picture_and_the_layer_has_its_name() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("a.exr");
        let picture = Picture::from_fn(5, 3, |x, y| Rgb::new(x as f32, y as f32, 0.1));
        let error = picture.scaled(0.25);
        write_with_error(&path, &picture, &error).unwrap();
        assert_eq!(read_picture(&path).unwrap(), picture);
        let layers = exr::prelude::read_all_flat_layers_from_file(&path).unwrap();
        let channels = &layers.layer_data[0].channel_data.list;
        let found = channels.iter().find(|c| c.name.to_string() == "standard error.R");
        let values: Vec<f32> = found.unwrap().sample_data.values_as_f32().collect();
        let exact: Vec<f32> = error.pixels.iter().map(|p| p.x).collect();
        assert_eq!(values, exact);
    }

    #[test]
    fn two_sizes_are_refused_and_leave_nothing() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("a.exr");
        let found = write_with_error(&path, &Picture::new(2, 2), &Picture::new(2, 3));
        assert!(matches!(found, Err(ImageError::Encode { .. })) && !path.exists());
    }
}
