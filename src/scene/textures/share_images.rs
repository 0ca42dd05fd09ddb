//! Images of shares, made of channels of other images: each once, however many masks go by it.
//!
//! Not handled: images that hold the same texels and are not one.

use std::collections::HashMap;
use std::sync::Arc;

use crate::scene::textures::stored_image::{Channel, Image};

/// An image, which keeps its place as long as this is kept, and the shares that one of its channels gives.
type Made = (Arc<Image>, Arc<Image>);

/// Images of shares by the place and the channel of what they were made of.
#[derive(Default)]
pub(crate) struct ShareImages {
    known: HashMap<(*const Image, Channel), Made>,
}

impl ShareImages {
    /// The shares that a channel of an image gives.
    pub(crate) fn of(&mut self, image: &Arc<Image>, channel: Channel) -> Arc<Image> {
        let made = || (image.clone(), Arc::new(Image::shares(image.texels(), channel)));
        self.known.entry((Arc::as_ptr(image), channel)).or_insert_with(made).1.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pictures::Texels;

    #[test]
    fn a_channel_of_an_image_is_made_once() {
        let texels = |code: u8| Texels { width: 1, height: 1, channels: 2, codes: vec![code, 9] };
        let [a, b] = [7, 8].map(|code| Arc::new(Image::new(texels(code))));
        let mut images = ShareImages::default();
        let alpha = images.of(&a, Channel::Alpha);
        assert!(Arc::ptr_eq(&alpha, &images.of(&a, Channel::Alpha)));
        for other in [images.of(&b, Channel::Alpha), images.of(&a, Channel::Luminance)] {
            assert!(!Arc::ptr_eq(&alpha, &other));
        }
        assert_eq!(alpha.texels().codes, [9]);
    }
}
